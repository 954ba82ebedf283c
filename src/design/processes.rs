//! Many processes, on one machine or more, that simulate one search's layouts together, by MPI.
//!
//! The first process (rank 0) leads: it searches, keeps the journal, and writes. The others only answer. Layout k of a batch
//! goes to process k mod n, so each gets alike work, and the answers are gathered in the order asked. A response depends on
//! its layout alone, so the search is the same on any number of processes.
//!
//! Mixtures of voxels are shared by examples: each process presses its own, and differentiates their readings.

use super::search::{Bench, Progress};
use super::voxels::bench::MixtureBench;
use crate::fem::mixture::{MixtureError, Reading};
use crate::fem::rig::{Layout, Response, Rig};
use mpi::datatype::PartitionMut;
use mpi::environment::Universe;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use nalgebra::DMatrix;
use std::cell::Cell;
use std::ops::Range;

/// What the leader asks for: a bench's number, how many layouts, cells in each.
type Order = [u64; 3];
/// The bench's number in the order that ends it.
const NO_MORE: u64 = u64::MAX;
/// In the order to press mixtures: numbers in what follows.
const PRESS: u64 = u64::MAX - 1;
/// In the order to differentiate: numbers in shares and in readings.
const DIFFERENTIATE: u64 = u64::MAX - 2;
/// In place of whole (1) or not (0): was not simulated.
const NOT_SIMULATED: f64 = -1.0;

/// The processes of this run.
pub struct Processes {
    // Dropped last: it ends MPI.
    world: SimpleCommunicator,
    is_waited_for: Cell<bool>,
    _universe: Universe,
}

impl Processes {
    /// The processes that `mpirun` started; `None` if it started none or one.
    pub fn join() -> Option<Processes> {
        let names = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"];
        if !names.iter().any(|name| std::env::var_os(name).is_some()) {
            return None;
        }
        let universe = mpi::initialize()?;
        let world = universe.world();
        (world.size() > 1).then_some(Processes {
            world,
            is_waited_for: Cell::new(false),
            _universe: universe,
        })
    }

    /// Is this the process that searches and writes?
    pub fn leads(&self) -> bool {
        self.world.rank() == 0
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.world.size() as usize
    }

    /// The leader's bench number `number`: batches are shared among all processes, of which this one uses `own`.
    pub fn bench<'a>(&'a self, number: usize, own: Box<dyn Bench + 'a>, components: usize) -> Shared<'a> {
        self.is_waited_for.set(true);
        Shared {
            processes: self,
            number: number as u64,
            own,
            components,
        }
    }

