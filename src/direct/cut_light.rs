//! Light as emitted at one receiver, from many luminaires, by its patch's links.
//!
//! ```text
//! sum over what is surely seen + sum over closed forms + sum over nodes e of c_e F_e L_e
//!     + mean over draws of L A k(x, y) (T - c_e) / chance
//! ```
//!
//! with `c_e` the share of a node's light that is expected to arrive: where the guess is right nothing is left to chance,
//! and where it is wrong the draws make up for it. The first and third sum are one polynomial on a flat patch.
//!
//! Not handled: receivers off their patch; a luminaire by closed form whose shadows are too ragged costs one ray and its
//! ratio's bias, as without links.

use glam::{DVec3, Vec3};

use crate::direct::light_cut::{Chance, Link, Links, light};
use crate::direct::light_sampling::draw;
use crate::direct::luminaire::Luminaires;
use crate::direct::receive::{DirectSum, Receiver, Scratch, gather_luminaire};
use crate::direct::shaft_culling::Between;
use crate::direct::visibility::Sight;
use crate::rays::Rays;
use crate::rays::sobol::hash;

impl Links {
    /// How many luminaires to draw at a receiver on a patch.
    pub fn draws(&self, patch: u32) -> u32 {
        self.of(patch as usize).draws
    }

    /// `sum over luminaires of F_l L_l` at a receiver on a patch, and the rays cast; points (u, v) choose what is drawn.
    pub fn gather(
        &self,
        (receiver, patch): (&Receiver, u32),
        luminaires: &Luminaires,
        (rays, sight): (&Rays, &Sight),
        points: impl ExactSizeIterator<Item = (f32, f32)>,
        scratch: &mut Scratch,
    ) -> (DVec3, u64) {
        let link = self.of(patch as usize);
        let mut sum = self.seen(link, luminaires, receiver);
        let mut cast = 0;
        for (l, faces) in &link.exact {
            let between = match faces[..] {
                [] => Between::Nothing,
                _ => Between::Faces(faces),
            };
            let lamp = &luminaires.list[*l as usize];
            let mut own = DirectSum::default();
            let point = std::iter::once(somewhere(receiver.position, *l));
            let path = (rays, sight);
            let lamps = (lamp, between);
            cast += gather_luminaire(&mut own, DVec3::ONE, receiver, lamps, path, point, scratch);
            sum += own.estimate() * lamp.radiance.as_dvec3();
        }
        let share = 1.0 / points.len().max(1) as f64;
        for (u, v) in points {
            let Some((picked, chance, u)) = pick(link, u) else {
                break;
            };
            let (x, n) = (receiver.position, receiver.normal);
            if let Some(drawn) = draw(&self.lamps, luminaires, picked.node, (u, v), x, n) {
                let from = (x, Some(receiver.face));
                let to = (drawn.position, Some(drawn.face));
                let arrived = sight.occlusion.transmittance(rays, from, to, scratch.hits());
                let beyond = f64::from(arrived) - picked.expected;
                sum += drawn.light * (beyond * share / chance);
                cast += 1;
            }
        }
        (sum, cast)
    }

    /// What is surely seen.
    fn seen(&self, link: &Link, luminaires: &Luminaires, receiver: &Receiver) -> DVec3 {
        let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        if let Some(tiles) = &link.smooth {
            return tiles.at(x);
        }
        light((&self.lamps, luminaires), &link.seen, x, n)
    }
}

/// A point of the unit square that differs from receiver to receiver and from luminaire to luminaire.
fn somewhere(x: Vec3, luminaire: u32) -> (f32, f32) {
    let place = x.to_array().map(f32::to_bits);
    let seed = place.into_iter().fold(luminaire, |seed, bits| hash(bits, seed));
    let unit = |bits: u32| (bits >> 8) as f32 * (1.0 / 16_777_216.0);
    (unit(seed), unit(hash(1, seed)))
}

/// The node at u in the unit interval, its chance, and u within it.
fn pick(link: &Link, u: f32) -> Option<(Chance, f64, f32)> {
    let u = f64::from(u);
    let last = link.drawn.len().checked_sub(1)?;
    let k = link.drawn.partition_point(|d| d.until <= u).min(last);
    let before = if k == 0 { 0.0 } else { link.drawn[k - 1].until };
    let chance = link.drawn[k].until - before;
    let rest = ((u - before) / chance).clamp(0.0, 1.0);
    // Below 1, also once rounded: a luminaire of no power to speak of may be the last.
    Some((link.drawn[k], chance, (rest as f32).min(0.999_999_94)))
}
