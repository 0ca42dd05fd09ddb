//! By how much a picture is off because of the light it reads on patches, as one path shows: the dual-weighted residual
//! of the equation that patches stand for (R. Becker, R. Rannacher, *An optimal control approach to a posteriori error
//! estimation*, Acta Numerica 10, 2001); and samples of the light on patches, where paths reach and where most of it
//! is.
//!
//! The light L_h that is read on patches misses the equation of points by `r = E + K L_h - L_h`, and the picture misses
//! that of the exact light by
//!
//! ```text
//! G (L - L_h) = G (I - K)^-1 r = E[ sum over the vertices of a path of w_k r_k ],
//!     r_k = glow + D_k + alpha rho L_h(z_k) - L_h(y_k)
//! ```
//!
//! whose mean over paths ([`crate::error::importance_paths`]) has no bias however coarse the patches are: it sees the
//! noise of F, the truncation of the series, and patches that mix light which no other grid would part. If the gather
//! pass itself follows one more ray before it reads, the first term of the sum is left out.
//!
//! Paths from the camera meet a small bright place, as the spot of a lamp that shines at a wall, one time in thousands.
//! A patch that stands for the few points that paths reached would be as bright as those happen to be, and is not
//! divided where none of them lies in the spot. So a patch has as many samples as its part of all light asks for,
//!
//! ```text
//! n_i = N A_i L_i / sum of A_j L_j        those that paths have not reached at points uniform over it
//! ```
//!
//! Not handled: what many paths show of a picture ([`crate::error::sampled_pixels`]); places that are bright for the
//! picture alone, which paths reach.

use glam::DVec3;
use rayon::prelude::*;

use crate::error::importance_paths::{ImportancePaths, Path, PathTracer, Vertex};
use crate::light::Rgb;
use crate::patches::{Patches, Sample};
use crate::rays::sobol::{Stream, hash};
use crate::reading::patch_light::{Fields, READINGS, Reading};
use crate::reading::reflection::{Memory, SurfaceHit};
use crate::reading::view::View;
use crate::scene::Scene;
use crate::surfaces::SurfacePoint;

/// The leading field on the patch of a point, as a ray reads it; nothing where there is none.
fn light_at(patches: &Patches, fields: &Fields, at: &SurfaceHit) -> DVec3 {
    let read = |patch: u32| fields.of_patch(patch)[0].at(at.position) * at.over_patch(patches, patch);
    patches.at(at.face, at.side, at.position).map_or(DVec3::ZERO, |patch| read(patch).as_dvec3())
}

/// A sample of the light that leaves a vertex of a path, from the leading field on what its next rays meet.
pub(crate) fn sample(vertex: &Vertex, patches: &Patches, fields: &Fields) -> DVec3 {
    let incident = |m: &SurfaceHit| f64::from(m.through) * light_at(patches, fields, m);
    vertex.found.light(vertex.found.next.iter().map(incident).sum())
}

/// `sum of w_k r_k` over the vertices of a path that each reading leaves to the patches.
pub(crate) fn errors(path: &Path, patches: &Patches, fields: &Fields) -> [DVec3; READINGS] {
    let mut errors = [DVec3::ZERO; READINGS];
    // From the last vertex on, so that sums over what follows are known.
    let (mut rest, mut own) = (DVec3::ZERO, DVec3::ZERO);
    for (k, vertex) in path.vertices.iter().enumerate().rev() {
        let SurfaceHit { face, side, position, distance, .. } = vertex.at;
        let patch = patches.at(face, side, position);
        let over_patch = patch.map_or(Rgb::ONE, |patch| vertex.at.over_patch(patches, patch));
        let read = |patch: u32| (fields.of_patch(patch)[0].at(position) * over_patch).as_dvec3();
        let light = patch.map_or(DVec3::ZERO, read);
        rest += vertex.weight * (sample(vertex, patches, fields) - light);
        // A ray that is too short goes on: what the next one leaves is what it leaves.
        if !patch.is_some_and(|patch| fields.is_near(patch, distance)) {
            own = rest;
        }
        if let Some(error) = errors.get_mut(k) {
            *error = own;
        }
    }
    errors
}

/// What asking for direct light takes for each of its rays, in rays: points on lamps are drawn and weighed beside.
const ASKED: f64 = 2.0;
/// Paths that one thread takes at a time.
const CHUNK: usize = 1024;

