//! Lambert's closed form for a mesh of triangles: only the edges that bound what the point sees count.
//!
//! Over an edge that two triangles share the terms of Lambert's sum cancel when the point sees both from the front
//! and above its horizon. So the sum runs over the outline of the visible triangles, and triangles cut by the horizon
//! are clipped one by one: a lamp of a hundred triangles costs little more than its rim.
//!
//! Not handled: triangles of the mesh that hide others of it; that is visibility.

use std::collections::HashMap;

use glam::DVec3;

use crate::form_factors::geometry::lambert::{clip_to_horizon, edge_term, signed_edges};
use crate::form_factors::geometry::plane::ON_FACE;

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

/// One bit for each face of a mesh of up to [`Outline::MOST_FACES`].
struct Bits([u64; Outline::MOST_FACES / 64]);

impl Bits {
    fn set(&mut self, k: u32) {
        self.0[k as usize / 64] |= 1 << (k % 64);
    }

    fn get(&self, k: u32) -> bool {
        self.0[k as usize / 64] >> (k % 64) & 1 == 1
    }
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
                    continue;
                }
                open.insert((a, b), self.edges.len());
                self.edges.push(Edge { a, b, left: k as u32, right: None });
            }
        }
    }

    /// Form factor from the point x with unit normal n to the mesh's front, nothing between; faces that x lies on count
    /// for nothing.
    pub fn form(&self, x: DVec3, n: DVec3) -> f64 {
        let mut seen = Bits([0; Outline::MOST_FACES / 64]);
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
                seen.set(k as u32);
            } else if heights.iter().any(|&h| h > 0.0) {
                let (clipped, count) = clip_to_horizon(n, &corners);
                sum += signed_edges(n, &clipped[..count]);
            }
        }
        // Sum over the outline of the whole ones.
        for e in &self.edges {
            let (left, right) = (seen.get(e.left), e.right.is_some_and(|r| seen.get(r)));
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
    use super::*;
    use crate::form_factors::geometry::lambert::point_to_polygon;
    use proptest::prelude::*;

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
