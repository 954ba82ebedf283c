//! The fit: a homogeneous law, then centres over the strains that it meets, in rounds, and the forces under the probe.
//!
//! ```text
//! linear law at small strain → homogeneous law → [ strains met → centres → all presses at once ] × rounds
//!                                              → centres move with the moduli → to the end
//! ```
//!
//! Tangential forces under the probe are estimated after the homogeneous law and after the rounds, each time in turns with
//! fits, and are kept if the markers elsewhere are better for them.
//!
//! Each arrow but the first is a Levenberg–Marquardt minimisation of `problem.rs`; a step to a law that the specimen does
//! not stand is refused and shortened. A fit of rounds ends when the centres stay where they are. Source: Bickel 2010, 8.3.

use super::centres::{strains_met, with_range};
use super::errors::{Errors, errors};
use super::press::{Failure, PressedSpecimen};
use super::spread::{self, Final, PressCurve, Spread};
use super::stages::{Descent, Fitter, size};
use super::start::Symmetry;
use crate::fem::measurement_set::{MeasurementSet, Origin};
use crate::material::law::{Law, LawError};
use crate::math::Vec3;
use crate::numerics::least_squares::{LeastSquaresError, Stop};
use std::time::Instant;

/// How to fit.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeOptions {
    /// Centres, rest among them; 1 for a homogeneous law. `None`: 6 for an isotropic law, 12 for a transversely isotropic one.
    pub centres: Option<usize>,
    /// Most rounds of placing centres and fitting. Default 6.
    pub rounds: usize,
    /// Most Levenberg–Marquardt steps of a round. Default 40.
    pub iterations: usize,
    /// Whether the centres move with the moduli after the rounds. Default true.
    pub moves_centres: bool,
    /// Moving centres end when a step lowers the cost by less than this part: they creep near the end, for little gain.
    /// Default 0.005.
    pub move_tolerance: f64,
    /// Whether tangential forces under the probe are estimated where markers tell them. Default true.
    pub tangential: bool,
    /// Refits of the bootstrap; 0 for none. Default 0.
    pub bootstrap: usize,
    /// Seed of the bootstrap. Default 1.
    pub seed: u64,
}

impl ProbeOptions {
    /// The defaults for a set: the forces of a computed one are known, so nothing is estimated under the probe.
    pub fn suited(set: &MeasurementSet) -> ProbeOptions {
        ProbeOptions {
            tangential: set.origin == Origin::Measured,
            ..ProbeOptions::default()
        }
    }
}

impl Default for ProbeOptions {
    fn default() -> ProbeOptions {
        ProbeOptions {
            centres: None,
            rounds: 6,
            iterations: 40,
            moves_centres: true,
            move_tolerance: 5e-3,
            tangential: true,
            bootstrap: 0,
            seed: 1,
        }
    }
}

