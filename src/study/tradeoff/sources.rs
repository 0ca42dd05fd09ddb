//! Where references come from: the path tracer, a tightly solved patch picture, or the user's files.
//!
//! Neither is made by the method it judges. Their sample points are not those of the ladders. Not handled: a filter other than
//! the box in a picture that the user brings.

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::light::Rgb;
use crate::pictures::{Picture, read_picture, relative_rms};
use crate::rays::Rays;
use crate::reference::{NextEvent, TraceSettings, Tracer};
use crate::render::{Silent, Wanted, Watch, prepare, render_within};
use crate::scene::Scene;
use crate::solve::Diverges;
use crate::study::tradeoff::store::{Kept, Key};
use crate::study::tradeoff::truth::{Made, Truth};
use crate::study::tradeoff::{Ladder, Plan, TradeoffError};

/// Samples of the path tracer between two looks at the clock.
const PASS: u32 = 16;
/// The path tracer stops here in any case: finer than any tolerance charted.
const NOISE: f64 = 2e-4;
/// Errors asked of the patch picture, one after the other while time allows; each takes some three times the last.
const TIGHTER: [f64; 5] = [0.01, 0.005, 0.002, 0.001, 0.0005];
/// Camera rays a pixel that look for luminaires where the user brings a reference.
const LOOKS: u32 = 256;

/// A reference that the user brings.
#[derive(Clone, Debug)]
pub struct Brought {
    /// The picture, `.exr`, `.hdr` or `.png`.
    pub picture: PathBuf,
    /// Its standard error.
    pub error: Option<PathBuf>,
}

/// The references for patch methods and for the path tracer: from the store, or made and put there. Where no path tracer
/// is to be judged both are the first.
pub fn made(scene: &Scene, plan: &Plan, watch: &dyn Watch) -> Result<[Truth; 2], TradeoffError> {
    let key = Key::of(scene, plan.transport, plan.size);
    let kept = |by: &str| Kept::new(&plan.store, scene, plan.transport, plan.size, by);
    let paths = kept("paths");
    let traced = match paths.read(&key, plan.seconds) {
        Some(truth) => truth,
        None => paths.write(&key, plan.seconds, traced(scene, plan, watch))?,
    };
    if !plan.ladders.contains(&Ladder::Paths) {
        return Ok([traced.clone(), traced]);
    }
    let patches = kept("patches");
    let mut solved = match patches.read(&key, plan.seconds) {
        Some(truth) => truth,
        None => patches.write(&key, plan.seconds, solved(scene, plan, watch)?)?,
    };
    // Thousands of samples know best which pixels see a luminaire.
    solved.mask = traced.mask.clone();
    Ok([traced, solved])
}

/// The path tracer, until the time is over.
fn traced(scene: &Scene, plan: &Plan, watch: &dyn Watch) -> Truth {
    let clock = Instant::now();
    watch.begin("reference, paths", plan.seconds.ceil() as u64);
    let rays = Rays::new(scene);
    let transports = scene.transports(plan.transport);
    let settings = TraceSettings {
        // Not the samples of the ladder.
        seed: plan.seed ^ 0x5eed_0001,
        ..TraceSettings::default()
    };
    let mut tracer = Tracer::new(scene, &rays, &transports, plan.size, &settings);
    let (mut longest, mut now) = (0.0_f64, 0.0);
    loop {
        tracer.pass(PASS);
        let then = clock.elapsed().as_secs_f64();
        watch.tick((then as u64).saturating_sub(now as u64));
        longest = longest.max(then - now);
        now = then;
        let fine = tracer.relative_error().is_some_and(|e| e < NOISE);
        if fine || now + longest > plan.seconds {
            break;
        }
    }
    let picture = tracer.picture();
    let noise = tracer.standard_error();
    Truth {
        noise: noise.unwrap_or_else(|| picture.scaled(0.0)),
        mask: counted(tracer.mask()),
        made: Made {
            by: "path tracing, next event".into(),
            effort: format!("{} samples a pixel", tracer.samples()),
            seconds: now,
            error: tracer.relative_error(),
        },
        ..Truth::of(picture, "")
    }
}

/// The patch picture, tighter and tighter until the time would be over.
fn solved(scene: &Scene, plan: &Plan, watch: &dyn Watch) -> Result<Truth, Diverges> {
    watch.begin("reference, patches", TIGHTER.len() as u64);
    let mut clock = Instant::now();
    let mut best = None;
    let mut last = 0.0;
    for tolerance in TIGHTER {
        if 3.0 * last > plan.seconds {
            break;
        }
        let wanted = Wanted { tolerance, size: plan.size, seed: plan.seed ^ 0x5eed_0002 };
        let mut p = prepare(scene.clone(), 1);
        p.memory = plan.memory;
        let within = render_within(&mut p, plan.transport, &wanted, &Silent)?;
        last = clock.elapsed().as_secs_f64();
        clock = Instant::now();
        watch.tick(1);
        best = Some((tolerance, within, last));
    }
    let (tolerance, within, seconds) = best.expect("the first is always made");
    Ok(Truth {
        noise: within.standard_error,
        made: Made {
            by: "Neumann over patches".into(),
            effort: format!("tolerance {} %", 100.0 * tolerance),
            seconds,
            error: Some(within.error.total),
        },
        ..Truth::of(within.picture, "")
    })
}

/// A reference from the user's files.
pub fn brought(scene: &Scene, plan: &Plan, files: &Brought) -> Result<Truth, TradeoffError> {
    let picture = read_picture(&files.picture)?;
    let noise = files.error.as_deref().map(read_picture).transpose()?;
    let mask = counted(luminaires_unseen(scene, plan));
    // Tells sizes that differ, before the ladders are run.
    let known = noise.is_some();
    let noise = noise.unwrap_or_else(|| picture.scaled(0.0));
    let black = mask.scaled(0.0);
    relative_rms(&black, &picture, Some(&mask), Some(&noise))?;
    let own = relative_rms(&noise.plus(&picture).unwrap_or_else(|| picture.clone()), &picture, Some(&mask), None)?;
    let paths = [Some(&files.picture), files.error.as_ref()];
    let name = |path: &Path| path.display().to_string();
    Ok(Truth {
        noise,
        mask,
        made: Made {
            by: name(&files.picture),
            effort: "brought by the user".into(),
            seconds: 0.0,
            error: known.then_some(own),
        },
        kept: true,
        files: paths.into_iter().flatten().cloned().collect(),
        ..Truth::of(picture, "")
    })
}

/// 1 in pixels none of whose camera rays meets a luminaire.
fn luminaires_unseen(scene: &Scene, plan: &Plan) -> Picture {
    let rays = Rays::new(scene);
    let settings = TraceSettings { next_event: NextEvent::Off, max_bounces: 0, seed: plan.seed };
    let transports = scene.transports(plan.transport);
    let mut tracer = Tracer::new(scene, &rays, &transports, plan.size, &settings);
    tracer.pass(LOOKS);
    tracer.mask()
}

/// The mask, or every pixel where all see a luminaire, as in a furnace.
fn counted(mask: Picture) -> Picture {
    match mask.pixels.iter().any(|p| p.x >= 0.5) {
        true => mask,
        false => Picture::filled(mask.width, mask.height, Rgb::ONE),
    }
}
