//! `halflight figure`: labelled pictures for print, as PNG and SVG: the four modes, successive approximation, what lies
//! between the modes, and the local mode beside OpenGL ([`figure_four`]).
//!
//! Not handled: charts of the series ([`bounces`](crate::cli::bounces)) and of where it converges
//! ([`map`](crate::cli::map)).

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use serde::Serialize;

use crate::cli::console::Console;
use crate::cli::effort::{Effort, Precision};
use crate::cli::error::CliError;
use crate::cli::figure_four;
use crate::cli::figure_four::FigureFour;
use crate::cli::figure_report::{PageReport, page_report};
use crate::cli::memory::{Within, pixel};
use crate::cli::options::{Common, Completion};
use crate::cli::unmet::warn_of_error;
use crate::cli::values::{size, stops};
use crate::gather::{GatherPass, GatherSampling};
use crate::light::Mode;
use crate::pictures::{Size, make_directory};
use crate::render::prepared::Spent;
use crate::render::prepared::render_fixed;
use crate::render::{Fineness, Prepared, Wanted, assemble, prepare, render_within};
use crate::scene::Scene;
use crate::solve::{Settings, neumann};
use crate::study::figures::{
    Figure, LocalEffort, PageSettings, SolvedMode, SquareEffort, Successive, TRIANGLES, between_grid, between_strip,
    four_modes, solve_points, square_points, successive,
};
use crate::study::map::check_crossings;
use crate::study::{bounce_fields_and_rest, bounce_pictures};

/// Bounces with a picture of their own in the figure of the series; the rest shares one.
const BOUNCES: usize = 4;
/// Effort of the figures that are not made to a tolerance, where none is given.
const FINENESS: Fineness = Fineness { patches: 3000, rays: 256 };
const SAMPLES: u32 = 128;
/// Samples of a pixel of figure 4, by every method.
const FOUR: u32 = 64;

/// `halflight figure`
#[derive(Args, Debug)]
pub struct FigureArguments {
    /// Which figure
    #[arg(value_enum, value_name = "NAME")]
    pub figure: Name,
    /// A built-in scene (see `halflight scenes`), a .toml scene file or an .obj file
    #[arg(long, default_value = "gallery")]
    pub scene: String,
    /// What its files do not say.
    #[command(flatten)]
    pub completion: Completion,
    /// Size of each picture in the figure [default: 600x400 in figure 1, 512x512 in figure 4, 240x160 in the others]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<Size>,
    /// Brighten all pictures by so many stops (factors of two) over what suits them
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = stops)]
    pub exposure: f32,
    /// Figure 4: also the error of five lights over the luminaire's width to height, as a chart
    #[arg(long)]
    pub sweep: bool,
    /// Figure 4: about how many triangles
    #[arg(
        long,
        value_name = "N",
        default_value_t = TRIANGLES as u32,
        value_parser = clap::value_parser!(u32).range(100..=20_000_000)
    )]
    pub triangles: u32,
    /// How accurately; a tolerance is for figure 1.
    #[command(flatten)]
    pub effort: Effort,
}

/// The figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Name {
    /// The four modes on one scene at one exposure
    #[value(name = "1")]
    FourModes,
    /// Successive approximation: E, KE, K²E, ... above their sums, for each mode that converges
    Series,
    /// The local mode, real OpenGL and path tracing on two spheres made by a recipe, and what they differ by
    #[value(name = "4")]
    Local,
    /// Between the modes: a grid over the (alpha, tau) square, and strips from mode to mode
    Between,
}

/// `halflight figure --json`
#[derive(Serialize)]
struct FigureReport {
    figure: &'static str,
    scene: String,
    /// Size of each picture, pixels.
    width: usize,
    height: usize,
    /// The whole command.
    seconds: f64,
    pages: Vec<PageReport>,
    files: Vec<PathBuf>,
}

