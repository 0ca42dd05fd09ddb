//! The watertight meeting of a line and a triangle, and which of several meetings of a ray comes first.
//!
//! The ray is sheared so that it becomes the z axis; the triangle is met where the three edge functions of its
//! projection agree in sign. Two triangles that share an edge compute that edge's function from the same two
//! projected points, with opposite sign and the same rounding, so no ray slips between them. Where a function is
//! exactly 0 it is computed again in f64, in which the products are exact.
//!
//! Meetings that are close together are ordered by [`Candidate::precedes`], whatever order they are found in.
//!
//! Not handled: curved primitives; lines within the plane of a triangle, which miss it.
//!
//! Source: S. Woop, C. Benthin, I. Wald, *Watertight ray/triangle intersection*, JCGT 2(1), 2013.

use glam::{Vec3, Vec3A, Vec3Swizzles};
use obvhs::aabb::Aabb;

/// One meeting of a ray and a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, unit coordinates.
    pub t: f32,
    /// The face's index in the scene.
    pub face: u32,
    /// The side of the face the ray meets.
    pub side: Side,
    /// Barycentric weight of the face's second corner.
    pub u: f32,
    /// Barycentric weight of the face's third corner.
    pub v: f32,
}

/// A side of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// From which its corners run counter-clockwise.
    Front,
    /// The other.
    Back,
}

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
        // On the edge opposite the first corner u + v is exactly 1, so that u and v show that it is on the edge.
        let v = if edges.x == 0.0 { 1.0 - u } else { edges.z * inverse };
        Meeting { t, side, u, v }
    }

    /// The meeting as one with a face.
    #[inline]
    pub(crate) fn hit(&self, face: u32) -> Hit {
        Hit { t: self.t, face, side: self.side, u: self.u, v: self.v }
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

/// Two meetings further apart than this are not taken for the same place of one plane. t errs by about 2e-7 over the
/// cosine between ray and normal, so this covers all but the most grazing rays.
pub(crate) const SAME_PLACE: f32 = 1e-3;

/// No plane: nothing is skipped.
pub(crate) const NO_PLANE: u32 = u32::MAX;

/// What a triangle belongs to.
#[derive(Clone, Copy)]
pub(crate) struct Label {
    pub face: u32,
    pub plane: u32,
}

/// A ray made ready: where it runs, how far, and the planes it cannot meet.
pub(crate) struct Query {
    pub shear: Shear,
    pub origin: Vec3A,
    pub direction: Vec3A,
    pub end: f32,
    pub skip: [u32; 2],
}

impl Query {
    /// Meetings with `0 < t < end` of planes other than `skip`.
    #[inline]
    pub(crate) fn new(origin: Vec3A, direction: Vec3A, end: f32, skip: [u32; 2]) -> Self {
        // Zeros are made positive: -0.0 and its inverse would disagree in sign.
        let direction = direction + Vec3A::ZERO;
        Query { shear: Shear::new(origin, direction), origin, direction, end, skip }
    }

    /// The meeting with a triangle of a plane, if it is before `reach` and the plane is none to skip.
    #[inline(always)]
    pub(crate) fn candidate(&self, triangle: &Triangle, plane: u32, reach: f32) -> Option<Candidate> {
        let meeting = self.shear.meet(triangle)?;
        let within = meeting.t > 0.0 && meeting.t < reach;
        (within && plane != self.skip[0] && plane != self.skip[1]).then_some(Candidate { meeting, plane })
    }
}

/// A meeting that counts, and the plane of the triangle met.
#[derive(Clone, Copy)]
pub(crate) struct Candidate {
    pub meeting: Meeting,
    pub plane: u32,
}

/// Sorting key of a meeting: backs count as a few ulps further, so that of a thin sheet the front comes first.
#[inline]
pub(crate) fn depth(t: f32, side: Side) -> f32 {
    match side {
        Side::Front => t,
        Side::Back => t + 5e-7 * (1.0 + t),
    }
}

impl Candidate {
    /// Whether it is met before another: by depth, then front before back, then by face, which `by_face` compares.
    ///
    /// Within one plane, which a line meets once, the front comes first whatever the rounding of t.
    #[inline]
    pub(crate) fn precedes(&self, other: &Candidate, by_face: impl FnOnce() -> bool) -> bool {
        let (a, b) = (&self.meeting, &other.meeting);
        if self.plane == other.plane && a.side != b.side {
            return a.side == Side::Front;
        }
        let (near, far) = (depth(a.t, a.side), depth(b.t, b.side));
        near < far || (near == far && (a.side < b.side || (a.side == b.side && by_face())))
    }
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
