//! Hemisphere rays that go on before they read: where what they meet is nearer than it is wide, and where patches stand
//! for the light too coarsely.
//!
//! Not handled: fields beyond the first, which is the only one read this way.

use glam::DVec3;

use crate::gather::fields::Fields;
use crate::gather::reflection::{Memory, SurfaceHit, Walker};
use crate::rays::Ray;
use crate::rays::sobol::Stream;

/// Rays that follow one another at most before one reads, however near what they meet is.
pub(crate) const MOST: u32 = 16;

/// What one ray found.
pub(crate) struct RaySample {
    /// Inverse distance to the first face that it met.
    pub nearness: f64,
    /// Light of the first field.
    pub light: DVec3,
}

/// How far a ray may go on.
#[derive(Clone, Copy)]
struct Left {
    /// Rays before light is read anywhere.
    bounces: u32,
    /// Rays before light is read however near what is met.
    most: u32,
}

/// Follows rays until they read the first field.
pub(crate) struct Continuation<'a> {
    pub walker: Walker<'a>,
    pub fields: &'a Fields,
}

impl Continuation<'_> {
    /// What a ray finds that goes on before it reads; `seed` is that of its numbers.
    ///
    /// Most rays read what they meet at once, and take nothing but that.
    pub fn read(&self, ray: &Ray, seed: u32, memory: &mut Memory) -> RaySample {
        let mut met = std::mem::take(&mut memory.met);
        met.clear();
        let left = Left { bounces: self.fields.reading().bounces(), most: MOST };
        let mut light = DVec3::ZERO;
        let nearness = self.walker.follow(ray, memory, |m| {
            if self.ends(&m, left) {
                light += f64::from(m.through) * self.of_patch(&m);
            } else {
                met.push(m);
            }
        });
        if !met.is_empty() {
            light += self.incident(&met, left, &mut Stream::new(seed), memory);
        }
        memory.met = met;
        RaySample { nearness, light }
    }

    /// What arrives along one ray from all that it met.
    ///
    /// Light is read at every place that ends the ray. Of the places that the ray goes on from, one is drawn by what
    /// gets through to it and stands for all: with tau > 0 a ray meets many, and going on from each of them would
    /// double the rays with every bounce.
    fn incident(&self, met: &[SurfaceHit], left: Left, random: &mut Stream, memory: &mut Memory) -> DVec3 {
        if let [one] = met {
            return f64::from(one.through) * self.light(one, left, random, memory);
        }
        let mut sum = DVec3::ZERO;
        let mut onward: Option<&SurfaceHit> = None;
        let mut through = 0.0;
        for m in met {
            if self.ends(m, left) {
                sum += f64::from(m.through) * self.light(m, left, random, memory);
                continue;
            }
            through += m.through;
            if onward.is_none() || random.uniform() * through < m.through {
                onward = Some(m);
            }
        }
        let on = onward.map_or(DVec3::ZERO, |m| f64::from(through) * self.light(m, left, random, memory));
        sum + on
    }

    /// What arrives at a point along one more ray.
    fn onward(&self, at: &SurfaceHit, left: Left, random: &mut Stream, memory: &mut Memory) -> DVec3 {
        let next = self.walker.bounce(at, random, memory);
        self.incident(&next, left, random, memory)
    }

    /// Whether light is read at a place.
    fn ends(&self, at: &SurfaceHit, left: Left) -> bool {
        left.most == 0 || (left.bounces == 0 && !self.fields.is_near(at.patch, at.distance))
    }

    /// A sample of the first field at a point, read there or after more rays.
    fn light(&self, at: &SurfaceHit, left: Left, random: &mut Stream, memory: &mut Memory) -> DVec3 {
        if !self.ends(at, left) {
            let found = self.walker.direct(at, random, memory);
            if found.reflect == DVec3::ZERO {
                return found.light(DVec3::ZERO);
            }
            let left = Left { bounces: left.bounces.saturating_sub(1), most: left.most - 1 };
            return found.light(self.onward(at, left, random, memory));
        }
        self.of_patch(at)
    }

    /// The first field where a ray meets a patch.
    #[inline]
    fn of_patch(&self, at: &SurfaceHit) -> DVec3 {
        let over_patch = at.over_patch(self.walker.view.patches, at.patch);
        (self.fields.of_patch(at.patch)[0].at(at.position) * over_patch).as_dvec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Rgb, Transport};
    use crate::rays::warp::cosine_direction;

    /// Rays once went on from every surface that they crossed: with tau > 0 their number doubled and more with every
    /// bounce, and a furnished staircase at alpha = tau = 0.5 did not end in nine minutes.
    #[test]
    fn a_ray_that_crosses_many_surfaces_goes_on_from_one() {
        let lights = lights_of("furnished-room", Transport { alpha: 0.5, tau: 0.9 }, 300);
        let view = View::new(&lights, (1, 1).into());
        let patches = view.patches;
        let fields = Fields::new(&[vec![Rgb::ONE; patches.len()]]);
        let fields = fields.not_read_nearer(vec![f32::INFINITY; patches.len()]);
        let continuation = Continuation { walker: Walker::new(&view), fields: &fields };
        let mut memory = Memory::default();
        let mut random = Stream::new(1);
        for i in 0..patches.len() {
            let from = patches.point(i, 0.5, 0.5);
            let direction = cosine_direction(from.normal, random.uniform(), random.uniform());
            let before = memory.cast;
            let ray = Ray { origin: from.position, direction, source: Some(from.face) };
            continuation.read(&ray, i as u32, &mut memory);
            // Each bounce is one ray and those to luminaires, one for each of at most a handful.
            let lamps = view.luminaires.list.len() as u64;
            let most = u64::from(MOST + 1) * (1 + lamps);
            assert!(memory.cast - before <= most, "{i}: {} rays", memory.cast - before);
        }
    }
}
