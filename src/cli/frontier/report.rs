//! What `halflight frontier` tells: a table for people, the JSON report, and the formal solution as CSV.

use std::fmt::Write as _;
use std::path::PathBuf;

use serde::Serialize;

use crate::cli::frontier::{Study, Traced};
use crate::operator::Bounds;
use crate::study::frontier::{Formal, Run, Timing};

/// `halflight frontier --json`
#[derive(Serialize)]
pub struct Report {
    scene: String,
    patches: usize,
    tau: f64,
    /// The mean diverges beyond.
    alpha_c: f64,
    /// The path tracer's variance is infinite beyond.
    alpha_variance: f64,
    runs: Vec<RunReport>,
    formal: Option<FormalReport>,
    spread: Vec<SpreadReport>,
    files: Vec<PathBuf>,
}

#[derive(Serialize)]
struct RunReport {
    share: f64,
    alpha: f64,
    spectral_radius: Bounds,
    norm_of_k: f64,
    verdict: &'static str,
    terms: Option<usize>,
    products_extrapolated: Option<usize>,
    seconds: Timing,
    shooting: &'static str,
    shots_per_patch: f64,
    unshot: f64,
}

#[derive(Serialize)]
struct FormalReport {
    /// Says what this is not.
    label: &'static str,
    alpha: f64,
    smallest: f64,
    largest: f64,
    negative_patches: usize,
}

#[derive(Serialize)]
struct SpreadReport {
    alpha: f64,
    predicted_exponent: f64,
    measured_exponent: f64,
    standard_error: f64,
    points: Vec<SpreadPoint>,
}

#[derive(Serialize)]
struct SpreadPoint {
    paths: u64,
    spread: f64,
    reported: f64,
}

/// What is written on everything that shows a formal solution.
pub const NOT_LIGHT: &str = "formal solution of (I - K) L = E beyond the frontier: not light";

impl Study<'_> {
    /// The JSON report.
    pub fn report(
        &self,
        found: &[Run],
        beyond: Option<&(f64, Formal)>,
        traced: &[Traced],
        files: Vec<PathBuf>,
    ) -> Report {
        Report {
            scene: self.scene.name.clone(),
            patches: self.prepared.patches.len(),
            tau: self.tau,
            alpha_c: self.alpha_c,
            alpha_variance: self.alpha_variance,
            runs: found.iter().map(run_report).collect(),
            formal: beyond.map(|(alpha, f)| FormalReport {
                label: NOT_LIGHT,
                alpha: *alpha,
                smallest: f.smallest,
                largest: f.largest,
                negative_patches: f.negative,
            }),
            spread: traced.iter().map(spread_report).collect(),
            files,
        }
    }
}

/// One line a run.
pub fn table(found: &[Run]) -> String {
    let mut text = String::from(
        "    of                 spectral                  products with K      seconds of Neumann, extra-     shots             shooting\n\
         alpha_c   alpha          radius norm(K)   terms  extrapolated    polated, LU, shooting over K   a patch    unshot      says\n",
    );
    let optional = |n: Option<usize>| n.map_or("-".into(), |n| n.to_string());
    let second = |s: Option<f64>| s.map_or("-".into(), |s| format!("{s:.4}"));
    for run in found {
        let report = run_report(run);
        let radius = format!("{:.4} to {:.4}", run.radius.lower, run.radius.upper);
        let t = run.seconds;
        let seconds = [t.neumann, t.extrapolated, t.direct, t.shooting].map(second);
        let _ = writeln!(
            text,
            "{:>7} {:>7.4} {radius:>16} {:>7.4} {:>7} {:>13} {:>31} {:>9.1} {:>9.2e} {:>10}",
            run.share,
            run.alpha,
            run.norm,
            optional(report.terms),
            optional(run.extrapolated),
            seconds.join(" "),
            report.shots_per_patch,
            report.unshot,
            report.shooting,
        );
    }
    text
}

fn run_report(run: &Run) -> RunReport {
    let last = run.shooting.last();
    RunReport {
        share: run.share,
        alpha: run.alpha,
        spectral_radius: run.radius,
        norm_of_k: run.norm,
        verdict: run.verdict.name(),
        terms: run.reached.then_some(run.bounds.len()),
        products_extrapolated: run.extrapolated,
        seconds: run.seconds,
        shooting: run.shot.name(),
        shots_per_patch: last.map_or(0.0, |s| s.sweeps),
        unshot: last.map_or(1.0, |s| s.unshot),
    }
}

fn spread_report(traced: &Traced) -> SpreadReport {
    let (slope, error) = traced.found.slope;
    let points =
        traced.found.spreads.iter().map(|s| SpreadPoint { paths: s.paths, spread: s.spread, reported: s.reported });
    SpreadReport {
        alpha: traced.alpha,
        predicted_exponent: -traced.exponent,
        measured_exponent: slope,
        standard_error: error,
        points: points.collect(),
    }
}

/// Every patch of the formal solution, labelled.
pub fn formal_csv(alpha: f64, formal: &Formal) -> String {
    let mut text = format!(
        "# {NOT_LIGHT}; alpha {alpha}\npatch,invisible_r,invisible_g,invisible_b,visible_r,visible_g,visible_b\n"
    );
    for (i, l) in formal.light.iter().enumerate() {
        let [a, b] = [l.invisible, l.visible];
        let _ = writeln!(text, "{i},{},{},{},{},{},{}", a.x, a.y, a.z, b.x, b.y, b.z);
    }
    text
}