/// Why no law could be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProbeError {
    /// An option out of its range.
    #[error("{field} = {value}: expected {expected}")]
    Option {
        /// Name of the option.
        field: &'static str,
        /// The value found.
        value: usize,
        /// What was expected.
        expected: &'static str,
    },
    /// Nothing to fit.
    #[error(
        "no example has a reading to fit: all {held_out} held-out examples are for comparison, and {empty} others have no reading"
    )]
    Nothing {
        /// Examples that are held out.
        held_out: usize,
        /// Others without a reading.
        empty: usize,
    },
    /// A deviation that is no weight.
    #[error("example {press:?}: a standard deviation of {value} mm: expected a positive number")]
    Deviation {
        /// Name of the example.
        press: String,
        /// The value found \[mm\].
        value: f64,
    },
    /// The readings go against the forces.
    #[error(
        "the measured displacements go against the forces (the best linear material has a negative modulus): check the signs and the axes"
    )]
    Backwards,
    /// The specimen does not stand its presses with any law that was tried.
    #[error("no law was found with which the specimen stands its presses: {0}")]
    Stands(#[from] Failure),
    /// The minimiser.
    #[error(transparent)]
    LeastSquares(#[from] LeastSquaresError),
    /// Moduli that make no law.
    #[error(transparent)]
    Law(#[from] LawError),
    /// Asked to stop before there was anything.
    #[error("stopped on request, before there was a law")]
    Cancelled,
}

/// What a fit is doing.
#[derive(Clone, Debug)]
pub struct Step {
    /// In words.
    pub stage: String,
    /// Steps tried in this stage.
    pub iterations: usize,
    /// Root mean square of the residuals over their deviations.
    pub scaled_rms: f64,
}

/// One minimisation.
#[derive(Clone, Debug, PartialEq)]
pub struct Round {
    /// In words.
    pub stage: String,
    /// Centres of the law.
    pub centres: usize,
    /// Root mean square of the residuals over their deviations, at the end.
    pub scaled_rms: f64,
    /// Steps tried.
    pub iterations: usize,
    /// Laws that were solved for.
    pub evaluations: usize,
    /// Why it stopped.
    pub stop: Stop,
}

/// What was found about the forces under the probe.
#[derive(Clone, Debug, PartialEq)]
pub enum Tangential {
    /// Not asked for.
    Off,
    /// No marker under a probe tells them.
    Untold,
    /// Estimated, but the markers elsewhere were no better for it; taken back.
    Dropped,
    /// Estimated and used, `(presses × levels)` \[N\].
    Used {
        /// Presses that they were estimated for, and their forces.
        forces: Vec<(String, Vec<Vec3>)>,
        /// Root mean square of the scaled residuals of the markers that are not under a probe, without these forces and
        /// with them.
        elsewhere: [f64; 2],
    },
}

/// What a fit came to.
#[derive(Clone, Debug)]
pub struct ProbeFit {
    /// The law; its range is the box of invariants that the presses met.
    pub law: Law,
    /// The homogeneous law that the centres came from.
    pub homogeneous: Law,
    /// The minimisations, in order.
    pub rounds: Vec<Round>,
    /// Did the centres settle, rather than the rounds run out?
    pub has_settled: bool,
    /// Why the last minimisation stopped.
    pub stop: Stop,
    /// Starts that were tried.
    pub starts: usize,
    /// The forces under the probe.
    pub tangential: Tangential,
    /// Errors of the examples that were fitted.
    pub errors: Errors,
    /// Errors of those that were held out; `None` where there are none, and the reason where the law does not stand them.
    pub held_out: Option<Result<Errors, Failure>>,
    /// Force–displacement curves, of the fitted examples first.
    pub curves: Vec<PressCurve>,
    /// What the data leave open; `None` where the readings are too few.
    pub spread: Option<Spread>,
    /// Least and largest normal strain along the specimen's axes that an integration point met.
    pub strain: [f64; 2],
    /// Readings that were fitted.
    pub readings: usize,
    /// Wall time \[s\].
    pub seconds: f64,
}

impl ProbeFit {
    /// Did the last minimisation end because there was nothing left to gain?
    pub fn has_converged(&self) -> bool {
        !matches!(self.stop, Stop::Iterations | Stop::Cancelled)
    }
}

/// Fits a law to the presses of `pressed` that are not held out; tangential forces that are found go into its presses.
///
/// # Errors
/// [`ProbeError`]: no readings, readings that go against the forces, a specimen that no law holds up.
pub fn fit(
    pressed: &mut PressedSpecimen,
    symmetry: Symmetry,
    options: &ProbeOptions,
    cancelled: &(dyn Fn() -> bool + Sync),
    news: &mut dyn FnMut(&Step),
) -> Result<ProbeFit, ProbeError> {
    let began = Instant::now();
    let which = check(pressed, options)?;
    let mut fitter = Fitter {
        symmetry,
        options,
        size: size(pressed, &which),
        which,
        cancelled,
        news,
        rounds: Vec::new(),
    };
    let (homogeneous, starts) = fitter.homogeneous(pressed)?;
    let first = homogeneous.law.clone();
    let homogeneous = fitter.alternate(pressed, homogeneous)?;
    let (found, has_settled) = fitter.rounds(pressed, homogeneous)?;
    let (found, tangential) = fitter.tangential(pressed, found)?;
    let found = fitter.moved(pressed, found)?;
    let found = fitter.last(pressed, found)?;
    fitter.outcome(pressed, found, first, (starts, has_settled, tangential), began)
}

/// The presses to be fitted.
fn check(pressed: &PressedSpecimen, options: &ProbeOptions) -> Result<Vec<usize>, ProbeError> {
    for (field, value, least) in [
        ("centres", options.centres.unwrap_or(1), 1),
        ("rounds", options.rounds, 1),
        ("iterations", options.iterations, 1),
    ] {
        if value < least || value > 1000 {
            let expected = "a number from 1 to 1000";
            return Err(ProbeError::Option {
                field,
                value,
                expected,
            });
        }
    }
    for press in &pressed.presses {
        for (deviations, readings) in press.deviations.iter().zip(&press.readings) {
            for (&value, _) in deviations.iter().zip(readings).filter(|(_, r)| r.is_some()) {
                if !(value > 0.0 && value.is_finite()) {
                    return Err(ProbeError::Deviation {
                        press: press.name.clone(),
                        value,
                    });
                }
            }
        }
    }
    let has_reading = |k: &usize| pressed.presses[*k].readings.iter().flatten().any(Option::is_some);
    let all = 0..pressed.presses.len();
    let (held_out, rest): (Vec<usize>, Vec<usize>) = all.partition(|&k| pressed.presses[k].held_out);
    let which: Vec<usize> = rest.iter().copied().filter(has_reading).collect();
    if which.is_empty() {
        return Err(ProbeError::Nothing {
            held_out: held_out.len(),
            empty: rest.len(),
        });
    }
    Ok(which)
}

impl Fitter<'_> {
    fn outcome(
        self,
        pressed: &PressedSpecimen,
        found: Descent,
        homogeneous: Law,
        (starts, has_settled, tangential): (usize, bool, Tangential),
        began: Instant,
    ) -> Result<ProbeFit, ProbeError> {
        let coordinates = self.symmetry.coordinates;
        let last = Final {
            coordinates,
            theta: &found.theta,
            free: &found.free,
            residual: &found.outcome.residual,
            jacobian: &found.outcome.jacobian,
            data_rows: found.data_rows,
        };
        let mut spread = last.spread();
        let slope = coordinates.slope(&found.theta);
        let refits = match self.options.bootstrap {
            0 => None,
            count => last.refits(
                &spread::markers_of_rows(pressed, &self.which),
                count,
                self.options.seed,
            ),
        };
        if let (Some(spread), Some(refits)) = (&mut spread, &refits) {
            spread.covariance = spread::bootstrap_covariance(&slope, refits);
            spread.basis = format!("bootstrap of {} (wild, by markers, linearised)", refits.len());
        }
        let refits = refits.as_ref().map(|r| (&slope, r.as_slice()));
        let mut curves = spread::curves(pressed, &self.which, &found.law, &found.equilibria, refits)?;
        let others: Vec<usize> = (0..pressed.presses.len())
            .filter(|&k| pressed.presses[k].held_out)
            .collect();
        let held_out = if others.is_empty() {
            None
        } else {
            // Ctrl-C was for the fit; what it found is still to be compared.
            Some(match pressed.equilibria(&found.law, &others, &|| false) {
                Ok(equilibria) => {
                    curves.extend(spread::curves(pressed, &others, &found.law, &equilibria, refits)?);
                    Ok(errors(pressed, &others, &equilibria))
                }
                Err(failure) => Err(failure),
            })
        };
        let met = strains_met(pressed, &found.law, &found.equilibria);
        let strain = met
            .iter()
            .flat_map(|m| [m.strain[0], m.strain[1], m.strain[2]])
            .fold([0.0_f64; 2], |[l, h], e| [l.min(e), h.max(e)]);
        Ok(ProbeFit {
            law: rounded(&with_range(&found.law, &met)?)?,
            homogeneous,
            has_settled,
            stop: match (self.cancelled)() {
                true => Stop::Cancelled,
                false => found.outcome.stop,
            },
            starts,
            tangential,
            errors: errors(pressed, &self.which, &found.equilibria),
            held_out,
            curves,
            spread,
            strain,
            readings: found.data_rows,
            rounds: self.rounds,
            seconds: began.elapsed().as_secs_f64(),
        })
    }
}

/// Six decimals: far below the fit's error, and a refit on another machine gives the same record.
fn rounded(law: &Law) -> Result<Law, LawError> {
    let values = law
        .parameters()
        .into_iter()
        .map(|p| (p.value * 1e6).round() / 1e6);
    law.with_parameters(&values.collect::<Vec<_>>())
}
