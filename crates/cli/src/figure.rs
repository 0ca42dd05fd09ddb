//! `halflight figure`: labelled pictures for print, as PNG and SVG: the four modes, successive approximation, what lies
//! between the modes, and the local mode next to OpenGL.
//!
//! Not handled: charts of the series ([`bounces`](crate::bounces)) and of where it converges
//! ([`map`](crate::map)).

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Common, Completion, Effort, Precision, pixel, size, stops};
use crate::pictures::Files;
use crate::render::Rendering;
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::Mode;
use halflight::pictures::{Size, make_directory};
use halflight::render::{Apart, Fineness};
use halflight::scene::Scene;
use halflight::solve::{Settings, neumann};
use halflight_study::figures::{
    Figure, LocalEffort, LocalLight, PageSettings, SolvedMode, SquareEffort, Successive, Swept, TRIANGLES,
    between_grid, between_strip, four_modes, local_light, local_page, local_sweep, solve_points, square_points,
    successive, sweep_chart,
};
use halflight_study::map::check_crossings;
use halflight_study::{bounce_fields_and_rest, bounce_pictures};

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
    #[serde(flatten)]
    size: Size,
    /// The whole command.
    seconds: f64,
    pages: Vec<PageReport>,
    files: Vec<PathBuf>,
}

/// One page of a figure.
#[derive(Serialize)]
struct PageReport {
    file: PathBuf,
    #[serde(flatten)]
    figure: Figure,
}

/// `halflight figure 4 --json`
#[derive(Serialize)]
struct LocalReport<'a> {
    #[serde(flatten)]
    found: &'a LocalLight,
    sweep: Vec<Swept>,
    files: Vec<PathBuf>,
}

/// What all figures are made from.
struct Work<'a> {
    own: &'a FigureArguments,
    common: &'a Common,
    console: &'a Console,
    size: Size,
}

