//! `halflight frontier`: what each method does on both sides of the frontier, at one tau, as tables, charts and JSON.

pub(crate) mod report;

use std::path::PathBuf;

use clap::Args;

use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::cli::frontier::report::{NOT_LIGHT, formal_csv, table};
use crate::cli::memory::MemoryLimit;
use crate::cli::options::Common;
use crate::cli::values::unit_interval;
use crate::form_factors::Sampling;
use crate::light::Transport;
use crate::pictures::{make_directory, write_whole};
use crate::plot::Chart;
use crate::render::{Prepared, Silent, assemble, prepare};
use crate::scene::{LoadOptions, Scene};
use crate::solve::Settings;
use crate::study::frontier::{
    Formal, Run, Scaling, at, check_dense, formal, runs, scaling, series_chart, shooting_chart, spread_chart,
};
use crate::study::map::{Survey, check_crossings};

/// alpha over alpha_c of the runs.
const SHARES: [f64; 4] = [0.9, 0.99, 0.999, 1.1];
/// Terms of the Neumann series at most: at 0.999 alpha_c it takes about ten thousand.
const MAX_TERMS: usize = 20_000;
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
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

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
    let alphas: Vec<_> = SHARES.iter().map(|s| (*s, s * study.alpha_c)).filter(|(_, alpha)| *alpha <= 1.0).collect();
    let settings = Settings { max_terms: MAX_TERMS, ..Settings::default() };
    let found = runs(&study.scene, own.patches as usize, (study.tau, &alphas), &study.sampling, &settings);
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
    let traced = if own.trace { study.trace(&console) } else { Vec::new() };
    let files = study.write(common, &found, beyond.as_ref(), &traced)?;
    for file in &files {
        console.say(file.display().to_string());
    }
    console.report(&study.report(&found, beyond.as_ref(), &traced, files))
}

impl<'a> Study<'a> {
    fn new(own: &'a Frontier, common: &Common, scene: Scene, console: &Console) -> Result<Self, CliError> {
        let sampling = Sampling { rays: own.rays, seed: common.seed, ..Sampling::default() };
        let prepared = prepare(scene.clone(), own.patches as usize);
        let limit = own.limit.bytes();
        check_crossings(&prepared, &sampling, 1, limit)?;
        check_dense(&prepared, limit)?;
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
        [0.5 * self.alpha_variance, between].map(measure).into()
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
        let series = series_chart(title("The series near its frontier"), caption.clone(), found);
        draw("series", series)?;
        let shooting = title("Progressive shooting near the frontier");
        draw("shooting", shooting_chart(shooting, caption.clone(), found))?;
        if !traced.is_empty() {
            let line = |t: &Traced| (format!("alpha {:.3}", t.alpha), t.exponent, t.found.spreads.clone());
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
}
