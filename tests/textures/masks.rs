//! Masks: holes, half-transparent surfaces, and what they leave of power and pictures.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use halflight::Solver;
use halflight::light::{Mode, Rgb};
use halflight::rays::sobol::Stream;
use halflight::rays::{Ray, Rays};
use halflight::scene::textures::{Channel, Filter, Image, Maps, Mask, Texture};
use halflight::scene::{Camera, Material, Scene, SkyLight};
use halflight_reference::{TraceSettings, Tracer};

use crate::common::{Mesh, grey, rendered};
use crate::textures::{place, texture};

/// A floor, a lamp above it, and between them a card from x = -1 to `end` with a mask.
fn shaded(end: f64, mask: Option<Mask>) -> Scene {
    let p = DVec3::new;
    let mut mesh = Mesh::default();
    mesh.polygon(&[p(-2., 0., 2.), p(2., 0., 2.), p(2., 0., -2.), p(-2., 0., -2.)], 0);
    mesh.polygon(&[p(-1., 1., 1.), p(end, 1., 1.), p(end, 1., -1.), p(-1., 1., -1.)], 1);
    mesh.polygon(&[p(-0.5, 2., -0.5), p(0.5, 2., -0.5), p(0.5, 2., 0.5), p(-0.5, 2., 0.5)], 2);
    let maps = mask.map(|mask| Arc::new(Maps { mask: Some(mask), ..Maps::default() }));
    let card = Material { maps, ..grey("card", 0.7) };
    let lamp = Material { emission: Rgb::splat(5.0), ..grey("lamp", 0.0) };
    let mut scene = mesh.scene(vec![grey("floor", 0.5), card, lamp]);
    place(&mut scene, DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.0, 0.0, 0.5));
    scene
}

fn mask(width: usize, codes: Vec<u8>) -> Mask {
    let colours = texture(width, codes, Filter::Nearest);
    let image = Arc::new(Image::shares(colours.image.texels(), Channel::Luminance));
    Mask { texture: Some(Texture { image, ..colours }), factor: 1.0, cutoff: None, over: Vec::new() }
}

/// Coordinates run from -0.5 to 0.5: the image's second half, then its first. The card is there for x < 0.
fn half() -> Mask {
    mask(2, vec![0, 255])
}

#[test]
fn rays_pass_where_there_is_nothing() {
    let scene = shaded(1.0, Some(half()));
    let rays = Rays::new(&scene);
    let unit = |x: f64, y: f64| scene.frame.to_unit(DVec3::new(x, y, 0.3)).as_vec3();
    for (x, there) in [(-0.9, true), (-0.01, true), (0.01, false), (0.9, false)] {
        let ray = Ray { origin: unit(x, 1.5), direction: Vec3::NEG_Y, source: None };
        let met = rays.closest(&ray).expect("the floor or the card").face;
        assert_eq!(scene.faces[met as usize].material, u32::from(there), "{x}");
        let mut all = Vec::new();
        rays.crossings(&ray, &mut all);
        assert_eq!(all.len(), 1 + usize::from(there));
        let ends = ((unit(x, 1.5), None), (unit(x, 0.5), None));
        assert_eq!(rays.visible(ends.0, ends.1), !there);
        let through = rays.transmittance(ends.0, ends.1, &[0.0, 0.25, 0.0], &mut Vec::new());
        assert_eq!(through, if there { 0.25 } else { 1.0 });
    }
}

#[test]
fn a_share_lets_the_rest_through_in_the_mean() {
    let scene = shaded(1.0, Some(Mask { factor: 0.3, ..mask(1, vec![255]) }));
    let rays = Rays::new(&scene);
    let n = 10_000;
    let passed = (0..n).filter(|&k| {
        let at = |k: i32, y: f64| {
            let x = 1.8 * (f64::from(k) * 0.618_034).fract() - 0.9;
            scene.frame.to_unit(DVec3::new(x, y, 1.8 * (f64::from(k) / f64::from(n)) - 0.9)).as_vec3()
        };
        rays.visible((at(k, 1.5), None), (at(k, 0.5), None))
    });
    let share = passed.count() as f64 / f64::from(n);
    // Four standard errors of so many chances of 0.7.
    assert!((share - 0.7).abs() < 4.0 * (0.21 / f64::from(n)).sqrt(), "{share}");
}

#[test]
fn patches_count_what_is_there_of_them() {
    let p = Solver::new(&shaded(1.0, Some(half()))).cut(40);
    let cut = Solver::new(&shaded(0.0, None)).cut(40);
    let area = |p: &halflight::render::Discretization| -> f64 {
        let own = p.patches.materials().iter().zip(p.patches.areas()).filter(|(m, _)| **m == 1);
        own.map(|(_, a)| a).sum()
    };
    // 24² points of each piece, none of which the edge cuts.
    assert!((area(&p) / area(&cut) - 1.0).abs() < 0.01, "{} {}", area(&p), area(&cut));
    for i in (0..p.patches.len()).filter(|&i| p.patches.materials()[i] == 1) {
        let rho = p.patches.reflectance(&p.geometry.scene, i).x;
        assert!(rho == 0.7 || (rho - 0.7).abs() < 1e-6 || rho == 0.0, "{rho}");
    }
}

