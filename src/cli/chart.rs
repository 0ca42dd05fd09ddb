//! `halflight chart`: speed against accuracy, measured against references that are kept on disk.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::cli::memory::{MemoryLimit, Within, pixel};
use crate::cli::options::{Common, Subject};
use crate::cli::report::mode_of;
use crate::cli::study::{Files, each_mode};
use crate::cli::values::{seconds, size};
use crate::cli::variance::check_variance;
use crate::light::Transport;
use crate::pictures::{Size, make_directory};
use crate::render::Stored;
use crate::scene::Scene;
use crate::study::compare::{
    Ladder, LadderPoint, Method, Source, Study, StudyPlan, Tradeoff, Truth, asked_chart, charted_chart, charted_table,
    seconds_bars, slope, trade_off,
};

/// `halflight chart`
#[derive(Args, Debug)]
pub struct ChartCommand {
    /// What is rendered.
    #[command(flatten)]
    pub subject: Subject,
    /// Size of the pictures
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = size)]
    pub size: Size,
    /// Seconds that each of a mode's two references may take; a quarter of it bounds each step of the ladders
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = seconds)]
    pub time: f64,
    /// Run these ladders only, separated by commas
    #[arg(long, value_enum, value_name = "LADDERS", value_delimiter = ',', default_values_t = Ladder::CHARTED)]
    pub ladders: Vec<Ladder>,
    /// Measure against this picture (.exr) of one mode instead of making references
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// Standard error of every pixel of --reference (.exr), to be subtracted
    #[arg(long, value_name = "FILE", requires = "reference")]
    pub reference_error: Option<PathBuf>,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// The tolerances over which a slope of its own is told.
const MIDDLE: RangeInclusive<f64> = 0.005..=0.05;

/// `halflight chart --json`: one report a mode; those that diverge are left out.
#[derive(Serialize)]
struct ChartReport {
    modes: Vec<ModeReport>,
}

#[derive(Serialize)]
struct ModeReport {
    scene: String,
    /// `global`, `shadowless`, `one-bounce`, `local`; null away from the corners.
    mode: Option<&'static str>,
    alpha: f64,
    tau: f64,
    width: usize,
    height: usize,
    references: Vec<ReferenceReport>,
    points: Vec<LadderPoint>,
    slopes: Vec<SlopeReport>,
    files: Vec<PathBuf>,
}

/// What pictures were held against.
#[derive(Serialize)]
struct ReferenceReport {
    /// `patch methods` or `path tracing`.
    judges: &'static str,
    #[serde(flatten)]
    truth: Truth,
}

/// How fast a method's error falls: over all its points, and for the tolerances from 5 % to 0.5 % alone.
#[derive(Serialize)]
struct SlopeReport {
    method: &'static str,
    slope: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    from_5_to_half_percent: Option<f64>,
}

/// The first patches and rays for a picture to this tolerance must fit in memory.
const MUST_FIT: f64 = 0.01;

/// Charts every mode asked for; of several, those that diverge are named and left out.
pub fn run(own: &ChartCommand, common: &Common) -> Result<(), CliError> {
    let clock = Instant::now();
    let console = Console::new(common);
    own.limit.check_pictures(own.size, pixel::CHART)?;
    let scene = own.subject.load(|warning| console.warn(warning))?;
    let load = clock.elapsed().as_secs_f64();
    let transports = own.subject.transports(&scene);
    if transports.len() > 1 && own.reference.is_some() {
        return Err(CliError::Usage {
            message: "--reference is the picture of one mode, and several are to be charted".into(),
            help: "name the mode: --mode global, or --alpha and --tau".into(),
        });
    }
    make_directory(&common.out)?;
    // Built anew for every step: here only to refuse what does not fit, before anything is measured.
    let ready = own.limit.prepare_within(scene.clone(), &transports, MUST_FIT).map_err(unfit)?;
    let modes = each_mode(&transports, "chart", &console, |transport| {
        Run { own, common, console: &console, ready: &ready, load }.one_mode(transport)
    })?;
    console.report(&ChartReport { modes })
}

/// Patches are not asked for here, so the advice is another.
fn unfit(error: CliError) -> CliError {
    match error {
        CliError::Memory(unfit) => CliError::Memory(unfit.of(Stored::Ladders)),
        other => other,
    }
}

/// What all modes of one run share.
struct Run<'a> {
    own: &'a ChartCommand,
    common: &'a Common,
    console: &'a Console,
    ready: &'a Within,
    /// Seconds that loading took.
    load: f64,
}

