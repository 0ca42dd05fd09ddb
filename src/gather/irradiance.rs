//! Irradiance at given points: direct light by closed form and visibility rays, all other light by hemisphere rays.
//!
//! ```text
//! irradiance(x) = pi (sum over luminaires of F_l E_l T  +  mean over cosine-distributed rays of what they read)
//! ```
//!
//! Every point is estimated by [`REPLICAS`] independent scramblings of one sequence, whose spread is the variance of
//! their mean. Rays double, of the kind that varies more, until that is small enough.
//!
//! Not handled: the error of the light that is read; light that rays read only after going on.

use std::ops::Range;

use glam::{DVec3, Vec2};

use crate::direct::{Choice, LightSum, Lights};
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
pub(crate) const STUDENT: f64 = 1.066;
/// Hemisphere rays, and visibility rays to every luminaire, of each estimate at first, and at most.
const RAYS: [u32; 2] = [16, 1 << 14];
const VISIBILITY: [u32; 2] = [2, 1 << 12];
/// Patches of luminaires seen from points in the air, which lie on none.
const NO_PATCH: u32 = 0;

/// What arrives at a point, over pi.
#[derive(Clone, Debug)]
pub(crate) struct Irradiance {
    /// Of luminaires and lights without area.
    pub direct: DVec3,
    /// Of every field.
    pub fields: Vec<DVec3>,
    /// Of direct light and the fields that make the picture.
    pub total: DVec3,
    /// Variance of that, channel by channel.
    pub variance: DVec3,
    /// The fields that make the picture, by replica.
    pub replicas: [DVec3; REPLICAS],
    /// Rays of each replica: hemisphere rays, and visibility rays to every luminaire.
    pub effort: [u32; 2],
    /// Rays cast.
    pub rays: u64,
}

/// When the rays of a point are enough.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Enough {
    /// At a relative standard error.
    Within(f64),
    /// At those of another estimate, whose rays they are.
    Like([u32; 2]),
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

/// Estimates irradiance at points under some lights, of fields of light on patches.
pub(crate) struct IrradianceSampler<'a> {
    lights: &'a Lights,
    final_gather: FinalGather<'a>,
    /// Of the points on luminaires.
    sobol: Sobol,
    seed: u32,
}

/// The sums of one replica.
struct Replica {
    fields: Vec<DVec3>,
    direct: LightSum,
}

impl<'a> IrradianceSampler<'a> {
    /// The lights of the view must know of no pair of a patch and a luminaire, as [`Lights::by_rays`] does.
    pub fn new(view: &'a View, fields: &'a Fields, seed: u32) -> IrradianceSampler<'a> {
        let sobol = Sobol::new(64, 2);
        IrradianceSampler { lights: view.lights, final_gather: FinalGather::new(view, fields), sobol, seed }
    }

    /// Irradiance over pi at point number k, by no more rays than there may be.
    pub fn at(&self, k: u32, point: &SurfacePoint, enough: Enough, memory: &mut Memory) -> Irradiance {
        let picture = self.final_gather.picture_fields();
        let none = |_| Replica { fields: vec![DVec3::ZERO; self.final_gather.fields()], direct: LightSum::default() };
        let mut replicas: [Replica; REPLICAS] = std::array::from_fn(none);
        let before = memory.scratch.cast;
        let [first, visible] = if let Enough::Like(effort) = enough { effort } else { [RAYS[0], VISIBILITY[0]] };
        let (mut rays, mut visibility) = (0..first, 0..visible);
        let mut cast = 0;
        loop {
            for (j, replica) in replicas.iter_mut().enumerate() {
                let seed = hash(k, Purpose::Points(j).seed(self.seed));
                self.read(replica, rays.clone(), (point, seed), memory);
                self.add(replica, visibility.clone(), (point, seed), memory);
            }
            cast += (REPLICAS * rays.len()) as u64;
            let [n, m] = [rays.end, visibility.end].map(f64::from);
            let indirect = replicas.each_ref().map(|r| r.fields[..picture].iter().sum::<DVec3>() / n);
            let direct = replicas.each_ref().map(|r| self.lights.total(&r.direct) / m);
            let both: [DVec3; REPLICAS] = std::array::from_fn(|j| indirect[j] + direct[j]);
            let [own, other] = [&indirect, &direct].map(|values| variance(values).element_sum());
            let is_enough = match enough {
                Enough::Within(tolerance) => (own + other).sqrt() <= tolerance * mean(&both).length(),
                Enough::Like(_) => true,
            };
            // Rays of the kind that varies more, while there may be more of it.
            let can = [own > 0.0 && rays.end < RAYS[1], other > 0.0 && visibility.end < VISIBILITY[1]];
            if is_enough || can == [false, false] {
                let fields = (0..self.final_gather.fields()).map(|f| {
                    let sum: DVec3 = replicas.iter().map(|r| r.fields[f]).sum();
                    sum / (n * REPLICAS as f64)
                });
                // The bias of a ratio falls as the number of all points drawn.
                let mut all = LightSum::default();
                replicas.iter().for_each(|replica| all.join(&replica.direct));
                let direct = self.lights.total(&all) / (m * REPLICAS as f64);
                let rays_end = rays.end;
                let rays = cast + memory.scratch.cast - before;
                let (total, variance) = (mean(&indirect) + direct, variance(&both));
                let (fields, effort) = (fields.collect(), [rays_end, visibility.end]);
                return Irradiance { direct, fields, total, variance, replicas: indirect, effort, rays };
            }
            let is_hemisphere = can[0] && (own >= other || !can[1]);
            rays = rays.end..if is_hemisphere { 2 * rays.end } else { rays.end };
            visibility = visibility.end..if is_hemisphere { visibility.end } else { 2 * visibility.end };
        }
    }

    /// Reads fields along more hemisphere rays.
    fn read(
        &self,
        replica: &mut Replica,
        indices: Range<u32>,
        (point, seed): (&SurfacePoint, u32),
        memory: &mut Memory,
    ) {
        if !indices.is_empty() && self.final_gather.fields() > 0 {
            let from = std::slice::from_ref(point);
            let rays = HemisphereRays { from, indices, seed, guiding: Guiding::NONE };
            self.final_gather.read(&rays, memory, &mut replica.fields);
        }
    }

    /// Adds direct light of more points on luminaires.
    fn add(
        &self,
        replica: &mut Replica,
        indices: Range<u32>,
        (point, seed): (&SurfacePoint, u32),
        memory: &mut Memory,
    ) {
        if indices.is_empty() {
            return;
        }
        let weight = DVec3::splat(f64::from(indices.end - indices.start));
        let draw = |choice: Choice| {
            let seed = hash(choice.luminaire, seed);
            Vec2::from([0, 1].map(|d| self.sobol.point(indices.start + choice.k, d, seed)))
        };
        let count = indices.end - indices.start;
        self.lights.add(&mut replica.direct, (point, NO_PATCH, weight), count, draw, &mut memory.scratch);
    }
}
