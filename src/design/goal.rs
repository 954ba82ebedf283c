//! A goal: the object, what holds it, its cells, the palette, and the examples to behave like; read from `goal.toml` and
//! checked, so that what follows need not ask again.

use super::goal_text::{GoalText, PaletteText};
use super::rules::Rules;
use super::rules_text::read_rules;
use super::voxels::rules::{VoxelRules, VoxelsText, read_voxel_rules};
use crate::fem::example_text::read_examples;
use crate::fem::regions::read_cells;
use crate::fem::setup::{self, Object, Setup};
use crate::geometry::cells::Cells;
use crate::material::database::Database;
use crate::material::law::Law;
use crate::material::record::MaterialRecord;
use crate::math::mandel::Mandel;
use crate::units;
use crate::units::document::{Document, Mistake};
use std::path::{Path, PathBuf};
use toml::Spanned;

/// The version of `goal.toml` that this program reads.
pub const SCHEMA: u32 = 1;
/// More base materials than this make no sense for a tree.
const MOST_MATERIALS: usize = 64;

/// A checked goal.
#[derive(Clone, Debug)]
pub struct Goal {
    /// The object's name.
    pub name: String,
    /// The object, what holds it, its cells, and the examples.
    pub setup: Setup,
    /// The base materials.
    pub palette: Vec<BaseMaterial>,
    /// At most how many of them in one layout.
    pub most_materials: usize,
    /// What ties cells together, where a region is cut into voxels.
    pub voxels: Option<VoxelRules>,
    /// The thinnest layer that may be made \[mm\], if the goal says so.
    pub least_layer_mm: Option<f64>,
    /// What may touch what, lie on the surface, and what the whole may weigh and cost.
    pub rules: Rules,
}

/// A material of the palette with its law.
#[derive(Clone, Debug)]
pub struct BaseMaterial {
    /// The record.
    pub record: MaterialRecord,
    /// Its law, axis along z.
    pub law: Law,
}

/// Why there is no goal.
#[derive(Debug, thiserror::Error)]
pub enum GoalError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {reason}; name a folder that holds a goal.toml, or the file itself", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// Something in the file is wrong.
    #[error(transparent)]
    Mistake(#[from] Mistake),
}

impl Goal {
    /// Reads a goal. `place` is the file or the folder that holds `goal.toml`.
    ///
    /// # Errors
    /// [`GoalError`] names the file, the line, what was found and what was expected.
    pub fn read(place: &Path, database: &Database) -> Result<Goal, GoalError> {
        let file = if place.is_dir() {
            place.join("goal.toml")
        } else {
            place.to_path_buf()
        };
        let text = std::fs::read_to_string(&file).map_err(|e| GoalError::Read {
            file: file.clone(),
            reason: e.to_string(),
        })?;
        let document = Document {
            file: file.clone(),
            text,
        };
        let goal: GoalText = document.parse()?;
        if *goal.schema.get_ref() != SCHEMA {
            let message = format!("found schema {}, expected {SCHEMA}", goal.schema.get_ref());
            return Err(document.mistake(&goal.schema.span(), message).into());
        }
        let object = goal.object.read(&document)?;
        let palette = palette(&document, &goal.palette, database)?;
        let most_materials = most_materials(&document, &goal.palette, palette.len())?;
        let rules = read_rules(&document, &goal.palette, &palette)?;
        let cells = read_cells(
            &document,
            &goal.region,
            goal.palette.least_layer.as_ref(),
            &object,
        )?;
        let element_size_mm = cells.element_size_mm(goal.object.element_size_mm(&document, &object)?);
        let examples = read_examples(&document, &goal.example)?;
        let voxels = voxel_rules(&document, goal.voxels.as_ref(), &cells, &object, &palette)?;
        let least = goal.palette.least_layer.as_ref();
        let least_layer_mm = least.map(|l| setup::positive_length(&document, l)).transpose()?;
        let setup = Setup {
            document,
            object,
            fixed: goal.fixed,
            cells,
            element_size_mm,
            examples,
        };
        Ok(Goal {
            name: goal.name,
            setup,
            palette,
            most_materials,
            voxels,
            least_layer_mm,
            rules,
        })
    }

    /// The file that it was read from.
    pub fn file(&self) -> &Path {
        &self.setup.document.file
    }

    /// The folder of the goal's file.
    pub fn folder(&self) -> &Path {
        self.file().parent().unwrap_or(Path::new(""))
    }
}

/// The rules of `[voxels]`; none where no region is cut into voxels.
fn voxel_rules(
    document: &Document,
    text: Option<&Spanned<VoxelsText>>,
    cells: &Cells,
    object: &Object,
    palette: &[BaseMaterial],
) -> Result<Option<VoxelRules>, Mistake> {
    let ids: Vec<&str> = palette.iter().map(|m| m.record.id.as_str()).collect();
    match text {
        Some(text) if !cells.has_voxels() => {
            let message = "found [voxels] where no [[region]] has voxels or columns, expected one that does";
            Err(document.mistake(&text.span(), message))
        }
        Some(text) => read_voxel_rules(document, text.get_ref(), cells, &object.solid, &ids).map(Some),
        None => Ok(cells.has_voxels().then(|| VoxelRules::free(cells.count()))),
    }
}

