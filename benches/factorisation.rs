//! Cholesky factorisation of elasticity matrices on regular and irregular meshes: orders of elimination side by side,
//! and CHOLMOD with METIS as the peer, in alternating rounds on one thread.
//!
//! `cargo bench --bench factorisation` times ours; `-- --orders` compares it with faer's minimum degree; `-- --peer=target/peers/cholmod` adds CHOLMOD (see
//! `benches/peers/cholmod.c`; set `OMP_THREAD_LIMIT=1` and unset `OPENBLAS_CORETYPE`); `--write=FOLDER` leaves the
//! matrices there; `--rounds=5`, `--only=cube`.

#[path = "support/mod.rs"]
mod support;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Par, Side, Spec};
use pliant::numerics::cholesky::{Cholesky, Pattern, Symbolic};
use std::io::Write;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;
use support::{Material, Problem, argument, cube, median, seconds, sole};

fn main() {
    let rounds: usize = argument("rounds").map_or(5, |a| a.parse().expect("--rounds= takes a count"));
    let only = argument("only").unwrap_or_default();
    let plain = Material {
        contrast: 1.0,
        poisson: 0.45,
    };
    println!(
        "object | unknowns | entries of L | ours: analysis, factor, solve ms | CHOLMOD + METIS: the same, entries | ratios factor, solve"
    );
    for n in [7, 12, 19, 30] {
        for tetrahedra in [false, true] {
            let kind = if tetrahedra { "cube-kuhn" } else { "cube-hex" };
            if kind.contains(&only) {
                compare(kind, &cube(n, plain, tetrahedra), rounds);
            }
        }
    }
    for (size, layers) in [(11.0, 2), (7.0, 3), (4.2, 5), (2.6, 8)] {
        if "sole".contains(&only) {
            compare("sole", &sole(size, layers, plain), rounds);
        }
    }
}

/// Milliseconds of one analysis, factorisation and solve, and the entries of the factor.
struct Times {
    analysis: f64,
    factor: f64,
    solve: f64,
    entries: usize,
}

fn compare(kind: &str, problem: &Problem, rounds: usize) {
    let pattern = problem.model.symbolic().pattern();
    let values = problem.stiffness();
    let n = pattern.unknowns();
    let folder = argument("write").map_or_else(std::env::temp_dir, PathBuf::from);
    let path = folder.join(format!("pliant-{kind}-{n}.bin"));
    let peer = argument("peer");
    if peer.is_some() || argument("write").is_some() {
        write_matrix(&path, pattern, &values).expect("the folder can be written to");
    }
    let repeats = (60_000 / n).clamp(1, 20);
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        ours.push(own_times(pattern, &values, repeats));
        if let Some(program) = &peer {
            theirs.push(peer_times(program, &path, repeats));
        }
    }
    if argument("write").is_none() {
        // Only there if a peer was asked for.
        let _ = std::fs::remove_file(&path);
    }
    let ours = middle(&ours);
    if std::env::args().any(|a| a == "--orders") {
        minimum_degree(pattern, &values, repeats);
    }
    print!(
        "{kind} | {n} | {} | {:.2}, {:.2}, {:.3} |",
        ours.entries, ours.analysis, ours.factor, ours.solve
    );
    if theirs.is_empty() {
        println!(" – | –");
        return;
    }
    let theirs = middle(&theirs);
    println!(
        " {:.2}, {:.2}, {:.3}, {} | {:.2}, {:.2}",
        theirs.analysis,
        theirs.factor,
        theirs.solve,
        theirs.entries,
        ours.factor / theirs.factor,
        ours.solve / theirs.solve
    );
}

fn middle(all: &[Times]) -> Times {
    let of = |pick: fn(&Times) -> f64| median(all.iter().map(pick).collect());
    Times {
        analysis: of(|t| t.analysis),
        factor: of(|t| t.factor),
        solve: of(|t| t.solve),
        entries: all[0].entries,
    }
}

fn own_times(pattern: &Pattern, values: &[f64], repeats: usize) -> Times {
    let copy = pattern.clone();
    let mut symbolic = None;
    let analysis = seconds(|| symbolic = Some(Symbolic::new(copy).expect("it fits")));
    let symbolic = Arc::new(symbolic.expect("made above"));
    let entries = symbolic.factor_entries().expect("it fits");
    let mut cholesky = Cholesky::new(symbolic).expect("it fits");
    let factor = (0..repeats).map(|_| seconds(|| cholesky.factorise(values).expect("it is held")));
    let factor = median(factor.collect());
    let mut x = vec![1.0; pattern.unknowns()];
    let solve = (0..repeats).map(|_| {
        x.fill(1.0);
        seconds(|| cholesky.solve(&mut x))
    });
    let solve = median(solve.collect());
    Times {
        analysis: 1e3 * analysis,
        factor: 1e3 * factor,
        solve: 1e3 * solve,
        entries,
    }
}

/// faer's own approximate minimum degree order on the same matrix.
fn minimum_degree(pattern: &Pattern, values: &[f64], repeats: usize) {
    let n = pattern.unknowns();
    let structure = SymbolicSparseColMatRef::new_checked(n, n, &pattern.columns, None, &pattern.rows);
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        ..Default::default()
    };
    let mut symbolic = None;
    let analysis = seconds(|| {
        symbolic = factorize_symbolic_cholesky(structure, Side::Lower, SymmetricOrdering::Amd, params).ok();
    });
    let symbolic = symbolic.expect("it fits");
    let mut factor = vec![0.0; symbolic.len_val()];
    let mut memory = MemBuffer::new(symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default()));
    let times = (0..repeats).map(|_| {
        seconds(|| {
            let done = symbolic.factorize_numeric_llt(
                &mut factor,
                SparseColMatRef::new(structure, values),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Spec::default(),
            );
            assert!(done.is_ok(), "it is held");
        })
    });
    let ms = 1e3 * median(times.collect());
    println!(
        "minimum degree: {} entries, {:.2}, {ms:.2} ms",
        symbolic.len_val(),
        1e3 * analysis
    );
}

fn peer_times(program: &str, matrix: &PathBuf, repeats: usize) -> Times {
    let output = Command::new(program)
        .arg(matrix)
        .arg(repeats.to_string())
        .output()
        .unwrap_or_else(|e| panic!("{program}: {e}; see benches/peers/cholmod.c"));
    let text = String::from_utf8_lossy(&output.stdout);
    let numbers: Vec<f64> = text.split_whitespace().filter_map(|t| t.parse().ok()).collect();
    let [analysis, factor, solve, entries] = numbers[..] else {
        panic!(
            "{program} said: {text} {}",
            String::from_utf8_lossy(&output.stderr)
        );
    };
    Times {
        analysis,
        factor,
        solve,
        entries: entries as usize,
    }
}

fn write_matrix(path: &PathBuf, pattern: &Pattern, values: &[f64]) -> std::io::Result<()> {
    let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
    let integers = [pattern.unknowns(), values.len()];
    for integer in integers.iter().chain(&pattern.columns).chain(&pattern.rows) {
        out.write_all(&(*integer as i64).to_le_bytes())?;
    }
    for value in values {
        out.write_all(&value.to_le_bytes())?;
    }
    out.flush()
}
