//! Blocks of triangles against the hierarchy: the same meetings, ray by ray.

use rayon::prelude::*;

use crate::rays::accelerator::Accelerator;
use crate::rays::tests::*;
use crate::rays::triangle::{Label, NO_PLANE, Query, Triangle};

/// Faces, and accelerators of them in blocks and in a hierarchy.
fn both(triangles: &[[Vec3; 3]]) -> (Rays, [Accelerator; 2]) {
    let rays = Rays::new(&plain(triangles));
    let label = |face: u32| Label { face, plane: rays.plane(face) };
    let faces: Vec<_> =
        (0..triangles.len() as u32).map(|face| (Triangle::new(triangles[face as usize]), label(face))).collect();
    let pair = [usize::MAX, 0].map(|many| Accelerator::of(&faces, 1e-5 * 2.0, many));
    assert!(matches!(pair, [Accelerator::Blocks(_), Accelerator::Bvh(_)]));
    (rays, pair)
}

/// A closed room with two turned boxes and a thin sheet: 52 faces.
fn furnished(turn: Quat) -> Vec<[Vec3; 3]> {
    let sheet = [(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)].map(|(x, y)| turn * Vec3::new(x, y, 0.31));
    let [a, b, c, d] = sheet;
    [
        room(Vec3::ZERO, Vec3::splat(0.57), 1, turn),
        body(turn * Vec3::new(0.2, -0.1, -0.1), Vec3::new(0.1, 0.3, 0.15), oblique()),
        body(turn * Vec3::new(-0.2, 0.2, -0.2), Vec3::splat(0.1), Quat::IDENTITY),
        // Two coincident squares, back to back.
        halves([a, b, c, d]).to_vec(),
        halves([b, c, d, a]).map(flipped).to_vec(),
    ]
    .concat()
}

/// A ray of three kinds by turns: from a random inner point, from a point next to an edge, and along a lattice on which
/// edge functions are exactly 0.
fn random_ray(triangles: &[[Vec3; 3]], turn: Quat, index: u32) -> Ray {
    let mut dice = Random(index.wrapping_mul(32));
    let u = dice.pair();
    match index % 4 {
        0 | 1 => Ray { origin: turn * (0.9 * 0.57 * dice.point()), direction: dice.direction(), source: None },
        2 => {
            let face = (dice.next() * triangles.len() as f32) as usize;
            let [a, b, c] = triangles[face];
            let near = 10_f32.powf(-1.0 - 8.0 * dice.next());
            let along = dice.next();
            Ray {
                origin: (1.0 - near) * ((1.0 - along) * a + along * b) + near * c,
                direction: warp::cosine_direction(normal(triangles[face]), u.x, u.y),
                source: Some(face as u32),
            }
        }
        _ => {
            let step = |x: f32| (8.0 * x).floor() - 4.0;
            let way = Vec3::new(step(u.x), step(u.y), step(dice.next()));
            let target = triangles[(dice.next() * triangles.len() as f32) as usize];
            let [origin, corner] = [Vec3::splat(0.0), target[(3.0 * dice.next()) as usize]];
            let way = if index % 8 == 3 { way } else { corner - origin };
            Ray { origin, direction: way.try_normalize().unwrap_or(Vec3::X), source: None }
        }
    }
}

#[test]
fn blocks_and_hierarchy_find_the_same_meetings_along_ten_million_rays() {
    // 2 rooms x 5 million rays, each a closest hit from both; crossings and visibility for every eighth.
    for turn in [Quat::IDENTITY, oblique()] {
        let triangles = &furnished(turn);
        let (rays, [few, many]) = &both(triangles);
        let differ = |&index: &u32| {
            let ray = random_ray(triangles, turn, index);
            let query = rays.query(&ray);
            let (a, b) = (few.closest(&query), many.closest(&query));
            let same = match (a, b) {
                // On a shared edge any face around it will do.
                (Some(a), Some(b)) => {
                    a == b || (a.side == b.side && (a.t - b.t).abs() < 1e-6 && on_edge(&a) && on_edge(&b))
                }
                // The room is closed: a miss is a leak.
                _ => false,
            };
            !same || (index.is_multiple_of(8) && !same_crossings(few, many, &ray, rays))
        };
        let differing: Vec<u32> = (0..5_000_000u32).into_par_iter().filter(differ).collect();
        assert_eq!(differing, [0u32; 0]);
    }
}

/// Whether both trees find the same set of crossings, and the same visibility over the first half of the way.
fn same_crossings(few: &Accelerator, many: &Accelerator, ray: &Ray, rays: &Rays) -> bool {
    let query = rays.query(ray);
    let [a, b] = [few, many].map(|tree| {
        let mut hits = Vec::new();
        tree.all(&query, &mut hits);
        hits.sort_by_key(|hit| hit.face);
        hits
    });
    let end = 0.7 * a.iter().map(|hit| hit.t).fold(0.5, f32::max);
    let part = Query::new(query.origin, query.direction, end, [query.skip[0], NO_PLANE]);
    a == b && few.is_clear(&part) == many.is_clear(&part)
}

fn on_edge(hit: &Hit) -> bool {
    hit.u == 0.0 || hit.v == 0.0 || hit.u + hit.v >= 1.0
}

#[test]
fn trees_of_every_small_size_agree() {
    // Full and partly filled blocks and box groups, up to the most faces blocks are used for.
    let mut dice = Random(77);
    let soup: Vec<[Vec3; 3]> = (0..400)
        .map(|_| {
            let at = 0.5 * dice.point();
            [dice.point(), dice.point(), dice.point()].map(|p| at + 0.3 * p)
        })
        .collect();
    for count in [1, 2, 7, 8, 9, 16, 17, 63, 64, 65, 100, 129, 200, 300, 400] {
        let (rays, [few, many]) = both(&soup[..count]);
        for _ in 0..4000 {
            let ray = Ray { origin: 1.5 * dice.point(), direction: dice.direction(), source: None };
            let query = rays.query(&ray);
            assert_eq!(few.closest(&query), many.closest(&query));
            assert!(same_crossings(&few, &many, &ray, &rays));
        }
    }
}