/// Makes the requested figure.
pub fn run(own: &FigureArguments, common: &Common, console: &Console) -> Result<(), CliError> {
    let start = Instant::now();
    let size = own.size.unwrap_or(own.figure.size());
    own.check_effort()?;
    own.effort.limit.check_pictures(size, own.figure.pixel_bytes())?;
    let scene = own.completion.load(&own.scene, console)?;
    scene.require_emission()?;
    make_directory(&common.out)?;
    let name = scene.name.clone();
    let work = Work { own, common, console, size };
    let figures = match own.figure {
        Name::FourModes => vec![("-figure-1", work.four_modes(scene)?)],
        Name::Series => vec![("-figure-series", work.series(scene)?)],
        Name::Between => work.between(scene)?.into(),
        Name::Local => return work.local(),
    };
    let mut files = Files::new(&common.out, &name);
    let mut pages = Vec::new();
    for (end, figure) in figures {
        files.draw(end, &["png", "svg"], &figure.page.drawing())?;
        pages.push(PageReport { file: common.out.join(format!("{name}{end}.png")), figure });
    }
    let files = files.said(console);
    let seconds = start.elapsed().as_secs_f64();
    console.report(&FigureReport { figure: own.figure.name(), scene: name, size, seconds, pages, files })
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

    /// Size of its pictures where none is requested.
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

    /// Patches and rays, and hemisphere rays of a pixel.
    fn fineness(&self) -> (Fineness, u32) {
        match self.effort.precision(None) {
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
        let (name, effort, console) = (scene.name.clone(), &self.own.effort, self.console);
        let (limit, precision) = (&effort.limit, effort.precision(None));
        let judged = matches!(precision, Precision::Within(_));
        let start = Instant::now();
        let (seed, apart) = (self.common.seed, Apart::default());
        let (size, time, kept) = (self.size, None, None);
        let rendering = Rendering { limit, precision, size, seed, time, apart, start, console, kept };
        let mut solved = Vec::new();
        rendering.each_mode(&scene, &Mode::ALL.map(Mode::transport), |_, transport, picture| {
            let mode = transport.mode().expect("these are the four modes");
            solved.push(SolvedMode { mode, picture, judged });
            Ok(())
        })?;
        for s in &solved {
            if let Err(e) = &s.picture {
                console.warn(format!("{}: no picture, {e}", s.mode));
            }
        }
        Ok(four_modes(&self.settings(&name), &solved))
    }

    /// The series of the four modes, from one cast of rays.
    fn series(&self, scene: Scene) -> Result<Figure, CliError> {
        let (name, modes) = (scene.name.clone(), Mode::ALL.map(Mode::transport));
        let (fineness, samples) = self.own.fineness();
        let seed = self.common.seed;
        let equations = self.own.effort.limit.solver(&scene, seed).assemble(&modes, fineness, self.console)?;
        let pass = GatherPass::new(self.size, &GatherSampling::with_samples(samples, seed));
        let mut series = Vec::new();
        for mode in &equations.modes {
            series.push(match neumann(&mode.operator, &Settings::default()) {
                Ok(s) => {
                    let fields = bounce_fields_and_rest(&mode.lights, &s.terms, BOUNCES);
                    let terms = bounce_pictures(&mode.lights, &fields, &pass, self.console);
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
        let p = Solver::new(&scene).cut(fineness.patches);
        let sampling = fineness.sampling(self.common.seed);
        check_crossings(&p, &sampling, 1, self.own.effort.limit.bytes())?;
        let gather = GatherSampling::with_samples(samples, self.common.seed);
        let effort = SquareEffort { sampling, gather, size: self.size };
        let points = solve_points(&p, &square_points(), &effort, self.console);
        let grid = between_grid(&self.settings(&name), &points);
        let strip = between_strip(&self.settings(&name), &points);
        Ok([("-figure-between", grid), ("-figure-between-strips", strip)])
    }

    /// Local illumination next to real OpenGL and path tracing, as a page, numbers and a chart.
    fn local(&self) -> Result<(), CliError> {
        let Work { own, common, console, size } = *self;
        let samples = own.effort.samples.unwrap_or(FOUR);
        let effort = LocalEffort { size, triangles: own.triangles as usize, samples, seed: common.seed };
        let found = local_light(&effort, console);
        let mut files = Files::new(&common.out, "gallery-figure-4");
        files.draw("", &["png", "svg"], &local_page(&found, &effort, own.exposure).drawing())?;
        let mut sweep = Vec::new();
        if own.sweep {
            sweep = local_sweep(common.seed, console);
            let chart = sweep_chart(&sweep, found.opengl.as_ref().map_or("the local mode", |_| "OpenGL"));
            files.draw("-sweep", &["png", "svg"], &chart.drawing())?;
        }
        let files = files.said(console);
        say_local(&found, &sweep, console);
        console.report(&LocalReport { found: &found, sweep, files })
    }
}

/// The table.
fn say_local(found: &LocalLight, swept: &[Swept], console: &Console) {
    if let Err(why) = &found.opengl {
        console.warn(format!("no OpenGL: {why}. Its lights are lit by the local mode instead"));
    }
    let line = |what: &str, e_pixel: f64, mean: Option<f64>, largest: Option<f64>, seconds: Option<f64>| {
        let or = |value: Option<String>| value.unwrap_or_else(|| "-".into());
        console.say(format!(
            "{what:34} {:>11} {:>11} {:>10} {:>8}",
            format!("{:.5} %", 100.0 * e_pixel),
            or(mean.map(|mean| format!("{:.3}/255", 255.0 * mean))),
            or(largest.map(|largest| format!("{:.3} %", 100.0 * largest))),
            or(seconds.map(|seconds| format!("{seconds:.2}"))),
        ));
    };
    console.say(format!("{:34} {:>11} {:>11} {:>10} {:>8}", "", "e_pixel", "mean colour", "largest", "seconds"));
    for lights in &found.point_lights {
        line(&format!("OpenGL, {}", lights.kind), lights.e_pixel, None, Some(lights.largest), None);
    }
    let (area, tracer) = (&found.area, &found.tracer);
    let seconds = found.opengl.as_ref().ok().map(|drawn| drawn.seconds);
    line("five lights for the luminaire", area.e_pixel, Some(area.mean_colour), Some(area.largest), seconds);
    line("halflight against a quadrature", found.quadrature.e_pixel, None, None, Some(found.local.seconds.total));
    let noise = &tracer.difference;
    line("path tracing", tracer.e_pixel, Some(noise.mean_colour), Some(noise.largest), Some(tracer.seconds));
    let equal = tracer.equal_seconds;
    console.say(format!("path tracing would need {equal:.1} s for the standard error of halflight's picture"));
    for s in swept {
        console.say(format!(
            "w/h {:4.2}: {:9.6} %, closed form {:9.6} %",
            s.ratio,
            100.0 * s.e_pixel,
            100.0 * s.closed_form
        ));
    }
}
