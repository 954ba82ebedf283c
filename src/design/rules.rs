//! From the rules of a goal and its object on the bench to the layouts that may be built.
//!
//! ```text
//! V_c = V Σ_{q in c} w_q / Σ_q w_q
//! ```
//!
//! Symbols: V_c volume of cell c, V the object's own from its surface \[cm³\], w_q volume of integration point q inside the
//! object. So the cells add up to the object exactly; each is as accurate as the grid's share of it.
//!
//! *Which cells touch.* Each hexahedron holds eight octants, one for each node. Two octants touch if they lie side by side in a
//! hexahedron, or on the two sides of a face; cells touch if octants of theirs do that both hold some of the object. Cells
//! that meet in an edge or a corner alone do not touch.
//!
//! *Which cells lie on the surface.* Each triangle of the surface is cut into pieces smaller than an element, and the cell
//! just under the middle of each piece gets its area. A piece faces the top if its normal is within 60° of the layer axis, the
//! bottom if within 60° of the other way, a side otherwise.

use super::goal::Goal;
use super::space::Space;
use crate::fem::rig::Rig;
use crate::geometry::axis::Axis;
use crate::geometry::surface::area_vector;
use crate::geometry::volume::CORNERS;
use crate::units::document::Mistake;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// A side of the object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// Towards the upper end of the layer axis.
    Top,
    /// Towards its lower end.
    Bottom,
    /// What is neither.
    Sides,
    /// All of the surface.
    Outside,
}

impl Face {
    fn word(self) -> &'static str {
        match self {
            Face::Top => "top",
            Face::Bottom => "bottom",
            Face::Sides => "sides",
            Face::Outside => "outside",
        }
    }

    fn holds(self, cosine: f64) -> bool {
        match self {
            Face::Top => cosine >= 0.5,
            Face::Bottom => cosine <= -0.5,
            Face::Sides => cosine.abs() < 0.5,
            Face::Outside => true,
        }
    }
}

/// What may lie on a side of the object.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceRule {
    /// The side.
    pub face: Face,
    /// May the material be there? `(materials)`.
    pub may: Vec<bool>,
    /// Where it stands in the goal's file.
    pub at: Range<usize>,
}

/// The checked rules of `[palette]`, without the limit on materials.
#[derive(Clone, Debug, PartialEq)]
pub struct Rules {
    /// Pairs of materials that must not touch.
    pub apart: Vec<[u8; 2]>,
    /// What may lie on the surface.
    pub surface: Vec<SurfaceRule>,
    /// Most mass \[g\]; infinite if there is no limit.
    pub most_mass_g: f64,
    /// Most cost; infinite if there is no limit.
    pub most_cost: f64,
    /// Price of each material per cm³, `(materials)`; empty if the goal names none.
    pub prices_per_cm3: Vec<f64>,
    /// The currency of the prices.
    pub currency: Option<String>,
    /// The error that one unit of cost is worth \[mm\]; 0 if cost does not count.
    pub cost_weight_mm: f64,
    /// Where `apart` stands in the goal's file.
    pub apart_at: Range<usize>,
    /// Where `most_materials` stands.
    pub most_materials_at: Range<usize>,
    /// Where `most_mass` stands.
    pub most_mass_at: Range<usize>,
    /// Where `most_cost` stands.
    pub most_cost_at: Range<usize>,
}

/// Pieces of the surface along an element's edge.
const PIECES: f64 = 3.0;
/// At most how many pieces a triangle is cut into along an edge.
const MOST_CUTS: f64 = 200.0;
/// A cell lies on a side if it has this share of an element's face there.
const LEAST_FACE: f64 = 0.05;
/// How far under the surface its cells are asked for, as a share of an element.
const UNDER: f64 = 1e-3;
/// Most nodes that are looked at to find a layout that keeps all rules.
const MOST_STEPS: usize = 100_000;
/// Most cells that are looked at in all these nodes.
const MOST_VISITS: usize = 20_000_000;
/// Most cells among which a layout is looked for: with more, none is found in that many visits.
const MOST_CELLS: usize = 4000;

impl Goal {
    /// The layouts that keep the goal's rules.
    ///
    /// # Errors
    /// [`Mistake`] names the rule that no layout keeps.
    pub fn space(&self, rig: &Rig) -> Result<Space, Mistake> {
        let mut space = self.weighed(rig);
        if !self.rules.surface.is_empty() {
            self.clear_surface(rig, &mut space)?;
        }
        self.check_possible(&space)?;
        Ok(space)
    }

