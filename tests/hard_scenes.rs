//! Scenes made to break the estimate of error, against pictures by another program (`tests/data/hard`), and what the
//! estimate itself must tell.

use std::path::Path;

use halflight::Solver;
use halflight::direct::Scratch;
use halflight::light::Mode;
use halflight::pictures::{Picture, read_picture, relative_rms};
use halflight::rays::sobol::Stream;
use halflight::render::Discretization;
use halflight::scene::{Scene, Sides};

use crate::common::{assemble_one, builtin, light_by_area, rendered, sampling};

fn folder(scene: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/hard").join(scene)
}

/// Renders a scene to a tolerance and compares with its reference.
fn is_as_near_as_asked_and_stated(name: &str, tolerance: f64) {
    is_so_over_seeds(name, tolerance, 1);
}

/// The same of the root of the mean squares over so many seeds.
fn is_so_over_seeds(name: &str, tolerance: f64, seeds: u32) {
    let folder = folder(name);
    let data = |file: &str| -> Picture { read_picture(folder.join(file)).expect("a picture") };
    let file = folder.join(format!("{name}.toml"));
    let scene = Scene::open(&file.to_string_lossy()).expect("a scene");
    let (reference, se, mask) = (data("reference.exr"), data("reference_se.exr"), data("mask.exr"));
    let mut squares = [0.0; 2];
    for seed in 0..seeds {
        let found = rendered(&scene, Mode::Global.transport(), reference.size(), tolerance, seed);
        let reached = relative_rms(&found.picture, &reference, Some(&mask), Some(&se)).unwrap();
        println!("{name}: reached {reached}, stated {:?}", found.error);
        squares[0] += reached * reached / f64::from(seeds);
        squares[1] += found.error.total.powi(2) / f64::from(seeds);
    }
    let [reached, stated] = squares.map(f64::sqrt);
    assert!(reached <= 1.1 * tolerance, "{name}: {reached}");
    assert!(reached <= 1.2 * stated, "{name}: {reached} {stated}");
}

#[test]
fn light_smaller_than_a_patch_is_found() {
    is_as_near_as_asked_and_stated("plain", 0.02);
}

#[test]
fn a_small_lamp_in_a_large_room_loses_no_light() {
    is_as_near_as_asked_and_stated("tinylamp", 0.02);
}

#[test]
fn narrow_surfaces_and_a_far_panel_are_right() {
    is_as_near_as_asked_and_stated("reveals", 0.02);
}

#[test]
fn a_few_pixels_in_a_window_do_not_escape_at_a_coarse_tolerance() {
    is_as_near_as_asked_and_stated("reveals", 0.05);
}

/// Of single seeds one pixel of 5,724 in the edge of the light makes a fifth of the squared error: 5.8, 4.2, 3.9 and
/// 4.2 % are true and 4.8 to 5.1 stated.
#[test]
fn light_through_slats_is_found_where_patches_of_one_size_fail() {
    is_so_over_seeds("louvres", 0.05, 4);
}

/// Seeds 0 to 3 stated 4.6 to 5.9 % where 6.2, 8.8, 5.0 and 7.4 were true.
#[test]
fn light_below_a_door_is_told_beside_itself_and_not_beside_noise() {
    is_as_near_as_asked_and_stated("underdoor", 0.05);
}

#[test]
fn a_floor_that_reaches_into_the_dark_is_parted() {
    is_as_near_as_asked_and_stated("halfdark", 0.02);
}

#[test]
fn thin_treads_and_narrow_stripes_are_right() {
    is_as_near_as_asked_and_stated("stairs", 0.02);
    is_as_near_as_asked_and_stated("stripes", 0.02);
}

#[test]
fn faces_may_coincide_and_cross() {
    is_as_near_as_asked_and_stated("coplanar", 0.02);
    is_as_near_as_asked_and_stated("interpenetrate", 0.02);
}

#[test]
fn a_small_thing_on_endless_ground_is_right() {
    is_as_near_as_asked_and_stated("sizes", 0.02);
}

/// Numbers of back parents passed the number of patches once, and the program ended.
#[test]
fn some_materials_may_be_two_sided() {
    let mut scene = builtin("cornell-box");
    scene.materials[1].sides = Sides::Two;
    let found = rendered(&scene, Mode::Global.transport(), (32, 32).into(), 0.05, 0);
    assert!(found.error.total < 0.1);
    let p = Solver::new(&scene).cut(1000);
    let parents = p.patches.parents();
    assert!(parents.iter().all(|&k| (k as usize) < p.patches.len()));
}

/// One visibility ray for each of many receivers must have no bias.
#[test]
fn light_that_is_asked_with_single_rays_is_that_of_many_rays() {
    let textured = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/room.toml");
    for scene in [builtin("furnished-room"), Scene::open(textured).expect("a scene")] {
        single_rays_agree_with_many(&Solver::new(&scene).cut(200));
    }
}

fn single_rays_agree_with_many(p: &Discretization) {
    let mode = assemble_one(p, Mode::Global.transport(), &sampling(16, 0));
    let lights = &mode.lights;
    let (mut scratch, mut random, mut hits) = (Scratch::default(), Stream::new(7), Vec::new());
    for patch in (0..p.patches.len()).step_by(23) {
        let receiver = p.patches.point(patch, 0.4, 0.6);
        let mut sample = || lights.sample(&receiver, patch as u32, &mut random, &mut scratch);
        let asked: Vec<glam::DVec3> = (0..4096).map(|_| sample()).collect();
        let by_area = || light_by_area(lights, &receiver, &mut random, &mut hits);
        let many: Vec<glam::DVec3> = std::iter::repeat_with(by_area).take(65_536).collect();
        for channel in 0..3 {
            let own: Vec<f64> = asked.iter().map(|light| light[channel]).collect();
            let (mean, error) = crate::common::mean_and_error(&own);
            let many: Vec<f64> = many.iter().map(|light| light[channel]).collect();
            let (many, of_many) = crate::common::mean_and_error(&many);
            let allowed = 5.0 * error.hypot(of_many) + 1e-6 * many + 1e-12;
            assert!((mean - many).abs() <= allowed, "{patch} {channel}: {mean} {many} {allowed}");
        }
    }
}
