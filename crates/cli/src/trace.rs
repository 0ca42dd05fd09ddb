//! `halflight trace`: the picture of each mode by path tracing, and a contact sheet of several.
//!
//! Samples come in passes of [`PASS`], also without a time limit, so a number of samples gives the same bytes however
//! it was reached. Not handled: proof of divergence. A series that diverges is cut at `--max-bounces`, and said to be.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use crate::console::Console;
use crate::console::warnings::{Pictured, check_variance, warn_of_backs};
use crate::error::CliError;
use crate::options::arguments::{Common, Exposing, MemoryLimit, NextEventChoice, Subject, pixel, seconds, size};
use crate::pictures::{Outcome, Places, RenderReport, finish};
use halflight::light::Transport;
use halflight::pictures::{Size, check_extension, write_picture};
use halflight::rays::Rays;
use halflight::render::{Seconds, Watch};
use halflight::scene::Scene;
use halflight_reference::{Mean, NextEvent, Overflow, TraceSettings, Tracer};
use halflight_study::map::Growth;

/// `halflight trace`
#[derive(Args, Debug)]
#[command(next_help_heading = "Picture")]
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
    #[arg(long, value_name = "N", help_heading = "Accuracy",
        value_parser = clap::value_parser!(u32).range(1..=16_777_216))]
    pub samples: Option<u32>,
    /// Look for emitters at every vertex, or wait until paths meet them, as in the paper
    #[arg(long, value_enum, default_value_t = NextEventChoice::On, help_heading = "Accuracy")]
    pub next_event: NextEventChoice,
    /// End every path after so many reflections; the light of later ones is missing
    #[arg(long, value_name = "N", default_value_t = 128, help_heading = "Accuracy",
        value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    pub max_bounces: u32,
    /// Begin no pass of samples that would not end within so many seconds, for each mode
    #[arg(long, value_name = "SECONDS", value_parser = seconds, help_heading = "Accuracy")]
    pub time: Option<f64>,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// Samples a pixel between two looks at the clock.
const PASS: u32 = 16;

/// Samples a pixel where neither their number nor a time is given.
const SAMPLES: u32 = 256;

/// `halflight trace --json`, one for each mode: render's fields and these.
///
/// There are no patches, form factors or bounds: those fields are 0 or null; `gather` is the time spent tracing. The
/// verdict is `ends` (alpha is 0 everywhere), `sampled` (every path ended by itself), `truncated` (`--max-bounces`
/// ended some, so later bounces are missing) or `overflows` (no picture).
#[derive(Serialize)]
pub struct TraceReport {
    /// The fields of render.
    #[serde(flatten)]
    pub render: RenderReport,
    /// Paths for each pixel.
    pub samples: u64,
    /// RMS of the pixels' standard errors over RMS of the pixels without their noise, where no luminaire is seen; null
    /// from one sample, and where there is more noise than picture.
    pub standard_error: Option<f64>,
    /// Whether the standard errors mean anything.
    pub variance: Growth,
    /// Whether emitters were sampled at every vertex.
    pub next_event: bool,
    /// Reflections after which a path ends in any case.
    pub max_bounces: u32,
    /// Paths.
    pub paths: u64,
    /// Paths that `max_bounces` ended with light still to gather.
    pub paths_cut: u64,
    /// Mean radiance of the picture by bounce; the last is that of all later bounces together.
    pub bounces: Vec<MeanReport>,
}

/// Mean radiance of one bounce order over the picture, with its standard error.
#[derive(Serialize)]
pub struct MeanReport {
    /// Number of reflections.
    pub n: usize,
    /// Mean radiance per channel and its standard error.
    #[serde(flatten)]
    pub mean: Mean,
}

type Tracing = Outcome<TraceReport, Overflow>;

/// What all modes of one run share.
struct Run<'a> {
    own: &'a Trace,
    common: &'a Common,
    console: &'a Console,
    scene: &'a Scene,
    rays: &'a Rays,
    seconds: Seconds,
    places: &'a Places<'a>,
    exposing: &'a Exposing,
}

