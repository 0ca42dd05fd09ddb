//! Pictures that are wrong in a known way: a lamp that is brighter, a camera that is shifted, a gamma, and one that
//! another program made and that is right.

use std::path::Path;

use halflight::Solver;
use halflight::light::Rgb;
use halflight::pictures::{Picture, read_picture};
use halflight::render::Silent;
use halflight::scene::Scene;
use halflight_audit::{AuditGoal, Cause, Verdict, audit, verdict};

use crate::{global, score, told};

/// The picture of a scene, good to 2 %.
fn picture(scene: &Scene) -> Picture {
    let mode = halflight::Mode::Global;
    Solver::new(scene).render(mode, (48, 48)).tolerance(0.02).expect("a picture").picture
}

/// A fault explains most of the error, and is told first.
#[test]
fn a_gamma_and_a_shift_are_named() {
    let (scene, mode) = global("cornell-box");
    let right = picture(&scene);
    let power = |pixel: &Rgb| pixel.map(|v| v.powf(1.15));
    let bent = Picture { pixels: right.pixels.iter().map(power).collect(), ..right };
    let own = told(&scene, mode, &bent, 0.02, 1);
    let Some(Cause::Gamma { gamma, explains }) = own.causes.first() else { panic!("{:?}", own.causes) };
    assert!((gamma.value - 1.15).abs() < 0.03 && *explains > 0.8, "{:?}", own.causes);

    let mut moved = scene.clone();
    // A pixel to the right: what is seen moves to the left.
    let pixel = moved.camera.pixel(48) as f32;
    moved.camera.forward = (moved.camera.forward + pixel * moved.camera.right).normalize();
    let own = told(&scene, mode, &picture(&moved), 0.02, 1);
    let Some(Cause::Shift { right, down, explains }) = own.causes.first() else { panic!("{:?}", own.causes) };
    assert!((-1.3..-0.4).contains(&right.value) && down.value.abs() < 0.2 && *explains > 0.3, "{:?}", own.causes);
    // Most of it is at edges: somewhere the map has far more than in the mean.
    let largest = own.squared.pixels.iter().map(|p| p.x).fold(0.0, f32::max);
    assert!(f64::from(largest) > 2.0 * own.error.relative().value * own.error.rms, "{largest} {:?}", own.error);
}

/// One of two lamps is half as bright: the picture is darker below it, and right below the other.
#[test]
fn a_wrong_lamp_is_seen_where_it_shines() {
    let obj = "mtllib s.mtl\nusemtl floor\nv -4 0 2\nv 4 0 2\nv 4 0 -2\nv -4 0 -2\nf 1 2 3 4\n\
               usemtl left\nv -3 1.5 -0.5\nv -2 1.5 -0.5\nv -2 1.5 0.5\nv -3 1.5 0.5\nf 5 6 7 8\n\
               usemtl right\nv 2 1.5 -0.5\nv 3 1.5 -0.5\nv 3 1.5 0.5\nv 2 1.5 0.5\nf 9 10 11 12\n\
               usemtl wall\nv 0 0 -2\nv 0 0 2\nv 0 3 2\nv 0 3 -2\nf 13 14 15 16\nf 16 15 14 13\n";
    let mtl = |right: f32| {
        format!(
            "newmtl floor\nKd 0.5 0.5 0.5\nnewmtl wall\nKd 0.5 0.5 0.5\nnewmtl left\nKd 0 0 0\nKe 5 5 5\n\
             newmtl right\nKd 0 0 0\nKe {right} {right} {right}\n"
        )
    };
    let toml =
        "obj = \"s.obj\"\n[camera]\nposition = [0, 9, 0.01]\ntarget = [0, 0, 0]\nup = [0, 0, -1]\nvertical_fov = 50\n";
    let scene = |right: f32| Scene::from_toml_text("s", toml, obj, &mtl(right), Default::default()).expect("a scene");
    let own = told(&scene(5.0), halflight::Mode::Global.transport(), &picture(&scene(2.5)), 0.1, 1);
    let half = |columns: std::ops::Range<usize>| {
        let all = own.signed.pixels.iter().enumerate().filter(|(k, _)| columns.contains(&(k % 48)));
        all.map(|(_, shown)| f64::from(shown.element_sum())).sum::<f64>()
    };
    let (left, right) = (half(0..24), half(24..48));
    assert!(right < 0.0 && left.abs() < 0.03 * right.abs(), "{left} {right}");
    assert!(own.parts[0].columns.start >= 24 && (own.parts[0].mean.value + 0.5).abs() < 0.03, "{:?}", own.parts);
    // A half of all light is half as bright.
    assert!((own.mean.total.value + 0.25).abs() < 0.02, "{:?}", own.mean);
}

/// The Cornell box by Mitsuba, whose noise is 0.29 % at 256 pixels a side and known at each of these.
#[test]
fn the_reference_of_another_program_is_right() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/cornell");
    let [reference, noise] = ["reference.exr", "reference_se.exr"].map(|name| read_picture(folder.join(name)).unwrap());
    let (scene, mode) = global("cornell-box");
    let goal = AuditGoal { at_most: Some(0.03), ..AuditGoal::default() };
    let own = audit(&scene, mode, &reference, &goal, &Silent).expect("an audit");
    assert_eq!(verdict(&own.error, 0.03), Verdict::Within, "{:?}", own.error);
    assert!(score(own.mean.total, 0.0).abs() < 4.0, "{:?}", own.mean);
    let squares = |of: &Picture| of.pixels.iter().map(|p| p.as_dvec3().length_squared()).sum::<f64>();
    let masked =
        Picture { pixels: (0..own.mask.pixels.len()).map(|k| own.mask.pixels[k] * noise.pixels[k]).collect(), ..noise };
    let truth = squares(&masked) / (3.0 * own.error.pixels as f64 * own.error.rms.powi(2));
    assert!(score(own.error.squared, truth).abs() < 4.0, "{:?} {truth}", own.error);
}
