//! Many processes, on one machine or more, that simulate one search's layouts together, by MPI.
//!
//! The first process (rank 0) leads: it searches, keeps the journal, and writes. The others only answer. Layout k of a batch
//! goes to process k mod n, so each gets alike work, and the answers are gathered in the order asked. A response depends on
//! its layout alone, so the search is the same on any number of processes.

use super::search::{Bench, Progress};
use crate::fem::rig::{Layout, Response};
use mpi::datatype::PartitionMut;
use mpi::environment::Universe;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use std::cell::Cell;

/// What the leader asks for: a bench's number, how many layouts, cells in each.
type Order = [u64; 3];
/// The bench's number in the order that ends it.
const NO_MORE: u64 = u64::MAX;
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
