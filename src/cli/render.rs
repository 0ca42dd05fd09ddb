//! `halflight render`: the picture of each mode, and a contact sheet of several.

use crate::cli::error::picture_or_divergence;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use crate::cli::arguments::Common;
use crate::cli::arguments::Precision;
use crate::cli::arguments::Problem;
use crate::cli::arguments::pixel;
use crate::cli::arguments::size;
use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::cli::pictures::{Outcome, Places, RenderReport, finish};
use crate::cli::warnings::{Pictured, unmet, warn_of_backs, warn_of_error};
use crate::gather::{GatherPass, GatherSampling};
use crate::light::Transport;
use crate::operator::Bounds;
use crate::pictures::{Size, check_extension, write_picture, write_with_error};
use crate::render::Fineness;
use crate::render::Rendered;
use crate::render::Seconds;
use crate::render::Solver;
use crate::scene::Scene;
use crate::solve::Diverges;

/// `halflight render`
#[derive(Args, Debug)]
pub struct Render {
    /// What to solve.
    #[command(flatten)]
    pub problem: Problem,
    /// Size of the picture
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = size)]
    pub size: Size,
    /// Picture to write, .png or .exr [default: <out>/<scene>-<mode>.png]; with several modes the mode is added
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Add the standard error of every pixel as a layer of the EXR file
    #[arg(long)]
    pub standard_error: bool,
}

/// Solves and renders every requested mode.
pub fn run(own: &Render, common: &Common, console: &Console) -> Result<(), CliError> {
    let start = Instant::now();
    if let Some(path) = &own.output {
        check_extension(path)?;
    }
    if own.standard_error {
        check_layered(own.output.as_deref())?;
    }
    let Problem { subject, effort, .. } = &own.problem;
    let each = match effort.precision() {
        Precision::Within(_) => pixel::WITHIN,
        Precision::Fixed(..) => pixel::RENDER,
    };
    effort.limit.check_pictures(own.size, each)?;
    let scene = subject.load(console)?;
    let transports = subject.transports(&scene);
    let places = Places {
        output: own.output.as_deref(),
        directory: &common.out,
        stem: scene.name.clone(),
        several: transports.len() > 1,
    };
    places.check(&transports)?;
    let run = Run { own, common, console, places: &places, load: start.elapsed().as_secs_f64(), start };
    let outcomes = match effort.precision() {
        Precision::Within(tolerance) => run.within(scene, &transports, tolerance)?,
        Precision::Fixed(fineness, samples) => run.fixed(scene, &transports, fineness, samples)?,
    };
    let heading = format!("{}: L = E + K L, the visible half", places.stem);
    finish(outcomes, &places, heading, subject.exposure(), console)
}

type Rendering = Outcome<RenderReport, Diverges>;

/// What all modes of one run share.
struct Run<'a> {
    own: &'a Render,
    common: &'a Common,
    console: &'a Console,
    places: &'a Places<'a>,
    /// Seconds that loading took.
    load: f64,
    /// When the command began.
    start: Instant,
}

