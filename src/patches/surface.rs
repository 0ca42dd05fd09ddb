//! Surfaces: faces of one plane, one orientation, one object and one material that touch each other.
//!
//! Each has a rectangular frame (u, v) in its plane, turned so that the rectangle around it is smallest.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec3};

use crate::rays::Rays;
use crate::scene::Scene;

/// A maximal set of touching coplanar faces with its (u, v) frame.
#[derive(Debug)]
pub(super) struct Surface {
    pub faces: Vec<u32>,
    pub material: u32,
    pub area: f64,
    pub normal: DVec3,
    /// Corner of the rectangle with the smallest u and v.
    pub origin: DVec3,
    /// Unit vectors of u and v; `cross(u, v)` is the normal.
    pub axes: [DVec3; 2],
    /// Width and height of the rectangle, the longer first.
    pub extent: [f64; 2],
}

impl Surface {
    /// Columns and rows of a grid of about `size`.
    pub fn divisions(&self, size: f64) -> [usize; 2] {
        self.extent
            .map(|e| ((e / size).round().clamp(1.0, 4096.0)) as usize)
    }

    /// Expected number of patches of a grid of about `size`: the cells that the surface covers.
    pub fn cells(&self, size: f64) -> f64 {
        let [columns, rows] = self.divisions(size).map(|n| n as f64);
        let covered = self.area / (self.extent[0] * self.extent[1]);
        (columns * rows * covered).ceil().max(1.0)
    }

    /// (u, v) of a point, in the surface's units.
    pub fn uv(&self, p: DVec3) -> DVec2 {
        let d = p - self.origin;
        DVec2::new(d.dot(self.axes[0]), d.dot(self.axes[1]))
    }
}

/// Unit normal of a triangle, by the right-hand rule.
pub(super) fn normal(corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a).normalize_or(DVec3::Z)
}

/// All surfaces of a scene, in the order of their first faces.
pub(super) fn find(scene: &Scene, rays: &Rays) -> Vec<Surface> {
    let roots = connected(scene, rays);
    let mut order: HashMap<u32, usize> = HashMap::new();
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for (face, root) in roots.into_iter().enumerate() {
        let k = *order.entry(root).or_insert_with(|| {
            faces.push(Vec::new());
            faces.len() - 1
        });
        faces[k].push(face as u32);
    }
    faces.into_iter().map(|f| measure(scene, f)).collect()
}

/// Representative face of every face's surface (union-find over shared corners).
fn connected(scene: &Scene, rays: &Rays) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..scene.faces.len() as u32).collect();
    let mut first: HashMap<([u32; 3], u32, u32, bool), u32> = HashMap::new();
    for face in 0..scene.faces.len() as u32 {
        let n = normal(scene.corners(face));
        let outward = n.x + 0.7 * n.y + 0.3 * n.z > 0.0;
        let material = scene.faces[face as usize].material;
        for corner in scene.corners(face) {
            // Corners are compared by position: exporters repeat vertices.
            let position = corner.to_array().map(|x| (x + 0.0).to_bits());
            let key = (position, rays.plane(face), material, outward);
            let other = *first.entry(key).or_insert(face);
            join(&mut parents, face, other);
        }
    }
    (0..parents.len() as u32)
        .map(|f| root(&mut parents, f))
        .collect()
}

fn root(parents: &mut [u32], mut face: u32) -> u32 {
    while parents[face as usize] != face {
        parents[face as usize] = parents[parents[face as usize] as usize];
        face = parents[face as usize];
    }
    face
}

fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    let (low, high) = (a.min(b), a.max(b));
    parents[high as usize] = low;
}

/// Area, normal and the smallest rectangle around a surface's faces.
fn measure(scene: &Scene, faces: Vec<u32>) -> Surface {
    let corners: Vec<[DVec3; 3]> = faces
        .iter()
        .map(|&f| scene.corners(f).map(|p| p.as_dvec3()))
        .collect();
    let doubled: DVec3 = corners
        .iter()
        .map(|[a, b, c]| (*b - *a).cross(*c - *a))
        .sum();
    let normal = doubled.normalize_or(DVec3::Z);
    let (u, low, high) = smallest_rectangle(&corners, normal);
    let v = normal.cross(u);
    let size = high - low;
    let base = corners[0][0];
    let origin = base + u * low.x + v * low.y;
    let mut surface = Surface {
        material: scene.faces[faces[0] as usize].material,
        area: faces.iter().map(|&f| scene.area(f)).sum(),
        normal,
        origin,
        axes: [u, v],
        extent: [size.x, size.y],
        faces,
    };
    if size.y > size.x {
        // Turn by a right angle so that the longer side comes first: (u, v) -> (v, -u).
        surface.origin = origin + u * size.x;
        surface.axes = [v, -u];
        surface.extent = [size.y, size.x];
    }
    surface
}

/// Direction u, and the corners of the rectangle around the faces in (u, v), relative to the first corner.
fn smallest_rectangle(corners: &[[DVec3; 3]], normal: DVec3) -> (DVec3, DVec2, DVec2) {
    // Some edge of the convex hull lies on the best rectangle; 48 edges are enough for any shape one draws by hand.
    const EDGES: usize = 48;
    let base = corners[0][0];
    let edges = corners
        .iter()
        .flat_map(|[a, b, c]| [*b - *a, *c - *b, *a - *c]);
    let mut best: Option<(f64, DVec3, DVec2, DVec2)> = None;
    for edge in edges.take(EDGES) {
        let u = edge
            .reject_from_normalized(normal)
            .normalize_or(normal.any_orthonormal_vector());
        let v = normal.cross(u);
        let (mut low, mut high) = (DVec2::MAX, DVec2::MIN);
        for p in corners.iter().flatten() {
            let q = DVec2::new((*p - base).dot(u), (*p - base).dot(v));
            low = low.min(q);
            high = high.max(q);
        }
        let around = (high - low).element_product();
        // A hair of preference for the earlier edge keeps the choice stable under rounding.
        if best.is_none_or(|b| around < b.0 * (1.0 - 1e-6)) {
            best = Some((around, u, low, high));
        }
    }
    let (_, u, low, high) = best.expect("a surface has at least one face with three edges");
    (u, low, high)
}
