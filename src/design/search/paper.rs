//! The thesis' search (Bickel 2010, section 8.4.2): breadth first through a decision tree whose level l decides cell l.
//!
//! A node with the first cells decided is judged by its *uniform completions*: the undecided cells all of one base
//! material, for each material in turn. All completions of a level are simulated first, then
//!
//! - *culling*: the box that spans a node's completions, component by component, is taken to hold what its subtree can
//!   reach; a node is dropped if the target is farther from its box than the best layout's error;
//! - *clustering*: nodes that behave alike are merged to at most K representatives ([`super::clusters`]).
//!
//! Every completion is a whole layout and competes for the best. Neither step is conservative: displacements are not
//! monotone in the materials, and a representative speaks for its cluster.
//!
//! The thesis measures the distance of (8.4) squared and the culling distance plain; here both sides of the culling test
//! are root mean square errors in mm.

use super::bound::{Corners, completions};
use super::clusters::representatives;
use super::memory::{Halt, Memory};
use super::{Counts, Options};
use crate::fem::rig::Layout;

/// Walks the tree to its leaves.
pub(super) fn walk(memory: &mut Memory, options: &Options, counts: &mut Counts) -> Result<(), Halt> {
    let space = memory.aim.space;
    let corners = Corners::all(space);
    let mut nodes: Vec<Layout> = vec![Vec::new()];
    for level in 0..space.cells {
        let children: Vec<Layout> = nodes
            .iter()
            .flat_map(|node| {
                space.allowed[level]
                    .iter()
                    .map(move |&m| [node.as_slice(), &[m]].concat())
            })
            .filter(|child| space.may_hold(child))
            .collect();
        let whole: Vec<Layout> = children
            .iter()
            .flat_map(|c| completions(c, space.cells, &corners))
            .collect();
        memory.simulate(&whole, "searching", [level + 1, space.cells])?;
        let kept: Vec<Layout> = children
            .iter()
            .filter(|c| may_improve(memory, c, &corners))
            .cloned()
            .collect();
        counts.culled += children.len() - kept.len();
        let features: Vec<Vec<f64>> = kept.iter().map(|node| features(memory, node, &corners)).collect();
        let chosen = representatives(&features, options.clusters, options.seed + level as u64);
        counts.merged += kept.len() - chosen.len();
        nodes = chosen.into_iter().map(|i| kept[i].clone()).collect();
    }
    Ok(())
}

/// Can the node's subtree hold something better than the best? A node with a completion that has no equilibrium is not
/// bounded.
fn may_improve(memory: &Memory, node: &[u8], corners: &Corners) -> bool {
    match corners.box_of(memory, node) {
        // Rounding must not drop the node of the best layout itself.
        Some(reach) => reach.score_mm(memory.aim, node) <= memory.best_mm * (1.0 + 1e-9),
        None => true,
    }
}

fn features(memory: &Memory, node: &[u8], corners: &Corners) -> Vec<f64> {
    let components = &memory.aim.target.components;
    let mut features = Vec::new();
    for layout in completions(node, memory.aim.space.cells, corners) {
        let Some(entry) = memory.get(&layout) else {
            continue;
        };
        let measured = entry.response.displacements.iter().zip(components);
        features.extend(measured.filter(|(_, target)| target.is_some()).map(|(x, _)| *x));
    }
    features
}
