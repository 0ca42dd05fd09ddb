//! The ladders: each step from scratch, from the scene to the picture, its time taken.
//!
//! A step is not begun where the last one foresees that it would take longer than its share of [`Plan::seconds`].

use std::time::Instant;

use crate::form_factors::Sampling;
use crate::gather::{GatherSampling, Gathered};
use crate::rays::Rays;
use crate::reference::{TraceSettings, Tracer};
use crate::render::look::{fields, reflected};
use crate::render::{
    Seconds, Silent, Wanted, Watch, assemble, check_memory, picture, prepare, ray_shooter, render, render_within,
};
use crate::scene::Scene;
use crate::solve::{Diverges, RaySettings, Settings, Shooting, ShootingSettings, neumann};
use crate::study::tradeoff::{Ladder, Plan, Run};

/// The errors asked for.
pub const TOLERANCES: [f64; 6] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.002];
/// What the knobs that are not varied stand at: patches, rays a patch, samples a pixel.
const FINE: Knobs = Knobs { patches: 8000, rays: 1024, samples: 512 };
/// Steps of a knob's ladder, each four times the last.
const STEPS: u32 = 5;
/// Share of the plan's seconds that a step of any ladder but the tolerance's may take.
const SHARE: f64 = 0.25;
/// Unshot power that counts as none.
const UNSHOT: f64 = 1e-4;

#[derive(Clone, Copy)]
struct Knobs {
    patches: usize,
    rays: u32,
    samples: u32,
}

/// Runs steps while the next is foreseen to end within `limit` seconds: it takes as many times the last as that did the one
/// before, `growth` times at most. A step of none, for want of memory, is the end too.
fn climb<E>(
    count: u32,
    (growth, limit): (f64, f64),
    watch: &dyn Watch,
    mut step: impl FnMut(u32) -> Result<Option<Run>, E>,
) -> Result<Vec<Run>, E> {
    let mut runs: Vec<Run> = Vec::new();
    for k in 0..count {
        let foreseen = match &runs[..] {
            [] => 0.0,
            [only] => only.seconds.total,
            [.., before, last] => {
                let factor = last.seconds.total / before.seconds.total;
                last.seconds.total * factor.clamp(1.0, growth)
            }
        };
        if foreseen > limit {
            break;
        }
        let Some(run) = step(k)? else {
            break;
        };
        runs.push(run);
        watch.tick(1);
    }
    Ok(runs)
}

/// The tolerance's ladder.
pub fn tolerances(scene: &Scene, plan: &Plan, watch: &dyn Watch) -> Result<Vec<Run>, Diverges> {
    let count = TOLERANCES.len() as u32;
    watch.begin("tolerance", u64::from(count));
    climb(count, (3.0, plan.seconds), watch, |k| {
        let tolerance = TOLERANCES[k as usize];
        let wanted = Wanted { tolerance, size: plan.size, seed: plan.seed };
        let mut p = prepare(scene.clone(), 1);
        p.memory = plan.memory;
        let within = render_within(&mut p, plan.transport, &wanted, &Silent)?;
        let run = Run {
            ladder: Ladder::Tolerance,
            effort: format!("{} patches, {} rays in all", within.patches, within.rays),
            asked: Some(tolerance),
            estimated: Some(within.error.total),
            seconds: loaded(plan, within.seconds),
            picture: within.picture,
        };
        Ok(Some(run))
    })
}

/// The ladder of one knob, the others fine.
pub fn one_knob(scene: &Scene, plan: &Plan, ladder: Ladder, watch: &dyn Watch) -> Result<Vec<Run>, Diverges> {
    watch.begin(ladder.name(), u64::from(STEPS));
    climb(STEPS, (4.0, SHARE * plan.seconds), watch, |k| {
        let mut knobs = FINE;
        match ladder {
            Ladder::Patches => knobs.patches = 250 << (2 * k),
            Ladder::Rays => knobs.rays = 16 << (2 * k),
            _ => knobs.samples = 8 << (2 * k),
        }
        fixed(scene, plan, ladder, knobs)
    })
}