/// Traces every requested mode.
pub fn run(own: &Trace, common: &Common, console: &Console) -> Result<(), CliError> {
    let start = Instant::now();
    if let Some(path) = &own.output {
        check_extension(path)?;
    }
    own.limit.check_pictures(own.size, pixel::TRACE)?;
    let scene = own.subject.load(console)?;
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
    let seconds = Seconds { load, patches: start.elapsed().as_secs_f64() - load, ..Seconds::default() };
    let exposing = &own.subject.exposing();
    let run = Run { own, common, console, places: &places, scene: &scene, rays: &rays, seconds, exposing };
    let mut outcomes = Vec::new();
    for &transport in &transports {
        outcomes.push(run.one_mode(transport)?);
    }
    let pictured = Pictured { scene: &scene, rays: &rays, size: own.size };
    warn_of_backs(console, &pictured, outcomes.iter().map(|outcome| outcome.backs));
    let heading = format!("{}: path tracing, the visible half", scene.name);
    finish(outcomes, &places, heading, exposing.of_all(), console)
}

impl Run<'_> {
    /// Traces and writes one mode.
    fn one_mode(&self, transport: Transport) -> Result<Tracing, CliError> {
        let (own, seed) = (self.own, self.common.seed);
        let next_event = if own.next_event == NextEventChoice::On { NextEvent::On } else { NextEvent::Off };
        let settings = TraceSettings { next_event, max_bounces: own.max_bounces, seed };
        let transports = self.scene.transports(transport);
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
            let exposure = self.exposing.of(picture);
            write_picture(&path, picture, exposure)?;
            report.render.exposure = exposure.stops;
            report.render.files.push(path);
        }
        let backs = tracer.counts().backs as f64 / tracer.counts().paths.max(1) as f64;
        let outcome = Outcome { transport, picture, backs, report };
        self.say(&outcome);
        Ok(outcome)
    }

    /// Runs passes until the samples are there or the next pass would take too long.
    fn sample(&self, tracer: &mut Tracer) {
        let (seconds, unlimited) = self.own.time.map_or((f64::INFINITY, SAMPLES), |seconds| (seconds, u32::MAX));
        let most = self.own.samples.unwrap_or(unlimited);
        if self.own.time.is_none() {
            self.console.begin("trace", u64::from(most.div_ceil(PASS)));
        }
        tracer.sample_within(PASS, most, seconds, |_, _| {
            self.console.tick(1);
            true
        });
    }

    fn report(&self, transport: Transport, tracer: &Tracer, ends: bool, variance: Growth) -> TraceReport {
        let counts = tracer.counts();
        let verdict = match (tracer.check(), counts.cut) {
            (Err(_), _) => "overflows",
            _ if ends => "ends",
            (_, 0) => "sampled",
            _ => "truncated",
        };
        let known = RenderReport::new(self.scene, transport, self.own.size);
        let bounce = |(n, mean): (usize, Mean)| MeanReport { n, mean };
        TraceReport {
            render: RenderReport { rays: counts.rays, seconds: self.seconds, verdict, ..known },
            samples: tracer.samples(),
            standard_error: tracer.relative_error(),
            variance,
            next_event: self.own.next_event == NextEventChoice::On,
            max_bounces: self.own.max_bounces,
            paths: counts.paths,
            paths_cut: counts.cut,
            bounces: tracer.means().into_iter().enumerate().map(bounce).collect(),
        }
    }

    /// One line for a mode, and what limits its picture.
    fn say(&self, outcome: &Tracing) {
        let label = outcome.label(self.places.several, self.console);
        let r = &outcome.report;
        if outcome.picture.is_err() {
            return;
        }
        let error = r.standard_error.map_or("unknown".into(), |error| format!("{:.3} %", 100.0 * error));
        self.console.say(format!(
            "{label:<11} {} samples a pixel in {:.2} s, relative standard error {error}: {}{}",
            r.samples,
            r.render.seconds.total,
            r.render.file_names(),
            r.render.shown(),
        ));
        if r.paths_cut > 0 {
            let advice = if r.variance.diverges() {
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
}
