//! `halflight render`: the picture of each mode, and a contact sheet of several.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use crate::cli::backs;
use crate::cli::console::Console;
use crate::cli::effort::Precision;
use crate::cli::error::CliError;
use crate::cli::memory::{Within, pixel};
use crate::cli::options::{Common, Problem};
use crate::cli::pictures::{Places, Shown, mode_sheet};
use crate::cli::report::{Modes, RenderReport};
use crate::cli::unmet::{unmet, warn_of_error};
use crate::cli::values::size;
use crate::error::deadline::deadline_after;
use crate::gather::{GatherPass, GatherSampling};
use crate::light::Transport;
use crate::operator::Bounds;
use crate::pictures::{Exposure, Picture, Size, check_extension, write_picture, write_with_error};
use crate::render::prepared::Spent;
use crate::render::prepared::render_fixed;
use crate::render::{Fineness, Prepared, Rendered, Seconds, Wanted, assemble, render_within};
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

/// One mode's picture, or the reason why there is none.
struct Outcome {
    transport: Transport,
    picture: Result<Picture, Diverges>,
    /// Share of the camera's rays that meet the black back of a face.
    backs: f64,
    report: RenderReport,
}

/// Solves and renders every mode asked for.
pub fn run(own: &Render, common: &Common) -> Result<(), CliError> {
    let start = Instant::now();
    let console = Console::new(common);
    if let Some(path) = &own.output {
        check_extension(path)?;
    }
    if own.standard_error {
        check_layered(own.output.as_deref())?;
    }
    let effort = &own.problem.effort;
    let each = match effort.precision() {
        Precision::Within(_) => pixel::WITHIN,
        Precision::Fixed(..) => pixel::RENDER,
    };
    effort.limit.check_pictures(own.size, each)?;
    let scene = own.problem.subject.load(|warning| console.warn(warning))?;
    let transports = own.problem.subject.transports(&scene);
    let places = Places {
        output: own.output.as_deref(),
        directory: &common.out,
        stem: scene.name.clone(),
        several: transports.len() > 1,
    };
    places.check(&transports)?;
    let run = Shared { own, common, console: &console, places: &places, load: start.elapsed().as_secs_f64(), start };
    let outcomes = match effort.precision() {
        Precision::Within(tolerance) => run.within(scene, &transports, tolerance)?,
        Precision::Fixed(fineness, samples) => run.fixed(scene, &transports, fineness, samples)?,
    };
    finish(&places, &console, exposure(own), outcomes)
}

/// Whether a picture's error is known.
#[derive(Clone, Copy)]
enum Stated {
    /// It was to be at most so much.
    Within { tolerance: f64 },
    /// The effort was given, not the error.
    Nothing,
}

/// What all modes of one run share.
struct Shared<'a> {
    own: &'a Render,
    common: &'a Common,
    console: &'a Console,
    places: &'a Places<'a>,
    /// Seconds that loading took.
    load: f64,
    /// When the command began.
    start: Instant,
}

