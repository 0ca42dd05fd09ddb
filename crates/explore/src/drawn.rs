//! The page's picture, drawn by the program: what a pixel sees by a ray, and the light there by the sums of
//! [`crate::sums`], in double precision and from light before it is rounded for the page.
//!
//! It is the oracle of the page's own test, and tells how far the page is from a picture of [`Solver::render`].
//!
//! [`Solver::render`]: halflight::Solver::render

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::charts::{Charts, Taps};
use crate::light::Layers;
use crate::sums::Mixture;
use halflight::pictures::{Picture, Size, encode_srgb};
use halflight::rays::{Ray, Rays};
use halflight::scene::Scene;

/// What a part of a pixel sees.
struct Seen {
    pixel: usize,
    share: f64,
    rho: DVec3,
    /// Emission, and the lamp it belongs to.
    emission: (DVec3, usize),
    taps: Option<[Taps; 2]>,
    face: u32,
    /// The chart there.
    chart: Option<usize>,
    /// How long a pixel is there.
    length: f32,
}

/// What a part of a pixel is off by.
pub(super) struct SeenError {
    /// Squared, as a share of the squares of the picture.
    pub error: f64,
    pub face: u32,
    pub chart: usize,
    /// How long a pixel is there.
    pub length: f32,
}

/// What all pixels of a view see.
pub(super) struct View {
    /// How far before the eye the nearest surface lies along the view, unit coordinates; infinite where there is none.
    pub nearest: f32,
    size: Size,
    seen: Vec<Seen>,
}

impl View {
    /// Casts the camera's rays, `step` by `step` evenly over each pixel.
    pub fn new(
        (scene, rays): (&Scene, &Rays),
        charts: &Charts,
        lamp_of: &dyn Fn(u32) -> usize,
        size: Size,
        step: usize,
    ) -> View {
        let Size { width, height } = size;
        let aspect = width as f32 / height as f32;
        let (mut seen, mut nearest) = (Vec::new(), f32::INFINITY);
        for k in 0..width * height * step * step {
            let (pixel, part) = (k / (step * step), k % (step * step));
            let through = |u: f32, v: f32| {
                let offset = |k: usize, within: f32| (k as f32 + within) / step as f32;
                let x = ((pixel % width) as f32 + offset(part % step, u)) / width as f32;
                let y = ((pixel / width) as f32 + offset(part / step, v)) / height as f32;
                let (origin, direction) = scene.camera.ray(x, y, aspect);
                Ray { origin, direction, source: None }
            };
            let ray = through(0.5, 0.5);
            let cell = || [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| through(u, v));
            for (hit, share) in rays.seen(&ray, cell) {
                let at = ray.at(hit.t);
                if !scene.is_sky(hit.face) {
                    nearest = nearest.min(hit.t * ray.direction.dot(scene.camera.forward));
                }
                let taps = if scene.is_sky(hit.face) { None } else { charts.taps(hit.face, hit.side, at) };
                let length = hit.t * scene.camera.vertical_fov.to_radians() / height as f32;
                let is_lit = scene.is_sky(hit.face) || taps.is_some();
                let emission = if is_lit { scene.emitted_at(hit.face, at).visible.as_dvec3() } else { DVec3::ZERO };
                seen.push(Seen {
                    pixel,
                    share: f64::from(share) / (step * step) as f64,
                    rho: scene.rho_at(hit.face, at).as_dvec3(),
                    emission: (emission, lamp_of(hit.face)),
                    taps,
                    face: hit.face,
                    chart: if scene.is_sky(hit.face) { None } else { charts.of(hit.face, hit.side) },
                    length,
                });
            }
        }
        View { nearest, size, seen }
    }

    /// Pixels that see no emission, nor do those around them, as points may miss a luminaire's edge: 1 there.
    pub fn mask(&self) -> Picture {
        let Size { width, height } = self.size;
        let mut mask = Picture::filled(width, height, Vec3::ONE);
        for seen in self.seen.iter().filter(|seen| seen.emission.0 != DVec3::ZERO) {
            let (x, y) = (seen.pixel % width, seen.pixel / width);
            for row in y.saturating_sub(1)..(y + 2).min(height) {
                mask.pixels[row * width + x.saturating_sub(1)..row * width + (x + 2).min(width)].fill(Vec3::ZERO);
            }
        }
        mask
    }

    /// What each part of the pixels is off by that count in a mask, where a picture of this view is and a better one.
    pub fn errors(&self, [own, better]: [&Picture; 2], mask: &Picture) -> Vec<SeenError> {
        let counted = |k: usize| f64::from(mask.pixels[k].x);
        let square = |v: Vec3| v.as_dvec3().length_squared();
        let all: f64 = (0..mask.pixels.len()).map(|k| counted(k) * square(better.pixels[k])).sum();
        let one = |seen: &Seen| {
            let off = counted(seen.pixel) * square(own.pixels[seen.pixel] - better.pixels[seen.pixel]);
            let error = if all > 0.0 { seen.share * off / all } else { 0.0 };
            Some(SeenError { error, face: seen.face, chart: seen.chart?, length: seen.length })
        };
        self.seen.iter().filter_map(one).collect()
    }

    /// Linear radiance of a mixture.
    pub fn picture(&self, layers: &Layers, mixture: &Mixture) -> Picture {
        let one = |seen: &Seen| {
            let (emission, lamp) = seen.emission;
            let lit = seen.taps.as_ref().map_or(DVec3::ZERO, |taps| layers.incident(taps, mixture));
            seen.share * (mixture.emission[lamp] * emission + mixture.rho * seen.rho * lit)
        };
        let each: Vec<DVec3> = self.seen.par_iter().map(one).collect();
        let mut pixels = vec![DVec3::ZERO; self.size.width * self.size.height];
        self.seen.iter().zip(each).for_each(|(seen, light)| pixels[seen.pixel] += light);
        let pixels = pixels.into_iter().map(|light| light.as_vec3()).collect();
        Picture { width: self.size.width, height: self.size.height, pixels }
    }
}

/// The mean of the shown sRGB values, 0..=1.
pub(super) fn shown_mean(picture: &Picture, stops: f64) -> [f64; 3] {
    let shown = |value: f32| f64::from(encode_srgb((value * stops.exp2() as f32).clamp(0.0, 1.0)));
    let sum: DVec3 = picture.pixels.iter().map(|p| DVec3::from(p.to_array().map(shown))).sum();
    (sum / picture.pixels.len().max(1) as f64).to_array()
}
