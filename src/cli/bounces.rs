//! `halflight bounces`: the series E, KE, K²E, ... of each mode, as a table, a chart, CSV and pictures.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use crate::cli::console::Console;
use crate::cli::effort::Precision;
use crate::cli::error::CliError;
use crate::cli::memory::{Within, pixel};
use crate::cli::options::{Common, Problem};
use crate::cli::report::{BounceReport, BouncesReport, Modes, mode_of};
use crate::cli::values::size;
use crate::error::deadline::deadline_after;
use crate::gather::{GatherPass, GatherSampling, Gathering};
use crate::light::Transport;
use crate::pictures::{Exposure, Size, Table, known, make_directory};
use crate::render::{
    Assembled, BounceSeries, End, Fineness, Prepared, TermError, WantedTerms, assemble, explore_within,
};
use crate::scene::Scene;
use crate::solve::{Bounce, Solution, Verdict, explore};
use crate::study::{bounce_fields, bounce_pictures, bounce_sheet, bounces_chart, partial_sums, term_name};

/// `halflight bounces`
#[derive(Args, Debug)]
pub struct Bounces {
    /// What to solve.
    #[command(flatten)]
    pub problem: Problem,
    /// Terms in the table, the chart and the sheet, E not counted
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub count: u16,
    /// Size of each picture in the sheet
    #[arg(long, value_name = "WxH", default_value = "160x160", value_parser = size)]
    pub size: Size,
}

/// Bounces shown in the sheet at most: more would not fit a page.
const SHEET: usize = 12;

/// The series of one mode.
struct Studied {
    transport: Transport,
    solution: Solution,
    patches: usize,
    /// Errors of the terms, where a tolerance was asked for.
    errors: Option<Vec<TermError>>,
    /// What ended the search for it.
    end: Option<End>,
}

/// Studies every mode asked for.
pub fn run(own: &Bounces, common: &Common) -> Result<(), CliError> {
    let console = Console::new(common);
    let (fixed, term) = pixel::BOUNCES;
    let each = fixed + term * f64::from(own.count);
    own.problem.effort.limit.check_pictures(own.size, each)?;
    let scene = own.problem.subject.load(|warning| console.warn(warning))?;
    make_directory(&common.out)?;
    let transports = own.problem.subject.transports(&scene);
    let run = Run { own, common, console: &console };
    let (prepared, studies) = match own.problem.effort.precision() {
        Precision::Fixed(fineness, samples) => run.fixed(scene, &transports, fineness, samples)?,
        Precision::Within(tolerance) => run.within(scene, &transports, tolerance)?,
    };
    let Studies { studied, mut files } = studies;
    files.extend(chart_and_table(common, &prepared, &studied)?);
    for file in &files {
        console.say(file.display().to_string());
    }
    console.report(&Modes { modes: studied.iter().map(|s| report(&prepared, s)).collect(), files })
}

/// The modes studied so far, and the files written.
#[derive(Default)]
struct Studies {
    studied: Vec<Studied>,
    files: Vec<PathBuf>,
}

/// What all modes of one run share.
struct Run<'a> {
    own: &'a Bounces,
    common: &'a Common,
    console: &'a Console,
}

impl Run<'_> {
    /// Every mode with the effort given: one set of patches and one cast of rays for all.
    fn fixed(
        &self,
        scene: Scene,
        transports: &[Transport],
        fineness: Fineness,
        samples: u32,
    ) -> Result<(Prepared, Studies), CliError> {
        let Run { own, common, console } = *self;
        let p = own.problem.effort.prepare(scene, transports, fineness, common.seed)?;
        let (modes, _) = assemble(&p, transports, &fineness.sampling(common.seed), console);
        let sampling = GatherSampling::with_samples(samples, common.seed);
        let mut studies = Studies::default();
        for mode in &modes {
            let solution = explore(&mode.operator, own.count as usize);
            let (transport, patches) = (mode.transport, p.patches.len());
            let s = Studied { transport, solution, patches, errors: None, end: None };
            self.take(&mut studies, &p, mode, s, (&sampling).into())?;
        }
        Ok((p, studies))
    }

    /// Every mode to a tolerance of its terms' powers, each with the patches that it needs.
    fn within(&self, scene: Scene, transports: &[Transport], tolerance: f64) -> Result<(Prepared, Studies), CliError> {
        let Run { own, common, console } = *self;
        let (time, seed) = (own.problem.time, common.seed);
        let Within { prepared: mut p, memory } = own.problem.effort.prepare_within(scene, transports, tolerance)?;
        let mut studies = Studies::default();
        for &transport in transports {
            let deadline = time.and_then(|seconds| deadline_after(Instant::now(), seconds));
            let wanted = WantedTerms { count: own.count.into(), tolerance, time, memory, seed };
            let BounceSeries { mode, solution, errors, end, .. } = explore_within(&mut p, transport, &wanted, console);
            let (errors, end) = (Some(errors), Some(end));
            let s = Studied { transport, solution, patches: p.patches.len(), errors, end };
            self.take(&mut studies, &p, &mode, s, Gathering::Within { error: tolerance, seed, deadline })?;
        }
        Ok((p, studies))
    }

    /// Shows one mode's table and writes its sheet.
    fn take(
        &self,
        studies: &mut Studies,
        p: &Prepared,
        mode: &Assembled,
        s: Studied,
        gathering: Gathering,
    ) -> Result<(), CliError> {
        self.console.say(table(&s));
        studies.files.push(self.sheet(p, mode, &s.solution, gathering)?);
        studies.studied.push(s);
        Ok(())
    }

    /// The sheet of one mode: its terms, and their sums under them.
    fn sheet(
        &self,
        prepared: &Prepared,
        mode: &Assembled,
        solution: &Solution,
        gathering: Gathering,
    ) -> Result<PathBuf, CliError> {
        let Run { own, common, console } = *self;
        let count = SHEET.min(own.count as usize);
        let pass = GatherPass::new(own.size, gathering);
        let terms = bounce_pictures(prepared, mode, &bounce_fields(prepared, solution, count), &pass, console);
        let sums = partial_sums(&terms);
        let scene = &prepared.scene.name;
        let label = mode.transport.label();
        let heading = format!("{scene}, {label}: {}", sentence(mode.transport, solution));
        let exposure = Exposure { stops: own.problem.subject.exposure };
        let path = common.out.join(format!("{scene}-bounces-{}.png", label.replace(' ', "-")));
        bounce_sheet(heading, &terms, &sums, exposure).write(&path)?;
        Ok(path)
    }
}

