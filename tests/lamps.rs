//! Many luminaires: what light cuts find against the sum over all of them, on patches and in pictures, in one thread
//! and in two.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use halflight::Solver;
use halflight::direct::{Lights, Scratch};
use halflight::form_factors::Sampling;
use halflight::gather::{GatherSampling, Gathering, Told, gather};
use halflight::light::{Mode, Rgb};
use halflight::pictures::{Picture, Size};
use halflight::rays::Rays;
use halflight::rays::sobol::{Sobol, Stream};
use halflight::reading::{Fields, View};
use halflight::render::Discretization;
use halflight::scene::{Camera, Material, Scene, Sides};
use halflight_reference::{TraceSettings, Tracer};

use crate::common::{Facing, Mesh, grey, light_by_area, lights, rendered};

/// Whether lamps are one object, or each its own.
#[derive(Clone, Copy)]
enum Lamps {
    Together,
    Apart,
}

/// A room of 4 by 4 by 2.4 with a box, and `side`² lamps below its ceiling.
fn room(side: u32, lamps: Lamps) -> Discretization {
    Solver::new(&scene(side, lamps)).cut(200)
}

fn scene(side: u32, lamps: Lamps) -> Scene {
    let white = Material::new("white", Rgb::splat(0.7), Rgb::ZERO);
    let glow = Material::new("glow", Rgb::splat(0.5), Rgb::new(10.0, 9.0, 7.0));
    let (mut corners, mut faces) = (Vec::new(), Vec::new());
    let mut quad = |points: [[f64; 3]; 4], material: u32| {
        let first = corners.len() as u32;
        corners.extend(points.map(DVec3::from));
        faces.push(((first..first + 4).collect::<Vec<u32>>(), material));
    };
    let (x, z) = (4.0, 2.4);
    quad([[0.0, 0.0, 0.0], [x, 0.0, 0.0], [x, x, 0.0], [0.0, x, 0.0]], 0);
    quad([[0.0, 0.0, z], [0.0, x, z], [x, x, z], [x, 0.0, z]], 0);
    quad([[0.0, 0.0, 0.0], [0.0, x, 0.0], [0.0, x, z], [0.0, 0.0, z]], 0);
    quad([[x, 0.0, 0.0], [x, 0.0, z], [x, x, z], [x, x, 0.0]], 0);
    let (a, b, h) = (1.2, 2.1, 1.1);
    quad([[a, a, h], [b, a, h], [b, b, h], [a, b, h]], 0);
    quad([[a, a, 0.0], [b, a, 0.0], [b, a, h], [a, a, h]], 0);
    quad([[a, b, 0.0], [a, b, h], [b, b, h], [b, b, 0.0]], 0);
    for k in 0..side * side {
        let at = |i: u32| (f64::from(i) + 0.4) / f64::from(side) * x;
        let (u, v, s, z) = (at(k % side), at(k / side), 0.4 / f64::from(side), z - 0.02);
        quad([[u, v, z], [u, v + s, z], [u + s, v + s, z], [u + s, v, z]], 1);
    }
    let scene = Scene::from_faces("lamps", &corners, &faces, vec![white, glow]);
    let mut scene = scene.expect("a correct scene");
    if let Lamps::Apart = lamps {
        for (f, face) in scene.faces.iter_mut().enumerate() {
            face.object = f as u32 / 2;
        }
    }
    scene
}

/// What patches of the first material receive.
fn receive(p: &Discretization, mode: Mode, rays: u32, seed: u32) -> Vec<Rgb> {
    let receives: Vec<bool> = p.patches.materials().iter().map(|&m| m == 0).collect();
    let sampling = Sampling { rays: 1, emitter_rays: rays, seed };
    lights(p, mode.transport()).receive_emitted(&receives, &sampling, &|_| ()).0
}

/// The same by so many points of each patch, each with a point on each lamp.
fn receive_by_area(p: &Discretization, mode: Mode, points: u32, seed: u32) -> Vec<Rgb> {
    let lights = by_rays(p, mode);
    let one = |i: usize| {
        if p.patches.materials()[i] != 0 {
            return Rgb::ZERO;
        }
        let (mut random, mut hits) = (Stream::new(seed ^ (i as u32) << 8), Vec::new());
        let mut at = |_| {
            let receiver = p.patches.point(i, random.uniform(), random.uniform());
            light_by_area(&lights, &receiver, &mut random, &mut hits)
        };
        ((0..points).map(&mut at).sum::<DVec3>() / f64::from(points)).as_vec3()
    };
    (0..p.patches.len()).map(one).collect()
}

