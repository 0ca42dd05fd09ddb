//! Figure 4: local illumination by this solver, by real OpenGL and by path tracing, on two spheres, in numbers and as a
//! page; and how wrong five lights are for a luminaire, over its width to height.
//!
//! ```text
//! point lights   the same lights in both: OpenGL against the local mode
//! area           OpenGL's five lights against the luminaire that they stand for, in the local mode
//! quadrature     the local mode's luminaire against so many lights at Gauss and Legendre's points, along the same rays
//! tracer         path tracing of the luminaire against the local mode
//! ```
//!
//! All as the mean of e_pixel ([`mean_e_pixel`]). Where there is no OpenGL its five lights are lit by the local mode,
//! which differs by what the point lights show where there is one.
//!
//! Below the middle of a luminaire w by d at height h light falls as the mean over it of (1 + q)^-2, q the square of
//! the distance from its middle over h². The mean of q over the luminaire is (w² + d²)/(12 h²), over the five lights 4
//! (w² + d²)/(45 h²), so to first order the five are off by -2 (4/45 - 1/12) (w² + d²)/h² = -(w² + d²)/(90 h²).

use std::fmt::{Display, Formatter, Write as _};
use std::time::Instant;

use crate::page::exposure_words;
use crate::two_spheres::{FiveLights, Lit, TwoSpheres};
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Mode, Rgb};
use halflight::pictures::{Exposure, Picture, Size, largest_difference, mean_difference, mean_e_pixel};
use halflight::rays::Rays;
use halflight::render::{Fineness, Rendered, Silent};
use halflight::scene::Scene;
use halflight_plot::{
    Axis, Cell, Chart, Heading, Page, PageRow, Series, Shown, Style, difference_cells, difference_scale,
};
use halflight_reference::opengl::{NoOpenGl, OpenGlPicture, render as draw};
use halflight_reference::{TraceSettings, Tracer};

/// Points of the quadrature, to a side of the luminaire.
const POINTS: usize = 16;
/// Patches are for light that travels, and in the local mode none does.
const FINENESS: Fineness = Fineness { patches: 64, rays: 1 };

/// How the figure is made.
#[derive(Clone, Copy, Debug)]
pub struct LocalEffort {
    /// Width and height of the pictures.
    pub size: Size,
    /// About how many triangles.
    pub triangles: usize,
    /// Samples a pixel, by every method.
    pub samples: u32,
    /// Chooses the sample points.
    pub seed: u32,
}

/// OpenGL against the local mode under the same lights.
#[derive(Clone, Debug)]
pub struct PointLights {
    /// The lights, and whether there are highlights.
    pub kind: String,
    /// What the two differ by.
    pub difference: PictureDifference,
}

/// What two pictures differ by.
#[derive(Clone, Copy, Debug)]
pub struct PictureDifference {
    /// Mean e_pixel.
    pub e_pixel: f64,
    /// The length of the difference of the mean colours, over that from black to white.
    pub mean_colour: f64,
    /// The largest difference of a channel.
    pub largest: f64,
}

/// Path tracing against the local mode.
#[derive(Clone, Debug)]
pub struct TracedLight {
    /// Its picture of the luminaire.
    pub picture: Picture,
    /// What it differs by from the local mode.
    pub difference: PictureDifference,
    /// Seconds that it took.
    pub seconds: f64,
    /// Seconds that it would take to the local mode's standard error, as N^-1/2.
    pub equal_seconds: f64,
}

/// All that the figure shows.
pub struct LocalLight {
    /// OpenGL under five lights, or why it is not there.
    pub opengl: Result<OpenGlPicture, NoOpenGl>,
    /// The local mode under the same five lights.
    pub five: Rendered,
    /// The local mode under the luminaire.
    pub local: Rendered,
    /// By kind of light, without and with highlights; none without OpenGL.
    pub point_lights: Vec<PointLights>,
    /// Five lights against the luminaire.
    pub area: PictureDifference,
    /// Mean e_pixel of the local mode against the quadrature.
    pub quadrature: f64,
    /// Path tracing against the local mode.
    pub tracer: TracedLight,
}

impl LocalLight {
    /// The picture of five lights: OpenGL's, or ours where there is none.
    fn five(&self) -> &Picture {
        self.opengl.as_ref().map_or(&self.five.picture, |drawn| &drawn.picture)
    }
}

