//! Lambert's closed form: the form factor from a point to polygons and meshes, clipped to the point's horizon.
//!
//! `F = 1/(2 pi) |sum over edges of angle_e (n · Gamma_e)|`, with `angle_e` the angle the edge subtends at the point
//! and `Gamma_e` the unit normal of the plane through point and edge (Lambert 1760; Baum, Rushmeier and Winget 1989).
//! Double precision: a polygon of solid angle Omega loses sqrt(Omega) of the digits.
//!
//! Over an edge that two triangles of a mesh share the terms cancel where the point sees both from the front and above
//! its horizon. So the sum runs over the outline of the visible triangles, and triangles cut by the horizon are clipped
//! one by one: a luminaire of a hundred triangles costs little more than its rim.
//!
//! Not handled: visibility, also of triangles of a mesh behind others of it; a point on the polygon itself, where the
//! form factor is discontinuous.

use std::collections::HashMap;

use glam::DVec3;

use crate::form_factors::plane::{ON_FACE, towards};
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
    let sum = if corners.iter().all(|p| p.dot(n) >= 0.0) {
        signed_edges(n, corners)
    } else {
        let (clipped, count) = clip_to_horizon(n, corners);
        signed_edges(n, &clipped[..count])
    };
    sum.abs() / std::f64::consts::TAU
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

/// A triangle mesh with its edges.
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    corners: Vec<DVec3>,
    faces: Vec<Face>,
    edges: Vec<Edge>,
}

#[derive(Clone, Debug)]
struct Face {
    corners: [u32; 3],
    /// The plane `normal · x = offset` with a unit normal, front where it is greater.
    normal: DVec3,
    offset: f64,
}

/// An edge from a to b as `left` runs through it; `right` runs the other way.
#[derive(Clone, Debug)]
struct Edge {
    a: u32,
    b: u32,
    left: u32,
    right: Option<u32>,
}

impl Outline {
    /// The largest mesh this handles.
    pub const MOST_FACES: usize = 512;

    /// Finds the edges of a mesh; `None` where it has too many faces. Triangles are counter-clockwise from the front.
    pub fn new(triangles: impl ExactSizeIterator<Item = [DVec3; 3]>) -> Option<Outline> {
        if triangles.len() > Outline::MOST_FACES {
            return None;
        }
        let mut mesh = Outline { corners: Vec::new(), faces: Vec::new(), edges: Vec::new() };
        let mut known: HashMap<[u64; 3], u32> = HashMap::new();
        for triangle in triangles {
            let corners = triangle.map(|p| {
                *known.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
                    mesh.corners.push(p);
                    mesh.corners.len() as u32 - 1
                })
            });
            let [a, b, c] = triangle;
            let normal = (b - a).cross(c - a).normalize_or_zero();
            mesh.faces.push(Face { corners, normal, offset: normal.dot(a) });
        }
        mesh.find_edges();
        Some(mesh)
    }

    /// Pairs every directed edge with the opposite one, if there is just one face on either side.
    fn find_edges(&mut self) {
        let mut open: HashMap<(u32, u32), usize> = HashMap::new();
        for (k, face) in self.faces.iter().enumerate() {
            for i in 0..3 {
                let (a, b) = (face.corners[i], face.corners[(i + 1) % 3]);
                if let Some(edge) = open.remove(&(b, a)) {
                    self.edges[edge].right = Some(k as u32);
                } else {
                    open.insert((a, b), self.edges.len());
                    self.edges.push(Edge { a, b, left: k as u32, right: None });
                }
            }
        }
    }

    /// Form factor from the point x with unit normal n to the mesh's front, nothing between; faces that x lies on count
    /// for nothing.
    pub fn form(&self, x: DVec3, n: DVec3) -> f64 {
        let mut seen = [false; Outline::MOST_FACES];
        let mut sum = 0.0;
        let at = |k: u32| self.corners[k as usize] - x;
        // Sort faces into whole, cut by the horizon, and unseen.
        for (k, face) in self.faces.iter().enumerate() {
            if face.normal.dot(x) <= face.offset + ON_FACE {
                continue;
            }
            let corners = face.corners.map(at);
            let heights = corners.map(|p| p.dot(n));
            if heights.iter().all(|&h| h >= 0.0) {
                seen[k] = true;
            } else if heights.iter().any(|&h| h > 0.0) {
                let (clipped, count) = clip_to_horizon(n, &corners);
                sum += signed_edges(n, &clipped[..count]);
            }
        }
        // Sum over the outline of the whole ones.
        for e in &self.edges {
            let (left, right) = (seen[e.left as usize], e.right.is_some_and(|r| seen[r as usize]));
            if left != right {
                let term = edge_term(n, at(e.a), at(e.b));
                sum += if left { term } else { -term };
            }
        }
        sum.abs() / std::f64::consts::TAU
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

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

    /// A bowl of triangles around the z axis, open upwards, wound to face inwards.
    fn bowl(sides: usize) -> Vec<[DVec3; 3]> {
        let rim = |k: usize, r: f64, z: f64| {
            let angle = (k % sides) as f64 / sides as f64 * std::f64::consts::TAU;
            DVec3::new(r * angle.cos(), r * angle.sin(), z)
        };
        let mut mesh = Vec::new();
        for k in 0..sides {
            let (a, b) = (rim(k, 0.5, 0.2), rim(k + 1, 0.5, 0.2));
            let (c, d) = (rim(k, 1.0, 1.0), rim(k + 1, 1.0, 1.0));
            mesh.push([DVec3::ZERO, a, b]);
            mesh.push([a, c, b]);
            mesh.push([b, c, d]);
        }
        mesh
    }

    proptest! {
        #[test]
        fn equals_the_sum_over_triangles(p in prop::array::uniform3(-2.0..2.0f64), q in prop::array::uniform3(-1.0..1.0f64)) {
            let (x, n) = (DVec3::from(p), DVec3::from(q));
            prop_assume!(n.length() > 0.1);
            let n = n.normalize();
            let mesh = bowl(12);
            let sum: f64 = mesh.iter().map(|t| point_to_polygon(n, &t.map(|p| p - x))).sum();
            let form = Outline::new(mesh.iter().copied()).unwrap().form(x, n);
            // A few hundred terms of at most pi, each to f64 rounding.
            prop_assert!((form - sum).abs() < 1e-12, "{form} {sum}");
        }
    }

    #[test]
    fn large_meshes_are_left_to_others() {
        let many = vec![[DVec3::X, DVec3::Y, DVec3::Z]; Outline::MOST_FACES + 1];
        assert!(Outline::new(many.into_iter()).is_none());
    }
}
