//! What a search leaves behind: `found/layout.toml`, enough to export or re-simulate the layout later without a search.

use super::goal::Goal;
use super::misfit::{Misfit, Target};
use super::pareto::Against;
use super::search::{Bound, Options, Outcome, Stop};
use crate::fem::planes::Planes;
use crate::fem::rig::Layout;
use crate::geometry::cells::{Cells, LayeredRegion};
use crate::units::whole_file::replace_file;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// The version of `layout.toml` that this program writes and reads.
pub const SCHEMA: u32 = 1;

/// The whole file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// Version of this format.
    pub schema: u32,
    /// The object's name.
    pub name: String,
    /// Version of pliant that searched.
    pub pliant: String,
    /// The goal's file, from the folder of this one.
    pub goal: String,
    /// SHA-256 of the goal's file, so that a changed goal is noticed.
    pub goal_sha256: String,
    /// The error of the layout.
    pub error: FoundError,
    /// What was searched and how.
    pub search: FoundSearch,
    /// The materials that the layout uses.
    pub material: Vec<FoundMaterial>,
    /// The cells of regions in layers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cell: Vec<FoundCell>,
    /// The cells of regions in voxels or columns.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub voxels: Vec<FoundVoxels>,
    /// Where layer borders were moved to; absent where they were not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness: Option<FoundThickness>,
    /// The next best layouts.
    #[serde(default)]
    pub runner_up: Vec<FoundLayout>,
    /// Error against mass or cost: the layouts that none beats in both.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pareto: Vec<FoundChoice>,
}

/// `[error]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundError {
    /// Root mean square displacement error \[mm\].
    pub rms_mm: f64,
    /// Largest displacement error \[mm\].
    pub max_mm: f64,
    /// The largest target displacement \[mm\], which percentages refer to.
    pub largest_target_mm: f64,
    /// RMS error of the best single material \[mm\].
    pub best_single_material_rms_mm: Option<f64>,
    /// That material's id.
    pub best_single_material: Option<String>,
    /// RMS error that is not exceeded with the probability of `quantile`, given how well the materials are known \[mm\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pessimistic_rms_mm: Option<f64>,
    /// That probability.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantile: Option<f64>,
}

/// `[search]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundSearch {
    /// Why it ended.
    pub stop: Stop,
    /// What no layout can be better than, and what that rests on.
    #[serde(default)]
    pub bound: Option<Bound>,
    /// The options, seed included.
    pub options: Options,
    /// Tolerance of each simulation.
    pub tolerance: f64,
    /// Edge length of the elements \[mm\].
    pub element_size_mm: f64,
    /// Ids of the palette.
    pub palette: Vec<String>,
    /// Layouts simulated.
    pub simulations: usize,
    /// Of these, without equilibrium under all loads.
    pub failed: usize,
    /// Nodes dropped by their bound.
    pub culled: usize,
    /// Nodes merged into a representative.
    pub merged: usize,
}

/// `[[material]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundMaterial {
    /// Id in the database.
    pub id: String,
    /// Name for people.
    pub name: String,
    /// Display colour, `#rrggbb`.
    pub colour: String,
    /// Is it synthetic?
    pub synthetic: bool,
}

/// `[[cell]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundCell {
    /// Name of the cell.
    pub name: String,
    /// Id of its material.
    pub material: String,
}

/// `[[voxels]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundVoxels {
    /// Name of the region.
    pub region: String,
    /// How many along x, y and z.
    pub counts: [usize; 3],
    /// One text for each step along z, from below: rows along y, the lowest first, with a blank between them; in a row one
    /// character for each voxel along x, the number of its `[[material]]` out of 0–9, a–z, A–Z, + and /.
    pub slices: Vec<String>,
}

/// The numbers of materials, one character each.
const DIGITS: &[u8; 64] = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ+/";

impl FoundVoxels {
    /// `own` holds the materials of the region's cells, as numbers among the layout's materials.
    fn new(region: &LayeredRegion, own: &[usize]) -> FoundVoxels {
        let [nx, ny, nz] = region.counts();
        let digit = |x, y, z| DIGITS[own[region.number([x, y, z])] % DIGITS.len()] as char;
        let row = |y, z| (0..nx).map(|x| digit(x, y, z)).collect::<String>();
        let slice = |z| (0..ny).map(|y| row(y, z)).collect::<Vec<_>>().join(" ");
        FoundVoxels {
            region: region.name.clone(),
            counts: region.counts(),
            slices: (0..nz).map(slice).collect(),
        }
    }

    /// The numbers of the cells' materials, in the region's order; `None` where texts and counts differ.
    fn numbers(&self, region: &LayeredRegion) -> Option<Vec<usize>> {
        let [nx, ny, nz] = region.counts();
        let mut numbers = vec![usize::MAX; region.count()];
        if self.region != region.name || self.counts != region.counts() || self.slices.len() != nz {
            return None;
        }
        for (z, slice) in self.slices.iter().enumerate() {
            let rows: Vec<&str> = slice.split(' ').collect();
            if rows.len() != ny || rows.iter().any(|row| row.len() != nx) {
                return None;
            }
            for (y, row) in rows.iter().enumerate() {
                for (x, c) in row.bytes().enumerate() {
                    numbers[region.number([x, y, z])] = DIGITS.iter().position(|&d| d == c)?;
                }
            }
        }
        Some(numbers)
    }
}

