//! Final gathering: irradiance over pi at one place by hemisphere rays that read the solution, and the inverse distance
//! to the surroundings.
//!
//! Rays have Sobol points and follow a guiding density where there is one.
//!
//! Not handled: where to gather ([`crate::gather::records::irradiance_cache`]).

use std::ops::Range;

use glam::DVec3;

use crate::gather::records::guiding::Guiding;
use crate::light::Rgb;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::{FAN, Fan, Hit, Ray};
use crate::reading::patch_light::Fields;
use crate::reading::reflection::{Continuation, Memory, RaySample, SurfaceHit, Walker};
use crate::reading::view::View;
use crate::surfaces::SurfacePoint;

/// Rays of a place whose numbers are tabled: few places cast more.
const TABLED: usize = 1 << 13;

/// Hemisphere rays that are cast together.
pub(crate) struct HemisphereRays<'a> {
    /// The points that they start from.
    pub from: &'a [SurfacePoint],
    /// Their numbers in the sequence.
    pub indices: Range<u32>,
    /// Chooses the scrambling of the sequence.
    pub seed: u32,
    /// The density that they follow and that they are recorded in.
    pub guiding: Guiding<'a>,
}

/// Weight of the light that a ray reads: `weight * light + offset`, the offset for the first field only.
#[derive(Clone, Copy)]
struct Counted {
    weight: f32,
    offset: Rgb,
}

/// Reads fields along cosine-distributed rays.
pub(crate) struct FinalGather<'a> {
    view: &'a View<'a>,
    pub fields: &'a Fields,
    sobol: Sobol,
    continuation: Continuation<'a>,
}

