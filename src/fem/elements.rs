//! Integration points: where an element samples the deformation gradient.
//!
//! ```text
//! F = I + Σ_a u_a ⊗ ∇N_a
//! ```
//!
//! Hexahedra have eight Gauss points with trilinear shape functions; a tetrahedron is one point with constant
//! gradients; a Kuhn cell is its six tetrahedra taken as one element of eight nodes. A point's weight is the volume it
//! stands for, times the share of that volume that lies inside the object.
//!
//! Points that share one volumetric strain (see [`super::forces`]) form a *cluster*: the points of a hexahedron or of a
//! Kuhn cell, or, for tetrahedra, a patch of up to eight neighbours ([`super::patches`]). Without sharing, each element
//! is a cluster of its own. For speed, points lie side by side in *batches* of eight; a cluster that shares fills one.

use super::patches::Patches;
use crate::geometry::volume::{CORNERS, Elements, KUHN, VolumeMesh};
use crate::material::law::Law;
use crate::math::polar_lanes::{Lanes, ZERO};
use crate::math::{Mat3, Vec3};

/// Points in a batch.
pub const BATCH: usize = 8;
/// Stands for no point in a batch that is not full.
pub const NO_POINT: u32 = u32::MAX;

/// Whether points share one volumetric strain, the remedy against locking near incompressibility.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumetricStrain {
    /// Every point has its own.
    Pointwise,
    /// One in each hexahedron or Kuhn cell, and in each patch of tetrahedra.
    Shared,
}

/// Poisson's ratio above which plain tetrahedra lock noticeably: at 0.45 the bulk modulus is ten times the shear modulus.
pub const LOCKING_POISSON: f64 = 0.45;

impl VolumetricStrain {
    /// What `elements` of the materials `laws` need: hexahedra and Kuhn cells always share, tetrahedra where a material's
    /// Poisson's ratio at rest is above [`LOCKING_POISSON`].
    pub fn suited<'a>(elements: &Elements, laws: impl IntoIterator<Item = &'a Law>) -> VolumetricStrain {
        let is_plain = matches!(elements, Elements::Tetrahedra(_));
        let locks = |law: &Law| law.poisson_ratio_at_rest() > LOCKING_POISSON;
        if is_plain && !laws.into_iter().any(locks) {
            return VolumetricStrain::Pointwise;
        }
        VolumetricStrain::Shared
    }
}

/// One place where strain and stress live.
#[derive(Clone, Debug)]
pub struct IntegrationPoint<const N: usize> {
    /// Gradients of the shape functions in the undeformed object, `(N × 3)` \[1/mm\].
    pub gradients: [Vec3; N],
    /// Volume that the point stands for \[mm³\].
    pub weight: f64,
}

/// Eight points side by side.
#[derive(Clone, Debug)]
pub struct Batch<const N: usize> {
    /// The points' numbers, `(8)`; [`NO_POINT`] where there is none.
    pub points: [u32; BATCH],
    /// Gradients, `(N × 3 × 8)` \[1/mm\]; zero where there is no point.
    pub gradients: [[Lanes; 3]; N],
    /// Volumes, `(8)` \[mm³\]; zero where there is no point.
    pub weight: Lanes,
}

/// All elements of one kind with `N` nodes each.
#[derive(Clone, Debug)]
pub struct Block<const N: usize> {
    /// Nodes of each element.
    pub nodes: Vec<[u32; N]>,
    /// Points of all elements, those of one element together.
    pub points: Vec<IntegrationPoint<N>>,
    /// How many points an element has.
    pub points_per_element: usize,
    /// Do the points of a cluster share one volumetric strain?
    pub volumetric: VolumetricStrain,
    /// The patches, where tetrahedra share.
    pub patches: Option<Patches>,
    /// The points again, eight by eight.
    pub batches: Vec<Batch<N>>,
}

/// A mesh's elements with their points.
#[derive(Clone, Debug)]
pub enum Discretisation {
    /// Hexahedra and Kuhn cells.
    Eight(Block<8>),
    /// Tetrahedra.
    Four(Block<4>),
}

/// An element that cannot carry strain.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("element {element} near ({x:.2}, {y:.2}, {z:.2}) mm is flat or inside out in the undeformed mesh (volume {volume_mm3:.3e} mm³): mend the mesh", x = place.x, y = place.y, z = place.z)]
pub struct BadElement {
    /// Number of the element, from 0.
    pub element: usize,
    /// Its first node's position \[mm\].
    pub place: Vec3,
    /// The volume that one of its points stands for \[mm³\].
    pub volume_mm3: f64,
}

