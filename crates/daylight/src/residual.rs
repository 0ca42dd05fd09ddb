//! How wrong light on patches is as points read it: by the equation itself, at places that their rays meet.
//!
//! ```text
//! r(y) = a rho(y) (S(y) + mean over rays of B_h(z)) - B_h(y)        what the light read at y lacks
//! d_x  = mean over rays from x of r(y) + a rho(y) r(y') + ...       what R_x lacks, along paths x, y, y', ...
//! b²   = sum of d_x d'_x / sum of R_x²                              d and d' by rays of their own
//! ```
//!
//! The product of two independent estimates has no noise in its mean, so b is the relative error that is left, whether
//! or not patches of another size agree. Where noise leaves b² open, its standard error over points is added.
//!
//! Not handled: how b differs from point to point; corners next to points are met by rays that go on.

use glam::Vec3;
use halflight::rays::sobol::{Stream, hash};
use halflight::rays::warp::cosine_direction;
use halflight::surfaces::SurfacePoint;
use rayon::prelude::*;

use crate::gather::{Met, Surroundings};
use crate::light_on_patches::OnPatches;

/// Points at which it is measured at most, and at least: fewer are looked from several times, for noise is known by the
/// differences between them. Rays from each place, and places of a path.
const POINTS: usize = 48;
const FEWEST: usize = 12;
const ONWARD: usize = 24;
const PLACES: usize = 3;
/// Meridians by which a place sees the sky.
const MERIDIANS: usize = 30;

/// How b is measured.
#[derive(Clone, Copy)]
pub(crate) struct Measure {
    /// Reflections that count; none where all do.
    pub bounces: Option<usize>,
    /// Rays from each point, twice.
    pub rays: u32,
    pub seed: u32,
}

impl Measure {
    /// As many rays as noise below a tolerance needs: that of the product of two estimates is one over their number,
    /// and of so many points one over the root of theirs.
    pub fn to(tolerance: f64, points: usize, bounces: Option<usize>, seed: u32) -> Measure {
        let points = points.clamp(FEWEST, POINTS) as f64;
        let rays = 1.6 / tolerance * (POINTS as f64 / points).sqrt();
        Measure { bounces, rays: rays.clamp(48.0, 512.0) as u32, seed }
    }
}

/// Light on patches: the sum of several answers.
pub(crate) struct Solved {
    /// B as points read it.
    pub first: OnPatches,
    /// B as it is read after one more step; as before where none.
    pub second: Option<OnPatches>,
    /// `a rho` of the patches.
    pub passed_on: Vec<Vec3>,
    /// How many.
    pub answers: usize,
}

impl Solved {
    /// The sum of both.
    pub fn plus(mut self, other: Solved) -> Solved {
        let add =
            |sum: &mut OnPatches, own: &OnPatches| sum.values.iter_mut().zip(&own.values).for_each(|(a, b)| *a += b);
        add(&mut self.first, &other.first);
        if let (Some(sum), Some(own)) = (&mut self.second, &other.second) {
            add(sum, own);
        }
        self.answers += other.answers;
        self
    }

    /// Adds the light read at a place, times a weight.
    fn read(&self, of: &OnPatches, met: &Met, weight: Vec3, out: &mut [[f32; 3]]) {
        of.add(met.patch as usize, (weight * met.reading / self.answers as f32).to_array(), out);
    }
}

/// What patches leave.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Residual {
    /// b.
    pub share: f64,
    /// Rays that were cast.
    pub rays: u64,
}