/// `[[runner_up]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundLayout {
    /// Id of each cell's material.
    pub materials: Vec<String>,
    /// Root mean square displacement error \[mm\].
    pub rms_mm: f64,
    /// Largest displacement error \[mm\].
    pub max_mm: f64,
    /// RMS error that is not exceeded with the probability of `error.quantile` \[mm\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pessimistic_rms_mm: Option<f64>,
}

/// `[thickness]`: layer borders that were moved. The runners-up have theirs as the goal draws them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundThickness {
    /// RMS error of the layout with the borders as drawn \[mm\].
    pub rms_before_mm: f64,
    /// The least thickness of a layer \[mm\].
    pub least_mm: f64,
    /// Names of the cells that are as thin as they may be.
    pub thinnest: Vec<String>,
    /// The regions, in the goal's order.
    pub region: Vec<FoundBorders>,
}

/// `[[thickness.region]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundBorders {
    /// Name of the region.
    pub name: String,
    /// Its borders from below, outer ones included, `(layers + 1)`: coordinates \[mm\], or shares of the object's height where the
    /// layers follow it.
    pub borders: Vec<f64>,
}

/// `[[pareto]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundChoice {
    /// What stands against the error.
    pub against: Against,
    /// Root mean square displacement error \[mm\].
    pub rms_mm: f64,
    /// Largest displacement error \[mm\].
    pub max_mm: f64,
    /// Mass of the object \[g\].
    pub mass_g: f64,
    /// Its cost, where the goal names prices.
    pub cost: Option<f64>,
    /// The currency.
    pub currency: Option<String>,
    /// Id of each cell's material; with voxels of each material once.
    pub materials: Vec<String>,
}

/// Why a layout file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FoundFileError {
    /// It cannot be read.
    #[error("{}: cannot be read: {reason}; `pliant replicate` makes it", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system or the parser said.
        reason: String,
    },
    /// It cannot be written.
    #[error("{}: cannot be written: {reason}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// It does not fit the goal.
    #[error("{}: {reason}; run `pliant replicate` again", file.display())]
    Stale {
        /// The file.
        file: PathBuf,
        /// What differs.
        reason: String,
    },
}

impl FoundMaterial {
    /// Material `m` of the goal's palette.
    fn of(goal: &Goal, m: u8) -> FoundMaterial {
        let record = &goal.palette[m as usize].record;
        FoundMaterial {
            id: record.id.clone(),
            name: record.name.clone(),
            colour: record.colour.clone(),
            synthetic: record.synthetic,
        }
    }
}

impl Found {
    /// The record of a search; `None` if it found nothing.
    pub fn new(
        goal: &Goal,
        target: &Target,
        outcome: &Outcome,
        options: &Options,
        tolerance: f64,
    ) -> Option<Found> {
        let best = outcome.best.first()?;
        let id = |m: u8| goal.palette[m as usize].record.id.clone();
        let mut used: Vec<u8> = best.layout.clone();
        used.sort_unstable();
        used.dedup();
        let material = used.iter().map(|&m| FoundMaterial::of(goal, m)).collect();
        let mut cell = Vec::new();
        let mut voxels = Vec::new();
        let cells = &goal.setup.cells;
        for (region, &first) in cells.regions().iter().zip(cells.first_cells()) {
            let own = first..first + region.count();
            if region.is_voxels() {
                let number = |&m: &u8| used.iter().position(|&u| u == m).unwrap_or(0);
                let numbers: Vec<usize> = best.layout[own].iter().map(number).collect();
                voxels.push(FoundVoxels::new(region, &numbers));
            } else {
                cell.extend(own.map(|c| FoundCell {
                    name: cells.name(c),
                    material: id(best.layout[c]),
                }));
            }
        }
        let runner_up = outcome.best[1..]
            .iter()
            .map(|r| FoundLayout {
                materials: r.layout.iter().map(|&m| id(m)).collect(),
                rms_mm: r.misfit.rms_mm,
                max_mm: r.misfit.max_mm,
                pessimistic_rms_mm: None,
            })
            .collect();
        let uniform = outcome.best_uniform.as_ref();
        Some(Found {
            schema: SCHEMA,
            name: goal.name.clone(),
            pliant: env!("CARGO_PKG_VERSION").into(),
            goal: goal_from_found(goal),
            goal_sha256: sha256(goal.setup.document.text.as_bytes()),
            error: FoundError {
                rms_mm: best.misfit.rms_mm,
                max_mm: best.misfit.max_mm,
                largest_target_mm: target.largest_mm(),
                best_single_material_rms_mm: uniform.map(|u| u.misfit.rms_mm),
                best_single_material: uniform.map(|u| id(u.layout[0])),
                pessimistic_rms_mm: None,
                quantile: None,
            },
            search: FoundSearch {
                stop: outcome.stop,
                bound: Some(outcome.bound),
                options: *options,
                tolerance,
                element_size_mm: goal.setup.element_size_mm,
                palette: goal.palette.iter().map(|m| m.record.id.clone()).collect(),
                simulations: outcome.simulations,
                failed: outcome.failed,
                culled: outcome.culled,
                merged: outcome.merged,
            },
            material,
            cell,
            voxels,
            thickness: None,
            runner_up,
            pareto: Vec::new(),
        })
    }

