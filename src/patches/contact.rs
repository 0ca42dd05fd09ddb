//! Where other faces touch or cut a surface: the lines across which its light jumps.
//!
//! A box on a floor hides the floor under it. A patch that lies half under the box would carry the mean of a lit and
//! a buried half, and everyone who sees the lit half would read it too dark: an error that falls only with the first
//! power of the patch size. Cells are therefore cut along these lines (the D0 discontinuities of Heckbert 1992).
//!
//! Not handled: discontinuities of higher order, the edges of shadows.

use glam::{DVec2, DVec3};

use super::surface::Surface;
use crate::rays::Rays;
use crate::scene::Scene;

/// Distance in unit coordinates below which a corner lies in a plane: a few roundings of f32.
const TOUCHES: f64 = 2e-6;

/// Cells along each axis of the scene's box.
const VOXELS: usize = 32;

/// The faces of a scene, found by place.
pub(super) struct Contacts<'a> {
    scene: &'a Scene,
    rays: &'a Rays,
    /// Faces by voxel.
    voxels: Vec<Vec<u32>>,
}

impl<'a> Contacts<'a> {
    /// Sorts the faces into voxels.
    pub fn new(scene: &'a Scene, rays: &'a Rays) -> Self {
        let mut voxels = vec![Vec::new(); VOXELS * VOXELS * VOXELS];
        for face in 0..scene.faces.len() as u32 {
            let (low, high) = bounds(scene.corners(face).map(|p| p.as_dvec3()));
            for_voxels(low, high, |k, _| voxels[k].push(face));
        }
        Contacts {
            scene,
            rays,
            voxels,
        }
    }

    /// Segments in the surface's (u, v) along which faces of other planes touch or cut it.
    pub fn segments(&self, s: &Surface) -> Vec<[DVec2; 2]> {
        let [u, v] = [s.axes[0] * s.extent[0], s.axes[1] * s.extent[1]];
        let corners = [s.origin, s.origin + u, s.origin + v, s.origin + u + v];
        let (low, high) = bounds(corners);
        let mut faces = Vec::new();
        for_voxels(low, high, |k, middle| {
            let reach = 3f64.sqrt() / VOXELS as f64 + TOUCHES;
            if (middle - s.origin).dot(s.normal).abs() <= reach {
                faces.extend_from_slice(&self.voxels[k]);
            }
        });
        faces.sort_unstable();
        faces.dedup();
        let own = self.rays.plane(s.faces[0]);
        faces.retain(|&f| self.rays.plane(f) != own);
        faces.iter().filter_map(|&f| self.segment(s, f)).collect()
    }

    /// The segment in which a face meets the surface's plane.
    fn segment(&self, s: &Surface, face: u32) -> Option<[DVec2; 2]> {
        let corners = self.scene.corners(face).map(|p| p.as_dvec3());
        let heights = corners.map(|p| {
            let h = (p - s.origin).dot(s.normal);
            if h.abs() < TOUCHES { 0.0 } else { h }
        });
        let mut ends: Vec<DVec2> = Vec::with_capacity(2);
        for k in 0..3 {
            let next = (k + 1) % 3;
            let (h, g) = (heights[k], heights[next]);
            if h == 0.0 {
                ends.push(s.uv(corners[k]));
            } else if h * g < 0.0 {
                ends.push(s.uv(corners[k].lerp(corners[next], h / (h - g))));
            }
        }
        match ends[..] {
            [a, b] if a.distance(b) > TOUCHES => Some([a, b]),
            _ => None,
        }
    }
}

fn bounds<const N: usize>(points: [DVec3; N]) -> (DVec3, DVec3) {
    let low = points.iter().fold(DVec3::MAX, |m, p| m.min(*p));
    let high = points.iter().fold(DVec3::MIN, |m, p| m.max(*p));
    (low, high)
}

/// Calls `visit(index, middle)` for every voxel of [-1, 1]³ that a box touches.
fn for_voxels(low: DVec3, high: DVec3, mut visit: impl FnMut(usize, DVec3)) {
    let n = VOXELS as f64;
    let cell = |p: DVec3| {
        ((p + 1.0) * (0.5 * n))
            .floor()
            .clamp(DVec3::ZERO, DVec3::splat(n - 1.0))
    };
    let (low, high) = (
        cell(low - TOUCHES).as_usizevec3(),
        cell(high + TOUCHES).as_usizevec3(),
    );
    for z in low.z..=high.z {
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let middle = (DVec3::new(x as f64, y as f64, z as f64) + 0.5) * (2.0 / n) - 1.0;
                visit((z * VOXELS + y) * VOXELS + x, middle);
            }
        }
    }
}
