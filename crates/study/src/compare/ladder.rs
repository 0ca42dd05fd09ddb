//! Ladders: a method climbs steps, each finer than the last, and every step is a picture with its cost and its error.
//!
//! `halflight chart` runs [`Ladder::CHARTED`], which vary one setting of the program at a time; `halflight compare`
//! runs [`Ladder::COMPARED`], which give every method the same time.
//!
//! Not handled: how pictures and references are made.

use std::time::Instant;

use serde::{Serialize, Serializer};

use crate::compare::truth::{Reached, Truth, reached};
use crate::statistics::log_slope;
use halflight::light::Transport;
use halflight::pictures::{ImageError, MetricError, Picture, Size};
use halflight::render::{RenderError, Seconds, Unfit, Watch};
use halflight::solve::Diverges;

/// Bounce orders that are compared one by one: n = 0 to this.
pub const ORDERS: usize = 5;

/// The study that pictures are made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Study {
    /// What settings cost: whole pictures, a path tracer's each time it has four times the samples.
    Chart,
    /// Whether methods agree: bounce by bounce, a path tracer's by the clock.
    Compare,
}

impl Study {
    /// Bounce orders that are looked at one by one.
    pub(crate) fn orders(self) -> usize {
        if self == Study::Compare { ORDERS + 1 } else { 0 }
    }

    /// Unshot share, and tail of the series, that count as none next to the errors measured.
    pub(crate) fn rest(self) -> f64 {
        if self == Study::Compare { 2e-5 } else { 1e-4 }
    }
}

/// What is studied, and within which limits.
#[derive(Clone, Copy)]
pub struct StudyPlan<'a> {
    /// What for.
    pub study: Study,
    /// (alpha, tau) of every material that has none of its own.
    pub transport: Transport,
    /// Width and height of the pictures.
    pub size: Size,
    /// Seconds that each ladder, and each reference, may take.
    pub seconds: f64,
    /// Chooses sample points.
    pub seed: u32,
    /// Bytes that K and its solutions may take: steps that need more are left out.
    pub memory: f64,
    /// Seconds that reading the scene took, which count for every picture.
    pub load: f64,
    /// Follows the progress of each step.
    pub watch: &'a dyn Watch,
    /// Called with the name of each step of a comparison that begins.
    pub begins: &'a dyn Fn(&str),
}

/// There is nothing to study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The series diverges.
    #[error(transparent)]
    Diverges(#[from] Diverges),
    /// K of the patches that verdicts need does not fit in memory.
    #[error(transparent)]
    Memory(#[from] Unfit),
    /// A reference cannot be read, or not be written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A reference does not fit, or it is black.
    #[error(transparent)]
    Metric(#[from] MetricError),
}

impl From<RenderError> for StudyError {
    fn from(error: RenderError) -> StudyError {
        match error {
            RenderError::Diverges(diverges) => diverges.into(),
            RenderError::Memory(unfit) => unfit.into(),
        }
    }
}

/// A way to a picture, and what is varied on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The picture to a tolerance; the tolerance is varied.
    Tolerance,
    /// The Neumann series over an assembled K; the number of patches is varied, the rest fine.
    Patches,
    /// The Neumann series over an assembled K; the rays a patch are varied, the rest fine.
    Rays,
    /// The Neumann series over an assembled K; the rays a pixel are varied, the rest fine.
    Samples,
    /// The Neumann series over an assembled K, everything finer together.
    Neumann,
    /// Progressive shooting over an assembled K, everything finer together.
    ShootingAssembled,
    /// Progressive shooting with rays from the shooter and no K, everything finer together.
    ShootingRays,
    /// Path tracing with next-event estimation.
    NextEvent,
    /// Path tracing as in the paper.
    Paths,
}

impl Method {
    /// Whether it solves on patches.
    pub fn is_patchwise(self) -> bool {
        !matches!(self, Method::NextEvent | Method::Paths)
    }
}

/// A method that climbs from coarse to fine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ladder {
    /// As in reports, tables and legends.
    pub name: &'static str,
    /// What climbs.
    pub method: Method,
    /// Steps at most.
    pub steps: u32,
    /// The next step is predicted to take as many times the last as that did the one before, but within these.
    growth: [f64; 2],
    /// A step that is predicted to take more than this share of the plan's seconds is not begun.
    share: f64,
}

const fn ladder(name: &'static str, method: Method, steps: u32, growth: [f64; 2], share: f64) -> Ladder {
    Ladder { name, method, steps, growth, share }
}

