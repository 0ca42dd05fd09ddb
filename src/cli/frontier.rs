//! `halflight frontier`: what each method does on both sides of the frontier, at one tau, as tables, charts and JSON.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::CliError;
use super::console::Console;
use super::options::Common;
use super::report::Radius;
use super::values::unit_interval;
use crate::form_factors::Sampling;
use crate::image::{make_directory, write_whole};
use crate::light::Transport;
use crate::scene::{LoadOptions, Scene};
use crate::solve::Settings;
use crate::study::frontier::{
    Formal, Run, Scaling, at, formal, runs, scaling, series_chart, shooting_chart, spread_chart,
};
use crate::study::map::Survey;
use crate::study::{Chart, Prepared, Silent, assemble, prepare};

/// alpha over alpha_c of the runs.
const SHARES: [f64; 4] = [0.9, 0.99, 0.999, 1.1];
/// Repeats and doublings of the path tracer's error.
const REPEATS: usize = 128;
const DOUBLINGS: u32 = 12;

/// `halflight frontier`
#[derive(Args, Debug)]
pub struct Frontier {
    /// A built-in scene (see `halflight scenes`), a .toml scene file or an .obj file
    #[arg(default_value = "furnished-room")]
    pub scene: String,
    /// Transmission, 0 to 1; a material's own tau is multiplied by it
    #[arg(long, value_name = "T", default_value_t = 1.0, value_parser = unit_interval)]
    pub tau: f32,
    /// About how many patches; true tails come from a dense solve
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..=2000))]
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
}

/// `halflight frontier --json`
#[derive(Serialize)]
struct Report {
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
    spectral_radius: Radius,
    norm_of_k: f64,
    verdict: &'static str,
    terms: Option<usize>,
    products_extrapolated: Option<usize>,
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
const NOT_LIGHT: &str = "formal solution of (I - K) L = E beyond the frontier: not light";

/// The path tracer's error at one alpha.
struct Traced {
    alpha: f64,
    /// Predicted error ~ N^-exponent.
    exponent: f64,
    found: Scaling,
}

/// What one run works on.
struct Study<'a> {
    own: &'a Frontier,
    sampling: Sampling,
    scene: Scene,
    prepared: Prepared,
    survey: Survey,
    tau: f64,
    alpha_c: f64,
    alpha_variance: f64,
}

/// Studies a scene at one tau.
pub fn run(own: &Frontier, common: &Common) -> Result<(), CliError> {
    let console = Console::new(common);
    let scene = Scene::open(&own.scene, LoadOptions::default())?;
    scene.require_emission()?;
    make_directory(&common.out)?;
    for warning in &scene.warnings {
        console.warn(warning);
    }
    let study = Study::new(own, common, scene, &console)?;
    console.say(study.heading());
    let alphas: Vec<_> = SHARES
        .iter()
        .map(|s| (*s, s * study.alpha_c))
        .filter(|(_, alpha)| *alpha <= 1.0)
        .collect();
    let settings = Settings::default();
    let found = runs(
        &study.scene,
        own.patches as usize,
        (study.tau, &alphas),
        &study.sampling,
        &settings,
    );
    console.say(table(&found));
    let beyond = (own.formal.then(|| study.formal()).flatten()).inspect(|(alpha, f)| {
        console.say(format!(
            "{NOT_LIGHT}; alpha {alpha:.4}: radiance {:.4e} to {:.4e}, negative in {} of {} patches",
            f.smallest,
            f.largest,
            f.negative,
            f.light.len()
        ));
    });
    let traced = if own.trace {
        study.trace(&console)
    } else {
        Vec::new()
    };
    let files = study.write(common, &found, beyond.as_ref(), &traced)?;
    for file in &files {
        console.say(file.display().to_string());
    }
    console.report(&study.report(&found, beyond.as_ref(), &traced, files))
}

impl<'a> Study<'a> {
    fn new(
        own: &'a Frontier,
        common: &Common,
        scene: Scene,
        console: &Console,
    ) -> Result<Self, CliError> {
        let sampling = Sampling {
            rays: own.rays,
            seed: common.seed,
            ..Sampling::default()
        };
        let prepared = prepare(scene.clone(), own.patches as usize);
        let survey = Survey::new(&prepared, &sampling, console);
        let tau = f64::from(own.tau);
        let radius = survey.spectrum(tau, &survey.start()).worst();
        let squares = survey.moment(tau, 2.0, &survey.start()).worst();
        let alpha_c = 2.0 / (radius.lower + radius.upper);
        if alpha_c * SHARES[0] > 1.0 {
            return Err(CliError::Usage {
                message: format!(
                    "at tau = {tau} the series of {} converges for every alpha up to 1: its spectral radius is {:.4} at most",
                    scene.name, radius.upper
                ),
                help: "pass a larger --tau or another scene; `halflight map` shows where the frontier is".into(),
            });
        }
        Ok(Study {
            own,
            sampling,
            scene,
            prepared,
            survey,
            tau,
            alpha_c,
            alpha_variance: (2.0 / (squares.lower + squares.upper)).sqrt(),
        })
    }

