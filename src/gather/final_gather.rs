//! Hemisphere rays from one point that read the solution: irradiance over pi, and how near the surroundings are.

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::gather::fields::Fields;
use crate::gather::guiding::Guided;
use crate::gather::reading::Reading;
use crate::gather::reflection::{Memory, Walker};
use crate::gather::view::View;
use crate::light::Rgb;
use crate::rays::sobol::{Sobol, Stream, hash};
use crate::rays::{FAN, Fan, Hit, Ray};
use crate::surfaces::SurfacePoint;

/// Rays of a point whose numbers are tabled: few points cast more.
const TABLED: usize = 1 << 13;

/// How what a ray reads is counted: `weight * light + offset`, the offset for the first field only.
#[derive(Clone, Copy)]
struct Counts {
    weight: f32,
    offset: Rgb,
}

/// What one ray found.
pub(crate) struct Told {
    /// Inverse distance to the first face that it met.
    pub nearness: f64,
    /// Light of the first field.
    pub light: DVec3,
}

/// Reads fields along cosine-distributed rays.
pub(crate) struct Reader<'a> {
    view: &'a View<'a>,
    pub(crate) fields: &'a Fields,
    sobol: Sobol,
    pub(crate) walker: Walker<'a>,
    pub(crate) reading: Reading,
}

