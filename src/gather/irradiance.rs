//! Irradiance at given points: direct light by closed form and visibility rays, all other light by hemisphere rays.
//!
//! ```text
//! irradiance(x) = pi (sum over luminaires of F_l E_l T  +  mean of L_0 over N rays  +  mean of L_d - L_0 over n)
//! ```
//!
//! L_k is what a cosine-distributed ray reads of the light on patches after k more rays, with direct light sampled
//! where it goes on. L_d is the result; most rays read L_0, which costs a cast and varies little, and the others, which
//! are among them, what d more rays change of it (control variate: M. Giles, *Multilevel Monte Carlo path simulation*,
//! Operations Research 56, 2008). With e the error of light on patches L_k is off by `F K^k e`. The last change,
//! from L_(d-1) to L_d, shows what of it differs from place to place; of what is alike everywhere it shows little.
//!
//! Every point is estimated by [`REPLICAS`] independent scramblings of one sequence, whose spread is the variance of
//! their mean. Rays double, of the kind that takes most variance for its price, until the error is small enough.
//!
//! Not handled: what of the error is alike everywhere, which callers know ([`Asked`]); light that rays read only after
//! going on for being near.

use std::ops::Range;

use glam::{DVec3, Vec2};

use crate::direct::{Choice, Cuts, LightSum};
use crate::gather::records::final_gather::{FinalGather, HemisphereRays};
use crate::gather::records::guiding::Guiding;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Sobol, hash};
use crate::reading::reflection::Memory;
use crate::reading::{Fields, View};
use crate::surfaces::SurfacePoint;

/// Independent estimates of a point. Their mean is within twice its standard error, times [`STUDENT`], in 95 of 100.
pub(crate) const REPLICAS: usize = 16;
/// Half the quantile of Student's distribution of 15 degrees of freedom that 95 of 100 are within, 2.131.
const STUDENT: f64 = 1.066;
/// Kinds of rays: those that read at once, those that go on, visibility rays to every luminaire.
const KINDS: usize = 3;
const AT_ONCE: usize = 0;
const ONWARD: usize = 1;
const VISIBILITY: usize = 2;
/// Rays of each kind and replica at first, and at most.
const FIRST: [u32; KINDS] = [16, 16, 2];
const MOST: [u32; KINDS] = [1 << 14, 1 << 13, 1 << 12];
/// Rays that read at once for each that goes on, at most: what a few of them meet must be met by those as well.
const FOR_EACH: u32 = 4;
/// Visibility rays of a point that, where all agree, are followed by no more: what they may have missed is stated.
const AGREED: f64 = 4096.0;
/// Share of the tolerance that noise is worth lessening to, where the error of the light that is read exceeds it alone.
const NOISE: f64 = 0.5;
/// Standard errors beyond which a change that more rays make is no chance.
const CERTAIN: f64 = 2.0;

/// What arrives at a point, over pi.
#[derive(Clone, Debug)]
pub(crate) struct Irradiance {
    /// Of luminaires and punctual lights, emitter by emitter.
    pub direct: Vec<DVec3>,
    /// Of the fields that are read at once, which those that go on do not correct.
    pub fields: Vec<DVec3>,
    /// Direct light and all that rays read.
    pub total: DVec3,
    /// The square of its error, channel by channel: of its noise, and of light on patches.
    pub squared_error: DVec3,
    /// Whether the light on patches is what keeps the error above the tolerance; one more ray would lessen it.
    pub is_coarse: bool,
    /// Rays cast.
    pub rays: u64,
}

/// What is asked of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    /// Relative error.
    pub tolerance: f64,
    /// Squared errors of the light that is read which the point itself does not show: those in proportion to reflected
    /// light, and to all light, as squared shares of them.
    pub of_reflected: DVec3,
    pub of_all: DVec3,
    /// Light that is none: what single precision cannot tell from it.
    pub dark: f64,
    /// Whether more may follow: else rays go on until noise is no matter.
    pub may_go_deeper: bool,
}

/// Estimates irradiance at points under some lights, of fields of light on patches.
pub(crate) struct IrradianceSampler<'a> {
    view: &'a View<'a>,
    at_once: FinalGather<'a>,
    onward: FinalGather<'a>,
    /// Of the points on luminaires.
    sobol: Sobol,
    seed: u32,
}

/// The point that is asked for.
struct AskedAt<'a> {
    /// Its number.
    k: u32,
    point: &'a SurfacePoint,
    cuts: Cuts<'a>,
}

/// The sums of one replica.
struct Replica {
    /// What rays read at once, field by field.
    at_once: Vec<DVec3>,
    /// What rays read that go on: after all of them, then after 0, 1, ... of them.
    onward: Vec<DVec3>,
    direct: LightSum,
}

