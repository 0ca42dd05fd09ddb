//! Opacity that is a share, by an image or by alpha of the vertices, before what is bright: pixels show the mean of it
//! over their area, by closed form.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3, Vec4};
use halflight::Solver;
use halflight::light::{Mode, Rgb};
use halflight::pictures::Picture;
use halflight::rays::sobol::Stream;
use halflight::scene::textures::{Channel, Filter, Image, Maps, Mask, Texture};
use halflight::scene::{Camera, LoadOptions, Material, Scene, SkyLight};
use halflight_reference::{TraceSettings, Tracer};

use crate::common::{Mesh, grey, rendered};
use crate::textures::{place, texture};

const SIZE: usize = 8;

/// A black pane from -1 to 1 in x and y that fills the view, twice as many texels to a side as `shares` has in its
/// side.
fn pane(maps: Maps) -> Scene {
    let p = DVec3::new;
    let mut mesh = Mesh::default();
    mesh.polygon(&[p(-1., -1., 0.), p(1., -1., 0.), p(1., 1., 0.), p(-1., 1., 0.)], 0);
    let mut scene = mesh.scene(vec![Material { maps: Some(Arc::new(maps)), ..grey("pane", 0.0) }]);
    place(&mut scene, DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.5, 0.0));
    look(&mut scene);
    scene
}

/// Looks at the pane from so far away that it fills the view.
fn look(scene: &mut Scene) {
    let [from, to] = [1.0, 0.0].map(|z| scene.frame.to_unit(DVec3::new(0.0, 0.0, z)));
    scene.camera = Camera::look_at(from, to, DVec3::Y, 80.0).expect("a view");
}

fn with_sky(mut scene: Scene) -> Scene {
    scene.set_sky(SkyLight { upper: Rgb::ONE, lower: Rgb::ONE }, DVec3::Y);
    scene
}

fn shares(width: usize, codes: Vec<u8>) -> Mask {
    let colours = texture(width, codes, Filter::Linear);
    let image = Arc::new(Image::shares(colours.image.texels(), Channel::Luminance));
    Mask { texture: Some(Texture { image, ..colours }), factor: 1.0, cutoff: None, over: Vec::new() }
}

fn picture(scene: &Scene) -> Picture {
    rendered(scene, Mode::Global.transport(), (SIZE, SIZE).into(), 0.02, 0).picture
}

/// The mean over each pixel of a function of the places of the pane that it sees.
fn means(of: impl Fn(DVec2) -> f64) -> Vec<f64> {
    const N: usize = 64;
    let half = 40_f64.to_radians().tan();
    let mean = |k: usize| {
        let at = |i: usize, j: usize| {
            let within = DVec2::new((i as f64 + 0.5) / N as f64, (j as f64 + 0.5) / N as f64);
            let pixel = DVec2::new((k % SIZE) as f64, (k / SIZE) as f64);
            let across = 2.0 * (pixel + within) / SIZE as f64 - 1.0;
            half * DVec2::new(across.x, -across.y)
        };
        (0..N * N).map(|i| of(at(i % N, i / N))).sum::<f64>() / (N * N) as f64
    };
    (0..SIZE * SIZE).map(mean).collect()
}

fn noise(width: usize) -> Vec<u8> {
    let mut random = Stream::new(3);
    (0..width * width).map(|_| (256.0 * random.uniform()) as u8).collect()
}

/// Texels from a tenth of a pixel to twice as large as one.
#[test]
fn a_pixel_shows_the_mean_share_of_its_area() {
    for width in [4, 32, 64] {
        let mask = shares(width, noise(width));
        let scene = with_sky(pane(Maps { mask: Some(mask.clone()), ..Maps::default() }));
        let expected = means(|at| 1.0 - f64::from(mask.at(0.5 * at, 1.0)));
        for (k, (found, expected)) in picture(&scene).pixels.iter().zip(&expected).enumerate() {
            // 64² points of a pixel, and its outline in single precision.
            assert!((f64::from(found.x) - expected).abs() < 2e-3, "{width}, {k}: {found} {expected}");
        }
    }
}

/// Alpha from 0 to 1 along x, by the corners of two triangles.
#[test]
fn alpha_of_vertices_is_a_share_of_each_place() {
    let mask = Some(Mask { texture: None, factor: 1.0, cutoff: None, over: Vec::new() });
    let mut scene = pane(Maps { mask, vertex_colours: true, ..Maps::default() });
    let alpha = |p: Vec3| Vec4::new(1.0, 1.0, 1.0, 0.5 + 0.5 * scene.frame.to_file(p.as_dvec3()).x as f32);
    scene.colours = (0..scene.faces.len() as u32).map(|face| scene.corners(face).map(alpha)).collect();
    let expected = means(|at| 0.5 - 0.5 * at.x);
    for (found, expected) in picture(&with_sky(scene)).pixels.iter().zip(&expected) {
        assert!((f64::from(found.x) - expected).abs() < 2e-3, "{found} {expected}");
    }
}

