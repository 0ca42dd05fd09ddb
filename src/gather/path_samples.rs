//! What paths from the camera tell of the light on patches, beside its error: samples of it where they reach, and what
//! a gather ray takes until it has read.
//!
//! Not handled: by how much the light is off ([`crate::gather::path_errors`]).

use rayon::prelude::*;

use crate::gather::fields::Fields;
use crate::gather::importance_paths::{ImportancePaths, Path, Vertex};
use crate::gather::path_errors::sample;
use crate::gather::reading::{READINGS, Reading};
use crate::gather::reflection::SurfaceHit;
use crate::patches::{Patches, Sample};
use crate::scene::Scene;
use crate::surfaces::SurfacePoint;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::view::{View, lights_of};
    use crate::light::{Mode, Rgb};

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
        let most = ASKED * view.luminaires.list.len() as f64;
        assert!(0.0 < asked && asked <= most, "{asked} {most}");
        // In a closed room nearly every ray that goes on reads what the next one meets.
        let more = (prices[1] - prices[0]) / (1.0 + asked);
        assert!((0.9..1.1).contains(&more), "{more} {prices:?}");
    }
}
