//! Trees that are hard to build or to walk: everything in one place, sizes of many scales, any number of threads.

use obvhs::aabb::Aabb;

use crate::rays::bvh_build::{Branches, LEAF, Layout};
use crate::rays::tests::*;
use crate::rays::triangle::Triangle;

/// Triangles across the z axis, each `ratio` times as large as the one before it.
fn nested(count: usize, ratio: f32) -> Vec<[Vec3; 3]> {
    let sized = |k: usize| {
        let (size, z) = (ratio.powi(k as i32), k as f32 / count as f32);
        [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, y)| Vec3::new(size * x, size * y, z))
    };
    (0..count).map(sized).collect()
}

/// Triangles whose boxes have one centre, each larger than the one before it, in parallel planes.
fn concentric(count: usize) -> Vec<[Vec3; 3]> {
    let corners = [Vec3::NEG_ONE, Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 1.0)];
    (1..=count).map(|k| corners.map(|corner| 2.0 * k as f32 / count as f32 * corner)).collect()
}

/// How many nodes stand above the deepest leaf.
fn depth(nodes: &[Branches], own: u32) -> usize {
    let below = nodes[own as usize].iter().filter(|branch| branch.1 & LEAF == 0);
    1 + below.map(|branch| depth(nodes, branch.1)).max().unwrap_or(0)
}

/// The tree over triangles, whose leaves hold each box once.
fn layout(triangles: &[[Vec3; 3]]) -> Layout {
    let boxes: Vec<Aabb> = triangles.iter().map(|t| Triangle::new(*t).padded_box(1e-5)).collect();
    let layout = Layout::new(&boxes);
    let mut held: Vec<u32> = layout.leaves.iter().flat_map(|leaf| &layout.order[leaf.clone()]).copied().collect();
    held.sort_unstable();
    assert!(held.into_iter().eq(0..boxes.len() as u32));
    layout
}

/// Where pairs of boxes that are cheapest to join come one after the other, joining them all took hours for a million.
#[test]
fn every_one_of_many_triangles_across_a_ray_is_met() {
    const COUNT: usize = 50_000;
    for (triangles, name) in [
        (nested(COUNT, 1.0), "row"),
        (nested(COUNT, 0.9997), "shrinking"),
        (nested(3000, 0.99), "vanishing"),
        (concentric(COUNT), "concentric"),
    ] {
        let depth = depth(&layout(&triangles).nodes, 0);
        assert!(depth <= 32, "{name}: {depth}");
        let rays = Rays::new(&plain(&triangles));
        let ray = Ray { origin: Vec3::new(0.0, 0.0, -0.5), direction: Vec3::Z, source: None };
        let mut hits = Vec::new();
        rays.crossings(&ray, &mut hits);
        let faces: Vec<u32> = hits.iter().map(|hit| hit.face).collect();
        assert!(faces.iter().copied().eq(0..triangles.len() as u32), "{name}: {}", faces.len());
        assert_eq!(rays.closest(&ray), Some(hits[0]));
    }
}

#[test]
fn triangles_in_one_place_make_a_tree() {
    let triangles = vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; 50_000];
    assert!(depth(&layout(&triangles).nodes, 0) <= 32);
    let rays = Rays::new(&plain(&triangles));
    let ray = Ray { origin: Vec3::new(0.2, 0.3, 1.0), direction: Vec3::NEG_Z, source: None };
    // Of equal meetings that of the first face counts.
    assert_eq!(rays.closest(&ray).map(|hit| hit.face), Some(0));
}

#[test]
fn layouts_are_the_same_for_any_number_of_threads() {
    let mut dice = Random(5);
    let triangles: Vec<[Vec3; 3]> = (0..40_000)
        .map(|_| {
            let at = dice.point();
            [dice.point(), dice.point(), dice.point()].map(|p| at + 0.01 * p)
        })
        .collect();
    let laid = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let layout = pool.build().unwrap().install(|| layout(&triangles));
        (layout.order, layout.leaves)
    };
    assert_eq!(laid(1), laid(3));
}
