//! What each method does on both sides of the frontier where the series starts to diverge, at one tau, as tables and
//! charts: along alpha = share / radius(1, tau).
//!
//! ```text
//! cargo run --release --example frontier -- furnished-room --formal --trace --out docs
//! ```
//!
//! Not handled: scenes whose frontier lies beyond alpha = 1 at this tau.

mod charts;
#[path = "../common/mod.rs"]
mod common;
mod formal;
mod series;
mod slice;
mod spread;

use std::fmt::Write as _;
use std::process::ExitCode;

use clap::Parser;
use miette::MietteDiagnostic;

use crate::charts::{series_chart, shooting_chart, spread_chart};
use crate::common::{Failure, Output, end, open};
use crate::formal::formal;
use crate::series::{SeriesRun, Shot};
use crate::slice::Slice;
use crate::spread::{Traced, scaling};
use halflight::form_factors::Sampling;
use halflight::pictures::{make_directory, write_whole};
use halflight_plot::Chart;

/// alpha over alpha_c of the runs.
const SHARES: [f64; 4] = [0.9, 0.99, 0.999, BEYOND];
/// The one beyond the frontier.
const BEYOND: f64 = 1.1;
/// Repeats and doublings of the path tracer's error.
const REPEATS: usize = 128;
const DOUBLINGS: u32 = 12;

/// Shows what each method does on both sides of the frontier where the series starts to diverge.
#[derive(Parser, Debug)]
struct Arguments {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file
    #[arg(default_value = "furnished-room")]
    scene: String,
    /// Transmission, 0 to 1; a material's own tau is multiplied by it
    #[arg(long, value_name = "T", default_value_t = 1.0, value_parser = unit_interval)]
    tau: f64,
    /// About how many patches; true tails come from a dense solve
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..=1000))]
    patches: u32,
    /// Hemisphere rays from each patch
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    rays: u32,
    /// Solve (I - K) L = E beyond the frontier too: a solution, negative in places, and not light
    #[arg(long)]
    formal: bool,
    /// Measure how the path tracer's error shrinks on both sides of the frontier of its variance
    #[arg(long)]
    trace: bool,
    /// Where files go.
    #[command(flatten)]
    output: Output,
}

fn main() -> ExitCode {
    end(run(&Arguments::parse()))
}

/// Studies a scene at one tau.
fn run(own: &Arguments) -> Result<(), Failure> {
    let Output { out, seed } = &own.output;
    let slice = own.slice()?;
    make_directory(out)?;
    let (name, tau, alpha_c) = (&slice.scene.name, slice.tau, slice.alpha_c);
    let frontiers = format!("alpha_c = {alpha_c:.4}, variance frontier {:.4}", slice.alpha_variance);
    println!("{name} at tau {tau}: {frontiers}\n");
    let draw = |end: &str, what: &str, chart: &dyn Fn(String, String) -> Chart| {
        let caption =
            format!("{name} at tau {tau}: {} patches, {} rays each; {frontiers}.", slice.patches[1], own.rays);
        own.output.draw(&format!("{name}-frontier-{end}"), &chart(format!("{what}, {name}"), caption).drawing())
    };
    let shares = SHARES.into_iter().filter(|share| share * alpha_c <= 1.0);
    let runs: Vec<SeriesRun> = shares.map(|share| series::run(&slice, share)).collect();
    println!("{}", table(&runs));
    draw("series", "The series near its frontier", &|title, caption| series_chart(title, caption, &runs))?;
    draw("shooting", "Progressive shooting near the frontier", &|title, caption| {
        shooting_chart(title, caption, &runs)
    })?;
    if let Some(found) = own.formal.then(|| formal(&slice, (BEYOND * alpha_c).min(1.0))).flatten() {
        println!("{found}");
        write_whole(out.join(format!("{name}-frontier-formal-not-light.csv")), found.csv().as_bytes())?;
    }
    if own.trace {
        let traced = trace(&slice, *seed);
        traced.iter().for_each(|one| println!("{one}"));
        draw("spread", "The path tracer's error", &|title, caption| spread_chart(title, caption, &traced))?;
    }
    Ok(())
}

