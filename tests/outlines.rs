//! Light as emitted where outlines of emitters lie within pixels, against areas of polygons.
//!
//! Not tested here: what emitters light (`direct_light.rs`); slats and reveals in rooms (`hard_scenes.rs`).

use glam::DVec3;
use halflight::light::{Mode, Rgb};
use halflight::pictures::Size;
use halflight::rays::{Hit, Ray, Rays, Side};
use halflight::render::Rendered;
use halflight::scene::{Camera, Material, Scene, Sides, SkyLight};

use crate::common::{Facing, Mesh, random, rendered};

/// Rounding of positions in single precision and of the picture's values, a share of a pixel.
const ROUNDING: f64 = 2e-5;

fn lamp(name: &str, emission: Rgb) -> Material {
    Material::new(name, Rgb::ZERO, emission)
}

fn show(scene: &Scene, size: Size) -> Rendered {
    rendered(scene, Mode::Global.transport(), size, 0.05, 0)
}

/// The scene, looked at along -z from a height so that at z = 0 a picture of `size` rows shows -1 to 1.
fn from_above(mesh: Mesh, materials: Vec<Material>) -> Scene {
    let mut scene = mesh.scene(materials);
    let [from, to] = [4.0, 0.0].map(|z| scene.frame.to_unit(DVec3::new(0.0, 0.0, z)));
    let fov = 2.0 * 0.25_f32.atan().to_degrees();
    scene.camera = Camera::look_at(from, to, DVec3::Y, fov.into()).expect("a view");
    scene
}

/// A rectangle at z = `height` that faces up and covers, seen from z = 4, this part of z = 0.
fn level(mesh: &mut Mesh, [low, high]: [[f64; 2]; 2], height: f64, material: u32) {
    let at = |x: f64, y: f64| DVec3::new(0.25 * (4.0 - height) * x, 0.25 * (4.0 - height) * y, height);
    let corners = [at(low[0], low[1]), at(high[0], low[1]), at(high[0], high[1]), at(low[0], high[1])];
    mesh.polygon(&corners, material);
}

/// A share of a pixel that an interval covers.
fn covered([low, high]: [f64; 2], pixel: usize, pixels: usize) -> f64 {
    let at = |k: usize| 2.0 * k as f64 / pixels as f64 - 1.0;
    let overlap = high.min(at(pixel + 1)) - low.max(at(pixel));
    0.5 * pixels as f64 * overlap.max(0.0)
}

/// A panel behind wires of a tenth to a thousandth of a pixel: each pixel by areas alone, wherever rays pass.
#[test]
fn wires_before_a_panel_take_what_they_cover() {
    const PIXELS: usize = 24;
    let panel = [[-0.83, -0.7], [0.77, 0.9]];
    let wire = |k: usize| {
        let (x, half) = (-0.9 + 0.137 * k as f64, 0.05 / 12.0 / 3.0_f64.powi(k as i32 % 5));
        [x - half, x + half]
    };
    let mut mesh = Mesh::default();
    level(&mut mesh, panel, 0.0, 0);
    (0..13).for_each(|k| level(&mut mesh, [[wire(k)[0], -1.1], [wire(k)[1], 1.1]], 0.5 + 0.1 * k as f64, 1));
    let scene = from_above(mesh, vec![lamp("panel", Rgb::new(3.0, 2.0, 1.0)), lamp("wire", Rgb::ZERO)]);
    let found = show(&scene, (PIXELS, PIXELS).into());
    for (k, shown) in found.picture.pixels.iter().enumerate() {
        let (x, y) = (k % PIXELS, PIXELS - 1 - k / PIXELS);
        let of_panel = covered([panel[0][0], panel[1][0]], x, PIXELS);
        let hidden: f64 =
            (0..13).map(|w| covered([wire(w)[0].max(panel[0][0]), wire(w)[1].min(panel[1][0])], x, PIXELS)).sum();
        let exact = (of_panel - hidden) * covered([panel[0][1], panel[1][1]], y, PIXELS);
        let off = (f64::from(shown.x) / 3.0 - exact).abs();
        assert!(off < ROUNDING * PIXELS as f64, "({x}, {y}): {shown} {exact}");
    }
    assert_eq!(found.error.emission, 0.0);
}

