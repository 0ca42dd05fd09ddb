//! What points receive of the patches of a scene: the weights of their light.
//!
//! ```text
//! D_x = S_x + mean over cosine-distributed rays of through(y) B(y),     B(y) = a rho(y) / (a rho)_i B_i
//! ```
//!
//! for y on patch i. Where y lies nearer than a few patches are wide, B there is not read but found by one more step,
//! `a rho(y) (S(y) + mean B(z))`, since the patch as a whole stands for nothing that near a point.
//!
//! Not handled: light that is emitted.

use glam::Vec3;
use halflight::patches::Patches;
use halflight::rays::Hit;
use halflight::rays::sobol::hash;
use halflight::rays::warp::cosine_direction;
use halflight::surfaces::SurfacePoint;

use crate::sight::Sight;

/// What is nearer than so many times the size of patches is not read from them.
const NEAR: f32 = 2.0;
/// Meridians over which the sky is sampled from what is near.
const MERIDIANS: usize = 24;

/// What a point receives of a unit of B of some patches, channel by channel.
pub(crate) type Weights = Vec<(u32, [f32; 3])>;

/// What one point receives.
#[derive(Clone, Default)]
pub(crate) struct Gathered {
    /// Of light read at the ends of its rays.
    pub first: Weights,
    /// Of light read after one more ray.
    pub second: Weights,
    /// What the ends of its rays reflect of the sky, RGB columns; empty where none was near.
    pub fresh: Vec<[f32; 3]>,
    /// Rays that were cast.
    pub rays: u64,
}

/// How far reading may go.
#[derive(Clone, Copy)]
pub(crate) struct Reading {
    /// Reflections that count; none where all do.
    pub bounces: Option<usize>,
    /// Rays from each point.
    pub rays: u32,
    pub seed: u32,
}

/// Memory for one point after the other.
#[derive(Default)]
pub(crate) struct Scratch {
    sums: Vec<[f32; 3]>,
    touched: Vec<u32>,
    pub hits: Vec<Hit>,
}

impl Scratch {
    fn add(&mut self, patches: usize, patch: u32, weight: Vec3) {
        self.sums.resize(patches, [0.0; 3]);
        let own = &mut self.sums[patch as usize];
        if *own == [0.0; 3] {
            self.touched.push(patch);
        }
        *own = [0, 1, 2].map(|c| own[c] + weight[c]);
    }

    fn take(&mut self) -> Weights {
        self.touched.sort_unstable();
        self.touched.dedup();
        let sums = &mut self.sums;
        self.touched.drain(..).map(|patch| (patch, std::mem::take(&mut sums[patch as usize]))).collect()
    }
}

/// A place that a ray meets, and what it sends on of what it receives.
#[derive(Clone, Copy)]
pub(crate) struct Met {
    pub point: SurfacePoint,
    pub patch: u32,
    /// `a rho` there.
    pub passed_on: Vec3,
    /// The same over that of the patch, times the share of light that passes what is before.
    pub reading: Vec3,
    pub through: f32,
    pub distance: f32,
}

/// Where patches are met, and what they pass on.
pub(crate) struct Surroundings<'a> {
    pub sight: &'a Sight,
    pub patches: &'a Patches,
    /// `a rho` of each patch.
    pub passed_on: &'a [Vec3],
}

impl Surroundings<'_> {
    /// What a ray from a point meets, in order.
    pub fn meet(&self, point: &SurfacePoint, direction: Vec3, hits: &mut Vec<Hit>, mut each: impl FnMut(Met)) {
        let ray = self.sight.ray(point, direction);
        self.sight.follow(&ray, hits, |hit, through| {
            if self.sight.geometry.rays.is_sky(hit.face) {
                return;
            }
            let at = ray.at(hit.t);
            let Some(patch) = self.patches.met(&ray, hit) else { return };
            let passed_on = self.sight.passed_on(hit, at);
            let whole = self.passed_on[patch as usize];
            let share = Vec3::from_array([0, 1, 2].map(|c| if whole[c] > 0.0 { passed_on[c] / whole[c] } else { 0.0 }));
            let normal = self.patches.normal(hit.face, hit.side);
            let point = SurfacePoint { position: at, normal, face: hit.face };
            each(Met { point, patch, passed_on, reading: through * share, through, distance: hit.t });
        });
    }

    /// What a point receives.
    pub fn gather(&self, point: &SurfacePoint, reading: Reading, scratch: &mut Scratch) -> Gathered {
        let mut second = Scratch::default();
        let mut found = Gathered::default();
        let columns = self.sight.division.columns();
        let near = NEAR * self.patches.size() as f32;
        let mut grey = vec![0.0; columns];
        let count = reading.rays as f32;
        let mut hits = std::mem::take(&mut scratch.hits);
        let mut others = Vec::new();
        for k in 0..reading.rays {
            let [u, v, s, t] = self.sight.numbers(k, reading.seed);
            found.rays += 1;
            let mut own = |met: Met| {
                if met.distance >= near {
                    scratch.add(self.patches.len(), met.patch, met.reading / count);
                    return;
                }
                let sent = met.through * met.passed_on / count;
                grey.fill(0.0);
                let seed = hash(k, reading.seed ^ 0x6e65_6172);
                self.sight.sampled_sky(&met.point, (MERIDIANS, seed), 1.0, &mut grey);
                found.fresh.resize(columns, [0.0; 3]);
                for (out, grey) in found.fresh.iter_mut().zip(&grey).filter(|(_, grey)| **grey != 0.0) {
                    *out = [0, 1, 2].map(|c| out[c] + sent[c] * grey);
                }
                if reading.bounces == Some(1) {
                    return;
                }
                found.rays += 1;
                let onward = cosine_direction(met.point.normal, s, t);
                self.meet(&met.point, onward, &mut others, |met| {
                    second.add(self.patches.len(), met.patch, sent * met.reading);
                });
            };
            self.meet(point, cosine_direction(point.normal, u, v), &mut hits, &mut own);
        }
        scratch.hits = hits;
        (found.first, found.second) = (scratch.take(), second.take());
        found
    }
}
