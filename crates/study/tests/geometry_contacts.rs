//! Patches that touch, nearly coincide, are thin, or cut through each other: by the rows of K and by `factors`, against
//! exact values.
//!
//! Truths of 40-digit contour integrals (see `data/factors`), or made the same way for 5° and 1°.

use glam::DVec3;
use halflight::scene::Scene;
use halflight_study::{FactorSettings, factors};

use crate::common::rows::{by_rows, objects};
use crate::common::{Mesh, Silent, grey};

const RAYS: u32 = 1024;

fn rectangle(origin: DVec3, u: DVec3, v: DVec3) -> Vec<DVec3> {
    vec![origin, origin + u, origin + u + v, origin + v]
}

/// Two polygons, the first of material 0, the second of material 1.
fn pair(a: &[DVec3], b: &[DVec3]) -> Scene {
    let mut mesh = Mesh::default();
    mesh.polygon(a, 0);
    mesh.polygon(b, 1);
    mesh.scene(vec![grey("a", 0.5), grey("b", 0.5)])
}

fn floor() -> Vec<DVec3> {
    rectangle(DVec3::ZERO, DVec3::X, DVec3::Y)
}

/// `F` from the first to the second as `factors` has it, to 1e-9.
#[track_caller]
fn exactly(a: &[DVec3], b: &[DVec3], truth: f64) {
    let scene = objects(&[a.to_vec(), b.to_vec()]);
    let settings = FactorSettings { tolerance: 1e-6, seed: 0 };
    let table = factors(&scene, &[0.0], &settings, &Silent);
    let found = table.factors[1].share;
    let apart = (found.value - truth).abs();
    assert!(apart <= 1e-9 && apart <= 4.0 * found.error + 1e-15, "{found:?} {truth}");
}

/// `F` from the first to the second as the rows of K have it, to four standard errors and the rounding of corners to
/// single precision, `rounding`.
#[track_caller]
fn by_rays(a: &[DVec3], b: &[DVec3], truth: f64, rounding: f64) {
    let (mean, error) = by_rows(&pair(a, b), (0, 1), RAYS);
    let apart = (mean - truth).abs();
    assert!(apart <= 4.0 * error + rounding, "{mean} +- {error}, exactly {truth}");
    assert!((0.0..=1.0).contains(&mean));
}

#[test]
fn wedges_that_share_an_edge() {
    for (degrees, truth) in
        [(90.0_f64, 0.200_043_776_075_403_15), (5.0, 0.920_261_908_111_222_4), (1.0, 0.982_997_178_574_648_8)]
    {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let up = rectangle(DVec3::ZERO, DVec3::Y, DVec3::new(cos, 0.0, sin));
        exactly(&floor(), &up, truth);
        by_rays(&floor(), &up, truth, 1e-6);
    }
}

#[test]
fn parallel_patches_that_nearly_coincide() {
    for (gap, truth) in [(1e-4, 0.999_800_070_977_788_5), (1e-6, 0.999_998_000_010_029_5)] {
        let above = rectangle(DVec3::new(0.0, 0.0, gap), DVec3::Y, DVec3::X);
        exactly(&floor(), &above, truth);
    }
    // Rays tell planes apart that are 2e-6 of half the scene's extent apart, and start a little above theirs: a gap of
    // 1e-4 of the size is seen to 1e-4.
    let above = rectangle(DVec3::new(0.0, 0.0, 1e-4), DVec3::Y, DVec3::X);
    by_rays(&floor(), &above, 0.999_800_070_977_788_5, 1e-5);
}

#[test]
fn slivers_of_one_to_a_thousand() {
    let thin = rectangle(DVec3::ZERO, DVec3::X, 1e-3 * DVec3::Y);
    let above = rectangle(DVec3::Z, 1e-3 * DVec3::Y, DVec3::X);
    exactly(&thin, &above, 2.499_999_242_371_3e-4);
    by_rays(&thin, &above, 2.499_999_242_371_3e-4, 1e-7);
    let long = rectangle(DVec3::ZERO, DVec3::X, 1e3 * DVec3::Y);
    let wall = rectangle(DVec3::ZERO, 1e3 * DVec3::Y, DVec3::Z);
    exactly(&long, &wall, 0.292_782_901_039_901_96);
    by_rays(&long, &wall, 0.292_782_901_039_901_96, 1e-4);
}

#[test]
fn a_wall_that_stands_on_part_of_an_edge() {
    // A T-junction: the wall's foot is the middle half of the floor's edge.
    let wall = rectangle(DVec3::new(0.0, 0.25, 0.0), 0.5 * DVec3::Y, 0.5 * DVec3::Z);
    exactly(&floor(), &wall, 0.080_126_580_723_306_7);
    by_rays(&floor(), &wall, 0.080_126_580_723_306_7, 1e-6);
}

#[test]
fn a_face_cut_through_by_another() {
    let wide = rectangle(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y);
    let through = rectangle(DVec3::new(0.5, -1.0, -0.5), 1.5 * DVec3::Z, 2.0 * DVec3::Y);
    exactly(&wide, &through, 0.137_442_486_013_759_2);
    by_rays(&wide, &through, 0.137_442_486_013_759_2, 1e-6);
}

#[test]
fn coincident_faces_exchange_nothing() {
    let back: Vec<DVec3> = floor().into_iter().rev().collect();
    // Facing apart they see nothing of each other; facing each other there is no room between them for light.
    let below = rectangle(DVec3::new(0.0, 0.0, -0.5), DVec3::X, DVec3::Y);
    let above = rectangle(DVec3::new(0.0, 0.0, 1.0), DVec3::Y, DVec3::X);
    exactly(&floor(), &back, 0.0);
    by_rays(&floor(), &back, 0.0, 0.0);
    // A sheet of two faces hides what is behind it and is seen from both sides.
    let scene = objects(&[floor(), back, above.clone(), below.clone()]);
    let settings = FactorSettings { tolerance: 1e-4, seed: 0 };
    let table = factors(&scene, &[0.0], &settings, &Silent);
    let f = |from: usize, to: usize| table.factors[4 * from + to].share.value;
    // Howell's catalogue, C-11: squares at distance 1 and 0.5.
    assert!((f(2, 0) - 0.199_824_895_698_387_4).abs() < 1e-9, "{}", f(2, 0));
    assert!((f(3, 1) - 0.415_253_283_577_146_9).abs() < 1e-9, "{}", f(3, 1));
    for (from, to) in [(2, 1), (2, 3), (3, 0), (3, 2), (0, 1), (1, 0)] {
        assert!(f(from, to) <= 1e-7, "{from} to {to}: {}", f(from, to));
    }
}
