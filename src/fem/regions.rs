//! `[[region]]` tables: an object's regions and layers as people write them, turned into cells.

use super::setup::{CylinderText, Object, ShapeText, positive_length};
use crate::geometry::axis::Axis;
use crate::geometry::cells::{Cells, LayeredRegion, Style};
use crate::geometry::heights::Heights;
use crate::geometry::region::Region;
use crate::geometry::solid::Solid;
use crate::math::Vec3;
use crate::units::document::{Document, Mistake};
use serde::Deserialize;
use toml::Spanned;

/// More cells than this make no sense for layers.
const MOST_LAYERS: usize = 256;
/// More cells than this are not searched, with voxels; cells are numbered by 16 bits.
const MOST_CELLS: usize = 50_000;
/// Most voxels along one axis.
const MOST_ALONG: usize = 256;

/// `[[region]]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionText {
    /// Its name.
    pub name: String,
    /// Two corners of a box \[mm\].
    pub box_mm: Option<Spanned<[[f64; 3]; 2]>>,
    /// A cylinder.
    pub cylinder: Option<Spanned<CylinderText>>,
    /// File of a closed surface.
    pub mesh: Option<Spanned<String>>,
    /// How many layers.
    pub layers: Option<Spanned<usize>>,
    /// How many cells along x, y and z.
    pub voxels: Option<Spanned<[usize; 3]>>,
    /// How many cells along the two axes across `along`, in the order of x, y, z.
    pub columns: Option<Spanned<[usize; 2]>>,
    /// The axis that the layers are stacked along; z if absent.
    pub along: Option<Axis>,
    /// How the layers are cut; "flat" if absent.
    pub style: Option<Spanned<Style>>,
}

impl RegionText {
    /// The keys that say where the region is.
    pub fn shape(&self) -> ShapeText {
        ShapeText {
            box_mm: self.box_mm.clone(),
            cylinder: self.cylinder.clone(),
            mesh: self.mesh.clone(),
        }
    }
}

/// The cells of an object, and their check: one follow axis, every point in a region, no layer below `least_layer`.
///
/// # Errors
/// [`Mistake`] at the region that is wrong.
pub fn read_cells(
    document: &Document,
    texts: &Spanned<Vec<RegionText>>,
    least_layer: Option<&Spanned<String>>,
    object: &Object,
) -> Result<Cells, Mistake> {
    let span = texts.span();
    let regions = texts.get_ref();
    if regions.is_empty() {
        return Err(document.mistake(&span, "found no [[region]], expected at least one"));
    }
    let follow: Vec<Axis> = regions
        .iter()
        .filter(|r| style(r) == Style::Follow)
        .map(along)
        .collect();
    if follow.windows(2).any(|pair| pair[0] != pair[1]) {
        let message =
            "regions follow the object's height along different axes, expected one axis for all of them";
        return Err(document.mistake(&span, message));
    }
    let heights = follow
        .first()
        .map(|&axis| Heights::new(&object.solid, axis, height_spacing(&object.solid)));
    let mut layered = Vec::new();
    for text in regions {
        layered.push(layered_region(document, text, object)?);
    }
    let cells = Cells::new(layered, heights);
    let most = if cells.has_voxels() {
        MOST_CELLS
    } else {
        MOST_LAYERS
    };
    if cells.count() > most {
        let message = format!("found {} cells in all, expected at most {most}", cells.count());
        return Err(document.mistake(&span, message));
    }
    check_cover(document, &span, &cells, &object.solid)?;
    if let Some(least) = least_layer {
        check_layers(document, least, regions, &cells, &object.solid)?;
    }
    Ok(cells)
}

/// Fine enough to follow a sole's edge, coarse enough for quick lookups.
fn height_spacing(solid: &Solid) -> f64 {
    let (low, high) = solid.bounds();
    (high - low).max() / 120.0
}

fn style(text: &RegionText) -> Style {
    text.style.as_ref().map_or(Style::Flat, |s| *s.get_ref())
}

fn along(text: &RegionText) -> Axis {
    text.along.unwrap_or(Axis::Z)
}

fn layered_region(document: &Document, text: &RegionText, object: &Object) -> Result<LayeredRegion, Mistake> {
    let axis = along(text);
    let (counts, span) = counts(document, text, axis)?;
    let region = text.shape().read(document, object.unit)?;
    let ends = |axis: Axis| match style(text) {
        Style::Follow if axis == along(text) => [0.0, 1.0],
        _ => extent(&region, axis, &object.solid),
    };
    let (a, b) = axis.others();
    let mut borders = [(); 3].map(|()| Vec::new());
    for (c, own) in [Axis::X, Axis::Y, Axis::Z].into_iter().enumerate() {
        if text.layers.is_some() && own != axis {
            continue;
        }
        let [from, to] = ends(own);
        if to <= from {
            let message = format!("region {:?} does not meet the object", text.name);
            return Err(document.mistake(&span, message));
        }
        borders[c] = (0..=counts[c])
            .map(|k| from + (to - from) * k as f64 / counts[c] as f64)
            .collect();
    }
    let across = match text.layers {
        Some(_) => Default::default(),
        None => [a, b].map(|c| std::mem::take(&mut borders[c])),
    };
    Ok(LayeredRegion {
        name: text.name.clone(),
        region,
        axis,
        style: style(text),
        borders: std::mem::take(&mut borders[axis.index()]),
        across,
    })
}