    /// The leader's bench of mixtures: `own` answers for this process' [`Processes::presses`].
    pub fn mixtures<'a>(&'a self, own: Box<dyn MixtureBench + 'a>, rig: &'a Rig) -> SharedMixtures<'a> {
        self.is_waited_for.set(true);
        SharedMixtures {
            processes: self,
            own,
            rig,
        }
    }

    /// The examples of `rig` that this process presses where mixtures are.
    pub fn presses(&self, rig: &Rig) -> Range<usize> {
        self.presses_of(self.world.rank() as usize, rig)
    }

    fn presses_of(&self, rank: usize, rig: &Rig) -> Range<usize> {
        let start = |rank: usize| rig.presses.len() * rank / self.count();
        start(rank)..start(rank + 1)
    }

    /// Answers the leader's orders with the bench of mixtures `own`, until it has no more.
    pub fn serve_mixtures(&self, own: &mut dyn MixtureBench) {
        let leader = self.world.process_at_rank(0);
        loop {
            let mut order: Order = [NO_MORE, 0, 0];
            leader.broadcast_into(&mut order);
            let mut numbers = vec![0.0; (order[1] + order[2]) as usize];
            let answer = match order[0] {
                PRESS => {
                    leader.broadcast_into(&mut numbers);
                    packed_press(own.press(&numbers[1..], numbers[0]))
                }
                DIFFERENTIATE => {
                    leader.broadcast_into(&mut numbers);
                    let (shares, readings) = numbers.split_at(order[1] as usize);
                    let readings = unpacked_readings(readings);
                    packed_derivatives(own.derivatives(&shares[1..], shares[0], &readings))
                }
                _ => return,
            };
            let size = answer.len() as u64;
            leader.gather_into(&size);
            leader.gather_varcount_into(&answer);
        }
    }

    /// Answers the leader's orders with the benches `own`, until it has no more.
    pub fn serve(&self, mut own: Vec<Box<dyn Bench + '_>>, components: usize) {
        let leader = self.world.process_at_rank(0);
        let idle = Progress {
            phase: "serving",
            level: [0, 0],
            batch: 0,
            best_mm: f64::INFINITY,
            bound_mm: 0.0,
        };
        loop {
            let mut order: Order = [NO_MORE, 0, 0];
            leader.broadcast_into(&mut order);
            let Some(bench) = usize::try_from(order[0]).ok().and_then(|n| own.get_mut(n)) else {
                return;
            };
            let mut cells = vec![0u8; (order[1] * order[2]) as usize];
            leader.broadcast_into(&mut cells);
            let answer = self.answer(bench.as_mut(), &cells, order[2] as usize, &idle, components);
            leader.gather_varcount_into(&answer);
        }
    }

    /// This process' share of a batch, simulated and packed, `(share × (1 + components))`.
    fn answer(
        &self,
        bench: &mut dyn Bench,
        cells: &[u8],
        size: usize,
        progress: &Progress,
        components: usize,
    ) -> Vec<f64> {
        let (rank, count) = (self.world.rank() as usize, self.count());
        let share: Vec<Layout> = cells
            .chunks(size.max(1))
            .skip(rank)
            .step_by(count)
            .map(<[u8]>::to_vec)
            .collect();
        let mut packed = Vec::with_capacity(share.len() * (1 + components));
        for response in bench.respond(&share, progress) {
            match response {
                Some(response) => {
                    packed.push(f64::from(u8::from(response.complete)));
                    packed.extend(response.displacements);
                }
                None => {
                    packed.push(NOT_SIMULATED);
                    packed.resize(packed.len() + components, f64::NAN);
                }
            }
        }
        packed
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        if self.leads() && self.is_waited_for.get() {
            let mut order: Order = [NO_MORE, 0, 0];
            self.world.process_at_rank(0).broadcast_into(&mut order);
        }
    }
}

/// A bench of all processes.
pub struct Shared<'a> {
    processes: &'a Processes,
    number: u64,
    own: Box<dyn Bench + 'a>,
    components: usize,
}

impl Bench for Shared<'_> {
    fn respond(&mut self, layouts: &[Layout], progress: &Progress) -> Vec<Option<Response>> {
        let (count, width) = (self.processes.count(), 1 + self.components);
        let size = layouts.first().map_or(0, Vec::len);
        let leader = self.processes.world.process_at_rank(0);
        let mut order: Order = [self.number, layouts.len() as u64, size as u64];
        leader.broadcast_into(&mut order);
        let mut cells = layouts.concat();
        leader.broadcast_into(&mut cells);
        let own = self
            .processes
            .answer(self.own.as_mut(), &cells, size, progress, self.components);
        let shares: Vec<usize> = (0..count)
            .map(|rank| layouts.len().saturating_sub(rank).div_ceil(count))
            .collect();
        let counts: Vec<i32> = shares.iter().map(|n| (n * width) as i32).collect();
        let starts: Vec<i32> = counts
            .iter()
            .scan(0, |sum, n| Some(std::mem::replace(sum, *sum + n)))
            .collect();
        let mut all = vec![0.0; layouts.len() * width];
        leader.gather_varcount_into_root(&own, &mut PartitionMut::new(&mut all, counts, starts.as_slice()));
        let mut answers = vec![None; layouts.len()];
        for rank in 0..count {
            let from = starts[rank] as usize;
            for (k, packed) in all[from..from + shares[rank] * width].chunks(width).enumerate() {
                answers[rank + k * count] = (packed[0] != NOT_SIMULATED).then(|| Response {
                    displacements: packed[1..].to_vec(),
                    complete: packed[0] == 1.0,
                });
            }
        }
        answers
    }
}

/// A bench of all processes for mixtures.
pub struct SharedMixtures<'a> {
    processes: &'a Processes,
    own: Box<dyn MixtureBench + 'a>,
    rig: &'a Rig,
}

