//! Closed rooms leak nothing: rays at every vertex, edge and cell, and rays that start next to edges.

use rayon::prelude::*;

use crate::rays::tests::*;

const CELLS: u32 = 16;

/// Corners, edge midpoints and centroids of all faces.
fn delicate_points(triangles: &[[Vec3; 3]]) -> Vec<Vec3> {
    let of_face = |&[a, b, c]: &[Vec3; 3]| [a, b, c, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a), (a + b + c) / 3.0];
    triangles.iter().flat_map(of_face).collect()
}

/// Rays that find no front first, from `eyes` inner points, aimed at the delicate points and `random` others.
fn leaks(center: Vec3, turn: Quat, eyes: u32, random: u32) -> usize {
    let triangles = &room(center, Vec3::new(0.6, 0.5, 0.55), CELLS, turn);
    let rays = Rays::new(&plain(triangles));
    let targets = delicate_points(triangles);
    let escapes = |origin: Vec3, direction: Vec3| {
        let ray = Ray { origin, direction, source: None };
        rays.closest(&ray).is_none_or(|hit| hit.side == Side::Back)
    };
    let from_eye = |eye: u32| {
        let mut dice = Random(eye << 16);
        // The first eye is the very centre, from where directions have exact zeros and ties.
        let spread = if eye == 0 { 0.0 } else { 0.4 };
        let origin = center + turn * (spread * dice.point());
        let aimed = targets.iter().filter(|&&p| escapes(origin, (p - origin).normalize()));
        let aimed = aimed.count();
        aimed + (0..random).filter(|_| escapes(origin, dice.direction())).count()
    };
    (0..eyes).into_par_iter().map(from_eye).sum()
}

#[test]
fn ten_million_rays_stay_in_their_rooms() {
    // 2 rooms x 240 eyes x (21,504 delicate points + 500 random ones) = 10.6 million rays.
    let center = Vec3::new(0.05, -0.1, 0.02);
    for turn in [Quat::IDENTITY, oblique()] {
        assert_eq!(leaks(center, turn, 240, 500), 0);
    }
}

#[test]
fn directions_along_the_axes_do_not_leak_whatever_the_sign_of_their_zeros() {
    let rays = Rays::new(&plain(&room(Vec3::ZERO, Vec3::ONE, 4, Quat::IDENTITY)));
    for axis in 0..3 {
        for (length, zero) in [(1.0, 0.0), (1.0, -0.0), (-1.0, 0.0), (-1.0, -0.0)] {
            let mut direction = Vec3::splat(zero);
            direction[axis] = length;
            let ray = Ray { origin: Vec3::ZERO, direction, source: None };
            assert_eq!(rays.closest(&ray).map(|hit| (hit.t, hit.side)), Some((1.0, Side::Front)));
        }
    }
}

/// Counts rays from points on the walls, at a distance of about `10^-e` from an edge for e in 2..9, that do not hit a
/// front first, or cross anything but one front.
fn escapes_near_edges(triangles: &[[Vec3; 3]], count: u32) -> usize {
    let rays = Rays::new(&plain(triangles));
    let bad = |index: u32| {
        let mut dice = Random(index.wrapping_mul(64));
        let face = (dice.next() * triangles.len() as f32) as usize;
        let [a, b, c] = triangles[face];
        let near = 10_f32.powf(-2.0 - 7.0 * dice.next());
        let along = dice.next();
        let origin = (1.0 - near) * ((1.0 - along) * a + along * b) + near * c;
        let u = dice.pair();
        let direction = warp::cosine_direction(normal(triangles[face]), u.x, u.y);
        let ray = Ray { origin, direction, source: Some(face as u32) };
        let mut hits = Vec::new();
        rays.crossings(&ray, &mut hits);
        let once = hits.len() == 1 && hits[0].side == Side::Front;
        !once || rays.closest(&ray) != Some(hits[0])
    };
    (0..count).into_par_iter().filter(|&i| bad(i)).count()
}

#[test]
fn rays_that_start_next_to_an_edge_of_a_closed_cube_cross_one_wall() {
    for turn in [Quat::IDENTITY, oblique()] {
        for cells in [1, 16] {
            let walls = room(Vec3::ZERO, Vec3::splat(0.57), cells, turn);
            assert_eq!(escapes_near_edges(&walls, 500_000), 0);
        }
    }
}
