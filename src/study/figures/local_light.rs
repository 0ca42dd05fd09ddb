//! Figure 4 in numbers: local illumination by this solver, by real OpenGL and by path tracing, on two spheres.
//!
//! ```text
//! point lights   the same lights in both: OpenGL against the local mode
//! area           OpenGL's five lights against the luminaire that they stand for, in the local mode
//! quadrature     the local mode's luminaire against so many lights at Gauss and Legendre's points, along the same rays
//! tracer         path tracing of the luminaire against the local mode
//! ```
//!
//! All as the mean of e_pixel ([`mean_e_pixel`]). Where there is no OpenGL its five lights are lit by the local mode,
//! which differs by what the point lights tell where there is one. Not handled: how the figure looks.

use std::time::Instant;

use crate::gather::{GatherPass, GatherSampling};
use crate::light::{Mode, Rgb};
use crate::pictures::{Picture, Size, largest_difference, mean_difference, mean_e_pixel};
use crate::rays::Rays;
use crate::reference::opengl::{NoOpenGl, OpenGlPicture, render as draw};
use crate::reference::{TraceSettings, Tracer};
use crate::render::prepared::Spent;
use crate::render::prepared::render_fixed;
use crate::render::{Fineness, Rendered, Watch, assemble, prepare};
use crate::scene::Scene;
use crate::study::figures::two_spheres::{FiveLights, Lit, TwoSpheres};

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
#[derive(Clone, Debug, serde::Serialize)]
pub struct PointLights {
    /// The lights, and whether there are highlights.
    #[serde(rename = "type")]
    pub kind: String,
    /// Mean e_pixel.
    pub e_pixel: f64,
    /// The largest difference of a channel.
    pub largest: f64,
}

/// What two pictures differ by.
#[derive(Clone, Copy, Debug)]
pub struct Apart {
    /// Mean e_pixel.
    pub e_pixel: f64,
    /// The length of the difference of the mean colours, over that from black to white.
    pub mean_colour: f64,
    /// The largest difference of a channel.
    pub largest: f64,
}

/// All that the figure shows.
pub struct LocalLight {
    /// OpenGL under five lights, or why it is not there.
    pub opengl: Result<OpenGlPicture, NoOpenGl>,
    /// The local mode under the same five lights.
    pub five: Rendered,
    /// The local mode under the luminaire.
    pub local: Rendered,
    /// The path tracer's picture of that.
    pub traced: Picture,
    /// Its seconds, and those it would take to the local mode's standard error, as N^-1/2.
    pub traced_seconds: [f64; 2],
    /// By kind of light, without and with highlights; none without OpenGL.
    pub point_lights: Vec<PointLights>,
    /// Five lights against the luminaire.
    pub area: Apart,
    /// The local mode against the quadrature.
    pub quadrature: f64,
    /// Path tracing against the local mode.
    pub tracer: Apart,
}

/// Makes all pictures and compares them.
pub fn local_light(effort: &LocalEffort, watch: &dyn Watch) -> LocalLight {
    let of = |lit| TwoSpheres { triangles: effort.triangles, ..TwoSpheres::paper(lit) };
    let scene = of(Lit::Area).scene();
    let local = solve(&scene, effort, effort.samples, watch);
    let (traced, noise, seconds) = trace(&scene, effort);
    let five_lights = of(Lit::Five(FiveLights::Warn)).scene();
    let five = solve(&five_lights, effort, effort.samples, watch);
    let opengl = draw(&five_lights, effort.size, effort.samples);
    // The same camera rays meet other lights: few are enough.
    let [closed, summed] = [Lit::Area, Lit::Quadrature(POINTS)].map(|lit| solve(&of(lit).scene(), effort, 4, watch));
    let own = rms(&local.standard_error);
    LocalLight {
        area: apart(opengl.as_ref().map_or(&five.picture, |found| &found.picture), &local.picture),
        quadrature: mean_e_pixel(&closed.picture, &summed.picture).unwrap_or(f64::NAN),
        tracer: apart(&traced, &local.picture),
        traced_seconds: [seconds, seconds * (noise / own).powi(2)],
        point_lights: if opengl.is_ok() { point_lights(effort, watch) } else { Vec::new() },
        opengl,
        five,
        local,
        traced,
    }
}

/// Every kind of five lights, without and with highlights, by OpenGL and by the local mode.
fn point_lights(effort: &LocalEffort, watch: &dyn Watch) -> Vec<PointLights> {
    let mut found = Vec::new();
    for kind in FiveLights::ALL {
        for highlights in [false, true] {
            let lit = Lit::Five(kind);
            let scene = TwoSpheres { triangles: effort.triangles, highlights, ..TwoSpheres::paper(lit) }.scene();
            if let Ok(drawn) = draw(&scene, effort.size, effort.samples) {
                let own = solve(&scene, effort, effort.samples, watch);
                let apart = apart(&drawn.picture, &own.picture);
                let kind = if highlights { format!("{} with highlights", kind.name()) } else { kind.name().into() };
                found.push(PointLights { kind, e_pixel: apart.e_pixel, largest: apart.largest });
            }
        }
    }
    found
}

/// The local mode's picture, with so many camera rays a pixel.
pub(crate) fn solve(scene: &Scene, effort: &LocalEffort, samples: u32, watch: &dyn Watch) -> Rendered {
    let p = prepare(scene.clone(), FINENESS.patches);
    let start = Instant::now();
    let (modes, rays) = assemble(&p, &[Mode::Local.transport()], &FINENESS.sampling(effort.seed), watch);
    let mut spent = Spent { rays, ..Spent::default() };
    spent.seconds.form_factors = start.elapsed().as_secs_f64();
    let sampling = GatherSampling { camera: samples.div_ceil(2), luminaire: 1, hemisphere: 1, seed: effort.seed };
    let found = render_fixed(&p, &modes[0], &GatherPass::new(effort.size, &sampling), spent, watch);
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
pub(crate) fn apart(picture: &Picture, reference: &Picture) -> Apart {
    let [a, b] = [picture, reference].map(shown);
    let mean = mean_difference(&a, &b, None).map_or([f64::NAN; 3], |mean| mean.absolute);
    Apart {
        e_pixel: mean_e_pixel(&a, &b).unwrap_or(f64::NAN),
        mean_colour: (mean.iter().map(|d| d * d).sum::<f64>() / 3.0).sqrt(),
        largest: largest_difference(&a, &b).map_or(f64::NAN, |largest| largest.value),
    }
}

/// A picture clamped to 0..1.
pub(crate) fn shown(picture: &Picture) -> Picture {
    let pixels = picture.pixels.iter().map(|p| p.clamp(Rgb::ZERO, Rgb::ONE)).collect();
    Picture { pixels, ..*picture }
}