/// Makes all pictures and compares them.
pub fn local_light(effort: &LocalEffort) -> LocalLight {
    let of = |lit| TwoSpheres { triangles: effort.triangles, ..TwoSpheres::paper(lit) };
    let scene = of(Lit::Area).scene();
    let local = solve(&scene, effort, effort.samples);
    let (traced, noise, seconds) = trace(&scene, effort);
    let five_lights = of(Lit::Five(FiveLights::Warn)).scene();
    let five = solve(&five_lights, effort, effort.samples);
    let opengl = draw(&five_lights, effort.size, effort.samples);
    // Nothing but the lights differs between the two, and camera rays are shared: few are enough.
    let [closed, summed] = [Lit::Area, Lit::Quadrature(POINTS)].map(|lit| solve(&of(lit).scene(), effort, 4));
    let difference = difference(&traced, &local.picture);
    LocalLight {
        area: self::difference(opengl.as_ref().map_or(&five.picture, |found| &found.picture), &local.picture),
        quadrature: mean_e_pixel(&closed.picture, &summed.picture).unwrap_or(f64::NAN),
        tracer: TracedLight {
            picture: traced,
            difference,
            seconds,
            equal_seconds: seconds * (noise / rms(&local.standard_error)).powi(2),
        },
        point_lights: if opengl.is_ok() { point_lights(effort) } else { Vec::new() },
        opengl,
        five,
        local,
    }
}

/// Every kind of five lights, without and with highlights, by OpenGL and by the local mode.
fn point_lights(effort: &LocalEffort) -> Vec<PointLights> {
    let mut found = Vec::new();
    for kind in FiveLights::ALL {
        for highlights in [false, true] {
            let lit = Lit::Five(kind);
            let scene = TwoSpheres { triangles: effort.triangles, highlights, ..TwoSpheres::paper(lit) }.scene();
            if let Ok(drawn) = draw(&scene, effort.size, effort.samples) {
                let own = solve(&scene, effort, effort.samples);
                let kind = if highlights { format!("{} with highlights", kind.name()) } else { kind.name().into() };
                found.push(PointLights { kind, difference: difference(&drawn.picture, &own.picture) });
            }
        }
    }
    found
}

/// The local mode's picture, with so many camera rays a pixel.
fn solve(scene: &Scene, effort: &LocalEffort, samples: u32) -> Rendered {
    let solver = Solver::new(scene).seed(effort.seed).memory(f64::INFINITY);
    let equations = solver.assemble(&[Mode::Local.transport()], FINENESS, &Silent).expect("no memory is asked for");
    let sampling = GatherSampling { camera: samples.div_ceil(2), luminaire: 1, hemisphere: 1, seed: effort.seed };
    let found = equations.render(&GatherPass::new(effort.size, &sampling), &Silent).remove(0);
    found.expect("light that nothing passes on makes a series that ends")
}

/// The path tracer's picture, its standard error, and its seconds.
fn trace(scene: &Scene, effort: &LocalEffort) -> (Picture, f64, f64) {
    let start = Instant::now();
    let rays = Rays::new(scene);
    let settings = TraceSettings { seed: effort.seed, ..TraceSettings::default() };
    let transports = scene.transports(Mode::Local.transport());
    let mut tracer = Tracer::new(scene, &rays, &transports, effort.size, &settings);
    tracer.pass(effort.samples.max(2));
    let noise = tracer.standard_error().map_or(f64::NAN, |error| rms(&error));
    (tracer.picture(), noise, start.elapsed().as_secs_f64())
}

/// Root of the mean square over pixels and channels.
fn rms(picture: &Picture) -> f64 {
    let sum: f64 = picture.pixels.iter().map(|p| p.as_dvec3().length_squared()).sum();
    (sum / (3.0 * picture.pixels.len() as f64)).sqrt()
}

/// What two pictures, clamped to 0..1, differ by.
fn difference(picture: &Picture, reference: &Picture) -> PictureDifference {
    let [a, b] = [picture, reference].map(shown);
    let mean = mean_difference(&a, &b, None).map_or([f64::NAN; 3], |mean| mean.absolute);
    PictureDifference {
        e_pixel: mean_e_pixel(&a, &b).unwrap_or(f64::NAN),
        mean_colour: (mean.iter().map(|d| d * d).sum::<f64>() / 3.0).sqrt(),
        largest: largest_difference(&a, &b).map_or(f64::NAN, |largest| largest.value),
    }
}

/// A picture clamped to 0..1.
fn shown(picture: &Picture) -> Picture {
    let pixels = picture.pixels.iter().map(|p| p.clamp(Rgb::ZERO, Rgb::ONE)).collect();
    Picture { pixels, ..*picture }
}

