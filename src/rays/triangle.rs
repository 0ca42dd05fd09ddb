//! The watertight meeting of a line and a triangle.
//!
//! The ray is sheared so that it becomes the z axis; the triangle is met where the three edge functions of its
//! projection agree in sign. Two triangles that share an edge compute that edge's function from the same two
//! projected points, with opposite sign and the same rounding, so no ray slips between them. Where a function is
//! exactly 0 it is computed again in f64, in which the products are exact.
//!
//! Not handled: choosing which meeting counts (t range, the face a ray starts on); that is the tree's.
//!
//! Source: S. Woop, C. Benthin, I. Wald, *Watertight ray/triangle intersection*, JCGT 2(1), 2013.

use glam::{Vec3, Vec3A, Vec3Swizzles};
use obvhs::aabb::Aabb;

use crate::rays::ray::Side;

/// Three corners, one register for each axis: register 0 holds the corners' x.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle(pub [Vec3A; 3]);

/// Where a line meets a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meeting {
    /// Distance along the unit direction; negative behind the origin.
    pub t: f32,
    pub side: Side,
    /// Barycentric weight of the second corner.
    pub u: f32,
    /// Barycentric weight of the third corner.
    pub v: f32,
}

/// The per-ray half of the test: the shear that turns the ray into the z axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shear {
    /// Which axis becomes x, y and z; z is the one along which the ray runs fastest.
    pub axes: [usize; 3],
    /// The ray's origin along those axes.
    pub origin: [f32; 3],
    /// What a unit of z adds to x and to y, and z's own factor.
    pub slope: [f32; 3],
}

impl Triangle {
    /// Meets no line.
    pub(crate) const NOTHING: Triangle = Triangle([Vec3A::NAN; 3]);

    pub(crate) fn new([a, b, c]: [Vec3; 3]) -> Self {
        Triangle([0, 1, 2].map(|axis| Vec3A::new(a[axis], b[axis], c[axis])))
    }

    /// Its bounding box, wider by `pad` on every side.
    pub(crate) fn padded_box(&self, pad: f32) -> Aabb {
        let low = Vec3A::from_array(self.0.map(Vec3A::min_element));
        let high = Vec3A::from_array(self.0.map(Vec3A::max_element));
        Aabb::new(low - pad, high + pad)
    }
}

impl Shear {
    /// The shear of the ray from `origin` along the unit vector `direction`.
    #[inline]
    pub(crate) fn new(origin: Vec3A, direction: Vec3A) -> Self {
        let size = direction.abs();
        let z = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        // The winding is kept: the two other axes change places when the ray runs down its main axis.
        let way = direction.to_array();
        let (next, last) = ([1, 2, 0][z], [2, 0, 1][z]);
        let down = way[z] < 0.0;
        let axes = [if down { last } else { next }, if down { next } else { last }, z];
        let scale = 1.0 / way[z];
        let from = origin.to_array();
        Shear {
            axes,
            origin: axes.map(|axis| from[axis]),
            slope: [-way[axes[0]] * scale, -way[axes[1]] * scale, scale],
        }
    }

    /// Where the line meets the triangle; `None` if it misses it or runs within its plane.
    #[inline(always)]
    pub(crate) fn meet(&self, triangle: &Triangle) -> Option<Meeting> {
        // Each sheared corner depends on the corner and the ray alone: neighbours agree on it to the bit.
        let along = |k: usize| triangle.0[self.axes[k]] - Vec3A::splat(self.origin[k]);
        let z = along(2);
        let (px, py) = (along(0) + z * self.slope[0], along(1) + z * self.slope[1]);
        let mut edges = edge_functions(px, py);
        if edges.cmpeq(Vec3A::ZERO).any() {
            edges = exact_edges(px, py);
        }
        let outside = edges.cmplt(Vec3A::ZERO).any() && edges.cmpgt(Vec3A::ZERO).any();
        let det = edges.x + edges.y + edges.z;
        if outside || det == 0.0 {
            return None;
        }
        let inverse = 1.0 / det;
        let t = edges.dot(z * self.slope[2]) * inverse;
        Some(Meeting::new(t, edges, inverse))
    }
}

impl Meeting {
    #[inline(always)]
    fn new(t: f32, edges: Vec3A, inverse: f32) -> Self {
        let side = if inverse > 0.0 { Side::Front } else { Side::Back };
        let u = edges.y * inverse;
        // On the edge opposite the first corner u + v is exactly 1, so that `on_edge` can be read off u and v.
        let v = if edges.x == 0.0 { 1.0 - u } else { edges.z * inverse };
        Meeting { t, side, u, v }
    }
}

/// `py x px`: the three edge functions, each of the two corners of its edge.
///
/// Written out because the library's cross product uses fused multiply-adds where the machine has them, and then a
/// shared edge's two functions are no longer each other's negative.
#[inline(always)]
fn edge_functions(px: Vec3A, py: Vec3A) -> Vec3A {
    py.yzx() * px.zxy() - py.zxy() * px.yzx()
}

/// The edge functions in f64: products of two f32 are exact there, so only a true 0 stays 0.
#[cold]
fn exact_edges(px: Vec3A, py: Vec3A) -> Vec3A {
    let (px, py) = (px.as_dvec3(), py.as_dvec3());
    py.cross(px).as_vec3a()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meet(origin: Vec3, direction: Vec3, corners: [Vec3; 3]) -> Option<Meeting> {
        Shear::new(origin.into(), direction.into()).meet(&Triangle::new(corners))
    }

    #[test]
    fn the_front_is_where_the_corners_run_counter_clockwise() {
        for axis in 0..3 {
            let mut corners = [Vec3::ZERO; 3];
            corners[1][(axis + 1) % 3] = 1.0;
            corners[2][(axis + 2) % 3] = 1.0;
            for sign in [1.0, -1.0] {
                let mut origin = Vec3::splat(0.25);
                origin[axis] = 2.0 * sign;
                let mut direction = Vec3::ZERO;
                direction[axis] = -sign;
                let meeting = meet(origin, direction, corners).unwrap();
                let expected = if sign > 0.0 { Side::Front } else { Side::Back };
                assert_eq!(meeting.side, expected);
                assert_eq!((meeting.t, meeting.u, meeting.v), (2.0, 0.25, 0.25));
            }
        }
    }

    #[test]
    fn a_point_on_an_edge_has_a_weight_of_exactly_zero() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for (x, y) in [(0.5, 0.0), (0.0, 0.3), (0.25, 0.75), (0.0, 0.0)] {
            let m = meet(Vec3::new(x, y, 1.0), Vec3::NEG_Z, corners).unwrap();
            assert!(m.u == 0.0 || m.v == 0.0 || m.u + m.v == 1.0);
        }
    }
}
