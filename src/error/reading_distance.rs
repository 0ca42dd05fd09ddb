//! The least distance from which the light of a patch may be read; from nearer a point sees parts of it, not its mean.
//!
//! ```text
//! d_i = w_i max(s_i, u_i / EVEN)        u_i² = mean over points of |alpha rho D(x) - D_i(x)|² / |L_i|²
//! ```
//!
//! with w the width of the patch, s 0 where light is read as linear along both axes and 1 elsewhere, D the light of
//! luminaires at the point and `D_i(x)` that of the patch as it is read there. Across a patch of width w at distance d
//! the weights of its points differ by about w / d, so the error of uneven light read there is u w / d.
//!
//! Not handled: indirect light that is uneven within a patch.

use halflight_team::Loop;

use crate::error::halves::Halves;
use crate::rays::sobol::{Sobol, Stream, hash};
use crate::reading::patch_light::Fields;
use crate::reading::reflection::{Memory, SurfaceHit, Walker};
use crate::reading::view::View;

/// Share of a patch's light that its direct light differs by, where it is read from its width on like patches whose
/// light is one value.
const EVEN: f64 = 0.25;
/// Points of a patch at which direct light is sampled, twice each: the mean of the products has no bias by noise.
const POINTS: u32 = 8;

/// The length below which a ray does not read the patch it meets, by patch, in unit coordinates, empty where it is 0 on
/// all; and how many rays were cast.
pub(crate) fn nearest_read(view: &View, fields: &Fields, seed: u32) -> (Vec<f32>, u64) {
    let neighbours = view.patches.neighbours();
    let sampler = UnevennessSampler {
        walker: Walker::new(view).with_cone(1.0),
        fields,
        sobol: Sobol::new(POINTS as usize, 2),
        seed,
    };
    let of = |memory: &mut Memory, i: usize| {
        let least = if neighbours.has_slopes(i) { 0.0 } else { 1.0 };
        let extent = if sampler.has_enough_points(i) { view.patches.extent(i) } else { view.patches.cut_extent(i) };
        let width = extent.width;
        let before = memory.scratch.cast;
        let widths = (sampler.unevenness(i, width, memory) / EVEN).max(least);
        (widths as f32 * width, memory.scratch.cast - before)
    };
    let found = Loop::each(view.patches.len()).map_init(Memory::default, of);
    let (nearest, cast): (Vec<f32>, Vec<u64>) = found.into_iter().unzip();
    let nearest = if nearest.iter().all(|near| *near == 0.0) { Vec::new() } else { nearest };
    (nearest, cast.iter().sum())
}

/// Samples the direct light at points of patches.
struct UnevennessSampler<'a> {
    walker: Walker<'a>,
    fields: &'a Fields,
    sobol: Sobol,
    seed: u32,
}