impl ImportancePaths {
    /// By reading: what a gather ray takes until it has read, in rays. It goes on while what it meets is too near, and
    /// direct light is asked for where it goes on.
    pub fn prices(&self, patches: &Patches, fields: &Fields) -> [f64; READINGS] {
        let asked = ASKED * self.asked();
        let further = |reading: Reading| self.further(patches, fields, reading.bounces() as usize);
        Reading::ALL.map(|reading| 1.0 + further(reading) * (1.0 + asked))
    }

    /// Rays that follow a gather ray before it reads, in the mean: `bounces`, and more while what they meet is near.
    fn further(&self, patches: &Patches, fields: &Fields, bounces: usize) -> f64 {
        let reads = |vertex: &Vertex| {
            let SurfaceHit { face, side, position, distance, .. } = vertex.at;
            patches.at(face, side, position).is_some_and(|patch| !fields.is_near(patch, distance))
        };
        let before = |path: &Path| {
            let read = path.vertices.iter().skip(bounces).position(reads);
            // By how much a path would have gone on that ended before is not known.
            read.map_or(path.vertices.len(), |k| k + bounces)
        };
        let count: usize = self.paths.par_iter().map(before).sum();
        count as f64 / self.paths.len().max(1) as f64
    }

    /// For every patch as it was cut samples of the light that leaves it, at the vertices of the paths, from the
    /// leading field on what they meet; as if every patch reflected its mean, so that no patch is divided for a
    /// texture.
    pub fn samples(&self, scene: &Scene, patches: &Patches, fields: &Fields) -> Vec<Vec<Sample>> {
        let chunks = self.paths.par_chunks(CHUNK);
        let vertices = |chunk: &[Path]| {
            let all = chunk.iter().flat_map(|p| &p.vertices);
            all.filter_map(|vertex| patch_sample(vertex, scene, patches, fields)).collect()
        };
        let found: Vec<Vec<(u32, Sample)>> = chunks.map(vertices).collect();
        let mut samples = vec![Vec::new(); patches.len()];
        for (whole, sample) in found.into_iter().flatten() {
            samples[whole as usize].push(sample);
        }
        samples
    }
}

/// The patch, as it was cut, that a vertex of a path lies on, with a sample of the light that leaves it.
pub(crate) fn patch_sample(
    vertex: &Vertex,
    scene: &Scene,
    patches: &Patches,
    fields: &Fields,
) -> Option<(u32, Sample)> {
    let SurfaceHit { face, side, position, .. } = vertex.at;
    let normal = patches.normal(face, side);
    let whole = patches.whole(patches.at(face, side, position)?);
    let mut light = sample(vertex, patches, fields);
    if scene.maps(face).is_some() {
        let own = vertex.found.rho;
        let mean = patches.reflectance(scene, whole as usize).as_dvec3();
        // Where a texel is black nothing is known of the light that arrives.
        let even = || vertex.found.glow + (light - vertex.found.glow) * mean / own;
        light = (own.min_element() > 0.0).then(even)?;
    }
    Some((whole, Sample { point: SurfacePoint { position, normal, face }, light }))
}

/// Adds samples to those of patches as they were cut, until each has its part of `count`; returns the rays cast.
pub(crate) fn add_samples_of_bright(
    view: &View,
    fields: &Fields,
    samples: &mut [Vec<Sample>],
    count: usize,
    seed: u32,
) -> u64 {
    let powers = powers(view, fields, samples.len());
    let total: f64 = powers.iter().sum();
    let tracer = PathTracer::new(view);
    let add = |memory: &mut Memory, (k, own): (usize, &mut Vec<Sample>)| {
        let wanted = (count as f64 * powers[k] / total) as usize;
        let before = memory.scratch.cast;
        let mut random = Stream::new(hash(k as u32, seed));
        for _ in own.len()..wanted {
            own.extend(sample_of(&tracer, fields, k, &mut random, memory));
        }
        memory.scratch.cast - before
    };
    samples.par_iter_mut().enumerate().map_init(Memory::default, add).sum()
}

