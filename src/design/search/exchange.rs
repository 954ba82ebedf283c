//! Polishing: one cell at a time takes another material, the best exchange first, until none improves.

use super::by_score;
use super::memory::{Halt, Memory};

/// Polishes the `count` best layouts.
pub(super) fn polish(memory: &mut Memory, count: usize) -> Result<(), Halt> {
    let starts = memory.ranked();
    for (number, start) in starts.iter().take(count).enumerate() {
        let mut current = start.clone();
        loop {
            let near = memory.aim.space.neighbours(&current.layout);
            memory.simulate(&near, "polishing", [number + 1, count.min(starts.len())])?;
            let rated = near.iter().filter_map(|layout| memory.get(layout));
            match rated.map(|entry| &entry.ranked).min_by(|a, b| by_score(a, b)) {
                Some(better) if better.score_mm < current.score_mm => current = better.clone(),
                _ => break,
            }
        }
    }
    Ok(())
}
