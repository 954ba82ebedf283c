//! The door to the library: everything happens in [`pliant::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    pliant::cli::main()
}
