//! `halflight chart`: speed against accuracy, measured against references that are kept on disk.

pub(crate) mod report;

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use crate::cli::chart::report::{ChartReport, ModeReport, report};
use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::cli::memory::{MemoryLimit, pixel};
use crate::cli::options::{Common, Subject};
use crate::cli::values::{Size, seconds, size};
use crate::cli::variance::check_variance;
use crate::light::Transport;
use crate::pictures::make_directory;
use crate::render::{Prepared, Stored, Unfit};
use crate::scene::Scene;
use crate::study::tradeoff::{
    Brought, Ladder, Plan, Tradeoff, TradeoffError, Truth, asked_chart, error_chart, points_table, seconds_bars,
    trade_off,
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
    #[arg(long, value_enum, value_name = "LADDERS", value_delimiter = ',', default_values_t = Ladder::ALL)]
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
const MIDDLE: (f64, f64) = (0.005, 0.05);

impl From<TradeoffError> for CliError {
    fn from(error: TradeoffError) -> CliError {
        match error {
            TradeoffError::Diverges(e) => e.into(),
            TradeoffError::Image(e) => e.into(),
            TradeoffError::Write(e) => e.into(),
            TradeoffError::Metric(e) => e.into(),
        }
    }
}

/// Charts every mode asked for; of several, those that diverge are named and left out.
pub fn run(own: &ChartCommand, common: &Common) -> Result<(), CliError> {
    let clock = Instant::now();
    let console = Console::new(common);
    own.limit.check_pictures(own.size, pixel::CHART)?;
    let scene = own.subject.load()?;
    let load = clock.elapsed().as_secs_f64();
    for warning in &scene.warnings {
        console.warn(warning);
    }
    let transports = own.subject.transports(&scene);
    let several = transports.len() > 1;
    if several && own.reference.is_some() {
        return Err(CliError::Usage {
            message: "--reference is the picture of one mode, and several are to be charted".into(),
            help: "name the mode: --mode global, or --alpha and --tau".into(),
        });
    }
    make_directory(&common.out)?;
    // Built anew for every step: here only to refuse what does not fit, before anything is measured.
    let prepared = own.limit.prepare_within(scene.clone(), &transports);
    let prepared = prepared.map_err(unfit)?;
    let mut modes = Vec::new();
    for transport in transports {
        match one_mode(own, common, &console, (&prepared, load), transport) {
            Err(CliError::Diverges(e)) if several => {
                console.warn(format!("{}: nothing to chart, {e}", transport.label()));
            }
            other => modes.push(other?),
        }
    }
    console.report(&ChartReport { modes })
}

/// Patches are not asked for here, so the advice is another.
fn unfit(mut error: CliError) -> CliError {
    if let CliError::Memory(Unfit { stored, .. }) = &mut error
        && let Stored::Rows(entries) = *stored
    {
        *stored = Stored::Ladders(entries);
    }
    error
}

fn one_mode(
    own: &ChartCommand,
    common: &Common,
    console: &Console,
    (prepared, load): (&Prepared, f64),
    transport: Transport,
) -> Result<ModeReport, CliError> {
    let scene = &prepared.scene;
    let plan = Plan {
        transport,
        size: (own.size.width, own.size.height),
        seconds: own.time,
        seed: common.seed,
        load,
        store: common.out.join("references"),
        ladders: own.ladders.clone(),
        memory: prepared.memory,
    };
    let brought =
        own.reference.as_ref().map(|picture| Brought { picture: picture.clone(), error: own.reference_error.clone() });
    let found = trade_off(scene, &plan, brought.as_ref(), console)?;
    check_variance(console, scene, &prepared.rays, transport, common.seed);
    tell(console, scene, transport, &found);
    let files = write(common, scene, &plan, &found)?;
    for file in &files {
        console.say(file.display().to_string());
    }
    Ok(report(scene, &plan, &found, files))
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
            p.ladder.name(),
            p.seconds.total,
            percent(p.asked),
            percent(p.estimated),
            percent(Some(p.reached.error)),
            p.effort,
        ));
    }
    let slopes = Ladder::ALL.into_iter().filter_map(|ladder| {
        let slope = t.slope(ladder)?;
        Some(format!("{} {slope:.2}", ladder.name()))
    });
    let mut slopes: Vec<String> = slopes.collect();
    if let Some(slope) = t.tolerance_slope(MIDDLE) {
        slopes.push(format!("tolerance from 5 % to 0.5 % {slope:.2}"));
    }
    console.say(format!("  slopes: {}", slopes.join(", ")));
}

/// The references, one where both are the same.
fn references(t: &Tradeoff) -> impl Iterator<Item = &Truth> {
    let same = t.truths[0].files == t.truths[1].files;
    t.truths.iter().take(if same { 1 } else { 2 })
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
fn write(common: &Common, scene: &Scene, plan: &Plan, t: &Tradeoff) -> Result<Vec<PathBuf>, CliError> {
    let label = plan.transport.label();
    let stem = format!("{}-chart-{}", scene.name, label.replace(' ', "-"));
    let place = |suffix: &str| common.out.join(format!("{stem}{suffix}"));
    let subject = format!("{}, {label}", scene.name);
    let (width, height) = plan.size;
    let held = references(t).map(described).collect::<Vec<_>>().join("; ");
    let settings = format!(
        "{subject}, {width}×{height} pixels, {} threads. Relative RMS error over the pixels that see no luminaire. \
         Reference: {held}.",
        rayon::current_num_threads(),
    );
    let mut files = Vec::new();
    for extension in ["svg", "png"] {
        let chart = error_chart(format!("Error against time: {subject}"), settings.clone(), t);
        let path = place(&format!(".{extension}"));
        chart.write(&path)?;
        files.push(path);
        if t.of(Ladder::Tolerance).next().is_none() {
            continue;
        }
        let chart = asked_chart(format!("Asked and reached: {subject}"), settings.clone(), t);
        let path = place(&format!("-asked.{extension}"));
        chart.write(&path)?;
        files.push(path);
        let title = format!("Where the time goes: {subject}");
        let path = place(&format!("-seconds.{extension}"));
        seconds_bars(title, settings.clone(), t).write(&path)?;
        files.push(path);
    }
    let path = place(".csv");
    points_table(t).write(&path)?;
    files.push(path);
    Ok(files)
}
