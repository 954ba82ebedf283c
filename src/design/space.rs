//! The layouts that may be built: which materials each cell may take, what may touch what, and what the whole may weigh
//! and cost.
//!
//! ```text
//! mass  M(m) = Σ_c V_c ρ(m_c) ≤ M̂        cost  C(m) = Σ_c V_c π(m_c) ≤ Ĉ        |{m_c}| ≤ k
//! (m_a, m_b) ∉ apart for all cells a, b that touch;    m_c ∈ allowed_c
//! ```
//!
//! Symbols: V_c volume of cell c \[cm³\], ρ density \[g/cm³\], π price \[per cm³\], in the goal's currency.

/// The space that a search walks through.
#[derive(Clone, Debug, PartialEq)]
pub struct Space {
    /// Number of cells.
    pub cells: usize,
    /// Number of base materials.
    pub materials: usize,
    /// At most how many different materials in one layout.
    pub most_materials: usize,
    /// For each cell, the materials that it may take, ascending, `(cells)`.
    pub allowed: Vec<Vec<u8>>,
    /// For each cell, the cells that it touches, ascending, `(cells)`.
    pub touching: Vec<Vec<u32>>,
    /// Pairs of materials that must not touch.
    pub apart: Vec<[u8; 2]>,
    /// Volume of each cell \[cm³\], `(cells)`.
    pub volumes_cm3: Vec<f64>,
    /// Density of each material \[g/cm³\], `(materials)`.
    pub densities_g_per_cm3: Vec<f64>,
    /// Price of each material per cm³, `(materials)`.
    pub prices_per_cm3: Vec<f64>,
    /// Most mass \[g\].
    pub most_mass_g: f64,
    /// Most cost.
    pub most_cost: f64,
}

impl Space {
    /// A space without rules: `cells` cells, each of which may take any of `materials` materials.
    pub fn free(cells: usize, materials: usize) -> Space {
        Space {
            cells,
            materials,
            most_materials: materials,
            allowed: vec![(0..materials).map(|m| m as u8).collect(); cells],
            touching: vec![Vec::new(); cells],
            apart: Vec::new(),
            volumes_cm3: vec![0.0; cells],
            densities_g_per_cm3: vec![0.0; materials],
            prices_per_cm3: vec![0.0; materials],
            most_mass_g: f64::INFINITY,
            most_cost: f64::INFINITY,
        }
    }

    /// May this layout, `(cells)`, be built?
    pub fn allows(&self, layout: &[u8]) -> bool {
        layout.len() == self.cells && self.may_hold(layout)
    }

    /// May the first cells of a layout be these? No if every completion breaks a rule for what is decided already.
    pub fn may_hold(&self, decided: &[u8]) -> bool {
        distinct(decided) <= self.most_materials
            && decided
                .iter()
                .zip(&self.allowed)
                .all(|(m, allowed)| allowed.contains(m))
            && self.may_fill_with_few(decided)
            && (self.apart.is_empty() || (0..decided.len()).all(|cell| self.stands_apart(decided, cell)))
            && self.least(decided, &self.densities_g_per_cm3) <= self.most_mass_g * (1.0 + 1e-12)
            && self.least(decided, &self.prices_per_cm3) <= self.most_cost * (1.0 + 1e-12)
    }

    /// Where no further material may come in, can the open cells take one of those that are there?
    fn may_fill_with_few(&self, decided: &[u8]) -> bool {
        distinct(decided) < self.most_materials
            || (decided.len()..self.cells).all(|c| self.allowed[c].iter().any(|m| decided.contains(m)))
    }

    /// Does the material of `cell` stand beside none that it must not touch, among the decided cells?
    fn stands_apart(&self, decided: &[u8], cell: usize) -> bool {
        self.touching[cell].iter().all(|&other| {
            let Some(&b) = decided.get(other as usize) else {
                return true;
            };
            let a = decided[cell];
            !self.apart.iter().any(|&pair| pair == [a, b] || pair == [b, a])
        })
    }

