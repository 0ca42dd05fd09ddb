//! `halflight figure 4`: local illumination beside real OpenGL and path tracing, as a page, numbers and a chart.
//!
//! Not handled: scenes other than the figure's own.

use std::path::PathBuf;

use serde::Serialize;

use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::cli::options::Common;
use crate::pictures::make_directory;
use crate::study::figures::{
    LocalEffort, LocalLight, PointLights, Swept, local_light, local_page, local_sweep, sweep_chart,
};

/// What is asked.
pub(crate) struct FigureFour {
    pub effort: LocalEffort,
    /// Stops over what suits the pictures.
    pub exposure: f32,
    /// Whether the luminaire's width is swept.
    pub sweep: bool,
}

/// `halflight figure 4 --json`
#[derive(Serialize)]
struct Report<'a> {
    opengl: Option<OpenGlReport<'a>>,
    point_lights: &'a [PointLights],
    area: AreaReport,
    quadrature: EPixel,
    tracer: TracerReport,
    sweep: &'a [Swept],
    files: Vec<PathBuf>,
}

#[derive(Serialize)]
struct OpenGlReport<'a> {
    renderer: &'a str,
    version: &'a str,
    seconds: f64,
}

#[derive(Serialize)]
struct AreaReport {
    e_pixel: f64,
    mean_colour_difference: f64,
}

#[derive(Serialize)]
struct EPixel {
    e_pixel: f64,
}

#[derive(Serialize)]
struct TracerReport {
    e_pixel: f64,
    seconds: f64,
}

/// Makes figure 4.
pub(crate) fn run(asked: &FigureFour, common: &Common) -> Result<(), CliError> {
    let console = Console::new(common);
    make_directory(&common.out)?;
    let found = local_light(&asked.effort, &console);
    let mut files = Vec::new();
    let mut write = |name: &str, save: &dyn Fn(&PathBuf) -> Result<(), CliError>| {
        for kind in ["png", "svg"] {
            let file = common.out.join(format!("{name}.{kind}"));
            save(&file)?;
            console.say(file.display().to_string());
            files.push(file);
        }
        Ok::<(), CliError>(())
    };
    let page = local_page(&found, &asked.effort, asked.exposure);
    write("gallery-figure-4", &|file| Ok(page.write(file)?))?;
    let mut swept = Vec::new();
    if asked.sweep {
        swept = local_sweep(common.seed, &console);
        let chart = sweep_chart(&swept, found.opengl.as_ref().map_or("the local mode", |_| "OpenGL"));
        write("gallery-figure-4-sweep", &|file| Ok(chart.write(file)?))?;
    }
    tell(&found, &swept, &console);
    console.report(&Report {
        opengl: found.opengl.as_ref().ok().map(|drawn| OpenGlReport {
            renderer: &drawn.renderer,
            version: &drawn.version,
            seconds: drawn.seconds,
        }),
        point_lights: &found.point_lights,
        area: AreaReport { e_pixel: found.area.e_pixel, mean_colour_difference: found.area.mean_colour },
        quadrature: EPixel { e_pixel: found.quadrature },
        tracer: TracerReport { e_pixel: found.tracer.e_pixel, seconds: found.traced_seconds[0] },
        sweep: &swept,
        files,
    })
}

/// The table.
fn tell(found: &LocalLight, swept: &[Swept], console: &Console) {
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
    line("halflight against a quadrature", found.quadrature, None, None, Some(found.local.seconds.total));
    let [seconds, equal] = found.traced_seconds;
    line("path tracing", tracer.e_pixel, Some(tracer.mean_colour), Some(tracer.largest), Some(seconds));
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
