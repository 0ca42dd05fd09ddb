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
//! What stands for many luminaires, moments of nodes and polynomials, is nearer the less is tolerable of a picture
//! ([`LightTree::new`](crate::direct::light_tree::LightTree::new)); paths that measure the error of a picture ask
//! without either ([`LightCuts::ask`]).
//!
//! Not handled: receivers off their patch; a luminaire by closed form whose shadows are too ragged costs one ray and
//! its ratio's bias, as elsewhere.

use glam::{DVec3, Vec2, Vec3};

use crate::direct::light_choice::{Choice, choose};
use crate::direct::light_cut::{LightCut, LightCuts, Seen, light};
use crate::direct::light_sampling::draw;
use crate::direct::luminaire::Luminaires;
use crate::direct::ratio_estimator::{DirectSum, Lamp, Scratch};
use crate::direct::resampled_light::Asking;
use crate::direct::shaft_culling::Between;
use crate::direct::visibility::Lighting;
use crate::rays::sobol::{Stream, fraction, hash};
use crate::surfaces::SurfacePoint;

/// Luminaires drawn where one by one stands for all that is seen.
const WITNESSES: u32 = 4;

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
        for lamp in lamps(cut, lighting.luminaires) {
            let mut own = DirectSum::default();
            let point = std::iter::once(somewhere(receiver.position, lamp.number));
            let Numbered { lamp, .. } = lamp;
            cast += lighting.gather_luminaire(lamp, receiver, DVec3::ONE, point, scratch, &mut own);
            sum += own.estimate() * lamp.luminaire.radiance.as_dvec3();
        }
        let (drawn, more) = self.beyond(cut, lighting, receiver, points, scratch);
        (sum + drawn, cast + more)
    }

    /// The same without bias, by luminaires drawn one by one where nodes or a polynomial would stand for many: the
    /// witness to those.
    pub fn ask(&self, lighting: &Lighting, receiver: &SurfacePoint, patch: u32, mut asking: Asking) -> DVec3 {
        let cut = self.of(patch as usize);
        let mut sum = self.one_by_one(cut, lighting.luminaires, receiver, asking.random);
        for Numbered { lamp, .. } in lamps(cut, lighting.luminaires) {
            sum += lighting.ask_luminaire(lamp, receiver, &mut asking);
        }
        let Asking { random, scratch, cast } = asking;
        let points: Vec<Vec2> = (0..cut.draws).map(|_| Vec2::new(random.uniform(), random.uniform())).collect();
        let (drawn, more) = self.beyond(cut, lighting, receiver, points.into_iter(), scratch);
        *cast += more;
        sum + drawn
    }

    /// What is drawn of the luminaires left to chance, beyond what is expected of them; and the rays cast.
    fn beyond(
        &self,
        cut: &LightCut,
        lighting: &Lighting,
        receiver: &SurfacePoint,
        points: impl ExactSizeIterator<Item = Vec2>,
        scratch: &mut Scratch,
    ) -> (DVec3, u64) {
        let (mut sum, mut cast) = (DVec3::ZERO, 0);
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

    /// What is surely seen and likely arrives, by closed forms of luminaires drawn from its nodes: of the nodes by
    /// their parts of the patch's light, well spread, and within each by power.
    fn one_by_one(
        &self,
        cut: &LightCut,
        luminaires: &Luminaires,
        receiver: &SurfacePoint,
        random: &mut Stream,
    ) -> DVec3 {
        if cut.seen.is_empty() {
            return DVec3::ZERO;
        }
        let first = f64::from(random.uniform());
        let one = |k: u32| {
            let u = (first + f64::from(k)) / f64::from(WITNESSES);
            let i = cut.seen.partition_point(|seen| seen.until <= u).min(cut.seen.len() - 1);
            let Seen { node, share, until } = cut.seen[i];
            let chance = until - if i == 0 { 0.0 } else { cut.seen[i - 1].until };
            let (l, of_node, _) = self.tree.draw(&self.tree.nodes[node].range, f64::from(random.uniform()));
            let (luminaire, x, n) = (&luminaires.list[l as usize], receiver.position, receiver.normal);
            let light = luminaire.light(x, n, luminaire.exact_form(x, n)) * luminaire.radiance.as_dvec3();
            light * (share / (chance * of_node * f64::from(WITNESSES)))
        };
        (0..WITNESSES).map(one).sum()
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

/// A luminaire that keeps its closed form, with its number.
struct Numbered<'a> {
    number: u32,
    lamp: Lamp<'a>,
}

/// The luminaires of a cut that keep their closed form.
fn lamps<'a>(cut: &'a LightCut, luminaires: &'a Luminaires) -> impl Iterator<Item = Numbered<'a>> {
    cut.exact.iter().map(|(number, faces)| {
        let between = if faces.is_empty() { Between::Nothing } else { Between::Faces(faces) };
        Numbered { number: *number, lamp: Lamp { luminaire: &luminaires.list[*number as usize], between } }
    })
}

/// A point of the unit square that differs from receiver to receiver and from luminaire to luminaire.
pub(crate) fn somewhere(x: Vec3, luminaire: u32) -> Vec2 {
    let place = x.to_array().map(f32::to_bits);
    let seed = place.into_iter().fold(luminaire, |seed, bits| hash(bits, seed));
    Vec2::new(fraction(seed), fraction(hash(1, seed)))
}
