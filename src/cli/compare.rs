//! `halflight compare`: five ways to one picture, their errors over time, and whether they agree.

use std::path::PathBuf;

use serde::Serialize;

use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::cli::memory::pixel;
use crate::cli::options::{Common, Compare};
use crate::cli::report::mode_of;
use crate::cli::variance::check_variance;
use crate::light::Transport;
use crate::pictures::{Exposure, make_directory, write_whole};
use crate::rays::Rays;
use crate::render::Watch;
use crate::scene::Scene;
use crate::study::compare::{
    CompareError, Comparison, Difference, Method, ORDERS, Plan, Stage, compare, error_chart, markdown, order_chart,
    pairs_table, picture_sheet, points_table, verdict,
};
use crate::study::term_name;

#[derive(Serialize)]
struct CompareReport {
    scene: String,
    alpha: f64,
    tau: f64,
    reference: String,
    methods: Vec<MethodReport>,
    pairs: Vec<PairReport>,
    files: Vec<PathBuf>,
}

#[derive(Serialize)]
struct MethodReport {
    name: &'static str,
    reference: String,
    points: Vec<PointReport>,
    slope: Option<f64>,
}

#[derive(Serialize)]
struct PointReport {
    seconds: f64,
    rms: f64,
}

#[derive(Serialize)]
struct PairReport {
    a: &'static str,
    b: &'static str,
    verdict: &'static str,
    mean_difference: f64,
    mean_difference_error: f64,
    failing_pixels: usize,
    orders: Vec<OrderReport>,
}

#[derive(Serialize)]
struct OrderReport {
    n: usize,
    mean_difference: f64,
    mean_difference_error: f64,
    verdict: &'static str,
}

/// Tells what is being done, with a bar for each step.
struct Telling<'a> {
    console: &'a Console,
    label: String,
}

impl Watch for Telling<'_> {
    fn begin(&self, step: &str, length: u64) {
        self.console.begin(step, length);
    }

    fn tick(&self, done: u64) {
        self.console.tick(done);
    }
}

impl Stage for Telling<'_> {
    fn climbs(&self, method: Method) {
        let label = &self.label;
        self.console.say(format!("{label}: {} …", method.name()));
    }

    fn repeats(&self) {
        let label = &self.label;
        self.console.say(format!("{label}: the patch methods once more, for the verdicts …"));
    }
}

impl From<CompareError> for CliError {
    fn from(error: CompareError) -> CliError {
        match error {
            CompareError::Diverges(e) => e.into(),
            CompareError::Memory(e) => e.into(),
        }
    }
}

/// Compares every mode asked for; of several, those that diverge are named and left out.
pub fn run(own: &Compare, common: &Common) -> Result<(), CliError> {
    let console = Console::new(common);
    own.limit.check_pictures(own.size, pixel::COMPARE)?;
    let scene = own.subject.load()?;
    for warning in &scene.warnings {
        console.warn(warning);
    }
    make_directory(&common.out)?;
    let transports = own.subject.transports(&scene);
    let several = transports.len() > 1;
    let rays = Rays::new(&scene);
    let mut reports = Vec::new();
    for transport in transports {
        match one_mode(own, common, &console, (&scene, &rays), transport) {
            Err(CliError::Diverges(e)) if several => {
                console.warn(format!("{}: nothing to compare, {e}", transport.label()));
            }
            other => reports.push(other?),
        }
    }
    match several {
        true => console.report(&serde_json::json!({ "modes": reports })),
        false => console.report(&reports[0]),
    }
}

fn one_mode(
    own: &Compare,
    common: &Common,
    console: &Console,
    (scene, rays): (&Scene, &Rays),
    transport: Transport,
) -> Result<CompareReport, CliError> {
    let plan = Plan {
        transport,
        size: (own.size.width, own.size.height),
        seconds: own.time,
        seed: common.seed,
        memory: own.limit.bytes(),
    };
    let label = transport.label();
    let stage = Telling { console, label: label.clone() };
    let comparison = compare(scene, &plan, &stage)?;
    check_variance(console, scene, rays, transport, common.seed);
    let title = format!("{}, {label}: five ways to one picture", scene.name);
    let text = markdown(&title, &comparison);
    console.say(&text);
    let files = write(own, common, scene, transport, &comparison, &text)?;
    for file in &files {
        console.say(file.display().to_string());
    }
    Ok(report(scene, transport, &comparison, files))
}

/// Writes the charts, the sheet and the tables.
fn write(
    own: &Compare,
    common: &Common,
    scene: &Scene,
    transport: Transport,
    c: &Comparison,
    text: &str,
) -> Result<Vec<PathBuf>, CliError> {
    let label = transport.label();
    let stem = format!("{}-compare-{}", scene.name, label.replace(' ', "-"));
    let place = |suffix: &str| common.out.join(format!("{stem}{suffix}"));
    let settings = format!(
        "{}, {label}, {}×{} pixels, {} s a method. Errors of patch methods against path tracing with next-event \
         estimation, of path tracing against Neumann; pixels that see a luminaire do not count.",
        scene.name, own.size.width, own.size.height, own.time
    );
    let mut files = Vec::new();
    for extension in [".svg", ".png"] {
        let title = format!("Error against time: {}, {label}", scene.name);
        error_chart(title, settings.clone(), c).write(place(extension))?;
        files.push(place(extension));
        for n in 1..=ORDERS {
            let path = place(&format!("-bounce-{n}{extension}"));
            let title = format!("Error of {} against time: {}, {label}", term_name(n), scene.name);
            let chart = order_chart(title, settings.clone(), c, n);
            // Orders that are black in this mode have no relative error to show.
            if chart.series.iter().any(|s| !s.points.is_empty()) {
                chart.write(&path)?;
                files.push(path);
            }
        }
    }
    let exposure = Exposure { stops: own.subject.exposure };
    let heading = format!("{}, {label}: pictures, and their signed differences", scene.name);
    picture_sheet(heading, c, exposure).sheet().write(place("-pictures.png"))?;
    write_whole(place(".md"), text.as_bytes())?;
    points_table(c).write(place(".csv"))?;
    pairs_table(c).write(place("-pairs.csv"))?;
    files.extend(["-pictures.png", ".md", ".csv", "-pairs.csv"].map(place));
    Ok(files)
}

fn report(scene: &Scene, transport: Transport, c: &Comparison, files: Vec<PathBuf>) -> CompareReport {
    let (_, alpha, tau) = mode_of(transport);
    let methods = c.tracks.iter().map(|t| MethodReport {
        name: t.method.name(),
        reference: t.reference.clone(),
        points: t.points.iter().map(|p| PointReport { seconds: p.seconds, rms: p.rms }).collect(),
        slope: t.slope,
    });
    let pairs = c.pairs.iter().map(|(a, b, pair)| PairReport {
        a: a.name(),
        b: b.name(),
        verdict: verdict(pair.agree),
        mean_difference: pair.mean.relative,
        mean_difference_error: pair.mean.error,
        failing_pixels: pair.failing_pixels,
        orders: pair.orders.iter().enumerate().map(order_report).collect(),
    });
    CompareReport {
        scene: scene.name.clone(),
        alpha,
        tau,
        reference: "path tracing with next-event estimation for patch methods, Neumann over K for path tracing".into(),
        methods: methods.collect(),
        pairs: pairs.collect(),
        files,
    }
}

fn order_report((n, d): (usize, &Difference)) -> OrderReport {
    OrderReport { n, mean_difference: d.relative, mean_difference_error: d.error, verdict: verdict(d.agree) }
}