#[test]
fn a_mask_is_as_good_as_geometry_cut_out() {
    for mode in [Mode::Global, Mode::OneBounce, Mode::Shadowless] {
        let means = [shaded(1.0, Some(half())), shaded(0.0, None)].map(|scene| {
            let rays = Rays::new(&scene);
            let transports = scene.transports(mode.transport());
            let mut tracer = Tracer::new(&scene, &rays, &transports, (16, 16), &TraceSettings::default());
            tracer.pass(512);
            let found = halflight::Solver::new(&scene).render(mode, (16, 16)).tolerance(0.01).expect("a picture");
            let pixels = found.picture.pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / 256.0;
            (tracer.mean(), pixels, found.error.total)
        });
        let [(traced, shown, stated), (other, cut, its)] = means;
        let error = traced.error[0].hypot(other.error[0]);
        assert!((traced.value[0] - other.value[0]).abs() < 4.0 * error, "{mode}: {traced:?} {other:?}");
        assert!((shown / cut - 1.0).abs() < stated + its, "{mode}: {shown} {cut} {stated} {its} {traced:?} {other:?}");
        let allowed = (4.0 * traced.error[0]).hypot(stated * shown);
        assert!((shown - traced.value[0]).abs() < allowed, "{mode}: {shown} {traced:?}");
    }
}

/// A wall that emits 1 behind black cards of one share each before a camera, or the sky in place of the wall.
fn cards(share: f32, count: usize, wall: bool) -> Scene {
    let p = DVec3::new;
    let mut mesh = Mesh::default();
    let mut across = |z: f64, material: u32| {
        mesh.polygon(&[p(-9., -9., z), p(9., -9., z), p(9., 9., z), p(-9., 9., z)], material);
    };
    (1..=count).for_each(|k| across(1.0 / k as f64, 0));
    if wall {
        across(0.0, 1);
    }
    let uniform = Mask { texture: None, factor: share, cutoff: None, over: Vec::new() };
    let maps = Some(Arc::new(Maps { mask: Some(uniform), ..Maps::default() }));
    let card = Material { maps, ..grey("card", 0.0) };
    let mut scene = mesh.scene(vec![card, Material { emission: Rgb::ONE, ..grey("wall", 0.0) }]);
    if !wall {
        scene.set_sky(SkyLight { upper: Rgb::ONE, lower: Rgb::ONE }, DVec3::Y);
    }
    let [from, to] = [2.0, 1.0].map(|z| scene.frame.to_unit(DVec3::new(0.0, 0.0, z)));
    scene.camera = Camera::look_at(from, to, DVec3::Y, 60.0).expect("a view");
    scene
}

/// A pane of share 0.5 before the camera took 20 to 40 s in place of 0.2, as pixels met it or not by chance; of the sky
/// through a pane of share 0.1 pixels showed 0.904.
#[test]
fn pixels_see_through_uniform_masks_by_weight() {
    for (share, count, wall) in [(0.5, 1, true), (0.5, 3, true), (0.1, 1, false), (0.02, 2, false)] {
        let found = rendered(&cards(share, count, wall), Mode::Global.transport(), (16, 16).into(), 0.05, 0);
        let expected = (1.0 - share).powi(count as i32);
        for pixel in found.picture.pixels {
            assert!((pixel - expected).abs().max_element() < 1e-6, "{share} {count}: {pixel}");
        }
    }
}

/// Behind so many panes that next to nothing is left of a ray it goes on by chance: the mean stays, in few points.
#[test]
fn what_is_little_of_a_ray_is_met_by_chance() {
    const CARDS: usize = 40;
    let (share, scene) = (0.2_f64, cards(0.2, CARDS, true));
    let rays = Rays::new(&scene);
    let card = |face: u32| scene.faces[face as usize].material == 0;
    let from = scene.frame.to_unit(DVec3::new(0.0, 0.0, 2.0)).as_vec3();
    let mut random = Stream::new(5);
    let (mut sum, mut most) = (0.0, 0);
    const DRAWS: u32 = 20_000;
    for _ in 0..DRAWS {
        let aside = Vec3::new(random.uniform() - 0.5, random.uniform() - 0.5, 0.0) * 0.1;
        let ray = Ray { origin: from, direction: (Vec3::NEG_Z + aside).normalize(), source: None };
        let seen = rays.seen(&ray, || [ray; 4]);
        let all: f32 = seen.iter().map(|(_, share)| share).sum();
        assert!((all - 1.0).abs() < 1e-5, "{all}");
        sum += seen.iter().filter(|(hit, _)| !card(hit.face)).map(|(_, share)| f64::from(*share)).sum::<f64>();
        most = most.max(seen.len());
    }
    // 0.8^n falls below 1/64 at n = 19; one more is met by chance.
    assert_eq!(most, 20);
    let (mean, expected) = (sum / f64::from(DRAWS), (1.0 - share).powi(CARDS as i32));
    // Each draw is 0 or at most 1/64, so its variance is at most the mean over 64.
    assert!((mean - expected).abs() < 4.0 * (expected / 64.0 / f64::from(DRAWS)).sqrt(), "{mean} {expected}");
}
