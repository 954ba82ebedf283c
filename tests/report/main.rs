//! A whole page from made-up results: well-formed, self-contained, the same twice. With `PLIANT_SAMPLE` set to a
//! folder, the page and its drawings are left there to be looked at.

mod shapes;

use pliant::geometry::surface::TriMesh;
use pliant::math::Vec3;
use pliant::report::bars::BarPlot;
use pliant::report::colour::Colour;
use pliant::report::layouts::{CellChoice, LayoutRow};
use pliant::report::page::{Fact, Figure, MaterialRow, ReplicatePage};
use pliant::report::picture::{ColouredPart, CutOpen, Marker, SurfaceMap};
use pliant::report::plot::{LinePlot, Series};
use pliant::report::raster::{Camera, Paint, Rendering, Shape, View, render};
use pliant::report::svg::Svg;

const MATERIALS: [(&str, &str, f64); 5] = [
    ("EcoFlex 00-30 + 50 % thinner", "#f4d9a8", 0.012),
    ("EcoFlex 00-50", "#e69f00", 0.083),
    ("Dragon Skin 20", "#56b4e9", 0.34),
    ("LEAP foam <medium>", "#c9c4bd", 0.21),
    ("Smooth-Sil 950", "#2a7f62", 1.9),
];

fn colour(index: usize) -> Colour {
    Colour::from_hex(MATERIALS[index].1).unwrap()
}

/// A softening curve: displacement under a force for a material of a stiffness.
fn curve(stiffness: f64, reach: f64) -> Vec<[f64; 2]> {
    (0..=20)
        .map(f64::from)
        .map(|force| [force, reach * (1.0 - (-force * 0.02 / stiffness).exp())])
        .collect()
}

fn example(title: &str, stiffness: f64) -> LinePlot {
    let target = curve(stiffness, 9.0).into_iter().skip(4).step_by(4).collect();
    let prediction = curve(stiffness * 1.04, 9.0);
    let band = prediction.iter().map(|[_, y]| [0.95 * y, 1.05 * y]).collect();
    let base = (0..MATERIALS.len()).map(|index| {
        Series::base_material(MATERIALS[index].0, curve(MATERIALS[index].2, 9.0), colour(index))
    });
    let prediction = Series::prediction("found layout", prediction).with_band(band);
    LinePlot::force_displacement(
        title,
        Series::target("target", target),
        prediction,
        base.collect(),
    )
}

fn layout(rank: Option<usize>, note: &str, cells: [usize; 6], rms_mm: f64) -> LayoutRow {
    let names = ["heel 1", "heel 2", "heel 3", "toe 1", "toe 2", "toe 3"];
    let choice = |(cell, index): (&str, usize)| CellChoice {
        cell: cell.to_owned(),
        material: MATERIALS[index].0.to_owned(),
        colour: colour(index),
    };
    LayoutRow {
        rank,
        note: note.to_owned(),
        cells: names.into_iter().zip(cells).map(choice).collect(),
        rms_mm,
        rms_percent: 100.0 * rms_mm / 5.4,
        max_mm: 2.1 * rms_mm,
        max_percent: 210.0 * rms_mm / 5.4,
        mass_g: Some(143.2 + rms_mm),
    }
}

