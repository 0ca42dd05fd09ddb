//! Direct light of all luminaires and punctual lights at receivers:
//!
//! * what every patch receives: [`Lights::receive`], the mean over receiver points of the patch;
//! * one sample at a point, without bias: [`Lights::sample`], which of more luminaires asks two, drawn by about what
//!   they send: a bathroom with eleven luminaires takes 0.7 of the time at 2 %;
//! * the mean over receivers of what they reflect: [`Lights::add`] and [`Lights::total`] with a [`LightSum`].
//!
//! Not handled: emitters that are no luminaires, whose light hemisphere rays sample.

use glam::{DVec3, Vec2};
use halflight_team::Loop;

use crate::direct::Lights;
use crate::direct::emitters::occlusion::Occlusion;
use crate::direct::emitters::shafts::Between;
use crate::direct::luminaire_light::{DirectSum, Scratch};
use crate::direct::many::light_cut::LightCuts;
use crate::direct::systematic::systematic;
use crate::form_factors::{Progress, Sampling};
use crate::light::Rgb;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Sobol, Stream, hash};
use crate::surfaces::SurfacePoint;

/// Receiver points that are enough where each is exact: the form factor varies smoothly over a patch.
const SMOOTH: u32 = 32;

/// Luminaires that one sample at a point asks.
const ASKED: usize = 2;

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
#[derive(Default)]
pub struct LightSum {
    /// Luminaires evaluated one by one.
    each: Vec<DirectSum>,
    /// All other light, emitter by emitter.
    others: Vec<DVec3>,
}

/// Which point of the unit square a receiver uses: number k of `of` for a luminaire.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// The luminaire, or 0 where the points are for all of them.
    pub luminaire: u32,
    /// Number of the point.
    pub k: u32,
    /// Points that no two receivers share.
    pub of: u32,
}

impl LightSum {
    /// Forgets all light; memory stays.
    pub fn clear(&mut self) {
        self.each.fill(DirectSum::default());
        self.others.fill(DVec3::ZERO);
    }

    /// Adds the light of other receivers.
    pub(crate) fn join(&mut self, other: &LightSum) {
        self.each.resize(self.each.len().max(other.each.len()), DirectSum::default());
        self.each.iter_mut().zip(&other.each).for_each(|(own, other)| own.join(other));
        self.others.resize(self.others.len().max(other.others.len()), DVec3::ZERO);
        self.others.iter_mut().zip(&other.others).for_each(|(own, other)| *own += *other);
    }

    /// Adds other light of an emitter.
    pub fn add(&mut self, emitter: usize, light: DVec3) {
        if self.others.len() <= emitter {
            self.others.resize(emitter + 1, DVec3::ZERO);
        }
        self.others[emitter] += light;
    }
}