impl Run<'_> {
    /// Every mode to a tolerance, each with the patches that it needs.
    fn within(&self, scene: Scene, transports: &[Transport], tolerance: f64) -> Result<Vec<Rendering>, CliError> {
        let Problem { effort, time, .. } = &self.own.problem;
        let solver = effort.limit.solver(&scene, self.common.seed);
        solver.check_tolerance(transports, tolerance)?;
        // Reading the scene counts in the time of the first picture.
        let mut before = self.start.elapsed().as_secs_f64();
        let mut outcomes = Vec::new();
        for &transport in transports {
            let mut request = solver.render(transport, self.own.size).watch(self.console);
            if let Some(seconds) = time {
                request = request.time((seconds - before).max(0.0));
            }
            let found = picture_or_divergence(request.tolerance(tolerance))?;
            if let Ok(found) = &found {
                warn_of_error(self.console, transport, found, tolerance);
            }
            outcomes.push(self.outcome(&solver, transport, Some(tolerance), found)?);
            before = 0.0;
        }
        self.warn_of_backs(&solver, transports, &outcomes);
        Ok(outcomes)
    }

    /// Every mode with the effort given: one set of patches and one cast of rays for all.
    fn fixed(
        &self,
        scene: Scene,
        transports: &[Transport],
        fineness: Fineness,
        samples: u32,
    ) -> Result<Vec<Rendering>, CliError> {
        let seed = self.common.seed;
        let solver = self.own.problem.effort.limit.solver(&scene, seed);
        let equations = solver.assemble(transports, fineness, self.console)?;
        let pass = GatherPass::new(self.own.size, &GatherSampling::with_samples(samples, seed));
        let mut outcomes = Vec::new();
        for (&transport, found) in transports.iter().zip(equations.render(&pass, self.console)) {
            outcomes.push(self.outcome(&solver, transport, None, found)?);
        }
        self.warn_of_backs(&solver, transports, &outcomes);
        Ok(outcomes)
    }

    fn warn_of_backs(&self, solver: &Solver, transports: &[Transport], outcomes: &[Rendering]) {
        let geometry = solver.geometry();
        let pictured = Pictured { scene: &geometry.scene, rays: &geometry.rays, size: self.own.size, transports };
        warn_of_backs(self.console, &pictured, outcomes.iter().map(|o| o.backs));
    }

    /// Writes a picture, and reports it, or why there is none.
    fn outcome(
        &self,
        solver: &Solver,
        transport: Transport,
        tolerance: Option<f64>,
        found: Result<Rendered, Diverges>,
    ) -> Result<Rendering, CliError> {
        let (radius, verdict) = found.as_ref().map_or_else(|e| (e.radius, e.verdict), |s| (s.radius, s.verdict));
        let mut report = RenderReport {
            patches: solver.last_cut().patches.len(),
            spectral_radius: Some(radius),
            verdict: verdict.name(),
            ..RenderReport::new(&solver.geometry().scene, transport, self.own.size)
        };
        if let Ok(found) = &found {
            self.describe(found, tolerance, &mut report);
            report.files.push(self.write(transport, found)?);
        }
        let backs = found.as_ref().map_or(0.0, |found| found.backs);
        let outcome = Outcome { transport, picture: found.map(|found| found.picture), backs, report };
        self.say(&outcome);
        Ok(outcome)
    }

    /// What a picture cost and how good it is.
    fn describe(&self, found: &Rendered, tolerance: Option<f64>, report: &mut RenderReport) {
        report.patches = found.patches;
        report.rays = found.rays;
        report.seconds = Seconds { load: self.load, ..found.seconds };
        report.seconds.sum();
        report.closure = found.closure;
        if let Some(tolerance) = tolerance {
            report.error = Some(found.error);
            report.why = unmet(found, tolerance);
            report.met = Some(report.why.is_none());
        }
    }

    fn write(&self, transport: Transport, found: &Rendered) -> Result<PathBuf, CliError> {
        let path = self.places.picture(transport);
        if self.own.standard_error {
            write_with_error(&path, &found.picture, &found.standard_error)?;
        } else {
            write_picture(&path, &found.picture, self.own.problem.subject.exposure())?;
        }
        Ok(path)
    }

    /// A line on one mode.
    fn say(&self, outcome: &Rendering) {
        let label = outcome.label(self.places.several, self.console);
        let (r, s) = (&outcome.report, &outcome.report.seconds);
        if outcome.picture.is_ok() {
            self.console.say(format!(
                "{label:<11} {} in {:.2} s ({} patches, F {:.2} s, L {:.2} s, gather {:.2} s), {}spectral radius {}: {}",
                r.verdict,
                s.total,
                r.patches,
                s.form_factors,
                s.solve,
                s.gather,
                r.error.map_or(String::new(), |e| format!("estimated error {:.2} %, ", 100.0 * e.total)),
                bounds(r.spectral_radius),
                r.file_names(),
            ));
        }
    }
}

/// The standard error is a layer of an EXR file.
fn check_layered(output: Option<&Path>) -> Result<(), CliError> {
    let extension = output.and_then(Path::extension).unwrap_or_default();
    if extension.eq_ignore_ascii_case("exr") {
        return Ok(());
    }
    Err(CliError::Usage {
        message: "--standard-error is a layer of an EXR file, and the picture is to be a PNG".into(),
        help: "name an EXR file: --output FILE.exr".into(),
    })
}

fn bounds(radius: Option<Bounds>) -> String {
    match radius {
        Some(r) if r.upper > 0.0 => format!("{:.4} to {:.4}", r.lower, r.upper),
        _ => "0".into(),
    }
}
