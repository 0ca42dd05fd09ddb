//! Light as emitted at one receiver, from many luminaires, by its patch's light cut.
//!
//! ```text
//! sum over what is surely seen + sum over closed forms + sum over nodes e of c_e F_e L_e
//!     + mean over draws of L A k(x, y) (T - c_e) / chance
//! ```
//!
//! with `c_e` the share of a node's light that is expected to arrive: where the guess is right nothing is left to
//! chance, and where it is wrong the draws make up for it. The first and third sum are one polynomial on a flat patch.
//!
//! Not handled: receivers off their patch; a luminaire by closed form whose shadows are too ragged costs one ray and
//! its ratio's bias, as elsewhere.

use glam::{DVec3, Vec2, Vec3};

use crate::direct::light_choice::{Choice, choose};
use crate::direct::light_cut::{LightCut, LightCuts, light};
use crate::direct::light_sampling::draw;
use crate::direct::luminaire::Luminaires;
use crate::direct::ratio_estimator::{DirectSum, Lamp, Scratch};
use crate::direct::shaft_culling::Between;
use crate::direct::visibility::Lighting;
use crate::rays::sobol::{fraction, hash};
use crate::surfaces::SurfacePoint;

impl LightCuts {
    /// How many luminaires to draw at a receiver on a patch.
    pub fn draws(&self, patch: u32) -> u32 {
        self.of(patch as usize).draws
    }

    /// `sum over luminaires of F_l L_l` at a receiver on a patch, and the rays cast; points of the unit square choose
    /// what is drawn.
    pub fn gather(
        &self,
        lighting: &Lighting,
        receiver: &SurfacePoint,
        patch: u32,
        points: impl ExactSizeIterator<Item = Vec2>,
        scratch: &mut Scratch,
    ) -> (DVec3, u64) {
        let cut = self.of(patch as usize);
        let mut sum = self.seen(cut, lighting.luminaires, receiver);
        let mut cast = 0;
        for (l, faces) in &cut.exact {
            let between = if faces.is_empty() { Between::Nothing } else { Between::Faces(faces) };
            let lamp = Lamp { luminaire: &lighting.luminaires.list[*l as usize], between };
            let mut own = DirectSum::default();
            let point = std::iter::once(somewhere(receiver.position, *l));
            cast += lighting.gather_luminaire(lamp, receiver, DVec3::ONE, point, scratch, &mut own);
            sum += own.estimate() * lamp.luminaire.radiance.as_dvec3();
        }
        let share = 1.0 / points.len().max(1) as f64;
        for point in points {
            let Some(Choice { drawn: picked, chance, rest }) = choose(cut, &self.tree, receiver, point.x) else {
                break;
            };
            let at = Vec2::new(rest, point.y);
            if let Some(drawn) = draw(&self.tree, lighting.luminaires, picked.node, receiver, at) {
                let occlusion = &lighting.sight.occlusion;
                let arrived = occlusion.transmittance(lighting.rays, receiver.end(), drawn.end, scratch.hits());
                let beyond = f64::from(arrived) - picked.expected;
                sum += drawn.light * (beyond * share / chance);
                cast += 1;
            }
        }
        (sum, cast)
    }

    /// What is surely seen.
    fn seen(&self, cut: &LightCut, luminaires: &Luminaires, receiver: &SurfacePoint) -> DVec3 {
        let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        match &cut.smooth {
            Some(tiles) => tiles.at(x),
            None => light(&self.tree, luminaires, &cut.seen, x, n),
        }
    }
}

/// A point of the unit square that differs from receiver to receiver and from luminaire to luminaire.
pub(crate) fn somewhere(x: Vec3, luminaire: u32) -> Vec2 {
    let place = x.to_array().map(f32::to_bits);
    let seed = place.into_iter().fold(luminaire, |seed, bits| hash(bits, seed));
    Vec2::new(fraction(seed), fraction(hash(1, seed)))
}