/// Magnification of the details.
const ZOOM: usize = 8;
/// Where the middle of the detail is, as shares of the picture's width and height.
const DETAIL: (f64, f64) = (0.41, 0.5);

/// The page: OpenGL, the local mode and path tracing side by side, a detail of each, and signed differences.
pub fn local_page(found: &LocalLight, effort: &LocalEffort, brighter: f32) -> Page {
    let exposure = Exposure { stops: brighter };
    let row = |name: &str, note: &str, cells| PageRow { heading: Heading::new(name, note), cells };
    Page {
        title: "Local illumination is OpenGL's lighting".into(),
        rows: vec![
            row("picture", "", found.pictures(effort.samples, exposure)),
            row("detail", &format!("× {ZOOM}"), found.details(effort.size, exposure)),
            row("difference", "", found.differences(exposure)),
        ],
        caption: format!(
            "After Figure 4 of Banks and Beason 2006: {} triangles below a luminaire of 18 by 18 at height 20. OpenGL \
             has no light with an area and takes five points for it. Under the same lights the pictures are one but \
             for Gouraud's interpolation and the samples of edges; what is left on the lower left is what five \
             points are off by, −(w² + d²)/(90 h²) = −1.8 % below the middle of the light. Linear colours, {}.",
            effort.triangles,
            exposure_words(exposure),
        ),
        panel: effort.size,
        style: Style::Print,
    }
}

impl LocalLight {
    /// What pictures differ by, one line each, and what the path tracer would need.
    pub fn table(&self) -> String {
        let drawn = |drawn: &OpenGlPicture| format!("OpenGL: {}, {}\n", drawn.renderer, drawn.version);
        let mut text = self.opengl.as_ref().map_or(String::new(), drawn);
        let _ = writeln!(text, "{:34} {:>11} {:>11} {:>10} {:>8}", "", "e_pixel", "mean colour", "largest", "seconds");
        let mut line = |what: &str, e_pixel: f64, others: [Option<String>; 3]| {
            let [mean, largest, seconds] = others.map(|value| value.unwrap_or("-".into()));
            let e_pixel = format!("{:.5} %", 100.0 * e_pixel);
            let _ = writeln!(text, "{what:34} {e_pixel:>11} {mean:>11} {largest:>10} {seconds:>8}");
        };
        let mean = |d: &PictureDifference| Some(format!("{:.3}/255", 255.0 * d.mean_colour));
        let largest = |d: &PictureDifference| Some(format!("{:.3} %", 100.0 * d.largest));
        let time = |seconds: f64| Some(format!("{seconds:.2}"));
        for PointLights { kind, difference } in &self.point_lights {
            line(&format!("OpenGL, {kind}"), difference.e_pixel, [None, largest(difference), None]);
        }
        let (area, noise) = (&self.area, &self.tracer.difference);
        let drawn = self.opengl.as_ref().ok().and_then(|drawn| time(drawn.seconds));
        line("five lights for the luminaire", area.e_pixel, [mean(area), largest(area), drawn]);
        line("halflight against a quadrature", self.quadrature, [None, None, time(self.local.seconds.total)]);
        line("path tracing", noise.e_pixel, [mean(noise), largest(noise), time(self.tracer.seconds)]);
        let equal = self.tracer.equal_seconds;
        let _ = writeln!(text, "path tracing would need {equal:.1} s for the standard error of halflight's picture");
        text
    }

    /// A picture of OpenGL, or the reason why there is none.
    fn drawn(&self, picture: &Picture, exposure: Exposure) -> Shown {
        match &self.opengl {
            Ok(_) => Shown::image(picture, exposure),
            Err(why) => Shown::Absent(why.to_string()),
        }
    }

    /// The three pictures, with their seconds.
    fn pictures(&self, samples: u32, exposure: Exposure) -> Vec<Cell> {
        let drawn = self.opengl.as_ref().map_or(String::new(), |drawn| {
            format!("{:.1} s with {samples} samples a pixel, {}", drawn.seconds, short(&drawn.renderer))
        });
        let local = format!(
            "{:.1} s with {samples} camera rays a pixel; {} from a quadrature of it",
            self.local.seconds.total,
            percent(self.quadrature)
        );
        let TracedLight { seconds, equal_seconds, .. } = self.tracer;
        let traced = format!(
            "{seconds:.1} s with {samples} paths a pixel; {:.0} times as long for halflight's noise",
            equal_seconds / seconds
        );
        let image = |picture| Shown::image(picture, exposure);
        vec![
            cell("OpenGL", "five point lights", self.drawn(self.five(), exposure), drawn),
            cell("halflight, local", "alpha 0, tau 1, area light", image(&self.local.picture), local),
            cell("path tracing, local", "area light", image(&self.tracer.picture), traced),
        ]
    }

