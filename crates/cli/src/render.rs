//! `halflight render`: the picture of each mode, and a contact sheet of several.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use crate::console::Console;
use crate::console::progress::Aim;
use crate::console::warnings::{Pictured, warn_of_backs, warn_of_error, words_of};
use crate::error::{CliError, picture_or_divergence};
use crate::options::arguments::{Common, Exposing, MemoryLimit, Precision, Problem, pixel, size};
use crate::options::keep::{Keep, Kept};
use crate::options::layers::Layers;
use crate::options::points::{Points, Sensors};
use crate::pictures::{Outcome, Places, RenderReport, finish};
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::Transport;
use halflight::operator::Bounds;
use halflight::pictures::{NamedPicture, Picture, Size, check_extension, is_exr, write_layered};
use halflight::render::{Apart, Errors, Rendered, Seconds};
use halflight::scene::Scene;
use halflight::solve::Diverges;

/// `halflight render`
#[derive(Args, Debug)]
#[command(next_help_heading = "Picture")]
pub struct Render {
    /// What to solve.
    #[command(flatten)]
    pub problem: Problem,
    /// Where light is measured.
    #[command(flatten)]
    pub points: Points,
    /// What the picture is taken apart into.
    #[command(flatten)]
    pub layers: Layers,
    /// Size of the picture
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = size)]
    pub size: Size,
    /// Picture to write, .png or .exr [default: <out>/<scene>-<mode>.png]; with several modes the mode is added
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// What is kept.
    #[command(flatten)]
    pub keep: Keep,
    /// Add the standard error of every pixel, and that of each layer, as layers of the EXR file
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
        check_layered(own.output.as_deref(), "--standard-error is a layer")?;
    }
    if own.layers.are_numbers() {
        check_layered(own.output.as_deref(), "layers for denoisers are layers")?;
    }
    let Problem { subject, effort, .. } = &own.problem;
    let scene = subject.load(console)?;
    let transports = subject.transports(&scene);
    let kept = own.keep.open(transports.len() > 1, subject.exposure())?;
    let precision = effort.precision(kept.as_ref().and_then(Kept::fineness));
    kept.iter().try_for_each(|kept| kept.check(precision))?;
    let each = match precision {
        Precision::Within(_) => pixel::WITHIN,
        Precision::Fixed(..) => pixel::RENDER,
    };
    effort.limit.check_pictures(own.size, each)?;
    let places = Places {
        output: own.output.as_deref(),
        directory: &common.out,
        stem: scene.name.clone(),
        several: transports.len() > 1,
    };
    places.check(&transports)?;
    let sensors = own.points.sensors(&scene)?;
    if let Some(sensors) = &sensors {
        sensors.check(&common.out, &scene.name, &transports)?;
    }
    let load = start.elapsed().as_secs_f64();
    let exposing = subject.exposing();
    let run = Run { own, console, places: &places, precision, load, sensors, exposing: &exposing };
    let mut outcomes = Vec::new();
    let rendering = Rendering {
        limit: &effort.limit,
        precision,
        size: own.size,
        seed: common.seed,
        time: own.problem.time,
        apart: own.layers.apart(),
        start,
        console,
        kept: kept.as_ref(),
    };
    let solver = rendering.each_mode(&scene, &transports, |solver, transport, found| {
        outcomes.push(run.outcome(solver, transport, found)?);
        Ok(())
    })?;
    if let Some(kept) = kept {
        kept.finish(console)?;
    }
    let geometry = solver.geometry();
    let (scene, rays) = (&geometry.scene, &geometry.rays);
    let pictured = Pictured { scene, rays, size: own.size };
    warn_of_backs(console, &pictured, outcomes.iter().map(|o| o.backs));
    let heading = format!("{}: L = E + K L, the visible half", places.stem);
    finish(outcomes, &places, heading, exposing.of_all(), console)
}

/// How the pictures of several modes are made.
struct Rendering<'a> {
    limit: &'a MemoryLimit,
    precision: Precision,
    size: Size,
    seed: u32,
    /// Seconds for each mode, where a tolerance is aimed at.
    time: Option<f64>,
    /// What is taken apart.
    apart: Apart,
    /// When the first mode began.
    start: Instant,
    console: &'a Console,
    /// Where F comes from, and what is kept.
    kept: Option<&'a Kept>,
}

impl Rendering<'_> {
    /// Renders every mode and passes it on to `take`: to a tolerance, each with the patches that it needs; or with the
    /// effort given, from one set of patches and one cast of rays for all.
    fn each_mode(
        &self,
        scene: &Scene,
        transports: &[Transport],
        mut take: impl FnMut(&Solver, Transport, Result<Rendered, Diverges>) -> Result<(), CliError>,
    ) -> Result<Solver, CliError> {
        let Rendering { limit, precision, size, seed, time, apart, start, console, kept } = *self;
        let solver = Kept::with(kept, limit.solver(scene, seed)).apart(apart);
        let mut take = |transport, mut found: Result<Rendered, Diverges>| {
            let light = found.as_mut().ok().and_then(|found| found.light.take());
            if let (Some(kept), Some(light)) = (kept, &light) {
                kept.save(light)?;
            }
            take(&solver, transport, found)
        };
        match precision {
            Precision::Within(tolerance) => {
                let pilots = transports.iter().map(|&mode| solver.pilot(mode, tolerance));
                let pilots = pilots.collect::<Result<Vec<_>, _>>()?;
                // What came before counts in the time of the first picture.
                let mut before = start.elapsed().as_secs_f64();
                for (number, (&transport, pilot)) in transports.iter().zip(pilots).enumerate() {
                    console.aim(Aim { label: transport.label(), tolerance, number, of: transports.len() });
                    let mut request = solver.render(transport, size).watch(console).pilot(pilot);
                    if let Some(seconds) = time {
                        request = request.time((seconds - before).max(0.0));
                    }
                    let found = picture_or_divergence(request.tolerance(tolerance))?;
                    if let Ok(found) = &found {
                        warn_of_error(console, transport, found, tolerance);
                    }
                    take(transport, found)?;
                    before = 0.0;
                }
            }
            Precision::Fixed(fineness, samples) => {
                if let Some(kept) = kept {
                    kept.read(&solver.cut(fineness.patches), transports, &fineness.sampling(seed), console)?;
                }
                let equations = solver.assemble(transports, fineness, console)?;
                let pass = GatherPass::new(size, &GatherSampling::with_samples(samples, seed));
                for (&transport, found) in transports.iter().zip(equations.render(&pass, console)) {
                    take(transport, found)?;
                }
            }
        }
        Ok(solver)
    }
}