/// Lights that know of no occluder.
fn by_rays(p: &Discretization, mode: Mode) -> Lights {
    Lights::by_rays(&p.geometry, &p.patches, &p.luminaires, p.transports(mode.transport()))
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

fn apart(a: &[Rgb], b: &[Rgb]) -> f64 {
    let off = a.iter().zip(b).map(|(a, b)| f64::from((*a - *b).length()));
    rms(off) / rms(b.iter().map(|b| f64::from(b.length())))
}

#[test]
fn a_thousand_lamps_are_the_sum_of_each() {
    for lamps in [Lamps::Together, Lamps::Apart] {
        let p = room(32, lamps);
        compare_with_each(&p);
    }
}

fn compare_with_each(p: &Discretization) {
    // Nothing hides anything: the closed form of each lamp, at 16 points a patch. The spread over seeds of what is
    // found is its standard error.
    let found: Vec<Vec<Rgb>> = (0..2).map(|seed| receive(p, Mode::Local, 16, seed)).collect();
    let noise = apart(&found[0], &found[1]);
    let sobol = Sobol::new(16, 2);
    let exact = |i: usize| {
        let form = |k: u32| {
            let receiver = p.patches.point(i, sobol.point(k, 0, 7), sobol.point(k, 1, 7));
            let (x, n) = (receiver.position, receiver.normal);
            p.luminaires.list.iter().map(|l| l.radiance * l.exact_form(x, n) as f32).sum::<Rgb>()
        };
        if p.patches.materials()[i] == 0 { (0..16).map(form).sum::<Rgb>() / 16.0 } else { Rgb::ZERO }
    };
    let exact: Vec<Rgb> = (0..p.patches.len()).map(exact).collect();
    // What nodes of radius 0.2 of their distance leave in third order is below 0.2 %.
    assert!(apart(&found[0], &exact) < 2.0 * noise + 2e-3, "{} {noise}", apart(&found[0], &exact));
}

#[test]
fn drawing_is_free_of_bias() {
    let p = room(8, Lamps::Apart);
    let count = 8;
    let areas = p.patches.areas();
    let power = |l: Vec<Rgb>| -> f64 { l.iter().zip(areas).map(|(l, a)| f64::from(l.x) * a).sum() };
    let found: Vec<f64> = (0..count).map(|s| power(receive(&p, Mode::OneBounce, 64, s))).collect();
    let general: Vec<f64> = (0..count).map(|s| power(receive_by_area(&p, Mode::OneBounce, 64, s))).collect();
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let spread = |v: &[f64]| rms(v.iter().map(|x| x - mean(v))) / f64::from(count - 1).sqrt();
    let error = spread(&found).hypot(spread(&general));
    let off = mean(&found) - mean(&general);
    // Four standard errors, and what moments leave.
    assert!(off.abs() < 4.0 * error + 2e-3 * mean(&general), "{off} {error} {}", mean(&general));
}

/// Of nine lamps a sample asks few, drawn by about what each sends: their mean is the sum of all.
#[test]
fn a_few_lamps_asked_by_chance_have_the_mean_of_all() {
    let p = Solver::new(&scene(3, Lamps::Apart)).cut(200);
    assert_eq!(p.luminaires.list.len(), 9);
    let lights = lights(&p, Mode::Local.transport());
    let (mut scratch, mut random) = (Scratch::default(), Stream::new(7));
    let walls = (0..p.patches.len()).filter(|&i| p.patches.materials()[i] == 0);
    for patch in walls.step_by(11) {
        let receiver = p.patches.point(patch, 0.4, 0.6);
        let (x, n) = (receiver.position, receiver.normal);
        let exact: f64 = p.luminaires.list.iter().map(|l| f64::from(l.radiance.x) * l.exact_form(x, n)).sum();
        let mut sample = || lights.sample(&receiver, patch as u32, &mut random, &mut scratch).x;
        let asked: Vec<f64> = (0..4096).map(|_| sample()).collect();
        let (mean, error) = crate::common::mean_and_error(&asked);
        assert!((mean - exact).abs() <= 5.0 * error + 1e-9 * exact, "{patch}: {mean} {exact} {error}");
        // Lamps are drawn by about what they send, so that a sample is seldom far from the sum.
        assert!(error * 64.0 <= exact, "{patch}: {error} {exact}");
    }
}

/// The room looked down into: no lamp is in the picture.
fn looked_into(side: u32) -> Scene {
    let mut scene = scene(side, Lamps::Apart);
    let [from, to] = [[2.0, 0.3, 1.4], [1.8, 2.2, 0.3]].map(|p| scene.frame.to_unit(p.into()));
    scene.camera = Camera::look_at(from, to, DVec3::Z, 50.0).expect("a view");
    scene
}

/// Direct light with every lamp asked at every camera ray.
fn each_asked(p: &Discretization, mode: Mode, size: Size, camera: u32, seed: u32) -> Picture {
    let lights = by_rays(p, mode);
    let view = View::new(&lights, size);
    let dark = Fields::new(&[vec![Rgb::ZERO; p.patches.len()]]);
    let sampling = GatherSampling { camera, luminaire: 1, hemisphere: 1, seed };
    gather(&view, &dark, &Gathering::Uniform(sampling), &Told::NOBODY).direct
}

#[test]
fn a_picture_of_a_thousand_lamps_is_as_near_as_it_says() {
    let (size, tolerance) = (Size { width: 32, height: 32 }, 0.02);
    for (mode, camera) in [(Mode::Local, 8), (Mode::OneBounce, 16)] {
        let scene = looked_into(32);
        let p = Solver::new(&scene).cut(1);
        assert_eq!(p.luminaires.list.len(), 1024);
        let found = rendered(&scene, mode.transport(), size, tolerance, 5);
        // The product of the differences to two references is free of their noise.
        let [a, b] = [1, 2].map(|seed| each_asked(&p, mode, size, camera, seed));
        let pixels = || (0..a.pixels.len()).map(|k| (found.picture.pixels[k], a.pixels[k], b.pixels[k]));
        let error: f64 = pixels().map(|(p, a, b)| f64::from((p - a).dot(p - b))).sum();
        let signal: f64 = pixels().map(|(_, a, b)| f64::from(a.dot(b))).sum();
        let reached = (error / signal).max(0.0).sqrt();
        println!("{mode}: stated {}, reached {reached}", found.error.total);
        assert!(reached <= 1.1 * tolerance, "{mode}: {reached}");
        let ratio = found.error.total / reached;
        assert!((0.5..=2.0).contains(&ratio), "{mode}: {ratio}");
    }
}

/// The floor under a ball of many faces gets `pi L (r/d)² cos` on every square metre, and the ball hides none of
/// itself.
#[test]
fn a_ball_of_many_faces_is_a_ball() {
    let center = DVec3::new(0.1, -0.2, 1.0);
    for levels in [2, 3, 4] {
        let mut mesh = Mesh::default();
        let floor = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        mesh.polygon(&floor.map(|(x, y)| 2.0 * DVec3::new(x, y, 0.0) - center), 0);
        mesh.sphere(0.2, levels, Facing::Out, 1);
        let mut glow = grey("glow", 0.0);
        glow.emission = Rgb::ONE;
        let p = Solver::new(&mesh.scene(vec![grey("floor", 0.5), glow])).cut(200);
        // A convex body is as large as its surface over 4 from everywhere on average (Cauchy).
        let face = |f: &u32| p.geometry.scene.faces[*f as usize].material == 1;
        let faces = (0..p.geometry.scene.faces.len() as u32).filter(face);
        let area: f64 = faces.map(|f| p.geometry.scene.area(f)).sum();
        let square = area / (4.0 * PI);
        let middle = p.geometry.scene.frame.to_unit(DVec3::ZERO);
        let found = receive(&p, Mode::OneBounce, 32, 0);
        let sobol = Sobol::new(64, 2);
        let (mut sum, mut exact) = (0.0, 0.0);
        for i in (0..p.patches.len()).filter(|&i| p.patches.materials()[i] == 0) {
            let form = |k: u32| {
                let at = |d: usize| sobol.point(k, d, i as u32);
                let q = p.patches.point(i, at(0), at(1));
                let d = middle - q.position.as_dvec3();
                square * d.dot(q.normal.as_dvec3()) / d.length().powi(3)
            };
            let own = p.patches.areas()[i];
            sum += own * f64::from(found[i].x);
            exact += own * (0..64).map(form).sum::<f64>() / 64.0;
        }
        let off = sum / exact - 1.0;
        assert!(off.abs() < 2e-3, "{levels}: {off}");
    }
}

/// Twenty-four candles: their tops are four patches, and each place on them is lit by the flame above it. As every
/// flame had one chance for a patch, one draw in tens made most of the light: 0.81 of it was chance, where 0.04 is.
#[test]
fn what_many_lamps_light_from_close_by_is_no_matter_of_luck() {
    const RUNS: u32 = 16;
    let mut mesh = Mesh::default();
    let corners = [(-0.5, -0.5), (2.5, -0.5), (2.5, 2.0), (-0.5, 2.0)];
    mesh.polygon(&corners.map(|(x, y)| DVec3::new(x, y, -0.1)), 1);
    for k in 0..24 {
        let top = DVec3::new(0.4 * f64::from(k % 6), 0.4 * f64::from(k / 6), 0.0);
        let corner = |j: usize| {
            let (sin, cos) = (j as f64 * PI / 5.0).sin_cos();
            top + 0.03 * DVec3::new(cos, sin, 0.0)
        };
        mesh.polygon(&std::array::from_fn::<DVec3, 10, _>(corner), 0);
        mesh.cuboid(top + 0.04 * DVec3::Z, DVec3::splat(0.01), DQuat::IDENTITY, Facing::Out, 2);
    }
    let glow = Material { emission: Rgb::ONE, ..grey("glow", 0.0) };
    let p = Solver::new(&mesh.scene(vec![grey("wax", 0.8), grey("board", 0.5), glow])).cut(8);
    let tops: Vec<usize> = (0..p.patches.len()).filter(|&i| p.patches.materials()[i] == 0).collect();
    assert_eq!((tops.len(), p.luminaires.list.len()), (4, 24));
    let power = |found: Vec<Rgb>| -> f64 { tops.iter().map(|&i| p.patches.areas()[i] * f64::from(found[i].x)).sum() };
    let mean = |v: &[f64]| v.iter().sum::<f64>() / f64::from(RUNS);
    let found: Vec<f64> = (0..RUNS).map(|seed| power(receive(&p, Mode::OneBounce, 64, seed))).collect();
    let general: Vec<f64> = (0..RUNS).map(|s| power(receive_by_area(&p, Mode::OneBounce, 1024, s))).collect();
    let spread = |v: &[f64]| rms(v.iter().map(|x| x / mean(v) - 1.0));
    // A lamp close by has a third of the chance by its light at least, so that a draw is at most 6 times the mean and
    // its variance 6 times the square of that; there are 64 on each of four patches.
    assert!(spread(&found) < (6.0_f64 / 256.0).sqrt(), "{}", spread(&found));
    let error = spread(&found).hypot(spread(&general)) / f64::from(RUNS).sqrt();
    let off = mean(&found) / mean(&general) - 1.0;
    // Four standard errors, and what moments leave.
    assert!(off.abs() < 4.0 * error + 2e-3, "{off} {error}");
}

/// A lamp that emits to both sides 5 cm below a ceiling: the bright gap between is a hundredth of all surfaces, and
/// what it lights is smooth. Patches of one size that were small enough for it were 139,000.
#[test]
fn patches_are_divided_where_a_lamp_lights_a_ceiling_from_close_by() {
    const SIZE: (usize, usize) = (48, 48);
    let mut mesh = Mesh::default();
    mesh.cuboid(DVec3::new(2.5, 1.3, 2.0), DVec3::new(2.5, 1.3, 2.0), DQuat::IDENTITY, Facing::In, 0);
    let at = |x: f64, z: f64| DVec3::new(x, 2.55, z);
    mesh.polygon(&[at(2.4, 1.6), at(3.0, 1.6), at(3.0, 2.2), at(2.4, 2.2)], 1);
    let lamp = Material { emission: Rgb::splat(11.0), sides: Sides::Two, ..grey("lamp", 0.8) };
    let mut scene = mesh.scene(vec![grey("walls", 0.8), lamp]);
    let [eye, target] = [DVec3::new(0.4, 1.5, 3.8), DVec3::new(2.7, 1.3, 1.9)].map(|p| scene.frame.to_unit(p));
    scene.camera = Camera::look_at(eye, target, DVec3::Y, 70.0).expect("a view");
    let rays = Rays::new(&scene);
    let transports = scene.transports(Mode::Global.transport());
    let mut tracer = Tracer::new(&scene, &rays, &transports, SIZE, &TraceSettings::default());
    tracer.pass(512);
    let traced = tracer.mean();
    for seed in 0..2 {
        let found = rendered(&scene, Mode::Global.transport(), SIZE.into(), 0.02, seed);
        assert!(found.patches < 30_000, "{}", found.patches);
        let mean = found.picture.pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / found.picture.pixels.len() as f64;
        let allowed = (4.0 * traced.error[0]).hypot(found.error.total * traced.value[0]);
        assert!((mean - traced.value[0]).abs() < allowed, "{seed}: {mean} {traced:?} {:?}", found.error);
    }
}

#[test]
fn threads_change_no_bit() {
    let p = room(8, Lamps::Apart);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a pool").install(|| receive(&p, Mode::OneBounce, 16, 0))
    };
    assert_eq!(with(1), with(2));
}
