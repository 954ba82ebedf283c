//! Where in the space of invariants a law's moduli are fitted: centres that cover the strains that the presses met.
//!
//! ```text
//! min Σ_i w_i min_j |q_i − c_j|²,    w_i = (V_i T_i·ε_i)^½,    c_0 = 0 (rest)
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | q_i, V_i | invariants and volume of an integration point at a level of a press | –, mm³ |
//! | T·ε | work of its secant stress | MPa |
//! | c_j | centres | – |
//!
//! Strains that store much energy shape the displacements, so they are to be covered well; the root keeps the few strains under
//! the rim of the probe, which store the most, from drawing all centres to them. The sum is lowered by Lloyd's iteration from
//! greedy starts (each the point that adds most to the sum), with one centre held at rest; the same strains give the same
//! centres. Source: Bickel 2010, 8.3, which leaves open how the strains are covered; Lloyd 1982.

use super::press::{Levels, PressedSpecimen};
use crate::fem::forces::point_fields;
use crate::material::energy::EnergyRbf;
use crate::material::isotropic::{IsotropicRbf, invariants};
use crate::material::law::{Law, LawError, Range};
use crate::material::transverse::{TransverseModuli, TransverseRbf};
use crate::math::mandel::Mandel;

/// Lloyd's iterations.
const ITERATIONS: usize = 60;
/// Centres nearer than this share of the cloud's reach are one.
const MERGE: f64 = 0.01;

/// A strain that was met, with the volume that met it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// As the law was shown it.
    pub strain: Mandel,
    /// Of the integration point \[mm³\].
    pub volume: f64,
}

/// Strains at all integration points, at all levels of the presses.
pub fn strains_met(pressed: &PressedSpecimen, law: &Law, equilibria: &[Levels]) -> Vec<Met> {
    let laws = [law];
    let materials = pressed.materials(&laws);
    let parts = &pressed.model.parts;
    let of = |u: &Vec<_>| {
        let strains = point_fields(parts, u, &materials).strain;
        let met = strains.into_iter().enumerate().map(|(q, strain)| Met {
            strain,
            volume: parts.weight(q),
        });
        met.filter(|m| m.volume > 0.0).collect::<Vec<_>>()
    };
    equilibria.iter().flatten().flat_map(of).collect()
}

/// The law with up to `count` centres, rest among them, that cover the strains `met`; its moduli there are those that `law`
/// has now. Fewer centres where the strains lie too near to one another.
///
/// # Errors
/// Moduli that make no law.
pub fn with_centres(law: &Law, met: &[Met], count: usize) -> Result<Law, LawError> {
    let weight = |m: &Met| (m.volume * law.stress(&m.strain).dot(&m.strain)).max(0.0).sqrt();
    match law {
        Law::Isotropic(law) => {
            let cloud: Vec<_> = met.iter().map(|m| (invariants(&m.strain), weight(m))).collect();
            let centres = cover(&cloud, count);
            let moduli: Vec<[f64; 2]> = centres.iter().map(|q| law.moduli(q)).collect();
            IsotropicRbf::interpolating(&centres, &moduli, Range::UNBOUNDED).map(Law::Isotropic)
        }
        Law::TransverselyIsotropic(law) => {
            let cloud: Vec<_> = met
                .iter()
                .map(|m| (law.invariants(&m.strain), weight(m)))
                .collect();
            let centres = cover(&cloud, count);
            let moduli: Vec<TransverseModuli> = centres.iter().map(|q| law.moduli(q)).collect();
            let placed = TransverseRbf::interpolating(&centres, &moduli, Range::UNBOUNDED)?;
            Ok(Law::TransverselyIsotropic(Box::new(placed.rotated(law.axis()))))
        }
        Law::Energy(law) => {
            let cloud: Vec<_> = met.iter().map(|m| (invariants(&m.strain), weight(m))).collect();
            let centres = cover(&cloud, count);
            let moduli: Vec<[f64; 2]> = centres.iter().map(|q| law.moduli(q)).collect();
            let offset = EnergyRbf::default_offset(&centres);
            let placed = EnergyRbf::interpolating(&centres, &moduli, offset, Range::UNBOUNDED)?;
            Ok(Law::Energy(Box::new(placed)))
        }
        other => Ok(other.clone()),
    }
}

