//! Labelled pictures for print, as PNG and SVG: the four modes, successive approximation, what lies between the modes,
//! and the local mode next to OpenGL, which the feature `opengl` asks for.
//!
//! ```text
//! cargo run --release --example figure -- 1 --size 300x200 --out docs
//! ```
//!
//! Not handled: charts of the series and of where it converges, which `halflight bounces` and `map` make.

mod between;
#[path = "../common/mod.rs"]
mod common;
mod four_modes;
mod local;
mod page;
mod successive;
mod two_spheres;

use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};

use crate::between::{between_grid, between_strip, solve_square};
use crate::common::{Failure, Output, end, open};
use crate::four_modes::{Precision, four_modes, solve_modes};
use crate::local::{LocalEffort, RATIOS, local_light, local_page, local_sweep, sweep_chart};
use crate::page::PageSettings;
use crate::successive::{solve_series, successive};
use crate::two_spheres::TRIANGLES;
use halflight::pictures::{Size, make_directory};
use halflight::render::Fineness;

/// Makes a labelled figure for print, as PNG and SVG.
#[derive(Parser, Debug)]
struct Arguments {
    /// Which figure.
    #[command(subcommand)]
    figure: Name,
    /// Where it goes.
    #[command(flatten)]
    output: Output,
    /// Size of each picture in the figure [default: 600x400 in figure 1, 512x512 in figure 4, 240x160 in the others]
    #[arg(long, global = true, value_name = "WxH", value_parser = size)]
    size: Option<Size>,
    /// Brighten all pictures by so many stops (factors of two) over what suits them
    #[arg(long, global = true, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
}

/// The figures.
#[derive(Subcommand, Debug)]
enum Name {
    /// The four modes on one scene at one exposure
    #[command(name = "1")]
    FourModes(FourModes),
    /// Successive approximation: E, KE, K²E, ... above their sums, for each mode that converges
    Series(Subject),
    /// Between the modes: a grid over the (alpha, tau) square, and strips from mode to mode
    Between(Subject),
    /// The local mode, real OpenGL and path tracing on two spheres made by a recipe, and what they differ by
    #[command(name = "4")]
    Local(Local),
}

/// A scene, and how finely it is solved.
#[derive(Args, Debug)]
struct Subject {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file
    #[arg(long, default_value = "gallery")]
    scene: String,
    /// Cut the scene into about so many patches [default: 3000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    patches: Option<u32>,
    /// Cast so many hemisphere rays from each patch [default: 256]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    rays: Option<u32>,
    /// Cast so many hemisphere rays for each pixel, rounded up to a power of two [default: 128]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    samples: Option<u32>,
}

/// Figure 1.
#[derive(Args, Debug)]
struct FourModes {
    #[command(flatten)]
    subject: Subject,
    /// Error to aim at, a share of the picture's RMS radiance, unless effort is given
    #[arg(
        long,
        value_name = "T",
        default_value_t = 0.01,
        value_parser = tolerance,
        conflicts_with_all = ["patches", "rays", "samples"]
    )]
    tolerance: f64,
}

/// Figure 4.
#[derive(Args, Debug)]
struct Local {
    /// Samples a pixel, by every method
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    samples: u32,
    /// About how many triangles
    #[arg(
        long,
        value_name = "N",
        default_value_t = TRIANGLES as u32,
        value_parser = clap::value_parser!(u32).range(100..=20_000_000)
    )]
    triangles: u32,
    /// Also the error of five lights over the luminaire's width to height, as a chart
    #[arg(long)]
    sweep: bool,
}

fn main() -> ExitCode {
    end(run(&Arguments::parse()))
}