impl Shared<'_> {
    /// Every mode to a tolerance, each with the patches that it needs.
    fn within(&self, scene: Scene, transports: &[Transport], tolerance: f64) -> Result<Vec<Outcome>, CliError> {
        let (size, seed) = (self.own.size, self.common.seed);
        let effort = &self.own.problem.effort;
        let Within { mut prepared, memory } = effort.prepare_within(scene, transports, tolerance)?;
        let mut start = self.start;
        let mut outcomes = Vec::new();
        for &transport in transports {
            let deadline = self.own.problem.time.and_then(|seconds| deadline_after(start, seconds));
            let wanted = Wanted { tolerance, size, deadline, memory, seed };
            let found = render_within(&mut prepared, transport, &wanted, self.console);
            if let Ok(within) = &found {
                warn_of_error(self.console, transport, within, tolerance);
            }
            let report = self.report(&prepared, transport);
            outcomes.push(self.outcome(transport, Stated::Within { tolerance }, report, found)?);
            start = Instant::now();
        }
        self.warn_of_backs(&prepared, transports, &outcomes);
        Ok(outcomes)
    }

    /// Every mode with the effort given: one set of patches and one cast of rays for all.
    fn fixed(
        &self,
        scene: Scene,
        transports: &[Transport],
        fineness: Fineness,
        samples: u32,
    ) -> Result<Vec<Outcome>, CliError> {
        let prepared = self.own.problem.effort.prepare(scene, transports, fineness, self.common.seed)?;
        let clock = Instant::now();
        let (modes, rays) = assemble(&prepared, transports, &fineness.sampling(self.common.seed), self.console);
        let form_factors = clock.elapsed().as_secs_f64();
        let sampling = GatherSampling::with_samples(samples, self.common.seed);
        let pass = GatherPass::new(self.own.size, &sampling);
        let spent = Spent { seconds: Seconds { form_factors, ..Seconds::default() }, rays };
        let mut outcomes = Vec::new();
        for mode in &modes {
            let found = render_fixed(&prepared, mode, &pass, spent.clone(), self.console);
            let report = self.report(&prepared, mode.transport);
            outcomes.push(self.outcome(mode.transport, Stated::Nothing, report, found)?);
        }
        self.warn_of_backs(&prepared, transports, &outcomes);
        Ok(outcomes)
    }

    fn warn_of_backs(&self, p: &Prepared, transports: &[Transport], outcomes: &[Outcome]) {
        let shown = backs::Shown { scene: &p.scene, rays: &p.rays, size: self.own.size, transports };
        backs::warn_of_backs(self.console, &shown, outcomes.iter().map(|o| o.backs));
    }

    fn report(&self, prepared: &Prepared, transport: Transport) -> RenderReport {
        let known = RenderReport::new(&prepared.scene, transport, self.own.size);
        RenderReport { patches: prepared.patches.len(), ..known }
    }

    /// Writes a picture, and reports it, or why there is none.
    fn outcome(
        &self,
        transport: Transport,
        stated: Stated,
        mut report: RenderReport,
        found: Result<Rendered, Diverges>,
    ) -> Result<Outcome, CliError> {
        let (radius, verdict) = match &found {
            Ok(s) => (s.radius, s.verdict),
            Err(e) => (e.radius, e.verdict),
        };
        report.spectral_radius = Some(radius);
        report.verdict = verdict.name();
        let mut backs = 0.0;
        let picture = match found {
            Ok(within) => {
                report.take(&within, self.load);
                match stated {
                    Stated::Within { tolerance } => {
                        report.why = unmet(&within, tolerance);
                        report.met = Some(report.why.is_none());
                    }
                    Stated::Nothing => report.error = None,
                }
                backs = within.backs;
                let path = self.places.picture(transport);
                if self.own.standard_error {
                    write_with_error(&path, &within.picture, &within.standard_error)?;
                } else {
                    write_picture(&path, &within.picture, exposure(self.own))?;
                }
                report.files.push(path);
                Ok(within.picture)
            }
            Err(diverges) => Err(diverges),
        };
        let outcome = Outcome { transport, picture, backs, report };
        tell(self.console, &outcome, self.places.several);
        Ok(outcome)
    }
}

/// The contact sheet and the report of several modes, or the report or error of one.
fn finish(places: &Places, console: &Console, exposure: Exposure, mut outcomes: Vec<Outcome>) -> Result<(), CliError> {
    if outcomes.len() == 1 {
        let outcome = outcomes.remove(0);
        outcome.picture?;
        return console.report(&outcome.report);
    }
    let path = places.sheet();
    let shown: Vec<Shown> =
        outcomes.iter().map(|o| (o.transport, o.picture.as_ref().map_err(|e| e.to_string()))).collect();
    let heading = format!("{}: L = E + K L, the visible half", places.stem);
    mode_sheet(heading, &shown, exposure).write(&path)?;
    console.say(format!("contact sheet: {}", path.display()));
    console.report(&Modes { modes: outcomes.into_iter().map(|o| o.report).collect(), files: vec![path] })
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

/// A line on one mode; where it was the only one, its error speaks for itself.
fn tell(console: &Console, outcome: &Outcome, several: bool) {
    let label = outcome.transport.label();
    let r = &outcome.report;
    let s = &r.seconds;
    match &outcome.picture {
        Ok(_) => console.say(format!(
            "{label:<11} {} in {:.2} s ({} patches, F {:.2} s, L {:.2} s, gather {:.2} s), {}spectral radius {}: {}",
            r.verdict,
            s.total,
            r.patches,
            s.form_factors,
            s.solve,
            s.gather,
            r.error.map_or(String::new(), |e| format!("estimated error {:.2} %, ", 100.0 * e.total)),
            bounds(r.spectral_radius),
            r.files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().join(" "),
        )),
        Err(e) if several => console.warn(format!("{label}: no picture, {e}")),
        Err(_) => (),
    }
}

fn bounds(radius: Option<Bounds>) -> String {
    match radius {
        Some(r) if r.upper > 0.0 => format!("{:.4} to {:.4}", r.lower, r.upper),
        _ => "0".into(),
    }
}

fn exposure(own: &Render) -> Exposure {
    Exposure { stops: own.problem.subject.exposure }
}
