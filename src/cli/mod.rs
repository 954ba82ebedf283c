//! The command line: one file per subcommand, each turning raw arguments into checked options, calling the library,
//! and reporting. Exit codes: 0 done, 1 a negative answer, 2 an error.
//!
//! Rooms: [`replicate`], [`export`], [`simulate`], [`db`], [`fit`], [`measure`], [`object`], [`verify`]; what they share: [`terminal`] (output), [`progress`] (a
//! bar while a search runs), `searching` (a search with its journal and
//! processes), [`stop`] (Ctrl-C).

pub mod db;
pub mod export;
pub mod fit;
mod fit_coupon;
mod fit_probe;
pub mod measure;
pub mod object;
pub mod progress;
pub mod replicate;
mod replicate_outcome;
mod replicate_rules;
mod replicate_shape;
mod replicate_voxels;
mod searching;
pub mod simulate;
mod simulate_volume;
pub mod stop;
pub mod terminal;
pub mod verify;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Designs and fabricates deformable objects.
#[derive(Debug, Parser)]
#[command(name = "pliant", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Finds the layout of base materials that gives like the examples, and writes the printer's files
    Replicate(replicate::Arguments),
    /// Writes the printer's files of a layout that was found before
    Export(export::Arguments),
    /// Simulates a scene, or a layout that was found, and writes what ParaView and goals read
    Simulate(simulate::Arguments),
    /// Lists, shows and checks the materials of the database
    Db(db::Arguments),
    /// Fits materials to coupon tests, or to presses of a specimen, and writes their records
    Fit(fit::Arguments),
    /// Presses fine structures in the virtual laboratory and writes their measurement sets
    Measure(measure::Arguments),
    /// Makes the surface of a simple object, or inspects any mesh file
    Object(object::Arguments),
    /// Checks the mechanics against closed forms, other programs and measurements
    Verify(verify::Arguments),
}

/// What a command found out, once it ran to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Done, or yes: exit code 0.
    Done,
    /// No: exit code 1 (a record does not validate, a solve does not reach its load).
    Negative,
}

/// Reads the arguments, runs the command, and answers with the exit code.
pub fn main() -> ExitCode {
    // Terminals fold long lines themselves; folded here, an id would be cut at its hyphens and could not be copied.
    let _ = miette::set_hook(Box::new(|_| {
        Box::new(miette::MietteHandlerOpts::new().wrap_lines(false).build())
    }));
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    match run(&cli) {
        Ok(Answer::Done) => ExitCode::SUCCESS,
        Ok(Answer::Negative) => ExitCode::from(1),
        Err(report) => {
            terminal::complain(&report);
            ExitCode::from(2)
        }
    }
}

fn run(cli: &Cli) -> miette::Result<Answer> {
    match &cli.command {
        Command::Replicate(arguments) => replicate::run(arguments),
        Command::Export(arguments) => export::run(arguments),
        Command::Simulate(arguments) => simulate::run(arguments),
        Command::Db(arguments) => db::run(arguments),
        Command::Fit(arguments) => fit::run(arguments),
        Command::Measure(arguments) => measure::run(arguments),
        Command::Object(arguments) => object::run(arguments),
        Command::Verify(arguments) => verify::run(arguments),
    }
}