    /// The same without what may lie on the surface, and unchecked: for what a layout weighs and costs.
    pub fn weighed(&self, rig: &Rig) -> Space {
        let rules = &self.rules;
        let cells = self.setup.cells.count();
        let (volumes_cm3, touching) = self.volumes_and_neighbours(rig);
        let mut space = Space {
            most_materials: self.most_materials,
            touching,
            apart: rules.apart.clone(),
            volumes_cm3,
            densities_g_per_cm3: self.palette.iter().map(|m| m.record.density_g_per_cm3).collect(),
            most_mass_g: rules.most_mass_g,
            most_cost: rules.most_cost,
            ..Space::free(cells, self.palette.len())
        };
        if !rules.prices_per_cm3.is_empty() {
            space.prices_per_cm3.clone_from(&rules.prices_per_cm3);
        }
        space
    }

    fn volumes_and_neighbours(&self, rig: &Rig) -> (Vec<f64>, Vec<Vec<u32>>) {
        let cells = self.setup.cells.count();
        let mut volumes = vec![0.0; cells];
        for (q, &cell) in rig.cell_of_point.iter().enumerate() {
            volumes[cell as usize] += rig.model.parts.weight(q);
        }
        let whole = 1e-3 * self.setup.object.solid.volume();
        let sum: f64 = volumes.iter().sum();
        volumes.iter_mut().for_each(|v| *v *= whole / sum);
        let pairs = touching_cells(rig);
        let mut touching = vec![Vec::new(); cells];
        for [a, b] in pairs {
            touching[a as usize].push(b);
            touching[b as usize].push(a);
        }
        touching.iter_mut().for_each(|list| list.sort_unstable());
        (volumes, touching)
    }

    /// Takes from the cells of each side the materials that must not lie there.
    fn clear_surface(&self, rig: &Rig, space: &mut Space) -> Result<(), Mistake> {
        let axis = rig.grid.axis();
        for rule in &self.rules.surface {
            for (cell, area) in self.areas(axis, rule.face).into_iter().enumerate() {
                if area < LEAST_FACE * self.setup.element_size_mm.powi(2) {
                    continue;
                }
                space.allowed[cell].retain(|&m| rule.may[m as usize]);
                if space.allowed[cell].is_empty() {
                    let message = format!(
                        "the surface rules leave no material for cell {:?}, which lies on the {}",
                        self.setup.cells.name(cell),
                        rule.face.word()
                    );
                    return Err(self.setup.document.mistake(&rule.at, message));
                }
            }
        }
        Ok(())
    }

    /// The area of each cell on a side, `(cells)` \[mm²\].
    fn areas(&self, axis: Axis, face: Face) -> Vec<f64> {
        let solid = &self.setup.object.solid;
        let size = self.setup.element_size_mm;
        let mut areas = vec![0.0; self.setup.cells.count()];
        for t in 0..solid.mesh().triangles.len() {
            let corners = solid.mesh().corners(t);
            let vector = area_vector(&corners);
            let area = vector.norm();
            if area <= 0.0 {
                continue;
            }
            let normal = vector / area;
            if !face.holds(normal[axis.index()]) {
                continue;
            }
            let [a, b, c] = corners;
            let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
            let cuts = (PIECES * longest / size).ceil().clamp(1.0, MOST_CUTS) as usize;
            let (along, across) = ((b - a) / cuts as f64, (c - a) / cuts as f64);
            let mut add = |i: f64, j: f64| {
                let middle = a + along * i + across * j - normal * (UNDER * size);
                if let Some(cell) = self.setup.cells.cell_at(&middle) {
                    areas[cell] += area / (cuts * cuts) as f64;
                }
            };
            for i in 0..cuts {
                for j in 0..cuts - i {
                    let (x, y) = (i as f64, j as f64);
                    add(x + 1.0 / 3.0, y + 1.0 / 3.0);
                    if i + j + 1 < cuts {
                        add(x + 2.0 / 3.0, y + 2.0 / 3.0);
                    }
                }
            }
        }
        areas
    }