/// All replicas of a point so far.
struct Sums {
    replicas: [Replica; REPLICAS],
    /// Rays of each kind and replica.
    counts: [u32; KINDS],
    /// Rays cast for each kind.
    cast: [u64; KINDS],
    /// Variance of what rays that go on change, before there were twice as many.
    before: DVec3,
}

/// What the replicas say together.
struct Means {
    total: DVec3,
    direct: DVec3,
    /// Of the total, and of the parts by each kind of ray.
    variance: DVec3,
    variances: [f64; KINDS],
    /// Of what rays that go on change.
    onward: DVec3,
    /// The square of what the last of the rays that go on changes, less what noise adds to it; and that.
    change: DVec3,
    change_noise: DVec3,
}

fn mean(values: &[DVec3; REPLICAS]) -> DVec3 {
    values.iter().sum::<DVec3>() / REPLICAS as f64
}

/// Variance of the mean of independent values.
pub(crate) fn variance(values: &[DVec3; REPLICAS]) -> DVec3 {
    let mean = mean(values);
    let squares: DVec3 = values.iter().map(|v| (*v - mean) * (*v - mean)).sum();
    squares / (REPLICAS * (REPLICAS - 1)) as f64
}

impl Sums {
    /// Of what the replicas have of a kind.
    fn each(&self, value: impl Fn(&Replica) -> DVec3) -> [DVec3; REPLICAS] {
        self.replicas.each_ref().map(value)
    }

    fn means(&self) -> Means {
        let [n, onward, visibility] = self.counts.map(f64::from);
        let at_once = self.each(|r| r.at_once.first().copied().unwrap_or_default() / n);
        let change = |from: usize| self.each(|r| onward_change(&r.onward, from) / onward);
        let corrected = change(1);
        let last = change(self.replicas[0].onward.len() - 1);
        let direct = self.each(|r| r.direct.total() / visibility);
        let total: [DVec3; REPLICAS] = std::array::from_fn(|j| at_once[j] + corrected[j] + direct[j]);
        // Rays that all agree have no spread.
        let agreement = *self.direct().agreement();
        let doubt = agreement.doubt() * agreement.doubt();
        let asked = if agreement.rays() < AGREED { doubt } else { DVec3::ZERO };
        let noise = variance(&last);
        let varies = variance(&corrected);
        // Twice as many leave half of it: rays do not end because their spread happened to be small.
        let by_chance = (0.5 * self.before - varies).max(DVec3::ZERO);
        Means {
            total: mean(&total),
            direct: mean(&direct),
            variance: variance(&total) + by_chance + doubt,
            onward: varies,
            variances: [variance(&at_once), varies, variance(&direct) + asked].map(DVec3::element_sum),
            change: (mean(&last) * mean(&last) - noise).max(DVec3::ZERO),
            change_noise: noise,
        }
    }

    /// Direct light of all replicas together.
    fn direct(&self) -> LightSum {
        let mut all = LightSum::default();
        self.replicas.iter().for_each(|replica| all.join(&replica.direct));
        all
    }

    /// The kind of rays that takes most variance for its price, of those that may become more.
    fn next(&self, means: &Means) -> Option<usize> {
        let can = |&kind: &usize| means.variances[kind] > 0.0 && self.counts[kind] < MOST[kind];
        let worth = |kind: usize| means.variances[kind] / self.cast[kind].max(1) as f64;
        let next = (0..KINDS).filter(can).max_by(|&a, &b| worth(a).total_cmp(&worth(b)));
        let is_ahead = self.counts[AT_ONCE] >= FOR_EACH * self.counts[ONWARD] && can(&ONWARD);
        if next == Some(AT_ONCE) && is_ahead { Some(ONWARD) } else { next }
    }
}

/// What the rays from reading number `from` on change: 1 stands for L_0, the last for L_(d-1).
fn onward_change(read: &[DVec3], from: usize) -> DVec3 {
    if from == 0 { DVec3::ZERO } else { read[0] - read[from] }
}

impl Means {
    fn squared_error(&self, asked: &Asked) -> DVec3 {
        let reflected = self.total - self.direct;
        let light = asked.of_reflected * reflected * reflected + asked.of_all * self.total * self.total;
        STUDENT * STUDENT * self.variance + self.change + light
    }

    /// Whether light on patches alone exceeds what is asked by as much as is no chance.
    fn is_coarse(&self, allowed: f64) -> bool {
        let [change, noise] = [self.change, self.change_noise].map(DVec3::element_sum);
        change > NOISE * allowed && change > CERTAIN * CERTAIN * noise
    }
}

