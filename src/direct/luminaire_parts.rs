//! Pieces of luminaires: what hangs together, halved until few faces are left.
//!
//! Faces hang together where they share a corner. Lamps that lie apart are luminaires of their own whatever object they
//! belong to: a node of the tree ([`crate::direct::light_tree`]) can then be as small as one of them, and a shadow's
//! edge asks only those it parts.
//!
//! Not handled: faces that touch without a common corner count as apart, which costs time and no accuracy.

use crate::direct::light_halving::{Placed, halve};
use crate::form_factors::geometry::silhouette::Outline;
use crate::scene::Scene;
use crate::surfaces::connected::connected;

/// Luminaires that each receiver asks one by one, at most.
pub(crate) const FEW: usize = 16;
/// Faces of a piece at most.
const PIECE: usize = 16;

/// Groups of faces, cut into pieces where there are many groups, or many faces in one.
pub(crate) fn divided(scene: &Scene, groups: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    let many = |faces: &Vec<u32>| faces.len() > Outline::MOST_FACES;
    if groups.len() <= FEW && !groups.iter().any(many) {
        return groups;
    }
    let mut pieces = Vec::new();
    for group in groups.iter().flat_map(|g| connected(scene, g, |_| ())) {
        let place = |face: u32| {
            let [a, b, c] = scene.corners(face).map(|p| p.as_dvec3());
            let direction = (b - a).cross(c - a).normalize_or_zero();
            Placed { place: (a + b + c) / 3.0, direction, number: face }
        };
        divide(&mut group.into_iter().map(place).collect::<Vec<_>>(), &mut pieces);
    }
    pieces
}

/// Halves faces until few are left together.
fn divide(faces: &mut [Placed], pieces: &mut Vec<Vec<u32>>) {
    if faces.len() <= PIECE {
        let mut piece: Vec<u32> = faces.iter().map(|f| f.number).collect();
        piece.sort_unstable();
        return pieces.push(piece);
    }
    let (left, right) = halve(faces);
    divide(left, pieces);
    divide(right, pieces);
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::light::Rgb;
    use crate::scene::Material;

    /// 300 panels of side 0.01 as one object, one every `pitch`: more faces than one closed form takes.
    fn panels(pitch: f64) -> Scene {
        let square = |k: u32| {
            let x = f64::from(k) * pitch;
            [(0.0, 0.0), (0.01, 0.0), (0.01, 0.01), (0.0, 0.01)].map(|(u, v)| DVec3::new(x + u, v, 0.0))
        };
        let corners: Vec<DVec3> = (0..300).flat_map(square).collect();
        let faces: Vec<(Vec<u32>, u32)> = (0..300).map(|k| ((4 * k..4 * k + 4).collect(), 0)).collect();
        let glow = Material::new("glow", Rgb::ZERO, Rgb::ONE);
        Scene::from_faces("panels", &corners, &faces, vec![glow]).expect("a correct scene")
    }

    #[test]
    fn lamps_that_lie_apart_are_no_pieces_of_one() {
        let pieces = |pitch: f64| divided(&panels(pitch), vec![(0..600).collect()]);
        assert_eq!(pieces(0.02).len(), 300);
        let touching = pieces(0.01);
        assert!(touching.len() < 100 && touching.iter().all(|p| p.len() <= PIECE));
        assert_eq!(touching.iter().map(Vec::len).sum::<usize>(), 600);
    }
}
