//! `halflight bounces`: the series E, KE, K²E, ... of each mode, as a table, a chart, CSV and pictures.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Instant;

use clap::Args;
use halflight_team::deadline_after;
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Common, Precision, Problem, pixel, size};
use crate::options::keep::{Keep, Kept};
use crate::options::layers::PerEmitter;
use crate::options::points::{Points, Sensors};
use crate::pictures::{Files, Modes};
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling, Gathering, Limit};
use halflight::light::budget::CAMERA;
use halflight::light::{Mode, Transport};
use halflight::operator::Bounds;
use halflight::pictures::{Exposure, Size, Table, known, make_directory};
use halflight::render::{BounceSeries, EmitterTerms, End, Fineness};
use halflight::scene::Scene;
use halflight::solve::{Bounce, Solution, Verdict};
use halflight_lighting::Measured;
use halflight_plot::term_name;
use halflight_study::{bounce_fields, bounce_pictures, bounce_sheet, bounces_chart, partial_sums};

/// `halflight bounces`
#[derive(Args, Debug)]
#[command(next_help_heading = "Picture")]
pub struct Bounces {
    /// What to solve.
    #[command(flatten)]
    pub problem: Problem,
    /// What light is kept apart by.
    #[command(flatten)]
    pub per: PerEmitter,
    /// What is kept.
    #[command(flatten)]
    pub keep: Keep,
    /// Where light is measured, bounce by bounce.
    #[command(flatten)]
    pub points: Points,
    /// Terms in the table, the chart and the sheet, E not counted
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub count: u16,
    /// Size of each picture in the sheet
    #[arg(long, value_name = "WxH", default_value = "160x160", value_parser = size)]
    pub size: Size,
}

/// Bounces shown in the sheet at most: more would not fit a page.
const SHEET: usize = 12;
/// Noise of the pictures of a sheet that nobody sees, over the RMS of the first: 0.03 of radiance are 1.4 % of an sRGB
/// code, less than two of 255 in its middle. Powers are as near as they were asked for.
const SEEN: f64 = 0.03;

/// `halflight bounces --json`, one for each mode.
#[derive(Serialize)]
struct BouncesReport {
    scene: String,
    #[serde(flatten)]
    transport: Transport,
    patches: usize,
    /// Proved bounds.
    spectral_radius: Bounds,
    verdict: Verdict,
    /// Whether every term is within the tolerance; null where effort was given instead.
    met: Option<bool>,
    /// What keeps it from that.
    why: Option<&'static str>,
    bounces: Vec<BounceReport>,
    /// Light at points, where it is requested.
    #[serde(flatten)]
    measured: Option<Measured>,
}

/// One term.
#[derive(Serialize)]
struct BounceReport {
    #[serde(flatten)]
    bounce: Bounce,
    /// Estimated relative error of the power; null where effort was given instead of a tolerance.
    error: Option<ErrorReport>,
    /// Power of the visible half of each emitter per channel, W, and its relative error, where they are kept apart.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    luminaires: BTreeMap<String, [f64; 3]>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    luminaire_errors: BTreeMap<String, f64>,
}

/// The error of one term's power, by what makes it: walks of light alone, as no power is that of the patches.
#[derive(Serialize)]
struct ErrorReport {
    form_factors: f64,
    patches: f64,
    walks: f64,
    total: f64,
}

/// The series of one mode.
struct Studied {
    transport: Transport,
    solution: Solution,
    patches: usize,
    /// Errors of the terms, and what ended the search for them, where a tolerance was requested.
    errors: Vec<f64>,
    end: Option<End>,
    emitters: Vec<EmitterTerms>,
    measured: Option<Measured>,
}

/// What all modes of one run share, and what is known of them so far.
struct Run<'a> {
    own: &'a Bounces,
    common: &'a Common,
    console: &'a Console,
    kept: Option<Kept>,
    sensors: Option<Sensors>,
    studied: Vec<Studied>,
    files: Files,
}

