//! Pieces of luminaires: what hangs together, halved until few faces are left.
//!
//! Faces hang together where they share a corner. Lamps that lie apart are luminaires of their own whatever object they
//! belong to, as exporters often write all lamps as one: a node of the tree ([`crate::direct::light_tree`]) can then be
//! as small as one of them, and a shadow's edge asks only those it parts. Few lamps stay as they are written: one ray
//! to any of them costs less than one to each.
//!
//! What is near beside its size counts as one lamp: panes between bars, strips, faces that touch without a common
//! corner. Not handled: where such faces are cut into pieces each counts as apart, which costs time and no accuracy.

use glam::DVec3;

use crate::direct::light_halving::{Placed, halve};
use crate::form_factors::hull::bounds;
use crate::form_factors::lambert::Outline;
use crate::scene::Scene;
use crate::surfaces::coplanar::connected;

/// Luminaires that each receiver asks one by one, at most.
pub(crate) const FEW: usize = 16;
/// Faces of a piece at most.
const PIECE: usize = 16;
/// Gap between the boxes of two parts, in diagonals of the smaller, below which they are one lamp.
const NEAR: f64 = 0.5;

/// Groups of faces, cut into pieces where they make up many lamps, or many faces are in one.
pub(crate) fn divided(scene: &Scene, groups: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    let many = |faces: &Vec<u32>| faces.len() > Outline::MOST_FACES;
    if !groups.iter().any(many) && groups.iter().map(|group| lamps(scene, group)).sum::<usize>() <= FEW {
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

/// The box of one part.
struct PartBox {
    low: DVec3,
    high: DVec3,
}

impl PartBox {
    fn of(scene: &Scene, faces: &[u32]) -> PartBox {
        let corners = faces.iter().flat_map(|&face| scene.corners(face)).map(|p| p.as_dvec3());
        let (low, high) = bounds(corners);
        PartBox { low, high }
    }

    fn is_near(&self, other: &PartBox) -> bool {
        let gap = (self.low - other.high).max(other.low - self.high).max(DVec3::ZERO).length();
        let diagonal = |part: &PartBox| (part.high - part.low).length();
        gap <= NEAR * diagonal(self).min(diagonal(other))
    }
}

/// Number of lamps in a group of few faces: what hangs together, with what is near.
fn lamps(scene: &Scene, group: &[u32]) -> usize {
    let mut lamps: Vec<Vec<PartBox>> = Vec::new();
    for faces in connected(scene, group, |_| ()) {
        let own = PartBox::of(scene, &faces);
        let is_near = |lamp: &Vec<PartBox>| lamp.iter().any(|other| other.is_near(&own));
        let (near, apart): (Vec<_>, Vec<_>) = lamps.into_iter().partition(is_near);
        lamps = apart;
        lamps.push(near.into_iter().flatten().chain([own]).collect());
    }
    lamps.len()
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
    use super::*;
    use crate::light::Rgb;
    use crate::scene::Material;

    /// Panels of side 0.01 as one object, one every `pitch`; 300 have more faces than one closed form takes.
    fn panels(count: u32, pitch: f64) -> Scene {
        let square = |k: u32| {
            let x = f64::from(k) * pitch;
            [(0.0, 0.0), (0.01, 0.0), (0.01, 0.01), (0.0, 0.01)].map(|(u, v)| DVec3::new(x + u, v, 0.0))
        };
        let corners: Vec<DVec3> = (0..count).flat_map(square).collect();
        let faces: Vec<(Vec<u32>, u32)> = (0..count).map(|k| ((4 * k..4 * k + 4).collect(), 0)).collect();
        let glow = Material::new("glow", Rgb::ZERO, Rgb::ONE);
        Scene::from_faces("panels", &corners, &faces, vec![glow]).expect("a correct scene")
    }

    #[test]
    fn lamps_that_lie_apart_are_no_pieces_of_one() {
        let pieces = |pitch: f64| divided(&panels(300, pitch), vec![(0..600).collect()]);
        assert_eq!(pieces(0.02).len(), 300);
        let touching = pieces(0.01);
        assert!(touching.len() < 100 && touching.iter().all(|p| p.len() <= PIECE));
        assert_eq!(touching.iter().map(Vec::len).sum::<usize>(), 600);
    }

    /// A hundred lamps of one object were one luminaire of 200 faces, which every point asked as a whole.
    #[test]
    fn few_faces_are_as_many_luminaires_as_lamps_where_those_are_many() {
        let lamps = |count: u32, pitch: f64| divided(&panels(count, pitch), vec![(0..2 * count).collect()]).len();
        assert_eq!(lamps(100, 0.03), 100);
        assert_eq!(lamps(FEW as u32, 0.03), 1);
        // Gaps of a quarter of a panel leave them one.
        assert_eq!(lamps(100, 0.0125), 1);
    }
}
