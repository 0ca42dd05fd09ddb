//! Irradiance at given points: direct light by closed form and visibility rays, all other light by hemisphere rays.
//!
//! ```text
//! irradiance(x) = pi (sum over luminaires of F_l E_l T
//!                     + mean of L_h over N rays  +  mean of sum of w_k r_k over n paths)
//! ```
//!
//! L_h is what a cosine-distributed ray reads of the light on patches, which costs a cast and varies little; the
//! residuals r_k along paths ([`crate::error::residual`]) have the mean `F (L - L_h)`, what is wrong with it. So light
//! on patches is a control variate (M. Giles, *Multilevel Monte Carlo path simulation*, Operations Research 56, 2008):
//! the mean does not depend on patches, on rays of F or on where the series was truncated, and the only error is noise.
//!
//! Every point is estimated by [`REPLICAS`] independent scramblings of one sequence, whose spread is the variance of
//! their mean. Rays double, of the kind that takes most variance for its price, until the error is small enough.
//!
//! Not handled: light that few of all rays meet, of which their spread tells too little.

use std::ops::Range;

use glam::{DVec3, Vec2};

use crate::direct::{Choice, Cuts, LightSum};
use crate::error::importance_paths::PathTracer;
use crate::error::residual::error;
use crate::gather::records::final_gather::{FinalGather, HemisphereRays};
use crate::gather::records::guiding::Guiding;
use crate::rays::Ray;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Sobol, Stream, hash};
use crate::rays::warp::cosine_direction;
use crate::reading::reflection::Memory;
use crate::reading::{Fields, View};
use crate::surfaces::SurfacePoint;

/// Independent estimates of a point. Their mean is within twice its standard error, times [`STUDENT`], in 95 of 100.
const REPLICAS: usize = 16;
/// Half the quantile of Student's distribution of 15 degrees of freedom that 95 of 100 are within, 2.131.
const STUDENT: f64 = 1.066;
/// Kinds of rays: those that read at once, those that begin a path, visibility rays to every luminaire.
const KINDS: usize = 3;
const AT_ONCE: usize = 0;
const PATHS: usize = 1;
const VISIBILITY: usize = 2;
/// Rays of each kind and replica at first, and at most.
const FIRST: [u32; KINDS] = [16, 4, 2];
const MOST: [u32; KINDS] = [1 << 14, 1 << 13, 1 << 12];
/// Rays of a vertex of a path.
const SPREAD: usize = 4;
/// Rays that read at once for each path, at most: what a few of them meet must be met by those as well.
const FOR_EACH: u32 = 8;
/// Visibility rays of a point that, where all agree, are followed by no more: what they may have missed is stated.
const AGREED: f64 = 4096.0;
/// Rays of a replica at most where none brings light.
const NOTHING: u32 = 256;

/// What arrives at a point, over pi.
#[derive(Clone, Debug)]
pub(crate) struct Irradiance {
    /// Of luminaires and punctual lights, emitter by emitter.
    pub direct: Vec<DVec3>,
    /// Of the fields that are read at once, which paths do not correct.
    pub fields: Vec<DVec3>,
    /// Direct light and all that rays read.
    pub total: DVec3,
    /// The square of its error, channel by channel.
    pub squared_error: DVec3,
    /// Rays cast.
    pub rays: u64,
}

/// What is asked of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    /// Relative error.
    pub tolerance: f64,
    /// The brightest light on patches.
    pub brightest: f64,
}

impl Asked {
    /// Light that is none: what single precision cannot tell from it.
    pub(crate) fn dark(&self) -> f64 {
        f64::from(f32::EPSILON) * self.brightest
    }
}

/// Estimates irradiance at points under some lights, of fields of light on patches.
pub(crate) struct IrradianceSampler<'a> {
    view: &'a View<'a>,
    at_once: FinalGather<'a>,
    paths: PathTracer<'a>,
    /// Of the points on luminaires and of the first rays of paths.
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
    /// What residuals along paths add up to.
    paths: DVec3,
    direct: LightSum,
}

/// All replicas of a point so far.
struct Sums {
    replicas: [Replica; REPLICAS],
    /// Rays of each kind and replica.
    counts: [u32; KINDS],
    /// Rays cast for each kind.
    cast: [u64; KINDS],
    /// Variance of what paths change, before there were twice as many.
    before: DVec3,
}

/// What the replicas say together.
struct Means {
    total: DVec3,
    /// Of the total, and of the parts by each kind of ray.
    variance: DVec3,
    variances: [f64; KINDS],
    /// Of what paths change.
    paths: DVec3,
}

impl Means {
    /// Whether no ray brought light.
    fn is_nothing(&self) -> bool {
        self.total == DVec3::ZERO && self.variance == DVec3::ZERO
    }
}

fn mean(values: &[DVec3; REPLICAS]) -> DVec3 {
    values.iter().sum::<DVec3>() / REPLICAS as f64
}