impl Discretisation {
    /// The points of `mesh`, hexahedra and Kuhn cells with one volumetric strain each, tetrahedra without;
    /// `fill`, `(points)`, is the share of each point's volume inside the object, all if `None`.
    ///
    /// # Errors
    /// [`BadElement`] for an element of no or negative volume.
    pub fn new(mesh: &VolumeMesh, fill: Option<&[f64]>) -> Result<Discretisation, BadElement> {
        let volumetric = match mesh.elements {
            Elements::Tetrahedra(_) => VolumetricStrain::Pointwise,
            _ => VolumetricStrain::Shared,
        };
        Discretisation::with(mesh, fill, volumetric, None)
    }

    /// The points of `mesh` with volumetric strains as asked; patches of tetrahedra stay inside one of the
    /// `regions`, `(elements)`, if those are given.
    ///
    /// # Errors
    /// [`BadElement`] for an element of no or negative volume.
    pub fn with(
        mesh: &VolumeMesh,
        fill: Option<&[f64]>,
        volumetric: VolumetricStrain,
        regions: Option<&[u16]>,
    ) -> Result<Discretisation, BadElement> {
        let mut result = match &mesh.elements {
            Elements::Hexahedra(cells) => {
                Discretisation::Eight(block(&mesh.nodes, cells, 8, |corners, points| {
                    points.extend(gauss_points().map(|at| hexahedron_point(corners, &at)));
                })?)
            }
            Elements::KuhnCells(cells) => {
                Discretisation::Eight(block(&mesh.nodes, cells, 6, |corners, points| {
                    points.extend(KUHN.iter().map(|tet| kuhn_point(corners, tet)));
                })?)
            }
            Elements::Tetrahedra(tets) => {
                Discretisation::Four(block(&mesh.nodes, tets, 1, |corners, points| {
                    let (gradients, weight) = tetrahedron(corners);
                    points.push(IntegrationPoint { gradients, weight });
                })?)
            }
        };
        match &mut result {
            Discretisation::Eight(b) => b.finish(fill, volumetric, None),
            Discretisation::Four(b) => {
                let patches = match volumetric {
                    VolumetricStrain::Shared => Some(Patches::new(&b.nodes, regions)),
                    VolumetricStrain::Pointwise => None,
                };
                b.finish(fill, volumetric, patches);
            }
        }
        Ok(result)
    }

    /// Number of clusters: elements, or patches where tetrahedra share.
    pub fn clusters(&self) -> usize {
        match self {
            Discretisation::Eight(b) => b.clusters(),
            Discretisation::Four(b) => b.clusters(),
        }
    }

    /// The nodes of cluster `c`, each once.
    pub fn nodes_of_cluster(&self, c: usize) -> &[u32] {
        match self {
            Discretisation::Eight(b) => b.nodes_of_cluster(c),
            Discretisation::Four(b) => b.nodes_of_cluster(c),
        }
    }

    /// How many points an element has.
    pub fn points_per_element(&self) -> usize {
        match self {
            Discretisation::Eight(b) => b.points_per_element,
            Discretisation::Four(b) => b.points_per_element,
        }
    }

    /// How many points there are.
    pub fn points(&self) -> usize {
        match self {
            Discretisation::Eight(b) => b.points.len(),
            Discretisation::Four(b) => b.points.len(),
        }
    }

    /// The volume that point `q` stands for \[mm³\].
    pub fn weight(&self, q: usize) -> f64 {
        match self {
            Discretisation::Eight(b) => b.points[q].weight,
            Discretisation::Four(b) => b.points[q].weight,
        }
    }
}

/// Reference coordinates of the eight Gauss points in [−1, 1]³, in the order of the nodes they are next to.
pub fn gauss_points() -> [Vec3; 8] {
    let g = 1.0 / 3.0_f64.sqrt();
    CORNERS.map(|c| c * g)
}

/// Values of the trilinear shape functions at the reference coordinates `at`, `(8)`.
pub fn trilinear(at: &Vec3) -> [f64; 8] {
    CORNERS.map(|c| 0.125 * (1.0 + c.x * at.x) * (1.0 + c.y * at.y) * (1.0 + c.z * at.z))
}