/// What all figures are made from.
struct Work<'a> {
    own: &'a FigureArguments,
    common: &'a Common,
    console: &'a Console,
    size: Size,
}

/// Makes the figure asked for.
pub fn run(own: &FigureArguments, common: &Common) -> Result<(), CliError> {
    let (start, console) = (Instant::now(), Console::new(common));
    let size = own.size.unwrap_or(own.figure.size());
    own.check_effort()?;
    own.effort.limit.check_pictures(size, own.figure.pixel_bytes())?;
    let scene = own.completion.load(&own.scene, |warning| console.warn(warning))?;
    scene.require_emission()?;
    make_directory(&common.out)?;
    let name = scene.name.clone();
    let work = Work { own, common, console: &console, size };
    let figures = match own.figure {
        Name::FourModes => vec![("-figure-1", work.four_modes(scene)?)],
        Name::Series => vec![("-figure-series", work.series(scene)?)],
        Name::Between => work.between(scene)?.into(),
        Name::Local => return figure_four::run(&own.figure_four(size, common.seed), common),
    };
    let mut report = FigureReport {
        figure: own.figure.name(),
        scene: name.clone(),
        width: size.width,
        height: size.height,
        seconds: 0.0,
        pages: Vec::new(),
        files: Vec::new(),
    };
    for (end, figure) in &figures {
        let [png, svg] = ["png", "svg"].map(|kind| common.out.join(format!("{name}{end}.{kind}")));
        for file in [&png, &svg] {
            figure.page.write(file)?;
            console.say(file.display().to_string());
        }
        report.pages.push(page_report(figure, png.clone()));
        report.files.extend([png, svg]);
    }
    report.seconds = start.elapsed().as_secs_f64();
    console.report(&report)
}

impl Name {
    /// As on the command line.
    fn name(self) -> &'static str {
        match self {
            Name::FourModes => "1",
            Name::Series => "series",
            Name::Local => "4",
            Name::Between => "between",
        }
    }

    /// Size of its pictures where none is asked for.
    fn size(self) -> Size {
        match self {
            Name::FourModes => Size { width: 600, height: 400 },
            Name::Local => Size { width: 512, height: 512 },
            Name::Series | Name::Between => Size { width: 240, height: 160 },
        }
    }

    /// Bytes for each pixel of a panel, all panels together.
    fn pixel_bytes(self) -> f64 {
        match self {
            Name::FourModes => pixel::WITHIN,
            Name::Local => 6.0 * pixel::TRACE,
            Name::Series => pixel::BOUNCES.0 + 4.0 * BOUNCES as f64 * pixel::BOUNCES.1,
            Name::Between => pixel::BOUNCES.0 + square_points().len() as f64 * pixel::BOUNCES.1,
        }
    }
}

impl FigureArguments {
    /// A tolerance is what one picture has.
    fn check_effort(&self) -> Result<(), CliError> {
        if self.effort.tolerance.is_none() || self.figure == Name::FourModes {
            return Ok(());
        }
        Err(CliError::Usage {
            message: format!("figure {} is made with given effort, not to a tolerance", self.figure.name()),
            help: "pass --patches, --rays or --samples instead of --tolerance".into(),
        })
    }

    /// What figure 4 is made with.
    fn figure_four(&self, size: Size, seed: u32) -> FigureFour {
        let samples = self.effort.samples.unwrap_or(FOUR);
        let effort = LocalEffort { size, triangles: self.triangles as usize, samples, seed };
        FigureFour { effort, exposure: self.exposure, sweep: self.sweep }
    }

    /// Patches and rays, and hemisphere rays of a pixel.
    fn fineness(&self) -> (Fineness, u32) {
        match self.effort.precision() {
            Precision::Within(_) => (FINENESS, SAMPLES),
            Precision::Fixed(fineness, samples) => (fineness, samples),
        }
    }
}

