//! Colours of vertices and opacities: as files say them, in means over faces, at points, and in pictures.
//!
//! Not tested here: what other readers make of the same files.

mod glb;
mod opacity;

use std::fs;

use glam::{DVec3, Vec3, Vec4};
use halflight::Solver;
use halflight::light::Mode;
use halflight::rays::Rays;
use halflight::scene::{Camera, LoadOptions, Scene, SkyLight};
use halflight_reference::{TraceSettings, Tracer};

/// Corners of a square in y = 0 that faces up, each with what follows its coordinates.
fn square(behind: [&str; 4]) -> String {
    let corners = ["0 0 0", "0 0 1", "1 0 1", "1 0 0"];
    corners.iter().zip(behind).map(|(corner, behind)| format!("v {corner} {behind}\n")).collect()
}

fn read(obj: &str, mtl: &str) -> Scene {
    Scene::from_obj_text("s", obj, mtl).expect("a scene")
}

/// rho at a point given in the file's units, on the face that holds it.
fn rho(scene: &Scene, x: f64, z: f64) -> Vec3 {
    let at = scene.frame.to_unit(DVec3::new(x, 0.0, z)).as_vec3();
    let inside = |face: &u32| {
        let [a, b, c] = scene.corners(*face);
        [(a, b), (b, c), (c, a)].iter().all(|&(p, q)| (q - p).cross(at - p).y >= -1e-6)
    };
    scene.rho_at((0..scene.faces.len() as u32).find(inside).expect("a face"), at)
}

#[track_caller]
fn near(a: Vec3, b: Vec3) {
    // Some roundings of single precision.
    assert!((a - b).abs().max_element() < 1e-6, "{a} {b}");
}

#[track_caller]
fn warns(scene: &Scene, parts: &[&str]) {
    assert_eq!(scene.warnings.len(), parts.len(), "{:#?}", scene.warnings);
    for part in parts {
        assert_eq!(scene.warnings.iter().filter(|w| w.contains(part)).count(), 1, "{part}: {:#?}", scene.warnings);
    }
}

/// What the sRGB codes over 255 that an OBJ has stand for, by the curve of IEC 61966-2-1.
fn decoded(codes: Vec3) -> Vec3 {
    let curve = |v: f32| if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    Vec3::new(curve(codes.x), curve(codes.y), curve(codes.z))
}

const FACE: &str = "mtllib m.mtl\nusemtl a\nf 1 2 3 4\n";
const RED: &str = ".8 .1 .05";

#[test]
fn a_colour_is_what_a_material_that_says_nothing_reflects() {
    let red = decoded(Vec3::new(0.8, 0.1, 0.05));
    let without = "f 1 2 3 4\n";
    for (faces, mtl, expected, warned) in [
        (without, "", red, "no usemtl"),
        ("usemtl a\nf 1 2 3 4\n", "", red, "1 undefined material"),
        (FACE, "newmtl a\n", red, "1 missing Kd"),
        (FACE, "newmtl a\nKd 1 1 1\n", red, ""),
        (FACE, "newmtl a\nKd .5 1 0\n", red * Vec3::new(0.5, 1.0, 0.0), ""),
    ] {
        let scene = read(&format!("{}{faces}", square([RED; 4])), mtl);
        near(rho(&scene, 0.3, 0.6), expected);
        // One colour is the material's own number.
        assert!(!scene.is_textured() && scene.colours.is_empty());
        let parts: &[&str] = if warned.is_empty() { &[] } else { &[warned] };
        warns(&scene, parts);
        assert!(scene.warnings.iter().all(|w| w.contains("where vertices have no colour")));
    }
}

#[test]
fn colours_are_linear_over_each_triangle() {
    let obj = format!("{}{FACE}", square(["1 0 0", "0 1 0", "0 0 1", "1 1 1"]));
    let scene = read(&obj, "newmtl a\nKd .5 .5 .5\n");
    assert_eq!(scene.colours.len(), 2);
    // (0, 0), (0, 1), (1, 1) is the first triangle: weights 1 - z, z - x, x.
    let expected = |x: f32, z: f32| 0.5 * Vec3::new(1.0 - z, z - x, x);
    for (x, z) in [(0.0, 0.0), (0.1, 0.7), (0.25, 0.5), (0.9, 0.95), (0.0, 1.0)] {
        near(rho(&scene, x, z), expected(x as f32, z as f32));
    }
    for face in 0..2 {
        let corners = scene.corners(face);
        let middle = corners.iter().sum::<Vec3>() / 3.0;
        let means = scene.means(face, corners);
        near(means.rho.as_vec3(), scene.rho_at(face, middle));
        near(scene.means_of_face(face).rho.as_vec3(), means.rho.as_vec3());
        // Over a part as well.
        let part = [corners[0], middle, corners[1]];
        near(scene.means(face, part).rho.as_vec3(), scene.rho_at(face, part.iter().sum::<Vec3>() / 3.0));
    }
}

