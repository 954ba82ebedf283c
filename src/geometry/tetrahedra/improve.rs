//! Rounds of improvement, the worst tetrahedron first.
//!
//! For each one below the goal: the best edge collapse, edge removal or face exchange that leaves its neighbourhood better
//! than it was, and else moves of its vertices (Klingner and Shewchuk 2007, "Aggressive tetrahedral mesh improvement", in
//! the small). First everything stays on its surfaces; what is still bad then may leave them by a growing slack.

use super::collapse::{Leave, collapse};
use super::rims::sharpen;
use super::rings::{removal, two_to_three};
use super::smooth::smooth;
use super::surfaces::Surfaces;
use super::workpiece::Workpiece;

/// Rounds that keep to the surfaces, and rounds that may leave them.
const ROUNDS: [usize; 2] = [8, 20];
/// The first rounds aim higher than the bound, by this factor on the angle: what they leave is far from it.
const AIM: f64 = 1.8;
/// And the last ones by this: rounding must not miss it.
const MARGIN: f64 = 1.02;
/// Before the first round vertices go to their surfaces where that leaves this share of the bound; the rounds mend the rest.
const SETTLED: f64 = 0.3;
/// How often each vertex may look for a rim; the neighbours of one that has moved look again.
const SHARPENINGS: usize = 2;
/// How far the middle of a face may be from its surface, over the edge length, where vertices may not leave theirs at all.
const SAG: f64 = 0.1;
/// The cosine of the angle by which faces of borders may turn, in the first rounds and in those that may leave surfaces.
const TURN: [f64; 2] = [0.8, 0.5];
/// How much better a change must be.
const GAIN: f64 = 1e-3;

/// Improves until all dihedral angles are above the bound \[°\], or nothing helps. Vertices may leave their surfaces by
/// `slack` \[mm\].
pub(super) fn improve(piece: &mut Workpiece, surfaces: &Surfaces, bound_deg: f64, slack: f64) {
    let sine = |angle: f64| angle.min(60.0).to_radians().sin();
    surfaces.settle(piece, SETTLED * sine(bound_deg));
    rounds(piece, surfaces, sine, bound_deg, slack);
    surfaces.settle(piece, sine(MARGIN * bound_deg));
    for _ in 0..SHARPENINGS {
        sharpen(piece, surfaces, sine(MARGIN * bound_deg));
    }
}

fn rounds(piece: &mut Workpiece, surfaces: &Surfaces, sine: impl Fn(f64) -> f64, bound_deg: f64, slack: f64) {
    for round in 0..ROUNDS[0] + ROUNDS[1] {
        let share = if round < ROUNDS[0] {
            0.0
        } else {
            (((round - ROUNDS[0]) / 2 + 1) as f64 / 3.0).min(1.0)
        };
        let aim = if share == 0.0 { AIM } else { MARGIN };
        let goal = sine(aim * bound_deg);
        let leave = Leave {
            slack: share * slack,
            sag: (SAG * surfaces.edge).max(share * slack),
            turn: if share > 0.0 { TURN[1] } else { TURN[0] },
        };
        let mut bad: Vec<u32> = piece.alive().filter(|&t| piece.sine(t) < goal).collect();
        bad.sort_by(|&s, &t| piece.sine(s).total_cmp(&piece.sine(t)).then(s.cmp(&t)));
        if bad.is_empty() && share > 0.0 {
            return;
        }
        let mut changed = 0;
        for t in bad {
            if piece.is_alive(t) && piece.sine(t) < goal && mend(piece, surfaces, t, leave) {
                changed += 1;
            }
        }
        if round + 1 == ROUNDS[0] {
            surfaces.settle(piece, sine(MARGIN * bound_deg));
        }
        if changed == 0 && (share == 1.0 || slack == 0.0 && share > 0.0) {
            return;
        }
    }
}

