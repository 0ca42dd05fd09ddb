//! The path tracers' ladder: one tracer goes on adding samples, looked at when each step's time has passed.

use std::time::Instant;

use super::{Estimate, ORDERS};
use crate::image::Picture;
use crate::light::Transport;
use crate::rays::Rays;
use crate::reference::{NextEvent, TraceSettings, Tracer};
use crate::scene::Scene;

/// Traces until the last of `steps` (seconds, ascending) has passed; also the mask of pixels that see no luminaire.
pub fn trace(
    (scene, rays): (&Scene, &Rays),
    (transport, size): (Transport, (usize, usize)),
    next_event: NextEvent,
    seed: u32,
    steps: &[f64],
) -> (Vec<Estimate>, Picture) {
    let settings = TraceSettings {
        next_event,
        seed,
        ..TraceSettings::default()
    };
    let start = Instant::now();
    let transports = scene.transports(transport);
    let mut tracer = Tracer::new(scene, rays, &transports, size, &settings);
    let mut ladder = Vec::new();
    let mut looking = 0.0;
    for &step in steps {
        // Two samples at least, or there is no standard error.
        loop {
            tracer.pass(2);
            if start.elapsed().as_secs_f64() - looking >= step {
                break;
            }
        }
        let seconds = start.elapsed().as_secs_f64() - looking;
        ladder.push(look(&tracer, seconds));
        looking = start.elapsed().as_secs_f64() - seconds;
    }
    let mask = tracer.mask();
    (ladder, mask)
}

fn look(tracer: &Tracer, seconds: f64) -> Estimate {
    let noise: Option<Vec<Picture>> = (0..=ORDERS).map(|n| tracer.bounce_error(n)).collect();
    Estimate {
        seconds,
        effort: format!("{} samples a pixel", tracer.samples()),
        picture: tracer.picture(),
        noise: tracer.standard_error(),
        systematic: None,
        orders: (0..=ORDERS).filter_map(|n| tracer.bounce(n)).collect(),
        order_noise: noise,
        mean_error: tracer.mean().error,
    }
}