    /// The least sum of volume times `density`, `(materials)`, over the completions of `decided`.
    fn least(&self, decided: &[u8], density: &[f64]) -> f64 {
        let known: f64 = decided
            .iter()
            .zip(&self.volumes_cm3)
            .map(|(&m, v)| v * density[m as usize])
            .sum();
        let open: f64 = (decided.len()..self.cells)
            .map(|c| {
                let densities = self.allowed[c].iter().map(|&m| density[m as usize]);
                self.volumes_cm3[c] * densities.fold(f64::INFINITY, f64::min)
            })
            .sum();
        known + open
    }

    /// Least mass of a layout, whatever the other rules say \[g\].
    pub fn least_mass_g(&self) -> f64 {
        self.least(&[], &self.densities_g_per_cm3)
    }

    /// Least cost of a layout, whatever the other rules say.
    pub fn least_cost(&self) -> f64 {
        self.least(&[], &self.prices_per_cm3)
    }

    /// Is there a layout that keeps all rules? Looks at `most_steps` nodes at most; `None` if that is too few to know.
    pub fn is_possible(&self, most_steps: usize) -> Option<bool> {
        let mut decided: Vec<u8> = Vec::with_capacity(self.cells);
        // For each decided cell, which of its allowed materials comes next.
        let mut next = vec![0usize];
        for _ in 0..most_steps {
            if decided.len() == self.cells {
                return Some(true);
            }
            let cell = decided.len();
            match self.allowed[cell].get(next[cell]) {
                Some(&m) => {
                    next[cell] += 1;
                    decided.push(m);
                    if self.may_hold(&decided) {
                        next.push(0);
                    } else {
                        decided.pop();
                    }
                }
                None => {
                    next.pop();
                    if decided.pop().is_none() {
                        return Some(false);
                    }
                }
            }
        }
        None
    }

    /// The layouts that differ from `layout` in one cell and may be built.
    pub fn neighbours(&self, layout: &[u8]) -> Vec<Vec<u8>> {
        let mut result = Vec::new();
        for (cell, allowed) in self.allowed.iter().enumerate() {
            for &material in allowed.iter().filter(|&&m| m != layout[cell]) {
                let mut other = layout.to_vec();
                other[cell] = material;
                if self.allows(&other) {
                    result.push(other);
                }
            }
        }
        result
    }

    /// Mass of a layout \[g\].
    pub fn mass_g(&self, layout: &[u8]) -> f64 {
        self.least(layout, &self.densities_g_per_cm3)
    }

    /// Cost of a layout in the goal's currency.
    pub fn cost(&self, layout: &[u8]) -> f64 {
        self.least(layout, &self.prices_per_cm3)
    }

    /// How many layouts there are, without the rules on how cells go together.
    pub fn size(&self) -> f64 {
        self.allowed.iter().map(|a| a.len() as f64).product()
    }
}

