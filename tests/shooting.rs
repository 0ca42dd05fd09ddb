//! Progressive shooting against the Neumann series, the conservation of power and the frontier of convergence.

use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::light::{Light, Mode, Rgb, Transport};
use halflight::operator::{EmitterLight, LinearOperator as _};
use halflight::render::{Assembled, Discretization, Watch};
use halflight::scene::{LoadOptions, Scene};
use halflight::solve::{
    Emitted, Progress, RaySettings, Settings, Shooter, Shooting, ShootingSettings, Source, Verdict, explore, neumann,
    norm, solve_columns, verdict,
};

struct Quiet;

impl Watch for Quiet {
    fn begin(&self, _: &str, _: u64) {}
    fn tick(&self, _: u64) {}
}

fn scene(name: &str) -> Scene {
    Scene::builtin(name, LoadOptions::default()).expect("a built-in name").expect("a correct scene")
}

fn k(p: &Discretization, mode: Transport, seed: u32) -> Assembled {
    let sampling = Sampling { rays: 256, emitter_rays: 16, seed };
    let (mut modes, _) = p.assemble(&[mode], &sampling, &Quiet);
    modes.remove(0)
}

fn rays(emitted: Emitted, seed: u32) -> RaySettings {
    RaySettings { rays: 1 << 17, emitter_rays: 16, emitted, seed }
}

fn until(unshot: f64) -> ShootingSettings {
    ShootingSettings { unshot, ..ShootingSettings::default() }
}

fn finished<'a>(shooter: &'a dyn Shooter, unshot: f64) -> Shooting<'a> {
    let mut shooting = Shooting::new(shooter, until(unshot)).expect("a converging series");
    shooting.run(|_| ()).expect("a converging series");
    shooting
}

/// The Cornell box with glass-like blocks that pass half of the light and walls that pass on a part.
fn hybrid() -> Scene {
    let mut scene = scene("cornell-box");
    for (m, (alpha, tau)) in scene.materials.iter_mut().zip([(1.0, 0.25), (0.0, 1.0), (0.5, 0.0)]) {
        (m.alpha, m.tau) = (Some(alpha), Some(tau));
    }
    scene
}

/// Relative difference of two light fields in the area-weighted norm.
fn difference(areas: &[f64], a: &[Light], b: &[Light]) -> f64 {
    let apart: Vec<Light> = a
        .iter()
        .zip(b)
        .map(|(a, b)| Light { invisible: a.invisible - b.invisible, visible: a.visible - b.visible })
        .collect();
    norm(areas, &apart) / norm(areas, b)
}

/// Where every ray lands on a surface that reflects, what was emitted is absorbed or unshot.
#[test]
fn rays_conserve_power_in_closed_opaque_scenes() {
    let global = Mode::Global.transport();
    for name in ["furnace", "concentric-spheres"] {
        let p = Solver::new(&scene(name)).cut(300);
        let shooter = p.ray_shooter(global, rays(Emitted::Rays, 0));
        let shooting = finished(&shooter, 1e-3);
        let s = shooter.surfaces();
        let (mut emitted, mut absorbed) = (0.0, 0.0);
        for (i, l) in shooting.light().iter().enumerate() {
            let (rho, emission) = (s.rho[i].as_dvec3(), s.emission[i].visible.as_dvec3());
            let incident = (l.visible.as_dvec3() - emission) / rho;
            emitted += std::f64::consts::PI * s.areas[i] * emission.element_sum();
            absorbed += std::f64::consts::PI * s.areas[i] * ((1.0 - rho) * incident).element_sum();
        }
        let spent = absorbed + shooting.progress().unshot;
        assert!((spent / emitted - 1.0).abs() < 1e-6, "{name}: {spent} {emitted}");
    }
}

#[test]
fn a_furnace_is_uniform_to_the_rays_noise() {
    // Power is conserved, so the mean of L / (E / (1 - rho)) is exact to what is unshot.
    let global = Mode::Global.transport();
    let p = Solver::new(&scene("furnace")).cut(300);
    let own = &p.geometry.scene.materials[0];
    let exact = f64::from(own.emission.x) / (1.0 - f64::from(own.rho.x));
    let shooter = p.ray_shooter(global, rays(Emitted::Rays, 1));
    let shooting = finished(&shooter, 1e-6);
    let areas = shooter.surfaces().areas;
    let sum = |f: fn(f64) -> f64| -> f64 {
        let light = shooting.light();
        let each = light.iter().zip(areas);
        each.map(|(l, a)| a * f(l.visible.x as f64 / exact)).sum::<f64>() / areas.iter().sum::<f64>()
    };
    assert!((sum(|l| l) - 1.0).abs() < 3e-6);
    // All rays carry the same power or less, so a patch receives at least rays/patches of them: Poisson bounds
    // the relative deviation of what is received, which is half of L.
    let deviation = sum(|l| (l - 1.0) * (l - 1.0)).sqrt();
    let poisson = 0.5 / ((1 << 17) as f64 / p.patches.len() as f64).sqrt();
    assert!(deviation < 1.5 * poisson, "{deviation} {poisson}");
}

