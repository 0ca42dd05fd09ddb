//! Directions by Lambert's cosine law, one or [`FAN`] at a time, and uniform points of a triangle, from two numbers in
//! [0, 1).
//!
//! A ray's direction costs as much as finding what it meets in a small scene; sixteen at a time in vector instructions
//! cost a fraction of that. The level of instructions is chosen at run time and changes no bit of the result.
//!
//! Both maps preserve area and bend little, so well spread numbers give well spread directions and points.
//!
//! Sources: P. Shirley, K. Chiu, *A low distortion map between disk and square*, JGT 2(3), 1997; T. Duff et al.,
//! *Building an orthonormal basis, revisited*, JCGT 6(1), 2017; E. Heitz, *A low-distortion map between triangle and
//! square*, 2019.
//!
//! Not handled: densities other than the cosine and the uniform one.

use std::f32::consts::FRAC_PI_4;

use glam::Vec3;
use pulp::{Arch, Simd, WithSimd};

use crate::rays::sobol::Sobol;

/// A unit direction about the unit `normal` with density cos(theta)/pi per steradian.
///
/// cos(theta) is at least 1e-6: no direction lies within the surface.
#[inline]
pub fn cosine_direction(normal: Vec3, u1: f32, u2: f32) -> Vec3 {
    let (x, y, z) = about_z(u1, u2);
    turned(normal, Vec3::new(x, y, z))
}

/// A uniform direction in the hemisphere about `normal`.
pub fn hemisphere_direction(normal: Vec3, u1: f32, u2: f32) -> Vec3 {
    let (sin, cos) = (2.0 * std::f32::consts::PI * u1).sin_cos();
    let across = (1.0 - u2 * u2).max(0.0).sqrt();
    turned(normal, Vec3::new(across * cos, across * sin, u2))
}

/// A direction given about z, turned to lie about `normal`.
#[inline(always)]
fn turned(normal: Vec3, direction: Vec3) -> Vec3 {
    let (tangent, bitangent) = basis(normal);
    direction.x * tangent + direction.y * bitangent + direction.z * normal
}

/// [`cosine_direction`] about z. There are no branches in it, so that several can be made side by side.
#[inline(always)]
fn about_z(u1: f32, u2: f32) -> (f32, f32, f32) {
    // The concentric map of the unit square onto the unit disk.
    let (a, b) = (2.0 * u1 - 1.0, 2.0 * u2 - 1.0);
    let wide = a.abs() > b.abs();
    let (radius, other) = if wide { (a, b) } else { (b, a) };
    let (sin, cos) = of_eighth(other / if radius == 0.0 { 1.0 } else { radius });
    let (along, across) = (radius * cos, radius * sin);
    let (x, y) = if wide { (along, across) } else { (across, along) };
    // x² + y² is the radius squared; the least z keeps the direction off the surface.
    let squared = 1.0 - radius * radius;
    let z = if squared > 1e-12 { squared } else { 1e-12 }.sqrt();
    (x, y, z)
}

/// Sine and cosine of r pi/4 for r from -1 to 1, by their power series; the remainder is below 3e-8.
#[inline(always)]
fn of_eighth(r: f32) -> (f32, f32) {
    const T: f32 = FRAC_PI_4;
    const SIN: [f32; 4] = [1.0 / 6.0, 1.0 / 20.0, 1.0 / 42.0, 1.0 / 72.0];
    const COS: [f32; 4] = [1.0 / 2.0, 1.0 / 12.0, 1.0 / 30.0, 1.0 / 56.0];
    let t2 = (T * r) * (T * r);
    let sin = 1.0 - t2 * SIN[0] * (1.0 - t2 * SIN[1] * (1.0 - t2 * SIN[2] * (1.0 - t2 * SIN[3])));
    let cos = 1.0 - t2 * COS[0] * (1.0 - t2 * COS[1] * (1.0 - t2 * COS[2] * (1.0 - t2 * COS[3])));
    (T * r * sin, cos)
}

/// Barycentric weights of the second and third corner of a uniform point of a triangle.
#[inline]
pub fn triangle_weights(u1: f32, u2: f32) -> (f32, f32) {
    if u2 > u1 {
        let half = 0.5 * u1;
        (half, u2 - half)
    } else {
        let half = 0.5 * u2;
        (u1 - half, half)
    }
}

/// A uniform point of a triangle.
#[inline]
pub fn triangle_point([a, b, c]: [Vec3; 3], u1: f32, u2: f32) -> Vec3 {
    let (u, v) = triangle_weights(u1, u2);
    (1.0 - u - v) * a + u * b + v * c
}

/// Two unit vectors that complete a unit `normal` to a right-handed orthonormal basis, for every normal.
#[inline]
pub fn basis(normal: Vec3) -> (Vec3, Vec3) {
    let n = normal;
    let sign = 1.0_f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    let tangent = Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    let bitangent = Vec3::new(b, sign + n.y * n.y * a, -n.y);
    (tangent, bitangent)
}

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
