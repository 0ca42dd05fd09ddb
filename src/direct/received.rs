//! Direct light of all luminaires and punctual lights at receivers:
//!
//! * what every patch receives: [`Lights::receive`], the mean over receiver points of the patch;
//! * one sample at a point, without bias: [`Lights::sample`];
//! * the sum over receivers of what they reflect: [`Lights::add`] with a [`LightSum`].
//!
//! Not handled: emitters that are no luminaires, whose light hemisphere rays sample.

use glam::{DVec3, Vec2};
use halflight_team::Loop;

use crate::direct::agreement::Agreement;
use crate::direct::drawn_light::{Lit, Scratch};
use crate::direct::emitters::occlusion::Occlusion;
use crate::direct::lights::{Cuts, Lights};
use crate::direct::many::light_cut::MOST_DRAWN;
use crate::form_factors::{Progress, Sampling};
use crate::light::Rgb;
use crate::patches::spots::Stratum;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Sobol, Stream, hash};
use crate::surfaces::SurfacePoint;

/// Receiver points that are enough where each is exact: the form factor varies smoothly over a patch.
const SMOOTH: u32 = 32;

/// Of so many draws at a receiver of a picture a receiver of a patch takes one: there are many of them, and the light
/// of all is one number.
const SPARED: u32 = 4;

/// What patches receive as emitted.
pub struct Received {
    /// `sum over luminaires of F_il E_l` for every patch that receives, W/(m² sr).
    pub luminaires: Vec<Rgb>,
    /// Irradiance over pi from punctual lights, W/(m² sr); empty where there are none.
    pub punctual: Vec<Rgb>,
    /// All of both, emitter by emitter; empty where they are not kept apart.
    pub emitters: Vec<Vec<Rgb>>,
    /// Rays cast.
    pub rays: u64,
}

/// Light of all luminaires and punctual lights summed over receivers, each weighted per channel (by rho, say).
#[derive(Clone, Default)]
pub struct LightSum {
    /// Emitter by emitter.
    emitters: Vec<DVec3>,
    /// What visibility rays to luminaires found.
    agreement: Agreement,
}

/// Which point of the unit square a receiver uses: number k of `of` for a tree of luminaires.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// The number of the tree.
    pub tree: u32,
    /// Number of the point.
    pub k: u32,
    /// Points that no two receivers share.
    pub of: u32,
}

impl LightSum {
    /// Forgets all light; memory stays.
    pub fn clear(&mut self) {
        self.emitters.fill(DVec3::ZERO);
        self.agreement = Agreement::default();
    }

    /// Adds the light of other receivers, and what their rays found.
    pub(crate) fn join(&mut self, other: &LightSum) {
        self.join_weighted(DVec3::ONE, other);
    }

    /// The same, the light times a weight per channel.
    pub(crate) fn join_weighted(&mut self, weight: DVec3, other: &LightSum) {
        self.add_weighted(weight, other);
        self.agreement.join(&other.agreement);
    }

    /// Adds light of other receivers times a weight per channel, without what rays found.
    pub(crate) fn add_weighted(&mut self, weight: DVec3, other: &LightSum) {
        other.by_emitter(|emitter, light| self.add(emitter, weight * light));
    }

    /// Adds light of an emitter.
    pub fn add(&mut self, emitter: usize, light: DVec3) {
        if self.emitters.len() <= emitter {
            self.emitters.resize(emitter + 1, DVec3::ZERO);
        }
        self.emitters[emitter] += light;
    }

    /// All light that was added.
    pub fn total(&self) -> DVec3 {
        self.emitters.iter().sum()
    }

    /// Calls `each` with the emitters' parts of it.
    pub fn by_emitter(&self, mut each: impl FnMut(usize, DVec3)) {
        self.emitters.iter().enumerate().for_each(|(emitter, light)| each(emitter, *light));
    }

    /// What visibility rays to luminaires found.
    pub(crate) fn agreement(&self) -> &Agreement {
        &self.agreement
    }
}

impl Lights {
    /// Light at a receiver on a patch, `sum of F_l E_l` and irradiance over pi from punctual lights, W/(m² sr): one
    /// sample without bias. Patches cut by spots are lamps: of what they get nothing is told, of what they reflect a
    /// sample at the receiver.
    pub fn sample(&self, receiver: &SurfacePoint, patch: u32, random: &mut Stream, scratch: &mut Scratch) -> DVec3 {
        let mut sum = DVec3::ZERO;
        self.sample_each((receiver, patch), random, scratch, |_, light| sum += light);
        sum
    }

    /// Calls `each` with the emitters' parts of such a sample.
    pub fn sample_each(
        &self,
        (receiver, patch): (&SurfacePoint, u32),
        random: &mut Stream,
        scratch: &mut Scratch,
        mut each: impl FnMut(usize, DVec3),
    ) {
        self.sample_strata(receiver, random, scratch, &mut each);
        if self.patches.strata(patch as usize).is_empty() {
            self.sample_at((receiver, patch), random, scratch, each);
        }
    }