/// Parts of the light of K's emitters: the share of part c changes from patch to patch.
fn parts(k: &Assembled, count: usize) -> Vec<EmitterLight> {
    let part = |c: usize| {
        let share = |i: usize| if i % count == c { 0.5 } else { 0.5 / (count - 1) as f32 };
        let scaled = |l: &Light, share: f32| Light { invisible: share * l.invisible, visible: share * l.visible };
        EmitterLight {
            emission: k.operator.emission().iter().enumerate().map(|(i, l)| scaled(l, share(i))).collect(),
            received: k.operator.received().iter().enumerate().map(|(i, l)| share(i) * *l).collect(),
        }
    };
    (0..count).map(part).collect()
}

fn summed(lights: &[Vec<Light>]) -> Vec<Light> {
    let mut sum = vec![Light::default(); lights[0].len()];
    for light in lights {
        for (sum, l) in sum.iter_mut().zip(light) {
            sum.invisible += l.invisible;
            sum.visible += l.visible;
        }
    }
    sum
}

/// Sources that shoot together have the light that the same shots give their sum, and each its own solution.
#[test]
fn sources_shoot_together() {
    let p = Solver::new(&scene("cornell-box")).cut(500);
    let k = k(&p, Mode::Global.transport(), 0);
    let areas = k.operator.areas();
    let parts = parts(&k, 3);
    assert!(parts.iter().all(|part| part.received.iter().any(|r| *r != Rgb::ZERO)));
    let mut together = Shooting::of_sources(&k.operator, &parts, until(1e-6)).expect("a converging series");
    let progress = together.run(|_| ()).expect("a converging series");
    let alone = finished(&k.operator, 1e-6);
    // Powers are the same to rounding, and so are the shots.
    assert!(progress.shots.abs_diff(alone.progress().shots) * 100 <= progress.shots);
    let lights: Vec<Vec<Light>> = (0..3).map(|c| together.light_of(c)).collect();
    assert!(difference(areas, &summed(&lights), &alone.light()) < 2e-6);
    for n in 0..4 {
        let generations: Vec<Vec<Light>> = (0..3).map(|c| together.generation_of(c, n)).collect();
        assert!(difference(areas, &summed(&generations), &alone.generation(n)) < 1e-4, "{n}");
    }
    let source = |part: &EmitterLight| Source {
        emission: part.emission.clone(),
        first_bounce: Some(k.operator.first_bounce_of(part)),
    };
    let sources: Vec<Source> = parts.iter().map(source).collect();
    let settings = Settings { tolerance: 1e-6, ..Settings::default() };
    let solved = solve_columns(&k.operator, &sources, &settings).expect("a converging series");
    for (light, solved) in lights.iter().zip(&solved.light) {
        assert!(difference(areas, light, solved) < 1e-5);
    }
}

/// A source alone is what the shooter has as its own, bit by bit, by rays as well.
#[test]
fn a_source_alone_is_the_shooters_own() {
    let p = Solver::new(&scene("cornell-box")).cut(300);
    let shooter = p.ray_shooter(Mode::Global.transport(), rays(Emitted::ClosedForm, 0));
    let source =
        EmitterLight { emission: shooter.surfaces().emission.to_vec(), received: shooter.received().0.to_vec() };
    let sources = [source];
    let mut shooting = Shooting::of_sources(&shooter, &sources, until(1e-2)).expect("a converging series");
    shooting.run(|_| ()).expect("a converging series");
    assert_eq!(shooting.light(), finished(&shooter, 1e-2).light());
}

#[test]
fn generations_are_the_neumann_terms_of_the_same_k() {
    let mut cases: Vec<(Scene, Transport)> = Mode::ALL.iter().map(|m| (scene("cornell-box"), m.transport())).collect();
    cases.push((scene("cornell-box"), Transport::new(0.5, 0.5).unwrap()));
    cases.push((hybrid(), Mode::Global.transport()));
    for (case, (scene, mode)) in cases.into_iter().enumerate() {
        let p = Solver::new(&scene).cut(500);
        let k = k(&p, mode, 0);
        let series = explore(&k.operator, 6);
        let shooter = &k.operator;
        let shooting = finished(shooter, 1e-9);
        let areas = k.operator.areas();
        for n in 0..=5 {
            let own = shooting.generation(n);
            match series.terms.get(n) {
                Some(term) if norm(areas, term) > 0.0 => {
                    let apart = difference(areas, &own, term);
                    assert!(apart < 1e-5, "case {case}, n {n}: {apart}");
                }
                _ => assert!(own.iter().all(|l| *l == Light::default())),
            }
        }
        let whole = neumann(&k.operator, &Default::default()).unwrap();
        let apart = difference(areas, &shooting.light(), &whole.light);
        // Neumann's own tolerance is 1e-4 of the sum.
        assert!(apart < 1.2e-4, "case {case}: {apart}");
    }
}

