//! The furnace: where everything emits E and reflects rho, L = E/(1 - rho) and term n = rho^n E, whatever the geometry.
//!
//! Rows of F sum to 1 exactly, so nothing but rounding may separate the solver from the closed form.

use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling, Gathering, Limit};
use halflight::light::{Light, Mode, Rgb, Visibility};
use halflight::operator::LinearOperator as _;
use halflight::render::Discretization;
use halflight::scene::Scene;
use halflight::solve::{Settings, Verdict, neumann};

use crate::common::{Silent, assemble_one, builtin, sampling};

const RHO: Rgb = Rgb::new(0.8, 0.5, 0.1);
const E: Rgb = Rgb::new(0.5, 1.0, 3.0);

/// One material and one object, so that no part is small enough to be a luminaire with a closed form of its own.
fn furnace(name: &str) -> Scene {
    let mut scene = builtin(name);
    for face in &mut scene.faces {
        (face.material, face.object) = (0, 0);
    }
    scene.materials[0].rho = RHO;
    scene.materials[0].emission = E;
    scene
}

fn scenes() -> Vec<Discretization> {
    ["furnace", "concentric-spheres"].map(|name| Solver::new(&furnace(name)).cut(600)).into()
}

/// `1e-5` relative: dozens of terms, each within a few roundings of f32 of 6e-8. Below the normal numbers f32 has
/// fewer digits.
fn assert_near(found: Rgb, exact: Rgb, what: &str) {
    let allowed = (1e-5 * exact).max(Rgb::splat(f32::MIN_POSITIVE));
    let near = (found - exact).abs().cmple(allowed).all();
    assert!(near, "{what}: {found} is not {exact}");
}

#[test]
fn every_term_is_a_power_of_rho_in_every_patch() {
    for p in scenes() {
        let k = assemble_one(&p, Mode::Global.transport(), &sampling(512, 3)).operator;
        let settings = Settings { tolerance: 1e-6, ..Settings::default() };
        let solution = neumann(&k, &settings).expect("rho < 1 converges");
        assert_eq!(solution.verdict, Verdict::Converges);
        assert!(solution.terms.len() > 20);
        for (n, term) in solution.terms.iter().enumerate() {
            for l in term {
                let exact = RHO.powf(n as f32) * E;
                assert_near(l.invisible, exact, &format!("term {n}, invisible"));
                assert_near(l.visible, exact, &format!("term {n}, visible"));
            }
        }
    }
}

#[test]
fn light_is_emission_over_one_less_rho() {
    for p in scenes() {
        let k = assemble_one(&p, Mode::Global.transport(), &sampling(512, 0)).operator;
        let settings = Settings { tolerance: 1e-7, ..Settings::default() };
        let solution = neumann(&k, &settings).expect("rho < 1 converges");
        for l in &solution.light {
            assert_near(l.invisible, E / (Rgb::ONE - RHO), "invisible");
            assert_near(l.visible, E / (Rgb::ONE - RHO), "visible");
        }
    }
}

#[test]
fn the_picture_is_as_even_as_the_light() {
    for p in scenes() {
        let mode = assemble_one(&p, Mode::Global.transport(), &sampling(256, 0));
        let settings = Settings { tolerance: 1e-7, ..Settings::default() };
        let solution = neumann(&mode.operator, &settings).expect("rho < 1 converges");
        let gathering = GatherSampling::with_samples(16, 0);
        let gathered = mode.picture(&solution, &GatherPass::new((24, 16), &gathering), &Silent);
        assert_eq!(gathered.backs, 0.0);
        for pixel in gathered.total().pixels {
            assert_near(pixel, E / (Rgb::ONE - RHO), "pixel");
        }
    }
}

#[test]
fn hidden_emission_leaves_reflected_light_only() {
    let mut scene = furnace("furnace");
    scene.materials[0].visibility = Visibility::Hidden;
    let p = Solver::new(&scene).cut(100);
    let k = assemble_one(&p, Mode::Global.transport(), &sampling(64, 0)).operator;
    assert!(k.emission().iter().all(|e| *e == Light::emitted(E, Visibility::Hidden)));
    let settings = Settings { tolerance: 1e-7, ..Settings::default() };
    let solution = neumann(&k, &settings).expect("rho < 1 converges");
    for l in &solution.light {
        assert_near(l.invisible, E / (Rgb::ONE - RHO), "invisible");
        assert_near(l.visible, E * RHO / (Rgb::ONE - RHO), "visible");
    }
}

/// Where every pixel shows a luminaire the error was one over no pixel, 0 of 0, and rounds of sampling went on to the
/// last: 146 rays a pixel instead of 17.
#[test]
fn a_picture_of_nothing_but_luminaires_has_an_error_and_takes_one_round() {
    const SIDE: usize = 128;
    let p = Solver::new(&builtin("furnace")).cut(600);
    let mode = assemble_one(&p, Mode::Global.transport(), &sampling(256, 0));
    let solution = neumann(&mode.operator, &Settings::default()).expect("rho < 1 converges");
    let within = Gathering::Within { error: 0.01, camera: 0.25, seed: 0, limit: Limit::NONE };
    let gathered = mode.picture(&solution, &GatherPass::new((SIDE, SIDE), within), &Silent);
    // Light is the same everywhere up to rounding.
    assert!(gathered.error.signal > 0.0 && gathered.error.relative() < 1e-5, "{:?}", gathered.error);
    // Four camera rays a pixel, and two halves of 128 rays of a record for every 4 x 4; twice as many near edges.
    let most = 2.0 * (4.0 + 2.0 * 128.0 / 16.0);
    let each = gathered.rays as f64 / (SIDE * SIDE) as f64;
    assert!(each < most, "{each} rays a pixel");
}
