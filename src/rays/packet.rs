//! Cosine-distributed directions of successive Sobol points, made side by side.
//!
//! A ray's direction costs as much as finding what it meets in a small scene; sixteen at a time in vector instructions
//! cost a fraction of that. The level of instructions is chosen at run time and changes no bit of the result: the steps
//! are those of [`crate::rays::warp::cosine_direction`].
//!
//! Not handled: numbers of directions other than [`FAN`]; callers take the first of a fan.

use glam::Vec3;
use pulp::{Arch, Simd, WithSimd};

use crate::rays::sobol::Sobol;
use crate::rays::warp::{about_z, turned};

/// Directions made at once.
pub const FAN: usize = 16;

/// Directions about z of points of a sequence, and one more coordinate of each point.
#[derive(Clone, Debug)]
pub struct Fan {
    x: [f32; FAN],
    y: [f32; FAN],
    z: [f32; FAN],
    third: [f32; FAN],
}

impl Fan {
    /// The directions of the [`FAN`] points from `first` on by their dimensions 0 and 1, and their dimension 2.
    pub fn new(sobol: &Sobol, first: u32, seed: u32) -> Fan {
        Fan::warped(sobol, first, seed, |_, _| ()).0
    }

    /// The directions of [`Fan::new`] with dimensions 0 and 1 changed by `warp` before directions are made of them;
    /// also what `warp` returned.
    pub fn warped<B>(
        sobol: &Sobol,
        first: u32,
        seed: u32,
        warp: impl FnOnce(&mut [f32; FAN], &mut [f32; FAN]) -> B,
    ) -> (Fan, B) {
        let nothing = [0.0; FAN];
        let mut fan = Fan { x: nothing, y: nothing, z: nothing, third: nothing };
        let arch = Arch::new();
        arch.dispatch(Points(&mut fan, sobol, first, seed));
        let warped = warp(&mut fan.x, &mut fan.y);
        arch.dispatch(Directions(&mut fan));
        (fan, warped)
    }

    /// Direction k about a unit `normal`, a unit vector.
    #[inline]
    pub fn direction(&self, k: usize, normal: Vec3) -> Vec3 {
        turned(normal, Vec3::new(self.x[k], self.y[k], self.z[k]))
    }

    /// Dimension 2 of point k, in [0, 1).
    #[inline]
    pub fn third(&self, k: usize) -> f32 {
        self.third[k]
    }
}

/// Makes the points; those of dimensions 0 and 1 in the place of x and y.
struct Points<'a>(&'a mut Fan, &'a Sobol, u32, u32);

impl WithSimd for Points<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Points(fan, sobol, first, seed) = self;
        sobol.fill(first, 0, seed, &mut fan.x);
        sobol.fill(first, 1, seed, &mut fan.y);
        sobol.fill(first, 2, seed, &mut fan.third);
    }
}

/// Makes directions of the points.
struct Directions<'a>(&'a mut Fan);

impl WithSimd for Directions<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Directions(fan) = self;
        for k in 0..FAN {
            (fan.x[k], fan.y[k], fan.z[k]) = about_z(fan.x[k], fan.y[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::warp::cosine_direction;

    #[test]
    fn directions_are_those_of_the_points_one_by_one() {
        // Some of the points are tabled, the last ones are not.
        let sobol = Sobol::new(48, 3);
        for (first, seed) in [(0, 1), (16, 2), (40, 3), (200, 4)] {
            let fan = Fan::new(&sobol, first, seed);
            for (k, index) in (0..FAN).zip(first..) {
                let normal = Vec3::new(0.36, -0.48, 0.8);
                let [u, v, w] = [0, 1, 2].map(|d| sobol.point(index, d, seed));
                assert_eq!(fan.direction(k, normal), cosine_direction(normal, u, v));
                assert_eq!(fan.third(k), w);
            }
        }
    }

    #[test]
    fn directions_are_unit_vectors_to_rounding() {
        let sobol = Sobol::new(4096, 3);
        for first in (0..4096).step_by(FAN) {
            let fan = Fan::new(&sobol, first, 7);
            for k in 0..FAN {
                let length = fan.direction(k, Vec3::NEG_Z).length();
                // Some ten roundings of 6e-8.
                assert!((length - 1.0).abs() < 6e-7, "{length}");
            }
        }
    }
}
