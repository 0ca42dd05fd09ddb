//! `halflight compare` and `halflight chart`: ladders of pictures ever finer, measured against references. The first
//! compares five ways to one picture and says whether they agree; the second charts speed against accuracy, against
//! references that are kept on disk.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use crate::console::Console;
use crate::console::warnings::check_variance;
use crate::error::{CliError, Patches};
use crate::options::arguments::{Common, MemoryLimit, Subject, ladder, seconds, size};
use crate::pictures::{Files, Modes};
use halflight::light::Transport;
use halflight::pictures::{Size, make_directory, write_whole};
use halflight::rays::Rays;
use halflight::scene::Scene;
use halflight_plot::term_name;
use halflight_study::compare::{
    Climb, Ladder, LadderPoint, Measurements, Method, ORDERS, Pair, Reached, Source, Study, StudyPlan, Truth,
    charted_chart, charted_table, compared_chart, compared_sheet, compared_table, markdown, measure, pairs_table,
    requested_chart, seconds_bars, slope,
};

/// `halflight compare`
#[derive(Args, Debug)]
#[command(next_help_heading = "Picture")]
pub struct Compare {
    /// What is solved.
    #[command(flatten)]
    pub subject: Subject,
    /// Size of the pictures
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = size)]
    pub size: Size,
    /// Seconds each method may take, for each mode
    #[arg(long, value_name = "SECONDS", default_value_t = 8.0, help_heading = "Accuracy", value_parser = seconds)]
    pub time: f64,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// `halflight chart`
#[derive(Args, Debug)]
#[command(next_help_heading = "Picture")]
pub struct Chart {
    /// What is rendered.
    #[command(flatten)]
    pub subject: Subject,
    /// Size of the pictures
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = size)]
    pub size: Size,
    /// Seconds that each of a mode's two references may take; a quarter of it bounds each step of the ladders
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, help_heading = "Accuracy", value_parser = seconds)]
    pub time: f64,
    /// Run these ladders only, separated by commas
    #[arg(
        long,
        value_name = "LADDERS",
        value_delimiter = ',',
        value_parser = ladder(),
        default_values = ["tolerance", "patches", "rays", "samples", "shooting", "paths"]
    )]
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

/// `halflight compare --json`, one for each mode.
#[derive(Serialize)]
struct CompareReport {
    scene: String,
    alpha: f64,
    tau: f64,
    reference: &'static str,
    methods: Vec<Climb>,
    pairs: Vec<Pair>,
    files: Vec<PathBuf>,
}

/// `halflight chart --json`, one for each mode; those that diverge are left out.
#[derive(Serialize)]
struct ChartReport {
    scene: String,
    #[serde(flatten)]
    transport: Transport,
    #[serde(flatten)]
    size: Size,
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

/// The tolerances over which a slope of its own is reported.
const MIDDLE: RangeInclusive<f64> = 0.005..=0.05;
/// The first patches and rays for a picture to this tolerance must fit in memory.
const MUST_FIT: f64 = 0.01;
/// Bytes a pixel of a comparison: five methods' orders, repeated; and of a chart.
const COMPARED: f64 = 9000.0;
const CHARTED: f64 = 2500.0;

/// What all modes of one run share.
struct Run<'a> {
    common: &'a Common,
    console: &'a Console,
    scene: &'a Scene,
    rays: &'a Rays,
    size: Size,
    seconds: f64,
    memory: f64,
    /// Seconds that loading took, where they count.
    load: f64,
}

/// Compares every requested mode; of several, those that diverge are named and left out.
pub fn compare(own: &Compare, common: &Common, console: &Console) -> Result<(), CliError> {
    own.limit.check_pictures(own.size, COMPARED)?;
    let scene = own.subject.load(console)?;
    make_directory(&common.out)?;
    let transports = own.subject.transports(&scene);
    let (rays, memory) = (Rays::new(&scene), own.limit.bytes());
    let (size, seconds) = (own.size, own.time);
    let run = Run { common, console, scene: &scene, rays: &rays, size, seconds, memory, load: 0.0 };
    let modes = run.each_mode(&transports, "compare", |transport| run.compare(own, transport))?;
    console.report(&Modes { modes, files: Vec::new() })
}

