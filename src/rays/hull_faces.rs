//! Faces that can never lie strictly between two points of the scene.
//!
//! If every vertex lies on one side of a plane, so does every segment between points of the scene, and a face in that
//! plane touches such a segment at its ends at most. The walls of a room are of this kind: visibility between
//! its surfaces need not test them, and in an empty convex room needs no ray at all.
//!
//! Detection is exact to [`TOLERANCE`] and bounded in cost: a plane beyond the budget is an ordinary
//! occluder, which is always right. So is a wall whose corners are further from planar than the tolerance.
//!
//! Not handled: hulls of parts of the scene, as of a room within a building.

use glam::DVec3;
use rayon::prelude::*;

use crate::scene::Scene;
use crate::scene::planes::{Plane, Planes};

/// How far a vertex may lie behind a hull plane: coordinates of size 1 in f32, rounded a few times.
const TOLERANCE: f64 = 1e-6;

/// Vertex-plane distances computed at most.
const BUDGET: usize = 100_000_000;

/// The faces that may occlude: those on no hull plane.
pub(crate) fn occluders(scene: &Scene, planes: &Planes) -> Vec<u32> {
    let hull = hull_planes(scene, &planes.planes);
    let count = scene.solid_faces();
    (0..count).filter(|&face| !hull[planes.of_face[face as usize] as usize]).collect()
}

/// Whether all vertices lie on one side, for each plane.
fn hull_planes(scene: &Scene, planes: &[Plane]) -> Vec<bool> {
    let vertices = used_vertices(scene);
    let extremes = extreme_points(&vertices);
    // Almost every inner plane has extreme points on both sides: it never comes to the full check.
    let outer = (0..planes.len()).into_par_iter();
    let outer: Vec<usize> = outer.filter(|&p| one_sided(&planes[p], &extremes)).collect();
    let affordable = outer.len().min(BUDGET / vertices.len().max(1));
    let proved = outer[..affordable].par_iter();
    let proved: Vec<usize> = proved.copied().filter(|&p| one_sided(&planes[p], &vertices)).collect();
    let mut hull = vec![false; planes.len()];
    proved.into_iter().for_each(|p| hull[p] = true);
    hull
}

/// The vertices that faces use; others are no points of the scene.
fn used_vertices(scene: &Scene) -> Vec<DVec3> {
    let mut used = vec![false; scene.vertices.len()];
    for face in &scene.faces[..scene.solid_faces() as usize] {
        for v in face.vertices {
            used[v as usize] = true;
        }
    }
    let points = scene.vertices.iter().zip(used).filter(|(_, used)| *used);
    points.map(|(v, _)| v.as_dvec3()).collect()
}

/// The furthest vertex in each of the 26 directions of a cube's faces, edges and corners.
fn extreme_points(vertices: &[DVec3]) -> Vec<DVec3> {
    let steps = [-1.0, 0.0, 1.0];
    let directions = steps
        .iter()
        .flat_map(|&x| steps.iter().flat_map(move |&y| steps.map(|z| DVec3::new(x, y, z))))
        .filter(|d| *d != DVec3::ZERO);
    let directions: Vec<DVec3> = directions.collect();
    let furthest = directions.par_iter().filter_map(|d| {
        let (mut most, mut found) = (f64::NEG_INFINITY, None);
        for &vertex in vertices {
            let along = d.dot(vertex);
            if along >= most {
                (most, found) = (along, Some(vertex));
            }
        }
        found
    });
    furthest.collect()
}

/// Whether no two points lie on different sides of the plane.
fn one_sided(plane: &Plane, points: &[DVec3]) -> bool {
    let (mut front, mut behind) = (false, false);
    for &point in points {
        let distance = plane.distance(point);
        front |= distance > TOLERANCE;
        behind |= distance < -TOLERANCE;
        if front && behind {
            return false;
        }
    }
    true
}
