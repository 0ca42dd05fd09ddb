//! What the error of light on patches leaves at points that read it after some more rays, measured at some of them by
//! longer paths.
//!
//! With e the error of light on patches, a reading after m more rays is off by `F K^m e`. What one more ray changes
//! shows `F K^(m-1) (1 - K) e`, which is little of an error that is alike everywhere in a room: where surfaces pass on
//! four fifths of the light it is a quarter of what remains. But such an error is alike at all points too. So at some
//! points i paths of [`LONGEST`] more rays measure what remains, b_i ± s_i, and with x_i the reflected light there
//!
//! ```text
//! b_i = c x_i + the point's own,     c = sum of x_i b_i / sum of x_i²,     own² = mean of (b_i - c x_i)² - s_i²
//! ```
//!
//! all of it over the point's light (random effects: R. DerSimonian, N. Laird, *Meta-analysis in clinical trials*,
//! 1986). c x corrects each point; its standard error and the own part are stated.
//!
//! Not handled: what longer paths than these would change, a `LONGEST`-th power of what surfaces pass on.

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::irradiance::{REPLICAS, variance};
use crate::gather::records::final_gather::{FinalGather, HemisphereRays};
use crate::gather::records::guiding::Guiding;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::hash;
use crate::reading::reflection::Memory;
use crate::reading::{Fields, View};
use crate::surfaces::SurfacePoint;

/// More rays of a path.
pub(crate) const LONGEST: usize = 12;
/// Share of the tolerance that the standard error of c may be.
const NOISE: f64 = 0.2;
/// Share of the points that c is of: those of which least is missing.
const MOST: f64 = 0.9;
/// Paths of each point and replica at first, and at most.
const PATHS: [u32; 2] = [4, 1 << 12];
/// Marks numbers of points whose paths share no random numbers with the rays of the points themselves.
const OTHER: u32 = 1 << 31;

/// A point at which paths are traced.
pub(crate) struct PooledPoint {
    /// Its number.
    pub number: u32,
    pub point: SurfacePoint,
    /// All light there, over pi, and what of it is reflected.
    pub total: DVec3,
    pub reflected: DVec3,
}

/// What remains of the error of light on patches, after 1, 2, ... more rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct PooledError {
    depths: Vec<Remaining>,
    /// Rays cast.
    pub rays: u64,
}

/// After a number of rays.
#[derive(Clone, Copy, Debug, Default)]
struct Remaining {
    /// What is missing, as a share of the reflected light, and the variance of that.
    share: DVec3,
    variance: DVec3,
    /// The square of what differs from point to point, as a share of all light.
    own: DVec3,
}

/// Light that a path finds more than readings do after 1, 2, ... more rays, by replica: sums.
type Missing = Vec<[DVec3; REPLICAS]>;

impl PooledError {
    /// Measures it at some points by as many paths as a tolerance needs, for readings after up to `depths` more rays of
    /// a field.
    pub(super) fn new(
        view: &View,
        field: &Fields,
        points: &[PooledPoint],
        depths: usize,
        (tolerance, seed): (f64, u32),
    ) -> PooledError {
        let fields = field.clone().recording(LONGEST);
        let gather = FinalGather::new(view, &fields);
        let mut sums: Vec<Missing> = points.iter().map(|_| vec![[DVec3::ZERO; REPLICAS]; depths]).collect();
        let (mut count, mut more, mut rays) = (0, PATHS[0], 0);
        loop {
            let all = sums.par_iter_mut().zip(points);
            let cast = all.map_init(Memory::default, |memory, (sums, point)| {
                let before = memory.scratch.cast;
                extend(&gather, sums, point, (count..count + more, seed), memory);
                memory.scratch.cast - before
            });
            rays += cast.sum::<u64>();
            count += more;
            let of = |depth: usize| remaining(points, &sums, depth, f64::from(count));
            let depths: Vec<Remaining> = (0..depths).map(of).collect();
            let is_certain = |r: &Remaining| r.variance.max_element() <= (NOISE * tolerance).powi(2);
            if depths.iter().all(is_certain) || count >= PATHS[1] {
                return PooledError { depths, rays };
            }
            more = count;
        }
    }

    /// What is missing at points that read after so many more rays, as a share of the reflected light; the variance of
    /// that; and the square of what differs from point to point, as a share of all light. All 0 where not measured.
    pub(super) fn after(&self, rays: usize) -> [DVec3; 3] {
        let Remaining { share, variance, own } = self.depths.get(rays - 1).copied().unwrap_or_default();
        [share, variance, own]
    }
}

/// Adds what more paths of a point find.
fn extend(
    gather: &FinalGather,
    sums: &mut Missing,
    point: &PooledPoint,
    (indices, seed): (std::ops::Range<u32>, u32),
    memory: &mut Memory,
) {
    let mut read = vec![DVec3::ZERO; gather.count()];
    for j in 0..REPLICAS {
        read.fill(DVec3::ZERO);
        let seed = hash(point.number | OTHER, Purpose::Points(j).seed(seed));
        let from = std::slice::from_ref(&point.point);
        let rays = HemisphereRays { from, indices: indices.clone(), seed, guiding: Guiding::NONE };
        gather.read(&rays, memory, &mut read);
        for (depth, sum) in sums.iter_mut().enumerate() {
            // All rays first, then after 0, 1, ...
            sum[j] += read[0] - read[depth + 2];
        }
    }
}

/// What remains in a depth, of `count` paths of each point and replica.
fn remaining(points: &[PooledPoint], sums: &[Missing], depth: usize, count: f64) -> Remaining {
    let (mut xx, mut xb, mut noise) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    let mut each: Vec<(DVec3, DVec3, DVec3)> = points
        .iter()
        .zip(sums)
        .map(|(point, sums)| {
            let all = point.total.length();
            let missing = sums[depth].map(|sum| sum / (count * all));
            let mean = missing.iter().sum::<DVec3>() / REPLICAS as f64;
            (point.reflected / all, mean, variance(&missing))
        })
        .collect();
    // What a few points in the dark miss of their light is no matter of all.
    each.sort_by(|(_, a, _), (_, b, _)| a.length_squared().total_cmp(&b.length_squared()));
    let most = &each[..(MOST * each.len() as f64).ceil() as usize];
    for (x, b, s) in most {
        xx += *x * *x;
        xb += *x * *b;
        noise += *x * *x * *s;
    }
    let over = |a: DVec3, b: DVec3| DVec3::from([0, 1, 2].map(|c| if b[c] > 0.0 { a[c] / b[c] } else { 0.0 }));
    let share = over(xb, xx);
    let own = |(x, b, s): &(DVec3, DVec3, DVec3), times: f64| (*b - share * *x) * (*b - share * *x) - times * *s;
    // Points differ from c by chance too.
    let freedom = (most.len() as f64 - 1.0).max(1.0);
    let mean = most.iter().map(|point| own(point, 1.0)).sum::<DVec3>() / freedom;
    // Of 100 points 95 are to be within twice what is stated, as they are by chance alone.
    let of_most = DVec3::from([0, 1, 2].map(|c| quantile(each.iter().map(|point| own(point, 4.0)[c]).collect())));
    let own = mean.max(0.25 * of_most).max(DVec3::ZERO);
    Remaining { share, variance: over(noise, xx * xx), own }
}

/// What 95 of 100 values are at most.
fn quantile(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((0.95 * last as f64) as usize).copied().unwrap_or(0.0)
}
