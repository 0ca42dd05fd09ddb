//! Lamps that are convex bodies: whoever sees the front of one of their faces has no other of them in between.
//!
//! A ball of a thousand faces would else count as a thousand casters of shadows on itself.
//!
//! Not handled: lamps of so many faces that testing each against all corners would take long; they cast shadows on
//! themselves, which costs time and no accuracy.

use glam::DVec3;

use crate::scene::Scene;
use crate::surfaces::coplanar::connected;

/// Faces times corners of one lamp at most: a fifth of a second.
const MOST_TESTS: usize = 200_000_000;
/// Heights below this lie in the plane: a few roundings of unit coordinates.
const FLAT: f64 = 1e-6;

/// Of each face of the scene the number of the convex lamp it belongs to, if to one; empty where there is no such lamp.
pub(crate) fn convex_parts(scene: &Scene, groups: &[Vec<u32>]) -> Vec<Option<u32>> {
    let (mut parts, mut count) = (Vec::new(), 0);
    for faces in groups.iter().flat_map(|g| connected(scene, g, |_| ())) {
        // What lies in one plane has no use for this: no caster rises above it there anyway.
        if faces.len() > 2 && is_convex(scene, &faces) {
            parts.resize(scene.faces.len(), None);
            faces.iter().for_each(|&f| parts[f as usize] = Some(count));
            count += 1;
        }
    }
    parts
}

/// Whether no corner rises above the plane of any face.
fn is_convex(scene: &Scene, faces: &[u32]) -> bool {
    let vertices = |&f: &u32| scene.faces[f as usize].vertices;
    let mut corners: Vec<u32> = faces.iter().flat_map(vertices).collect();
    corners.sort_unstable();
    corners.dedup();
    let place = |&v: &u32| scene.vertices[v as usize].as_dvec3();
    let corners: Vec<DVec3> = corners.iter().map(place).collect();
    let below = |&face: &u32| {
        let [a, b, c] = scene.corners(face).map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        corners.iter().all(|p| normal.dot(*p - a) <= FLAT)
    };
    faces.len() * corners.len() <= MOST_TESTS && faces.iter().all(below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn a_ball_is_convex_and_a_hollow_is_not() {
        let scene = Scene::open("concentric-spheres").expect("built in");
        // The ball's faces look out of it, the sphere's into it.
        let groups: Vec<Vec<u32>> = (0..scene.objects.len() as u32)
            .map(|o| {
                let own = |f: &u32| scene.faces[*f as usize].object == o;
                (0..scene.faces.len() as u32).filter(own).collect()
            })
            .collect();
        let parts = convex_parts(&scene, &groups);
        for (faces, name) in groups.iter().zip(&scene.objects) {
            let found = faces.iter().filter(|&&f| parts[f as usize].is_some()).count();
            let radius = |&f: &u32| scene.corners(f)[0].length();
            let ball = faces.iter().all(|f| radius(f) < 0.75);
            assert_eq!(found, if ball { faces.len() } else { 0 }, "{name}");
        }
        assert!(parts.iter().any(|&p| p.is_some()));
    }
}