#[test]
fn later_generations_are_kept_together() {
    let p = Solver::new(&scene("cornell-box")).cut(200);
    let k = k(&p, Mode::Global.transport(), 0);
    let shooter = &k.operator;
    let all = finished(shooter, 1e-9);
    let settings = ShootingSettings { generations: 3, ..until(1e-9) };
    let mut few = Shooting::new(shooter, settings).unwrap();
    few.run(|_| ()).unwrap();
    let areas = k.operator.areas();
    assert!(few.generations() == 4 && all.generations() > 10);
    assert!(difference(areas, &few.generation(2), &all.generation(2)) < 1e-6);
    assert!(difference(areas, &few.light(), &all.light()) < 1e-6);
    assert!(norm(areas, &few.generation(3)) > 1.5 * norm(areas, &all.generation(3)));
}

/// Visible power, all channels, of generations 1 to 4 and of the whole.
fn powers(areas: &[f64], fields: impl Iterator<Item = Vec<Light>>) -> Vec<f64> {
    let of = |l: Vec<Light>| -> f64 {
        let each = l.iter().zip(areas);
        each.map(|(l, a)| a * l.visible.element_sum() as f64).sum()
    };
    fields.map(of).collect()
}

/// Mean of every column and its standard error.
fn mean_and_error(runs: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let n = runs.len() as f64;
    (0..runs[0].len())
        .map(|c| {
            let mean = runs.iter().map(|r| r[c]).sum::<f64>() / n;
            let squares: f64 = runs.iter().map(|r| (r[c] - mean).powi(2)).sum();
            (mean, (squares / (n - 1.0) / n).sqrt())
        })
        .collect()
}