fn page() -> ReplicatePage {
    let camera = Camera::three_quarter();
    let layers = shapes::cut_sole();
    let parts = layers.iter().enumerate().map(|(index, mesh)| ColouredPart {
        name: MATERIALS[[0, 4, 1][index % 3]].0.to_owned(),
        colour: colour([0, 4, 1][index % 3]),
        mesh,
    });
    let load = Marker::load(Vec3::new(10.0, 25.0, 21.0), -Vec3::z(), "heel, 20 N");
    let cut = CutOpen::new("The sole, cut open", parts.collect())
        .marked(vec![load.clone()])
        .picture(&camera)
        .unwrap();
    let whole = shapes::sole(0.0, 1.0, false);
    let values: Vec<f64> = whole.vertices.iter().map(shapes::error).collect();
    let other = Marker::point(Vec3::new(30.0, 200.0, 21.0), "toe");
    let map = SurfaceMap::new("Error", &whole, &values, "displacement error", "mm").marked(vec![load, other]);
    let bars = BarPlot::new("How close each layout comes", "RMS error [mm]")
        .with("found layout", 0.0673, Colour::qualitative(2))
        .with("best single material", 0.83, colour(1))
        .with("stiffest material throughout", 2.21, colour(4));
    ReplicatePage {
        title: "Flip-flop <script>alert(1)</script>".to_owned(),
        subtitle: "A made-up result, to see the page".to_owned(),
        summary:
            "The best layout follows the target to 0.067 mm RMS (1.2 % of the largest target displacement), \
                  twelve times closer than the best single material."
                .to_owned(),
        warnings: vec!["Materials marked synthetic were not measured.".to_owned()],
        object: vec![
            Fact::new("size", "240 × 90 × 21 mm"),
            Fact::new("volume", "312 cm³"),
            Fact::new("cells", 6),
            Fact::new("examples", "2, of 5 forces each"),
        ],
        layouts: vec![
            layout(Some(1), "", [0, 0, 4, 1, 1, 4], 0.0673),
            layout(Some(2), "", [0, 4, 4, 1, 2, 3], 0.0921),
            layout(None, "best single material", [1; 6], 0.83),
        ],
        pictures: vec![
            Figure::new(
                "cut",
                cut.svg(),
                "The layers of the best layout, cut along the middle.",
            ),
            Figure::new(
                "error",
                map.picture(&camera).unwrap().svg(),
                "Displacement error under the heel's load.",
            ),
        ],
        plots: vec![
            Figure::new(
                "Heel",
                example("Heel", 0.11).svg(),
                "A disc of 20 mm pressed into the heel.",
            ),
            Figure::new("Toe", example("Toe", 0.5).svg(), "The same at the toe."),
            Figure::new("bars", bars.svg(), ""),
        ],
        sections: Vec::new(),
        search: ["method", "seed", "K", "simulations", "culled", "time"]
            .into_iter()
            .zip([
                "branch and bound, breadth first",
                "7",
                "20",
                "1 204",
                "83 %",
                "2 min 5 s",
            ])
            .map(|(name, value)| Fact::new(name, value))
            .collect(),
        materials: (0..MATERIALS.len()).map(material).collect(),
        provenance: vec![
            Fact::new("pliant", "0.1.0"),
            Fact::new("goal", "goal.toml, sha256 1f6b…"),
        ],
    }
}

fn material(index: usize) -> MaterialRow {
    MaterialRow {
        id: format!("material-{index}"),
        name: MATERIALS[index].0.to_owned(),
        colour: colour(index),
        used: [0, 1, 4].contains(&index),
        kind: "isotropic".to_owned(),
        young_modulus: Some(MATERIALS[index].2),
        poisson_ratio: (index != 2).then_some(0.49),
        density: Some(1.07),
        source: "Compression of a cylinder of 29 mm, EcoFlex data set, CC BY 4.0".to_owned(),
    }
}

/// Every text node and attribute value, after a strict reading of the XML.
fn read(xml: &str) -> Vec<String> {
    use quick_xml::events::Event;
    let mut reader = quick_xml::Reader::from_str(xml);
    reader.config_mut().check_end_names = true;
    let mut texts = Vec::new();
    loop {
        match reader.read_event().expect("well-formed") {
            Event::Eof => return texts,
            Event::Text(text) => texts.push(text.to_string()),
            Event::Start(element) | Event::Empty(element) => {
                for attribute in element.attributes() {
                    texts.push(attribute.expect("an attribute").value.to_string());
                }
            }
            _ => {}
        }
    }
}