#[test]
fn corners_of_cut_polygons_keep_their_colours() {
    // An arrow, cut into two triangles away from its first corner, turned in every way.
    let corners = [("0 0 0", "1 0 0"), ("2 0 -1", "0 1 0"), ("0 0 -2", "0 0 1"), (".5 0 -1", "1 1 0")];
    for start in 0..4 {
        let turned = (0..4).map(|k| corners[(start + k) % 4]);
        let vertices: String = turned.map(|(place, colour)| format!("v {place} {colour}\n")).collect();
        let scene = read(&format!("{vertices}f 1 2 3 4\n"), "");
        let mut met = 0;
        for face in 0..scene.faces.len() as u32 {
            for (corner, own) in scene.exact_corners(face).into_iter().zip(scene.colours[face as usize]) {
                let place = scene.frame.to_file(corner);
                let text = format!("{} 0 {}", place.x, place.z);
                let known = corners
                    .iter()
                    .find(|(name, _)| name.replace("v ", "") == text.replace("0.5", ".5"))
                    .expect("a corner");
                let numbers: Vec<f32> = known.1.split(' ').map(|word| word.parse().unwrap()).collect();
                near(own.truncate(), Vec3::from_slice(&numbers));
                met += 1;
            }
        }
        assert_eq!(met, 6);
    }
}

#[test]
fn vertices_without_a_colour_are_white_or_the_grey_of_their_material() {
    let some = square([RED, RED, "", RED]);
    let scene = read(&format!("{some}{FACE}"), "newmtl a\nKd .5 .5 .5\n");
    near(rho(&scene, 1.0, 1.0), Vec3::splat(0.5));
    near(rho(&scene, 0.0, 0.0), 0.5 * decoded(Vec3::new(0.8, 0.1, 0.05)));
    warns(&scene, &["1 partly coloured face (first: s.obj, line 7)"]);
    let scene = read(&format!("{some}f 1 2 3 4\n"), "");
    near(rho(&scene, 1.0, 1.0), Vec3::splat(0.5));
    near(rho(&scene, 0.0, 0.0), decoded(Vec3::new(0.8, 0.1, 0.05)));
    // Another face of the same grey keeps it, and a face of fewer than three corners shifts no colours.
    let other = format!("{}v 3 0 0\nv 3 0 1\nv 4 0 1\nf 1 2\nf 1 2 3 4\nf 5 6 7\n", square([RED; 4]));
    let scene = read(&other, "");
    near(rho(&scene, 3.2, 0.6), Vec3::splat(0.5));
    near(rho(&scene, 0.3, 0.6), decoded(Vec3::new(0.8, 0.1, 0.05)));
}

#[test]
fn numbers_behind_coordinates_are_read_or_warned_of() {
    for (behind, expected, warned) in [
        ("1", Vec3::splat(0.5), None),
        ("2", Vec3::splat(0.5), Some("4 vertex weights (first: s.obj, line 1)")),
        ("1 .8 .1 .05", decoded(Vec3::new(0.8, 0.1, 0.05)), Some("4 seven-number vs")),
        ("204 25.5 0", Vec3::ONE.with_z(0.0), Some("4 vertex colours (first: s.obj, line 1): its numbers are clamped")),
        ("-.1 .5 1", decoded(Vec3::new(0.0, 0.5, 1.0)), Some("4 vertex colours")),
        (".5 .5", Vec3::splat(0.5), Some("4 vs (first: s.obj, line 1): what follows x y z")),
        (".5 .5 1 1 1", Vec3::splat(0.5), Some("4 vs (first")),
        ("nan 0 0", Vec3::splat(0.5), Some("4 vs (first")),
        ("red", Vec3::splat(0.5), Some("4 vs (first")),
        (".8 .1 .05 # wood", decoded(Vec3::new(0.8, 0.1, 0.05)), None),
    ] {
        let scene = read(&format!("{}f 1 2 3 4\n", square([behind; 4])), "");
        near(rho(&scene, 0.2, 0.7), expected);
        let parts: Vec<&str> = std::iter::once("no usemtl").chain(warned).collect();
        warns(&scene, &parts);
    }
    let painted = format!("{}#MRGB ffff0000ffff0000\nf 1 2 3 4\n", square([""; 4]));
    warns(&read(&painted, ""), &["no usemtl", "line 5: colours of vertices in comments (#MRGB)"]);
}

