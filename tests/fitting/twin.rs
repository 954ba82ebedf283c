//! Twin experiments: a specimen whose material is known is simulated, its markers are read, and the readings are fitted.

use pliant::fem::elements::VolumetricStrain;
use pliant::fem::example::{Contact, MeasuredPoint};
use pliant::fem::measurement_set::{Experiment, MaterialCard, MeasurementSet, Origin};
use pliant::fem::specimen::Specimen;
use pliant::fitting::probe::centres::{Met, strains_met};
use pliant::fitting::probe::press::{Levels, PressedSpecimen};
use pliant::geometry::volume::VolumeMesh;
use pliant::material::law::Law;
use pliant::material::record::{Kind, Printability, Source};
use pliant::math::Vec3;
use pliant::units::document::Document;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A block `[0, size]`, held at its base, of Kuhn cells (six tetrahedra a cell), pressed on top and sides.
pub struct Block {
    pub size: Vec3,
    pub counts: [usize; 3],
    pub radius_mm: f64,
    /// Places on the surface as shares of the size, with directions.
    pub presses: Vec<(Vec3, Vec3)>,
    /// Forces of each press \[N\].
    pub forces: Vec<f64>,
    /// Markers along each edge of a face.
    pub markers: usize,
}

impl Block {
    /// Tilted presses at different places of the top, `n` of them, and levels up to `force`.
    pub fn standard(counts: [usize; 3], n: usize, levels: usize, force: f64) -> Block {
        let places = [
            [0.5, 0.5, 0.0, 0.0],
            [0.3, 0.35, 0.15, 0.1],
            [0.7, 0.6, -0.3, 0.2],
            [0.4, 0.7, 0.0, 0.45],
            [0.65, 0.3, 0.45, 0.0],
            [0.25, 0.6, -0.5, 0.3],
            [0.5, 0.25, 0.2, -0.5],
            [0.75, 0.75, 0.1, -0.2],
            [0.35, 0.5, -0.6, -0.2],
            [0.6, 0.5, 0.3, 0.6],
        ];
        let press = |p: &[f64; 4]| {
            (
                Vec3::new(p[0], p[1], 1.0),
                Vec3::new(p[2], p[3], -1.0).normalize(),
            )
        };
        Block {
            size: Vec3::new(50.0, 40.0, 25.0),
            counts,
            radius_mm: 8.0,
            presses: places.iter().take(n).map(press).collect(),
            forces: (1..=levels).map(|l| force * l as f64 / levels as f64).collect(),
            markers: 5,
        }
    }

    fn places(&self) -> Vec<Vec3> {
        let m = self.markers;
        let along = |k: usize| (k as f64 + 0.5) / m as f64;
        let mut places = Vec::new();
        for i in 0..m {
            for j in 0..m {
                places.push(Vec3::new(along(i), along(j), 1.0));
            }
            for z in [0.35, 0.75] {
                places.push(Vec3::new(along(i), 0.0, z));
                places.push(Vec3::new(along(i), 1.0, z));
                places.push(Vec3::new(0.0, along(i), z));
                places.push(Vec3::new(1.0, along(i), z));
            }
        }
        places.iter().map(|p| p.component_mul(&self.size)).collect()
    }

