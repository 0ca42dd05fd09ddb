//! Thin sheets, shared edges, visibility between surfaces, transmission, plane ids.

use rayon::prelude::*;

use crate::rays::tests::*;

fn down(x: f32, y: f32) -> Ray {
    Ray { origin: Vec3::new(x, y, 0.9), direction: Vec3::NEG_Z, source: None }
}

/// Two coincident squares back to back, cut along different diagonals.
fn sheet(turn: Quat) -> Vec<[Vec3; 3]> {
    let corners = [(-0.7, -0.6), (0.7, -0.6), (0.7, 0.6), (-0.7, 0.6)];
    let [a, b, c, d] = corners.map(|(x, y)| turn * Vec3::new(x, y, 0.1));
    let back = halves([b, c, d, a]).map(flipped);
    [halves([a, b, c, d]), back].concat()
}

#[test]
fn of_a_thin_sheet_the_front_is_met_first_from_either_side() {
    for turn in [Quat::IDENTITY, oblique()] {
        let rays = Rays::new(&plain(&sheet(turn)));
        let mut dice = Random(5);
        let mut hits = Vec::new();
        for _ in 0..20_000 {
            let target = turn * Vec3::new(1.2 * dice.next() - 0.6, dice.next() - 0.5, 0.1);
            // t errs by about 2e-7 over the slope: below 1e-3, as far as the order within a plane is looked after.
            let direction = dice.direction();
            if direction.dot(turn * Vec3::Z).abs() < 1e-3 {
                continue;
            }
            let ray = Ray { origin: target - direction, direction, source: None };
            let first = rays.closest(&ray).expect("the ray is aimed at the sheet");
            assert_eq!(first.side, Side::Front);
            rays.crossings(&ray, &mut hits);
            let sides: Vec<Side> = hits.iter().map(|h| h.side).collect();
            assert_eq!(sides, [Side::Front, Side::Back]);
        }
    }
}

#[test]
fn both_faces_of_a_thin_sheet_share_a_plane_and_do_not_shade_each_other() {
    let rays = Rays::new(&plain(&sheet(oblique())));
    assert!((1..4).all(|face| rays.plane(face) == rays.plane(0)));
    let start = oblique() * Vec3::new(0.1, 0.2, 0.1);
    let ray = |direction| Ray { origin: start, direction, source: Some(0) };
    let up = oblique() * Vec3::Z;
    assert_eq!(rays.closest(&ray(up)), None);
    assert_eq!(rays.closest(&ray(-up)), None);
}

#[test]
fn a_crossing_through_an_edge_or_a_vertex_counts_once() {
    // A floor of 8 x 8 cells with exact coordinates, seen straight down on its vertices and edges, and two
    // tables of the same cut above each other.
    let layer = |z: f32| -> Vec<[Vec3; 3]> {
        let square = |i: i32, j: i32| {
            let p = |i: i32, j: i32| Vec3::new(i as f32 / 8.0, j as f32 / 8.0, z);
            halves([p(i, j), p(i + 1, j), p(i + 1, j + 1), p(i, j + 1)])
        };
        (-4..4).flat_map(|i| (-4..4).flat_map(move |j| square(i, j))).collect()
    };
    let rays = Rays::new(&plain(&[layer(0.0), layer(0.25)].concat()));
    let mut hits = Vec::new();
    for (i, j) in (-7..=7).flat_map(|i| (-7..=7).map(move |j| (i, j))) {
        rays.crossings(&down(i as f32 / 16.0, j as f32 / 16.0), &mut hits);
        let found: Vec<_> = hits.iter().map(|h| (h.t, h.side)).collect();
        assert_eq!(found, [(0.65, Side::Front), (0.9, Side::Front)]);
    }
}

/// A room with two boxes in it, one of them turned.
fn furnished(cells: u32, turn: Quat) -> Vec<[Vec3; 3]> {
    let walls = room(Vec3::ZERO, Vec3::splat(0.57), cells, turn);
    let one = body(turn * Vec3::new(0.2, -0.1, 0.1), Vec3::new(0.1, 0.3, 0.15), oblique());
    let two = body(turn * Vec3::new(-0.2, 0.2, -0.1), Vec3::new(0.2, 0.1, 0.1), Quat::IDENTITY);
    [walls, one, two].concat()
}

fn random_end(triangles: &[[Vec3; 3]], dice: &mut Random) -> End {
    let face = (dice.next() * triangles.len() as f32) as usize;
    let u = dice.pair();
    (warp::triangle_point(triangles[face], u.x, u.y), Some(face as u32))
}

