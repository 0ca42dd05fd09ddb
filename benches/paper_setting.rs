//! How many samples a pixel the paper's path tracer needs: local mode, no next-event estimation, against the closed
//! form.
//!
//! Banks and Beason (2006) used 80,000 samples a pixel and report a mean e_pixel of 0.4 % against OpenGL. Here the
//! reference is Lambert's closed form, gathered with 1024 camera rays a pixel, so that all of e_pixel is the tracer's
//! noise (and falls as N^-1/2). Printed for two scenes: e_pixel for growing N, the slope, the N at which the fitted
//! line meets 0.4 %, and e_pixel measured at that N. Run it with `cargo bench --bench paper_setting`; it takes no
//! options and measures no time.
//!
//! Source: D. C. Banks, K. M. Beason, *Retro-rendering with vector-valued light*, SPIE 6060, 2006.

use std::f64::consts::PI;
use std::fmt::Write as _;

use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::Mode;
use halflight::pictures::{Picture, Size, mean_e_pixel};
use halflight::rays::Rays;
use halflight::render::Silent;
use halflight::scene::Scene;
use halflight::solve::{Settings, neumann};
use halflight_reference::{NextEvent, TraceSettings, Tracer};

const SIZE: Size = Size { width: 64, height: 48 };
const WANTED: f64 = 0.004;
/// Samples a pixel at which e_pixel is measured.
const COUNTS: [u32; 5] = [64, 256, 1024, 2048, 4096];

fn main() {
    let cornell = Scene::open("cornell-box").expect("a correct scene");
    for (name, scene) in [("floor, two spheres, light 18 x 18", spheres()), ("cornell-box", cornell)] {
        study(name, &scene);
    }
}

/// Prints one scene's table.
fn study(name: &str, scene: &Scene) {
    let exact = closed_form(scene);
    println!("{name}, local mode, {} x {} pixels", SIZE.width, SIZE.height);
    println!("{:>16}  mean e_pixel", "samples a pixel");
    let points = traced(scene, NextEvent::Off, &COUNTS, &exact);
    for (n, error) in &points {
        println!("{n:>16}  {:.3} %", 100.0 * error);
    }
    let (slope, needed) = fit(&points);
    println!("slope {slope:.3}; 0.4 % at some {needed:.0} samples a pixel");
    let rounded = needed.round().clamp(2.0, 200_000.0) as u32;
    let (_, error) = traced(scene, NextEvent::Off, &[rounded], &exact)[0];
    println!("{rounded:>16}  {:.3} % (measured)", 100.0 * error);
    let (_, error) = traced(scene, NextEvent::On, &[1024], &exact)[0];
    println!("{:>16}  {:.3} % with next-event estimation\n", 1024, 100.0 * error);
}

/// The picture by Lambert's closed form, many camera rays a pixel.
fn closed_form(scene: &Scene) -> Picture {
    let p = Solver::new(&scene.clone()).cut(500);
    let (modes, _) = p.assemble(&[Mode::Local.transport()], &Sampling::default(), &Silent);
    let solution = neumann(&modes[0].operator, &Settings::default()).expect("it ends");
    let sampling = GatherSampling { camera: 1024, luminaire: 1, hemisphere: 1, seed: 0 };
    modes[0].picture(&solution, &GatherPass::new(SIZE, &sampling), &Silent).total()
}

/// e_pixel after each of the ascending numbers of samples.
fn traced(scene: &Scene, next_event: NextEvent, counts: &[u32], exact: &Picture) -> Vec<(f64, f64)> {
    let rays = Rays::new(scene);
    let transports = scene.transports(Mode::Local.transport());
    let settings = TraceSettings { next_event, ..TraceSettings::default() };
    let mut tracer = Tracer::new(scene, &rays, &transports, SIZE, &settings);
    let measure = |&count: &u32| {
        tracer.pass(count - tracer.samples() as u32);
        let error = mean_e_pixel(&tracer.picture(), exact).expect("pictures of one size");
        (f64::from(count), error)
    };
    counts.iter().map(measure).collect()
}

