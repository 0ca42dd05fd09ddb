//! A smooth function over a flat patch: the polynomial through 4×4 Chebyshev points of the rectangle around it.
//!
//! What far luminaires send is analytic in the receiving point: with half sides h and the nearest singularity at r the
//! error falls as (h/2r)⁴. So the sum over any number of luminaires is made once a patch, not once a camera ray.
//!
//! Not handled: curved patches.

use glam::{DVec3, Vec3};

use crate::patches::Patches;
use crate::surfaces::coplanar::smallest_rectangle;

/// Points along a side.
pub(crate) const SIDE: usize = 4;
/// Chebyshev points of (-1, 1): the cosines of odd multiples of pi/8.
const NODES: [f64; SIDE] =
    [0.923_879_532_511_286_8, 0.382_683_432_365_089_8, -0.382_683_432_365_089_8, -0.923_879_532_511_286_8];
/// Corners off the plane by more than this share of the patch's size make it curved.
const FLAT: f64 = 1e-4;

/// The rectangle around a flat patch.
#[derive(Clone, Debug)]
pub(crate) struct Rectangle {
    pub center: DVec3,
    pub normal: DVec3,
    /// From the centre to the middles of two sides.
    pub half: [DVec3; 2],
}

impl Rectangle {
    /// The smallest along an edge of the patch; `None` for a curved patch.
    pub(crate) fn new(patches: &Patches, i: usize) -> Option<Rectangle> {
        let side = patches.side(i);
        let (first, _) = patches.pieces(i).next()?;
        let normal = patches.normal(first, side).as_dvec3().normalize();
        let level = |face: u32| patches.normal(face, side).as_dvec3().dot(normal) > 1.0 - 1e-6;
        if !patches.pieces(i).all(|(face, _)| level(face)) {
            return None;
        }
        let triangles: Vec<[DVec3; 3]> = patches.pieces(i).map(|p| p.1.map(|q| q.as_dvec3())).collect();
        let (u, bounds) = smallest_rectangle(&triangles, normal);
        let (middle, half) = (bounds.middle(), 0.5 * bounds.size());
        let v = normal.cross(u);
        let center = triangles[0][0] + middle.x * u + middle.y * v;
        let found = Rectangle { center, normal, half: [half.x * u, half.y * v] };
        let flat = |p: &DVec3| (*p - center).dot(normal).abs() <= FLAT * found.radius();
        (half.element_product() > 0.0 && triangles.iter().flatten().all(flat)).then_some(found)
    }

    /// Distance from the centre to the corners.
    pub(crate) fn radius(&self) -> f64 {
        (self.half[0].length_squared() + self.half[1].length_squared()).sqrt()
    }

    /// The point at (s, t), each from -1 to 1.
    pub(crate) fn point(&self, s: f64, t: f64) -> DVec3 {
        self.center + s * self.half[0] + t * self.half[1]
    }

    /// Tile k of side² equal ones.
    fn tile(&self, k: usize, side: usize) -> Rectangle {
        let place = |i: usize| (2 * i + 1) as f64 / side as f64 - 1.0;
        Rectangle {
            center: self.point(place(k % side), place(k / side)),
            normal: self.normal,
            half: self.half.map(|h| h / side as f64),
        }
    }

    /// Its corners, in order around it.
    pub(crate) fn corners(&self) -> [DVec3; 4] {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(s, t)| self.point(s, t))
    }

    /// The points that carry the polynomial.
    pub(crate) fn points(&self) -> [DVec3; SIDE * SIDE] {
        std::array::from_fn(|k| self.point(NODES[k % SIDE], NODES[k / SIDE]))
    }

    /// The polynomial with these values there, at x; at the nearest place of the rectangle where x lies outside it.
    ///
    /// Points of patches are rounded to single precision, and a patch may be thinner than that: its polynomial,
    /// evaluated at places hundreds of widths away, would be anything.
    pub(crate) fn interpolate(&self, values: &[Vec3; SIDE * SIDE], x: DVec3) -> DVec3 {
        let d = x - self.center;
        let [s, t] = self.half.map(|h| weights((d.dot(h) / h.length_squared()).clamp(-1.0, 1.0)));
        let mut sum = DVec3::ZERO;
        for (row, t) in values.chunks_exact(SIDE).zip(t) {
            for (value, s) in row.iter().zip(s) {
                sum += s * t * value.as_dvec3();
            }
        }
        sum
    }
}