    /// Calls `each` with the emitters' parts of a sample of what they send to a receiver on a patch.
    pub(crate) fn sample_at(
        &self,
        (receiver, patch): (&SurfacePoint, u32),
        random: &mut Stream,
        scratch: &mut Scratch,
        mut each: impl FnMut(usize, DVec3),
    ) {
        self.gather_punctual(receiver, scratch, &mut each);
        for lit in self.lit(receiver, self.cuts(patch)) {
            each(lit.tree.emitter, lit.sample(random, scratch));
        }
    }

    /// A receiver with each tree of luminaires and the cut through it.
    fn lit<'a>(&'a self, receiver: &'a SurfacePoint, Cuts(cuts): Cuts<'a>) -> impl Iterator<Item = Lit<'a>> {
        self.trees.iter().zip(cuts).map(move |(tree, cut)| Lit { lights: self, tree, cut, receiver })
    }

    /// Adds the light at a receiver, weighted per channel, with `rays` visibility rays for each point that its cuts
    /// draw; `point` are the points of the unit square for sampling.
    pub fn add(
        &self,
        sum: &mut LightSum,
        (receiver, cuts, weight): (&SurfacePoint, Cuts, DVec3),
        rays: u32,
        point: impl Fn(Choice) -> Vec2,
        scratch: &mut Scratch,
    ) {
        self.gather_punctual(receiver, scratch, |emitter, light| sum.add(emitter, weight * light));
        // Blocks of one length for all patches, so that two of them in a pixel share no points.
        let of = self.points(rays);
        for (tree, lit) in (0..).zip(self.lit(receiver, cuts)) {
            let drawn = 0..(rays * lit.cut.draws) as usize;
            let drawn = drawn.map(|k| point(Choice { tree, k: k as u32, of }));
            let light = lit.gather(drawn, scratch, &mut sum.agreement);
            sum.add(lit.tree.emitter, weight * light);
        }
    }

    /// What every patch that `receives` gets from luminaires and from punctual lights; `tick` counts patches.
    pub fn receive(&self, receives: &[bool], sampling: &Sampling, tick: Progress) -> Received {
        let luminaires = self.emitted(receives, sampling, tick);
        let punctual = self.punctual(receives, sampling);
        let of = |all: &PatchSums, e: usize, i: usize| all.emitters.get(e).map_or(Rgb::ZERO, |own| own[i]);
        let count = self.emitters().names().len();
        let both = |e: usize| (0..self.patches.len()).map(|i| of(&luminaires, e, i) + of(&punctual, e, i)).collect();
        Received {
            emitters: (0..count).map(both).collect(),
            luminaires: luminaires.total,
            punctual: punctual.total,
            rays: luminaires.rays + punctual.rays,
        }
    }

    /// `sum over luminaires of F_il E_l` for every patch that `receives`, W/(m² sr); and how many rays were cast.
    pub fn receive_emitted(&self, receives: &[bool], sampling: &Sampling, tick: Progress) -> (Vec<Rgb>, u64) {
        let PatchSums { total, rays, .. } = self.emitted(receives, sampling, tick);
        (total, rays)
    }

    /// Irradiance over pi from punctual lights for every patch that `receives`, W/(m² sr), nothing at all where
    /// there are none; and how many rays were cast.
    pub fn receive_punctual(&self, receives: &[bool], sampling: &Sampling) -> (Vec<Rgb>, u64) {
        let PatchSums { total, rays, .. } = self.punctual(receives, sampling);
        (total, rays)
    }

    /// What luminaires send to every patch that `receives`.
    fn emitted(&self, receives: &[bool], sampling: &Sampling, tick: Progress) -> PatchSums {
        let rays = sampling.emitter_rays;
        let most = rays.clamp(1, SMOOTH) * rays.div_ceil(SMOOTH).next_power_of_two() * MOST_DRAWN;
        let sobol = Sobol::new(most as usize, 4);
        let points = ReceiverPoints { lights: self, sobol, rays, seed: Purpose::Received.seed(sampling.seed) };
        self.for_all(|scratch, i, sums| {
            tick(1);
            if receives[i] {
                points.by_cuts(i, scratch, sums);
            }
        })
    }

    /// What punctual lights send to every patch that `receives`; nothing at all where there are none.
    fn punctual(&self, receives: &[bool], sampling: &Sampling) -> PatchSums {
        if self.luminaires.punctual.is_empty() {
            return PatchSums::default();
        }
        let most = if self.punctual == Occlusion::Nothing { SMOOTH } else { u32::MAX };
        let rays = sampling.emitter_rays.clamp(1, most);
        let sobol = Sobol::new(rays as usize, 2);
        let points =
            ReceiverPoints { lights: self, sobol, rays, seed: Purpose::ReceivedFromPoints.seed(sampling.seed) };
        self.for_all(|scratch, i, sums| {
            if receives[i] {
                points.by_punctual(i, scratch, sums);
            }
        })
    }

    /// What every patch receives, added to the sums of the emitters.
    fn for_all(&self, receive: impl Fn(&mut Scratch, usize, &mut [DVec3]) + Sync + Send) -> PatchSums {
        let (count, is_apart) = (self.emitters().count(), self.emitters().are_apart());
        let one = |(scratch, sums): &mut (Scratch, Vec<DVec3>), i: usize| {
            let before = scratch.cast;
            sums.fill(DVec3::ZERO);
            receive(scratch, i, sums);
            let apart: Vec<Rgb> = if is_apart { sums.iter().map(|s| s.as_vec3()).collect() } else { Vec::new() };
            (sums.iter().sum::<DVec3>().as_vec3(), apart, scratch.cast - before)
        };
        let memory = || (Scratch::default(), vec![DVec3::ZERO; count]);
        let all: Vec<(Rgb, Vec<Rgb>, u64)> = Loop::each(self.patches.len()).map_init(memory, one);
        PatchSums {
            total: all.iter().map(|own| own.0).collect(),
            emitters: (0..self.emitters().names().len()).map(|e| all.iter().map(|own| own.1[e]).collect()).collect(),
            rays: all.iter().map(|own| own.2).sum(),
        }
    }
}

