//! Many benches side by side: layouts are simulated in parallel, one thread each, and answered in the order asked.
//!
//! A response depends on its layout alone, so the search is the same on any number of threads.

use super::search::{Bench, Progress};
use crate::fem::equilibrium::Options;
use crate::fem::rig::{Layout, Response, Rig};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// All benches of a rig.
pub struct Workbench<'a> {
    rig: &'a Rig,
    options: Options,
    stop: &'a AtomicBool,
    watch: &'a (dyn Fn(&Progress, usize) + Sync),
    /// When to stop by itself.
    pub until: Option<Instant>,
}

impl<'a> Workbench<'a> {
    /// Benches for `rig`. Setting `stop` ends the batch under way; `watch` is told of every simulated layout, with the
    /// number in its batch.
    pub fn new(
        rig: &'a Rig,
        options: Options,
        stop: &'a AtomicBool,
        watch: &'a (dyn Fn(&Progress, usize) + Sync),
    ) -> Workbench<'a> {
        Workbench {
            rig,
            options,
            stop,
            watch,
            until: None,
        }
    }
}

impl Bench for Workbench<'_> {
    fn respond(&mut self, layouts: &[Layout], progress: &Progress) -> Vec<Option<Response>> {
        let done = std::sync::atomic::AtomicUsize::new(0);
        let cancelled =
            || self.stop.load(Ordering::Relaxed) || self.until.is_some_and(|until| Instant::now() >= until);
        let failed = || Response {
            displacements: vec![f64::NAN; self.rig.components()],
            complete: false,
        };
        (self.watch)(progress, 0);
        layouts
            .par_iter()
            .map_init(
                || self.rig.bench(),
                |bench, layout| {
                    if cancelled() {
                        return None;
                    }
                    let response = match bench {
                        Ok(bench) => bench.respond(layout, &self.options, &cancelled),
                        Err(_) => failed(),
                    };
                    (self.watch)(progress, done.fetch_add(1, Ordering::Relaxed) + 1);
                    // A curve that was cut short by the stop is no answer.
                    if cancelled() { None } else { Some(response) }
                },
            )
            .collect()
    }
}
