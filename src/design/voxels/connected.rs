//! Parts of one material that hang together by faces.

use std::collections::VecDeque;

/// The cells of a layout that are to hang together, and which of them touch.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// For each cell the cells that it touches.
    pub touching: &'a [Vec<u32>],
    /// Which cells hold any of the object, `(cells)`.
    pub filled: &'a [bool],
    /// The variable of each cell, `(cells)`.
    pub variable_of_cell: &'a [u32],
    /// The materials that must be connected.
    pub connected: &'a [u8],
}

impl Parts<'_> {
    /// Is each of the materials one part? `choice`, `(variables)`.
    pub fn hold(&self, choice: &[u8]) -> bool {
        self.connected.iter().all(|&m| self.of(choice, m).len() <= 1)
    }

    /// The parts of a material, largest first, as lists of cells.
    fn of(&self, choice: &[u8], material: u8) -> Vec<Vec<u32>> {
        let holds = |c: usize| self.filled[c] && choice[self.variable_of_cell[c] as usize] == material;
        let mut seen = vec![false; self.filled.len()];
        let mut parts = Vec::new();
        for start in 0..seen.len() {
            if seen[start] || !holds(start) {
                continue;
            }
            seen[start] = true;
            let (mut part, mut queue) = (Vec::new(), VecDeque::from([start as u32]));
            while let Some(cell) = queue.pop_front() {
                part.push(cell);
                for &next in &self.touching[cell as usize] {
                    if !seen[next as usize] && holds(next as usize) {
                        seen[next as usize] = true;
                        queue.push_back(next);
                    }
                }
            }
            parts.push(part);
        }
        parts.sort_by_key(|part| std::cmp::Reverse(part.len()));
        parts
    }

    /// Gives every part but the largest to a material beside it, the one for which `price(variables, material)` is least.
    /// `None` if that does not end: tied cells can tear elsewhere what is mended here.
    pub fn mended(&self, choice: &[u8], price: impl Fn(&[u32], u8) -> f64) -> Option<Vec<u8>> {
        let mut choice = choice.to_vec();
        for _ in 0..=self.filled.len() {
            let loose = self.connected.iter().find_map(|&m| {
                let mut parts = self.of(&choice, m);
                (parts.len() > 1).then(|| (m, parts.swap_remove(1)))
            });
            let Some((material, part)) = loose else {
                return Some(choice);
            };
            let mut variables: Vec<u32> = part.iter().map(|&c| self.variable_of_cell[c as usize]).collect();
            variables.sort_unstable();
            variables.dedup();
            let beside = part.iter().flat_map(|&c| &self.touching[c as usize]);
            let mut others: Vec<u8> = beside
                .filter(|&&c| self.filled[c as usize])
                .map(|&c| choice[self.variable_of_cell[c as usize] as usize])
                .filter(|&m| m != material)
                .collect();
            others.sort_unstable();
            others.dedup();
            let best = others
                .into_iter()
                .map(|m| (price(&variables, m), m))
                .filter(|(price, _)| price.is_finite())
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
            variables.iter().for_each(|&v| choice[v as usize] = best.1);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of cells, each touching the next.
    fn row(n: usize) -> Vec<Vec<u32>> {
        (0..n)
            .map(|c| (0..n as u32).filter(|&o| (o as usize).abs_diff(c) == 1).collect())
            .collect()
    }

    #[test]
    fn loose_parts_are_found_and_given_away() {
        let (touching, filled) = (row(7), [true; 7]);
        let own: Vec<u32> = (0..7).collect();
        let parts = Parts {
            touching: &touching,
            filled: &filled,
            variable_of_cell: &own,
            connected: &[1],
        };
        assert!(parts.hold(&[0, 1, 1, 1, 0, 2, 0]) && !parts.hold(&[0, 1, 1, 0, 2, 1, 2]));
        assert_eq!(
            parts.mended(&[0, 1, 1, 0, 2, 1, 2], |_, m| f64::from(m)),
            Some(vec![0, 1, 1, 0, 2, 2, 2])
        );
        // Nothing beside it is allowed.
        assert_eq!(parts.mended(&[0, 1, 1, 0, 2, 1, 2], |_, _| f64::INFINITY), None);
        // A gap without the object does not connect.
        let mut hole = filled;
        hole[2] = false;
        let parts = Parts {
            filled: &hole,
            ..parts
        };
        assert!(!parts.hold(&[0, 1, 1, 1, 0, 0, 0]));
    }
}