impl<'a> FinalGather<'a> {
    /// Final gathering of the light that a view meets.
    pub(crate) fn new(view: &'a View, fields: &'a Fields) -> FinalGather<'a> {
        let continuation = Continuation { walker: Walker::new(view), fields };
        FinalGather { view, fields, sobol: Sobol::new(TABLED, 3), continuation }
    }

    /// The length of the brightest light of the fields that make the picture, over the middles of patches.
    pub(crate) fn brightest(&self) -> f64 {
        let patches = self.view.patches;
        let light = |i: usize| -> Rgb {
            let at = patches.point(i, 0.5, 0.5).position;
            let own = &self.fields.of_patch(i as u32)[..self.fields.picture_fields()];
            own.iter().map(|l| l.at(at)).sum()
        };
        let lengths = (0..patches.len()).map(|i| f64::from(light(i).length()));
        lengths.fold(0.0, f64::max)
    }

    /// Number of fields read.
    pub(crate) fn count(&self) -> usize {
        self.fields.count()
    }

    /// Adds what rays read in every field to `incident`; returns the weighted sum of the rays' inverse lengths.
    pub(crate) fn read(&self, rays: &HemisphereRays, memory: &mut Memory, incident: &mut [DVec3]) -> f64 {
        if !self.fields.is_read_at_once() {
            return self.cast(rays, |ray, k, counted| {
                let sample = self.continuation.read(ray, hash(k, rays.seed), memory);
                incident[0] += counted.offset.as_dvec3();
                for (sum, read) in incident.iter_mut().zip(&memory.read) {
                    *sum += f64::from(counted.weight) * *read;
                }
                sample
            });
        }
        self.cast(rays, |ray, _, counted| {
            let mut light = Rgb::ZERO;
            incident[0] += counted.offset.as_dvec3();
            let nearness = self.meet(ray, &mut memory.hits, |at| {
                let fields = self.fields.of_patch(at.patch).iter().enumerate();
                let through = at.through * at.over_patch(self.view.patches, at.patch);
                for ((f, l), sum) in fields.zip(incident.iter_mut()) {
                    let found = through * l.at(at.position);
                    *sum += (counted.weight * found).as_dvec3();
                    if f == 0 {
                        light += found;
                    }
                }
            });
            RaySample { nearness, light: light.as_dvec3() }
        })
    }

    /// Calls `each(ray, index, counted)` for the rays as their guiding density warps them. Returns the weighted sum of
    /// the rays' inverse lengths.
    #[inline(always)]
    fn cast(&self, rays: &HemisphereRays, mut each: impl FnMut(&Ray, u32, Counted) -> RaySample) -> f64 {
        let mut nearness = 0.0;
        let mut first = rays.indices.start;
        while first < rays.indices.end {
            let (fan, warped) = Fan::warped(&self.sobol, first, rays.seed, |u, v| rays.guiding.warp(u, v));
            for k in 0..FAN.min((rays.indices.end - first) as usize) {
                // A dimension of its own chooses the point: every other Sobol point lies in the same half.
                let from = match rays.from {
                    [one] => one,
                    from => &from[(f64::from(fan.third(k)) * from.len() as f64) as usize],
                };
                let direction = fan.direction(k, from.normal);
                let ray = Ray { origin: from.position, direction, source: from.source() };
                let counted = Counted { weight: warped.weights[k], offset: warped.offsets[k] };
                let sample = each(&ray, first + k as u32, counted);
                nearness += f64::from(warped.weights[k]) * sample.nearness;
                rays.guiding.record(warped.cells[k], sample.light);
            }
            first += FAN as u32;
        }
        nearness
    }

    /// Calls `meet` for all that light comes from along a ray; returns the inverse distance to the first face.
    #[inline(always)]
    fn meet(&self, ray: &Ray, hits: &mut Vec<Hit>, mut meet: impl FnMut(SurfaceHit)) -> f64 {
        self.continuation.walker.each(ray, hits, |hit, through| {
            let position = ray.at(hit.t);
            if let Some(patch) = self.view.patches.at(hit.face, hit.side, position) {
                let read = self.continuation.walker.read_reflectance(hit.face, position, hit.t);
                meet(SurfaceHit { face: hit.face, patch, side: hit.side, position, through, distance: hit.t, read });
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Mode;
    use crate::rays::sobol::Stream;
    use crate::rays::warp::cosine_direction;
    use crate::reading::view::lights_of;

    /// Rays from several points sample the whole hemisphere of each.
    #[test]
    fn every_origin_samples_all_of_its_hemisphere() {
        let lights = lights_of("furnace", Mode::Global.transport(), 6);
        let view = View::new(&lights, (1, 1).into());
        let patches = view.patches;
        // Three walls that meet in a corner are bright.
        let bright = |i: usize| patches.point(i, 0.5, 0.5).normal.element_sum() > 0.0;
        let field = (0..patches.len()).map(|i| Rgb::splat(f32::from(bright(i))));
        let fields = Fields::new(&[field.collect()]);
        let gather = FinalGather::new(&view, &fields);
        let middle = |i: usize| patches.point(i, 0.5, 0.5);
        const RAYS: u32 = 4096;
        let read = |from: &[SurfacePoint]| {
            let mut sums = [DVec3::ZERO];
            let rays = HemisphereRays { from, indices: 0..RAYS, seed: 5, guiding: Guiding::NONE };
            gather.read(&rays, &mut Memory::default(), &mut sums);
            sums[0].x / f64::from(RAYS)
        };
        for i in 0..patches.len() {
            for j in 0..i {
                let apart = read(&[middle(i), middle(j)]);
                let each = 0.5 * (read(&[middle(i)]) + read(&[middle(j)]));
                // Four standard errors of independent rays that see bright or dark; the two estimates share no points.
                let bound = 4.0 * (0.25 / f64::from(RAYS) * 2.0).sqrt();
                assert!((apart - each).abs() < bound, "{i} {j}: {apart} {each}");
            }
        }
    }

    #[test]
    fn rays_that_end_near_see_the_texels_there() {
        let room = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/room.toml");
        let lights = lights_of(room, Mode::Global.transport(), 100);
        let view = View::new(&lights, (1, 1).into());
        let patches = view.patches;
        let reflectance = |i: usize| patches.reflectance(view.scene, i);
        let fields = Fields::new(&[(0..patches.len()).map(reflectance).collect()]);
        let gather = FinalGather::new(&view, &fields);
        const RAYS: u32 = 4096;
        // Four standard errors of rays that see 0 or 1, of which texels differ by less.
        let bound = 4.0 * (0.25 / f64::from(RAYS) * 2.0).sqrt();
        let (mut random, mut most_apart) = (Stream::new(3), 0.0_f64);
        let floor = (0..patches.len()).filter(|&i| patches.point(i, 0.5, 0.5).face < 2);
        for i in floor.step_by(2) {
            // Faces down, a hand's breadth above the floor.
            let below = patches.point(i, 0.3, 0.6);
            let from = SurfacePoint { position: below.position + 0.01 * below.normal, normal: -below.normal, face: 3 };
            let mut sums = [DVec3::ZERO];
            let rays = HemisphereRays { from: &[from], indices: 0..RAYS, seed: 5, guiding: Guiding::NONE };
            gather.read(&rays, &mut Memory::default(), &mut sums);
            let texels = (0..RAYS).map(|_| {
                let direction = cosine_direction(from.normal, random.uniform(), random.uniform());
                let ray = Ray { origin: from.position, direction, source: None };
                view.rays.closest(&ray).map_or(0.0, |hit| view.scene.rho_at(hit.face, ray.at(hit.t)).x.into())
            });
            let (read, expected) = (sums[0].x / f64::from(RAYS), texels.sum::<f64>() / f64::from(RAYS));
            assert!((read - expected).abs() < bound, "{i}: {read} {expected}");
            most_apart = most_apart.max((f64::from(reflectance(i).x) - expected).abs());
        }
        assert!(most_apart > 1.5 * bound, "patches' means tell as much: {most_apart}");
    }
}
