//! The dual-weighted residual (R. Becker, R. Rannacher, *An optimal control approach to a posteriori error estimation*,
//! Acta Numerica 10, 2001): the error of a picture due to the light it reads on patches, sampled by paths; and samples
//! of the light that leaves patches.
//!
//! The light L_h that is read on patches has the residual `r = E + K L_h - L_h`, and the picture the error
//!
//! ```text
//! G (L - L_h) = G (I - K)^-1 r = E[ sum over the vertices of a path of w_k r_k ],
//!     r_k = glow + D_k + alpha rho L_h(z_k) - L_h(y_k)
//! ```
//!
//! whose mean over paths ([`crate::error::importance_paths`]) has no bias however coarse the patches are: noise of F,
//! truncation of the series and light that varies within patches are all in it.
//!
//! Paths from the camera seldom meet a small bright place, as the spot of a luminaire on a wall, and a patch
//! represented by a few of their vertices would be as bright as those happen to be. So patch i has at least
//!
//! ```text
//! n_i = N A_i L_i / sum of A_j L_j
//! ```
//!
//! samples: those that paths do not supply lie at points uniform over it.
//!
//! Not handled: the sum over a picture ([`crate::error::sampled_pixels`]).

use glam::DVec3;
use halflight_team::Loop;

use crate::error::importance_paths::{ImportancePaths, Path, PathTracer, Vertex};
use crate::light::Rgb;
use crate::patches::{Patches, Sample};
use crate::rays::sobol::{Stream, hash};
use crate::reading::patch_light::Fields;
use crate::reading::reflection::{Memory, SurfaceHit};
use crate::reading::view::View;
use crate::scene::Scene;
use crate::surfaces::SurfacePoint;

/// The first field on the patch of a point, as a ray reads it; nothing where there is none.
fn light_at(patches: &Patches, fields: &Fields, at: &SurfaceHit) -> DVec3 {
    let read = |patch: u32| fields.of_patch(patch)[0].at(at.position) * at.over_patch(patches, patch);
    patches.at(at.face, at.side, at.position).map_or(DVec3::ZERO, |patch| read(patch).as_dvec3())
}

/// A sample of the light that leaves a vertex of a path, from the first field on what its next rays meet.
pub(crate) fn sample(vertex: &Vertex, patches: &Patches, fields: &Fields) -> DVec3 {
    let incident = |m: &SurfaceHit| f64::from(m.through) * light_at(patches, fields, m);
    vertex.reflection.light(vertex.reflection.next.iter().map(incident).sum())
}

/// `sum of w_k r_k` over the vertices of a path from the one on where patches are read.
pub(crate) fn error(vertices: &[Vertex], patches: &Patches, fields: &Fields) -> DVec3 {
    // From the last vertex back, so that the sum over those that follow is known.
    let (mut rest, mut own) = (DVec3::ZERO, DVec3::ZERO);
    for vertex in vertices.iter().rev() {
        let SurfaceHit { face, side, position, distance, .. } = vertex.at;
        let patch = patches.at(face, side, position);
        let over_patch = patch.map_or(Rgb::ONE, |patch| vertex.at.over_patch(patches, patch));
        let read = |patch: u32| (fields.of_patch(patch)[0].at(position) * over_patch).as_dvec3();
        let light = patch.map_or(DVec3::ZERO, read);
        rest += vertex.weight * (sample(vertex, patches, fields) - light);
        // A ray too short to read goes on, with the error of the next one.
        if !patch.is_some_and(|patch| fields.is_near(patch, distance)) {
            own = rest;
        }
    }
    own
}

/// Cost of a visibility ray for direct light, in rays: points on luminaires are drawn and weighted, too.
const DIRECT_RAY: f64 = 2.0;

impl ImportancePaths {
    /// Cost of a gather ray, in rays: it goes on while what it meets is too near, with direct light sampled where it
    /// goes on.
    pub fn price(&self, patches: &Patches, fields: &Fields) -> f64 {
        let reads = |vertex: &Vertex| {
            let SurfaceHit { face, side, position, distance, .. } = vertex.at;
            patches.at(face, side, position).is_some_and(|patch| !fields.is_near(patch, distance))
        };
        // How far a path that ended before would have gone on is not known.
        let before = |path: &Path| path.vertices.iter().position(reads).unwrap_or(path.vertices.len());
        let count = self.sum(|path| before(path) as u64);
        let further = count as f64 / self.count.max(1) as f64;
        1.0 + further * (1.0 + DIRECT_RAY * self.direct_rays())
    }

