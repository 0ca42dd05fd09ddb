//! Direct light of all lights at receivers:
//!
//! * what every patch receives: [`Lights::receive`], the mean over receiver points of the patch;
//! * one sample at a point, without bias: [`Lights::sample`];
//! * the mean over receivers of what they reflect: [`Lights::add`] and [`Lights::total`] with a [`LightSum`].
//!
//! Not handled: emitters that are no luminaires, whose light hemisphere rays sample.

use glam::{DVec3, Vec2};
use rayon::prelude::*;

use crate::direct::Lights;
use crate::direct::emitters::occlusion::Occlusion;
use crate::direct::emitters::shafts::Between;
use crate::direct::luminaire_light::{DirectSum, Scratch};
use crate::direct::many::light_cut::LightCuts;
use crate::form_factors::{Progress, Sampling};
use crate::light::Rgb;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Sobol, Stream, hash};
use crate::surfaces::SurfacePoint;

/// Receiver points that are enough where each is exact: the form factor varies smoothly over a patch.
const SMOOTH: u32 = 32;

/// What patches receive as emitted.
pub struct Received {
    /// `sum over luminaires of F_il E_l` for every patch that receives, W/(m² sr).
    pub luminaires: Vec<Rgb>,
    /// Irradiance over pi from lights without area, W/(m² sr); empty where there are none.
    pub punctual: Vec<Rgb>,
    /// Rays cast.
    pub rays: u64,
}

/// Light of all lights summed over receivers, each weighted per channel (by rho, say).
#[derive(Default)]
pub struct LightSum {
    /// Luminaires evaluated one by one.
    each: Vec<DirectSum>,
    /// All other light.
    others: DVec3,
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
        self.others = DVec3::ZERO;
    }

    /// Adds the light of other receivers.
    pub(crate) fn join(&mut self, other: &LightSum) {
        self.each.resize(self.each.len().max(other.each.len()), DirectSum::default());
        self.each.iter_mut().zip(&other.each).for_each(|(own, other)| own.join(other));
        self.others += other.others;
    }

    /// Adds light of another source.
    pub fn add(&mut self, light: DVec3) {
        self.others += light;
    }
}

impl Lights {
    /// Light at a receiver on a patch, `sum of F_l E_l` and irradiance over pi from lights without area, W/(m² sr): one
    /// sample without bias.
    pub fn sample(&self, receiver: &SurfacePoint, patch: u32, random: &mut Stream, scratch: &mut Scratch) -> DVec3 {
        let mut sum = self.gather_punctual(receiver, scratch);
        if let Some(cuts) = &self.cuts {
            return sum + cuts.sample(self, receiver, patch, random, scratch);
        }
        for l in 0..self.luminaires.list.len() {
            sum += self.sample_luminaire(self.lamp(l, patch), receiver, random, scratch);
        }
        sum
    }

    /// Adds the light at a receiver on a patch, weighted per channel, with `rays` visibility rays for each luminaire
    /// whose visible part is not known; `point` are the points of the unit square for sampling.
    pub fn add(
        &self,
        sum: &mut LightSum,
        (receiver, patch, weight): (&SurfacePoint, u32, DVec3),
        rays: u32,
        point: impl Fn(Choice) -> Vec2,
        scratch: &mut Scratch,
    ) {
        sum.others += weight * self.gather_punctual(receiver, scratch);
        if let Some(cuts) = &self.cuts {
            // Blocks of one length for all patches, so that two of them in a pixel share no points.
            let of = self.points(rays);
            let drawn = 0..(rays * cuts.draws(patch)) as usize;
            let drawn = drawn.map(|k| point(Choice { luminaire: 0, k: k as u32, of }));
            sum.others += weight * cuts.gather(self, receiver, patch, drawn, scratch);
            return;
        }
        sum.each.resize(self.luminaires.list.len(), DirectSum::default());
        for (l, own) in sum.each.iter_mut().enumerate() {
            let drawn = (0..rays as usize).map(|k| point(Choice { luminaire: l as u32, k: k as u32, of: rays }));
            self.gather_luminaire(self.lamp(l, patch), receiver, weight, drawn, scratch, own);
        }
    }

    /// All light that was added, summed over the receivers.
    pub fn total(&self, sum: &LightSum) -> DVec3 {
        let luminaires = self.luminaires.list.iter().zip(&sum.each);
        let each = luminaires.map(|(l, sum)| sum.estimate() * l.radiance.as_dvec3());
        each.sum::<DVec3>() + sum.others
    }

    /// What every patch that `receives` gets from luminaires and from lights without area; `tick` counts patches.
    pub fn receive(&self, receives: &[bool], sampling: &Sampling, tick: Progress) -> Received {
        let (luminaires, cast) = self.receive_emitted(receives, sampling, tick);
        let (punctual, more) = self.receive_punctual(receives, sampling);
        Received { luminaires, punctual, rays: cast + more }
    }

