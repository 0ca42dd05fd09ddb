//! The path tracer against closed forms, against another program's Cornell box, and against itself.
//!
//! Every comparison of means allows 4 standard errors, as the tracer reports them; the seeds are fixed. That the
//! reported errors are right is tested by their spread over seeds.

mod agreement;
mod closed_forms;
mod spheres;

use halflight::light::Transport;
use halflight::rays::Rays;
use halflight::scene::{LoadOptions, Scene};
use halflight_reference::{NextEvent, TraceSettings, Tracer};

const BOTH: [NextEvent; 2] = [NextEvent::On, NextEvent::Off];

fn load(name: &str) -> Scene {
    Scene::builtin(name, LoadOptions::default()).expect("a built-in name").expect("a correct scene")
}

fn settings(next_event: NextEvent) -> TraceSettings {
    TraceSettings { next_event, ..TraceSettings::default() }
}

fn traced<'a>(
    scene: &Scene,
    rays: &'a Rays,
    transport: Transport,
    (size, samples): (usize, u32),
    settings: &TraceSettings,
) -> Tracer<'a> {
    let transports = scene.transports(transport);
    let mut tracer = Tracer::new(scene, rays, &transports, (size, size), settings);
    tracer.pass(samples);
    tracer
}