/// How many different materials a layout mixes.
pub fn distinct(layout: &[u8]) -> usize {
    let mut seen = [false; 256];
    layout
        .iter()
        .filter(|&&m| !std::mem::replace(&mut seen[m as usize], true))
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn every_layout(cells: usize, materials: usize) -> Vec<Vec<u8>> {
        let mut all = vec![Vec::new()];
        for _ in 0..cells {
            all = all
                .into_iter()
                .flat_map(|l: Vec<u8>| (0..materials as u8).map(move |m| [l.as_slice(), &[m]].concat()))
                .collect();
        }
        all
    }

    /// The rules, written out from their definitions.
    fn keeps(space: &Space, layout: &[u8]) -> bool {
        let sum = |of: &[f64]| -> f64 {
            (0..space.cells)
                .map(|c| space.volumes_cm3[c] * of[layout[c] as usize])
                .sum()
        };
        let mut kinds = layout.to_vec();
        kinds.sort_unstable();
        kinds.dedup();
        let touches = (0..space.cells).flat_map(|a| space.touching[a].iter().map(move |&b| (a, b as usize)));
        kinds.len() <= space.most_materials
            && (0..space.cells).all(|c| space.allowed[c].contains(&layout[c]))
            && sum(&space.densities_g_per_cm3) <= space.most_mass_g
            && sum(&space.prices_per_cm3) <= space.most_cost
            && touches.into_iter().all(|(a, b)| {
                let pair = [layout[a], layout[b]];
                !space.apart.contains(&pair) && !space.apart.contains(&[pair[1], pair[0]])
            })
    }

    prop_compose! {
        fn spaces()(
            volumes_cm3 in prop::collection::vec(0.1..1.0, 4),
            densities_g_per_cm3 in prop::collection::vec(0.5..2.0, 3),
            prices_per_cm3 in prop::collection::vec(0.0..2.0, 3),
            most_mass_g in 0.5..5.0, most_cost in 0.2..5.0, most_materials in 1usize..4,
            forbidden in prop::collection::vec(0u8..8, 4),
            apart in prop::collection::vec((0u8..3, 0u8..3), 0..3),
            ring in any::<bool>(),
        ) -> Space {
            // Bit m of a cell's number forbids material m there.
            let allowed = forbidden.iter().map(|bits| (0..3).filter(|m| bits & (1 << m) == 0).collect()).collect();
            let mut touching = vec![vec![1], vec![0, 2], vec![1, 3], vec![2]];
            if ring {
                touching[0].push(3);
                touching[3].insert(0, 0);
            }
            let apart = apart.into_iter().filter(|(a, b)| a != b).map(|(a, b)| [a, b]).collect();
            Space {
                cells: 4, materials: 3, most_materials, allowed, touching, apart, volumes_cm3,
                densities_g_per_cm3, prices_per_cm3, most_mass_g, most_cost,
            }
        }
    }

    proptest! {
        /// Against all 81 layouts: a layout is allowed if it keeps the rules, a node is dropped only if no layout that begins
        /// with it does, and whether there is any is known.
        #[test]
        fn rules_agree_with_brute_force(space in spaces()) {
            let kept: Vec<Vec<u8>> =
                every_layout(4, 3).into_iter().filter(|l| keeps(&space, l)).collect();
            for layout in every_layout(4, 3) {
                prop_assert_eq!(space.allows(&layout), kept.contains(&layout));
            }
            for length in 0..4 {
                for node in every_layout(length, 3) {
                    let is_open = kept.iter().any(|l| l.starts_with(&node));
                    prop_assert!(space.may_hold(&node) || !is_open, "{:?}", node);
                }
            }
            prop_assert_eq!(space.is_possible(10_000), Some(!kept.is_empty()));
        }
    }

    #[test]
    fn each_rule_forbids_what_it_says() {
        let free = Space::free(3, 4);
        assert!(free.allows(&[0, 1, 3]) && !free.allows(&[0, 1]) && free.size() == 64.0);
        let two = Space {
            most_materials: 2,
            ..free.clone()
        };
        assert!(two.allows(&[1, 1, 2]) && !two.allows(&[0, 1, 2]));
        let mut top = free.clone();
        top.allowed[2] = vec![3];
        assert!(top.allows(&[0, 0, 3]) && !top.allows(&[0, 0, 1]) && top.may_hold(&[0, 0]));
        let apart = Space {
            touching: vec![vec![1], vec![0, 2], vec![1]],
            apart: vec![[0, 2]],
            ..free.clone()
        };
        assert!(!apart.may_hold(&[2, 0]) && !apart.allows(&[1, 0, 2]) && apart.allows(&[0, 1, 2]));
    }

    #[test]
    fn mass_and_cost_are_bounded_by_what_the_open_cells_cost_at_least() {
        let space = Space {
            volumes_cm3: vec![1.0, 2.0],
            densities_g_per_cm3: vec![1.0, 3.0],
            prices_per_cm3: vec![2.0, 0.5],
            most_mass_g: 5.0,
            ..Space::free(2, 2)
        };
        assert_eq!((space.mass_g(&[1, 0]), space.cost(&[1, 0])), (5.0, 4.5));
        assert!(space.allows(&[1, 0]) && space.may_hold(&[1]) && !space.allows(&[0, 1]));
    }
}