impl Lights {
    /// Light at a receiver on a patch, `sum of F_l E_l` and irradiance over pi from punctual lights, W/(m² sr): one
    /// sample without bias.
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
        self.gather_punctual(receiver, scratch, &mut each);
        if !self.cuts.is_empty() {
            for cuts in &self.cuts {
                each(cuts.emitter, cuts.sample(self, receiver, patch, random, scratch));
            }
            return;
        }
        let list = &self.luminaires.list;
        if list.len() <= ASKED {
            for (l, luminaire) in list.iter().enumerate() {
                let light = self.sample_luminaire(self.seen_luminaire(l, patch), receiver, random, scratch);
                each(luminaire.emitter, light);
            }
            return;
        }
        // Of more a few are asked, in proportion to what they send with nothing between.
        let about = list.iter().map(|luminaire| f64::from(luminaire.roughly(receiver.position, receiver.normal)));
        for (l, weight) in systematic(about, ASKED, 1.0 - f64::from(random.uniform())) {
            let light = self.sample_luminaire(self.seen_luminaire(l, patch), receiver, random, scratch);
            each(list[l].emitter, weight * light);
        }
    }

    /// Adds the light at a receiver on a patch, weighted per channel, with `rays` visibility rays for a luminaire whose
    /// visible part is not known, by its number; `point` are the points of the unit square for sampling.
    pub fn add(
        &self,
        sum: &mut LightSum,
        (receiver, patch, weight): (&SurfacePoint, u32, DVec3),
        rays: impl Fn(usize) -> u32,
        point: impl Fn(Choice) -> Vec2,
        scratch: &mut Scratch,
    ) {
        self.gather_punctual(receiver, scratch, |emitter, light| sum.add(emitter, weight * light));
        if !self.cuts.is_empty() {
            // Blocks of one length for all patches, so that two of them in a pixel share no points.
            let rays = rays(0);
            let of = self.points(rays);
            for (luminaire, cuts) in (0..).zip(&self.cuts) {
                let drawn = 0..(rays * cuts.draws(patch)) as usize;
                let drawn = drawn.map(|k| point(Choice { luminaire, k: k as u32, of }));
                sum.add(cuts.emitter, weight * cuts.gather(self, receiver, patch, drawn, scratch));
            }
            return;
        }
        sum.each.resize(self.luminaires.list.len(), DirectSum::default());
        for (l, own) in sum.each.iter_mut().enumerate() {
            let of = rays(l);
            let drawn = (0..of as usize).map(|k| point(Choice { luminaire: l as u32, k: k as u32, of }));
            self.gather_luminaire(self.seen_luminaire(l, patch), receiver, weight, drawn, scratch, own);
        }
    }

    /// Calls `each` with the luminaires of which a part was hidden from the receivers.
    pub fn partly_hidden(&self, sum: &LightSum, mut each: impl FnMut(usize)) {
        sum.each.iter().enumerate().filter(|(_, own)| own.is_partly_hidden()).for_each(|(l, _)| each(l));
    }

    /// All light that was added, summed over the receivers.
    pub fn total(&self, sum: &LightSum) -> DVec3 {
        let luminaires = self.luminaires.list.iter().zip(&sum.each);
        let each = luminaires.map(|(l, sum)| sum.estimate() * l.radiance.as_dvec3());
        each.sum::<DVec3>() + sum.others.iter().sum::<DVec3>()
    }

    /// Calls `each` with the emitters' parts of it.
    pub fn by_emitter(&self, sum: &LightSum, mut each: impl FnMut(usize, DVec3)) {
        let luminaires = self.luminaires.list.iter().zip(&sum.each);
        luminaires.for_each(|(l, sum)| each(l.emitter, sum.estimate() * l.radiance.as_dvec3()));
        sum.others.iter().enumerate().for_each(|(emitter, light)| each(emitter, *light));
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
        let most = match self.cuts.is_empty() {
            true => rays.max(1),
            false => rays.clamp(1, SMOOTH) * rays.div_ceil(SMOOTH).next_power_of_two() * LightCuts::MOST_DRAWN,
        };
        let sobol = Sobol::new(most as usize, 4);
        let points = ReceiverPoints { lights: self, sobol, rays, seed: Purpose::Received.seed(sampling.seed) };
        self.for_all(|scratch, i, sums| {
            tick(1);
            if !receives[i] {
                return;
            }
            if self.cuts.is_empty() {
                return points.one_by_one(i, scratch, sums);
            }
            for (number, cuts) in (0..).zip(&self.cuts) {
                sums[cuts.emitter] += points.by_cut((number, cuts), i, scratch);
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
    /// Number k of patch i.
    fn point(&self, i: usize, k: u32, seed: u32) -> SurfacePoint {
        self.lights.patches.point(i, self.sobol.point(k, 0, seed), self.sobol.point(k, 1, seed))
    }

    /// Adds what patch i receives from punctual lights.
    fn by_punctual(&self, i: usize, scratch: &mut Scratch, sums: &mut [DVec3]) {
        let seed = hash(i as u32, self.seed);
        for k in 0..self.rays {
            let add = |emitter: usize, light: DVec3| sums[emitter] += light / f64::from(self.rays);
            self.lights.gather_punctual(&self.point(i, k, seed), scratch, add);
        }
    }

    /// Adds what patch i receives from luminaires evaluated one by one.
    fn one_by_one(&self, i: usize, scratch: &mut Scratch, sums: &mut [DVec3]) {
        let count = self.lights.luminaires.list.len();
        for l in 0..count {
            let seen = self.lights.seen_luminaire(l, i as u32);
            let is_known = !matches!(seen.between, Between::Unknown);
            let exact = is_known || self.lights.occlusion == Occlusion::Nothing;
            let most = if exact { SMOOTH } else { u32::MAX };
            let receivers = self.rays.min(most).max(1);
            let seed = hash((i * count + l) as u32, self.seed);
            let mut sum = DirectSum::default();
            for k in 0..receivers {
                let draw = std::iter::once(Vec2::from([2, 3].map(|d| self.sobol.point(k, d, seed))));
                let receiver = self.point(i, k, seed);
                self.lights.gather_luminaire(seen, &receiver, DVec3::ONE, draw, scratch, &mut sum);
            }
            let received = sum.estimate() / f64::from(receivers) * seen.luminaire.radiance.as_dvec3();
            sums[seen.luminaire.emitter] += received;
        }
    }

    /// What patch i receives through its light cut number k: points are drawn on luminaires in proportion to the rays
    /// of a patch, however many luminaires there are.
    fn by_cut(&self, (number, cuts): (u32, &LightCuts), i: usize, scratch: &mut Scratch) -> DVec3 {
        let receivers = self.rays.clamp(1, SMOOTH);
        let draws = self.rays.div_ceil(SMOOTH).next_power_of_two() * cuts.draws(i as u32);
        let seed = hash(i as u32, if number == 0 { self.seed } else { hash(number, self.seed) });
        let mut received = DVec3::ZERO;
        for k in 0..receivers {
            let draw = |j: usize| Vec2::from([2, 3].map(|d| self.sobol.point(k * draws + j as u32, d, seed)));
            let drawn = (0..draws as usize).map(draw);
            let light = cuts.gather(self.lights, &self.point(i, k, seed), i as u32, drawn, scratch);
            received += light / f64::from(receivers);
        }
        received
    }
}