/// Makes the requested figure.
fn run(own: &Arguments) -> Result<(), Failure> {
    let size = own.size.unwrap_or(own.figure.size());
    let subject = match &own.figure {
        Name::FourModes(FourModes { subject, .. }) | Name::Series(subject) | Name::Between(subject) => subject,
        Name::Local(local) => return own.local(local, size),
    };
    let scene = open(&subject.scene)?;
    make_directory(&own.output.out)?;
    let settings = PageSettings { scene: &scene, size, brighter: own.exposure, seed: own.output.seed };
    let pages = match &own.figure {
        Name::FourModes(four) => vec![("1", four_modes(&settings, &solve_modes(&settings, four.precision())?))],
        Name::Series(_) => vec![("series", successive(&settings, &solve_series(&settings, subject.effort())?))],
        _ => {
            let points = solve_square(&settings, subject.effort())?;
            vec![("between", between_grid(&settings, &points)), ("between-strips", between_strip(&settings, &points))]
        }
    };
    pages.iter().try_for_each(|(end, page)| own.output.draw(&format!("{}-figure-{end}", scene.name), &page.drawing()))
}

impl Arguments {
    /// Local illumination next to real OpenGL and path tracing, as a page, numbers and a chart.
    fn local(&self, Local { samples, triangles, sweep }: &Local, size: Size) -> Result<(), Failure> {
        let Arguments { output, exposure, .. } = self;
        make_directory(&output.out)?;
        let effort = LocalEffort { size, triangles: *triangles as usize, samples: *samples, seed: output.seed };
        let found = local_light(&effort);
        output.draw("gallery-figure-4", &local_page(&found, &effort, *exposure).drawing())?;
        if let Err(why) = &found.opengl {
            eprintln!("warning: no OpenGL: {why}. Its lights are lit by the local mode instead");
        }
        print!("{}", found.table());
        if *sweep {
            let swept = local_sweep(&RATIOS, output.seed);
            let five = found.opengl.as_ref().map_or("the local mode", |_| "OpenGL");
            output.draw("gallery-figure-4-sweep", &sweep_chart(&swept, five).drawing())?;
            swept.iter().for_each(|s| println!("{s}"));
        }
        Ok(())
    }
}

impl Name {
    /// Size of its pictures where none is requested.
    fn size(&self) -> Size {
        match self {
            Name::FourModes(_) => Size { width: 600, height: 400 },
            Name::Local(_) => Size { width: 512, height: 512 },
            Name::Series(_) | Name::Between(_) => Size { width: 240, height: 160 },
        }
    }
}

impl Subject {
    /// Patches and rays, and hemisphere rays of a pixel.
    fn effort(&self) -> (Fineness, u32) {
        let patches = self.patches.unwrap_or(3000) as usize;
        (Fineness { patches, rays: self.rays.unwrap_or(256) }, self.samples.unwrap_or(128))
    }
}

impl FourModes {
    /// The tolerance, unless some effort is given.
    fn precision(&self) -> Precision {
        match (self.subject.patches, self.subject.rays, self.subject.samples) {
            (None, None, None) => Precision::Within(self.tolerance),
            _ => Precision::Fixed(self.subject.effort()),
        }
    }
}

/// A relative error of a picture.
fn tolerance(text: &str) -> Result<f64, String> {
    let parsed = text.parse().ok().filter(|error| (1e-4..=0.5).contains(error));
    parsed.ok_or_else(|| "must be a number from 0.0001 to 0.5; 0.01 is 1 %".into())
}

/// WIDTHxHEIGHT in pixels.
fn size(text: &str) -> Result<Size, String> {
    let parsed = text.split_once('x').and_then(|(width, height)| {
        let [width, height] = [width, height].map(|side| side.parse().ok().filter(|side| (1..=16_384).contains(side)));
        Some(Size { width: width?, height: height? })
    });
    parsed.ok_or_else(|| "must be WIDTHxHEIGHT, each from 1 to 16384, as in 640x480".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_go_together_is_refused() {
        let parse = |words: &str| Arguments::try_parse_from(words.split_whitespace());
        for wrong in
            ["figure", "figure 9", "figure series --tolerance 0.1", "figure 4 --scene gallery", "figure 1 --size 9"]
        {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
        assert!(parse("figure 1 --tolerance 0.1 --rays 16").is_err());
        let given = parse("figure 1 --rays 16 --exposure -1.5 --out docs").unwrap();
        let Name::FourModes(four) = &given.figure else { panic!("{given:?}") };
        assert!(matches!(four.precision(), Precision::Fixed((Fineness { patches: 3000, rays: 16 }, 128))));
    }
}