/// Studies every requested mode.
pub fn run(own: &Bounces, common: &Common, console: &Console) -> Result<(), CliError> {
    let Problem { subject, effort, .. } = &own.problem;
    let (fixed, term) = pixel::BOUNCES;
    effort.limit.check_pictures(own.size, fixed + term * f64::from(own.count))?;
    let scene = subject.load(console)?;
    make_directory(&common.out)?;
    let transports = subject.transports(&scene);
    let sensors = own.points.sensors(&scene)?.map(Sensors::by_bounce);
    if let Some(sensors) = &sensors {
        sensors.check(&common.out, &stem(&scene), &transports)?;
    }
    let files = Files::new(&common.out, &stem(&scene));
    let kept = own.keep.open(transports.len() > 1, subject.exposure())?;
    let precision = effort.precision(kept.as_ref().and_then(Kept::fineness));
    let mut run = Run { own, common, console, kept, sensors, studied: Vec::new(), files };
    match precision {
        Precision::Fixed(fineness, samples) => run.fixed(&scene, &transports, fineness, samples)?,
        Precision::Within(tolerance) => run.within(&scene, &transports, tolerance)?,
    }
    run.chart_and_table(&scene)?;
    if let Some(kept) = run.kept.take() {
        kept.finish(console)?;
    }
    let Run { studied, files, .. } = run;
    let modes = studied.into_iter().map(|s| s.report(&scene)).collect();
    console.report(&Modes { modes, files: files.said(console) })
}

/// What the files of a run are named after.
fn stem(scene: &Scene) -> String {
    format!("{}-bounces", scene.name)
}