/// Light that patches receive, W/(m² sr).
#[derive(Default)]
struct PatchSums {
    total: Vec<Rgb>,
    /// Emitter by emitter, where they are kept apart.
    emitters: Vec<Vec<Rgb>>,
    /// Rays cast.
    rays: u64,
}

/// Where patches receive.
struct ReceiverPoints<'a> {
    lights: &'a Lights,
    sobol: Sobol,
    /// Receiver points a patch and luminaire at most, each with one ray.
    rays: u32,
    seed: u32,
}

impl ReceiverPoints<'_> {
    /// Number k of patch i, or of its part.
    fn point(&self, (i, stratum): (usize, Option<&Stratum>), k: u32, seed: u32) -> SurfacePoint {
        let [u, v] = [0, 1].map(|d| self.sobol.point(k, d, seed));
        let patches = &self.lights.patches;
        stratum.map_or_else(|| patches.point(i, u, v), |own| patches.stratum_point(i, own, u, v))
    }

    /// Calls `add` with the strata of patch i and their shares of it, of all of it where it has none.
    fn by_strata(&self, i: usize, mut add: impl FnMut(Option<&Stratum>, f64)) {
        match self.lights.patches.strata(i) {
            [] => add(None, 1.0),
            strata => strata.iter().for_each(|own| add(Some(own), own.share)),
        }
    }

    /// Adds what patch i receives from punctual lights.
    fn by_punctual(&self, i: usize, scratch: &mut Scratch, sums: &mut [DVec3]) {
        let seed = hash(i as u32, self.seed);
        self.by_strata(i, |stratum, share| {
            let share = share / f64::from(self.rays);
            for k in 0..self.rays {
                let receiver = self.point((i, stratum), k, seed);
                self.lights.gather_punctual(&receiver, scratch, |emitter, light| sums[emitter] += share * light);
            }
        });
    }

    /// Adds what patch i receives through its light cuts: points are drawn on luminaires in proportion to the rays of a
    /// patch, however many luminaires there are.
    fn by_cuts(&self, i: usize, scratch: &mut Scratch, sums: &mut [DVec3]) {
        self.by_strata(i, |stratum, share| {
            let receivers = self.rays.clamp(1, SMOOTH);
            for k in 0..receivers {
                let receiver = self.point((i, stratum), k, hash(i as u32, self.seed));
                self.by_cuts_at(i, (k, &receiver), scratch, |emitter, light| {
                    sums[emitter] += share / f64::from(receivers) * light;
                });
            }
        });
    }

    /// Calls `add` with the emitters' light at receiver number k of patch i.
    fn by_cuts_at(
        &self,
        i: usize,
        (k, receiver): (u32, &SurfacePoint),
        scratch: &mut Scratch,
        mut add: impl FnMut(usize, DVec3),
    ) {
        let times = self.rays.div_ceil(SMOOTH).next_power_of_two();
        for (number, lit) in (0..).zip(self.lights.lit(receiver, self.lights.cuts(i as u32))) {
            let draws = (times * lit.cut.draws).div_ceil(SPARED);
            let seed = hash(i as u32, if number == 0 { self.seed } else { hash(number, self.seed) });
            let draw = |j: usize| Vec2::from([2, 3].map(|d| self.sobol.point(k * draws + j as u32, d, seed)));
            let light = lit.gather((0..draws as usize).map(draw), scratch, &mut Agreement::default());
            add(lit.tree.emitter, light);
        }
    }
}