    /// The set without displacements.
    pub fn set(&self, kind: Kind, axis: Vec3) -> MeasurementSet {
        let mesh = VolumeMesh::cuboid(self.size, self.counts, true);
        let constrained = mesh.nodes.iter().map(|x| [x.z < 1e-9; 3]).collect();
        let levels = self.forces.len();
        let point = |place: &Vec3| MeasuredPoint {
            place: *place,
            directions: vec![Vec3::x(), Vec3::y(), Vec3::z()],
            displacements_mm: vec![vec![None; 3]; levels],
        };
        let points: Vec<MeasuredPoint> = self.places().iter().map(point).collect();
        let experiment = |(k, (place, direction)): (usize, &(Vec3, Vec3))| Experiment {
            name: format!("press {}", k + 1),
            contact: Contact {
                point: place.component_mul(&self.size),
                direction: *direction,
                radius_mm: self.radius_mm,
            },
            forces: self.forces.iter().map(|f| direction * *f).collect(),
            points: points.clone(),
            deviations_mm: vec![vec![0.01; levels]; points.len()],
            weight: 1.0,
            held_out: false,
        };
        MeasurementSet {
            document: Document {
                file: "twin.toml".into(),
                text: String::new(),
            },
            origin: Origin::Computed("twin".into()),
            material: card(kind, axis),
            mesh,
            volumetric: VolumetricStrain::Shared,
            constrained,
            experiments: self.presses.iter().enumerate().map(experiment).collect(),
        }
    }
}

fn card(kind: Kind, axis: Vec3) -> MaterialCard {
    MaterialCard {
        id: "twin".into(),
        name: "twin".into(),
        kind,
        axis,
        colour: "#808080".into(),
        density_g_per_cm3: 1.0,
        assumptions: Vec::new(),
        printability: Printability {
            printable: false,
            process: "none".into(),
        },
        source: Source {
            citation: "this test".into(),
            licence: "none".into(),
            link: None,
        },
    }
}

/// What a law does on a pressed.
pub struct Truth {
    pub equilibria: Vec<Levels>,
    pub met: Vec<Met>,
}

/// Simulates the truth and writes its readings, with normal noise of `noise` times the largest displacement of each level
/// on every component, into the presses.
pub fn measure(pressed: &mut PressedSpecimen, truth: &Law, noise: f64, seed: u64) -> Truth {
    let all: Vec<usize> = (0..pressed.presses.len()).collect();
    let equilibria = pressed
        .equilibria(truth, &all, &|| false)
        .expect("the block stands the truth");
    let met = strains_met(pressed, truth, &equilibria);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    for (press, levels) in pressed.presses.iter_mut().zip(&equilibria) {
        for (level, u) in levels.iter().enumerate() {
            let read = press.read(u);
            let size = read
                .chunks(3)
                .map(|x| Vec3::from_column_slice(x).norm())
                .fold(0.0, f64::max);
            let deviation = noise * size;
            let noisy = |x: &f64| Some(x + deviation * normal(&mut random));
            press.readings[level] = read.iter().map(noisy).collect();
            press.deviations[level] = vec![deviation.max(1e-3 * size); read.len()];
        }
    }
    Truth { equilibria, met }
}

/// Box and Muller.
pub fn normal(random: &mut impl Rng) -> f64 {
    let (a, b): (f64, f64) = (random.gen_range(1e-12..1.0), random.gen_range(0.0..1.0));
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// The pressed of a set.
pub fn pressed<'a>(set: &MeasurementSet, specimen: &'a Specimen) -> PressedSpecimen<'a> {
    PressedSpecimen::new(set, specimen)
}

/// Root mean square of the stress error over the strains that the truth met, by volume, as a share of that of the stress.
pub fn stress_error(law: &Law, truth: &Law, met: &[Met]) -> f64 {
    let (mut error, mut size) = (0.0, 0.0);
    for m in met {
        let stress = truth.stress(&m.strain);
        error += m.volume * (law.stress(&m.strain) - stress).norm_squared();
        size += m.volume * stress.norm_squared();
    }
    (error / size).sqrt()
}

/// Largest distance of two displacement fields at the last level of each press, as a share of the largest displacement.
pub fn displacement_error(a: &[Levels], b: &[Levels]) -> f64 {
    let (mut error, mut size) = (0.0f64, 0.0f64);
    for (a, b) in a.iter().zip(b) {
        let (Some(a), Some(b)) = (a.last(), b.last()) else {
            panic!("a press without levels");
        };
        for (a, b) in a.iter().zip(b) {
            error = error.max((a - b).norm());
            size = size.max(b.norm());
        }
    }
    error / size
}
