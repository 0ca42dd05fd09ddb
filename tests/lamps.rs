//! Many luminaires: what links find against the sum over all of them, in one thread and in two.

use glam::DVec3;
use halflight::form_factors::{Luminaires, Occlusion, Sampling, Sight, receive_emitted};
use halflight::light::{Mode, Rgb};
use halflight::scene::{Material, Scene};
use halflight::study::{Prepared, prepare};

/// A room of 4 by 4 by 2.4 with a box, and `side`² lamps below its ceiling.
fn room(side: u32) -> Prepared {
    let white = Material::new("white", Rgb::splat(0.7), Rgb::ZERO);
    let glow = Material::new("glow", Rgb::splat(0.5), Rgb::new(10.0, 9.0, 7.0));
    let (mut corners, mut faces) = (Vec::new(), Vec::new());
    let mut quad = |points: [[f64; 3]; 4], material: u32| {
        let first = corners.len() as u32;
        corners.extend(points.map(DVec3::from));
        faces.push(((first..first + 4).collect::<Vec<u32>>(), material));
    };
    let (x, z) = (4.0, 2.4);
    quad(
        [[0.0, 0.0, 0.0], [x, 0.0, 0.0], [x, x, 0.0], [0.0, x, 0.0]],
        0,
    );
    quad([[0.0, 0.0, z], [0.0, x, z], [x, x, z], [x, 0.0, z]], 0);
    quad(
        [[0.0, 0.0, 0.0], [0.0, x, 0.0], [0.0, x, z], [0.0, 0.0, z]],
        0,
    );
    quad([[x, 0.0, 0.0], [x, 0.0, z], [x, x, z], [x, x, 0.0]], 0);
    let (a, b, h) = (1.2, 2.1, 1.1);
    quad([[a, a, h], [b, a, h], [b, b, h], [a, b, h]], 0);
    quad([[a, a, 0.0], [b, a, 0.0], [b, a, h], [a, a, h]], 0);
    quad([[a, b, 0.0], [a, b, h], [b, b, h], [b, b, 0.0]], 0);
    for k in 0..side * side {
        let at = |i: u32| (f64::from(i) + 0.4) / f64::from(side) * x;
        let (u, v, s, z) = (at(k % side), at(k / side), 0.4 / f64::from(side), z - 0.02);
        quad(
            [[u, v, z], [u, v + s, z], [u + s, v + s, z], [u + s, v, z]],
            1,
        );
    }
    let scene = Scene::from_faces("lamps", &corners, &faces, vec![white, glow]);
    prepare(scene.expect("a correct scene"), 200)
}

fn receive(p: &Prepared, mode: Mode, general: bool, rays: u32, seed: u32) -> Vec<Rgb> {
    let transports = p.scene.transports(mode.transport());
    let receives: Vec<bool> = p.patches.materials().iter().map(|&m| m == 0).collect();
    let path = (&p.rays, &p.patches);
    let lamps: &Luminaires = &p.luminaires;
    let sight = match general {
        true => Occlusion::new(&p.rays, &transports).into(),
        false => Sight::new(&p.scene, path, lamps, &transports, &receives),
    };
    let sampling = Sampling {
        rays: 1,
        emitter_rays: rays,
        seed,
    };
    receive_emitted(path, lamps, &sight, &receives, &sampling, &|_| ()).0
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
    let p = room(32);
    assert!(p.luminaires.list.len() > 16);
    // Both take 16 points a patch, not the same ones: the spread over seeds is the standard error.
    let exact: Vec<Vec<Rgb>> = (0..2)
        .map(|s| receive(&p, Mode::Local, true, 16, s))
        .collect();
    let found = receive(&p, Mode::Local, false, 16, 2);
    let noise = apart(&exact[0], &exact[1]);
    // What nodes of radius 0.2 of their distance leave in third order is below 0.2 %.
    assert!(apart(&found, &exact[0]) < 2.0 * noise + 2e-3, "{noise}");
}

#[test]
fn drawing_is_free_of_bias() {
    let p = room(8);
    let count = 8;
    let runs = |general: bool| -> Vec<f64> {
        let sum = |s: u32| receive(&p, Mode::OneBounce, general, 64, s);
        let areas = p.patches.areas();
        let power = |l: Vec<Rgb>| l.iter().zip(areas).map(|(l, a)| f64::from(l.x) * a).sum();
        (0..count).map(|s| power(sum(s))).collect()
    };
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (found, general) = (runs(false), runs(true));
    let spread = |v: &[f64]| rms(v.iter().map(|x| x - mean(v))) / f64::from(count - 1).sqrt();
    let error = spread(&found).hypot(spread(&general));
    let off = mean(&found) - mean(&general);
    // Four standard errors, and what moments leave.
    assert!(
        off.abs() < 4.0 * error + 2e-3 * mean(&general),
        "{off} {error} {}",
        mean(&general)
    );
}

#[test]
fn threads_change_no_bit() {
    let p = room(8);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a pool")
            .install(|| receive(&p, Mode::OneBounce, false, 16, 0))
    };
    assert_eq!(with(1), with(2));
}