/// What a pane of one grey does is what `d` does, bit for bit.
#[test]
fn an_image_of_one_grey_is_a_number() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/files/opacity");
    let load = |name: &str| Scene::load(&folder.join(name), LoadOptions::default()).expect("a scene");
    let share = 128.0 / 255.0;
    for name in ["map-d-grey", "map-128-wall"] {
        let scene = load(&format!("{name}.toml"));
        let maps = scene.materials[0].maps.clone().expect("a mask");
        assert_eq!(*maps, Maps { mask: Some(Mask { factor: share, ..uniform() }), ..Maps::default() }, "{name}");
    }
    let by_image = load("map-d-grey.toml");
    let mut by_number = load("pane-50-sky.toml");
    by_number.materials[0].maps.clone_from(&by_image.materials[0].maps);
    let [a, b] = [by_image, by_number].map(|scene| picture(&scene).pixels);
    assert_eq!(a, b);
    assert!(a.iter().all(|pixel| (pixel.x - (1.0 - share)).abs() < 1e-6), "{a:?}");
}

fn uniform() -> Mask {
    Mask { texture: None, factor: 1.0, cutoff: None, over: Vec::new() }
}

/// Of two panes in one place each lets its rest through: the second is there where the first is not.
#[test]
fn panes_in_one_place_are_one_behind_the_other() {
    let corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
    let obj = format!("mtllib m.mtl\n{corners}usemtl a\nf 1 2 3 4\nusemtl b\nf 1 2 3 4\n");
    let mtl = "newmtl a\nKd 0\nd .5\nnewmtl b\nKd 0\nd .25\n";
    let mut scene = Scene::from_obj_text("s", &obj, mtl).expect("a scene");
    look(&mut scene);
    let found = picture(&with_sky(scene));
    assert!(found.pixels.iter().all(|pixel| (pixel.x - 0.375).abs() < 1e-6), "{:?}", found.pixels[0]);
}

/// A leaf of two faces back to back, or a fence before its like: holes lie behind holes, so that as much is seen
/// through both as through one.
#[test]
fn holes_behind_holes_are_holes() {
    let p = DVec3::new;
    let codes: Vec<u8> = (0..64 * 64).map(|k| if (k % 64 + k / 64) % 2 == 0 { 0 } else { 255 }).collect();
    let holes = Mask {
        texture: Some(Texture { filter: Filter::Nearest, ..shares(64, codes).texture.expect("one") }),
        ..uniform()
    };
    let mut mesh = Mesh::default();
    for z in [0.0, 1e-4] {
        mesh.polygon(&[p(-1., -1., z), p(1., -1., z), p(1., 1., z), p(-1., 1., z)], 0);
    }
    let maps = Some(Arc::new(Maps { mask: Some(holes), ..Maps::default() }));
    let mut scene = mesh.scene(vec![Material { maps, ..grey("pane", 0.0) }]);
    place(&mut scene, DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.5, 0.0));
    look(&mut scene);
    let found = picture(&with_sky(scene));
    let mean = found.pixels.iter().map(|pixel| f64::from(pixel.x)).sum::<f64>() / (SIZE * SIZE) as f64;
    // At least four rays a pixel, each of which sees the sky or nothing.
    let error = (0.25 / (4.0 * (SIZE * SIZE) as f64)).sqrt();
    assert!((mean - 0.5).abs() < 4.0 * error, "{mean} {error}");
}

/// Share and reflectance of one image, which go together from texel to texel, in front of a wall: against paths.
#[test]
fn a_share_goes_with_the_reflectance_of_its_texels() {
    let p = DVec3::new;
    let mut mesh = Mesh::default();
    mesh.polygon(&[p(-3., -3., -1.), p(3., -3., -1.), p(3., 3., -1.), p(-3., 3., -1.)], 1);
    mesh.polygon(&[p(-1., -1., 0.), p(1., -1., 0.), p(1., 1., 0.), p(-1., 1., 0.)], 0);
    let codes = noise(24);
    let maps = Maps {
        reflectance: Some(texture(24, codes.clone(), Filter::Linear)),
        mask: Some(shares(24, codes)),
        ..Maps::default()
    };
    let card = Material { maps: Some(Arc::new(maps)), ..grey("card", 1.0) };
    let mut scene = mesh.scene(vec![card, grey("wall", 0.5)]);
    place(&mut scene, DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.5, 0.0));
    look(&mut scene);
    let scene = with_sky(scene);
    let found = Solver::new(&scene).render(Mode::Global, (SIZE, SIZE)).tolerance(0.01).expect("a picture");
    let rays = halflight::rays::Rays::new(&scene);
    let transports = scene.transports(Mode::Global.transport());
    let mut tracer = Tracer::new(&scene, &rays, &transports, (SIZE, SIZE), &TraceSettings::default());
    tracer.pass(2048);
    let traced = tracer.mean();
    let shown = found.picture.pixels.iter().map(|pixel| f64::from(pixel.x)).sum::<f64>() / (SIZE * SIZE) as f64;
    let allowed = (4.0 * traced.error[0]).hypot(found.error.total * shown);
    assert!((shown - traced.value[0]).abs() < allowed, "{shown} {traced:?} {:?}", found.error);
}

/// The mean share over a patch is exact, however fine the image.
#[test]
fn patches_count_the_mean_share_exactly() {
    let mask = shares(128, noise(128));
    let codes: Vec<u8> = mask.texture.as_ref().expect("an image").image.texels().codes.clone();
    let scene = pane(Maps { mask: Some(mask), ..Maps::default() });
    let expected = codes.iter().map(|&code| f64::from(code) / 255.0).sum::<f64>() / codes.len() as f64;
    let found = [0, 1].map(|face| scene.means_of_face(face).coverage).iter().sum::<f64>() / 2.0;
    assert!((found - expected).abs() < 1e-5, "{found} {expected}");
}
