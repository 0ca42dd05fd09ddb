//! Where other faces touch or cut a surface: the lines across which its light jumps.
//!
//! A box on a floor hides the floor under it. A patch that lies half under the box would carry the mean of a lit and
//! a buried half, and whatever sees the lit half would find it too dark: an error that falls only with the first
//! power of the patch size. Cells are therefore cut along these lines (the D0 discontinuities of Heckbert 1992).
//!
//! Not handled: discontinuities of higher order, the edges of shadows.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::rays::Rays;
use crate::scene::{Bounds, Scene};
use crate::surfaces::coplanar::Surface;

/// Distance in unit coordinates below which a corner lies in a plane: a few roundings of f32.
const TOUCHES: f64 = 2e-6;

/// Cells along each axis of the scene's box.
const VOXELS: usize = 32;

/// Where the surfaces of a scene are touched.
#[derive(Debug)]
pub(crate) struct Discontinuities {
    voxels: Voxels,
    /// Of every surface, found when first requested.
    segments: Vec<OnceLock<Vec<[DVec2; 2]>>>,
}

/// Faces by voxel.
#[derive(Debug)]
struct Voxels {
    /// Voxels with the faces that reach into them, in order of both.
    faces: Vec<(u32, u32)>,
    /// Where each voxel's faces begin.
    starts: Vec<u32>,
}

impl Voxels {
    /// Sorts the faces into voxels.
    fn new(scene: &Scene) -> Self {
        let all = (0..scene.faces.len() as u32).into_par_iter();
        let each = all.flat_map_iter(|face| {
            let bounds = Bounds::of(scene.corners(face).map(|p| p.as_dvec3()));
            let mut own = Vec::new();
            for_voxels(&bounds, |k, _| own.push((k as u32, face)));
            own
        });
        let mut faces: Vec<(u32, u32)> = each.collect();
        faces.par_sort_unstable();
        let mut starts = vec![0; VOXELS * VOXELS * VOXELS + 1];
        faces.iter().for_each(|&(k, _)| starts[k as usize + 1] += 1);
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        Voxels { faces, starts }
    }

    fn faces(&self, voxel: usize) -> impl Iterator<Item = u32> {
        let range = self.starts[voxel] as usize..self.starts[voxel + 1] as usize;
        self.faces[range].iter().map(|&(_, face)| face)
    }
}

impl Discontinuities {
    /// Of a scene's surfaces, so many.
    pub(crate) fn new(scene: &Scene, surfaces: usize) -> Self {
        Discontinuities { voxels: Voxels::new(scene), segments: vec![OnceLock::new(); surfaces] }
    }

    /// Segments in the (u, v) of surface k along which faces of other planes touch or cut it.
    pub(crate) fn segments(&self, scene: &Scene, rays: &Rays, k: usize, s: &Surface) -> &[[DVec2; 2]] {
        // Nothing in here works on several threads: a thread that waits for others might come by again.
        self.segments[k].get_or_init(|| segments(scene, rays, &self.voxels, s))
    }
}

fn segments(scene: &Scene, rays: &Rays, voxels: &Voxels, s: &Surface) -> Vec<[DVec2; 2]> {
    let [u, v] = [s.axes[0] * s.extent[0], s.axes[1] * s.extent[1]];
    let bounds = Bounds::of([s.origin, s.origin + u, s.origin + v, s.origin + u + v]);
    let mut faces = Vec::new();
    for_voxels(&bounds, |k, middle| {
        let reach = 3f64.sqrt() / VOXELS as f64 + TOUCHES;
        if (middle - s.origin).dot(s.normal).abs() <= reach {
            faces.extend(voxels.faces(k));
        }
    });
    faces.sort_unstable();
    faces.dedup();
    let own = rays.plane(s.faces[0]);
    faces.retain(|&f| rays.plane(f) != own);
    faces.iter().filter_map(|&f| segment(scene, s, f)).collect()
}

/// The segment in which a face meets the surface's plane.
fn segment(scene: &Scene, s: &Surface, face: u32) -> Option<[DVec2; 2]> {
    let corners = scene.corners(face).map(|p| p.as_dvec3());
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

/// Calls `visit(index, middle)` for every voxel of [-1, 1]³ that a box touches.
fn for_voxels(bounds: &Bounds<DVec3>, mut visit: impl FnMut(usize, DVec3)) {
    let n = VOXELS as f64;
    let cell = |p: DVec3| ((p + 1.0) * (0.5 * n)).floor().clamp(DVec3::ZERO, DVec3::splat(n - 1.0));
    let (low, high) = (cell(bounds.low - TOUCHES).as_usizevec3(), cell(bounds.high + TOUCHES).as_usizevec3());
    for z in low.z..=high.z {
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let middle = (DVec3::new(x as f64, y as f64, z as f64) + 0.5) * (2.0 / n) - 1.0;
                visit((z * VOXELS + y) * VOXELS + x, middle);
            }
        }
    }
}
