//! Every layout, simulated: proof for small spaces.

use super::memory::{Halt, Memory};
use super::{BadSearch, Stop};
use crate::design::space::Space;
use crate::fem::rig::Layout;

/// More layouts than this are not enumerated.
pub const MOST_ENUMERATED: usize = 2_000_000;
/// Layouts simulated between two looks at the progress.
const BATCH: usize = 2000;

/// Simulates the whole space.
pub(super) fn walk(memory: &mut Memory) -> Result<Result<Stop, Halt>, BadSearch> {
    let size = memory.aim.space.size();
    if size > MOST_ENUMERATED as f64 {
        return Err(BadSearch::TooManyLayouts { layouts: size });
    }
    // A layout of one material bounds and compares even where the rules forbid it.
    let uniform = memory.uniform();
    let walked = memory.simulate(&uniform, "enumerating", [0, 0]);
    Ok(walked.and_then(|()| rest(memory)).map(|()| Stop::Enumerated))
}

/// Simulates what is left of a space that can be enumerated.
pub(super) fn rest(memory: &mut Memory) -> Result<(), Halt> {
    let space = memory.aim.space;
    let layouts: Vec<Layout> = all(space).filter(|l| space.allows(l)).collect();
    let batches = layouts.len().div_ceil(BATCH);
    for (b, batch) in layouts.chunks(BATCH).enumerate() {
        memory.simulate(batch, "enumerating", [b + 1, batches])?;
    }
    Ok(())
}

/// All layouts of allowed materials, the first cell changing fastest.
pub(super) fn all(space: &Space) -> impl Iterator<Item = Layout> + '_ {
    (0..space.size() as usize).map(move |number| decoded(space, number))
}

fn decoded(space: &Space, mut number: usize) -> Layout {
    space
        .allowed
        .iter()
        .map(|allowed| {
            let material = allowed[number % allowed.len()];
            number /= allowed.len();
            material
        })
        .collect()
}