    /// `sum over luminaires of F_il E_l` for every patch that `receives`, W/(m² sr); and how many rays were cast.
    pub fn receive_emitted(&self, receives: &[bool], sampling: &Sampling, tick: Progress) -> (Vec<Rgb>, u64) {
        let rays = sampling.emitter_rays;
        let most = match self.cuts {
            Some(_) => rays.clamp(1, SMOOTH) * rays.div_ceil(SMOOTH).next_power_of_two() * LightCuts::MOST_DRAWN,
            None => rays.max(1),
        };
        let sobol = Sobol::new(most as usize, 4);
        let points = ReceiverPoints { lights: self, sobol, rays, seed: Purpose::Received.seed(sampling.seed) };
        let receive = |scratch: &mut Scratch, i: usize| {
            tick(1);
            match &self.cuts {
                _ if !receives[i] => DVec3::ZERO,
                Some(cuts) => points.by_cut(cuts, i, scratch),
                None => points.one_by_one(i, scratch),
            }
        };
        self.for_all(receive)
    }

    /// Irradiance over pi from lights without area for every patch that `receives`, W/(m² sr), nothing at all where
    /// there are no such lights; and how many rays were cast.
    pub fn receive_punctual(&self, receives: &[bool], sampling: &Sampling) -> (Vec<Rgb>, u64) {
        if self.luminaires.punctual.is_empty() {
            return (Vec::new(), 0);
        }
        let most = if self.punctual == Occlusion::Nothing { SMOOTH } else { u32::MAX };
        let rays = sampling.emitter_rays.clamp(1, most);
        let sobol = Sobol::new(rays as usize, 2);
        let points =
            ReceiverPoints { lights: self, sobol, rays, seed: Purpose::ReceivedFromPoints.seed(sampling.seed) };
        let receive = |scratch: &mut Scratch, i: usize| {
            if receives[i] { points.by_punctual(i, scratch) } else { DVec3::ZERO }
        };
        self.for_all(receive)
    }

    /// What every patch receives, and the sum of the rays.
    fn for_all(&self, receive: impl Fn(&mut Scratch, usize) -> DVec3 + Sync + Send) -> (Vec<Rgb>, u64) {
        let one = |scratch: &mut Scratch, i: usize| {
            let before = scratch.cast;
            (receive(scratch, i).as_vec3(), scratch.cast - before)
        };
        let received = (0..self.patches.len()).into_par_iter().map_init(Scratch::default, one);
        let (light, cast): (Vec<Rgb>, Vec<u64>) = received.unzip();
        (light, cast.iter().sum())
    }
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

    /// What patch i receives from lights without area.
    fn by_punctual(&self, i: usize, scratch: &mut Scratch) -> DVec3 {
        let seed = hash(i as u32, self.seed);
        let one = |k: u32| self.lights.gather_punctual(&self.point(i, k, seed), scratch) / f64::from(self.rays);
        (0..self.rays).map(one).sum()
    }

    /// What patch i receives from luminaires evaluated one by one.
    fn one_by_one(&self, i: usize, scratch: &mut Scratch) -> DVec3 {
        let count = self.lights.luminaires.list.len();
        let mut received = DVec3::ZERO;
        for l in 0..count {
            let lamp = self.lights.lamp(l, i as u32);
            let is_known = !matches!(lamp.between, Between::Unknown);
            let exact = is_known || self.lights.occlusion == Occlusion::Nothing;
            let most = if exact { SMOOTH } else { u32::MAX };
            let receivers = self.rays.min(most).max(1);
            let seed = hash((i * count + l) as u32, self.seed);
            let mut sum = DirectSum::default();
            for k in 0..receivers {
                let draw = std::iter::once(Vec2::from([2, 3].map(|d| self.sobol.point(k, d, seed))));
                let receiver = self.point(i, k, seed);
                self.lights.gather_luminaire(lamp, &receiver, DVec3::ONE, draw, scratch, &mut sum);
            }
            received += sum.estimate() / f64::from(receivers) * lamp.luminaire.radiance.as_dvec3();
        }
        received
    }

    /// What patch i receives through its light cut: points are drawn on luminaires in proportion to the rays of a
    /// patch, however many luminaires there are.
    fn by_cut(&self, cuts: &LightCuts, i: usize, scratch: &mut Scratch) -> DVec3 {
        let receivers = self.rays.clamp(1, SMOOTH);
        let draws = self.rays.div_ceil(SMOOTH).next_power_of_two() * cuts.draws(i as u32);
        let seed = hash(i as u32, self.seed);
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