impl<'a> IrradianceSampler<'a> {
    /// The first field of either is the light of everything; those that go on record what they read before.
    pub(crate) fn new(view: &'a View, (at_once, onward): (&'a Fields, &'a Fields), seed: u32) -> IrradianceSampler<'a> {
        let [at_once, onward] = [at_once, onward].map(|fields| FinalGather::new(view, fields));
        IrradianceSampler { view, at_once, onward, sobol: Sobol::new(64, 2), seed }
    }

    /// Irradiance over pi at point number k, by no more rays than there may be.
    pub(crate) fn at(&self, k: u32, point: &SurfacePoint, asked: &Asked, memory: &mut Memory) -> Irradiance {
        let mut sums = self.nothing();
        let cuts = self.view.lights.cuts_at(point);
        let asked_at = AskedAt { k, point, cuts: cuts.cuts() };
        for (kind, first) in FIRST.into_iter().enumerate() {
            self.extend(&mut sums, kind, first, &asked_at, memory);
        }
        loop {
            let means = sums.means();
            let allowed = (asked.tolerance * means.total.length().max(asked.dark)).powi(2);
            let squared = means.squared_error(asked);
            let is_coarse = means.is_coarse(allowed);
            let is_enough = squared.element_sum() <= allowed
                || is_coarse && asked.may_go_deeper
                || means.variance.element_sum() <= NOISE * NOISE * allowed
                || means.total.length() <= asked.dark && means.variance.element_sum() <= asked.dark * asked.dark;
            let next = sums.next(&means).filter(|_| !is_enough);
            let Some(kind) = next else {
                return self.irradiance(&sums, &means, (squared, is_coarse && squared.element_sum() > allowed));
            };
            let as_many = sums.counts[kind];
            if kind == ONWARD {
                sums.before = means.onward;
            }
            self.extend(&mut sums, kind, as_many, &asked_at, memory);
        }
    }

    fn nothing(&self) -> Sums {
        let dark = |of: &FinalGather| vec![DVec3::ZERO; of.count()];
        let none =
            |_| Replica { at_once: dark(&self.at_once), onward: dark(&self.onward), direct: LightSum::default() };
        Sums { replicas: std::array::from_fn(none), counts: [0; KINDS], cast: [0; KINDS], before: DVec3::ZERO }
    }

    /// So many more rays of a kind in every replica.
    fn extend(&self, sums: &mut Sums, kind: usize, more: u32, at: &AskedAt, memory: &mut Memory) {
        let indices = sums.counts[kind]..sums.counts[kind] + more;
        let before = memory.scratch.cast;
        for (j, replica) in sums.replicas.iter_mut().enumerate() {
            let seed = hash(at.k, Purpose::Points(j).seed(self.seed));
            match kind {
                AT_ONCE => read(&self.at_once, &mut replica.at_once, indices.clone(), (at.point, seed), memory),
                ONWARD => read(&self.onward, &mut replica.onward, indices.clone(), (at.point, seed), memory),
                _ => self.add(replica, indices.clone(), (at, seed), memory),
            }
        }
        // Rays that read at once are not counted one by one.
        let own = if kind == AT_ONCE { (REPLICAS * indices.len()) as u64 } else { memory.scratch.cast - before };
        sums.cast[kind] += own;
        sums.counts[kind] = indices.end;
    }

    fn irradiance(&self, sums: &Sums, means: &Means, (squared_error, is_coarse): (DVec3, bool)) -> Irradiance {
        let count = |kind: usize| f64::from(sums.counts[kind]) * REPLICAS as f64;
        let mut direct = vec![DVec3::ZERO; self.view.lights.emitters().count()];
        sums.direct().by_emitter(|emitter, light| direct[emitter] += light / count(VISIBILITY));
        let of = |f: usize| sums.replicas.iter().map(|r| r.at_once[f]).sum::<DVec3>() / count(AT_ONCE);
        let fields = (1..self.at_once.count()).map(of).collect();
        Irradiance { direct, fields, total: means.total, squared_error, is_coarse, rays: sums.cast.iter().sum() }
    }

    /// Adds direct light of more points on luminaires.
    fn add(&self, replica: &mut Replica, indices: Range<u32>, (at, seed): (&AskedAt, u32), memory: &mut Memory) {
        let count = indices.end - indices.start;
        let weight = DVec3::splat(f64::from(count));
        let draw = |choice: Choice| {
            let seed = hash(choice.tree, seed);
            let per_ray = choice.of / count;
            Vec2::from([0, 1].map(|d| self.sobol.point(indices.start * per_ray + choice.k, d, seed)))
        };
        let lights = self.view.lights;
        lights.add(&mut replica.direct, (at.point, at.cuts, weight), count, draw, &mut memory.scratch);
    }
}

/// Reads fields along more hemisphere rays.
fn read(
    gather: &FinalGather,
    sums: &mut [DVec3],
    indices: Range<u32>,
    (point, seed): (&SurfacePoint, u32),
    memory: &mut Memory,
) {
    let from = std::slice::from_ref(point);
    gather.read(&HemisphereRays { from, indices, seed, guiding: Guiding::NONE }, memory, sums);
}
