//! What no layout can be better than, as far as is known.
//!
//! ```text
//! node a: the first cells decided.   box(a) = [min_j x(a, j…j), max_j x(a, j…j)]     j over the corner materials
//! S(m) ≥ b(a) = RMS distance of x̄ from box(a) + w · least cost of a,   for m below a, if x(m) ∈ box(a)
//! b = min over the nodes that cover the space,   a child's bound at least its parent's
//! ```
//!
//! x(m) ∈ box(a) holds where displacements are monotone in the materials' softness. They need not be (Bickel 2010, 8.4.2:
//! "the bound estimation approach is not conservative"). So it is checked: every simulated layout below a node is a
//! sample. The boxes are widened by the largest overhang seen, component by component, and the bound says how often
//! and by how much ([`Basis::Broken`]). It is then a statement about what was sampled, no proof.
//!
//! *Corner materials* are those that give the least or the largest displacement in some component when they fill the
//! whole object. The tree is walked best-first: the node with the least bound is split next, so that the bound rises as fast
//! as it can; nodes whose bound is above the best score need no more looks.

use super::memory::{Halt, Memory};
use super::{Aim, Counts};
use crate::design::space::Space;
use crate::fem::rig::Layout;
use std::collections::{BTreeMap, HashMap};

/// Nodes that are split side by side.
const SPLIT: usize = 8;
/// An overhang below this share of the largest target displacement is the simulation's own haste.
const NOTICEABLE: f64 = 1e-4;

/// What no layout can be better than.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Bound {
    /// No layout has a lower score \[mm\].
    pub score_mm: f64,
    /// What that rests on.
    pub basis: Basis,
}

/// What a bound rests on.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Basis {
    /// Every layout was simulated: proof, at this mesh and tolerance.
    Enumerated,
    /// Displacements lie between those of uniform completions, which every sample confirmed.
    Monotone {
        /// How many samples.
        samples: usize,
    },
    /// Some samples lay outside; boxes are widened by the largest overhang seen: heuristic.
    Broken {
        /// How many samples.
        samples: usize,
        /// How many of them lay outside.
        outside: usize,
        /// The largest overhang \[mm\].
        most_mm: f64,
    },
    /// Every layout of which the learned model expects a score within its largest surprise of the best was simulated, or
    /// the bound is what the model expects less that surprise: heuristic.
    Learned {
        /// How many expectations were checked by simulation.
        checks: usize,
        /// The surprise allowed for, as a share of the score that was expected.
        surprise: f64,
    },
    /// The best mixture of the materials that was found is no better. Layouts are mixtures too, but there may be better
    /// ones: heuristic.
    Relaxed,
    /// Nothing is known: a uniform layout has no equilibrium, or none was simulated.
    Nothing,
}

impl Bound {
    /// The bound where every layout was simulated.
    pub(super) fn enumerated(best_mm: f64) -> Bound {
        Bound {
            score_mm: best_mm,
            basis: Basis::Enumerated,
        }
    }
}

impl std::fmt::Display for Basis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Basis::Enumerated => write!(f, "proved: every layout was simulated"),
            Basis::Monotone { samples } => write!(
                f,
                "rests on displacements that are monotone in the materials, which {samples} samples confirm"
            ),
            Basis::Broken {
                samples,
                outside,
                most_mm,
            } => write!(
                f,
                "heuristic: displacements are not monotone in the materials in {outside} of {samples} samples, by up to {most_mm:.2e} mm, which the bound allows for"
            ),
            Basis::Learned { checks, surprise } => write!(
                f,
                "heuristic: a model of all layouts expects nothing better; it is allowed to be wrong by {:.0} % of what it expects, as the last of {checks} checks say",
                100.0 * surprise
            ),
            Basis::Relaxed => write!(
                f,
                "heuristic: with shares of several materials in each cell nothing better was found either"
            ),
            Basis::Nothing => write!(f, "nothing is known"),
        }
    }
}

/// The materials that fill the undecided cells.
pub(super) struct Corners {
    materials: Vec<u8>,
}

impl Corners {
    /// All of them, as in the thesis.
    pub fn all(space: &Space) -> Corners {
        Corners {
            materials: (0..space.materials).map(|m| m as u8).collect(),
        }
    }

