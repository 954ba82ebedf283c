//! A folder with the block's mesh in it, and the binary run on scenes there.

use assert_cmd::Command;
use pliant::geometry::files::stl::write_stl;
use pliant::math::Vec3;
use serde_json::Value;
use std::path::{Path, PathBuf};

pub const DATABASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db");

/// A bar of 40 × 20 × 20 mm on rollers: its bottom rests on z = 0, its sides on x = 0 and y = 0, all free of friction.
pub const BAR: &str = r#"
schema = 1
[object]
mesh = "bar.stl"
unit = "mm"
element_size = "5 mm"
[[fixed]]
face = "bottom"
components = "z"
[[fixed]]
box_mm = [[-1, -1, -1], [0.1, 21, 21]]
components = "x"
[[fixed]]
box_mm = [[-1, -1, -1], [41, 0.1, 21]]
components = "y"
[[material]]
id = "rubber"
young = "0.3 MPa"
poisson = 0.3
[[region]]
name = "bar"
material = "rubber"
"#;

/// The same bar glued to its base and pressed in the middle.
pub const PRESSED: &str = r#"
schema = 1
[object]
mesh = "bar.stl"
unit = "mm"
element_size = "5 mm"
[[fixed]]
face = "bottom"
[[region]]
name = "bar"
material = "rubber"
[[material]]
id = "rubber"
young = "300 kPa"
poisson = 0.3
[[press]]
name = "middle"
point_mm = [20, 10, 20]
direction = [0, 0, -1]
radius = "6 mm"
forces_n = [1, 2, 4]
"#;

pub struct Bench {
    pub folder: tempfile::TempDir,
}

pub struct Run {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Bench {
    pub fn new() -> Bench {
        let folder = tempfile::tempdir().unwrap();
        let mesh = pliant::geometry::shapes::block(Vec3::new(40.0, 20.0, 20.0), 5.0).unwrap();
        let file = std::fs::File::create(folder.path().join("bar.stl")).unwrap();
        write_stl(&mesh, std::io::BufWriter::new(file)).unwrap();
        Bench { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        path
    }

    /// Simulates `scene`, written to `scene.toml`.
    pub fn simulate(&self, scene: &str, more: &[&str]) -> Run {
        let scene = self.write("scene.toml", scene);
        run(
            self.folder.path(),
            &[&["simulate", &scene.to_string_lossy()], more].concat(),
        )
    }

    /// What a scene that goes well leaves in `simulated.json`.
    pub fn record(&self, scene: &str) -> Value {
        let run = self.simulate(scene, &["--db", DATABASE]);
        assert_eq!(run.code, 0, "{}", run.err);
        self.simulated()
    }

    pub fn simulated(&self) -> Value {
        let text = std::fs::read_to_string(self.path("simulated/simulated.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    }
}

pub fn run(folder: &Path, arguments: &[&str]) -> Run {
    let output = Command::cargo_bin("pliant")
        .unwrap()
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Run {
        code: output.status.code().unwrap_or(-1),
        out: text(&output.stdout),
        err: text(&output.stderr),
    }
}

/// Every number below `value`, in order.
pub fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Number(x) => vec![x.as_f64().unwrap()],
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        Value::Object(map) => map.values().flat_map(numbers).collect(),
        _ => Vec::new(),
    }
}
