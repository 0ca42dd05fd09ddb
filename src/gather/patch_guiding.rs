//! Guiding densities of patches: where the light comes from that arrives there, for rays that go on.
//!
//! A ray that goes on from a patch finds light or none by chance, and where light comes by few ways, as through a
//! window, that is most of a picture's noise. All rays that went on from a patch before it tell where to look.
//!
//! Not handled: what is seen from one part of a patch only.

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::gather::guiding::{GuidedPlace, Guiding};

/// Densities at most: each takes some 14 KB, all of them 230 MB. Of more patches those next to each other share one.
const MOST: usize = 1 << 14;

/// A guiding density for every patch that rays went on from, or for so many of them next to each other.
pub(crate) struct PatchGuiding {
    /// Length of the brightest light.
    brightest: f64,
    /// Patches that share a density.
    each: usize,
    places: Vec<OnceLock<Box<GuidedPlace>>>,
}

impl PatchGuiding {
    /// No densities yet; no light is much brighter than `brightest`.
    pub fn new(patches: usize, brightest: f64) -> PatchGuiding {
        let brightest = brightest.max(f64::from(f32::MIN_POSITIVE));
        let each = patches.div_ceil(MOST).max(1);
        PatchGuiding { brightest, each, places: (0..patches.div_ceil(each)).map(|_| OnceLock::new()).collect() }
    }

    /// The density of a patch, and where its rays are recorded.
    #[inline]
    pub fn of(&self, patch: u32) -> Guiding<'_> {
        let place = &self.places[patch as usize / self.each];
        place.get_or_init(|| Box::new(GuidedPlace::none(self.brightest))).guiding()
    }

    /// Makes densities anew from what rays have found, where those have become more.
    pub fn update(&mut self) {
        self.places.par_iter_mut().filter_map(OnceLock::get_mut).for_each(|place| place.update());
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::gather::continuation::Continuation;
    use crate::gather::fields::Fields;
    use crate::gather::reading::Reading;
    use crate::gather::reflection::{Memory, Walker};
    use crate::gather::view::Ready;
    use crate::light::{Mode, Rgb};
    use crate::rays::Ray;
    use crate::rays::sobol::{Stream, hash};
    use crate::rays::warp::cosine_direction;

    /// Mean and variance of what rays find.
    struct Found {
        mean: f64,
        variance: f64,
    }

    impl Found {
        fn of(samples: impl Iterator<Item = f64>) -> Found {
            let (count, sum, squares) = samples.fold((0.0, 0.0, 0.0), |(n, s, q), x| (n + 1.0, s + x, q + x * x));
            let mean = sum / count;
            Found { mean, variance: squares / count - mean * mean }
        }
    }

    /// There was one for every patch, 14 KB each, which no estimate of memory counted.
    #[test]
    fn many_patches_share_densities() {
        let densities = |patches: usize| {
            let guiding = PatchGuiding::new(patches, 1.0);
            (0..patches as u32).for_each(|patch| _ = guiding.of(patch));
            guiding.places.iter().filter(|place| place.get().is_some()).count()
        };
        assert_eq!([1, MOST, MOST + 1].map(densities), [1, MOST, MOST.div_ceil(2) + 1]);
    }

    /// One patch of a closed room is bright, and rays go on once before they read. What those before them found makes
    /// the noise less and leaves the mean.
    #[test]
    fn rays_that_went_on_tell_the_next_ones_where_to_look() {
        const RAYS: usize = 40_000;
        let ready = Ready::new("furnace", Mode::Global.transport(), 24);
        let view = ready.view(1, 1);
        let patches = view.patches;
        let bright = |i: usize| Rgb::splat(f32::from(u8::from(i == 0)));
        let fields = Fields::new(&[(0..patches.len()).map(bright).collect()]);
        let fields = fields.read_by(Reading::AfterOneMore);
        let continuation = Continuation { walker: Walker::new(&view), fields: &fields };
        let (mut memory, mut random) = (Memory::default(), Stream::new(7));
        let from = patches.point(13, 0.3, 0.6);
        let mut found = |onward: Option<&PatchGuiding>| {
            Found::of((0..RAYS).map(|i| {
                let direction = cosine_direction(from.normal, random.uniform(), random.uniform());
                let ray = Ray { origin: from.position, direction, source: Some(from.face) };
                continuation.read(&ray, onward, hash(i as u32, 7), &mut memory).light.x
            }))
        };
        let alone = found(None);
        let mut guiding = PatchGuiding::new(patches.len(), DVec3::ONE.length());
        let first = found(Some(&guiding));
        guiding.update();
        let guided = found(Some(&guiding));
        // Rays without a density are the same as without guiding, but for chance.
        for (what, of) in [("before", &first), ("guided", &guided)] {
            let bound = 4.0 * ((alone.variance + of.variance) / RAYS as f64).sqrt();
            assert!((of.mean - alone.mean).abs() < bound, "{what}: {} {}", of.mean, alone.mean);
        }
        assert!(guided.variance < 0.5 * alone.variance, "{} {}", guided.variance, alone.variance);
    }
}
