//! Surfaces: faces of one plane, one orientation, one object and one material that touch each other.
//!
//! Each has a rectangular frame (u, v) in its plane, turned so that the rectangle around it is smallest.
//!
//! Faces touch where they share a corner: parts are found by union and find over corners.
//!
//! Not handled: smooth surfaces, each of whose facets is a surface; faces that touch without a common corner.

use std::hash::Hash;

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::rays::Rays;
use crate::scene::planes::by_plane;
use crate::scene::{Bounds, Scene};

/// A maximal set of touching coplanar faces with its (u, v) frame.
#[derive(Debug)]
pub(crate) struct Surface {
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
    pub(crate) fn divisions(&self, size: f64) -> [usize; 2] {
        self.extent.map(|e| ((e / size).round().clamp(1.0, 4096.0)) as usize)
    }

    /// Expected number of patches of a grid of about `size`: the cells that the surface covers.
    pub(crate) fn cells(&self, size: f64) -> f64 {
        let [columns, rows] = self.divisions(size).map(|n| n as f64);
        let covered = self.area / (self.extent[0] * self.extent[1]);
        (columns * rows * covered).ceil().max(1.0)
    }

    /// (u, v) of a point, in the surface's units.
    pub(crate) fn uv(&self, p: DVec3) -> DVec2 {
        let d = p - self.origin;
        DVec2::new(d.dot(self.axes[0]), d.dot(self.axes[1]))
    }
}

/// Unit normal of a triangle, by the right-hand rule.
pub(crate) fn normal(corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a).normalize_or(DVec3::Z)
}

/// All surfaces of a scene, in the order of their first faces.
pub(crate) fn find(scene: &Scene, rays: &Rays) -> Vec<Surface> {
    let planes: Vec<u32> = (0..scene.faces.len() as u32).map(|face| rays.plane(face)).collect();
    let (faces, starts) = by_plane(&planes);
    let planes = starts.par_windows(2);
    let kind = |face: u32| {
        let n = normal(scene.corners(face));
        let outward = n.x + 0.7 * n.y + 0.3 * n.z > 0.0;
        (scene.faces[face as usize].material, outward)
    };
    let connected = planes.flat_map_iter(|range| {
        let own = &faces[range[0] as usize..range[1] as usize];
        connected(scene, own, kind)
    });
    let mut parts: Vec<Vec<u32>> = connected.collect();
    parts.par_sort_unstable_by_key(|faces| faces[0]);
    parts.into_par_iter().map(|f| measure(scene, f)).collect()
}

/// Connected parts of `faces`: faces of one `kind` that share a corner. Parts and the faces of each keep their
/// order.
pub(crate) fn connected<K: Copy + Eq + Hash>(scene: &Scene, faces: &[u32], kind: impl Fn(u32) -> K) -> Vec<Vec<u32>> {
    if let [face] = faces {
        return vec![vec![*face]];
    }
    let mut parents: Vec<u32> = (0..faces.len() as u32).collect();
    let mut first: FxHashMap<([u32; 3], K), u32> = FxHashMap::default();
    for (k, &face) in (0u32..).zip(faces) {
        let kind = kind(face);
        for corner in scene.corners(face) {
            // Corners are compared by position: exporters repeat vertices.
            let position = corner.to_array().map(|x| (x + 0.0).to_bits());
            let other = *first.entry((position, kind)).or_insert(k);
            let (a, b) = (root(&mut parents, k), root(&mut parents, other));
            // The first face of a part is its root.
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    let mut parts: Vec<Vec<u32>> = vec![Vec::new(); faces.len()];
    for (k, &face) in (0u32..).zip(faces) {
        parts[root(&mut parents, k) as usize].push(face);
    }
    parts.retain(|faces| !faces.is_empty());
    parts
}

/// The root of k in a forest, whose paths it halves.
fn root(parents: &mut [u32], mut k: u32) -> u32 {
    while parents[k as usize] != k {
        parents[k as usize] = parents[parents[k as usize] as usize];
        k = parents[k as usize];
    }
    k
}

/// Area, normal and the smallest rectangle around a surface's faces.
fn measure(scene: &Scene, faces: Vec<u32>) -> Surface {
    let corners: Vec<[DVec3; 3]> = faces.iter().map(|&f| scene.corners(f).map(|p| p.as_dvec3())).collect();
    let doubled: DVec3 = corners.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).sum();
    let normal = doubled.normalize_or(DVec3::Z);
    let (u, bounds) = smallest_rectangle(&corners, normal);
    let v = normal.cross(u);
    let size = bounds.size();
    let base = corners[0][0];
    let origin = base + u * bounds.low.x + v * bounds.low.y;
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

/// Direction u, and the rectangle around the faces in (u, v), relative to the first corner.
pub(crate) fn smallest_rectangle(corners: &[[DVec3; 3]], normal: DVec3) -> (DVec3, Bounds<DVec2>) {
    // Some edge of the convex hull lies on the best rectangle; 48 edges are enough for any shape one draws by hand.
    const EDGES: usize = 48;
    // From so many faces on the edges are tried by several threads.
    const MANY: usize = 1000;
    let base = corners[0][0];
    let edges = corners.iter().flat_map(|[a, b, c]| [*b - *a, *c - *b, *a - *c]);
    let around = |edge: DVec3| {
        let u = edge.reject_from_normalized(normal).normalize_or(normal.any_orthonormal_vector());
        let v = normal.cross(u);
        let flat = |p: &DVec3| DVec2::new((*p - base).dot(u), (*p - base).dot(v));
        (u, Bounds::of(corners.iter().flatten().map(flat)))
    };
    let edges = edges.take(EDGES);
    // A hair of preference for the earlier edge keeps the choice stable under rounding.
    let area = |(_, bounds): &(DVec3, Bounds<DVec2>)| bounds.size().element_product();
    let lesser = |best, next| if area(&next) < area(&best) * (1.0 - 1e-6) { next } else { best };
    let best = if corners.len() > MANY {
        let edges: Vec<DVec3> = edges.collect();
        let tried: Vec<_> = edges.into_par_iter().map(around).collect();
        tried.into_iter().reduce(lesser)
    } else {
        edges.map(around).reduce(lesser)
    };
    best.expect("a surface has at least one face with three edges")
}