/// Variance of the mean of independent values.
fn variance(values: &[DVec3; REPLICAS]) -> DVec3 {
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
        let [n, paths, visibility] = self.counts.map(f64::from);
        let at_once = self.each(|r| r.at_once.first().copied().unwrap_or_default() / n);
        let corrected = self.each(|r| r.paths / paths);
        let direct = self.each(|r| r.direct.total() / visibility);
        let total: [DVec3; REPLICAS] = std::array::from_fn(|j| at_once[j] + corrected[j] + direct[j]);
        // Rays that all agree have no spread.
        let agreement = *self.direct().agreement();
        let doubt = agreement.doubt() * agreement.doubt();
        let asked = if agreement.rays() < AGREED { doubt } else { DVec3::ZERO };
        let varies = variance(&corrected);
        // Twice as many leave half of it: rays do not end because their spread happened to be small.
        let by_chance = (0.5 * self.before - varies).max(DVec3::ZERO);
        Means {
            total: mean(&total),
            variance: variance(&total) + by_chance + doubt,
            paths: varies,
            variances: [variance(&at_once), varies, variance(&direct) + asked].map(DVec3::element_sum),
        }
    }

    /// Direct light of all replicas together.
    fn direct(&self) -> LightSum {
        let mut all = LightSum::default();
        self.replicas.iter().for_each(|replica| all.join(&replica.direct));
        all
    }

    /// The square of what a point may get to which no ray brought light: that of one ray to the brightest patch.
    fn unseen(&self, means: &Means, brightest: f64) -> DVec3 {
        let one = brightest / (REPLICAS as f64 * f64::from(self.counts[AT_ONCE]));
        if means.is_nothing() { DVec3::splat(one * one / 3.0) } else { DVec3::ZERO }
    }

    /// The kind of rays that takes most variance for its price, of those that may become more.
    fn next(&self, means: &Means) -> Option<usize> {
        if means.is_nothing() {
            return (self.counts[AT_ONCE] < NOTHING).then_some(AT_ONCE);
        }
        let can = |&kind: &usize| means.variances[kind] > 0.0 && self.counts[kind] < MOST[kind];
        let worth = |kind: usize| means.variances[kind] / self.cast[kind].max(1) as f64;
        let next = (0..KINDS).filter(can).max_by(|&a, &b| worth(a).total_cmp(&worth(b)));
        let is_ahead = self.counts[AT_ONCE] >= FOR_EACH * self.counts[PATHS] && can(&PATHS);
        if next == Some(AT_ONCE) && is_ahead { Some(PATHS) } else { next }
    }
}

impl<'a> IrradianceSampler<'a> {
    /// The first of the fields is the light of everything.
    pub(crate) fn new(view: &'a View, fields: &'a Fields, seed: u32) -> IrradianceSampler<'a> {
        let (at_once, paths) = (FinalGather::new(view, fields), PathTracer::new(view).with_spread(SPREAD));
        IrradianceSampler { view, at_once, paths, sobol: Sobol::new(64, 2), seed }
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
            let squared = STUDENT * STUDENT * means.variance + sums.unseen(&means, asked.brightest);
            let allowed = asked.tolerance * means.total.length().max(asked.dark());
            let is_enough = squared.element_sum() <= allowed * allowed;
            let Some(kind) = sums.next(&means).filter(|_| !is_enough) else {
                return self.irradiance(&sums, &means, squared);
            };
            if kind == PATHS {
                sums.before = means.paths;
            }
            let as_many = sums.counts[kind];
            self.extend(&mut sums, kind, as_many, &asked_at, memory);
        }
    }

    fn nothing(&self) -> Sums {
        let dark = vec![DVec3::ZERO; self.at_once.count()];
        let none = |_| Replica { at_once: dark.clone(), paths: DVec3::ZERO, direct: LightSum::default() };
        Sums { replicas: std::array::from_fn(none), counts: [0; KINDS], cast: [0; KINDS], before: DVec3::ZERO }
    }

    /// So many more rays of a kind in every replica.
    fn extend(&self, sums: &mut Sums, kind: usize, more: u32, at: &AskedAt, memory: &mut Memory) {
        let indices = sums.counts[kind]..sums.counts[kind] + more;
        let before = memory.scratch.cast;
        for (j, replica) in sums.replicas.iter_mut().enumerate() {
            let seed = hash(at.k, Purpose::Points(j).seed(self.seed));
            match kind {
                AT_ONCE => {
                    let from = std::slice::from_ref(at.point);
                    let rays = HemisphereRays { from, indices: indices.clone(), seed, guiding: Guiding::NONE };
                    self.at_once.read(&rays, memory, &mut replica.at_once);
                }
                PATHS => replica.paths += self.residuals(indices.clone(), (at.point, seed), memory),
                _ => self.add(replica, indices.clone(), (at, seed), memory),
            }
        }
        // Rays that read at once are not counted one by one.
        let own = if kind == AT_ONCE { (REPLICAS * indices.len()) as u64 } else { memory.scratch.cast - before };
        sums.cast[kind] += own;
        sums.counts[kind] = indices.end;
    }

    /// The residuals along more paths, and what patches cut by spots send.
    fn residuals(&self, indices: Range<u32>, (point, seed): (&SurfacePoint, u32), memory: &mut Memory) -> DVec3 {
        let view = self.view;
        let own = |k: u32| {
            let [u, v] = [0, 1].map(|d| self.sobol.point(k, d, seed));
            let direction = cosine_direction(point.normal, u, v);
            let ray = Ray { origin: point.position, direction, source: point.source() };
            let random = &mut Stream::new(hash(k, seed));
            let mut sum = error(&self.paths.trace_ray(&ray, random, memory), view.patches, self.at_once.fields);
            view.lights.sample_strata(point, random, &mut memory.scratch, |_, light| sum += light);
            sum
        };
        indices.map(own).sum()
    }

    fn irradiance(&self, sums: &Sums, means: &Means, squared_error: DVec3) -> Irradiance {
        let count = |kind: usize| f64::from(sums.counts[kind]) * REPLICAS as f64;
        let mut direct = vec![DVec3::ZERO; self.view.lights.emitters().count()];
        sums.direct().by_emitter(|emitter, light| direct[emitter] += light / count(VISIBILITY));
        let of = |f: usize| sums.replicas.iter().map(|r| r.at_once[f]).sum::<DVec3>() / count(AT_ONCE);
        let fields = (1..self.at_once.count()).map(of).collect();
        Irradiance { direct, fields, total: means.total, squared_error, rays: sums.cast.iter().sum() }
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