    /// Reads a layout file.
    ///
    /// # Errors
    /// [`FoundFileError::Read`]: missing, not TOML, or of another version.
    pub fn read(file: &Path) -> Result<Found, FoundFileError> {
        let fail = |reason: String| FoundFileError::Read {
            file: file.to_path_buf(),
            reason,
        };
        let text = std::fs::read_to_string(file).map_err(|e| fail(e.to_string()))?;
        let found: Found = toml::from_str(&text).map_err(|e| fail(e.to_string()))?;
        if found.schema != SCHEMA {
            return Err(fail(format!(
                "schema {} where {SCHEMA} was expected",
                found.schema
            )));
        }
        Ok(found)
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// [`FoundFileError::Write`].
    pub fn write(&self, file: &Path) -> Result<(), FoundFileError> {
        let fail = |reason: String| FoundFileError::Write {
            file: file.to_path_buf(),
            reason,
        };
        let text = toml::to_string(self).map_err(|e| fail(e.to_string()))?;
        let head = "# Written by `pliant replicate`. `pliant export` and `pliant simulate` read it.\n";
        replace_file(file, format!("{head}{text}").as_bytes()).map_err(|e| fail(e.to_string()))
    }

    /// The goal with its layer borders where this layout has them.
    ///
    /// # Errors
    /// [`FoundFileError::Stale`] if its regions or layers are others.
    pub fn on(&self, mut goal: Goal, file: &Path) -> Result<Goal, FoundFileError> {
        let Some(thickness) = &self.thickness else {
            return Ok(goal);
        };
        let stale = |reason: String| FoundFileError::Stale {
            file: file.to_path_buf(),
            reason,
        };
        let cells = &goal.setup.cells;
        let names: Vec<&String> = cells.regions().iter().map(|r| &r.name).collect();
        let own: Vec<&String> = thickness.region.iter().map(|r| &r.name).collect();
        if own != names {
            return Err(stale(format!(
                "[[thickness.region]] names {own:?} where the goal has {names:?}"
            )));
        }
        let borders: Vec<Vec<f64>> = thickness.region.iter().map(|r| r.borders.clone()).collect();
        let moved = cells
            .moved(&borders)
            .map_err(|e| stale(format!("[[thickness.region]]: {e}")))?;
        Planes::of(&goal.setup.object.solid, &moved)
            .map_err(|e| stale(format!("[[thickness.region]]: {e}")))?;
        goal.setup.cells = moved;
        Ok(goal)
    }

    /// The layout in terms of the goal's palette, and its error as the search found it.
    ///
    /// # Errors
    /// [`FoundFileError::Stale`] if the goal has changed since.
    pub fn layout(&self, goal: &Goal, file: &Path) -> Result<(Layout, Misfit), FoundFileError> {
        let stale = |reason: String| FoundFileError::Stale {
            file: file.to_path_buf(),
            reason,
        };
        if self.goal_sha256 != sha256(goal.setup.document.text.as_bytes()) {
            return Err(stale(format!(
                "{} has changed since this layout was found",
                goal.file().display()
            )));
        }
        let place = |id: &str| goal.palette.iter().position(|m| m.record.id == id);
        let ids = self
            .materials_of_cells(&goal.setup.cells)
            .ok_or_else(|| stale("its cells are not those of the goal".into()))?;
        let layout = ids
            .into_iter()
            .map(|id| place(id).map(|m| m as u8))
            .collect::<Option<Layout>>()
            .ok_or_else(|| stale("it uses a material that the goal's palette does not hold".into()))?;
        Ok((
            layout,
            Misfit {
                rms_mm: self.error.rms_mm,
                max_mm: self.error.max_mm,
            },
        ))
    }
}

impl Found {
    /// Ids of the materials of all cells, in order; `None` if these are not the cells of the record.
    fn materials_of_cells(&self, cells: &Cells) -> Option<Vec<&str>> {
        let mut ids = Vec::with_capacity(cells.count());
        let mut layers = self.cell.iter();
        let mut voxels = self.voxels.iter();
        for region in cells.regions() {
            if region.is_voxels() {
                for number in voxels.next()?.numbers(region)? {
                    ids.push(self.material.get(number)?.id.as_str());
                }
            } else {
                for _ in 0..region.count() {
                    ids.push(layers.next()?.material.as_str());
                }
            }
        }
        (layers.next().is_none() && voxels.next().is_none()).then_some(ids)
    }
}

fn goal_from_found(goal: &Goal) -> String {
    let name = goal
        .file()
        .file_name()
        .map_or("goal.toml".into(), |n| n.to_string_lossy());
    format!("../{name}")
}

/// Lower-case hexadecimal SHA-256.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}
