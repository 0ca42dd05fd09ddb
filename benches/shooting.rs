//! Shots per second of both forms in the Cornell box, global mode.
//!
//! One iteration shoots from the start to 1 % unshot. Ratios count, not the absolute numbers.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::light::Mode;
use halflight::render::Watch;
use halflight::scene::{LoadOptions, Scene};
use halflight::solve::{RaySettings, Shooter, Shooting, ShootingSettings};

struct Quiet;

impl Watch for Quiet {
    fn begin(&self, _: &str, _: u64) {}
    fn tick(&self, _: u64) {}
}

/// Shoots to 1 %; tells how many shots it took.
fn shoot(shooter: &dyn Shooter) -> u64 {
    let settings = ShootingSettings { unshot: 1e-2, ..ShootingSettings::default() };
    let mut shooting = Shooting::new(shooter, settings).expect("it converges");
    shooting.run(|_| ()).expect("it converges").shots
}

fn shots(c: &mut Criterion) {
    let scene = Scene::builtin("cornell-box", LoadOptions::default());
    let scene = scene.expect("a built-in name").expect("a correct scene");
    let p = Solver::new(&scene).cut(2000);
    let mode = Mode::Global.transport();
    let (modes, _) = p.assemble(&[mode], &Sampling::default(), &Quiet);
    let assembled = &modes[0].operator;
    let cast = p.ray_shooter(mode, RaySettings::default());
    let forms: [(&str, &dyn Shooter); 2] = [("assembled", assembled), ("rays", &cast)];
    for (name, shooter) in forms {
        let mut group = c.benchmark_group("shooting");
        group.sample_size(10).throughput(Throughput::Elements(shoot(shooter)));
        group.bench_function(name, |b| b.iter(|| shoot(shooter)));
        group.finish();
    }
}

criterion_group!(benches, shots);
criterion_main!(benches);