impl Run<'_> {
    fn one_mode(&self, transport: Transport) -> Result<ModeReport, CliError> {
        let Run { own, common, console, ready, load } = *self;
        let scene = &ready.prepared.scene;
        let (width, height) = (own.size.width, own.size.height);
        let plan = StudyPlan {
            study: Study::Chart,
            transport,
            size: own.size,
            seconds: own.time,
            seed: common.seed,
            memory: ready.memory,
            load,
            watch: console,
        };
        let source = match &own.reference {
            Some(picture) => Source::Files { picture: picture.clone(), error: own.reference_error.clone() },
            None => Source::Store(common.out.join("references")),
        };
        let found = trade_off(scene, &plan, &own.ladders, &source)?;
        check_variance(console, scene, &ready.prepared.rays, transport, common.seed);
        tell(console, scene, transport, &found);
        let files = write(common, scene, &plan, &found)?.told(console);
        let (mode, alpha, tau) = mode_of(transport);
        let slopes = own.ladders.iter().map(|ladder| SlopeReport {
            method: ladder.name,
            slope: slope(found.of(ladder.method)),
            from_5_to_half_percent: middle_slope(&found).filter(|_| ladder.method == Method::Tolerance),
        });
        let slopes = slopes.collect();
        let judged = ["patch methods", "path tracing"].into_iter().zip(found.truths);
        Ok(ModeReport {
            scene: scene.name.clone(),
            mode,
            alpha,
            tau,
            width,
            height,
            references: judged.map(|(judges, truth)| ReferenceReport { judges, truth }).collect(),
            points: found.points,
            slopes,
            files,
        })
    }
}

fn middle_slope(t: &Tradeoff) -> Option<f64> {
    t.tolerance_slope(MIDDLE)
}

/// Every picture in a line, below what it was held against.
fn tell(console: &Console, scene: &Scene, transport: Transport, t: &Tradeoff) {
    console.say(format!("{}, {}", scene.name, transport.label()));
    for truth in references(t) {
        console.say(format!("  reference: {}", described(truth)));
    }
    console.say("  method          seconds     asked  estimated   reached  effort");
    let percent = |v: Option<f64>| v.map_or("-".into(), |v| format!("{:.3} %", 100.0 * v));
    for p in &t.points {
        console.say(format!(
            "  {:<14} {:>8.3} {:>9} {:>10} {:>9}  {}",
            p.ladder.name,
            p.seconds.total,
            percent(p.asked),
            percent(p.estimated),
            percent(Some(p.reached.error)),
            p.effort,
        ));
    }
    let slopes = Ladder::CHARTED.iter().map(|ladder| (ladder.name, slope(t.of(ladder.method))));
    let slopes = slopes.chain([("tolerance from 5 % to 0.5 %", middle_slope(t))]);
    let slopes: Vec<String> = slopes.filter_map(|(name, slope)| Some(format!("{name} {:.2}", slope?))).collect();
    console.say(format!("  slopes: {}", slopes.join(", ")));
}

/// The references, one where both are the same.
fn references(t: &Tradeoff) -> &[Truth] {
    let same = t.truths[0].files == t.truths[1].files;
    &t.truths[..if same { 1 } else { 2 }]
}

fn described(truth: &Truth) -> String {
    let made = &truth.made;
    let error = match made.error {
        Some(error) => format!("own error {:.3} %, its noise subtracted", 100.0 * error),
        None => "own error unknown".into(),
    };
    format!("{}, {} ({error})", made.by, made.effort)
}

/// Writes charts and numbers.
fn write(common: &Common, scene: &Scene, plan: &StudyPlan, t: &Tradeoff) -> Result<Files, CliError> {
    let subject = format!("{}, {}", scene.name, plan.transport.label());
    let Size { width, height } = plan.size;
    let held = references(t).iter().map(described).collect::<Vec<_>>().join("; ");
    let caption = || {
        format!(
            "{subject}, {width}×{height} pixels, {} threads. Relative RMS error over the pixels that see no luminaire. \
             Reference: {held}.",
            rayon::current_num_threads(),
        )
    };
    let mut files = Files::new(common, scene, "chart", plan.transport);
    for extension in ["svg", "png"] {
        let chart = charted_chart(format!("Error against time: {subject}"), caption(), t);
        chart.write(files.add(&format!(".{extension}")))?;
        if t.of(Method::Tolerance).next().is_some() {
            let chart = asked_chart(format!("Asked and reached: {subject}"), caption(), t);
            chart.write(files.add(&format!("-asked.{extension}")))?;
            let bars = seconds_bars(format!("Where the time goes: {subject}"), caption(), t);
            bars.write(files.add(&format!("-seconds.{extension}")))?;
        }
    }
    charted_table(t).write(files.add(".csv"))?;
    Ok(files)
}
