//! Directions by Lambert's cosine law and uniform points of a triangle, from two numbers in [0, 1).
//!
//! Both maps preserve area and bend little, so well spread numbers give well spread directions and points.
//!
//! Sources: P. Shirley, K. Chiu, *A low distortion map between disk and square*, JGT 2(3), 1997; T. Duff et al., *Building an
//! orthonormal basis, revisited*, JCGT 6(1), 2017; E. Heitz, *A low-distortion map between triangle and square*, 2019.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::Vec3;

/// A unit direction about the unit `normal` with density cos(theta)/pi per steradian.
///
/// cos(theta) is at least 1e-6: no direction lies within the surface.
#[inline]
pub fn cosine_direction(normal: Vec3, u1: f32, u2: f32) -> Vec3 {
    let (tangent, bitangent) = basis(normal);
    let (x, y) = disk(u1, u2);
    let z = (1.0 - x * x - y * y).max(1e-12).sqrt();
    (x * tangent + y * bitangent + z * normal).normalize()
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

/// The concentric map of the unit square onto the unit disk.
#[inline]
fn disk(u1: f32, u2: f32) -> (f32, f32) {
    let (a, b) = (2.0 * u1 - 1.0, 2.0 * u2 - 1.0);
    if a == 0.0 && b == 0.0 {
        return (0.0, 0.0);
    }
    let (radius, angle) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, FRAC_PI_2 - FRAC_PI_4 * (a / b))
    };
    let (sin, cos) = angle.sin_cos();
    (radius * cos, radius * sin)
}
