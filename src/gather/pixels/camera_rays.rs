//! Camera rays of the gather pass: what a pixel sees, and from each point seen the rays to luminaires.
//!
//! Every camera ray carries its own points on the luminaires, drawn together from one Sobol sequence, so that a
//! penumbra is sampled over pixel and emitter at once. Camera rays come in two halves with independent scramblings,
//! whose difference estimates the standard error.
//!
//! Not handled: indirect light, which comes from the irradiance cache.

use glam::{DVec2, DVec3, Vec2};

use crate::direct::{Choice, Highlights, LightSum, Scratch as Memory};
use crate::gather::pixels::pixel::Pixel;
use crate::gather::pixels::pixel_cell::{cell_corners, cells_to_a_side};
use crate::gather::pixels::pixel_layer::SurfaceKey;
use crate::gather::pixels::pixel_light::of_emitter;
use crate::gather::pixels::pixel_texture::{PixelCells, PixelTexture, SeenPoint, surfaces};
use crate::light::Rgb;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::{Hit, Side};
use crate::reading::patch_light::Fields;
use crate::reading::view::View;
use crate::surfaces::SurfacePoint;

/// Keeps the points of highlights apart from those of diffuse light.
const HIGHLIGHTS: u32 = 0x676c_6f73;

/// How camera rays are drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraSampling {
    /// Camera rays of a half whose points are tabled.
    pub tabled: u32,
    /// Visibility rays of each camera ray for each point that its cuts draw.
    pub visibility: u32,
    /// Chooses the scrambling of the points.
    pub seed: u32,
}

/// Casts the camera rays of all pixels.
pub(crate) struct CameraRays<'a> {
    pub view: &'a View<'a>,
    fields: &'a Fields,
    sobol: Sobol,
    /// Visibility rays of each camera ray for each point that its cuts draw.
    visibility: u32,
    seed: u32,
    /// No hemisphere ray finds any light.
    dark: bool,
    /// Some surface has a texture.
    textured: bool,
    /// Where some material shows any.
    highlights: Option<Highlights<'a>>,
}

/// Memory that one thread uses again for each pixel.
#[derive(Default)]
pub(crate) struct PixelScratch {
    memory: Memory,
    /// Direct light and highlights.
    sum: LightSum,
    /// Direct light at one point.
    own: LightSum,
    /// The points seen.
    seen: Vec<SeenPoint>,
}

/// One camera ray of a pixel.
#[derive(Clone, Copy)]
struct CameraRay {
    half: usize,
    /// Its number within the half.
    index: u32,
    /// Scrambling of the pixel's half.
    seed: u32,
    /// Cells to a side of the pixel, of which each ray stands for the one that it passes through.
    cells: u32,
}