/// Charts every requested mode; of several, those that diverge are named and left out.
pub fn chart(own: &Chart, common: &Common, console: &Console) -> Result<(), CliError> {
    let clock = Instant::now();
    own.limit.check_pictures(own.size, CHARTED)?;
    let scene = own.subject.load(console)?;
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
    let solver = own.limit.solver(&scene, common.seed);
    for &transport in &transports {
        solver.pilot(transport, MUST_FIT).map_err(|unfit| CliError::Memory(unfit, Patches::Ladders))?;
    }
    let (geometry, memory) = (solver.geometry(), own.limit.bytes());
    let (size, seconds) = (own.size, own.time);
    let run = Run { common, console, scene: &scene, rays: &geometry.rays, size, seconds, memory, load };
    let modes = run.each_mode(&transports, "chart", |transport| run.chart(own, transport))?;
    console.report(&Modes { modes, files: Vec::new() })
}

impl Run<'_> {
    /// Studies every mode; of several, those that diverge are named and left out.
    fn each_mode<T>(
        &self,
        transports: &[Transport],
        what: &str,
        study: impl Fn(Transport) -> Result<T, CliError>,
    ) -> Result<Vec<T>, CliError> {
        let mut found = Vec::new();
        for &transport in transports {
            match study(transport) {
                Err(CliError::Diverges(e)) if transports.len() > 1 => {
                    self.console.warn(format!("{}: nothing to {what}, {e}", transport.label()));
                }
                other => found.push(other?),
            }
        }
        Ok(found)
    }

    /// Climbs the ladders of one mode, and warns of a path tracer's variance.
    fn measure(
        &self,
        study: Study,
        transport: Transport,
        ladders: &[Ladder],
        source: &Source,
    ) -> Result<Measurements, CliError> {
        let Run { common, console, scene, rays, size, seconds, memory, load } = *self;
        let label = transport.label();
        let begins = |what: &str| console.say(format!("{label}: {what} …"));
        let seed = common.seed;
        let plan = StudyPlan { study, transport, size, seconds, seed, memory, load, watch: console, begins: &begins };
        let found = measure(scene, &plan, ladders, source)?;
        check_variance(console, scene, rays, transport, seed);
        Ok(found)
    }

    /// The files of one mode, called after the scene, what is done with it, and the mode.
    fn files(&self, what: &str, transport: Transport) -> Files {
        let mode = transport.file_name();
        Files::new(&self.common.out, &format!("{}-{what}-{mode}", self.scene.name))
    }

    fn compare(&self, own: &Compare, transport: Transport) -> Result<CompareReport, CliError> {
        let found = self.measure(Study::Compare, transport, &Ladder::COMPARED, &Source::Answers)?;
        let title = format!("{}, {}: five ways to one picture", self.scene.name, transport.label());
        let text = markdown(&title, &found);
        self.console.say(&text);
        let files = self.write_comparison(own, transport, &found, &text)?.said(self.console);
        let Transport { alpha, tau } = transport;
        let [alpha, tau] = [alpha, tau].map(|x| x.to_string().parse().unwrap_or(f64::from(x)));
        Ok(CompareReport {
            scene: self.scene.name.clone(),
            alpha,
            tau,
            reference: "path tracing with next-event estimation for patch methods, Neumann over K for path tracing",
            methods: found.climbs,
            pairs: found.pairs,
            files,
        })
    }

    /// Writes the charts, the sheet and the tables of a comparison.
    fn write_comparison(
        &self,
        own: &Compare,
        transport: Transport,
        m: &Measurements,
        text: &str,
    ) -> Result<Files, CliError> {
        let subject = format!("{}, {}", self.scene.name, transport.label());
        let caption = format!(
            "{subject}, {}×{} pixels, {} s a method. Errors of patch methods against path tracing with next-event \
             estimation, of path tracing against Neumann; pixels that see a luminaire do not count.",
            own.size.width, own.size.height, own.time
        );
        let mut files = self.files("compare", transport);
        let chart = |title, n| compared_chart(title, caption.clone(), m, n);
        let whole = chart(format!("Error against time: {subject}"), None).drawing();
        let order = |n| chart(format!("Error of {} against time: {subject}", term_name(n)), Some(n));
        // Orders that are black in this mode have no relative error to show.
        let shown = (1..=ORDERS).map(|n| (n, order(n))).filter(|(_, c)| c.series.iter().any(|s| !s.points.is_empty()));
        let orders: Vec<_> = shown.map(|(n, chart)| (n, chart.drawing())).collect();
        for kind in ["svg", "png"] {
            files.draw("", &[kind], &whole)?;
            for (n, drawing) in &orders {
                files.draw(&format!("-bounce-{n}"), &[kind], drawing)?;
            }
        }
        let heading = format!("{subject}: pictures, and their signed differences");
        let sheet = compared_sheet(heading, m, own.subject.exposure());
        files.draw("-pictures", &["png"], &sheet.drawing())?;
        write_whole(files.add(".md"), text.as_bytes())?;
        compared_table(m).write(files.add(".csv"))?;
        pairs_table(m).write(files.add("-pairs.csv"))?;
        Ok(files)
    }

    fn chart(&self, own: &Chart, transport: Transport) -> Result<ChartReport, CliError> {
        let source = match &own.reference {
            Some(picture) => Source::Files { picture: picture.clone(), error: own.reference_error.clone() },
            None => Source::Store(self.common.out.join("references")),
        };
        let ladders: Vec<Ladder> = Ladder::CHARTED.into_iter().filter(|l| own.ladders.contains(l)).collect();
        let found = self.measure(Study::Chart, transport, &ladders, &source)?;
        self.say_chart(transport, &found);
        let files = self.write_chart(transport, &found)?.said(self.console);
        let slopes = own.ladders.iter().map(|ladder| SlopeReport {
            method: ladder.name,
            slope: slope(found.of(ladder.method)),
            from_5_to_half_percent: found.tolerance_slope(MIDDLE).filter(|_| ladder.method == Method::Tolerance),
        });
        let points = found.points().cloned().collect();
        let judged = ["patch methods", "path tracing"].into_iter().zip(found.truths.iter().cloned());
        Ok(ChartReport {
            scene: self.scene.name.clone(),
            transport,
            size: self.size,
            references: judged.map(|(judges, truth)| ReferenceReport { judges, truth }).collect(),
            points,
            slopes: slopes.collect(),
            files,
        })
    }

    /// Every picture in a line, below what it was held against.
    fn say_chart(&self, transport: Transport, m: &Measurements) {
        let console = self.console;
        console.say(format!("{}, {}", self.scene.name, transport.label()));
        for truth in m.references() {
            console.say(format!("  reference: {}", described(truth)));
        }
        console.say("  method          seconds     asked  estimated   reached  effort");
        let percent = |v: Option<f64>| v.map_or("-".into(), |v| format!("{:.3} %", 100.0 * v));
        for p in m.points() {
            console.say(format!(
                "  {:<14} {:>8.3} {:>9} {:>10} {:>9}  {}",
                p.ladder.name,
                p.seconds.total,
                percent(p.requested),
                percent(p.estimated),
                reached(&p.reached),
                p.effort,
            ));
        }
        let slopes = m.climbs.iter().map(|climb| (climb.ladder.name, climb.slope));
        let slopes = slopes.chain([("tolerance from 5 % to 0.5 %", m.tolerance_slope(MIDDLE))]);
        let slopes: Vec<String> = slopes.filter_map(|(name, slope)| Some(format!("{name} {:.2}", slope?))).collect();
        console.say(format!("  slopes: {}", slopes.join(", ")));
    }

    /// Writes charts and numbers.
    fn write_chart(&self, transport: Transport, m: &Measurements) -> Result<Files, CliError> {
        let subject = format!("{}, {}", self.scene.name, transport.label());
        let Size { width, height } = self.size;
        let held = m.references().iter().map(described).collect::<Vec<_>>().join("; ");
        let caption = format!(
            "{subject}, {width}×{height} pixels, {} threads. Relative RMS error over the pixels that see no luminaire. \
             Reference: {held}.",
            rayon::current_num_threads(),
        );
        let title = |what: &str| format!("{what}: {subject}");
        let mut drawings = vec![("", charted_chart(title("Error against time"), caption.clone(), m).drawing())];
        if m.of(Method::Tolerance).next().is_some() {
            drawings.push(("-asked", requested_chart(title("Asked and reached"), caption.clone(), m).drawing()));
            drawings.push(("-seconds", seconds_bars(title("Where the time goes"), caption, m).drawing()));
        }
        let mut files = self.files("chart", transport);
        for kind in ["svg", "png"] {
            for (end, drawing) in &drawings {
                files.draw(end, &[kind], drawing)?;
            }
        }
        charted_table(m).write(files.add(".csv"))?;
        Ok(files)
    }
}

/// The error that a picture reached; where the reference's noise leaves nothing of it what it is below.
fn reached(found: &Reached) -> String {
    match found.error {
        0.0 => format!("< {:.2} %", 100.0 * found.high),
        error => format!("{:.3} %", 100.0 * error),
    }
}

fn described(truth: &Truth) -> String {
    let made = &truth.made;
    let error = match made.error {
        Some(error) => format!("own error {:.3} %, its noise subtracted", 100.0 * error),
        None => "own error unknown".into(),
    };
    format!("{}, {} ({error})", made.by, made.effort)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_error_is_said_to_be_none() {
        let found = |error: f64| Reached { error, low: 0.0, high: 0.0094 };
        assert_eq!([reached(&found(0.0)), reached(&found(0.00612))], ["< 0.94 %", "0.612 %"]);
    }
}