impl Arguments {
    /// Finds the frontiers: an error where memory or alpha ends before them.
    fn slice(&self) -> Result<Slice, Failure> {
        let sampling = Sampling { rays: self.rays, seed: self.output.seed, ..Sampling::default() };
        let slice = Slice::new(open(&self.scene)?, self.tau, self.patches as usize, sampling)?;
        if slice.alpha_c * SHARES[0] <= 1.0 {
            return Ok(slice);
        }
        let converges = MietteDiagnostic::new(format!(
            "at tau = {} the series of {} converges for every alpha up to 1: its spectral radius is {:.4} at most",
            slice.tau, slice.scene.name, slice.radius
        ));
        Err(converges
            .with_help("pass a larger --tau or another scene; `halflight map` shows where the frontier is")
            .into())
    }
}

/// The path tracer's error inside both frontiers, and between them.
fn trace(slice: &Slice, seed: u32) -> Vec<Traced> {
    let between = (slice.alpha_variance * slice.alpha_c).sqrt();
    let measure = |alpha: f64| {
        let measured = scaling(&slice.at(alpha), REPEATS, DOUBLINGS, seed);
        Traced { alpha, predicted: slice.exponent(alpha), measured }
    };
    [0.5 * slice.alpha_variance, between].map(measure).into()
}

/// One line a run.
fn table(found: &[SeriesRun]) -> String {
    let mut text = String::from(
        "    of                 spectral                  products with K      seconds of Neumann, extra-     shots             shooting\n\
         alpha_c   alpha          radius norm(K)   terms  extrapolated    polated, LU, shooting over K   a patch    unshot      says\n",
    );
    let optional = |n: Option<usize>| n.map_or("-".into(), |n| n.to_string());
    let second = |s: Option<f64>| s.map_or("-".into(), |s| format!("{s:.4}"));
    for run in found {
        let radius = format!("{:.4} to {:.4}", run.radius.lower, run.radius.upper);
        let last = run.shots.last().copied().unwrap_or(Shot { sweeps: 0.0, unshot: 1.0 });
        let _ = writeln!(
            text,
            "{:>7} {:>7.4} {radius:>16} {:>7.4} {:>7} {:>13} {:>31} {:>9.1} {:>9.2e} {:>10}",
            run.share,
            run.alpha,
            run.norm,
            optional(run.terms),
            optional(run.extrapolated),
            run.seconds.map(second).join(" "),
            last.sweeps,
            last.unshot,
            run.shot.name(),
        );
    }
    text
}

/// A number from 0 to 1.
fn unit_interval(text: &str) -> Result<f64, String> {
    let parsed = text.parse().ok().filter(|value| (0.0..=1.0).contains(value));
    parsed.ok_or_else(|| "must be a number from 0 to 1".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::solve::Verdict;

    fn slice(scene: &str) -> Result<Slice, Failure> {
        Arguments::try_parse_from(["frontier", scene, "--patches", "60", "--rays", "64"]).unwrap().slice()
    }

    #[test]
    fn both_sides_are_told_apart_and_what_is_not_light_is_labelled() {
        let slice = slice("furnished-room").unwrap();
        assert!(slice.alpha_variance < slice.alpha_c);
        let runs = [SHARES[0], BEYOND].map(|share| series::run(&slice, share));
        assert_eq!(runs.each_ref().map(|run| run.shot), [Verdict::Converges, Verdict::Diverges]);
        // What is proved holds, to what f32 leaves of the whole.
        let [inside, beyond] = &runs;
        assert_eq!(inside.terms, Some(inside.bounds.len()));
        let pairs = inside.tails[1..].iter().zip(&inside.bounds);
        assert!(pairs.clone().all(|(tail, bound)| *tail <= bound + 1e-5 * inside.tails[0]));
        assert!(beyond.terms.is_none() && beyond.tails.is_empty() && beyond.norms.last() > Some(&beyond.norms[1]));
        assert_eq!(table(&runs).lines().count(), 4);
        let found = formal(&slice, BEYOND * slice.alpha_c).unwrap();
        assert!(
            found.negative() > 0 && found.csv().starts_with("# formal solution") && found.csv().contains("not light")
        );
        assert_eq!(formal(&slice, 0.9 * slice.alpha_c).unwrap().negative(), 0);
    }

    #[test]
    fn scenes_without_a_frontier_are_refused() {
        let refused = slice("cornell-box").map(|_| ()).unwrap_err();
        assert!(refused.to_string().contains("converges for every alpha"), "{refused}");
        assert!(refused.help().is_some());
    }
}
