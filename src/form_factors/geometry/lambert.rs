//! Lambert's closed form: the form factor from a point to a polygon, clipped to the point's horizon.
//!
//! `F = 1/(2 pi) |sum over edges of angle_e (n · Gamma_e)|`, with `angle_e` the angle the edge subtends at the point
//! and `Gamma_e` the unit normal of the plane through point and edge (Lambert 1760; Baum, Rushmeier and Winget 1989).
//! Double precision: a polygon of solid angle Omega loses sqrt(Omega) of the digits.
//!
//! Not handled: visibility; a point on the polygon itself, where the form factor is discontinuous.

use glam::DVec3;

use crate::form_factors::geometry::plane::towards;
use crate::scene::convex_polygon::cut;

/// Form factor from a point at the origin with unit normal `n` to the side of a triangle that faces it.
///
/// `corners` are relative to the point, counter-clockwise seen from the front; 0 where the point is behind or in the
/// triangle's plane. Irradiance is `pi F L`.
pub fn point_to_polygon(n: DVec3, corners: &[DVec3; 3]) -> f64 {
    let [a, b, c] = *corners;
    // The point sees the front if it lies on the side that the normal points to.
    if a.dot((b - a).cross(c - a)) >= 0.0 {
        return 0.0;
    }
    if corners.iter().all(|p| p.dot(n) >= 0.0) {
        return edges(n, corners);
    }
    let (clipped, count) = clip_to_horizon(n, corners);
    edges(n, &clipped[..count])
}

/// Lambert's formula for a polygon above the horizon.
fn edges(n: DVec3, polygon: &[DVec3]) -> f64 {
    signed_edges(n, polygon).abs() / std::f64::consts::TAU
}

/// Lambert's sum over the edges of a polygon above the horizon; its sign is that of the polygon's turning.
pub(crate) fn signed_edges(n: DVec3, polygon: &[DVec3]) -> f64 {
    let next = |k: usize| polygon[(k + 1) % polygon.len()];
    let terms = polygon.iter().enumerate();
    terms.map(|(k, &a)| edge_term(n, a, next(k))).sum()
}

/// The angle from a to b times `n · Gamma`, Gamma the unit normal of the plane through both and the point.
#[inline]
pub(crate) fn edge_term(n: DVec3, a: DVec3, b: DVec3) -> f64 {
    let normal = a.cross(b);
    let sine = normal.length();
    // An edge seen end on spans no angle.
    if sine > 0.0 { sine.atan2(a.dot(b)) / sine * n.dot(normal) } else { 0.0 }
}

/// The part of a triangle above the horizon of a point at the origin with normal n: up to four corners, and how many.
pub(crate) fn clip_to_horizon(n: DVec3, corners: &[DVec3; 3]) -> ([DVec3; 4], usize) {
    let (mut out, mut count) = ([DVec3::ZERO; 4], 0);
    cut(
        corners,
        |p| p.dot(n),
        towards,
        |p, [above, _]| {
            if above {
                out[count] = p;
                count += 1;
            }
        },
    );
    (out, count)
}

/// The kernel `cos cos / (pi r²)` between two points with unit normals, 0 where either does not face the other.
pub fn point_kernel(x: DVec3, n: DVec3, y: DVec3, m: DVec3) -> f64 {
    let d = y - x;
    let (leaving, arriving) = (d.dot(n), -d.dot(m));
    if leaving <= 0.0 || arriving <= 0.0 {
        return 0.0;
    }
    let squared = d.length_squared();
    leaving * arriving / (std::f64::consts::PI * squared * squared)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both triangles of the unit square [0, 1]² at height h above the origin, facing down.
    fn square(h: f64) -> [[DVec3; 3]; 2] {
        let p = |x: f64, y: f64| DVec3::new(x, y, h);
        [[p(0.0, 0.0), p(1.0, 1.0), p(1.0, 0.0)], [p(0.0, 0.0), p(0.0, 1.0), p(1.0, 1.0)]]
    }

    /// Differential element below the corner of a parallel a×b rectangle at distance c (Howell's catalogue, B-3).
    fn corner(a: f64, b: f64, c: f64) -> f64 {
        let (x, y) = (a / c, b / c);
        let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        (x / p * (y / p).atan() + y / q * (x / q).atan()) / std::f64::consts::TAU
    }

    #[test]
    fn parallel_square_matches_the_catalogue() {
        for h in [1e-3, 0.1, 1.0, 10.0, 1e4] {
            let sum: f64 = square(h).iter().map(|t| point_to_polygon(DVec3::Z, t)).sum();
            let exact = corner(1.0, 1.0, h);
            // Cancellation: terms of the size of the edge's angle 1/h sum to a result of 1/h².
            let digits = 1e-15 * h.max(1.0) * 10.0;
            assert!((sum / exact - 1.0).abs() < digits, "{h}: {sum} {exact}");
        }
    }

    #[test]
    fn behind_below_and_edge_on_give_nothing() {
        let [t, _] = square(1.0);
        assert_eq!(point_to_polygon(DVec3::NEG_Z, &t), 0.0);
        assert_eq!(point_to_polygon(DVec3::Z, &square(-1.0)[0]), 0.0);
        assert_eq!(point_to_polygon(DVec3::Z, &square(0.0)[0]), 0.0);
    }

    #[test]
    fn a_polygon_that_crosses_the_horizon_is_cut_there() {
        // A wall in the plane x = 1, from below the floor to height 1, facing the point: only z > 0 counts.
        let p = |y: f64, z: f64| DVec3::new(1.0, y, z);
        let form = |low: f64| {
            let wall = [[p(0.0, low), p(0.0, 1.0), p(1.0, 1.0)], [p(0.0, low), p(1.0, 1.0), p(1.0, low)]];
            wall.iter().map(|t| point_to_polygon(DVec3::Z, t)).sum::<f64>()
        };
        assert!((form(-3.0) - form(0.0)).abs() < 1e-15);
        assert!(form(0.0) > 0.01);
    }
}