    /// Those that are extreme in some measured component where they fill the object; uniform layouts come first.
    fn extreme(memory: &Memory) -> Corners {
        let known: Vec<(u8, &[f64])> = memory
            .uniform()
            .iter()
            .filter_map(|layout| Some((layout[0], memory.get(layout)?)))
            .filter(|(_, entry)| entry.response.complete)
            .map(|(m, entry)| (m, entry.response.displacements.as_slice()))
            .collect();
        let mut materials = Vec::new();
        for (i, target) in memory.aim.target.components.iter().enumerate() {
            if target.is_some() {
                let by = |a: &&(u8, &[f64]), b: &&(u8, &[f64])| a.1[i].total_cmp(&b.1[i]);
                materials.extend(known.iter().min_by(by).map(|k| k.0));
                materials.extend(known.iter().max_by(by).map(|k| k.0));
            }
        }
        materials.sort_unstable();
        materials.dedup();
        Corners { materials }
    }

    /// The box of a node; `None` where a completion was not simulated, or has no equilibrium.
    pub fn box_of(&self, memory: &Memory, node: &[u8]) -> Option<Reach> {
        let components = memory.aim.target.components.len();
        let mut reach = Reach {
            low: vec![f64::INFINITY; components],
            high: vec![f64::NEG_INFINITY; components],
        };
        for layout in completions(node, memory.aim.space.cells, self) {
            let entry = memory.get(&layout).filter(|e| e.response.complete)?;
            for (i, &x) in entry.response.displacements.iter().enumerate() {
                reach.low[i] = reach.low[i].min(x);
                reach.high[i] = reach.high[i].max(x);
            }
        }
        (!self.materials.is_empty()).then_some(reach)
    }
}

/// The uniform completions of a node, one for each corner material. Those that break a rule still bound the node.
pub(super) fn completions(node: &[u8], cells: usize, corners: &Corners) -> Vec<Layout> {
    corners
        .materials
        .iter()
        .map(|&m| {
            let mut layout = node.to_vec();
            layout.resize(cells, m);
            layout
        })
        .collect()
}

/// The box that a node's displacements are taken to lie in.
pub(super) struct Reach {
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Reach {
    /// The bound of a node with this box \[mm\].
    pub fn score_mm(&self, aim: &Aim, node: &[u8]) -> f64 {
        aim.target.distance_to_box(&self.low, &self.high) + aim.worth(aim.space.cost(node))
    }

    fn widened(mut self, overhang: &[f64]) -> Reach {
        for (i, e) in overhang.iter().enumerate() {
            self.low[i] -= e;
            self.high[i] += e;
        }
        self
    }
}

/// How far samples lay outside their nodes' boxes.
struct Overhang {
    by_component: Vec<f64>,
    samples: usize,
    outside: usize,
}

impl Overhang {
    /// Looks at every simulated layout below every node whose box is known.
    fn seen(memory: &Memory, corners: &Corners) -> Overhang {
        let target = memory.aim.target;
        let slack = NOTICEABLE * target.largest_mm();
        let mut boxes: HashMap<&[u8], Option<Reach>> = HashMap::new();
        let mut overhang = Overhang {
            by_component: vec![0.0; target.components.len()],
            samples: 0,
            outside: 0,
        };
        for entry in memory.entries.iter().filter(|e| e.response.complete) {
            let layout = &entry.ranked.layout;
            for decided in 0..layout.len() {
                let node = &layout[..decided];
                let is_completion = layout[decided..].windows(2).all(|w| w[0] == w[1])
                    && corners.materials.contains(&layout[decided]);
                let reach = boxes.entry(node).or_insert_with(|| corners.box_of(memory, node));
                let Some(reach) = reach.as_ref().filter(|_| !is_completion) else {
                    continue;
                };
                overhang.samples += 1;
                let mut is_outside = false;
                for (i, &x) in entry.response.displacements.iter().enumerate() {
                    let by = (reach.low[i] - x).max(x - reach.high[i]);
                    if target.components[i].is_some() && by > slack {
                        is_outside = true;
                        overhang.by_component[i] = overhang.by_component[i].max(by);
                    }
                }
                overhang.outside += usize::from(is_outside);
            }
        }
        overhang
    }

