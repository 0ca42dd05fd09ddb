//! `halflight trace`: the picture of each mode by path tracing, and a contact sheet of several.
//!
//! Samples come in passes of [`PASS`], also without a time limit, so a number of samples gives the same bytes however
//! it was reached. Not handled: proof of divergence. A series that diverges is cut at `--max-bounces`, and said to be.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use crate::cli::backs;
use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::cli::memory::{MemoryLimit, pixel};
use crate::cli::options::{Common, Subject};
use crate::cli::pictures::{Places, Shown, mode_sheet};
use crate::cli::report::{MeanReport, Modes, RenderReport, TraceReport};
use crate::cli::values::{NextEventChoice, seconds, size};
use crate::cli::variance::check_variance;
use crate::light::Transport;
use crate::pictures::{Exposure, Picture, Size, check_extension, write_picture};
use crate::rays::Rays;
use crate::reference::{Mean, NextEvent, Overflow, TraceSettings, Tracer};
use crate::render::{Seconds, Watch};
use crate::scene::Scene;
use crate::study::map::Growth;

/// `halflight trace`
#[derive(Args, Debug)]
pub struct Trace {
    /// What to render.
    #[command(flatten)]
    pub subject: Subject,
    /// Size of the picture
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = size)]
    pub size: Size,
    /// Picture to write, .png or .exr [default: <out>/<scene>-traced-<mode>.png]; with several modes the mode is added
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Paths for each pixel [default: 256, or as many as --time allows]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16_777_216))]
    pub samples: Option<u32>,
    /// Look for emitters at every vertex, or wait until paths meet them, as in the paper
    #[arg(long, value_enum, default_value_t = NextEventChoice::On)]
    pub next_event: NextEventChoice,
    /// End every path after so many reflections; the light of later ones is missing
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub max_bounces: u32,
    /// Begin no pass of samples that would not end within so many seconds, for each mode
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub time: Option<f64>,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// Samples a pixel between two looks at the clock.
const PASS: u32 = 16;

/// Samples a pixel where neither their number nor a time is given.
const SAMPLES: u32 = 256;

/// One mode's picture, or the reason why there is none.
struct Outcome {
    transport: Transport,
    picture: Result<Picture, Overflow>,
    growth: Growth,
    report: TraceReport,
    /// Share of the camera's rays that meet the black back of a face.
    backs: f64,
}

/// What all modes of one run share.
struct Shared<'a> {
    own: &'a Trace,
    common: &'a Common,
    console: &'a Console,
    scene: &'a Scene,
    rays: &'a Rays,
    seconds: Seconds,
    places: &'a Places<'a>,
}

/// Traces every mode asked for.
pub fn run(own: &Trace, common: &Common) -> Result<(), CliError> {
    let start = Instant::now();
    let console = Console::new(common);
    if let Some(path) = &own.output {
        check_extension(path)?;
    }
    own.limit.check_pictures(own.size, pixel::TRACE)?;
    let scene = own.subject.load(|warning| console.warn(warning))?;
    let load = start.elapsed().as_secs_f64();
    let rays = Rays::new(&scene);
    let transports = own.subject.transports(&scene);
    let places = Places {
        output: own.output.as_deref(),
        directory: &common.out,
        // Traced pictures are named apart from rendered ones.
        stem: format!("{}-traced", scene.name),
        several: transports.len() > 1,
    };
    places.check(&transports)?;
    let run = Shared {
        own,
        common,
        console: &console,
        places: &places,
        scene: &scene,
        rays: &rays,
        seconds: Seconds { load, patches: start.elapsed().as_secs_f64() - load, ..Seconds::default() },
    };
    let mut outcomes = Vec::new();
    for &transport in &transports {
        outcomes.push(run.one_mode(transport)?);
    }
    let shown = backs::Shown { scene: &scene, rays: &rays, size: own.size, transports: &transports };
    backs::warn_of_backs(&console, &shown, outcomes.iter().map(|outcome| outcome.backs));
    run.finish(outcomes)
}