impl Run<'_> {
    /// Every mode with the effort given: one set of patches and one cast of rays for all.
    fn fixed(
        &mut self,
        scene: &Scene,
        transports: &[Transport],
        fineness: Fineness,
        samples: u32,
    ) -> Result<(), CliError> {
        let seed = self.common.seed;
        let limit = &self.own.problem.effort.limit;
        let solver = Kept::with(self.kept.as_ref(), limit.solver(scene, seed)).apart(self.own.per.apart());
        if let Some(kept) = &self.kept {
            kept.read(&solver.cut(fineness.patches), transports, &fineness.sampling(seed), self.console)?;
        }
        let equations = solver.assemble(transports, fineness, self.console)?;
        let sampling = GatherSampling::with_samples(samples, seed);
        for series in equations.bounces(self.own.count.into()) {
            self.take(series, (&sampling).into())?;
        }
        Ok(())
    }

    /// Every mode to a tolerance of its terms' powers, each with the patches that it needs.
    fn within(&mut self, scene: &Scene, transports: &[Transport], tolerance: f64) -> Result<(), CliError> {
        let (Problem { effort, time, .. }, seed) = (&self.own.problem, self.common.seed);
        let solver = Kept::with(self.kept.as_ref(), effort.limit.solver(scene, seed)).apart(self.own.per.apart());
        if let Some(kept) = &self.kept {
            let fineness = Fineness::of_terms(tolerance);
            kept.read(&solver.cut(fineness.patches), transports, &fineness.sampling(seed), self.console)?;
        }
        for &transport in transports {
            let deadline = time.and_then(|seconds| deadline_after(Instant::now(), seconds));
            let mut request = solver.bounces(transport, self.own.count.into()).watch(self.console);
            if let Some(seconds) = *time {
                request = request.time(seconds);
            }
            let series = request.tolerance(tolerance);
            let error = tolerance.max(SEEN);
            self.take(
                series,
                Gathering::Within { error, camera: CAMERA[1], seed, limit: Limit { deadline, rays: u64::MAX } },
            )?;
            self.measure((&solver, transport, tolerance), &stem(scene))?;
        }
        Ok(())
    }

    /// Measures light at points in the mode that was taken last.
    fn measure(&mut self, asked: (&Solver, Transport, f64), stem: &str) -> Result<(), CliError> {
        let Some(sensors) = &self.sensors else { return Ok(()) };
        let measured = sensors.measure(asked, (&self.common.out, stem), self.console)?;
        if measured.is_none() {
            self.console.warn(format!("{}: no light at points, the series is not proved to converge", asked.1.label()));
        }
        if let (Some(last), Some((measured, _))) = (self.studied.last_mut(), measured) {
            last.measured = Some(measured);
        }
        Ok(())
    }

    /// Shows one mode's table and writes its sheet: its terms, and their sums under them.
    fn take(&mut self, series: BounceSeries, gathering: Gathering) -> Result<(), CliError> {
        let BounceSeries { mode, solution, errors, end, emitters } = series;
        if let Some(kept) = &self.kept {
            kept.save(&mode.light(&solution))?;
        }
        let (transport, patches) = (mode.transport, mode.patches().len());
        let studied = Studied { transport, solution, patches, errors, end, emitters, measured: None };
        self.console.say(table(&studied));
        let solution = &studied.solution;
        let pass = GatherPass::new(self.own.size, gathering);
        let fields = bounce_fields(&mode.lights, solution, SHEET.min(self.own.count as usize));
        let terms = bounce_pictures(&mode.lights, &fields, &pass, self.console);
        let label = mode.transport.label();
        let heading = format!("{}, {label}: {}", mode.scene().name, sentence(mode.transport, solution));
        let sums = partial_sums(&terms);
        // Of a series that diverges the last sum would leave the first in the dark.
        let typical = sums.get(1).or(sums.last());
        let exposing = self.own.problem.subject.exposing();
        let exposure = typical.map_or(Exposure::default(), |sum| exposing.of(sum));
        let sheet = bounce_sheet(heading, &terms, &sums, exposure);
        self.files.draw(&format!("-{}", mode.transport.file_name()), &["png"], &sheet.drawing())?;
        self.studied.push(studied);
        Ok(())
    }

    fn chart_and_table(&mut self, scene: &Scene) -> Result<(), CliError> {
        let lines: Vec<_> = self.studied.iter().map(|s| (s.transport.label(), s.solution.bounces.as_slice())).collect();
        let caption = format!(
            "{}: {} triangles, up to {} patches. Norm: area-weighted RMS over patches, channels and halves.",
            scene.name,
            scene.solid_faces(),
            self.studied.iter().map(|s| s.patches).max().unwrap_or(0),
        );
        let chart = bounces_chart(format!("The bounce series of {}", scene.name), caption, &lines);
        self.files.draw("", &["svg", "png"], &chart.drawing())?;
        if self.own.per.apart().emitters {
            table_of_emitters(&self.studied).write(self.files.add("-luminaires.csv"))?;
        }
        Ok(table_of_terms(&self.studied).write(self.files.add(".csv"))?)
    }
}

impl Studied {
    /// Error of one term, where known.
    fn error(&self, n: usize) -> Option<f64> {
        self.errors.get(n).copied()
    }

    fn report(self, scene: &Scene) -> BouncesReport {
        let apart = |n: usize| self.emitters.iter().filter_map(move |e| Some((e.name.clone(), *e.powers.get(n)?)));
        let errors = |n: usize| self.emitters.iter().filter_map(move |e| Some((e.name.clone(), *e.errors.get(n)?)));
        let error = |walks: f64| ErrorReport { form_factors: 0.0, patches: 0.0, walks, total: walks };
        let bounce = |b: &Bounce| BounceReport {
            bounce: *b,
            error: self.error(b.n).map(error),
            luminaires: apart(b.n).collect(),
            luminaire_errors: errors(b.n).collect(),
        };
        BouncesReport {
            scene: scene.name.clone(),
            transport: self.transport,
            patches: self.patches,
            spectral_radius: self.solution.radius,
            verdict: self.solution.verdict,
            met: self.end.map(|end| end == End::Met),
            why: self.end.and_then(End::why),
            bounces: self.solution.bounces.iter().map(bounce).collect(),
            measured: self.measured,
        }
    }
}

