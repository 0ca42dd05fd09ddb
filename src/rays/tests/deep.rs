//! Trees that are hard to build or to walk: everything in one place, sizes of many scales, any number of threads.

use crate::rays::bounds::Bounds;
use crate::rays::bvh_build::{Branch, Layout};
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

#[test]
fn every_one_of_thousands_of_triangles_across_a_ray_is_met() {
    for ratio in [1.0, 0.999, 0.99] {
        let triangles = nested(3000, ratio);
        let rays = Rays::new(&plain(&triangles));
        let ray = Ray { origin: Vec3::new(0.0, 0.0, -0.5), direction: Vec3::Z, source: None };
        let mut hits = Vec::new();
        rays.crossings(&ray, &mut hits);
        let faces: Vec<u32> = hits.iter().map(|hit| hit.face).collect();
        assert_eq!(faces, (0..3000).collect::<Vec<u32>>(), "{ratio}");
        assert_eq!(rays.closest(&ray), Some(hits[0]));
    }
}

#[test]
fn triangles_in_one_place_make_a_tree() {
    let rays = Rays::new(&plain(&vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; 2000]));
    let ray = Ray { origin: Vec3::new(0.2, 0.3, 1.0), direction: Vec3::NEG_Z, source: None };
    // Of equal meetings that of the first face counts.
    assert_eq!(rays.closest(&ray).map(|hit| hit.face), Some(0));
}

/// The ranges of the leaves, in order.
fn leaves(branch: &Branch, found: &mut Vec<std::ops::Range<usize>>) {
    match branch {
        Branch::Leaf(range) => found.push(range.clone()),
        Branch::Node(branches) => branches.iter().for_each(|b| leaves(&b.1, found)),
    }
}

#[test]
fn layouts_are_the_same_for_any_number_of_threads() {
    let mut dice = Random(5);
    let boxes: Vec<Bounds> = (0..40_000)
        .map(|_| {
            let at = dice.point();
            let near = [dice.point(), dice.point(), dice.point()].map(|p| at + 0.01 * p);
            Triangle::new(near).padded_box(1e-5)
        })
        .collect();
    let laid = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let layout = pool.build().unwrap().install(|| Layout::new(&boxes));
        let mut found = Vec::new();
        leaves(&layout.root, &mut found);
        (layout.order, found)
    };
    let one = laid(1);
    let mut numbers = one.0.clone();
    numbers.sort_unstable();
    assert!(numbers.into_iter().eq(0..40_000), "each box once");
    assert!(one.1.iter().map(|range| range.len()).sum::<usize>() == 40_000);
    assert_eq!(one, laid(3));
}