/// Slope of log e_pixel over log N by least squares, and the N at which the line meets [`WANTED`].
fn fit(points: &[(f64, f64)]) -> (f64, f64) {
    let logs: Vec<(f64, f64)> = points.iter().map(|(n, e)| (n.ln(), e.ln())).collect();
    let count = logs.len() as f64;
    let (x, y) = (logs.iter().map(|p| p.0).sum::<f64>() / count, logs.iter().map(|p| p.1).sum::<f64>() / count);
    let spread: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
    let common: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let slope = common / spread;
    (slope, (x + (WANTED.ln() - y) / slope).exp())
}

/// A floor of ±60, balls of radius 4 at (-5, 0, 4) and (5, 2, 4), a light of 18 x 18 at height 20 that looks down.
fn spheres() -> Scene {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let mut obj = "mtllib s.mtl\n".to_string();
    let mut next = 1;
    quad(&mut obj, &mut next, "floor", [[-60., -60., 0.], [60., -60., 0.], [60., 60., 0.], [-60., 60., 0.]]);
    quad(&mut obj, &mut next, "light", [[-9., -9., 20.], [-9., 9., 20.], [9., 9., 20.], [9., -9., 20.]]);
    ball(&mut obj, &mut next, "warm", [-5.0, 0.0, 4.0]);
    ball(&mut obj, &mut next, "blue", [5.0, 2.0, 4.0]);
    // Five point lights of 0.67 in all match this radiance at attenuation 0.0025: sum of I = a2 L area / pi.
    let radiance = 0.67 * PI / (0.0025 * 18.0 * 18.0);
    let materials = format!(
        "newmtl floor\nKd 0.8 0.8 0.8\nnewmtl warm\nKd 1 0.92 0.85\nnewmtl blue\nKd 0.25 0.45 0.9\n\
         newmtl light\nKd 0 0 0\nKe {radiance} {radiance} {radiance}\n"
    );
    let view =
        "obj = \"s.obj\"\n[camera]\nposition = [0, -27, 24]\ntarget = [0, 0, 1.5]\nup = [0, 0, 1]\nvertical_fov = 38\n";
    for (file, text) in [("s.obj", obj.as_str()), ("s.mtl", &materials), ("s.toml", view)] {
        std::fs::write(directory.path().join(file), text).expect("a temporary file");
    }
    let path = directory.path().join("s.toml");
    let path = path.to_str().expect("a path of plain letters");
    Scene::open(path).expect("a correct scene")
}

fn quad(obj: &mut String, next: &mut usize, material: &str, corners: [[f64; 3]; 4]) {
    let _ = writeln!(obj, "g {material}\nusemtl {material}");
    for [x, y, z] in corners {
        let _ = writeln!(obj, "v {x} {y} {z}");
    }
    let [a, b, c, d] = [0, 1, 2, 3].map(|k| *next + k);
    let _ = writeln!(obj, "f {a} {b} {c} {d}");
    *next += 4;
}

/// A ball of radius 4, 128 x 64 facets.
fn ball(obj: &mut String, next: &mut usize, material: &str, centre: [f64; 3]) {
    const ROUND: usize = 128;
    const DOWN: usize = 64;
    let _ = writeln!(obj, "g {material}\nusemtl {material}");
    let point = |theta: f64, phi: f64| {
        let (s, c) = theta.sin_cos();
        let d = [s * phi.cos(), s * phi.sin(), c];
        [0, 1, 2].map(|k| centre[k] + 4.0 * d[k])
    };
    for j in 0..=DOWN {
        for i in 0..ROUND {
            let [x, y, z] = point(PI * j as f64 / DOWN as f64, 2.0 * PI * i as f64 / ROUND as f64);
            let _ = writeln!(obj, "v {x} {y} {z}");
        }
    }
    for j in 0..DOWN {
        for i in 0..ROUND {
            let at = |j: usize, i: usize| *next + j * ROUND + i % ROUND;
            let (a, b, c, d) = (at(j, i), at(j + 1, i), at(j + 1, i + 1), at(j, i + 1));
            // At the poles one side has no length.
            let _ = match j {
                0 => writeln!(obj, "f {a} {b} {c}"),
                j if j == DOWN - 1 => writeln!(obj, "f {a} {b} {d}"),
                _ => writeln!(obj, "f {a} {b} {c} {d}"),
            };
        }
    }
    *next += (DOWN + 1) * ROUND;
}
