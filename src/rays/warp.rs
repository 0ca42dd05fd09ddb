//! Directions by Lambert's cosine law and uniform points of a triangle, from two numbers in [0, 1).
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
pub(crate) fn turned(normal: Vec3, direction: Vec3) -> Vec3 {
    let (tangent, bitangent) = basis(normal);
    direction.x * tangent + direction.y * bitangent + direction.z * normal
}

/// [`cosine_direction`] about z. There are no branches in it, so that several can be made side by side.
#[inline(always)]
pub(crate) fn about_z(u1: f32, u2: f32) -> (f32, f32, f32) {
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

/// Sine and cosine of r pi/4 for r from -1 to 1, by their power series; what is left out is below 3e-8.
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