    /// One part of each picture, magnified.
    fn details(&self, size: Size, exposure: Exposure) -> Vec<Cell> {
        let [local, traced] = [&self.local.picture, &self.tracer.picture]
            .map(|picture| Shown::image(&magnified(picture, size), exposure));
        let drawn = self.drawn(&magnified(self.five(), size), exposure);
        [drawn, local, traced].map(|shown| cell("", "", shown, String::new())).into()
    }

    /// What the pictures differ by.
    fn differences(&self, exposure: Exposure) -> Vec<Cell> {
        let (five, local, ours) = (self.five(), &self.local.picture, &self.five.picture);
        let traced = [&self.tracer.picture, local];
        let noise = minus("path tracing − halflight", "noise", traced, &self.tracer.difference);
        let area = |name: &str| minus(name, "five lights for the area", [five, local], &self.area);
        if self.opengl.is_err() {
            let none = cell("", "", self.drawn(five, exposure), String::new());
            return vec![area("five lights − one luminaire"), none, noise];
        }
        let name = "OpenGL − halflight";
        vec![area(name), minus(name, "the same five lights", [five, ours], &difference(five, ours)), noise]
    }
}

/// The first of two pictures minus the second, and what they differ by.
fn minus(name: &str, note: &str, pictures: [&Picture; 2], difference: &PictureDifference) -> Cell {
    let [a, b] = pictures.map(shown);
    let scale = difference_scale(&a, &b);
    let [Cell { shown, .. }, _] = difference_cells(&a, &b, scale);
    let below = format!(
        "blue −{0}, red +{0}. Mean e_pixel {1}, mean colour {2:.2}/255, largest {3}",
        percent(f64::from(scale)),
        percent(difference.e_pixel),
        255.0 * difference.mean_colour,
        percent(difference.largest),
    );
    cell(name, note, shown, below)
}

fn cell(name: &str, note: &str, shown: Shown, below: String) -> Cell {
    Cell { above: Heading::new(name, note), shown, below }
}

/// A share in percent, to two digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    let digits = (1.0 - percent.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{percent:.digits$} %")
}

/// A renderer's name without what stands in brackets.
fn short(renderer: &str) -> &str {
    renderer.split(" (").next().unwrap_or(renderer)
}

/// The detail of a picture, every pixel as a square, of the size of the whole.
fn magnified(picture: &Picture, Size { width, height }: Size) -> Picture {
    let (wide, high) = (width.div_ceil(ZOOM), height.div_ceil(ZOOM));
    let first =
        |share: f64, all: usize, part: usize| ((share * all as f64) as usize).saturating_sub(part / 2).min(all - part);
    let (left, top) = (first(DETAIL.0, width, wide), first(DETAIL.1, height, high));
    Picture::from_fn(width, height, |x, y| picture.get(left + x / ZOOM, top + y / ZOOM).unwrap_or(Rgb::ZERO))
}

/// Width over height.
pub const RATIOS: [f64; 10] = [0.1, 0.15, 0.2, 0.25, 0.35, 0.5, 0.7, 0.9, 1.2, 1.6];
/// Width and height of pictures of the middle of the floor, and of the whole scene.
const MIDDLE: Size = Size { width: 4, height: 4 };
const WHOLE: Size = Size { width: 96, height: 96 };
/// Triangles of the whole scene, and camera rays a pixel.
const SWEPT_TRIANGLES: usize = 20_000;
const SWEPT_SAMPLES: u32 = 16;

/// One width.
#[derive(Clone, Copy, Debug)]
pub struct Swept {
    /// Width over height, both sides of the luminaire being equal.
    pub ratio: f64,
    /// Five lights less the luminaire in the middle of the floor, whose radiance is 1 under the luminaire.
    pub e_pixel: f64,
    /// The closed form: `-(w² + d²)/(90 h²)`.
    pub closed_form: f64,
    /// Mean e_pixel over a picture of the whole scene, both by the local mode.
    pub whole: f64,
}

