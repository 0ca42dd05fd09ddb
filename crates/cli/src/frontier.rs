//! `halflight frontier`: what each method does on both sides of the frontier, at one tau, as tables, charts and JSON.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Common, Completion, MemoryLimit, unit_interval};
use crate::pictures::Files;
use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::light::Transport;
use halflight::pictures::{Table, make_directory, write_whole};
use halflight::render::Silent;
use halflight::scene::Scene;
use halflight::solve::Settings;
use halflight_plot::Chart;
use halflight_study::frontier::{
    Approach, Formal, SeriesRun, Slice, Traced, at, check_dense, formal, runs, scaling, series_chart, shooting_chart,
    spread_chart,
};
use halflight_study::map::check_crossings;

/// alpha over alpha_c of the runs.
const SHARES: [f64; 4] = [0.9, 0.99, 0.999, 1.1];
/// Terms of the Neumann series at most: at 0.999 alpha_c it takes about ten thousand.
const MAX_TERMS: usize = 20_000;
/// Repeats and doublings of the path tracer's error.
const REPEATS: usize = 128;
const DOUBLINGS: u32 = 12;
/// What is written on everything that shows a formal solution.
const NOT_LIGHT: &str = "formal solution of (I - K) L = E beyond the frontier: not light";

/// `halflight frontier`
#[derive(Args, Debug)]
pub struct Frontier {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file
    #[arg(default_value = "furnished-room")]
    pub scene: String,
    /// Transmission, 0 to 1; a material's own tau is multiplied by it
    #[arg(long, value_name = "T", default_value_t = 1.0, value_parser = unit_interval)]
    pub tau: f32,
    /// About how many patches; true tails come from a dense solve
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub patches: u32,
    /// Hemisphere rays from each patch
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub rays: u32,
    /// Solve (I - K) L = E beyond the frontier too: a solution, negative in places, and not light
    #[arg(long)]
    pub formal: bool,
    /// Measure how the path tracer's error shrinks on both sides of the frontier of its variance
    #[arg(long)]
    pub trace: bool,
    /// What the scene's files do not say.
    #[command(flatten)]
    pub completion: Completion,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// `halflight frontier --json`
#[derive(Serialize)]
struct FrontierReport {
    scene: String,
    patches: usize,
    /// tau, and where the mean diverges and the path tracer's variance becomes infinite.
    #[serde(flatten)]
    slice: Slice,
    runs: Vec<SeriesRun>,
    formal: Option<FormalReport>,
    spread: Vec<Traced>,
    files: Vec<PathBuf>,
}

#[derive(Serialize)]
struct FormalReport {
    /// Says what this is not.
    label: &'static str,
    alpha: f64,
    #[serde(flatten)]
    found: Formal,
}

/// Studies a scene at one tau.
pub fn run(own: &Frontier, common: &Common, console: &Console) -> Result<(), CliError> {
    let scene = own.completion.load(&own.scene, console)?;
    scene.require_emission()?;
    make_directory(&common.out)?;
    let sampling = Sampling { rays: own.rays, seed: common.seed, ..Sampling::default() };
    let (slice, patches) = slice(own, &scene, &sampling, console)?;
    console.say(format!(
        "{} at tau {}: the series diverges beyond alpha_c = {:.4}, the path tracer's variance beyond {:.4}\n",
        scene.name, slice.tau, slice.alpha_c, slice.alpha_variance
    ));
    let alphas: Vec<_> = SHARES.iter().map(|s| (*s, s * slice.alpha_c)).filter(|(_, alpha)| *alpha <= 1.0).collect();
    let settings = Settings { max_terms: MAX_TERMS, ..Settings::default() };
    let found = runs(&scene, own.patches as usize, &Approach { tau: slice.tau, alphas }, &sampling, &settings);
    console.say(table(&found));
    let formal = if own.formal { beyond(own, &scene, &slice, &sampling) } else { None };
    if let Some(FormalReport { alpha, found: f, .. }) = &formal {
        console.say(format!(
            "{NOT_LIGHT}; alpha {alpha:.4}: radiance {:.4e} to {:.4e}, negative in {} of {} patches",
            f.smallest,
            f.largest,
            f.negative,
            f.light.len()
        ));
    }
    let spread = if own.trace { trace(&scene, &slice, common.seed, console) } else { Vec::new() };
    let mut report =
        FrontierReport { patches, slice, runs: found, formal, spread, files: Vec::new(), scene: scene.name };
    report.files = write(own, common, &report)?.said(console);
    console.report(&report)
}

/// Finds the frontiers, on how many patches: an error where memory or alpha ends before them.
fn slice(own: &Frontier, scene: &Scene, sampling: &Sampling, console: &Console) -> Result<(Slice, usize), CliError> {
    let prepared = Solver::new(scene).cut(own.patches as usize);
    let limit = own.limit.bytes();
    check_crossings(&prepared, sampling, 1, limit)?;
    check_dense(&prepared, limit)?;
    let slice = Slice::new(&prepared, own.tau.into(), sampling, console);
    if slice.alpha_c * SHARES[0] > 1.0 {
        return Err(CliError::Usage {
            message: format!(
                "at tau = {} the series of {} converges for every alpha up to 1: its spectral radius is {:.4} at most",
                slice.tau, scene.name, slice.radius
            ),
            help: "pass a larger --tau or another scene; `halflight map` shows where the frontier is".into(),
        });
    }
    Ok((slice, prepared.patches.len()))
}

/// The formal solution at the first share beyond the frontier.
fn beyond(own: &Frontier, scene: &Scene, slice: &Slice, sampling: &Sampling) -> Option<FormalReport> {
    let share = SHARES.into_iter().find(|s| *s > 1.0)?;
    let alpha = (share * slice.alpha_c).min(1.0);
    let prepared = Solver::new(&at(scene, alpha, slice.tau)).cut(own.patches as usize);
    let (modes, _) = prepared.assemble(&[Transport::default()], sampling, &Silent);
    Some(FormalReport { label: NOT_LIGHT, alpha, found: formal(&modes[0].operator)? })
}

/// The path tracer's error inside both frontiers, and between them.
fn trace(scene: &Scene, slice: &Slice, seed: u32, console: &Console) -> Vec<Traced> {
    let between = (slice.alpha_variance * slice.alpha_c).sqrt();
    let measure = |alpha: f64| {
        let found = scaling(&at(scene, alpha, slice.tau), REPEATS, DOUBLINGS, seed);
        let (measured_exponent, standard_error) = found.slope;
        let predicted_exponent = slice.exponent(alpha);
        console.say(format!(
            "path tracing at alpha {alpha:.4}: error falls as N^{measured_exponent:.3} ± {standard_error:.3}, \
             predicted N^{predicted_exponent:.3}"
        ));
        Traced { alpha, predicted_exponent, measured_exponent, standard_error, points: found.spreads }
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
        let t = run.seconds;
        let seconds = [t.neumann, t.extrapolated, t.direct, t.shooting].map(second);
        let _ = writeln!(
            text,
            "{:>7} {:>7.4} {radius:>16} {:>7.4} {:>7} {:>13} {:>31} {:>9.1} {:>9.2e} {:>10}",
            run.share,
            run.alpha,
            run.norm,
            optional(run.terms),
            optional(run.extrapolated),
            seconds.join(" "),
            run.last_shot.sweeps,
            run.last_shot.unshot,
            run.shot.name(),
        );
    }
    text
}

/// Draws the charts, and writes the formal solution where there is one.
fn write(own: &Frontier, common: &Common, r: &FrontierReport) -> Result<Files, CliError> {
    let name = &r.scene;
    let caption = || {
        format!(
            "{name} at tau {}: {} patches, {} rays each; alpha_c = {:.4}, variance frontier {:.4}.",
            r.slice.tau, r.patches, own.rays, r.slice.alpha_c, r.slice.alpha_variance,
        )
    };
    let title = |what: &str| format!("{what}, {name}");
    let mut files = Files::new(&common.out, &format!("{name}-frontier-"));
    let mut draw = |end: &str, chart: Chart| files.draw(end, &["svg", "png"], &chart.drawing());
    draw("series", series_chart(title("The series near its frontier"), caption(), &r.runs))?;
    draw("shooting", shooting_chart(title("Progressive shooting near the frontier"), caption(), &r.runs))?;
    if !r.spread.is_empty() {
        draw("spread", spread_chart(title("The path tracer's error"), caption(), &r.spread))?;
    }
    if let Some(formal) = &r.formal {
        write_whole(files.add("formal-not-light.csv"), formal.csv().as_bytes())?;
    }
    Ok(files)
}

impl FormalReport {
    /// Every patch, below a line that says what this is not.
    fn csv(&self) -> String {
        let mut table = Table::new("patch,invisible_r,invisible_g,invisible_b,visible_r,visible_g,visible_b");
        for (i, l) in self.found.light.iter().enumerate() {
            let [a, b] = [l.invisible, l.visible];
            table.row(&[&i, &a.x, &a.y, &a.z, &b.x, &b.y, &b.z]);
        }
        format!("# {NOT_LIGHT}; alpha {}\n{}", self.alpha, table.text())
    }
}