/// Does something about one bad tetrahedron.
fn mend(piece: &mut Workpiece, surfaces: &Surfaces, t: u32, leave: Leave) -> bool {
    let tet = piece.tet(t);
    let own = piece.sine(t);
    let (mut shrink, mut swap) = (None, None);
    for i in 0..4 {
        for j in (0..4).filter(|j| *j != i) {
            let ends = [tet[i], tet[j]];
            let before = piece.worst(piece.star(ends[0]));
            let least = shrink
                .as_ref()
                .map_or(before, |c: &super::collapse::Collapse| c.sine.max(before));
            if let Some(found) = collapse(piece, surfaces, ends, leave, least + GAIN * own.abs()) {
                shrink = Some(found);
            }
            if i < j {
                let before = piece.worst(&piece.around(ends[0], ends[1]));
                let least = swap
                    .as_ref()
                    .map_or(before, |s: &super::rings::Exchange| s.sine.max(before));
                if let Some(found) = removal(piece, surfaces, ends, leave, least + GAIN * own.abs()) {
                    swap = Some(found);
                }
            }
        }
        if let Some(s) = piece.across(t, i) {
            let before = own.min(piece.sine(s));
            let least = swap
                .as_ref()
                .map_or(before, |s: &super::rings::Exchange| s.sine.max(before));
            if let Some(found) = two_to_three(piece, t, i, least + GAIN * own.abs()) {
                swap = Some(found);
            }
        }
    }
    match (shrink, swap) {
        (Some(shrink), Some(swap)) if swap.sine > shrink.sine => swap.perform(piece),
        (Some(shrink), _) => shrink.perform(piece),
        (None, Some(swap)) => swap.perform(piece),
        (None, None) => {
            return move_corners(piece, surfaces, tet, leave.slack)
                || leave.slack > 0.0
                    && (split_an_edge(piece, surfaces, t, leave) || move_around(piece, surfaces, tet));
        }
    }
    true
}

/// Moves the neighbours of a bad tetrahedron's corners to where they are best: that can make room for it.
fn move_around(piece: &mut Workpiece, surfaces: &Surfaces, tet: [u32; 4]) -> bool {
    let mut near: Vec<u32> = tet
        .iter()
        .flat_map(|&v| piece.star(v))
        .flat_map(|&t| piece.tet(t))
        .collect();
    near.sort_unstable();
    near.dedup();
    let mut moved = false;
    for v in near {
        moved |= smooth(piece, surfaces, v, 0.0);
    }
    moved
}

/// Puts a vertex into the middle of an edge of a bad tetrahedron and moves it to where it is best, if all is better then.
fn split_an_edge(piece: &mut Workpiece, surfaces: &Surfaces, t: u32, leave: Leave) -> bool {
    let tet = piece.tet(t);
    let edges = (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j)));
    let mut edges: Vec<[u32; 2]> = edges.map(|(i, j)| [tet[i], tet[j]]).collect();
    let length =
        |piece: &Workpiece, [a, b]: &[u32; 2]| (piece.points[*a as usize] - piece.points[*b as usize]).norm();
    edges.sort_by(|e, f| length(piece, f).total_cmp(&length(piece, e)));
    for [a, b] in edges {
        let old = piece.around(a, b);
        let least = piece.worst(&old) * (1.0 + GAIN);
        let before = tet.map(|v| (v, piece.points[v as usize], piece.loose[v as usize]));
        let v = piece.split(a, b);
        let (firm, middle) = (
            piece.on[v as usize] & !piece.loose[v as usize],
            piece.points[v as usize],
        );
        match surfaces.onto(firm, middle) {
            Some(place) => piece.relocate(v, place),
            None => piece.loose[v as usize] = piece.on[v as usize],
        }
        smooth(piece, surfaces, v, leave.slack);
        move_corners(piece, surfaces, tet, leave.slack);
        if piece.worst(piece.star(v)) > least {
            return true;
        }
        piece.unsplit(v, &old);
        for (v, place, loose) in before {
            piece.loose[v as usize] = loose;
            piece.relocate(v, place);
        }
    }
    false
}

/// Moves the corners of a bad tetrahedron; where a slack is given, they may leave their surfaces.
fn move_corners(piece: &mut Workpiece, surfaces: &Surfaces, tet: [u32; 4], slack: f64) -> bool {
    let mut moved = false;
    for v in tet {
        moved |= smooth(piece, surfaces, v, slack);
    }
    if slack > 0.0 && !moved {
        for v in tet {
            let before = piece.loose[v as usize];
            // The planes of the bounds stay: nothing on them is curved.
            piece.loose[v as usize] |= piece.on[v as usize] & !0b11_1111;
            if piece.loose[v as usize] != before && smooth(piece, surfaces, v, slack) {
                moved = true;
            } else {
                piece.loose[v as usize] = before;
            }
        }
    }
    moved
}
