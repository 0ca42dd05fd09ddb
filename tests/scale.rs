//! The Cornell box a million times smaller, a million times larger, and far from the origin: the same picture.

use glam::DVec3;
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::Mode;
use halflight::pictures::{Picture, relative_rms};
use halflight::scene::{LoadOptions, Scene, builtin};
use halflight::solve::{Settings, neumann};

use crate::common::{Silent, assemble_one, sampling};

/// The Cornell box with every point p at `scale * (p + shift)`.
fn cornell(scale: f64, shift: DVec3) -> Scene {
    let files = builtin::find("cornell-box").expect("a built-in name");
    let place = |p: DVec3| scale * (p + shift);
    let line = |line: &str| match line.strip_prefix("v ") {
        None => line.to_owned(),
        Some(numbers) => {
            let xyz: Vec<f64> = numbers.split_whitespace().map(|w| w.parse().unwrap()).collect();
            let p = place(DVec3::from_slice(&xyz));
            format!("v {:.17e} {:.17e} {:.17e}", p.x, p.y, p.z)
        }
    };
    let obj: Vec<String> = files.obj.lines().map(line).collect();
    let (eye, target) = (place(DVec3::new(278.0, 273.0, -800.0)), place(DVec3::new(278.0, 273.0, -799.0)));
    let array = |p: DVec3| format!("[{:.17e}, {:.17e}, {:.17e}]", p.x, p.y, p.z);
    let toml = format!(
        "obj = \"cornell-box.obj\"\n[camera]\nposition = {}\ntarget = {}\nvertical_fov = 39.30764811610662\n",
        array(eye),
        array(target)
    );
    Scene::from_toml_text("cornell-box", &toml, &obj.join("\n"), files.mtl, LoadOptions::default())
        .expect("a correct scene")
}

/// The global picture and the power of the light, W.
fn solve(scene: Scene, seed: u32) -> (Picture, f64) {
    let p = Solver::new(&scene).cut(800);
    let mode = assemble_one(&p, Mode::Global.transport(), &sampling(256, seed));
    let solution = neumann(&mode.operator, &Settings::default()).expect("converges");
    let gathering = GatherSampling::with_samples(32, seed);
    let gathered = mode.picture(&solution, &GatherPass::new((64, 64), &gathering), &Silent);
    let power = solution.bounces.iter().map(|b| b.power[0]).sum();
    (gathered.total(), power)
}

#[test]
fn neither_size_nor_place_changes_the_picture() {
    let (picture, power) = solve(cornell(1.0, DVec3::ZERO), 0);
    // Two seeds differ by sqrt 2 standard errors; the same seed in another frame by rounding, and where that sends a
    // ray past an edge, by the noise of those rays.
    let (other, other_power) = solve(cornell(1.0, DVec3::ZERO), 1);
    let noise = relative_rms(&other, &picture, None, None).unwrap();
    let power_noise = (other_power / power - 1.0).abs().max(1e-4);
    assert!(noise > 0.0 && noise < 0.1, "{noise}");
    let far = 1e5 * 556.0 * DVec3::new(1.0, -0.7, 0.3);
    for (scale, shift) in [(1e-6, DVec3::ZERO), (1e6, DVec3::ZERO), (1.0, far), (1e6, far)] {
        let (found, watts) = solve(cornell(scale, shift), 0);
        let apart = relative_rms(&found, &picture, None, None).unwrap();
        assert!(apart <= noise, "scale {scale}, shift {shift}: {apart}, noise {noise}");
        let ratio = watts / power / (scale * scale);
        assert!((ratio - 1.0).abs() <= power_noise, "scale {scale}, shift {shift}: {ratio}");
    }
}

#[test]
fn power_leaves_the_lamp_as_area_times_radiance() {
    for scale in [1e-6, 1.0, 1e6] {
        let p = Solver::new(&cornell(scale, DVec3::ZERO)).cut(200);
        let mode = assemble_one(&p, Mode::OneBounce.transport(), &sampling(64, 0));
        let solution = neumann(&mode.operator, &Settings::default()).expect("ends");
        let exact = std::f64::consts::PI * 17.0 * 130.0 * 105.0 * scale * scale;
        let found = solution.bounces[0].power[0];
        // Corners are rounded to f32 in unit coordinates, where the lamp is half a unit long.
        assert!((found / exact - 1.0).abs() < 1e-5, "{found} {exact}");
    }
}
