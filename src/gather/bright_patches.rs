//! Samples of light on the patches that most of it comes from, spread evenly over them.
//!
//! Paths from the camera meet a small bright place, as the spot of a lamp that shines at a wall, one time in thousands.
//! A patch that stands for the few points that paths reached would be as bright as those happen to be, and is not
//! divided where none of them lies in the spot. So a patch has as many samples as its part of all light asks for,
//!
//! ```text
//! n_i = N A_i L_i / sum of A_j L_j        those that paths have not reached at points uniform over it
//! ```
//!
//! Not handled: places that are bright for the picture alone; paths reach those.

use rayon::prelude::*;

use crate::gather::fields::Fields;
use crate::gather::importance_paths::{PathTracer, Vertex};
use crate::gather::path_samples::patch_sample;
use crate::gather::reflection::{Memory, SurfaceHit};
use crate::gather::view::View;
use crate::patches::Sample;
use crate::rays::sobol::{Stream, hash};

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
    use crate::light::{Mode, Rgb};

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