/// Two panels that pass through each other along x = 0.05 seen from above: each is seen where it is higher.
#[test]
fn faces_that_pass_through_each_other_end_where_they_meet() {
    let (mut mesh, edge) = (Mesh::default(), 0.05);
    for (material, rise) in [(0, 0.4), (1, -0.4)] {
        // z = rise (x - edge (4 - z) / 4), so that they meet where the picture has x = edge.
        let at = |x: f64, y: f64| {
            let z = rise * (x - edge) / (1.0 + 0.25 * rise * x);
            DVec3::new(0.25 * (4.0 - z) * x, 0.25 * (4.0 - z) * y, z)
        };
        mesh.polygon(&[at(-1.5, -1.5), at(1.5, -1.5), at(1.5, 1.5)], material);
        mesh.polygon(&[at(-1.5, -1.5), at(1.5, 1.5), at(-1.5, 1.5)], material);
    }
    let scene = from_above(mesh, vec![lamp("right", Rgb::X), lamp("left", Rgb::Y)]);
    let found = show(&scene, (9, 9).into());
    for (k, shown) in found.picture.pixels.iter().enumerate() {
        let right = covered([edge, 1.0], k % 9, 9);
        let off = (f64::from(shown.x) - right).abs().max((f64::from(shown.y) - 1.0 + right).abs());
        assert!(off < 1e-4, "{k}: {shown} {right}");
    }
}

/// Of a sheet of two faces the front is seen, of two faces in one plane the first, as rays have it.
#[test]
fn of_faces_in_one_place_the_same_is_seen_as_by_rays() {
    let mut mesh = Mesh::default();
    let square = [[-0.31, -0.31], [0.31, 0.31]];
    level(&mut mesh, square, 0.0, 0);
    level(&mut mesh, [[-0.2, -0.5], [0.5, 0.23]], 0.0, 1);
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    mesh.polygon(&[at(-0.31, -0.31), at(-0.31, 0.31), at(0.31, 0.31), at(0.31, -0.31)], 2);
    let twice = |name, emission| Material { sides: Sides::Two, ..lamp(name, emission) };
    let scene = from_above(mesh, vec![lamp("first", Rgb::X), lamp("second", Rgb::Y), twice("back", Rgb::Z)]);
    let found = show(&scene, (7, 7).into());
    let sum = found.picture.pixels.iter().map(|p| p.as_dvec3()).sum::<DVec3>() * (2.0 / 7.0_f64).powi(2);
    let exact = DVec3::new(0.62 * 0.62, 0.7 * 0.73 - 0.51 * 0.54, 0.0);
    assert!((sum - exact).abs().max_element() < 1e-4, "{sum} {exact}");
}

/// A ball of 80 faces that covers 8e-9 of a pixel shows its light, though no face is much.
#[test]
fn a_far_lamp_of_many_faces_shines() {
    let mut mesh = Mesh::default();
    mesh.sphere(1e-5, 1, Facing::Out, 0);
    level(&mut mesh, [[-1.0, -1.0], [1.0, 1.0]], -0.5, 1);
    let scene = from_above(mesh, vec![lamp("ball", Rgb::splat(1e9)), lamp("plane", Rgb::ZERO)]);
    let found = show(&scene, (24, 24).into());
    let sum: f64 = found.picture.pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() * (2.0 / 24.0_f64).powi(2);
    let size = scene.frame.to_unit(DVec3::X).distance(scene.frame.to_unit(DVec3::ZERO));
    let seen_of = |face: u32| {
        let [a, b, c] = scene.corners(face).map(|corner| corner.as_dvec3() / size);
        0.5 * (b - a).cross(c - a).z.max(0.0)
    };
    let exact: f64 = 1e9 * (0..80).map(seen_of).sum::<f64>();
    assert!(exact > 0.28 && (sum / exact - 1.0).abs() < 1e-4, "{sum} {exact}");
}