/// What a person should take from the series.
fn sentence(transport: Transport, solution: &Solution) -> String {
    let radius = solution.radius;
    let bounds = format!("spectral radius {:.4} to {:.4}", radius.lower, radius.upper);
    match solution.verdict {
        Verdict::Ends => "the series ends, K²E = 0 exactly".into(),
        Verdict::Converges => format!("the series converges, {bounds}"),
        Verdict::Undecided => format!("undecided, {bounds}"),
        Verdict::Diverges => format!(
            "the series diverges, {bounds}; it converges for alpha below {:.4}",
            f64::from(transport.alpha) / radius.upper,
        ),
    }
}

/// The table of one mode for people.
fn table(studied: &Studied) -> String {
    let (transport, solution) = (studied.transport, &studied.solution);
    let Transport { alpha, tau } = transport;
    let mut text = format!("{} (alpha {alpha}, tau {tau})\n", transport.label());
    let _ = writeln!(
        text,
        "{:<6} {:>11} {:>11} {:>11} {:>11} {:>11} {:>7} {:>11} {:>7}",
        "term", "R, W", "G, W", "B, W", "invisible R", "norm", "ratio", "tail bound", "error"
    );
    for b in &solution.bounces {
        let [r, g, blue] = b.power;
        let _ = writeln!(
            text,
            "{:<6} {r:>11.4e} {g:>11.4e} {blue:>11.4e} {:>11.4e} {:>11.4e} {:>7} {:>11} {:>7}",
            term_name(b.n),
            b.power_invisible[0],
            b.norm,
            b.ratio.map_or("-".into(), |r| format!("{r:.4}")),
            b.tail_bound.map_or("-".into(), |t| format!("{t:.4e}")),
            studied.error(b.n).map_or("-".into(), |e| format!("{:.2} %", 100.0 * e)),
        );
    }
    for emitter in &studied.emitters {
        let of = |powers: &[[f64; 3]]| powers.iter().flatten().sum::<f64>();
        let reflected = of(emitter.powers.get(1..).unwrap_or_default());
        let _ = writeln!(
            text,
            "{:<24} {:>11.4e} W emitted, {reflected:>11.4e} W reflected",
            emitter.name,
            of(&emitter.powers[..1])
        );
    }
    let _ = writeln!(text, "{}", sentence(transport, solution));
    if let Some(why) = studied.end.and_then(End::why) {
        let _ = writeln!(text, "the tolerance is not met: {why}");
    }
    text
}

/// The terms of every emitter, one row each.
fn table_of_emitters(studied: &[Studied]) -> Table {
    let mut table = Table::new("mode,alpha,tau,luminaire,n,power_r,power_g,power_b,error");
    for s in studied {
        let Transport { alpha, tau } = s.transport;
        let mode = s.transport.mode().map_or("", Mode::name);
        for emitter in &s.emitters {
            for (n, [r, g, b]) in emitter.powers.iter().enumerate() {
                table.row(&[&mode, &alpha, &tau, &emitter.name, &n, r, g, b, &known(emitter.errors.get(n))]);
            }
        }
    }
    table
}

/// All modes' terms, one row each.
fn table_of_terms(studied: &[Studied]) -> Table {
    let mut table = Table::new(
        "mode,alpha,tau,n,power_r,power_g,power_b,power_invisible_r,power_invisible_g,power_invisible_b,norm,ratio,tail_bound,error",
    );
    for s in studied {
        let Transport { alpha, tau } = s.transport;
        let mode = s.transport.mode().map_or("", Mode::name);
        for b in &s.solution.bounces {
            let ([r, g, blue], [x, y, z]) = (&b.power, &b.power_invisible);
            let error = known(s.error(b.n));
            let (ratio, tail) = (known(b.ratio), known(b.tail_bound));
            table.row(&[&mode, &alpha, &tau, &b.n, r, g, blue, x, y, z, &b.norm, &ratio, &tail, &error]);
        }
    }
    table
}