impl Work<'_> {
    /// What the pages of a scene have in common.
    fn settings<'n>(&self, scene: &'n str) -> PageSettings<'n> {
        PageSettings { scene, size: self.size, brighter: self.own.exposure }
    }

    /// The four modes: to a tolerance, or with given effort.
    fn four_modes(&self, scene: Scene) -> Result<Figure, CliError> {
        let (name, modes) = (scene.name.clone(), Mode::ALL.map(Mode::transport));
        let (effort, seed) = (&self.own.effort, self.common.seed);
        let mut solved = Vec::new();
        match effort.precision() {
            Precision::Within(tolerance) => {
                let Within { prepared: mut p, memory } = effort.prepare_within(scene, &modes, tolerance)?;
                let wanted = Wanted { tolerance, size: self.size, deadline: None, memory, seed };
                for mode in Mode::ALL {
                    let picture = render_within(&mut p, mode.transport(), &wanted, self.console);
                    if let Ok(found) = &picture {
                        warn_of_error(self.console, mode.transport(), found, tolerance);
                    }
                    solved.push(SolvedMode { mode, picture, judged: true });
                }
            }
            Precision::Fixed(fineness, samples) => {
                let p = effort.prepare(scene, &modes, fineness, seed)?;
                let (assembled, _) = assemble(&p, &modes, &fineness.sampling(seed), self.console);
                let pass = GatherPass::new(self.size, &GatherSampling::with_samples(samples, seed));
                for (mode, k) in Mode::ALL.into_iter().zip(&assembled) {
                    let picture = render_fixed(&p, k, &pass, Spent::default(), self.console);
                    solved.push(SolvedMode { mode, picture, judged: false });
                }
            }
        }
        for s in &solved {
            if let Err(e) = &s.picture {
                self.console.warn(format!("{}: no picture, {e}", s.mode));
            }
        }
        Ok(four_modes(&self.settings(&name), &solved))
    }

    /// The series of the four modes, from one cast of rays.
    fn series(&self, scene: Scene) -> Result<Figure, CliError> {
        let (name, modes) = (scene.name.clone(), Mode::ALL.map(Mode::transport));
        let (fineness, samples) = self.own.fineness();
        let seed = self.common.seed;
        let p = self.own.effort.prepare(scene, &modes, fineness, seed)?;
        let (assembled, _) = assemble(&p, &modes, &fineness.sampling(seed), self.console);
        let pass = GatherPass::new(self.size, &GatherSampling::with_samples(samples, seed));
        let mut series = Vec::new();
        for mode in &assembled {
            series.push(match neumann(&mode.operator, &Settings::default()) {
                Ok(s) => {
                    let terms =
                        bounce_pictures(&p, mode, &bounce_fields_and_rest(&p, &s, BOUNCES), &pass, self.console);
                    Successive { transport: mode.transport, verdict: s.verdict, radius: s.radius, terms }
                }
                Err(e) => {
                    self.console.warn(format!("{}: no sum, {e}", mode.transport.label()));
                    Successive::diverging(mode.transport, &e)
                }
            });
        }
        Ok(successive(&self.settings(&name), &series))
    }

    /// The square, solved from one cast of rays, as a grid and as strips.
    fn between(&self, scene: Scene) -> Result<[(&'static str, Figure); 2], CliError> {
        let name = scene.name.clone();
        let (fineness, samples) = self.own.fineness();
        let p: Prepared = prepare(scene, fineness.patches);
        let sampling = fineness.sampling(self.common.seed);
        check_crossings(&p, &sampling, 1, self.own.effort.limit.bytes())?;
        let gather = GatherSampling::with_samples(samples, self.common.seed);
        let effort = SquareEffort { sampling, gather, size: self.size };
        let points = solve_points(&p, &square_points(), &effort, self.console);
        let grid = between_grid(&self.settings(&name), &points);
        let strip = between_strip(&self.settings(&name), &points);
        Ok([("-figure-between", grid), ("-figure-between-strips", strip)])
    }
}
