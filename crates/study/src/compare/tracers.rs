//! Pictures of the path tracers: one tracer goes on adding samples, and is looked at on the way.
//!
//! Not handled: variance that is infinite (`map` shows where), and whatever a path tracer's own standard error does not
//! show.

use std::convert::Infallible;
use std::time::Instant;

use crate::compare::arithmetic::{counted, masked_error, masked_mean, window};
use crate::compare::ladder::{Ladder, LadderStep, Method, ORDERS, Study, StudyPlan, climb, lap};
use crate::compare::verdict::{Answer, Mean};
use halflight::light::Rgb;
use halflight::pictures::Picture;
use halflight::rays::Rays;
use halflight::render::Seconds;
use halflight::scene::Scene;
use halflight_reference::{NextEvent, TraceSettings, Tracer};

/// Times at which tracers that are compared are looked at, as shares of the plan's.
const LOOKS: [f64; 6] = [1.0 / 32.0, 1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0, 1.0 / 2.0, 1.0];

/// Climbs with one tracer, which is given back with all its samples. `ready` seconds were spent on `rays`.
pub(crate) fn climb_paths<'a>(
    scene: &Scene,
    rays: &'a Rays,
    ready: f64,
    plan: &StudyPlan,
    ladder: &Ladder,
) -> (Vec<LadderStep>, Tracer<'a>) {
    let mut clock = Instant::now();
    let next_event = if ladder.method == Method::Paths { NextEvent::Off } else { NextEvent::On };
    let settings = TraceSettings { next_event, seed: plan.seed, ..TraceSettings::default() };
    let mut tracer = Tracer::new(scene, rays, &scene.transports(plan.transport), plan.size, &settings);
    let mut seconds = Seconds { patches: ready + lap(&mut clock), ..Seconds::default() };
    let steps = climb(ladder, plan, |k| {
        clock = Instant::now();
        match plan.study {
            Study::Chart => tracer.pass((4 << (2 * k)) - tracer.samples() as u32),
            Study::Compare => {
                pass_until(&mut tracer, LOOKS[k as usize] * plan.seconds - seconds.patches - seconds.gather, plan);
            }
        }
        seconds.gather += lap(&mut clock);
        let orders = (0..plan.study.orders()).filter_map(|n| tracer.bounce(n)).collect();
        Ok::<_, Infallible>(Some(LadderStep {
            effort: format!("{} samples a pixel", tracer.samples()),
            requested: None,
            estimated: tracer.relative_error(),
            seconds,
            picture: tracer.picture(),
            orders,
        }))
    });
    let Ok(steps) = steps;
    (steps, tracer)
}

/// Adds samples for so many seconds, two at least: one has no standard error. A tick for each millisecond.
fn pass_until(tracer: &mut Tracer, seconds: f64, plan: &StudyPlan) {
    plan.watch.begin("paths", (1e3 * seconds.max(0.0)) as u64);
    let (clock, mut ticked) = (Instant::now(), 0);
    loop {
        tracer.pass(2);
        let now = clock.elapsed();
        plan.watch.tick(now.as_millis() as u64 - ticked);
        ticked = now.as_millis() as u64;
        if now.as_secs_f64() >= seconds {
            return;
        }
    }
}

/// What a tracer found, with its means over the mask and the most that one sample can weigh.
pub(crate) fn traced_answer(tracer: &Tracer, name: &'static str, mask: &Picture) -> Answer {
    let black = || Picture::new(mask.width, mask.height);
    let picture = tracer.picture();
    let noise = tracer.standard_error().unwrap_or_else(black);
    let orders: Vec<Picture> = (0..=ORDERS).filter_map(|n| tracer.bounce(n)).collect();
    let order_noise: Vec<Picture> = (0..=ORDERS).map(|n| tracer.bounce_error(n).unwrap_or_else(black)).collect();
    let pictures = std::iter::once(&picture).chain(&orders);
    let means = pictures.zip(std::iter::once(&noise).chain(&order_noise)).map(|(picture, noise)| Mean {
        value: masked_mean(picture, mask),
        noise: masked_error(noise, mask),
        systematic: [0.0; 3],
    });
    Answer {
        name,
        effort: format!("{} samples a pixel", tracer.samples()),
        means: means.collect(),
        freedom: f64::INFINITY,
        sample: Some(weights(tracer, mask)),
        picture,
        noise,
        orders,
        order_noise,
        ..Answer::default()
    }
}

/// Samples with light among which the largest is taken: the next exceeds it with a probability of 1 in so many.
const ENOUGH: u64 = 2000;

/// The most that one sample can add to each pixel's mean: the largest of at least [`ENOUGH`] samples with light around
/// the pixel, or in the whole picture, over the number of samples.
fn weights(tracer: &Tracer, mask: &Picture) -> Picture {
    let (largest, lit) = (tracer.largest(), tracer.lit());
    let share = 1.0 / tracer.samples() as f32;
    let most = |pixels: &mut dyn Iterator<Item = usize>| {
        pixels.fold((Rgb::ZERO, 0), |(most, n), k| (most.max(largest.pixels[k]), n + u64::from(lit[k])))
    };
    let (everywhere, _) = most(&mut counted(mask).into_iter());
    let near = |k: usize| {
        let around = [3, 6, 12].into_iter().find_map(|half| {
            let (largest, lit) = most(&mut window(mask, k, half));
            (lit >= ENOUGH).then_some(largest)
        });
        around.unwrap_or(everywhere) * share
    };
    Picture { width: mask.width, height: mask.height, pixels: (0..mask.pixels.len()).map(near).collect() }
}
