//! `halflight compare`: five ways to one picture, their errors over time, and whether they agree.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use serde_json::{Value, json};

use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::cli::memory::{MemoryLimit, pixel};
use crate::cli::options::{Common, Subject};
use crate::cli::report::mode_of;
use crate::cli::study::{Files, each_mode};
use crate::cli::values::{seconds, size};
use crate::cli::variance::check_variance;
use crate::light::Transport;
use crate::pictures::{Exposure, Size, make_directory, write_whole};
use crate::rays::Rays;
use crate::scene::Scene;
use crate::study::compare::{
    Comparison, LadderPoint, ORDERS, Pair, Reach, Study, StudyPlan, compare, compared_chart, compared_table, markdown,
    pairs_table, write_sheet,
};
use crate::study::term_name;

/// `halflight compare`
#[derive(Args, Debug)]
pub struct Compare {
    /// What is solved.
    #[command(flatten)]
    pub subject: Subject,
    /// Size of the pictures
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = size)]
    pub size: Size,
    /// Seconds each method may take, for each mode
    #[arg(long, value_name = "SECONDS", default_value_t = 8.0, value_parser = seconds)]
    pub time: f64,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

#[derive(Serialize)]
struct CompareReport {
    scene: String,
    alpha: f64,
    tau: f64,
    reference: &'static str,
    methods: Vec<Value>,
    pairs: Vec<Pair>,
    files: Vec<PathBuf>,
}

/// Compares every mode asked for; of several, those that diverge are named and left out.
pub fn run(own: &Compare, common: &Common) -> Result<(), CliError> {
    let console = Console::new(common);
    own.limit.check_pictures(own.size, pixel::COMPARE)?;
    let scene = own.subject.load(|warning| console.warn(warning))?;
    make_directory(&common.out)?;
    let transports = own.subject.transports(&scene);
    let rays = Rays::new(&scene);
    let reports = each_mode(&transports, "compare", &console, |transport| {
        Run { own, common, console: &console, scene: &scene, rays: &rays }.one_mode(transport)
    })?;
    if transports.len() > 1 {
        return console.report(&json!({ "modes": reports }));
    }
    console.report(&reports[0])
}

/// What all modes of one run share.
struct Run<'a> {
    own: &'a Compare,
    common: &'a Common,
    console: &'a Console,
    scene: &'a Scene,
    rays: &'a Rays,
}

impl Run<'_> {
    fn one_mode(&self, transport: Transport) -> Result<CompareReport, CliError> {
        let Run { own, common, console, scene, rays } = *self;
        let plan = StudyPlan {
            study: Study::Compare,
            transport,
            size: own.size,
            seconds: own.time,
            seed: common.seed,
            memory: own.limit.bytes(),
            load: 0.0,
            watch: console,
        };
        let label = transport.label();
        let comparison = compare(scene, &plan, &|what| console.say(format!("{label}: {what} …")))?;
        check_variance(console, scene, rays, transport, common.seed);
        let text = markdown(&format!("{}, {label}: five ways to one picture", scene.name), &comparison);
        console.say(&text);
        let files = self.write(transport, &comparison, &text)?.told(console);
        let (_, alpha, tau) = mode_of(transport);
        Ok(CompareReport {
            scene: scene.name.clone(),
            alpha,
            tau,
            reference: "path tracing with next-event estimation for patch methods, Neumann over K for path tracing",
            methods: comparison.methods.iter().map(method).collect(),
            pairs: comparison.pairs,
            files,
        })
    }

    /// Writes the charts, the sheet and the tables.
    fn write(&self, transport: Transport, c: &Comparison, text: &str) -> Result<Files, CliError> {
        let Run { own, common, scene, .. } = *self;
        let subject = format!("{}, {}", scene.name, transport.label());
        let caption = format!(
            "{subject}, {}×{} pixels, {} s a method. Errors of patch methods against path tracing with next-event \
         estimation, of path tracing against Neumann; pixels that see a luminaire do not count.",
            own.size.width, own.size.height, own.time
        );
        let mut files = Files::new(common, scene, "compare", transport);
        for extension in ["svg", "png"] {
            let title = format!("Error against time: {subject}");
            compared_chart(title, caption.clone(), c, None).write(files.add(&format!(".{extension}")))?;
            for n in 1..=ORDERS {
                let title = format!("Error of {} against time: {subject}", term_name(n));
                let chart = compared_chart(title, caption.clone(), c, Some(n));
                // Orders that are black in this mode have no relative error to show.
                if chart.series.iter().any(|s| !s.points.is_empty()) {
                    chart.write(files.add(&format!("-bounce-{n}.{extension}")))?;
                }
            }
        }
        let exposure = Exposure { stops: own.subject.exposure };
        let heading = format!("{subject}: pictures, and their signed differences");
        write_sheet(&files.add("-pictures.png"), heading, c, exposure)?;
        write_whole(files.add(".md"), text.as_bytes())?;
        compared_table(c).write(files.add(".csv"))?;
        pairs_table(c).write(files.add("-pairs.csv"))?;
        Ok(files)
    }
}

/// What a method reached, as reported.
fn method(reach: &Reach) -> Value {
    let point = |p: &LadderPoint| json!({ "seconds": p.seconds.total, "rms": p.reached.error });
    let points: Vec<Value> = reach.points.iter().map(point).collect();
    json!({ "name": reach.name, "reference": reach.reference, "points": points, "slope": reach.slope })
}
