//! Progress of long work on a terminal; silent anywhere else.

use crate::design::search::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// The progress of a search.
pub struct SearchBar {
    bar: ProgressBar,
}

impl SearchBar {
    /// A bar on standard error, hidden if that is no terminal or `quiet` is set.
    pub fn new(quiet: bool) -> SearchBar {
        let bar = ProgressBar::new(0);
        if quiet || !std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template("{msg} {bar:30} {pos}/{len} layouts {per_sec} {eta}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        SearchBar { bar }
    }

    /// Layout `done` of the batch is simulated.
    pub fn show(&self, progress: &Progress, done: usize) {
        if done == 0 {
            let [level, levels] = progress.level;
            let step = if levels > 0 {
                format!(" {level}/{levels}")
            } else {
                String::new()
            };
            let best = if progress.best_mm.is_finite() {
                let gap = progress.best_mm - progress.bound_mm;
                format!(", best {:.4} mm, gap {gap:.4} mm", progress.best_mm)
            } else {
                String::new()
            };
            self.bar.reset();
            self.bar.set_length(progress.batch as u64);
            self.bar.set_message(format!("{}{step}{best}", progress.phase));
        }
        self.bar.set_position(done as u64);
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