    fn basis(&self) -> Basis {
        if self.outside == 0 {
            return Basis::Monotone {
                samples: self.samples,
            };
        }
        Basis::Broken {
            samples: self.samples,
            outside: self.outside,
            most_mm: self.by_component.iter().fold(0.0, |m, &e| m.max(e)),
        }
    }
}

/// The bound that the uniform layouts give alone.
pub(super) fn of_root(memory: &Memory) -> Bound {
    Tree::new(memory).bound(memory)
}

/// Splits nodes, the one with the least bound first, until none is below the best score or no more may be simulated. Where
/// samples broke the boxes already, a tree of them is not worth its simulations, and the root's box has to do.
pub(super) fn tighten(memory: &mut Memory, counts: &mut Counts) -> Result<(), Halt> {
    let mut tree = Tree::new(memory);
    let walked = match tree.overhang.outside {
        0 => tree.split(memory, counts),
        _ => Ok(()),
    };
    counts.improve(tree.bound(memory));
    walked
}

/// Nodes that cover the space.
struct Tree {
    corners: Corners,
    overhang: Overhang,
    /// Nodes that wait, by the bits of their bound, which order as the bounds do.
    open: BTreeMap<(u64, Layout), f64>,
    /// Nodes whose bound was above the best score when they were looked at.
    closed: Vec<(Layout, f64)>,
}

impl Tree {
    fn new(memory: &Memory) -> Tree {
        let corners = Corners::extreme(memory);
        let overhang = Overhang::seen(memory, &corners);
        let mut tree = Tree {
            corners,
            overhang,
            open: BTreeMap::new(),
            closed: Vec::new(),
        };
        let root = tree.bound_of(memory, &[], 0.0);
        tree.open.insert((root.to_bits(), Layout::new()), root);
        tree
    }

    /// The bound of a node whose parent's is `parent` \[mm\].
    fn bound_of(&self, memory: &Memory, node: &[u8], parent: f64) -> f64 {
        let reach = self.corners.box_of(memory, node);
        reach.map_or(parent, |reach| {
            parent.max(
                reach
                    .widened(&self.overhang.by_component)
                    .score_mm(memory.aim, node),
            )
        })
    }

    fn split(&mut self, memory: &mut Memory, counts: &mut Counts) -> Result<(), Halt> {
        let space = memory.aim.space;
        while let Some((_, &least)) = self.open.first_key_value() {
            memory.bound_mm = least.min(memory.best_mm);
            if least >= memory.best_mm || self.corners.materials.is_empty() {
                break;
            }
            let chosen: Vec<(Layout, f64)> = self
                .open
                .iter()
                .take(SPLIT)
                .filter(|(_, bound)| **bound < memory.best_mm)
                .map(|((_, node), bound)| (node.clone(), *bound))
                .collect();
            let children: Vec<(Layout, f64)> = chosen
                .iter()
                .flat_map(|(node, bound)| {
                    let allowed = space.allowed[node.len()].iter();
                    allowed.map(move |&m| ([node.as_slice(), &[m]].concat(), *bound))
                })
                .filter(|(child, _)| space.may_hold(child))
                .collect();
            let whole: Vec<Layout> = children
                .iter()
                .flat_map(|(child, _)| completions(child, space.cells, &self.corners))
                .collect();
            memory.simulate(&whole, "bounding", [0, 0])?;
            for (node, bound) in chosen {
                self.open.remove(&(bound.to_bits(), node));
            }
            for (child, parent) in children.into_iter().filter(|(c, _)| c.len() < space.cells) {
                let bound = self.bound_of(memory, &child, parent);
                if bound < memory.best_mm {
                    self.open.insert((bound.to_bits(), child), bound);
                } else {
                    counts.culled += 1;
                    self.closed.push((child, parent));
                }
            }
        }
        Ok(())
    }

    /// The least bound of all nodes, boxes widened by what was seen up to now.
    fn bound(&mut self, memory: &Memory) -> Bound {
        self.overhang = Overhang::seen(memory, &self.corners);
        let open = self.open.iter().map(|((_, node), bound)| (node, *bound));
        let closed = self.closed.iter().map(|(node, parent)| (node, *parent));
        let mut score_mm = memory.best_mm;
        for (node, known) in open.chain(closed) {
            let reach = self.corners.box_of(memory, node);
            let own = reach.map_or(0.0, |r| {
                r.widened(&self.overhang.by_component).score_mm(memory.aim, node)
            });
            // Where boxes had to be widened, what was known before was known of narrower ones.
            let bound = if self.overhang.outside == 0 {
                known.max(own)
            } else {
                own
            };
            score_mm = score_mm.min(bound);
        }
        let is_known = self.corners.box_of(memory, &[]).is_some();
        Bound {
            score_mm: if is_known { score_mm } else { 0.0 },
            basis: if is_known {
                self.overhang.basis()
            } else {
                Basis::Nothing
            },
        }
    }
}