/// A sample of the light that leaves a point of patch k as it was cut.
fn sample_of(
    tracer: &PathTracer,
    fields: &Fields,
    k: usize,
    random: &mut Stream,
    memory: &mut Memory,
) -> Option<Sample> {
    let view = tracer.view();
    let point = view.patches.cut_point(k, random.uniform(), random.uniform());
    let side = view.patches.side(k);
    let at = SurfaceHit {
        face: point.face,
        patch: view.patches.at(point.face, side, point.position)?,
        side,
        position: point.position,
        through: 1.0,
        // A texture is its mean over so much.
        distance: view.patches.cut_extent(k).width,
        read: None,
    };
    let found = tracer.reflect(&at, random, memory);
    let vertex = Vertex { at, weight: glam::DVec3::ONE, found };
    Some(patch_sample(&vertex, view.scene, view.patches, fields)?.1)
}

/// `A L` of each of the first `count` patches with all of its parts, channels added.
fn powers(view: &View, fields: &Fields, count: usize) -> Vec<f64> {
    let patches = view.patches;
    let mut powers = vec![0.0; count];
    for (i, area) in patches.areas().iter().enumerate() {
        let light = fields.of_patch(i as u32)[0].at(patches.point(i, 0.5, 0.5).position);
        powers[patches.whole(i as u32) as usize] += area * f64::from(light.element_sum().max(0.0));
    }
    powers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Mode;
    use crate::reading::view::lights_of;

    /// Four paths of each pixel of a view, and light 1 on its patches.
    fn followed(view: &View) -> (ImportancePaths, Fields) {
        let mut paths = ImportancePaths::new(view, vec![1.0; view.width * view.height], 3);
        paths.extend(view, 4);
        (paths, Fields::new(&[vec![Rgb::ONE; view.patches.len()]]))
    }

    /// In a closed room nothing ends a ray but what it reads, and its glow is asked for without a ray.
    #[test]
    fn a_reading_is_priced_by_the_rays_it_takes() {
        let lights = lights_of("furnace", Mode::Global.transport(), 24);
        let view = View::new(&lights, (8, 8).into());
        let (paths, fields) = followed(&view);
        let far = paths.prices(view.patches, &fields);
        assert_eq!(paths.asked(), 0.0);
        // Paths of a room that absorbs half of the light seldom end where the first reads.
        assert_eq!(far[0], 1.0);
        let second = far[1];
        assert!(1.9 < second && second <= 2.0, "{second}");
        // Where everything is near, a ray goes on as long as its path does.
        let near = fields.not_read_nearer(vec![f32::INFINITY; view.patches.len()]);
        let vertices: usize = paths.paths.iter().map(|path| path.vertices.len()).sum();
        assert_eq!(paths.prices(view.patches, &near)[0], 1.0 + vertices as f64 / paths.paths.len() as f64);
    }

    /// Each vertex of the furnished room's paths asks its lamps by rays, and so does each place that a ray goes on
    /// from.
    #[test]
    fn asking_for_direct_light_has_its_price() {
        let lights = lights_of("furnished-room", Mode::Global.transport(), 100);
        let view = View::new(&lights, (8, 8).into());
        let (paths, fields) = followed(&view);
        let prices = paths.prices(view.patches, &fields);
        let asked = ASKED * paths.asked();
        let most = ASKED * view.lights.luminaires.list.len() as f64;
        assert!(0.0 < asked && asked <= most, "{asked} {most}");
        // In a closed room nearly every ray that goes on reads what the next one meets.
        let more = (prices[1] - prices[0]) / (1.0 + asked);
        assert!((0.9..1.1).contains(&more), "{more} {prices:?}");
    }

    /// Where one patch has half of all light it gets half of the samples, less those that it has.
    #[test]
    fn patches_have_samples_by_their_part_of_all_light() {
        let lights = lights_of("furnace", Mode::Global.transport(), 24);
        let view = View::new(&lights, (8, 8).into());
        let mut light = vec![Rgb::ONE; view.patches.len()];
        let others = view.patches.areas().iter().sum::<f64>() - view.patches.areas()[0];
        light[0] = Rgb::splat((others / view.patches.areas()[0]) as f32);
        let fields = Fields::new(&[light]);
        let mut samples = vec![Vec::new(); view.patches.len()];
        let rays = add_samples_of_bright(&view, &fields, &mut samples, 1000, 3);
        assert!(samples[0].len().abs_diff(500) <= 1 && rays > 8 * 500, "{} {rays}", samples[0].len());
        let all: usize = samples.iter().map(Vec::len).sum();
        assert!(all <= 1000 && all + view.patches.len() > 1000, "{all}");
        assert_eq!(add_samples_of_bright(&view, &fields, &mut samples, 1000, 3), 0);
    }
}