fn chart_and_table(common: &Common, prepared: &Prepared, studied: &[Studied]) -> Result<[PathBuf; 3], CliError> {
    let scene = &prepared.scene.name;
    let lines: Vec<_> = studied.iter().map(|s| (s.transport.label(), s.solution.bounces.as_slice())).collect();
    let caption = format!(
        "{scene}: {} triangles, up to {} patches. Norm: area-weighted RMS over patches, channels and halves.",
        prepared.scene.solid_faces(),
        studied.iter().map(|s| s.patches).max().unwrap_or(0),
    );
    let chart = bounces_chart(format!("The bounce series of {scene}"), caption, &lines);
    let file = |extension: &str| common.out.join(format!("{scene}-bounces.{extension}"));
    let files = [file("svg"), file("png"), file("csv")];
    chart.write(&files[0])?;
    chart.write(&files[1])?;
    table_of_terms(studied).write(&files[2])?;
    Ok(files)
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

/// The table of one mode.
fn table(studied: &Studied) -> String {
    let (transport, solution) = (studied.transport, &studied.solution);
    let (_, alpha, tau) = mode_of(transport);
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
            studied.error(b.n).map_or("-".into(), |e| format!("{:.2} %", 100.0 * e.total)),
        );
    }
    let _ = writeln!(text, "{}", sentence(transport, solution));
    if let Some(why) = studied.end.and_then(End::why) {
        let _ = writeln!(text, "the tolerance is not met: {why}");
    }
    text
}

/// All modes' terms, one row each.
fn table_of_terms(studied: &[Studied]) -> Table {
    let mut table = Table::new(
        "mode,alpha,tau,n,power_r,power_g,power_b,power_invisible_r,power_invisible_g,power_invisible_b,norm,ratio,tail_bound,error",
    );
    for s in studied {
        let (mode, alpha, tau) = mode_of(s.transport);
        for b in &s.solution.bounces {
            let ([r, g, blue], [x, y, z]) = (&b.power, &b.power_invisible);
            let error = known(s.error(b.n).map(|e| e.total));
            let (ratio, tail) = (known(b.ratio), known(b.tail_bound));
            let mode = mode.unwrap_or_default();
            table.row(&[&mode, &alpha, &tau, &b.n, r, g, blue, x, y, z, &b.norm, &ratio, &tail, &error]);
        }
    }
    table
}

fn report(prepared: &Prepared, studied: &Studied) -> BouncesReport {
    let solution = &studied.solution;
    let (mode, alpha, tau) = mode_of(studied.transport);
    let bounce = |b: &Bounce| BounceReport { bounce: *b, error: studied.error(b.n) };
    BouncesReport {
        scene: prepared.scene.name.clone(),
        mode,
        alpha,
        tau,
        patches: studied.patches,
        spectral_radius: solution.radius,
        verdict: solution.verdict.name(),
        met: studied.end.map(|end| end == End::Met),
        why: studied.end.and_then(End::why),
        bounces: solution.bounces.iter().map(bounce).collect(),
    }
}

impl Studied {
    /// Error of one term, where known.
    fn error(&self, n: usize) -> Option<TermError> {
        self.errors.as_ref()?.get(n).copied()
    }
}