#[test]
fn colours_are_factors_on_textures() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let checker = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/checker.png");
    fs::copy(checker, at("checker.png")).unwrap();
    fs::write(at("m.mtl"), "newmtl a\nmap_Kd checker.png\n").unwrap();
    let corners = "vt 0 0\nvt 0 1.3\nvt 1.7 1.3\nvt 1.7 0\nmtllib m.mtl\nusemtl a\nf 1/1 2/2 3/3 4/4\n";
    let load = |behind| {
        fs::write(at("s.obj"), format!("{}{corners}", square(behind))).unwrap();
        Scene::load(&at("s.obj"), LoadOptions::default()).unwrap()
    };
    let (plain, coloured) = (load([""; 4]), load(["1 0 0", "0 1 0", "0 0 1", "1 1 1"]));
    assert!(plain.warnings.is_empty() && coloured.warnings.is_empty());
    let colour = |x: f32, z: f32| Vec3::new(1.0 - z, z - x, x);
    for (x, z) in [(0.1f32, 0.7f32), (0.25, 0.5), (0.3, 0.95)] {
        near(rho(&coloured, x.into(), z.into()), colour(x, z) * rho(&plain, x.into(), z.into()));
    }
    // The mean over a face by as many points as tell it within 1/n of what texels differ by along their borders.
    const N: u32 = 400;
    let corners = coloured.corners(0);
    let mut sum = DVec3::ZERO;
    for (i, j) in (0..N).flat_map(|i| (0..N - i).map(move |j| (i, j))) {
        let [v, w] = [i, j].map(|k| (k as f32 + 1.0 / 3.0) / N as f32);
        let at = (1.0 - v - w) * corners[0] + v * corners[1] + w * corners[2];
        sum += coloured.rho_at(0, at).as_dvec3();
    }
    let expected = sum / f64::from(N * (N + 1) / 2);
    // 64 parts have the colour of their middle each: a texture that differs by 1 within a part, whose colours differ by
    // 1/8, is off by some hundredth of that where parts cut it at random.
    let found = coloured.means_of_face(0).rho;
    assert!((found - expected).abs().max_element() < 5e-3, "{found} {expected}");
}

/// A plate under a sky of radiance 1 shows its reflectance, in every pixel and by either method.
#[test]
fn a_plate_under_the_sky_shows_its_colours() {
    let mut scene = read(&format!("{}f 1 2 3 4\n", square([".9 .1 .5", ".1 .9 .5", ".3 .2 1", "0 1 .2"])), "");
    scene.set_sky(SkyLight { upper: Vec3::ONE, lower: Vec3::ZERO }, DVec3::Y);
    let eye = scene.frame.to_unit(DVec3::new(0.5, 1.0, 0.5));
    scene.camera = Camera::look_at(eye, eye - DVec3::Y, DVec3::Z, 30.0).unwrap();
    let n = 12;
    let shown = |x: f32, y: f32| {
        let (origin, way) = scene.camera.ray(x, y, 1.0);
        let at = scene.frame.to_file((origin - way * (origin.y / way.y)).as_dvec3());
        rho(&scene, at.x, at.z)
    };
    let picture = Solver::new(&scene).render(Mode::Global, (n, n)).tolerance(0.01).expect("a picture");
    let rays = Rays::new(&scene);
    let transports = scene.transports(Mode::Global.transport());
    let mut tracer = Tracer::new(&scene, &rays, &transports, (n, n), &TraceSettings::default());
    tracer.pass(256);
    let (traced, error) = (tracer.picture(), tracer.standard_error().unwrap());
    for (k, pixel) in picture.picture.pixels.iter().enumerate() {
        let [x, y] = [k % n, k / n].map(|p| (p as f32 + 0.5) / n as f32);
        // Colours are linear over the pixel but where the diagonal cuts it, and then bend by a pixel's change at most.
        let step = 1.0 / n as f32;
        let change = (shown(x + 0.5 * step, y) - shown(x - 0.5 * step, y)).abs()
            + (shown(x, y + 0.5 * step) - shown(x, y - 0.5 * step)).abs();
        let allowed = 0.5 * change.max_element() + 0.01;
        assert!((*pixel - shown(x, y)).abs().max_element() < allowed, "{k} {pixel} {}", shown(x, y));
        let apart = (traced.pixels[k] - *pixel).abs() - 5.0 * error.pixels[k];
        assert!(apart.max_element() < 0.02, "{k} {} {pixel}", traced.pixels[k]);
    }
}

/// Faces made from arrays have no colours, and a scene may be given some.
#[test]
fn a_scene_may_be_coloured_by_hand() {
    let mut scene = read(&format!("{}f 1 2 3 4\n", square([""; 4])), "");
    let maps = halflight::scene::textures::Maps { vertex_colours: true, ..Default::default() };
    scene.materials[0].maps = Some(std::sync::Arc::new(maps));
    // Without any they are white.
    near(rho(&scene, 0.2, 0.7), Vec3::splat(0.5));
    scene.colours = vec![[Vec4::new(0.2, 0.4, 0.6, 1.0); 3]; 2];
    near(rho(&scene, 0.2, 0.7), 0.5 * Vec3::new(0.2, 0.4, 0.6));
    near(scene.means_of_face(1).rho.as_vec3(), 0.5 * Vec3::new(0.2, 0.4, 0.6));
}
