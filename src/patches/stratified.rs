//! Patches with spots: where a spot cuts one, points are drawn in each of its strata ([`crate::patches::spots`]).
//!
//! Not handled: patches divided by light, which leave those whole that spots cut.

use rustc_hash::FxHashMap;

use crate::patches::scene_patches::Patches;
use crate::patches::spots::{Spot, Spots, Stratum};
use crate::scene::Bounds;
use crate::surfaces::SurfacePoint;

impl Patches {
    /// The spots that are known.
    pub(crate) fn spots(&self) -> &[Spot] {
        &self.spots.list
    }

    /// The strata of a patch that spots cut; none where none does.
    pub(crate) fn strata(&self, i: usize) -> &[Stratum] {
        self.spots.strata.get(&(i as u32)).map_or(&[], |own| own)
    }

    /// The patches that spots cut, with their strata.
    pub(crate) fn all_strata(&self) -> impl Iterator<Item = (usize, &[Stratum])> {
        self.spots.strata.iter().map(|(i, own)| (*i as usize, &own[..]))
    }

    /// The point of a stratum of patch i at (u, v) in the unit square, uniform in area.
    pub(crate) fn stratum_point(&self, i: usize, stratum: &Stratum, u: f32, v: f32) -> SurfacePoint {
        let (position, face) = stratum.point(u, v);
        SurfacePoint { position, normal: self.normal(face, self.side(i)), face }
    }

    /// These patches, which nothing has divided, with more spots.
    pub(crate) fn with_spots(mut self, spots: &[Spot]) -> Patches {
        if spots.is_empty() {
            return self;
        }
        let mut list = std::mem::take(&mut self.spots.list);
        list.extend(spots);
        let cut = |i: usize| {
            let around = Bounds::of(self.pieces(i).flat_map(|(_, corners)| corners));
            let met: Vec<&Spot> = list.iter().filter(|spot| spot.meets(&around)).collect();
            let strata = if met.is_empty() { Vec::new() } else { Stratum::of(self.pieces(i), &met) };
            (!strata.is_empty()).then_some((i as u32, strata))
        };
        let strata: FxHashMap<u32, Vec<Stratum>> = (0..self.len()).filter_map(cut).collect();
        self.spots = Spots { list, strata };
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Rays;
    use crate::scene::Scene;

    /// Strata of a patch that a box cuts add up to it, and their points lie where they do.
    #[test]
    fn strata_cover_a_patch_once() {
        let scene = Scene::open("furnace").expect("a scene");
        let patches = Patches::new(&scene, &Rays::new(&scene), 24);
        let middle = patches.middle(3);
        let half = 0.1 * patches.extent(3).width;
        let spot = Bounds { low: middle - half, high: middle + half };
        let patches = patches.with_spots(&[spot]);
        let cut: Vec<usize> = (0..patches.len()).filter(|&i| !patches.strata(i).is_empty()).collect();
        assert_eq!((cut, patches.spots().len()), (vec![3], 1));
        let [inside, outside] = patches.strata(3) else { panic!("a spot and the rest") };
        // Sides in single precision.
        let share = f64::from(2.0 * half).powi(2) / patches.areas()[3];
        assert!((inside.share / share - 1.0).abs() < 1e-4, "{} {share}", inside.share);
        assert!((inside.share + outside.share - 1.0).abs() < 1e-6);
        let lies = |stratum: &Stratum, k: u32| {
            let at = |d: u32| (crate::rays::sobol::hash(k, d) >> 8) as f32 / (1 << 24) as f32;
            let point = patches.stratum_point(3, stratum, at(0), at(1));
            let away = (point.position - middle).abs();
            assert_eq!(patches.at(point.face, patches.side(3), point.position), Some(3));
            away.max_element() <= 1.0001 * half
        };
        assert!((0..100).all(|k| lies(inside, k)) && !(0..100).any(|k| lies(outside, k)));
    }
}