fn palette(
    document: &Document,
    text: &PaletteText,
    database: &Database,
) -> Result<Vec<BaseMaterial>, Mistake> {
    let synthetic = text.synthetic.unwrap_or(false);
    let mut chosen = Vec::new();
    match &text.materials {
        Some(ids) => {
            for id in ids.get_ref() {
                let record = database
                    .find(id.get_ref())
                    .map_err(|e| document.mistake(&id.span(), e.to_string()))?;
                if record.synthetic && !synthetic {
                    let message = format!(
                        "material {:?} is synthetic (its numbers are estimated, not measured); set synthetic = true in [palette] to use it",
                        id.get_ref()
                    );
                    return Err(document.mistake(&id.span(), message));
                }
                let same = |r: &MaterialRecord| {
                    let base = r.id.split('@').next().unwrap_or_default();
                    (base, r.version) == (record.id.as_str(), record.version)
                };
                if chosen.iter().any(same) {
                    return Err(
                        document.mistake(&id.span(), format!("material {:?} stands twice", id.get_ref()))
                    );
                }
                // As the goal names it: two versions of one record are two materials.
                chosen.push(MaterialRecord {
                    id: id.get_ref().clone(),
                    ..record.clone()
                });
            }
        }
        None => chosen.extend(filtered(document, text, database, synthetic)?),
    }
    let span = text.materials.as_ref().map_or(0..0, Spanned::span);
    if chosen.is_empty() || chosen.len() > MOST_MATERIALS {
        let message = format!(
            "the palette holds {} materials, expected 1 to {MOST_MATERIALS}",
            chosen.len()
        );
        return Err(document.mistake(&span, message));
    }
    chosen
        .into_iter()
        .map(|record| {
            let law = record.law().map_err(|e| document.mistake(&span, e.to_string()))?;
            Ok(BaseMaterial { record, law })
        })
        .collect()
}

fn filtered(
    document: &Document,
    text: &PaletteText,
    database: &Database,
    synthetic: bool,
) -> Result<Vec<MaterialRecord>, Mistake> {
    let bound = |text: &Option<Spanned<String>>, open: f64| match text {
        None => Ok(open),
        Some(text) => setup::quantity(document, text, units::stress),
    };
    let (softest, stiffest) = (bound(&text.softest, 0.0)?, bound(&text.stiffest, f64::INFINITY)?);
    let known = ["isotropic", "transversely-isotropic"];
    if let Some(kind) = text
        .kind
        .as_ref()
        .filter(|k| !known.contains(&k.get_ref().as_str()))
    {
        let message = format!("found kind {:?}, expected one of {known:?}", kind.get_ref());
        return Err(document.mistake(&kind.span(), message));
    }
    let fits = |record: &&MaterialRecord| {
        let stiffness = record
            .law()
            .map(|law| law.young_modulus(&Mandel::zeros()))
            .unwrap_or(f64::NAN);
        (synthetic || !record.synthetic)
            && text
                .kind
                .as_ref()
                .is_none_or(|k| k.get_ref() == record.kind.word())
            && (!text.printable.unwrap_or(false) || record.printability.printable)
            && stiffness >= softest
            && stiffness <= stiffest
    };
    Ok(database.records().filter(fits).cloned().collect())
}

fn most_materials(document: &Document, text: &PaletteText, available: usize) -> Result<usize, Mistake> {
    match &text.most_materials {
        None => Ok(available),
        Some(most) if *most.get_ref() >= 1 => Ok((*most.get_ref()).min(available)),
        Some(most) => Err(document.mistake(&most.span(), "found 0, expected at least one material")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The commented example of `docs/formats.md`, beside the sole that it is written for.
    fn documented(changed: [&str; 2]) -> Result<Goal, GoalError> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let formats = include_str!("../../docs/formats.md");
        let (_, section) = formats.split_once("## The goal").unwrap();
        let (_, rest) = section.split_once("```toml\n").unwrap();
        let (example, _) = rest.split_once("```").unwrap();
        assert!(example.contains(changed[0]));
        let folder = tempfile::tempdir().unwrap();
        std::fs::copy(
            root.join("designs/flip-flop/sole.stl"),
            folder.path().join("sole.stl"),
        )
        .unwrap();
        std::fs::write(
            folder.path().join("goal.toml"),
            example.replace(changed[0], changed[1]),
        )
        .unwrap();
        Goal::read(
            folder.path(),
            &Database::open(&root.join("materials-db")).unwrap(),
        )
    }

    #[test]
    fn the_documented_example_is_a_goal() {
        let goal = documented(["", ""]).unwrap();
        assert_eq!((goal.setup.cells.count(), goal.palette.len()), (7, 3));
        assert_eq!(goal.setup.cells.name(0), "heel 1");
        assert_eq!(goal.setup.examples[0].forces_n.len(), 5);
    }

    #[test]
    fn mistakes_are_answered_with_their_line() {
        for (changed, message) in [
            (["layers = 4", "layers = 0"], "found 0 layers"),
            (["layers = 4", "layrs = 4"], "layrs"),
            (["\"2.5 mm\"", "\"9 mm\""], "least_layer"),
            (["\"2.5 mm\"", "\"2.5\""], "without a unit"),
            (["[6, 12, 18", "[6, 6, 18"], "rising"),
            (["\"ecoflex-00-50\"", "\"ecoflx-00-50\""], "ecoflex-00-50"),
            (["\"ecoflex-00-50\"", "\"tubes-fine-wide\""], "synthetic"),
        ] {
            let Err(GoalError::Mistake(mistake)) = documented(changed) else {
                panic!("{changed:?} is no mistake");
            };
            assert!(mistake.to_string().contains(message), "{mistake}");
            assert!(mistake.line > 1, "{mistake}");
        }
    }
}
