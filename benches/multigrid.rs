//! How the work of one linear step grows with the number of unknowns, solved by multigrid conjugate gradients, and from
//! which size on it wins over a Cholesky factor.
//!
//! `cargo bench --bench multigrid` runs the sizes up to 200 000 unknowns; `-- --largest=1000000` goes to a million (4 GiB,
//! about a minute); `--only=sole` picks by name; `--direct` factorises too, up to 120 000 unknowns.

#[path = "support/mod.rs"]
mod support;

use pliant::numerics::cholesky::{Cholesky, Method, Symbolic};
use pliant::numerics::linear_solver::LinearSolver;
use std::sync::Arc;
use support::{Material, Problem, argument, cube, peak_mib, seconds, sole};

fn main() {
    let largest: f64 =
        argument("largest").map_or(200_000.0, |a| a.parse().expect("--largest= takes a number"));
    let only = argument("only").unwrap_or_default();
    let direct = std::env::args().any(|a| a == "--direct");
    println!(
        "object, stiffness contrast, Poisson's ratio | unknowns | levels | model s | assembly s | matrices s | solve s | iterations | direct: factor s, solve s | peak MiB"
    );
    let sizes = [12, 16, 32, 48, 69];
    let layered = |contrast, poisson| Material { contrast, poisson };
    for (name, contrast, poisson) in [
        ("hex", 1.0, 0.3),
        ("hex", 100.0, 0.3),
        ("hex", 1.0, 0.45),
        ("hex", 1.0, 0.49),
        ("kuhn", 1.0, 0.3),
        ("kuhn", 100.0, 0.45),
    ] {
        for n in sizes
            .into_iter()
            .filter(|&n| 3.0 * (n as f64 + 1.0).powi(3) < 1.1 * largest)
        {
            if format!("{name}-{contrast}-{poisson}").contains(&only) {
                measure(
                    &cube(n, layered(contrast, poisson), name == "kuhn"),
                    contrast,
                    poisson,
                    direct,
                );
            }
        }
    }
    for (contrast, poisson) in [(1.0, 0.3), (100.0, 0.3), (1.0, 0.45)] {
        for (size, layers) in [(5.0, 5), (2.5, 8), (1.6, 14), (1.12, 19)] {
            // Three unknowns a node: area over element area, times levels.
            let unknowns = 3.0 * 20_000.0 / (size * size) * layers as f64;
            if unknowns < 1.1 * largest && format!("sole-{contrast}-{poisson}").contains(&only) {
                measure(
                    &sole(size, layers, layered(contrast, poisson)),
                    contrast,
                    poisson,
                    direct,
                );
            }
        }
    }
}

fn measure(problem: &Problem, contrast: f64, poisson: f64, direct: bool) {
    let symbolic = problem.model.symbolic();
    let n = problem.model.unknowns();
    let mut values = Vec::new();
    let assembly = seconds(|| values = problem.stiffness());
    let (mut iterative, mut levels) = (None, 0);
    let prepared = seconds(|| {
        let by = if symbolic.method() == Method::Iterative {
            symbolic.clone()
        } else {
            let (pattern, sites) = (symbolic.pattern().clone(), symbolic.sites().cloned());
            Arc::new(Symbolic::by(Method::Iterative, pattern, sites).expect("it fits"))
        };
        levels = by.hierarchy().expect("it has sites").sites().len();
        iterative = Some(LinearSolver::new(by).expect("it fits"));
    });
    let mut iterative = iterative.expect("made above");
    let taken = seconds(|| iterative.factorise(&values).expect("it is held"));
    let mut x = problem.load.clone();
    let solved = seconds(|| iterative.solve(&mut x));
    let outcome = iterative.last().expect("solved above");
    let direct = if direct && n < 120_000 {
        factorised(problem, &values, &x)
    } else {
        String::new()
    };
    println!(
        "{}, {contrast}, {poisson} | {n} | {levels} | {prepared:.2} | {assembly:.2} | {taken:.2} | {solved:.2} | {} {:?} | {direct} | {:.0}",
        problem.name,
        outcome.iterations,
        outcome.ended,
        peak_mib(),
    );
}

fn factorised(problem: &Problem, values: &[f64], other: &[f64]) -> String {
    let pattern = problem.model.symbolic().pattern().clone();
    let symbolic = Arc::new(Symbolic::new(pattern).expect("it fits"));
    let mut cholesky = Cholesky::new(symbolic).expect("it fits");
    let factor = seconds(|| cholesky.factorise(values).expect("it is held"));
    let mut x = problem.load.clone();
    let solve = seconds(|| cholesky.solve(&mut x));
    let apart = x
        .iter()
        .zip(other)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt();
    let size = x.iter().map(|a| a * a).sum::<f64>().sqrt();
    format!("{factor:.2}, {solve:.3}, apart {:.0e}", apart / size)
}