#[test]
fn leaving_out_the_hull_changes_no_visibility_and_no_transmittance() {
    for (cells, turn) in [(1, Quat::IDENTITY), (16, Quat::IDENTITY), (1, oblique())] {
        let triangles = furnished(cells, turn);
        let rays = Rays::new(&plain(&triangles));
        let found = (0..40_000u32).into_par_iter().map(|i| {
            let mut dice = Random(i * 16);
            let (a, b) = (random_end(&triangles, &mut dice), random_end(&triangles, &mut dice));
            let Some(segment) = rays.segment(a, b) else {
                return [false; 2];
            };
            let full = rays.tree.is_clear(&segment);
            let inner = rays.between(a, b).expect("the boxes occlude and the walls do not");
            assert!(!std::ptr::eq(inner, &rays.tree));
            assert_eq!(full, inner.is_clear(&segment));
            assert_eq!(full, rays.visible(a, b));
            let through = rays.transmittance(a, b, &[0.0], &mut Vec::new());
            assert_eq!(through, if full { 1.0 } else { 0.0 });
            [full, !full]
        });
        let both = found.reduce(|| [false; 2], |a, b| [a[0] || b[0], a[1] || b[1]]);
        assert_eq!(both, [true; 2], "some pairs see each other and some do not");
    }
}

#[test]
fn in_an_empty_room_nothing_occludes_and_in_a_furnished_one_something_does() {
    let empty = room(Vec3::ZERO, Vec3::new(0.5, 0.6, 0.7), 8, Quat::IDENTITY);
    assert!(!Rays::new(&plain(&empty)).anything_occludes());
    assert!(Rays::new(&plain(&furnished(8, Quat::IDENTITY))).anything_occludes());
    // A point that is on no surface may lie outside the room: the walls count again.
    let rays = Rays::new(&plain(&empty));
    assert!(!rays.visible((Vec3::new(0.0, 0.0, 2.0), None), (Vec3::ZERO, None)));
    assert!(rays.visible((Vec3::new(0.1, 0.2, 0.3), None), (Vec3::ZERO, None)));
}

#[test]
fn transmittance_is_the_product_of_tau_over_the_surfaces_between() {
    let pane = |z: f32| halves([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| Vec3::new(x, y, z)));
    let panes = [0.9, 0.3, 0.0, -0.3, -0.9].map(pane).concat();
    let scene = scene_of(&panes, &[0, 0, 1, 1, 2, 2, 3, 3, 0, 0]);
    let rays = Rays::new(&scene);
    let mut scratch = Vec::new();
    // Straight through the diagonal both halves share, and next to it.
    for (x, y) in [(0.25, 0.25), (0.1, 0.3)] {
        let ends = [0.9, -0.9].map(|z| Vec3::new(x, y, z));
        let (from, to) = ((ends[0], Some(0)), (ends[1], Some(8)));
        let mut through = |tau: &[f32]| rays.transmittance(from, to, tau, &mut scratch);
        assert_eq!(through(&[0.0, 0.5, 0.5, 0.25]), 0.0625);
        assert_eq!(through(&[0.0, 0.5, 0.0, 1.0]), 0.0);
        assert_eq!(through(&[0.0, 1.0, 1.0, 1.0]), 1.0);
    }
}

#[test]
fn planes_are_shared_across_a_cut_wall_and_not_along_a_curved_one() {
    let walls = Rays::new(&plain(&room(Vec3::ZERO, Vec3::splat(0.5), 16, Quat::IDENTITY)));
    let ids: std::collections::HashSet<u32> = (0..6 * 512).map(|f| walls.plane(f)).collect();
    assert_eq!(ids.len(), 6);
    // A cylinder of 60,000 strips of 1e-4. A corner k + 1/2 strips from the founder's middle is off its plane by about
    // ((k + 1/2) 1e-4)^2 / 2, beyond the tolerance from k = 20 on. Rounding by 6e-8 tilts a strip by 6e-4 and adds
    // 1.2e-6 there, which allows k = 26: 53 strips to either side together, 106 faces. Ids that drift from neighbour to
    // neighbour would span thousands.
    let strips = 60_000;
    let rim = |i: i32, z: f32| {
        let angle = std::f32::consts::TAU * i as f32 / strips as f32;
        Vec3::new(angle.cos(), angle.sin(), z)
    };
    let strip = |i: i32| halves([rim(i, -0.5), rim(i + 1, -0.5), rim(i + 1, 0.5), rim(i, 0.5)]);
    let cylinder = Rays::new(&plain(&(0..strips).flat_map(strip).collect::<Vec<_>>()));
    let mut sizes = std::collections::HashMap::new();
    (0..2 * strips as u32).for_each(|f| *sizes.entry(cylinder.plane(f)).or_insert(0) += 1);
    let most = sizes.values().copied().max();
    assert!((3..=106).contains(&most.unwrap_or(0)), "{most:?}");
}