impl<'a> CameraRays<'a> {
    /// Camera rays of a view, for pixels that reflect some fields.
    pub(crate) fn new(view: &'a View, fields: &'a Fields, sampling: &CameraSampling) -> CameraRays<'a> {
        let visibility = sampling.visibility.max(1);
        let sobol = Sobol::new((sampling.tabled * view.lights.points(visibility)) as usize, 4);
        let (seed, dark, is_map) = (sampling.seed, fields.is_dark(), view.atlas.is_some());
        let highlights = Highlights::new(view.lights).filter(|_| !is_map);
        let textured = !is_map && view.scene.is_textured();
        CameraRays { view, fields, sobol, visibility, seed, dark, textured, highlights }
    }

    /// Memory for one thread.
    pub(crate) fn scratch(&self) -> PixelScratch {
        PixelScratch::default()
    }

    /// Casts camera rays until each half has `count`.
    pub(crate) fn extend(&self, k: usize, pixel: &mut Pixel, count: u32, scratch: &mut PixelScratch) {
        let more = count - pixel.count;
        for half in 0..2 {
            scratch.sum.clear();
            let mut seen = std::mem::take(&mut scratch.seen);
            seen.clear();
            let first = self.camera_ray(k, half, 0, cells_to_a_side(more));
            let ray = |index: u32| CameraRay { index, ..first };
            seen.extend((pixel.count..count).flat_map(|index| self.seen(k, ray(index))));
            let eye = self.view.scene.camera.position;
            let met = seen.chunk_by(|a, b| a.index == b.index).count() as u32;
            let beyond = (met < more).then_some(f32::INFINITY);
            let distances = seen.iter().map(|point| point.position.distance(eye)).chain(beyond);
            distances.for_each(|distance| pixel.met.extend_reach(distance));
            if self.textured {
                self.find_means(k, &mut pixel.texture, more, &mut seen);
            }
            for points in seen.chunk_by(|a, b| a.index == b.index) {
                let shade = |point: &SeenPoint| self.shade(point, ray(point.index), pixel, scratch);
                let emitting = points.iter().map(shade).filter(|emits| *emits).count();
                pixel.met.emitting += u32::from(emitting > 0);
            }
            scratch.seen = seen;
            pixel.light.lit[half] += scratch.sum.total();
            if self.view.lights.emitters().are_apart() {
                scratch.sum.by_emitter(|e, light| of_emitter(&mut pixel.light.emitters, e)[half] += light);
            }
        }
        pixel.met.rays += std::mem::take(&mut scratch.memory.cast) + 2 * u64::from(more);
        pixel.count = count;
    }

    /// Gives the points that so many rays of pixel k see the mean reflectance over the pixel, or, away from edges, over
    /// their cells.
    fn find_means(&self, k: usize, texture: &mut PixelTexture, rays: u32, seen: &mut [SeenPoint]) {
        let all = seen.len() as u32 == rays && seen.iter().all(|point| point.share == 1.0);
        if let Some(mean) = texture.see(self.view, k, seen, all) {
            seen.iter_mut().for_each(|point| point.mean = Some(mean));
            return;
        }
        let Some(mut cells) = PixelCells::new(rays) else { return };
        let surfaces = surfaces(self.view, seen);
        seen.iter().zip(surfaces).for_each(|(point, surface)| cells.see(point.at, surface));
        for point in seen {
            let mean = || cells.mean(self.view, k, point.hit.face, point.at);
            point.mean = cells.is_within_surface(point.at).then(mean).flatten();
        }
    }

    /// The surfaces that a camera ray of one half of pixel k sees, and the points.
    pub(crate) fn surfaces_seen(
        &self,
        k: usize,
        half: usize,
        index: u32,
    ) -> impl Iterator<Item = (SurfaceKey, SurfacePoint)> {
        let view = self.view;
        let one = |SeenPoint { hit, position, key, .. }: SeenPoint| {
            view.patches.at(hit.face, hit.side, position)?;
            Some((key, view.surface_point(hit.face, hit.side, position)))
        };
        self.seen(k, self.camera_ray(k, half, index, 1)).filter_map(one)
    }

    /// The surface that a face belongs to.
    pub(crate) fn key(&self, face: u32, side: Side) -> SurfaceKey {
        let view = self.view;
        SurfaceKey { plane: view.rays.plane(face), side, material: view.scene.faces[face as usize].material }
    }

    fn camera_ray(&self, k: usize, half: usize, index: u32, cells: u32) -> CameraRay {
        CameraRay { half, index, seed: hash(k as u32, Purpose::CameraRays(half).seed(self.seed)), cells }
    }

    /// The light of a face at a point of the picture, in pixels, if the face is visible there.
    pub(crate) fn light_of_face(&self, face: u32, place: DVec2, scratch: &mut PixelScratch) -> Option<DVec3> {
        let pixel = place.as_uvec2();
        let k = pixel.y as usize * self.view.width + pixel.x as usize;
        let ray = self.camera_ray(k, 0, 0, 1);
        let mut seen = self.seen_at(k, ray, (place - pixel.as_dvec2()).as_vec2());
        let seen = seen.find(|seen| seen.hit.face == face)?;
        let mut own = Pixel::default();
        scratch.sum.clear();
        self.shade(&seen, ray, &mut own, scratch);
        (own.met.reflecting > 0).then(|| scratch.sum.total() + own.light.ambient[0])
    }

    /// What a camera ray sees.
    fn seen(&self, k: usize, ray: CameraRay) -> impl Iterator<Item = SeenPoint> {
        self.seen_at(k, ray, Vec2::from([0, 1].map(|d| self.sobol.point(ray.index, d, ray.seed))))
    }

    /// The surfaces that are seen through a place of pixel k, and where, put exactly into the faces' planes.
    fn seen_at(
        &self,
        k: usize,
        CameraRay { index, cells, .. }: CameraRay,
        at: Vec2,
    ) -> impl Iterator<Item = SeenPoint> {
        let view = self.view;
        let ray = view.camera_ray(k, at.x, at.y);
        let one = move |(hit, share): (Hit, f32)| {
            let key = self.key(hit.face, hit.side);
            let position = view.met_at(&ray, &hit);
            let rho = view.shown_rho(hit.face, position);
            SeenPoint { index, at: at.as_dvec2(), hit, position, key, rho, mean: None, share }
        };
        let cell = || cell_corners(at, cells).map(|corner| view.camera_ray(k, corner.x, corner.y));
        view.rays.seen(&ray, cell).into_iter().filter(move |(hit, _)| view.is_looked_at(&ray, hit)).map(one)
    }

    /// Calls `each` with the faces that emit to a place of pixel k, and their light; each ray stands for one of
    /// `cells`² of the pixel.
    pub(crate) fn emission_at(&self, k: usize, at: Vec2, cells: u32, mut each: impl FnMut(u32, DVec3)) {
        let ray = CameraRay { cells, ..self.camera_ray(k, 0, 0, 1) };
        for SeenPoint { hit, position, share, .. } in self.seen_at(k, ray, at) {
            let emitted = self.view.shown_emission(hit.face, position);
            if emitted != Rgb::ZERO && self.view.patches.at(hit.face, hit.side, position).is_some() {
                each(hit.face, f64::from(share) * emitted.as_dvec3());
            }
        }
    }

    /// The emitter that a face is, where they are kept apart.
    pub(crate) fn emitter(&self, face: u32) -> Option<usize> {
        let emitters = self.view.lights.emitters();
        emitters.are_apart().then(|| emitters.of_face(self.view.scene, face))
    }

    /// Whether a material shows highlights.
    pub(crate) fn shows_highlights(&self, material: u32) -> bool {
        self.highlights.is_some() && self.view.scene.materials[material as usize].gloss.is_some()
    }

    /// Chooses the scrambling of the points.
    pub(crate) fn seed(&self) -> u32 {
        self.seed
    }

    /// Adds the light emitted and reflected at a point that a camera ray sees. Returns whether it emits any.
    fn shade(&self, seen: &SeenPoint, ray: CameraRay, pixel: &mut Pixel, scratch: &mut PixelScratch) -> bool {
        let view = self.view;
        let SeenPoint { hit, position, key, share, mean, .. } = *seen;
        let (share, rho) = (f64::from(share), seen.rho.as_dvec3());
        let typical = mean.unwrap_or(rho);
        let Some(patch) = view.patches.at(hit.face, hit.side, position) else {
            // A second side would change nothing where none reflects.
            pixel.met.backs += u32::from(view.scene.material(hit.face).rho != Rgb::ZERO);
            return false;
        };
        let emitted = view.shown_emission(hit.face, position).as_dvec3();
        let emits = emitted != DVec3::ZERO;
        pixel.light.emitted[ray.half] += share * emitted;
        if let Some(emitter) = self.emitter(hit.face).filter(|_| emits) {
            of_emitter(&mut pixel.light.glows, emitter)[ray.half] += share * emitted;
        }
        let (material, of_patch) =
            (view.scene.material(hit.face), view.patches.reflectance(view.scene, patch as usize));
        // Where there is nothing of a masked surface all over a patch its reflectance is 0, but a cell that reaches out
        // of a hole counts by its share of what is there.
        let is_dark = material.rho == Rgb::ZERO || (of_patch == Rgb::ZERO && typical == DVec3::ZERO);
        if is_dark && material.gloss.is_none() {
            return emits;
        }
        pixel.met.reflecting += 1;
        let receiver = view.surface_point(hit.face, hit.side, position);
        if let (Some(highlights), Some(gloss)) = (&self.highlights, material.gloss) {
            let seed = hash(HIGHLIGHTS, ray.seed);
            let draw = |d: usize, seed: u32| f64::from(self.sobol.point(ray.index, d, seed));
            let draws = [seed, !seed].map(|seed| DVec2::new(draw(2, seed), draw(3, seed)));
            let PixelScratch { memory, sum, .. } = &mut *scratch;
            highlights.gather(&receiver, gloss, draws, memory, |emitter, light| sum.add(emitter, share * light));
        }
        if is_dark {
            return emits;
        }
        // The first tree has the camera ray's scrambling: joint points over pixel and emitter.
        let point = |Choice { tree, k, of }: Choice| {
            let own = if tree == 0 { ray.seed } else { hash(tree, ray.seed) };
            Vec2::from([2, 3].map(|d| self.sobol.point(ray.index * of + k, d, own)))
        };
        let PixelScratch { memory, sum, own, .. } = scratch;
        let cuts = view.lights.cuts(patch);
        own.clear();
        view.lights.add(own, (&receiver, cuts, DVec3::splat(share)), self.visibility, point, memory);
        view.lights.add_strata(own, (&receiver, DVec3::splat(share)), self.visibility, point, memory);
        sum.join_weighted(rho, own);
        if let Some(mean) = mean {
            pixel.light.textured(key).add(ray.half, own, mean - rho);
        }
        let layer = pixel.layer(key, receiver);
        layer.add(ray.half, &receiver, share * typical, typical * own.total());
        if !self.dark {
            layer.keep(ray.half, receiver);
            pixel.light.ambient[ray.half] += share * typical * self.fields.ambient(patch).as_dvec3();
        }
        emits
    }
}