/// A picture with so many patches, rays and samples; none where K would not fit in memory.
fn fixed(scene: &Scene, plan: &Plan, ladder: Ladder, knobs: Knobs) -> Result<Option<Run>, Diverges> {
    let sampling = Sampling { rays: knobs.rays, seed: plan.seed, ..Sampling::default() };
    let p = prepare(scene.clone(), knobs.patches);
    if check_memory(&p, &[plan.transport], &sampling, plan.memory).is_err() {
        return Ok(None);
    }
    let mut seconds = Seconds { patches: p.seconds, ..Seconds::default() };
    let mut clock = Instant::now();
    let (modes, _) = assemble(&p, &[plan.transport], &sampling, &Silent);
    seconds.form_factors = lap(&mut clock);
    let solution = neumann(&modes[0].operator, &Settings::default())?;
    seconds.solve = lap(&mut clock);
    let gathering = GatherSampling::with_samples(knobs.samples, plan.seed);
    let gathered = render(&p, &modes[0], &solution, plan.size, &gathering, &Silent);
    seconds.gather = lap(&mut clock);
    let effort = format!("{} patches, {} rays a patch, {} samples a pixel", p.patches.len(), knobs.rays, knobs.samples);
    Ok(Some(finished(plan, ladder, effort, seconds, gathered)))
}

/// Progressive shooting with rays: patches, rays and samples doubled together.
pub fn shooting(scene: &Scene, plan: &Plan, watch: &dyn Watch) -> Result<Vec<Run>, Diverges> {
    let count = 8;
    watch.begin(Ladder::Shooting.name(), count);
    let limits = (2.5, SHARE * plan.seconds);
    climb(count as u32, limits, watch, |k| shoot(scene, plan, k).map(Some))
}

fn shoot(scene: &Scene, plan: &Plan, k: u32) -> Result<Run, Diverges> {
    let p = prepare(scene.clone(), 250 << k);
    let mut seconds = Seconds { patches: p.seconds, ..Seconds::default() };
    let mut clock = Instant::now();
    let rays = 64 << k;
    let settings = RaySettings {
        rays: u32::saturating_mul(rays, p.patches.len() as u32),
        seed: plan.seed,
        ..RaySettings::default()
    };
    let shooter = ray_shooter(&p, plan.transport, settings);
    let until = ShootingSettings { unshot: UNSHOT, ..ShootingSettings::default() };
    let mut shooting = Shooting::new(&shooter, until)?;
    shooting.run(|_| ())?;
    let terms: Vec<_> = (0..shooting.generations()).map(|n| shooting.generation(n)).collect();
    seconds.solve = lap(&mut clock);
    let camera = 2 << k;
    let gathering = GatherSampling { camera, luminaire: 4, hemisphere: 8, seed: plan.seed };
    let transports = p.scene.transports(plan.transport);
    let fields = fields(&p, &[reflected(&p, &terms)]);
    let gathered = picture(&p, &transports, &fields, plan.size, &gathering, &Silent);
    seconds.gather = lap(&mut clock);
    let effort = format!("{} patches, {rays} rays a patch, {camera} camera rays a pixel", p.patches.len());
    Ok(finished(plan, Ladder::Shooting, effort, seconds, gathered))
}

/// The path tracer's ladder: one tracer goes on, four times the samples at each step.
pub fn paths(scene: &Scene, plan: &Plan, watch: &dyn Watch) -> Vec<Run> {
    let count = 10;
    watch.begin(Ladder::Paths.name(), count);
    let mut clock = Instant::now();
    let rays = Rays::new(scene);
    let transports = scene.transports(plan.transport);
    let settings = TraceSettings { seed: plan.seed, ..TraceSettings::default() };
    let mut tracer = Tracer::new(scene, &rays, &transports, plan.size, &settings);
    let mut seconds = Seconds { patches: lap(&mut clock), ..Seconds::default() };
    let limits = (4.0, SHARE * plan.seconds);
    let climbed = climb(count as u32, limits, watch, |k| {
        clock = Instant::now();
        let samples = 4 << (2 * k);
        tracer.pass(samples - tracer.samples() as u32);
        seconds.gather += lap(&mut clock);
        Ok::<_, std::convert::Infallible>(Some(Run {
            ladder: Ladder::Paths,
            effort: format!("{samples} samples a pixel"),
            asked: None,
            estimated: tracer.relative_error(),
            seconds: loaded(plan, seconds),
            picture: tracer.picture(),
        }))
    });
    let Ok(runs) = climbed;
    runs
}

fn finished(plan: &Plan, ladder: Ladder, effort: String, seconds: Seconds, gathered: Gathered) -> Run {
    Run { ladder, effort, asked: None, estimated: None, seconds: loaded(plan, seconds), picture: gathered.total() }
}

/// Adds the time of reading the scene.
fn loaded(plan: &Plan, mut seconds: Seconds) -> Seconds {
    seconds.load = plan.load;
    seconds.sum();
    seconds
}

/// Seconds since the clock was last read here.
fn lap(clock: &mut Instant) -> f64 {
    let seconds = clock.elapsed().as_secs_f64();
    *clock = Instant::now();
    seconds
}