/// The law with the box of the invariants `met`, outward to four digits, as its range.
///
/// # Errors
/// Invariants that make no range.
pub fn with_range(law: &Law, met: &[Met]) -> Result<Law, LawError> {
    match law {
        Law::Isotropic(law) => {
            let range = range_of(met.iter().map(|m| invariants(&m.strain)))?;
            IsotropicRbf::from_weights(law.log_moduli().clone(), range).map(Law::Isotropic)
        }
        Law::TransverselyIsotropic(law) => {
            let range = range_of(met.iter().map(|m| law.invariants(&m.strain)))?;
            let ranged = TransverseRbf::from_weights(law.parameters().clone(), range)?;
            Ok(Law::TransverselyIsotropic(Box::new(ranged.rotated(law.axis()))))
        }
        Law::Energy(law) => {
            let range = range_of(met.iter().map(|m| invariants(&m.strain)))?;
            EnergyRbf::from_weights(law.log_moduli().clone(), range).map(|law| Law::Energy(Box::new(law)))
        }
        other => Ok(other.clone()),
    }
}

/// Largest distance from a centre of `law` to the nearest of `other`'s, as a share of the largest distance of a centre of
/// `law` from rest; infinite where their counts differ.
pub fn moved(law: &Law, other: &Law) -> f64 {
    match (law, other) {
        (Law::Isotropic(a), Law::Isotropic(b)) => between(&a.log_moduli().centres, &b.log_moduli().centres),
        (Law::TransverselyIsotropic(a), Law::TransverselyIsotropic(b)) => {
            between(&a.parameters().centres, &b.parameters().centres)
        }
        (Law::Energy(a), Law::Energy(b)) => between(&a.log_moduli().centres, &b.log_moduli().centres),
        _ => f64::INFINITY,
    }
}

/// For each centre of the law but the first the nearest one before it, as pairs of numbers.
pub fn neighbours(law: &Law) -> Vec<(usize, usize)> {
    match law {
        Law::Isotropic(law) => nearest_before(&law.log_moduli().centres),
        Law::TransverselyIsotropic(law) => nearest_before(&law.parameters().centres),
        Law::Energy(law) => nearest_before(&law.log_moduli().centres),
        _ => Vec::new(),
    }
}

/// For each invariant of each centre but the first, the distance of that centre from the nearest other one.
pub fn spacings(law: &Law) -> Vec<f64> {
    match law {
        Law::Isotropic(law) => gaps(&law.log_moduli().centres),
        Law::TransverselyIsotropic(law) => gaps(&law.parameters().centres),
        _ => Vec::new(),
    }
}

fn gaps<const D: usize>(centres: &[[f64; D]]) -> Vec<f64> {
    let gap = |i: usize| {
        let others = (0..centres.len()).filter(|&j| j != i);
        let nearest = others.map(|j| squared(&centres[i], &centres[j]));
        nearest.fold(f64::INFINITY, f64::min).sqrt()
    };
    (1..centres.len()).flat_map(|i| [gap(i); D]).collect()
}

fn nearest_before<const D: usize>(centres: &[[f64; D]]) -> Vec<(usize, usize)> {
    (1..centres.len())
        .map(|i| {
            let gap = |j: usize| squared(&centres[i], &centres[j]);
            (
                i,
                (0..i).fold(0, |best, j| if gap(j) < gap(best) { j } else { best }),
            )
        })
        .collect()
}

fn between<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    if a.len() != b.len() {
        return f64::INFINITY;
    }
    let reach = a.iter().map(|c| squared(c, &[0.0; D])).fold(0.0, f64::max);
    let gap = |c: &[f64; D]| b.iter().map(|d| squared(c, d)).fold(f64::INFINITY, f64::min);
    let largest = a.iter().map(gap).fold(0.0, f64::max);
    if reach > 0.0 {
        (largest / reach).sqrt()
    } else {
        0.0
    }
}

fn squared<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).map(|d| (a[d] - b[d]) * (a[d] - b[d])).sum()
}

fn range_of<const D: usize>(met: impl Iterator<Item = [f64; D]>) -> Result<Range<D>, LawError> {
    let (mut low, mut high) = ([0.0_f64; D], [0.0_f64; D]);
    for q in met {
        for d in 0..D {
            low[d] = low[d].min((q[d] * 1e4).floor() / 1e4);
            high[d] = high[d].max((q[d] * 1e4).ceil() / 1e4);
        }
    }
    Range::new(low, high)
}