impl SharedMixtures<'_> {
    /// The answers of all processes, in order; each begins with whole (1) or not (0), or that there is none.
    fn gathered(&self, own: &[f64]) -> Vec<Vec<f64>> {
        let leader = self.processes.world.process_at_rank(0);
        let mut sizes = vec![0u64; self.processes.count()];
        leader.gather_into_root(&(own.len() as u64), &mut sizes);
        let counts: Vec<i32> = sizes.iter().map(|&n| n as i32).collect();
        let starts: Vec<i32> = counts
            .iter()
            .scan(0, |sum, n| Some(std::mem::replace(sum, *sum + n)))
            .collect();
        let mut all = vec![0.0; sizes.iter().sum::<u64>() as usize];
        leader.gather_varcount_into_root(own, &mut PartitionMut::new(&mut all, counts, starts.as_slice()));
        let mut rest = all.as_slice();
        sizes
            .iter()
            .map(|&n| {
                let (own, others) = rest.split_at(n as usize);
                rest = others;
                own.to_vec()
            })
            .collect()
    }

    fn order(&self, kind: u64, numbers: &mut Vec<f64>, readings: usize) {
        let leader = self.processes.world.process_at_rank(0);
        let mut order: Order = [kind, (numbers.len() - readings) as u64, readings as u64];
        leader.broadcast_into(&mut order);
        leader.broadcast_into(numbers);
    }
}

impl MixtureBench for SharedMixtures<'_> {
    fn press(&mut self, shares: &[f64], tolerance: f64) -> Result<Option<Response>, MixtureError> {
        let mut numbers = [&[tolerance], shares].concat();
        self.order(PRESS, &mut numbers, 0);
        let own = self.own.press(shares, tolerance);
        let answers = self.gathered(&packed_press(own));
        if answers.iter().any(|a| a[0] == NOT_SIMULATED) {
            return Ok(None);
        }
        Ok(Some(Response {
            complete: answers.iter().all(|a| a[0] == 1.0),
            displacements: answers.iter().flat_map(|a| a[1..].to_vec()).collect(),
        }))
    }

    fn derivatives(
        &mut self,
        shares: &[f64],
        tolerance: f64,
        readings: &[Reading],
    ) -> Result<Option<DMatrix<f64>>, MixtureError> {
        let packed = packed_readings(readings);
        let mut numbers = [&[tolerance], shares, packed.as_slice()].concat();
        self.order(DIFFERENTIATE, &mut numbers, packed.len());
        let own = self.own.derivatives(shares, tolerance, readings);
        let answers = self.gathered(&packed_derivatives(own));
        if answers.iter().any(|a| a[0] == NOT_SIMULATED) {
            return Ok(None);
        }
        let rows = |rank: usize| {
            let presses = self.processes.presses_of(rank, self.rig);
            readings.iter().filter(|r| presses.contains(&r.press)).count()
        };
        let mut all = DMatrix::zeros(readings.len(), shares.len());
        let mut row = 0;
        for (rank, answer) in answers.iter().enumerate() {
            let part = DMatrix::from_column_slice(rows(rank), shares.len(), &answer[1..]);
            all.rows_mut(row, part.nrows()).copy_from(&part);
            row += part.nrows();
        }
        Ok(Some(all))
    }
}

/// A process that fails says that it was stopped, so that none waits for it.
fn packed_press(answer: Result<Option<Response>, MixtureError>) -> Vec<f64> {
    match answer {
        Ok(Some(response)) => {
            let complete = f64::from(u8::from(response.complete));
            [&[complete], response.displacements.as_slice()].concat()
        }
        _ => vec![NOT_SIMULATED],
    }
}

fn packed_derivatives(answer: Result<Option<DMatrix<f64>>, MixtureError>) -> Vec<f64> {
    match answer {
        Ok(Some(derivatives)) => [&[1.0], derivatives.as_slice()].concat(),
        _ => vec![NOT_SIMULATED],
    }
}

fn packed_readings(readings: &[Reading]) -> Vec<f64> {
    let one = |r: &Reading| {
        let head = [r.press as f64, r.level as f64, r.weights.len() as f64];
        [&head, r.weights.as_slice()].concat()
    };
    readings.iter().flat_map(one).collect()
}

fn unpacked_readings(mut numbers: &[f64]) -> Vec<Reading> {
    let mut readings = Vec::new();
    while let [press, level, count, rest @ ..] = numbers {
        let (weights, others) = rest.split_at(*count as usize);
        readings.push(Reading {
            press: *press as usize,
            level: *level as usize,
            weights: weights.to_vec(),
        });
        numbers = others;
    }
    readings
}
