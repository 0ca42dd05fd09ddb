//! Where a ray that starts on a face truly starts: strictly inside the face, strictly on the side it leaves by.
//!
//! A point computed on a face is off by its rounding, about 2e-7 in unit coordinates. Next to an edge it may so lie
//! outside the closed room the face belongs to, and a ray from there escapes. So a point within [`MARGIN`] of an edge
//! is moved inwards along the face to that margin, and every point is lifted by [`LIFT`] to the side the ray leaves by.
//! Both are below the distance at which planes count as one, so no surface is jumped over.
//!
//! Not handled: corners sharper than about 1 in 2 (`LIFT / MARGIN`), and slivers narrower than the margin.

use glam::{Vec3, Vec3A};

use crate::scene::Scene;

/// Least distance to the face's edges; several roundings of a coordinate of size 1.
pub(crate) const MARGIN: f32 = 1e-6;

/// Distance to the face's plane; a few roundings.
pub(crate) const LIFT: f32 = 5e-7;

/// Points further outside their face than this are not on it; they stay where they are.
const FOREIGN: f32 = -1e-5;

/// The face's unit normal and its edges' inward distance functions, `(n, c)` with distance `n . p + c`: the edges' x, y
/// and z of n, then their c.
#[derive(Clone, Copy)]
pub(crate) struct RayOffset {
    normal: Vec3A,
    edges: [Vec3A; 4],
}

impl RayOffset {
    pub(crate) fn new(scene: &Scene, face: u32) -> Self {
        let corners = scene.corners(face).map(|c| c.as_dvec3());
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| {
            let inward = normal.cross(q - p).normalize_or_zero();
            inward.extend(-inward.dot(p)).as_vec4()
        });
        let column = |k: usize| Vec3A::from_array(edges.map(|edge| edge[k]));
        RayOffset { normal: normal.as_vec3a(), edges: [column(0), column(1), column(2), column(3)] }
    }

    /// The start of a ray that leaves the face at `point` towards `direction`; `corners` are the face's.
    #[inline]
    pub(crate) fn start(&self, point: Vec3A, direction: Vec3A, corners: impl FnOnce() -> [Vec3; 3]) -> Vec3A {
        self.moved(point, direction, [MARGIN, LIFT], corners)
    }

    /// The point from which a ray of that direction starts twice as far from the edges and the plane.
    pub(crate) fn twice(&self, point: Vec3A, direction: Vec3A, corners: [Vec3; 3]) -> Vec3A {
        self.moved(point, direction, [2.0 * MARGIN, LIFT], || corners)
    }

    #[inline(always)]
    fn moved(
        &self,
        point: Vec3A,
        direction: Vec3A,
        [margin, lift]: [f32; 2],
        corners: impl FnOnce() -> [Vec3; 3],
    ) -> Vec3A {
        let least = self.clearance(point).min_element();
        let point = if (FOREIGN..margin).contains(&least) { self.inside(point, margin, corners()) } else { point };
        point + lift.copysign(self.normal.dot(direction)) * self.normal
    }

    /// Distances to the three edges, negative outside.
    #[inline]
    fn clearance(&self, point: Vec3A) -> Vec3A {
        let [x, y, z, c] = self.edges;
        (x * point.x + y * point.y) + (z * point.z + c)
    }

    /// The point moved towards the centroid until it keeps the margin, or half of what the centroid has.
    #[cold]
    fn inside(&self, point: Vec3A, margin: f32, [a, b, c]: [Vec3; 3]) -> Vec3A {
        let centroid = Vec3A::from((a + b + c) / 3.0);
        let (here, there) = (self.clearance(point), self.clearance(centroid));
        let least = (0.5 * there).min(Vec3A::splat(margin));
        let way = (least - here) / (there - here);
        let short = here.cmplt(least);
        let share = Vec3A::select(short, way, Vec3A::ZERO).max_element();
        point + (centroid - point) * share.clamp(0.0, 1.0)
    }
}