    /// For every patch as it was cut samples of the light that leaves it, at the vertices of the paths, from the
    /// first field on what they meet; as if every patch reflected its mean, so that no patch is divided for a
    /// texture.
    pub fn samples(&self, scene: &Scene, patches: &Patches, fields: &Fields) -> Vec<Vec<Sample>> {
        let of_path = |path: &Path| -> Vec<(u32, Sample)> {
            path.vertices.iter().filter_map(|vertex| patch_sample(vertex, scene, patches, fields)).collect()
        };
        let mut samples = vec![Vec::new(); patches.len()];
        for (whole, sample) in self.each_of(0, of_path).into_iter().flatten() {
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
        let own = vertex.reflection.rho;
        let mean = patches.reflectance(scene, whole as usize).as_dvec3();
        // At a black texel the light that arrives is unknown.
        let even = || vertex.reflection.glow + (light - vertex.reflection.glow) * mean / own;
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
    let add = |memory: &mut Memory, k: usize, own: &mut Vec<Sample>| {
        let wanted = (count as f64 * powers[k] / total) as usize;
        let before = memory.scratch.cast;
        let mut random = Stream::new(hash(k as u32, seed));
        for _ in own.len()..wanted {
            own.extend(sample_of(&tracer, fields, k, &mut random, memory));
        }
        memory.scratch.cast - before
    };
    Loop::weighed(samples.len(), |k| powers[k]).change(samples, Memory::default, add).into_iter().sum()
}

/// A sample of the light that leaves a point of patch k as it was cut.
fn sample_of(
    tracer: &PathTracer,
    fields: &Fields,
    k: usize,
    random: &mut Stream,
    memory: &mut Memory,
) -> Option<Sample> {
    let view = tracer.walker.view;
    let point = view.patches.cut_point(k, random.uniform(), random.uniform());
    let side = view.patches.side(k);
    let at = SurfaceHit {
        face: point.face,
        patch: view.patches.at(point.face, side, point.position)?,
        side,
        position: point.position,
        through: 1.0,
        // The cone over which a texture is averaged.
        distance: view.patches.cut_extent(k).width,
        read: None,
    };
    let reflection = tracer.reflect(&at, random, memory);
    let vertex = Vertex { at, weight: DVec3::ONE, reflection };
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

    /// In a closed room a ray ends only where it reads, and emission takes no ray.
    #[test]
    fn a_gather_ray_is_priced_by_the_rays_it_takes() {
        let lights = lights_of("furnace", Mode::Global.transport(), 24);
        let view = View::new(&lights, (8, 8).into());
        let (paths, fields) = followed(&view);
        assert_eq!((paths.direct_rays(), paths.price(view.patches, &fields)), (0.0, 1.0));
        // Where everything is near, a ray goes on as long as its path does.
        let near = fields.not_read_nearer(vec![f32::INFINITY; view.patches.len()]);
        let vertices = paths.sum(|path| path.vertices.len() as u64);
        assert_eq!(paths.price(view.patches, &near), 1.0 + vertices as f64 / paths.count as f64);
    }

    #[test]
    fn direct_light_has_its_price() {
        let lights = lights_of("furnished-room", Mode::Global.transport(), 100);
        let view = View::new(&lights, (8, 8).into());
        let (paths, fields) = followed(&view);
        let direct = DIRECT_RAY * paths.direct_rays();
        let most = DIRECT_RAY * view.lights.luminaires.list.len() as f64;
        assert!(0.0 < direct && direct <= most, "{direct} {most}");
        let near = fields.not_read_nearer(vec![f32::INFINITY; view.patches.len()]);
        let vertices = paths.sum(|path| path.vertices.len() as u64);
        let further = vertices as f64 / paths.count as f64;
        assert!((paths.price(view.patches, &near) / (1.0 + further * (1.0 + direct)) - 1.0).abs() < 1e-12);
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