impl Display for Swept {
    fn fmt(&self, f: &mut Formatter) -> std::fmt::Result {
        let [error, closed_form] = [self.e_pixel, self.closed_form].map(|share| 100.0 * share);
        write!(f, "w/h {:4.2}: {error:9.6} %, closed form {closed_form:9.6} %", self.ratio)
    }
}

/// Some widths: the five lights by OpenGL where there is one, else by the local mode.
pub fn local_sweep(ratios: &[f64], seed: u32) -> Vec<Swept> {
    let one = |&ratio: &f64| {
        let of = |lit| TwoSpheres { triangles: SWEPT_TRIANGLES, ratio, lit, highlights: false };
        let (five, area) = (of(Lit::Five(FiveLights::Warn)), of(Lit::Area));
        let effort = |size| LocalEffort { size, triangles: SWEPT_TRIANGLES, samples: SWEPT_SAMPLES, seed };
        let own = |scene| solve(&scene, &effort(MIDDLE), SWEPT_SAMPLES).picture;
        let scene = five.middle();
        let lit = draw(&scene, MIDDLE, SWEPT_SAMPLES).map_or_else(|_| own(scene), |found| found.picture);
        let mean = |picture: &Picture| {
            let sum: f64 = shown(picture).pixels.iter().map(|p| f64::from(p.element_sum())).sum();
            sum / (3.0 * picture.pixels.len() as f64)
        };
        let [five, area] = [five, area].map(|s| (s, solve(&s.scene(), &effort(WHOLE), SWEPT_SAMPLES).picture));
        Swept {
            ratio,
            e_pixel: mean(&lit) - mean(&own(area.0.middle())),
            closed_form: -2.0 * ratio * ratio / 90.0,
            whole: difference(&five.1, &area.1).e_pixel,
        }
    };
    ratios.iter().map(one).collect()
}

/// The widths as a chart.
pub fn sweep_chart(swept: &[Swept], five: &str) -> Chart {
    let points = |value: fn(&Swept) -> f64| swept.iter().map(|s| (s.ratio, value(s).abs())).collect();
    Chart {
        title: "Five lights for a luminaire".into(),
        caption: format!(
            "Two spheres on a floor below a square luminaire of width w at height h, and below five lights that stand \
             for it as in OpenGL, lit by {five}. The closed form holds below the middle of the luminaire, to first \
             order in w²/h². At w/h = 0.9, the paper's figure, it is 1.8 % there and the mean over the picture 0.4 %."
        ),
        x: Axis::log("width of the luminaire over its height, w/h"),
        y: Axis::log("difference, share of full scale"),
        series: vec![
            Series::bound("(w² + d²)/(90 h²)", 0, points(|s| s.closed_form)),
            Series::measured("middle of the floor", 0, points(|s| s.e_pixel)),
            Series::measured("mean e_pixel of the picture", 1, points(|s| s.whole)),
        ],
        size: Size { width: 900, height: 560 },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With the feature `opengl`, on a machine that has one, real OpenGL is held to the local mode.
    #[test]
    fn the_local_mode_is_opengls_lighting_and_five_lights_are_not_the_luminaire() {
        let effort = LocalEffort { size: (96, 96).into(), triangles: 100_000, samples: 64, seed: 0 };
        let found = local_light(&effort);
        if let Err(why) = &found.opengl {
            eprintln!("without OpenGL: {why}");
        }
        assert_eq!(found.point_lights.len(), if found.opengl.is_ok() { 8 } else { 0 });
        for PointLights { kind, difference } in &found.point_lights {
            // Triangles are sqrt 5 times as large as in the figure: Gouraud's error is five times as large.
            assert!(difference.e_pixel < 1e-3, "{kind}: {difference:?}");
        }
        // The paper's 0.4 %.
        assert!((found.area.e_pixel - 0.0039).abs() < 0.0003, "{:?}", found.area);
        assert!((255.0 * found.area.mean_colour - 0.7).abs() < 0.1, "{:?}", found.area);
        assert!(found.quadrature < 1e-5, "{}", found.quadrature);
        assert!(found.tracer.difference.e_pixel < 0.05, "{:?}", found.tracer.difference);
        let page = local_page(&found, &effort, 0.0);
        assert_eq!(page.rows.iter().map(|row| row.cells.len()).collect::<Vec<_>>(), [3; 3]);
    }

    #[test]
    fn five_lights_are_off_by_the_closed_form() {
        for s in local_sweep(&RATIOS[1..4], 0) {
            assert!((s.e_pixel / s.closed_form - 1.0).abs() < 0.05, "{s}");
        }
    }
}