impl UnevennessSampler<'_> {
    /// Whether a patch has enough chosen points to represent its width and evenness.
    fn has_enough_points(&self, i: usize) -> bool {
        self.walker.view.patches.chosen(i).len() >= POINTS as usize
    }

    /// u of a patch: RMS difference of direct light at its points from what is read of it, over all its light.
    fn unevenness(&self, i: usize, width: f32, memory: &mut Memory) -> f64 {
        let patch = i as u32;
        let own = self.fields.of_patch(patch)[0];
        let mut random = Stream::new(hash(patch, self.seed));
        let (mut squared, mut light) = (0.0, 0.0);
        for k in 0..POINTS {
            let [u, v] = [0, 1].map(|d| self.sobol.point(k, d, hash(patch, self.seed)));
            let patches = self.walker.view.patches;
            let point = if self.has_enough_points(i) { patches.point(i, u, v) } else { patches.cut_point(i, u, v) };
            let at = SurfaceHit {
                face: point.face,
                patch,
                side: self.walker.view.patches.side(i),
                position: point.position,
                through: 1.0,
                // The cone over which a texture is averaged.
                distance: width,
                read: None,
            };
            let mut sample = || self.walker.direct(&at, &mut random, memory).direct;
            let halves = [sample(), sample()];
            let all = own.at(point.position);
            let read = (all - self.fields.without_direct(patch, point.position)).as_dvec3();
            squared += Halves::of(halves.map(|direct| direct - read)).squared();
            light += all.as_dvec3().length_squared();
        }
        if light > 0.0 { (squared.max(0.0) / light).sqrt() } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::Sampling;
    use crate::light::{Mode, Rgb};
    use crate::reading::patch_light::linear;
    use crate::reading::view::lights_of;

    /// Clusters, cut cells and cells in a row are constant along an axis at least; light that grows along all axes
    /// shows which patches those are. Without interreflection direct light is read nowhere.
    #[test]
    fn near_rays_read_patches_whose_light_has_slopes_along_both_axes() {
        let local = Mode::Local.transport();
        let lights = lights_of("furnace", local, 600);
        let even = |view: &View| Fields::new(&[vec![Rgb::ONE; view.patches.len()]]);
        let view = View::new(&lights, (8, 8).into());
        assert!(nearest_read(&view, &even(&view), 0).0.is_empty());
        let lights = lights_of("furnished-room", local, 2000);
        let view = View::new(&lights, (8, 8).into());
        let neighbours = view.patches.neighbours();
        let means: Vec<Rgb> = (0..view.patches.len()).map(|i| Rgb::splat(9.0) + neighbours.middle(i)).collect();
        let light = linear(&neighbours, &means);
        let changes = |i: usize| neighbours.halves(i).map(|half| (light[i].slope * half).length());
        let nearest = nearest_read(&view, &even(&view), 0).0;
        for (i, nearest) in nearest.iter().enumerate() {
            let is_linear = changes(i).iter().all(|change| *change > 1e-6);
            let expected = if is_linear { 0.0 } else { view.patches.extent(i).width };
            assert_eq!(*nearest, expected, "{i}: {:?}", changes(i));
        }
        let near = nearest.iter().filter(|nearest| **nearest == 0.0).count();
        assert!(0 < near && near < view.patches.len(), "{near}");
    }

    /// Where a field of light 1 has no direct light, all of `alpha rho D` is uneven, and u is its RMS over a patch: no
    /// less than its mean, and not much more where no shadow falls. Where the field has it, little remains.
    #[test]
    fn patches_are_read_from_further_the_more_uneven_their_direct_light_is() {
        let lights = lights_of("cornell-box", Mode::Global.transport(), 400);
        let view = View::new(&lights, (8, 8).into());
        let (count, neighbours) = (view.patches.len(), view.patches.neighbours());
        let sampling = Sampling { rays: 1, emitter_rays: 256, seed: 5 };
        let received = view.lights.receive_emitted(&vec![true; count], &sampling, &|_| ()).0;
        let direct = |i: usize| view.patches.reflectance(view.scene, i) * received[i];
        let direct: Vec<Rgb> = (0..count).map(direct).collect();
        let even = Fields::new(&[vec![Rgb::ONE; count]]);
        let far = |direct: &[Rgb]| {
            let fields = even.clone().with_rest([direct.to_vec(), direct.to_vec()], view.patches);
            nearest_read(&view, &fields, 0).0
        };
        let [unknown, known] = [far(&vec![Rgb::ZERO; count]), far(&direct)];
        let mut sums = [0.0; 3];
        for i in (0..count).filter(|&i| neighbours.has_slopes(i)) {
            let unevenness = |far: &[f32]| EVEN * f64::from(far[i] / view.patches.extent(i).width);
            let mean = (direct[i].as_dvec3().length_squared() / 3.0).sqrt();
            sums[0] += mean;
            sums[1] += unevenness(&unknown);
            sums[2] += unevenness(&known);
        }
        let [mean, unknown, known] = sums;
        // An RMS is no less than a mean, but for noise of some 200 patches' eight points; and no more than 1.2 of it
        // where few of the patches have a shadow's edge.
        assert!(mean < 1.02 * unknown && unknown < 1.2 * mean, "{sums:?}");
        assert!(known < 0.25 * unknown, "{sums:?}");
    }
}