/// A heap of lamps, black triangles and backs of lamps that pass through each other, numbered by `seed`.
fn heap(seed: u32) -> (Mesh, Vec<Material>) {
    let mut mesh = Mesh::default();
    let uniform = |k: u32, d: u32| 2.0 * random(k, 100 * seed + d) - 1.0;
    for k in 0..40 {
        let size = if k % 4 == 0 { 1.0 } else { 0.2 };
        let place = |d: u32| DVec3::from([0, 1, 2].map(|axis| uniform(k, d + axis)));
        mesh.polygon(&[3, 6, 9].map(|d| place(0) + size * place(d)), k % 8);
    }
    let colour = |k: u32| Rgb::from([1, 2, 3].map(|d| random(k, d) as f32));
    let material = |k: u32| Material {
        sides: if k.is_multiple_of(2) { Sides::Two } else { Sides::One },
        ..lamp("lamp", if k == 0 { Rgb::ZERO } else { colour(k) })
    };
    (mesh, (0..8).map(material).collect())
}

/// The light of each pixel by `side`² rays, and its largest standard error where edges are `length` pixels long: each
/// cell on them has the variance 1/4 or less.
fn by_rays(scene: &Scene, pixels: usize, side: usize, length: f64) -> (Vec<DVec3>, f64) {
    let rays = Rays::new(scene);
    let count = side * side;
    let one = |k: usize, sample: usize| {
        let jitter = |d: u32| random(sample as u32, d + k as u32);
        let x = (k % pixels) as f64 + ((sample % side) as f64 + jitter(7)) / side as f64;
        let y = (k / pixels) as f64 + ((sample / side) as f64 + jitter(5003)) / side as f64;
        let (origin, direction) = scene.camera.ray((x / pixels as f64) as f32, (y / pixels as f64) as f32, 1.0);
        let hit = rays.closest(&Ray { origin, direction, source: None });
        let emits = |hit: &Hit| hit.side == Side::Front || scene.material(hit.face).sides == Sides::Two;
        hit.filter(emits).map_or(DVec3::ZERO, |hit| scene.material(hit.face).emission.as_dvec3())
    };
    let mean = |k: usize| (0..count).map(|sample| one(k, sample)).sum::<DVec3>() / count as f64;
    ((0..pixels * pixels).map(mean).collect(), (0.25 * length * side as f64).sqrt() / count as f64)
}

/// Before a panel that fills the picture every pixel is exact.
#[test]
fn heaps_of_lamps_are_as_rays_find_them() {
    for seed in 0..4 {
        let (mut mesh, mut materials) = heap(seed);
        level(&mut mesh, [[-3.0, -3.0], [3.0, 3.0]], -2.5, 8);
        materials.push(lamp("panel", Rgb::new(0.2, 0.5, 0.1)));
        let scene = from_above(mesh, materials);
        let found = show(&scene, (10, 10).into());
        let (all, error) = by_rays(&scene, 10, 96, 8.0);
        for (k, (shown, mean)) in found.picture.pixels.iter().zip(all).enumerate() {
            let off = (shown.as_dvec3() - mean).abs().max_element();
            assert!(off < 4.0 * error, "seed {seed}, pixel {k}: {shown} {mean} {error}");
        }
        assert_eq!(found.error.emission, 0.0);
    }
}

/// Before a sky those pixels are exact whose rays, or whose neighbours', disagree.
#[test]
fn heaps_of_lamps_before_a_sky_are_as_near_as_asked() {
    for seed in 0..3 {
        let (mesh, materials) = heap(seed);
        let mut scene = from_above(mesh, materials);
        let sky = SkyLight { upper: Rgb::new(0.1, 0.5, 0.2), lower: Rgb::new(0.3, 0.1, 0.0) };
        scene.set_sky(sky, DVec3::Y);
        let found = show(&scene, (32, 32).into());
        let (all, _) = by_rays(&scene, 32, 32, 8.0);
        let squared = found.picture.pixels.iter().zip(&all).map(|(p, e)| (p.as_dvec3() - e).length_squared());
        let reached = (squared.sum::<f64>() / all.iter().map(|e| e.length_squared()).sum::<f64>()).sqrt();
        assert!(reached < 1.1 * 0.05, "{seed}: {reached} {:?}", found.error);
    }
}
