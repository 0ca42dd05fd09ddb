//! Where references come from: the path tracer, a tightly solved patch picture, or the user's files.
//!
//! Neither is made by the method it judges. Their sample points are not those of the ladders. Not handled: a filter
//! other than the box in a picture that the user brings.

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::pictures::{Picture, read_picture, relative_rms};
use crate::rays::Rays;
use crate::rays::purpose::Purpose;
use crate::reference::{NextEvent, TraceSettings, Tracer};
use crate::scene::Scene;
use crate::solve::Diverges;
use crate::study::compare::ladder::{StudyError, StudyPlan, lap};
use crate::study::compare::patch_pictures::within;
use crate::study::compare::store::Kept;
use crate::study::compare::truth::{Made, Truth, or_everywhere};

/// Samples of the path tracer between two looks at the clock.
const PASS: u32 = 16;
/// The path tracer stops here in any case: finer than any tolerance charted.
const NOISE: f64 = 2e-4;
/// Errors asked of the patch picture, one after the other while time allows; each takes some three times the last.
const TIGHTER: [f64; 5] = [0.01, 0.005, 0.002, 0.001, 0.0005];
/// Camera rays a pixel that look for luminaires where the user brings a reference.
const LOOKS: u32 = 256;

/// Where the references of a chart come from.
#[derive(Clone, Debug)]
pub enum Source {
    /// They are kept in this folder, and made where they are not there.
    Store(PathBuf),
    /// The user brings one for all methods.
    Files {
        /// The picture, `.exr`, `.hdr` or `.png`.
        picture: PathBuf,
        /// Its standard error.
        error: Option<PathBuf>,
    },
}

/// The references for patch methods and for the path tracer: from the store, or made and put there. Where no path
/// tracer is to be judged both are the first.
///
/// # Errors
/// A series that diverges, a store that cannot be written.
pub(crate) fn made(
    scene: &Scene,
    plan: &StudyPlan,
    store: &Path,
    judges_paths: bool,
) -> Result<[Truth; 2], StudyError> {
    let paths = Kept::new(store, scene, plan, "paths");
    let traced = match paths.read() {
        Some(truth) => truth,
        None => paths.write(traced(scene, plan))?,
    };
    if !judges_paths {
        return Ok([traced.clone(), traced]);
    }
    let patches = Kept::new(store, scene, plan, "patches");
    let mut solved = match patches.read() {
        Some(truth) => truth,
        None => patches.write(solved(scene, plan)?)?,
    };
    // Thousands of samples know best which pixels see a luminaire.
    solved.mask = traced.mask.clone();
    Ok([traced, solved])
}

/// The path tracer, until the time is over.
fn traced(scene: &Scene, plan: &StudyPlan) -> Truth {
    let clock = Instant::now();
    plan.watch.begin("reference, paths", plan.seconds.ceil() as u64);
    let rays = Rays::new(scene);
    let transports = scene.transports(plan.transport);
    let settings = TraceSettings {
        // Not the samples of the ladder.
        seed: Purpose::TracedReference.seed(plan.seed),
        ..TraceSettings::default()
    };
    let mut tracer = Tracer::new(scene, &rays, &transports, plan.size, &settings);
    let (mut longest, mut now) = (0.0_f64, 0.0);
    loop {
        tracer.pass(PASS);
        let then = clock.elapsed().as_secs_f64();
        plan.watch.tick((then as u64).saturating_sub(now as u64));
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
        mask: or_everywhere(tracer.mask()),
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
fn solved(scene: &Scene, plan: &StudyPlan) -> Result<Truth, Diverges> {
    plan.watch.begin("reference, patches", TIGHTER.len() as u64);
    let mut clock = Instant::now();
    let mut best = None;
    let mut last = 0.0;
    for tolerance in TIGHTER {
        if 3.0 * last > plan.seconds {
            break;
        }
        let found = within(scene, plan, tolerance, Purpose::SolvedReference.seed(plan.seed))?;
        last = lap(&mut clock);
        plan.watch.tick(1);
        best = Some((tolerance, found, last));
    }
    let (tolerance, found, seconds) = best.expect("the first is always made");
    Ok(Truth {
        noise: found.standard_error,
        made: Made {
            by: "Neumann over patches".into(),
            effort: format!("tolerance {} %", 100.0 * tolerance),
            seconds,
            error: Some(found.error.total),
        },
        ..Truth::of(found.picture, "")
    })
}

/// A reference from the user's files.
///
/// # Errors
/// Files that cannot be read, sizes that differ, a black picture.
pub(crate) fn brought(scene: &Scene, plan: &StudyPlan, path: &Path, error: Option<&Path>) -> Result<Truth, StudyError> {
    let picture = read_picture(path)?;
    let noise = error.map(read_picture).transpose()?;
    let mask = or_everywhere(luminaires_unseen(scene, plan));
    // Tells sizes that differ, before the ladders are run.
    let known = noise.is_some();
    let noise = noise.unwrap_or_else(|| picture.scaled(0.0));
    let black = mask.scaled(0.0);
    relative_rms(&black, &picture, Some(&mask), Some(&noise))?;
    let own = relative_rms(&noise.plus(&picture).unwrap_or_else(|| picture.clone()), &picture, Some(&mask), None)?;
    Ok(Truth {
        noise,
        mask,
        made: Made {
            by: path.display().to_string(),
            effort: "brought by the user".into(),
            seconds: 0.0,
            error: known.then_some(own),
        },
        kept: true,
        files: [Some(path), error].into_iter().flatten().map(Path::to_path_buf).collect(),
        ..Truth::of(picture, "")
    })
}

/// 1 in pixels none of whose camera rays meets a luminaire.
fn luminaires_unseen(scene: &Scene, plan: &StudyPlan) -> Picture {
    let rays = Rays::new(scene);
    let settings = TraceSettings { next_event: NextEvent::Off, max_bounces: 0, seed: plan.seed };
    let transports = scene.transports(plan.transport);
    let mut tracer = Tracer::new(scene, &rays, &transports, plan.size, &settings);
    tracer.pass(LOOKS);
    tracer.mask()
}