fn block<const N: usize>(
    nodes: &[Vec3],
    cells: &[[u32; N]],
    points_per_element: usize,
    sample: impl Fn(&[Vec3; N], &mut Vec<IntegrationPoint<N>>),
) -> Result<Block<N>, BadElement> {
    let mut points = Vec::with_capacity(cells.len() * points_per_element);
    for (element, cell) in cells.iter().enumerate() {
        let corners = cell.map(|i| nodes[i as usize]);
        let start = points.len();
        sample(&corners, &mut points);
        if let Some(bad) = points[start..]
            .iter()
            .find(|p| p.weight.is_nan() || p.weight <= 0.0)
        {
            return Err(BadElement {
                element,
                place: corners[0],
                volume_mm3: bad.weight,
            });
        }
    }
    Ok(Block {
        nodes: cells.to_vec(),
        points,
        points_per_element,
        volumetric: VolumetricStrain::Pointwise,
        patches: None,
        batches: Vec::new(),
    })
}

impl<const N: usize> Block<N> {
    /// Applies the fill and lays the points side by side.
    fn finish(&mut self, fill: Option<&[f64]>, volumetric: VolumetricStrain, patches: Option<Patches>) {
        if let Some(fill) = fill {
            for (point, fill) in self.points.iter_mut().zip(fill) {
                point.weight *= fill;
            }
        }
        self.volumetric = volumetric;
        self.patches = patches;
        let count = self.points.len() as u32;
        let per = self.points_per_element as u32;
        let groups: Vec<Vec<u32>> = match (&self.patches, per) {
            (Some(patches), _) => (0..patches.len()).map(|p| patches.elements(p).to_vec()).collect(),
            (None, 1) => (0..count.div_ceil(BATCH as u32))
                .map(|b| (b * BATCH as u32..((b + 1) * BATCH as u32).min(count)).collect())
                .collect(),
            (None, _) => (0..count / per)
                .map(|e| (e * per..(e + 1) * per).collect())
                .collect(),
        };
        self.batches = groups
            .iter()
            .map(|points| side_by_side(&self.points, points))
            .collect();
    }

    /// Elements of this block again, each as often as `copies` name it, with their points' volumes times a factor. Only
    /// where each element is a cluster and fills a batch.
    pub(super) fn copied(&self, copies: &[(usize, f64)]) -> Block<N> {
        let per = self.points_per_element;
        let mut result = Block {
            nodes: copies.iter().map(|&(e, _)| self.nodes[e]).collect(),
            points: Vec::with_capacity(copies.len() * per),
            points_per_element: per,
            volumetric: self.volumetric,
            patches: None,
            batches: Vec::with_capacity(copies.len()),
        };
        for &(e, factor) in copies {
            let first = result.points.len() as u32;
            let own = self.points[e * per..(e + 1) * per].iter().cloned();
            result.points.extend(own.map(|p| IntegrationPoint {
                weight: p.weight * factor,
                ..p
            }));
            let mut batch = self.batches[e].clone();
            for l in 0..per {
                batch.points[l] = first + l as u32;
                batch.weight[l] *= factor;
            }
            result.batches.push(batch);
        }
        result
    }

    /// Number of clusters.
    #[inline]
    pub fn clusters(&self) -> usize {
        self.patches.as_ref().map_or(self.nodes.len(), Patches::len)
    }

    /// The nodes of cluster `c`, each once.
    #[inline]
    pub fn nodes_of_cluster(&self, c: usize) -> &[u32] {
        match &self.patches {
            Some(patches) => patches.nodes(c),
            None => &self.nodes[c],
        }
    }

    /// The points of cluster `c`, each with the places of its element's nodes among those of the cluster.
    #[inline]
    pub fn points_of_cluster(&self, c: usize) -> impl Iterator<Item = (usize, [usize; N])> + '_ {
        let n = self.points_per_element;
        let (patch, own) = match &self.patches {
            Some(patches) => (patches.elements(c), 0..0),
            None => (&[][..], c * n..(c + 1) * n),
        };
        let in_patch = patch.iter().enumerate().map(move |(k, &e)| {
            let places = self.patches.as_ref().map_or(&[][..], |p| p.places(c, k));
            (e as usize, std::array::from_fn(|a| places[a] as usize))
        });
        in_patch.chain(own.map(|q| (q, std::array::from_fn(|a| a))))
    }

    /// The element of point `q`.
    #[inline]
    pub fn element_of(&self, q: usize) -> usize {
        q / self.points_per_element
    }
}

