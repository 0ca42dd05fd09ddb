//! Textures: against closed forms, against the path tracer in every mode, and masks against geometry cut out.
//!
//! Not tested here: what Mitsuba makes of the same textures; docs/validation.md has that.

mod barrier;
mod emission;
mod files;
mod glb;
mod masks;
mod pictures;
mod shares;

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2};
use halflight::light::Rgb;
use halflight::pictures::Texels;
use halflight::scene::textures::{Filter, Image, Maps, Texture, Wrap};
use halflight::scene::{Material, Scene};

/// The room of `tests/data/textured`.
fn room() -> Scene {
    Scene::open(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/room.toml")).expect("a scene")
}

/// A texture of grey codes, `width` to a row.
fn texture(width: usize, codes: Vec<u8>, filter: Filter) -> Texture {
    let texels = Texels { width, height: codes.len() / width, channels: 1, codes };
    let placement = Texture::upright(DVec2::ONE, DVec2::ZERO);
    Texture { image: Arc::new(Image::new(texels)), placement, wrap: [Wrap::Repeat; 2], filter }
}

/// Black and white by turns, n x n.
fn checker(n: usize) -> Vec<u8> {
    (0..n * n).map(|k| if (k % n + k / n).is_multiple_of(2) { 0 } else { 255 }).collect()
}

/// A material that reflects rho times a texture.
fn textured(rho: f32, texture: Texture) -> Material {
    let maps = Maps { reflectance: Some(texture), ..Maps::default() };
    Material { maps: Some(Arc::new(maps)), ..Material::new("textured", Rgb::splat(rho), Rgb::ZERO) }
}

/// Gives every face of a scene coordinates: its points along two vectors.
fn place(scene: &mut Scene, u: DVec3, v: DVec3) {
    let at = |p: glam::Vec3| {
        let p = scene.frame.to_file(p.as_dvec3());
        Vec2::new(p.dot(u) as f32, p.dot(v) as f32)
    };
    scene.coordinates = (0..scene.faces.len() as u32).map(|f| scene.corners(f).map(at)).collect();
}

/// A face thinner than coordinates of single precision tell has no area left by them. Its light was no number, and the
/// error stated of a picture with such a face was 0 %.
#[test]
fn a_face_that_rounding_leaves_without_area_has_a_reflectance() {
    let mut scene = Scene::open("cornell-box").expect("a built-in scene");
    let face = scene.faces[0];
    let [a, b, c] = face.vertices.map(|v| v as usize);
    scene.vertices[a] = glam::Vec3::new(0.25, 0.5, 0.0);
    scene.vertices[b] = glam::Vec3::new(0.75, 0.5, 0.0);
    scene.vertices[c] = glam::Vec3::new(0.5, 0.5, 0.0);
    place(&mut scene, DVec3::X, DVec3::Z);
    scene.materials[face.material as usize] = textured(0.5, texture(4, checker(4), Filter::Linear));
    let at = scene.vertices[c];
    assert!(scene.coordinates_at(0, at).is_finite());
    let rho = scene.rho_at(0, at);
    assert!((0.0..=0.5).contains(&rho.x), "{rho}");
    let means = scene.means(0, scene.corners(0));
    assert!((0.0..=0.5).contains(&means.rho.x), "{means:?}");
}