impl<'a> Reader<'a> {
    /// A reader of the light that a view meets.
    pub fn new(view: &'a View, fields: &'a Fields, reading: Reading) -> Reader<'a> {
        Reader { view, fields, sobol: Sobol::new(TABLED, 3), walker: Walker::new(view), reading }
    }

    /// Number of fields that make the picture.
    pub fn leading(&self) -> usize {
        self.fields.leading()
    }

    /// The length of the brightest light of the fields that make the picture, over the middles of patches.
    pub fn brightest(&self) -> f64 {
        let patches = self.view.patches;
        let light = |i: usize| -> Rgb {
            let at = patches.point(i, 0.5, 0.5).position;
            let own = &self.fields.of_patch(i as u32)[..self.leading()];
            own.iter().map(|l| l.at(at)).sum()
        };
        let lengths = (0..patches.len()).map(|i| f64::from(light(i).length()));
        lengths.fold(0.0, f64::max)
    }

    /// Number of fields read.
    pub fn fields(&self) -> usize {
        self.fields.count()
    }

    /// Adds what the rays `indices`, which start from the points `from`, read in every field to `incident`; returns
    /// the sum of the rays' inverse lengths.
    pub fn read(
        &self,
        from: &[SurfacePoint],
        indices: Range<u32>,
        (seed, guided): (u32, Guided),
        memory: &mut Memory,
        incident: &mut [DVec3],
    ) -> f64 {
        if !self.fields.is_read_at_once() {
            return self.cast(from, indices, (seed, guided), |ray, k, counts| {
                let mut random = Stream::new(hash(k, seed));
                let told = self.read_onward(ray, &mut random, memory);
                incident[0] += f64::from(counts.weight) * told.light + counts.offset.as_dvec3();
                told
            });
        }
        self.cast(from, indices, (seed, guided), |ray, _, counts| {
            let mut light = Rgb::ZERO;
            incident[0] += counts.offset.as_dvec3();
            let nearness = self.meet(ray, &mut memory.hits, |patch, position, through| {
                let fields = self.fields.of_patch(patch).iter().enumerate();
                for ((f, l), sum) in fields.zip(incident.iter_mut()) {
                    let found = through * l.at(position);
                    *sum += (counts.weight * found).as_dvec3();
                    if f == 0 {
                        light += found;
                    }
                }
            });
            Told { nearness, light: light.as_dvec3() }
        })
    }

    /// Calls `each(ray, index, weight)` for the rays `indices` from the points `from`, as a guide bends them: what a ray reads counts
    /// `weight`. Returns the weighted sum of the rays' inverse lengths.
    #[inline(always)]
    fn cast(
        &self,
        from: &[SurfacePoint],
        indices: Range<u32>,
        (seed, guided): (u32, Guided),
        mut each: impl FnMut(&Ray, u32, Counts) -> Told,
    ) -> f64 {
        let mut nearness = 0.0;
        let mut first = indices.start;
        while first < indices.end {
            let (fan, bent) = Fan::bent(&self.sobol, first, seed, |u, v| guided.bend(u, v));
            for k in 0..FAN.min((indices.end - first) as usize) {
                // A dimension of its own chooses the point, or each would look at a part of the hemisphere only.
                let from = match from {
                    [one] => one,
                    _ => &from[(f64::from(fan.third(k)) * from.len() as f64) as usize],
                };
                let ray =
                    Ray { origin: from.position, direction: fan.direction(k, from.normal), source: Some(from.face) };
                let counts = Counts { weight: bent.weights[k], offset: bent.offsets[k] };
                let told = each(&ray, first + k as u32, counts);
                nearness += f64::from(bent.weights[k]) * told.nearness;
                guided.tell(bent.cells[k], told.light);
            }
            first += FAN as u32;
        }
        nearness
    }

    /// Calls `meet(patch, position, through)` for all that the rays `indices` from a point meet, `through` being the product of
    /// tau before it.
    pub fn trace(&self, from: &SurfacePoint, indices: Range<u32>, seed: u32, mut meet: impl FnMut(u32, Vec3, f32)) {
        let mut hits = Vec::new();
        let from = std::slice::from_ref(from);
        self.cast(from, indices, (seed, Guided::ALONE), |ray, _, _| Told {
            nearness: self.meet(ray, &mut hits, &mut meet),
            light: DVec3::ZERO,
        });
    }

    /// Meets all that light comes from along a ray; returns the inverse distance to the first.
    #[inline(always)]
    fn meet(&self, ray: &Ray, hits: &mut Vec<Hit>, mut meet: impl FnMut(u32, Vec3, f32)) -> f64 {
        let view = self.view;
        view.rays.light_crossings(ray, self.walker.opaque, hits);
        view.rays.transmit(hits, |m| view.transports[m].tau, |hit, through| self.meet_at(ray, hit, through, &mut meet));
        hits.first().map_or(0.0, |hit| 1.0 / f64::from(hit.t))
    }

    #[inline(always)]
    fn meet_at(&self, ray: &Ray, hit: &Hit, through: f32, meet: &mut impl FnMut(u32, Vec3, f32)) {
        let position = ray.at(hit.t);
        if let Some(patch) = self.view.patches.at(hit.face, hit.side, position) {
            meet(patch, position, through);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::{Luminaires, Sight};
    use crate::light::{Mode, Transport};
    use crate::patches::Patches;
    use crate::rays::Rays;
    use crate::scene::Scene;

    /// Rays once took their points in turn. Of Sobol points every other one lies in the same half of the interval, so each point
    /// looked at a half of its hemisphere only.
    #[test]
    fn every_point_that_rays_leave_looks_all_around() {
        let scene = Scene::open("furnace").unwrap();
        let rays = Rays::new(&scene);
        let patches = Patches::new(&scene, &rays, 6);
        let transports: Vec<Transport> = scene.transports(Mode::Global.transport());
        let luminaires = Luminaires::new(&scene);
        let receives = vec![true; patches.len()];
        let sight = Sight::new(&scene, &rays, &patches, &luminaires, &transports, &receives);
        let view = View {
            scene: &scene,
            rays: &rays,
            patches: &patches,
            luminaires: &luminaires,
            sight: &sight,
            transports: &transports,
            width: 1,
            height: 1,
        };
        // Three walls that meet in a corner are bright.
        let bright = |i: usize| patches.point(i, 0.5, 0.5).normal.element_sum() > 0.0;
        let field = (0..patches.len()).map(|i| Rgb::splat(f32::from(bright(i))));
        let fields = Fields::new(&[field.collect()]);
        let reader = Reader::new(&view, &fields, Reading::PLAIN);
        let middle = |i: usize| patches.point(i, 0.5, 0.5);
        const RAYS: u32 = 4096;
        let read = |from: &[SurfacePoint]| {
            let mut sums = [DVec3::ZERO];
            reader.read(from, 0..RAYS, (5, Guided::ALONE), &mut Memory::default(), &mut sums);
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
}