/// How many cells a region has along x, y and z, and where that is written.
fn counts(
    document: &Document,
    text: &RegionText,
    axis: Axis,
) -> Result<([usize; 3], std::ops::Range<usize>), Mistake> {
    let mut counts = [1; 3];
    match (&text.layers, &text.voxels, &text.columns) {
        (Some(layers), None, None) => {
            let (span, layers) = (layers.span(), *layers.get_ref());
            if !(1..=64).contains(&layers) {
                let message = format!("found {layers} layers, expected 1 to 64");
                return Err(document.mistake(&span, message));
            }
            counts[axis.index()] = layers;
            Ok((counts, span))
        }
        (None, Some(voxels), None) => {
            check_counts(document, voxels.get_ref(), &voxels.span(), "voxels")?;
            Ok((*voxels.get_ref(), voxels.span()))
        }
        (None, None, Some(columns)) => {
            check_counts(document, columns.get_ref(), &columns.span(), "columns")?;
            let across = (0..3).filter(|&c| c != axis.index());
            for (c, n) in across.zip(columns.get_ref()) {
                counts[c] = *n;
            }
            Ok((counts, columns.span()))
        }
        (None, None, None) => {
            let message = format!(
                "region {:?} is not cut into cells, expected layers = 4, columns = [20, 16] or voxels = [20, 16, 10]",
                text.name
            );
            Err(document.mistake(&(0..0), message))
        }
        (layers, voxels, columns) => {
            let spans = [
                columns.as_ref().map(Spanned::span),
                voxels.as_ref().map(Spanned::span),
                layers.as_ref().map(Spanned::span),
            ];
            let message = format!(
                "region {:?} is cut in two ways, expected one of layers, columns, voxels",
                text.name
            );
            Err(document.mistake(&spans.into_iter().flatten().next().unwrap_or(0..0), message))
        }
    }
}

fn check_counts(
    document: &Document,
    counts: &[usize],
    span: &std::ops::Range<usize>,
    key: &str,
) -> Result<(), Mistake> {
    if counts.iter().all(|n| (1..=MOST_ALONG).contains(n)) && counts.iter().product::<usize>() <= MOST_CELLS {
        return Ok(());
    }
    let message = format!(
        "found {key} = {counts:?}, expected 1 to {MOST_ALONG} along each axis and at most {MOST_CELLS} in all"
    );
    Err(document.mistake(span, message))
}

/// Where a region begins and ends inside the object along `axis`.
fn extent(region: &Region, axis: Axis, solid: &Solid) -> [f64; 2] {
    let (low, high) = solid.bounds();
    let w = axis.index();
    let (from, to) = match region {
        Region::Box { min, max } => (min[w], max[w]),
        Region::Cylinder {
            axis: own,
            centre,
            radius,
            range,
        } => {
            let (a, b) = own.others();
            if *own == axis {
                (range[0], range[1])
            } else {
                let c = if a == w {
                    centre[0]
                } else {
                    centre[usize::from(b == w)]
                };
                (c - radius, c + radius)
            }
        }
        Region::Mesh(own) => (own.bounds().0[w], own.bounds().1[w]),
        Region::Everything => (low[w], high[w]),
    };
    [from.max(low[w]), to.min(high[w])]
}

/// Every part of the object must belong to a region.
fn check_cover(
    document: &Document,
    span: &std::ops::Range<usize>,
    cells: &Cells,
    solid: &Solid,
) -> Result<(), Mistake> {
    let (low, high) = solid.bounds();
    let (mut inside, mut lost, mut first) = (0, 0, None);
    let n = 24;
    for k in 0..n * n * n {
        let at = |c: usize, i: usize| low[c] + (high[c] - low[c]) * (i as f64 + 0.5) / n as f64;
        let point = Vec3::new(at(0, k % n), at(1, k / n % n), at(2, k / n / n));
        if solid.contains(&point) {
            inside += 1;
            if cells.cell_at(&point).is_none() {
                lost += 1;
                first.get_or_insert(point);
            }
        }
    }
    let Some(point) = first else { return Ok(()) };
    Err(document.mistake(
        span,
        format!(
            "{:.0} % of the object lies in no region, for instance the point ({:.1}, {:.1}, {:.1}) mm; add a last [[region]] without a shape: it takes the rest",
            100.0 * lost as f64 / inside as f64,
            point.x,
            point.y,
            point.z
        ),
    ))
}

fn check_layers(
    document: &Document,
    least: &Spanned<String>,
    texts: &[RegionText],
    cells: &Cells,
    solid: &Solid,
) -> Result<(), Mistake> {
    let least_mm = positive_length(document, least)?;
    for (region, text) in cells.regions().iter().zip(texts) {
        let thinnest = cells.thinnest_layer(region, solid);
        if thinnest < least_mm {
            let layers = region.layers() as f64;
            let spans = [
                text.layers.as_ref().map(Spanned::span),
                text.voxels.as_ref().map(Spanned::span),
                text.columns.as_ref().map(Spanned::span),
            ];
            let span = spans.into_iter().flatten().next().unwrap_or(0..0);
            let message = format!(
                "{layers} layers in region {:?} are {thinnest:.2} mm thin, expected at least {least_mm} mm (least_layer): use at most {:.0}",
                text.name,
                (thinnest * layers / least_mm).floor().max(1.0)
            );
            return Err(document.mistake(&span, message));
        }
    }
    Ok(())
}