fn check_drawing(drawing: &Svg) {
    let mut texts = read(drawing.as_str());
    texts.retain(|text| !text.starts_with("data:"));
    assert!(texts.len() > 20);
    for text in texts {
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}

#[test]
fn drawings_are_well_formed_and_finite() {
    let page = page();
    for figure in page.pictures.iter().chain(&page.plots) {
        check_drawing(&figure.drawing);
    }
    let nothing = LinePlot::new("<empty> & \"odd\"", "", "").with(Series::target("a", vec![[f64::NAN, 1.0]]));
    read(nothing.svg().as_str());
    read(BarPlot::new("", "").svg().as_str());
}

#[test]
fn a_page_is_self_contained_and_the_same_twice() {
    let html = page().html();
    assert_eq!(html, page().html());
    assert!(html.contains("Flip-flop &lt;script&gt;") && !html.contains("<script"));
    for outside in ["src=", "<link", "@import", "url(", "https://"] {
        assert!(!html.contains(outside), "{outside}");
    }
    // The only address is the name of SVG's namespace; the only references are pictures within.
    assert_eq!(
        html.matches("http://").count(),
        html.matches("http://www.w3.org/2000/svg").count()
    );
    assert_eq!(
        html.matches("href=").count(),
        html.matches("href=\"data:image/png;base64,").count()
    );
    assert!(html.contains("LEAP foam &lt;medium&gt;"));
    if let Some(folder) = std::env::var_os("PLIANT_SAMPLE") {
        let folder = std::path::PathBuf::from(folder);
        std::fs::write(folder.join("page.html"), &html).unwrap();
        for (index, figure) in page().pictures.iter().chain(&page().plots).enumerate() {
            std::fs::write(
                folder.join(format!("figure-{index}.svg")),
                figure.drawing.as_str(),
            )
            .unwrap();
        }
    }
}

#[test]
fn a_scan_is_drawn_whole_and_the_same_twice() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../shared/data/objects/gensole_Left-Insole.stl"
    );
    let Some(mesh) = shapes::scan(path) else {
        println!("skipped: no {path}");
        return;
    };
    let view = View::fitted(Camera::three_quarter(), [&mesh], 800, 500, 10).unwrap();
    let shapes = [Shape {
        mesh: &mesh,
        paint: Paint::Uniform(colour(2)),
    }];
    let start = std::time::Instant::now();
    let image = render(&shapes, &view, Rendering::default());
    println!(
        "{} triangles in {:.3} s",
        mesh.triangles.len(),
        start.elapsed().as_secs_f64()
    );
    assert_eq!(image, render(&shapes, &view, Rendering::default()));
    let covered = image.rgba.chunks_exact(4).filter(|pixel| pixel[0] < 250).count();
    // An insole is long and narrow: from three quarters it fills between a tenth and nine tenths of its sheet.
    let share = covered as f64 / f64::from(image.size[0] * image.size[1]);
    assert!((0.1..0.9).contains(&share), "{share}");
    if let Some(folder) = std::env::var_os("PLIANT_SAMPLE") {
        std::fs::write(
            std::path::PathBuf::from(folder).join("scan.png"),
            image.png().unwrap(),
        )
        .unwrap();
    }
}

#[test]
fn three_hundred_thousand_triangles_are_drawn_once_each() {
    let mesh: TriMesh = shapes::sole(0.0, 1.0, true);
    assert!(mesh.triangles.len() > 300_000);
    let view = View::fitted(Camera::three_quarter(), [&mesh], 800, 500, 10).unwrap();
    let values: Vec<f64> = mesh.vertices.iter().map(shapes::error).collect();
    let start = std::time::Instant::now();
    let image = render(
        &[Shape {
            mesh: &mesh,
            paint: Paint::Values(&values, [0.0, 1.0]),
        }],
        &view,
        Rendering::default(),
    );
    println!(
        "{} triangles in {:.3} s",
        mesh.triangles.len(),
        start.elapsed().as_secs_f64()
    );
    // The middle of the sole is seen, the corners of the sheet are paper.
    let [x, y] = view.pixel(Vec3::new(0.0, 120.0, 21.0)).map(|pixel| pixel as u32);
    assert_ne!(image.pixel(x, y), Colour::rgb(255, 255, 255));
    assert_eq!(image.pixel(0, 0), Colour::rgb(255, 255, 255));
}