impl Ladder {
    /// Setting by setting.
    pub const CHARTED: [Ladder; 6] = [
        ladder("tolerance", Method::Tolerance, 6, [1.0, 3.0], 1.0),
        ladder("patches alone", Method::Patches, 5, [1.0, 4.0], 0.25),
        ladder("rays alone", Method::Rays, 5, [1.0, 4.0], 0.25),
        ladder("samples alone", Method::Samples, 5, [1.0, 4.0], 0.25),
        ladder("shooting", Method::ShootingRays, 8, [1.0, 2.5], 0.25),
        ladder("path tracing", Method::NextEvent, 10, [1.0, 4.0], 0.25),
    ];

    /// Five ways to one picture, each in the same time. A step of a patch method costs some two and a half times the
    /// one before; those of the path tracers end by the clock.
    pub const COMPARED: [Ladder; 5] = [
        ladder("Neumann over K", Method::Neumann, 12, [2.5, 2.5], 1.0),
        ladder("shooting over K", Method::ShootingAssembled, 12, [2.5, 2.5], 1.0),
        ladder("shooting with rays", Method::ShootingRays, 12, [2.5, 2.5], 1.0),
        ladder("path tracing, next event", Method::NextEvent, 6, [0.0, 0.0], 1.0),
        ladder("path tracing", Method::Paths, 6, [0.0, 0.0], 1.0),
    ];
}

/// In reports by its name.
impl Serialize for Ladder {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.name)
    }
}

/// One picture on the way up.
#[derive(Clone, Debug, Default)]
pub struct LadderStep {
    /// How fine, in words.
    pub effort: String,
    /// The requested relative error, where there is one.
    pub requested: Option<f64>,
    /// The relative error estimated while running, where it was.
    pub estimated: Option<f64>,
    /// Where the time went.
    pub seconds: Seconds,
    /// All bounces.
    pub picture: Picture,
    /// Bounces n = 0 to [`ORDERS`], where they are compared one by one.
    pub orders: Vec<Picture>,
}

/// Climbs as long as the next step is predicted to end in time; a step of none, for want of memory, is the end too.
///
/// # Errors
/// What `step` fails with.
pub(crate) fn climb<E>(
    ladder: &Ladder,
    plan: &StudyPlan,
    mut step: impl FnMut(u32) -> Result<Option<LadderStep>, E>,
) -> Result<Vec<LadderStep>, E> {
    let mut steps: Vec<LadderStep> = Vec::new();
    let [least, most] = ladder.growth;
    for k in 0..ladder.steps {
        let predicted = match &steps[..] {
            [] => 0.0,
            [only] => only.seconds.total * least,
            [.., before, last] => last.seconds.total * (last.seconds.total / before.seconds.total).clamp(least, most),
        };
        if predicted > ladder.share * plan.seconds {
            break;
        }
        let Some(mut made) = step(k)? else {
            break;
        };
        made.seconds.load = plan.load;
        made.seconds.sum();
        steps.push(made);
        plan.watch.tick(1);
    }
    Ok(steps)
}

/// Seconds since the clock was last read here.
pub(crate) fn lap(clock: &mut Instant) -> f64 {
    let seconds = clock.elapsed().as_secs_f64();
    *clock = Instant::now();
    seconds
}

/// One picture's cost and error.
#[derive(Clone, Debug, Serialize)]
pub struct LadderPoint {
    /// What climbed.
    #[serde(rename = "method")]
    pub ladder: Ladder,
    /// How fine, in words.
    pub effort: String,
    /// The requested error; null where effort was given.
    #[serde(rename = "asked")]
    pub requested: Option<f64>,
    /// The error estimated while running; null where none was.
    pub estimated: Option<f64>,
    /// The error against the reference.
    #[serde(flatten)]
    pub reached: Reached,
    /// Relative RMS errors of the bounce orders looked at; none where the reference is black.
    #[serde(skip)]
    pub orders: Vec<Option<f64>>,
    /// Where the time went.
    pub seconds: Seconds,
    /// Whether no other picture of the study is both faster and better.
    pub on_front: bool,
}

/// Holds a step against references: of the whole picture, then of each order.
///
/// # Errors
/// A reference of another size, or a black one; values that are not finite.
pub(crate) fn measured(ladder: &Ladder, step: LadderStep, truths: &[Truth]) -> Result<LadderPoint, MetricError> {
    let orders = step.orders.iter().zip(&truths[1..]);
    Ok(LadderPoint {
        reached: reached(&step.picture, &truths[0])?,
        orders: orders.map(|(picture, truth)| Some(reached(picture, truth).ok()?.error)).collect(),
        ladder: *ladder,
        effort: step.effort,
        requested: step.requested,
        estimated: step.estimated,
        seconds: step.seconds,
        on_front: false,
    })
}

/// Slope of log error over log seconds; `None` for fewer than two usable points.
pub fn slope<'a>(points: impl IntoIterator<Item = &'a LadderPoint>) -> Option<f64> {
    let line: Vec<_> = points.into_iter().map(|p| (p.seconds.total, p.reached.error)).collect();
    log_slope(&line)
}