fn side_by_side<const N: usize>(all: &[IntegrationPoint<N>], numbers: &[u32]) -> Batch<N> {
    let mut batch = Batch {
        points: [NO_POINT; BATCH],
        gradients: [[ZERO; 3]; N],
        weight: ZERO,
    };
    for (l, &q) in numbers.iter().enumerate() {
        let point = &all[q as usize];
        batch.points[l] = q;
        batch.weight[l] = point.weight;
        for (a, g) in point.gradients.iter().enumerate() {
            for c in 0..3 {
                batch.gradients[a][c][l] = g[c];
            }
        }
    }
    batch
}

fn hexahedron_point(corners: &[Vec3; 8], at: &Vec3) -> IntegrationPoint<8> {
    let local = CORNERS.map(|c| {
        let (x, y, z) = (1.0 + c.x * at.x, 1.0 + c.y * at.y, 1.0 + c.z * at.z);
        0.125 * Vec3::new(c.x * y * z, c.y * x * z, c.z * x * y)
    });
    let mut jacobian = Mat3::zeros();
    for (x, g) in corners.iter().zip(&local) {
        jacobian += x * g.transpose();
    }
    let weight = jacobian.determinant();
    let inverse = jacobian.try_inverse().unwrap_or_else(Mat3::zeros);
    IntegrationPoint {
        gradients: local.map(|g| inverse.tr_mul(&g)),
        weight,
    }
}

fn kuhn_point(corners: &[Vec3; 8], tet: &[usize; 4]) -> IntegrationPoint<8> {
    let (own, weight) = tetrahedron(&tet.map(|i| corners[i]));
    let mut gradients = [Vec3::zeros(); 8];
    for (&i, g) in tet.iter().zip(own) {
        gradients[i] = g;
    }
    IntegrationPoint { gradients, weight }
}

/// Gradients of the barycentric coordinates \[1/mm\] and the volume \[mm³\] of a tetrahedron.
fn tetrahedron(corners: &[Vec3; 4]) -> ([Vec3; 4], f64) {
    let [a, b, c] = [1, 2, 3].map(|i| corners[i] - corners[0]);
    let six_volumes = a.dot(&b.cross(&c));
    let [ga, gb, gc] = [b.cross(&c), c.cross(&a), a.cross(&b)].map(|g| g / six_volumes);
    ([-(ga + gb + gc), ga, gb, gc], six_volumes / 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn skewed(tetrahedra: bool) -> VolumeMesh {
        let mut mesh = VolumeMesh::cuboid(Vec3::new(3.0, 2.0, 4.0), [3, 2, 2], tetrahedra);
        for (i, x) in mesh.nodes.iter_mut().enumerate() {
            let t = i as f64;
            *x += 0.12 * Vec3::new((3.1 * t).sin(), (1.7 * t).cos(), (2.3 * t).sin());
        }
        mesh
    }

    fn check_linear_field<const N: usize>(mesh: &VolumeMesh, block: &Block<N>) {
        let slope = Mat3::new(0.1, -0.2, 0.3, 0.05, 0.4, -0.1, 0.2, 0.15, -0.3);
        for (e, nodes) in block.nodes.iter().enumerate() {
            let n = block.points_per_element;
            for point in &block.points[e * n..(e + 1) * n] {
                let mut gradient = Mat3::zeros();
                for (&i, g) in nodes.iter().zip(&point.gradients) {
                    gradient += (slope * mesh.nodes[i as usize]) * g.transpose();
                }
                assert!((gradient - slope).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn linear_fields_have_their_exact_gradient_on_skewed_elements() {
        for mesh in [skewed(false), skewed(true)] {
            match Discretisation::new(&mesh, None).unwrap() {
                Discretisation::Eight(block) => check_linear_field(&mesh, &block),
                Discretisation::Four(block) => check_linear_field(&mesh, &block),
            }
        }
    }

    #[test]
    fn weights_add_up_to_the_volume_and_inverted_cells_are_named() {
        let mut mesh = VolumeMesh::cuboid(Vec3::new(3.0, 2.0, 4.0), [3, 2, 2], false);
        let points = Discretisation::new(&mesh, None).unwrap();
        let volume: f64 = (0..points.points()).map(|q| points.weight(q)).sum();
        assert!((volume - 24.0).abs() < 1e-12);
        mesh.nodes[0].x = 5.0;
        assert_eq!(Discretisation::new(&mesh, None).unwrap_err().element, 0);
    }
}