/// Rest and up to `count − 1` centres that cover a cloud of weighted points, to six digits, so that a record shows what the
/// law holds.
fn cover<const D: usize>(cloud: &[([f64; D], f64)], count: usize) -> Vec<[f64; D]> {
    let rest = [0.0; D];
    let reach = cloud.iter().map(|(q, _)| squared(q, &rest)).fold(0.0, f64::max);
    let mut centres = vec![rest];
    let mut gaps: Vec<f64> = cloud.iter().map(|(q, _)| squared(q, &rest)).collect();
    while centres.len() < count {
        let score = |i: usize| cloud[i].1 * gaps[i];
        let next = (0..cloud.len()).fold(None, |best: Option<usize>, i| match best {
            Some(b) if score(b) >= score(i) => best,
            _ => Some(i),
        });
        let Some(next) = next.filter(|&i| gaps[i] > MERGE * MERGE * reach) else {
            break;
        };
        let centre = cloud[next].0;
        centres.push(centre);
        for (gap, (q, _)) in gaps.iter_mut().zip(cloud) {
            *gap = gap.min(squared(q, &centre));
        }
    }
    for _ in 0..ITERATIONS {
        if !lloyd(cloud, &mut centres) {
            break;
        }
    }
    let mut apart: Vec<[f64; D]> = Vec::new();
    for centre in centres {
        let rounded = centre.map(|x| (x * 1e6).round() / 1e6);
        if apart.iter().all(|a| squared(a, &rounded) > MERGE * MERGE * reach) {
            apart.push(rounded);
        }
    }
    apart
}

/// Moves each centre but the first to the mean of the points that are nearest to it; false if none moved.
fn lloyd<const D: usize>(cloud: &[([f64; D], f64)], centres: &mut [[f64; D]]) -> bool {
    let mut sums = vec![([0.0; D], 0.0); centres.len()];
    for (q, w) in cloud {
        let mut nearest = (0, f64::INFINITY);
        for (j, c) in centres.iter().enumerate() {
            let gap = squared(q, c);
            if gap < nearest.1 {
                nearest = (j, gap);
            }
        }
        let (sum, weight) = &mut sums[nearest.0];
        (0..D).for_each(|d| sum[d] += w * q[d]);
        *weight += w;
    }
    let mut has_moved = false;
    for (centre, (sum, weight)) in centres.iter_mut().zip(&sums).skip(1) {
        if *weight > 0.0 {
            let mean = sum.map(|s| s / weight);
            has_moved |= squared(&mean, centre) > 1e-18;
            *centre = mean;
        }
    }
    has_moved
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two heaps and rest: the centres are rest and the heaps' weighted means, however the points are ordered.
    #[test]
    fn covers_heaps_by_their_means() {
        let mut cloud = Vec::new();
        for i in 0..10 {
            let t = f64::from(i) / 10.0;
            cloud.push(([1.0 + 0.01 * t, 0.0], 1.0));
            cloud.push(([0.0, -2.0 + 0.01 * t], 1.0 + t));
            cloud.push(([0.001 * t, 0.0], 1.0));
        }
        let centres = cover(&cloud, 3);
        assert_eq!(centres.len(), 3);
        assert_eq!(centres[0], [0.0, 0.0]);
        // Σ (1 + t)(0.01 t)/Σ (1 + t) over t = 0 … 0.9: (4.5 + 2.85)/14.5 · 0.01.
        assert!(
            (centres[1][1] + 2.0 - 0.01 * 7.35 / 14.5).abs() < 1e-6,
            "{centres:?}"
        );
        assert!((centres[2][0] - 1.0045).abs() < 1e-6, "{centres:?}");
        cloud.reverse();
        assert_eq!(cover(&cloud, 3), centres);
    }

    #[test]
    fn strains_too_near_give_fewer_centres() {
        let cloud = [([1.0], 1.0), ([1.0001], 1.0)];
        assert_eq!(cover(&cloud, 6).len(), 2);
        assert_eq!(cover::<2>(&[], 6), vec![[0.0, 0.0]]);
    }
}
