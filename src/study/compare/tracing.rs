//! The path tracers' ladder: one tracer goes on adding samples, looked at when each step's time has passed.

use std::time::Instant;

use crate::light::Rgb;
use crate::pictures::Picture;
use crate::rays::Rays;
use crate::reference::{NextEvent, TraceSettings, Tracer};
use crate::render::Watch;
use crate::scene::Scene;
use crate::study::compare::arithmetic::{counted, masked_error, masked_mean, window};
use crate::study::compare::comparison::Plan;
use crate::study::compare::{Estimate, Mean, ORDERS};

/// What a tracer saw.
pub struct Traced {
    /// After each step.
    pub ladder: Vec<Estimate>,
    /// Pixels none of whose samples saw a luminaire.
    pub mask: Picture,
    /// Largest sample of each pixel.
    largest: Picture,
    /// Samples of each pixel that found light.
    lit: Vec<u32>,
    samples: u64,
}

/// Traces until the last of `steps` (seconds, ascending) has passed.
pub fn trace(
    (scene, rays): (&Scene, &Rays),
    plan: &Plan,
    next_event: NextEvent,
    steps: &[f64],
    watch: &dyn Watch,
) -> Traced {
    let settings = TraceSettings { next_event, seed: plan.seed, ..TraceSettings::default() };
    let milliseconds = |seconds: f64| (1e3 * seconds) as u64;
    watch.begin("paths", steps.last().map_or(0, |&s| milliseconds(s)));
    let start = Instant::now();
    let transports = scene.transports(plan.transport);
    let mut tracer = Tracer::new(scene, rays, &transports, plan.size, &settings);
    let mut ladder = Vec::new();
    let (mut looking, mut told) = (0.0, 0);
    for &step in steps {
        // Two samples at least, or there is no standard error.
        let seconds = loop {
            tracer.pass(2);
            let seconds = start.elapsed().as_secs_f64() - looking;
            let now = milliseconds(seconds);
            watch.tick(now - told);
            told = now;
            if seconds >= step {
                break seconds;
            }
        };
        ladder.push(look(&tracer, seconds));
        looking = start.elapsed().as_secs_f64() - seconds;
    }
    Traced { ladder, mask: tracer.mask(), largest: tracer.largest(), lit: tracer.lit(), samples: tracer.samples() }
}

fn look(tracer: &Tracer, seconds: f64) -> Estimate {
    let noise: Option<Vec<Picture>> = (0..=ORDERS).map(|n| tracer.bounce_error(n)).collect();
    Estimate {
        seconds,
        effort: format!("{} samples a pixel", tracer.samples()),
        picture: tracer.picture(),
        noise: tracer.standard_error(),
        orders: (0..=ORDERS).filter_map(|n| tracer.bounce(n)).collect(),
        order_noise: noise,
        ..Estimate::default()
    }
}

/// Samples with light among which the largest is looked for: the next exceeds it with a probability of 1 in so many.
const ENOUGH: u64 = 2000;

impl Traced {
    /// The last estimate with its means over the mask and the most one sample can weigh.
    pub fn best(&self, mask: &Picture) -> Estimate {
        let mut best = self.ladder[self.ladder.len() - 1].clone();
        let pictures = std::iter::once(&best.picture).chain(&best.orders);
        let noises = best.noise.iter().chain(best.order_noise.iter().flatten());
        let means = pictures.zip(noises).map(|(picture, noise)| Mean {
            value: masked_mean(picture, mask),
            noise: masked_error(noise, mask),
            systematic: [0.0; 3],
        });
        best.means = means.collect();
        best.freedom = f64::INFINITY;
        best.sample = Some(self.weights(mask));
        best
    }

    /// The most that one sample can add to each pixel's mean: the largest of at least [`ENOUGH`] samples with light
    /// around the pixel, or in the whole picture, over the number of samples.
    fn weights(&self, mask: &Picture) -> Picture {
        let share = 1.0 / self.samples as f32;
        let most = |pixels: &mut dyn Iterator<Item = usize>| {
            pixels.fold((Rgb::ZERO, 0), |(largest, lit), k| {
                let pixel = self.largest.pixels[k];
                (largest.max(pixel), lit + u64::from(self.lit[k]))
            })
        };
        let (everywhere, _) = most(&mut counted(mask).into_iter());
        let near = |k: usize| {
            let mut halves = [3, 6, 12].into_iter();
            let around = halves.find_map(|half| {
                let (largest, lit) = most(&mut window(mask, k, half));
                (lit >= ENOUGH).then_some(largest)
            });
            around.unwrap_or(everywhere) * share
        };
        Picture { width: mask.width, height: mask.height, pixels: (0..mask.pixels.len()).map(near).collect() }
    }
}