impl Shared<'_> {
    /// Traces and writes one mode.
    fn one_mode(&self, transport: Transport) -> Result<Outcome, CliError> {
        let own = self.own;
        let settings = TraceSettings {
            next_event: match own.next_event {
                NextEventChoice::On => NextEvent::On,
                NextEventChoice::Off => NextEvent::Off,
            },
            max_bounces: own.max_bounces,
            seed: self.common.seed,
        };
        let transports = self.scene.transports(transport);
        let seed = self.common.seed;
        let growth = check_variance(self.console, self.scene, self.rays, transport, seed);
        let clock = Instant::now();
        let mut tracer = Tracer::new(self.scene, self.rays, &transports, own.size, &settings);
        self.sample(&mut tracer);
        let ends = transports.iter().all(|t| t.alpha == 0.0);
        let mut report = self.report(transport, &tracer, ends, growth);
        report.render.seconds.gather = clock.elapsed().as_secs_f64();
        report.render.seconds.sum();
        let picture = tracer.check().map(|()| tracer.picture());
        if let Ok(picture) = &picture {
            let path = self.places.picture(transport);
            write_picture(&path, picture, self.exposure())?;
            report.render.files.push(path);
        }
        let backs = tracer.counts().backs as f64 / tracer.counts().paths.max(1) as f64;
        let outcome = Outcome { transport, picture, growth, report, backs };
        self.tell(&outcome);
        Ok(outcome)
    }

    /// Runs passes until the samples are there or the next pass would take too long.
    fn sample(&self, tracer: &mut Tracer) {
        let limit = self.own.time.unwrap_or(f64::INFINITY);
        let unlimited = if self.own.time.is_some() { u32::MAX } else { SAMPLES };
        let mut left = self.own.samples.unwrap_or(unlimited);
        if self.own.time.is_none() {
            self.console.begin("trace", u64::from(left.div_ceil(PASS)));
        }
        let start = Instant::now();
        let mut longest = 0.0_f64;
        let mut now = 0.0;
        while left > 0 && (tracer.samples() == 0 || now + longest <= limit) {
            tracer.pass(left.min(PASS));
            left -= left.min(PASS);
            let then = start.elapsed().as_secs_f64();
            longest = longest.max(then - now);
            now = then;
            self.console.tick(1);
        }
    }

    fn report(&self, transport: Transport, tracer: &Tracer, ends: bool, growth: Growth) -> TraceReport {
        let known = RenderReport::new(self.scene, transport, self.own.size);
        let counts = tracer.counts();
        let verdict = match (tracer.check(), counts.cut) {
            (Err(_), _) => "overflows",
            _ if ends => "ends",
            (_, 0) => "sampled",
            _ => "truncated",
        };
        let bounce = |(n, mean): (usize, Mean)| MeanReport { n, mean };
        TraceReport {
            render: RenderReport { rays: counts.rays, seconds: self.seconds, verdict, ..known },
            samples: tracer.samples(),
            standard_error: tracer.relative_error(),
            variance: growth,
            next_event: self.own.next_event == NextEventChoice::On,
            max_bounces: self.own.max_bounces,
            paths: counts.paths,
            paths_cut: counts.cut,
            bounces: tracer.means().into_iter().enumerate().map(bounce).collect(),
        }
    }

    /// One line for a mode, and what limits its picture.
    fn tell(&self, outcome: &Outcome) {
        let label = outcome.transport.label();
        let r = &outcome.report;
        if let Err(e) = &outcome.picture {
            // One mode alone ends with this error.
            if self.places.several {
                self.console.warn(format!("{label}: no picture, {e}"));
            }
            return;
        }
        let error = match r.standard_error {
            Some(error) => format!("{:.3} %", 100.0 * error),
            None => "unknown".into(),
        };
        self.console.say(format!(
            "{label:<11} {} samples a pixel in {:.2} s, relative standard error {error}: {}",
            r.samples,
            r.render.seconds.total,
            files(&r.render.files),
        ));
        if r.paths_cut > 0 {
            let advice = if outcome.growth.diverges() {
                ""
            } else {
                ". Raise --max-bounces, unless `halflight bounces` says that the series diverges"
            };
            self.console.warn(format!(
                "{label}: {:.2} % of the paths were cut after {} bounces; the picture is the series up to there{advice}",
                100.0 * r.paths_cut as f64 / r.paths as f64,
                r.max_bounces,
            ));
        }
    }

    /// The contact sheet and the report of several modes, or the report or error of one.
    fn finish(&self, mut outcomes: Vec<Outcome>) -> Result<(), CliError> {
        if outcomes.len() == 1 {
            let outcome = outcomes.remove(0);
            outcome.picture?;
            return self.console.report(&outcome.report);
        }
        let path = self.places.sheet();
        let shown: Vec<Shown> =
            outcomes.iter().map(|o| (o.transport, o.picture.as_ref().map_err(|e| e.to_string()))).collect();
        let heading = format!("{}: path tracing, the visible half", self.scene.name);
        mode_sheet(heading, &shown, self.exposure()).write(&path)?;
        self.console.say(format!("contact sheet: {}", path.display()));
        self.console.report(&Modes { modes: outcomes.into_iter().map(|o| o.report).collect(), files: vec![path] })
    }

    fn exposure(&self) -> Exposure {
        Exposure { stops: self.own.subject.exposure }
    }
}

fn files(files: &[PathBuf]) -> String {
    let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    names.join(" ")
}