    fn heading(&self) -> String {
        format!(
            "{} at tau {}: the series diverges beyond alpha_c = {:.4}, the path tracer's variance beyond {:.4}\n",
            self.scene.name, self.tau, self.alpha_c, self.alpha_variance
        )
    }

    /// The formal solution at the first share beyond the frontier, with its alpha.
    fn formal(&self) -> Option<(f64, Formal)> {
        let share = SHARES.into_iter().find(|s| *s > 1.0)?;
        let alpha = (share * self.alpha_c).min(1.0);
        let scene = at(&self.scene, alpha, self.tau);
        let prepared = prepare(scene, self.own.patches as usize);
        let (modes, _) = assemble(&prepared, &[Transport::default()], &self.sampling, &Silent);
        Some((alpha, formal(&modes[0].operator)?))
    }

    /// The path tracer's error inside both frontiers, and between them.
    fn trace(&self, console: &Console) -> Vec<Traced> {
        let between = (self.alpha_variance * self.alpha_c).sqrt();
        let measure = |alpha: f64| {
            let index = self.survey.tail_index(alpha, self.tau).unwrap_or(2.0);
            let scene = at(&self.scene, alpha, self.tau);
            let traced = Traced {
                alpha,
                exponent: 1.0 - 1.0 / index,
                found: scaling(&scene, REPEATS, DOUBLINGS, self.sampling.seed),
            };
            let (slope, error) = traced.found.slope;
            console.say(format!(
                "path tracing at alpha {alpha:.4}: error falls as N^{slope:.3} ± {error:.3}, predicted N^-{:.3}",
                traced.exponent
            ));
            traced
        };
        [0.7 * self.alpha_variance, between].map(measure).into()
    }

    fn write(
        &self,
        common: &Common,
        found: &[Run],
        beyond: Option<&(f64, Formal)>,
        traced: &[Traced],
    ) -> Result<Vec<PathBuf>, CliError> {
        let name = &self.scene.name;
        let caption = format!(
            "{name} at tau {}: {} patches, {} rays each; alpha_c = {:.4}, variance frontier {:.4}.",
            self.tau,
            self.prepared.patches.len(),
            self.own.rays,
            self.alpha_c,
            self.alpha_variance,
        );
        let file = |end: &str| common.out.join(format!("{name}-frontier{end}"));
        let title = |what: &str| format!("{what}, {name}");
        let mut files = Vec::new();
        let mut draw = |end: &str, chart: Chart| -> Result<(), CliError> {
            for extension in ["svg", "png"] {
                let path = file(&format!("-{end}.{extension}"));
                chart.write(&path)?;
                files.push(path);
            }
            Ok(())
        };
        let series = series_chart(
            title("The series near its frontier"),
            caption.clone(),
            found,
        );
        draw("series", series)?;
        let shooting = title("Progressive shooting near the frontier");
        draw("shooting", shooting_chart(shooting, caption.clone(), found))?;
        if !traced.is_empty() {
            let line = |t: &Traced| {
                (
                    format!("alpha {:.3}", t.alpha),
                    t.exponent,
                    t.found.spreads.clone(),
                )
            };
            let lines: Vec<_> = traced.iter().map(line).collect();
            let title = title("The path tracer's error");
            draw("spread", spread_chart(title, caption, &lines))?;
        }
        if let Some((alpha, formal)) = beyond {
            let path = file("-formal-not-light.csv");
            write_whole(&path, formal_csv(*alpha, formal).as_bytes())?;
            files.push(path);
        }
        Ok(files)
    }

    fn report(
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

fn table(found: &[Run]) -> String {
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
        spectral_radius: run.radius.into(),
        norm_of_k: run.norm,
        verdict: run.verdict.name(),
        terms: (!run.bounds.is_empty()).then_some(run.bounds.len()),
        products_extrapolated: run.extrapolated,
        shooting: run.shot.name(),
        shots_per_patch: last.map_or(0.0, |s| s.sweeps),
        unshot: last.map_or(1.0, |s| s.unshot),
    }
}

fn spread_report(traced: &Traced) -> SpreadReport {
    let (slope, error) = traced.found.slope;
    let points = traced.found.spreads.iter().map(|s| SpreadPoint {
        paths: s.paths,
        spread: s.spread,
        reported: s.reported,
    });
    SpreadReport {
        alpha: traced.alpha,
        predicted_exponent: -traced.exponent,
        measured_exponent: slope,
        standard_error: error,
        points: points.collect(),
    }
}

fn formal_csv(alpha: f64, formal: &Formal) -> String {
    let mut text = format!(
        "# {NOT_LIGHT}; alpha {alpha}\npatch,invisible_r,invisible_g,invisible_b,visible_r,visible_g,visible_b\n"
    );
    for (i, l) in formal.light.iter().enumerate() {
        let [a, b] = [l.invisible, l.visible];
        let _ = writeln!(text, "{i},{},{},{},{},{},{}", a.x, a.y, a.z, b.x, b.y, b.z);
    }
    text
}