    /// Is there a layout that keeps all rules? Says which rule stands in the way if there is none, and nothing where that is
    /// not found out in reasonable time.
    fn check_possible(&self, space: &Space) -> Result<(), Mistake> {
        let rules = &self.rules;
        let document = &self.setup.document;
        let (lightest, cheapest) = (space.least_mass_g(), space.least_cost());
        if lightest > rules.most_mass_g * (1.0 + 1e-12) {
            let message = format!(
                "the lightest layout weighs {lightest:.1} g, more than most_mass allows ({:.1} g): allow more, or add a lighter material",
                rules.most_mass_g
            );
            return Err(document.mistake(&rules.most_mass_at, message));
        }
        if cheapest > rules.most_cost * (1.0 + 1e-12) {
            let currency = rules.currency.as_deref().unwrap_or_default();
            let message = format!(
                "the cheapest layout costs {cheapest:.2} {currency}, more than most_cost allows ({:.2} {currency}): allow more, or add a cheaper material",
                rules.most_cost
            );
            return Err(document.mistake(&rules.most_cost_at, message));
        }
        let steps = MOST_STEPS.min(MOST_VISITS / space.cells.max(1));
        if space.cells > MOST_CELLS || space.is_possible(steps) != Some(false) {
            return Ok(());
        }
        let free = Space::free(space.cells, space.materials);
        let without = [
            (
                "apart",
                &rules.apart_at,
                Space {
                    apart: Vec::new(),
                    ..space.clone()
                },
            ),
            (
                "most_materials",
                &rules.most_materials_at,
                Space {
                    most_materials: space.materials,
                    ..space.clone()
                },
            ),
            (
                "most_mass",
                &rules.most_mass_at,
                Space {
                    most_mass_g: f64::INFINITY,
                    ..space.clone()
                },
            ),
            (
                "most_cost",
                &rules.most_cost_at,
                Space {
                    most_cost: f64::INFINITY,
                    ..space.clone()
                },
            ),
            (
                "[[palette.surface]]",
                rules.surface.first().map_or(&rules.apart_at, |rule| &rule.at),
                Space {
                    allowed: free.allowed,
                    ..space.clone()
                },
            ),
        ];
        for (name, at, loosened) in &without {
            if loosened.is_possible(steps) == Some(true) {
                let message = format!(
                    "no layout keeps all rules of [palette]; without {name} there are some: loosen it, or another rule"
                );
                return Err(document.mistake(at, message));
            }
        }
        let message = "no layout keeps all rules of [palette]: loosen more than one of them";
        Err(document.mistake(&rules.most_materials_at, message))
    }
}

/// Pairs of different cells that touch, the lower first.
fn touching_cells(rig: &Rig) -> BTreeSet<[u32; 2]> {
    let filled = |q: usize| rig.grid.fill[q] > 0.0;
    let cell = |q: usize| u32::from(rig.cell_of_point[q]);
    let mut pairs = BTreeSet::new();
    let mut join = |p: usize, q: usize| {
        let (a, b) = (cell(p), cell(q));
        if a != b && filled(p) && filled(q) {
            pairs.insert([a.min(b), a.max(b)]);
        }
    };
    // Octants of the two sides of a face that share a node lie against one another.
    let mut waiting: BTreeMap<[u32; 4], [usize; 4]> = BTreeMap::new();
    for e in 0..rig.grid.mesh.elements.len() {
        let nodes = rig.grid.mesh.elements.nodes_of(e);
        for (a, corner) in CORNERS.iter().enumerate() {
            for (b, other) in CORNERS.iter().enumerate().skip(a + 1) {
                // Corners of one edge are two apart in one coordinate.
                if (corner - other).abs().sum() < 3.0 {
                    join(8 * e + a, 8 * e + b);
                }
            }
        }
        for side in 0..6 {
            let (axis, sign) = (side / 2, if side % 2 == 0 { -1.0 } else { 1.0 });
            let mut face: Vec<(u32, usize)> = (0..8)
                .filter(|&k| CORNERS[k][axis] * sign > 0.0)
                .map(|k| (nodes[k], 8 * e + k))
                .collect();
            face.sort_unstable();
            let key = [face[0].0, face[1].0, face[2].0, face[3].0];
            let octants = [face[0].1, face[1].1, face[2].1, face[3].1];
            match waiting.remove(&key) {
                Some(others) => others.iter().zip(&octants).for_each(|(&p, &q)| join(p, q)),
                None => {
                    waiting.insert(key, octants);
                }
            }
        }
    }
    pairs
}

#[cfg(test)]
#[path = "rules_tests.rs"]
mod tests;