impl Residual {
    pub fn measure(around: &Surroundings, solved: &Solved, points: &[SurfacePoint], measure: Measure) -> Residual {
        let step = points.len().div_ceil(POINTS).max(1);
        let times = FEWEST.div_ceil(points.len());
        let chosen: Vec<usize> = (0..times * points.len()).step_by(step).collect();
        let own = |&k: &usize| {
            let x = k % points.len();
            let path = Path { around, solved, point: &points[x], measure };
            let [a, b] = [0, 1].map(|half| path.lacking(hash(2 * k as u32 + half, measure.seed)));
            let both = |of: fn(f64, f64) -> f64, p: &[[f32; 3]], q: &[[f32; 3]]| {
                let numbers = p.as_flattened().iter().zip(q.as_flattened());
                numbers.map(|(p, q)| of(f64::from(*p), f64::from(*q))).sum::<f64>()
            };
            let product = both(|p, q| p * q, &a.lacks, &b.lacks);
            let whole = both(|p, q| p * q, &a.read, &b.read).max(0.0);
            (product, whole, a.rays + b.rays)
        };
        let found: Vec<(f64, f64, u64)> = chosen.par_iter().map(own).collect();
        let whole: f64 = found.iter().map(|own| own.1).sum();
        let product: f64 = found.iter().map(|own| own.0).sum();
        if whole <= 0.0 {
            return Residual::default();
        }
        let square = product / whole;
        let apart = found.iter().map(|own| (own.0 - square * own.1).powi(2)).sum::<f64>();
        let count = found.len() as f64;
        let error = (apart * count / (count - 1.0)).sqrt() / whole;
        Residual { share: (square.max(0.0) + error).sqrt(), rays: found.iter().map(|own| own.2).sum() }
    }
}

/// Paths from a point.
struct Path<'a> {
    around: &'a Surroundings<'a>,
    solved: &'a Solved,
    point: &'a SurfacePoint,
    measure: Measure,
}

/// What paths from a point find.
struct Lacking {
    /// What R lacks, RGB columns.
    lacks: Vec<[f32; 3]>,
    /// R as it is read.
    read: Vec<[f32; 3]>,
    rays: u64,
}

impl Path<'_> {
    fn lacking(&self, seed: u32) -> Lacking {
        let columns = self.around.sight.division.columns();
        let mut found = Lacking { lacks: vec![[0.0; 3]; columns], read: vec![[0.0; 3]; columns], rays: 0 };
        let mut hits = Vec::new();
        let Measure { bounces, rays, .. } = self.measure;
        let places = if bounces.is_some() { 1 } else { PLACES };
        for k in 0..rays {
            let mut random = Stream::new(hash(k, seed));
            let [u, v, ..] = self.around.sight.numbers(k, seed);
            let mut onward = cosine_direction(self.point.normal, u, v);
            let (mut from, mut weight) = (*self.point, Vec3::splat(1.0 / rays as f32));
            for place in 0..places {
                let mut met: Vec<Met> = Vec::new();
                self.around.meet(&from, onward, &mut hits, |own| met.push(own));
                found.rays += 1;
                for own in &met {
                    if place == 0 {
                        self.solved.read(&self.solved.first, own, weight, &mut found.read);
                    }
                    self.residual(own, weight, &mut random, &mut found);
                }
                // One of what the ray meets is gone on from, as it is the first in all scenes but those with panes.
                let Some(own) = met.first() else { break };
                weight *= own.through * own.passed_on;
                if weight.max_element() <= 0.0 || met.len() > 1 {
                    break;
                }
                from = own.point;
                onward = cosine_direction(from.normal, random.uniform(), random.uniform());
            }
        }
        found
    }

    /// Adds what the light read at a place lacks.
    fn residual(&self, at: &Met, weight: Vec3, random: &mut Stream, found: &mut Lacking) {
        let sight = self.around.sight;
        self.solved.read(&self.solved.first, at, -weight, &mut found.lacks);
        let sent = weight * at.through * at.passed_on;
        if sent.max_element() <= 0.0 {
            return;
        }
        let mut grey = vec![0.0; sight.division.columns()];
        sight.sampled_sky(&at.point, (MERIDIANS, random.bits()), 1.0, &mut grey);
        for (out, grey) in found.lacks.iter_mut().zip(&grey) {
            *out = [0, 1, 2].map(|c| out[c] + sent[c] * grey);
        }
        if self.measure.bounces == Some(1) {
            return;
        }
        let deeper = self.solved.second.as_ref().unwrap_or(&self.solved.first);
        let (first, mut hits) = (random.bits(), Vec::new());
        for k in 0..ONWARD {
            let [u, v, ..] = sight.numbers(k as u32, first);
            let direction = cosine_direction(at.point.normal, u, v);
            found.rays += 1;
            self.around.meet(&at.point, direction, &mut hits, |own| {
                self.solved.read(deeper, &own, sent / ONWARD as f32, &mut found.lacks);
            });
        }
    }
}