/// Polynomials on equal tiles of a rectangle.
#[derive(Clone, Debug)]
pub(crate) struct Tiles {
    pub rectangle: Rectangle,
    /// Tiles along a side.
    pub side: usize,
    pub values: Vec<[Vec3; SIDE * SIDE]>,
}

impl Tiles {
    /// On as few tiles as make the polynomials fit within a share of the function, where some do.
    pub(crate) fn new(rectangle: &Rectangle, misfit: f64, function: impl Fn(DVec3) -> DVec3) -> Option<Tiles> {
        [1, 2, 4].into_iter().find_map(|side| {
            let fitted = (0..side * side).map(|k| {
                let tile = rectangle.tile(k, side);
                let values = tile.points().map(|x| function(x).as_vec3());
                let fits = |(s, t): (f64, f64)| {
                    let x = tile.point(s, t);
                    let exact = function(x);
                    let off = (tile.interpolate(&values, x) - exact).abs();
                    let most = values.iter().fold(Vec3::ZERO, |m, v| m.max(*v));
                    off.cmple(misfit * most.as_dvec3()).all()
                };
                [(0.0, 0.0), (0.7, 0.7)].into_iter().all(fits).then_some(values)
            });
            let values: Option<Vec<_>> = fitted.collect();
            let rectangle = rectangle.clone();
            values.map(|values| Tiles { rectangle, side, values })
        })
    }

    /// The polynomial at x.
    pub(crate) fn at(&self, x: DVec3) -> DVec3 {
        let d = x - self.rectangle.center;
        let [i, j] = self.rectangle.half.map(|h| {
            let place = 0.5 * (d.dot(h) / h.length_squared() + 1.0) * self.side as f64;
            (place.max(0.0) as usize).min(self.side - 1)
        });
        let k = i + j * self.side;
        let tile = self.rectangle.tile(k, self.side);
        tile.interpolate(&self.values[k], x)
    }
}

/// Lagrange's polynomials of the Chebyshev points at x.
fn weights(x: f64) -> [f64; SIDE] {
    std::array::from_fn(|k| {
        let others = (0..SIDE).filter(|&j| j != k);
        others.map(|j| (x - NODES[j]) / (NODES[k] - NODES[j])).product()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Extrapolated over hundreds of widths, light on a patch 1e-10 wide would be 1e18 times too much.
    #[test]
    fn a_patch_thinner_than_rounding_has_the_light_of_its_place() {
        let thin = Rectangle { center: DVec3::ZERO, normal: DVec3::Z, half: [DVec3::X, 1e-10 * DVec3::Y] };
        let light = |p: DVec3| DVec3::splat(1.0 + 0.25 * p.x + 0.1 * p.y);
        let tiles = Tiles::new(&thin, 1e-3, light).expect("smooth light");
        for outside in [-6e-8, 0.0, 6e-8] {
            let found = tiles.at(DVec3::new(0.3, outside, 0.0)).x;
            // Values are kept in single precision.
            assert!((found - 1.075).abs() < 1e-6, "{found}");
        }
    }

    #[test]
    fn cubics_pass_unchanged() {
        let unit =
            Rectangle { center: DVec3::new(0.1, 0.2, 0.3), normal: DVec3::Z, half: [DVec3::X * 0.5, DVec3::Y * 0.25] };
        let cubic = |p: DVec3| {
            let (x, y) = (p.x, p.y);
            DVec3::new(1.0, x * x * x - 2.0 * y * y * y * x, 3.0 * x * y - y)
        };
        let values = unit.points().map(|p| cubic(p).as_vec3());
        for (s, t) in [(0.0, 0.0), (0.9, -0.7), (-1.0, 1.0)] {
            let x = unit.point(s, t);
            // Values are kept in single precision; Lebesgue's constant of 4×4 points is below 4.
            let found = unit.interpolate(&values, x);
            assert!((found - cubic(x)).abs().max_element() < 4.0 * 2e-7, "{found}");
        }
    }
}
