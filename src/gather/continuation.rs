//! Hemisphere rays that go on before they read: where what they meet is nearer than it is wide, where patches stand for the light too coarsely, and
//! where direct light is asked for at the point met.
//!
//! Not handled: fields beyond the first, which is the only one read this way.

use glam::DVec3;

use crate::gather::final_gather::{Reader, Told};
use crate::gather::reading::Direct;
use crate::gather::reflection::{Memory, Met};
use crate::rays::Ray;
use crate::rays::sobol::Stream;

/// Rays that follow one another at most before one reads, however near what they meet is.
pub(crate) const MOST: u32 = 16;

impl Reader<'_> {
    /// What a ray finds that goes on, or asks for direct light, before it reads; only the leading field is read.
    pub(crate) fn read_onward(&self, ray: &Ray, random: &mut Stream, memory: &mut Memory) -> Told {
        let mut met = std::mem::take(&mut memory.met);
        met.clear();
        let nearness = self.walker.follow(ray, memory, |m| met.push(m));
        let mut sum = DVec3::ZERO;
        for m in &met {
            let light = self.light(m, (self.reading.bounces, MOST), random, memory);
            sum += f64::from(m.through) * light;
        }
        memory.met = met;
        Told { nearness, light: sum }
    }

    /// A sample of the leading field at a point, from light read after so many more rays, or at most so many where what is met
    /// is too near.
    fn light(&self, at: &Met, (bounces, most): (u32, u32), random: &mut Stream, memory: &mut Memory) -> DVec3 {
        let Some(patch) = self.walker.patch(at) else {
            return DVec3::ZERO;
        };
        let ends = bounces == 0 && !self.fields.is_near(patch, at.distance) || most == 0;
        match self.reading.direct {
            Direct::Patch if ends => self.fields.of_patch(patch)[0].at(at.position).as_dvec3(),
            Direct::Asked if ends => {
                let rest = self.fields.without_direct(patch, at.position).as_dvec3();
                rest + self.walker.direct(at, random, memory).direct
            }
            _ => {
                let found = self.walker.reflect(at, random, memory);
                let left = (bounces.saturating_sub(1), most - 1);
                let mut onward = DVec3::ZERO;
                for m in &found.next {
                    onward += f64::from(m.through) * self.light(m, left, random, memory);
                }
                found.light(onward)
            }
        }
    }
}