#[test]
fn rays_agree_with_neumann_within_the_noise_of_both() {
    const SEEDS: u32 = 10;
    for (scene, mode) in [
        (scene("cornell-box"), Mode::Global.transport()),
        (scene("cornell-box"), Transport::new(0.5, 0.5).unwrap()),
        (hybrid(), Mode::Global.transport()),
    ] {
        let p = Solver::new(&scene).cut(200);
        let series: Vec<Vec<f64>> = (0..SEEDS)
            .map(|seed| {
                let k = k(&p, mode, 100 + seed);
                let s = explore(&k.operator, 40);
                let terms = s.terms[1..5].iter().cloned();
                powers(k.operator.areas(), terms.chain([s.light.clone()]))
            })
            .collect();
        let reference = mean_and_error(&series);
        for emitted in [Emitted::ClosedForm, Emitted::Rays] {
            let runs: Vec<Vec<f64>> = (0..SEEDS)
                .map(|seed| {
                    let shooter = p.ray_shooter(mode, rays(emitted, seed));
                    let s = finished(&shooter, 1e-5);
                    let terms = (1..5).map(|n| s.generation(n));
                    powers(shooter.surfaces().areas, terms.chain([s.light()]))
                })
                .collect();
            for (c, (a, b)) in mean_and_error(&runs).iter().zip(&reference).enumerate() {
                // What is unshot is missing: at most 1e-5 of the emitted power, less than 1e-3 of these generations.
                let error = a.1.hypot(b.1);
                let missing = 1e-3 * b.0;
                assert!((a.0 - b.0).abs() < 4.0 * error + missing, "{mode:?} {emitted:?} {c}: {a:?} {b:?}");
                assert!(error < 0.02 * b.0, "too noisy to tell: {c} {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn it_stops_at_the_wanted_share_and_counts() {
    let global = Mode::Global.transport();
    let p = Solver::new(&scene("cornell-box")).cut(200);
    let k = k(&p, global, 0);
    let assembled = &k.operator;
    let cast = p.ray_shooter(global, rays(Emitted::ClosedForm, 0));
    let forms: [&dyn Shooter; 2] = [assembled, &cast];
    for shooter in forms {
        for wanted in [1.0, 0.1, 1e-2, 1e-3] {
            let mut seen: Vec<Progress> = Vec::new();
            let mut shooting = Shooting::new(shooter, until(wanted)).unwrap();
            shooting.run(|s| seen.push(s.progress())).unwrap();
            let last = shooting.progress();
            assert!(last.share <= wanted);
            assert_eq!(last.batches, seen.len() as u64);
            assert!(seen.iter().rev().skip(1).all(|p| p.share > wanted));
            assert!(seen.windows(2).all(|w| w[0].shots < w[1].shots));
            assert_eq!(shooting.step().unwrap(), None);
        }
    }
}

#[test]
fn where_nothing_is_passed_on_only_emitters_shoot() {
    let p = Solver::new(&scene("cornell-box")).cut(300);
    for mode in [Mode::Local, Mode::OneBounce] {
        let k = k(&p, mode.transport(), 0);
        let assembled = &k.operator;
        let closed = p.ray_shooter(mode.transport(), rays(Emitted::ClosedForm, 0));
        let cast = p.ray_shooter(mode.transport(), rays(Emitted::Rays, 0));
        let emitters = k.operator.emission().iter();
        let emitters = emitters.filter(|e| **e != Light::default()).count() as u64;
        let forms: [&dyn Shooter; 3] = [assembled, &closed, &cast];
        for shooter in forms {
            let shooting = finished(shooter, 0.0);
            assert_eq!(shooting.progress().shots, emitters);
            assert!(shooting.generation(1).iter().any(|l| l.visible.x > 0.0));
            let second = shooting.generation(2);
            assert!(second.iter().all(|l| *l == Light::default()));
        }
    }
}

/// Shoots until the end or the refusal.
fn refusal(shooter: &dyn Shooter) -> Option<halflight::solve::Diverges> {
    let mut shooting = match Shooting::new(shooter, until(1e-3)) {
        Ok(shooting) => shooting,
        Err(e) => return Some(e),
    };
    shooting.run(|_| ()).err()
}

#[test]
fn a_room_full_of_furniture_is_refused_without_shadows() {
    let mode = Mode::Shadowless.transport();
    let p = Solver::new(&scene("furnished-room")).cut(600);
    let k = k(&p, mode, 0);
    let proof = refusal(&k.operator).expect("refused by proof");
    assert_eq!(proof.verdict, Verdict::Diverges);
    let found = refusal(&p.ray_shooter(mode, rays(Emitted::ClosedForm, 0)));
    let found = found.expect("refused while running");
    assert_eq!(found.verdict, Verdict::Diverges);
    // A lower bound: it may not pass the proved upper one by more than the noise.
    assert!(found.radius.lower >= 1.0 && found.radius.lower < 1.02 * proof.radius.upper);
    assert!(found.radius.upper >= found.radius.lower);
}

#[test]
fn spheres_are_refused_just_beyond_the_frontier_and_solved_just_before() {
    let mut bright = scene("concentric-spheres");
    for m in &mut bright.materials {
        m.rho = halflight::light::Rgb::splat(0.95);
    }
    let few = |emitted| RaySettings { rays: 1 << 15, ..rays(emitted, 0) };
    let p = Solver::new(&bright).cut(250);
    let one = Mode::Shadowless.transport();
    let (_, spectrum) = verdict(&k(&p, one, 0).operator);
    // The radius is proportional to alpha.
    let radius = spectrum.expect("alpha 1 interreflects").worst();
    let frontier = 2.0 / (radius.lower + radius.upper);
    for (times, refused) in [(0.97, false), (1.03, true)] {
        let alpha = (times * frontier) as f32;
        let mode = Transport::new(alpha, 1.0).expect("a frontier below alpha 1");
        let k = k(&p, mode, 0);
        assert_eq!(refusal(&k.operator).is_some(), refused);
        for emitted in [Emitted::ClosedForm, Emitted::Rays] {
            let found = refusal(&p.ray_shooter(mode, few(emitted)));
            assert_eq!(found.is_some(), refused, "{times} {found:?}");
        }
    }
}

#[test]
fn a_run_that_takes_too_long_is_refused_as_undecided() {
    let mode = Transport::new(0.5, 0.5).unwrap();
    let p = Solver::new(&scene("cornell-box")).cut(200);
    let shooter = p.ray_shooter(mode, rays(Emitted::ClosedForm, 0));
    let settings = ShootingSettings { shots_per_patch: 2, ..until(1e-9) };
    let mut shooting = Shooting::new(&shooter, settings).unwrap();
    let refused = shooting.run(|_| ()).unwrap_err();
    assert_eq!(refused.verdict, Verdict::Undecided);
    assert!(refused.radius.lower < 1.0);
}

#[test]
fn the_same_bits_for_any_number_of_threads_and_other_bits_for_another_seed() {
    let mode = Transport::new(0.8, 0.3).unwrap();
    let p = Solver::new(&scene("cornell-box")).cut(200);
    let k = k(&p, mode, 0);
    let run = |threads: usize, seed: u32| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let cast = p.ray_shooter(mode, rays(Emitted::Rays, seed));
            let cast = finished(&cast, 1e-3);
            let assembled = &k.operator;
            let assembled = finished(assembled, 1e-3);
            (cast.light(), assembled.light(), cast.progress())
        })
    };
    let once = run(1, 0);
    assert!(once == run(3, 0));
    assert!(once.0 != run(1, 1).0);
}