/// What all modes of one run share.
struct Run<'a> {
    own: &'a Render,
    console: &'a Console,
    places: &'a Places<'a>,
    precision: Precision,
    /// Seconds that loading took.
    load: f64,
    sensors: Option<Sensors>,
    exposing: &'a Exposing,
}

impl Run<'_> {
    /// Writes a picture, and reports it, or why there is none.
    fn outcome(
        &self,
        solver: &Solver,
        transport: Transport,
        mut found: Result<Rendered, Diverges>,
    ) -> Result<Outcome<RenderReport, Diverges>, CliError> {
        let (radius, verdict) = found.as_ref().map_or_else(|e| (e.radius, e.verdict), |s| (s.radius, s.verdict));
        let mut report = RenderReport {
            patches: solver.last_cut().patches.len(),
            spectral_radius: Some(radius),
            verdict: verdict.name(),
            ..RenderReport::new(&solver.geometry().scene, transport, self.own.size)
        };
        if let Ok(found) = &mut found {
            let geometry = solver.geometry();
            let denoisers = self.own.layers.for_denoisers(&geometry.scene, &geometry.rays, found);
            self.describe(found, &mut report);
            report.luminaires.clone_from(&found.emitters);
            report.exposure = self.exposing.of(&found.picture).stops;
            let others = denoisers.layers();
            let own = found.layers.iter().map(|layer| layer.kind.name());
            report.layers = own.chain(others.iter().map(|layer| layer.name.clone())).collect();
            report.layer_errors = found.layers.iter().filter_map(|layer| layer.error).collect();
            report.files.extend(self.write(transport, found, others)?);
        }
        if let (Some(sensors), Precision::Within(tolerance)) = (&self.sensors, self.precision) {
            let place = (self.places.directory, self.places.stem.as_str());
            let measured = sensors.measure((solver, transport, tolerance), place, self.console)?;
            report.measured = measured.map(|(measured, paths)| {
                report.files.extend(paths);
                measured
            });
        }
        let backs = found.as_ref().map_or(0.0, |found| found.backs);
        let outcome = Outcome { transport, picture: found.map(|found| found.picture), backs, report };
        self.say(&outcome);
        Ok(outcome)
    }

    /// What a picture cost and how good it is.
    fn describe(&self, found: &Rendered, report: &mut RenderReport) {
        report.patches = found.patches;
        report.rays = found.rays;
        report.seconds = Seconds { load: self.load, ..found.seconds };
        report.seconds.sum();
        report.row_sums = found.row_sums;
        if let Precision::Within(tolerance) = self.precision {
            report.error = Some(found.error);
            report.why = found.unmet(tolerance).map(|unmet| words_of(&unmet));
            report.met = Some(report.why.is_none());
        }
    }

    fn write(
        &self,
        transport: Transport,
        found: &Rendered,
        others: Vec<NamedPicture<&Picture>>,
    ) -> Result<Vec<PathBuf>, CliError> {
        let exposure = self.exposing.of(&found.picture);
        let errors = if self.own.standard_error { Errors::Written } else { Errors::LeftOut };
        let path = self.places.picture(transport);
        let layers = [found.named_layers(errors), others].concat();
        Ok(write_layered(&path, &found.picture, &layers, exposure)?)
    }

    /// A line on one mode.
    fn say(&self, outcome: &Outcome<RenderReport, Diverges>) {
        let label = outcome.label(self.places.several, self.console);
        let (r, s) = (&outcome.report, &outcome.report.seconds);
        if outcome.picture.is_ok() {
            self.console.say(format!(
                "{label:<11} {} in {:.2} s ({} patches, F {:.2} s, L {:.2} s, gather {:.2} s), {}spectral radius {}: {}{}",
                r.verdict,
                s.total,
                r.patches,
                s.form_factors,
                s.solve,
                s.gather,
                r.error.map_or(String::new(), |e| format!("estimated error {:.2} %, ", 100.0 * e.total)),
                bounds(r.spectral_radius),
                r.file_names(),
                r.shown(),
            ));
        }
    }
}

/// Some layers are those of an EXR file alone.
fn check_layered(output: Option<&Path>, what: &str) -> Result<(), CliError> {
    if output.is_some_and(is_exr) {
        return Ok(());
    }
    Err(CliError::Usage {
        message: format!("{what} of an EXR file, and the picture is to be a PNG"),
        help: "name an EXR file: --output FILE.exr".into(),
    })
}

fn bounds(radius: Option<Bounds>) -> String {
    match radius {
        Some(r) if r.upper > 0.0 => format!("{:.4} to {:.4}", r.lower, r.upper),
        _ => "0".into(),
    }
}
