//! Speed against accuracy: what each way to a picture costs, and the error it reaches.
//!
//! Ladders are run from coarse to fine: the tolerance; patches, rays and samples one at a time, the others fine;
//! progressive shooting; the path tracer. Every picture is then held against a reference made by another method with far
//! more effort: patch methods against the path tracer, the path tracer against a tightly solved patch picture. The
//! reference's own noise is subtracted:
//!
//! ```text
//! reached error = sqrt( max(0, mean(d² - se²)) / mean(R²) )     over pixels that see no luminaire, and channels
//! its range     = the same with mean(d² - se²) ± 2 standard errors of that mean, from its spread over the pixels
//! ```
//!
//! Seconds run from the scene's files to the picture in memory. Not handled: series that diverge; errors of the reference
//! that its standard error does not show (what a patch picture is off in the mean: its estimated error is stated).

#[cfg(feature = "plot")]
pub(crate) mod figures;
pub(crate) mod ladders;
pub(crate) mod sources;
pub(crate) mod store;
pub(crate) mod truth;

#[cfg(feature = "plot")]
pub use figures::{asked_chart, error_chart, points_table, seconds_bars};
pub use ladders::TOLERANCES;
pub use sources::Brought;
pub use store::{Kept, Key};
pub use truth::{Made, Reached, Truth, reached};

use std::path::PathBuf;

use crate::light::Transport;
use crate::pictures::{ImageError, MetricError, Picture, WriteError};
use crate::render::{Seconds, Watch};
use crate::scene::Scene;
use crate::solve::Diverges;
use crate::study::statistics::log_slope;

/// What is varied on the way to a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ladder {
    /// The error asked for.
    Tolerance,
    /// The number of patches.
    Patches,
    /// Rays a patch.
    Rays,
    /// Rays a pixel.
    Samples,
    /// Progressive shooting with rays, everything finer together.
    Shooting,
    /// Samples of the path tracer, next event on.
    Paths,
}

impl Ladder {
    /// All six.
    pub const ALL: [Ladder; 6] =
        [Ladder::Tolerance, Ladder::Patches, Ladder::Rays, Ladder::Samples, Ladder::Shooting, Ladder::Paths];

    /// As in the report, tables and legends.
    pub fn name(self) -> &'static str {
        match self {
            Ladder::Tolerance => "tolerance",
            Ladder::Patches => "patches alone",
            Ladder::Rays => "rays alone",
            Ladder::Samples => "samples alone",
            Ladder::Shooting => "shooting",
            Ladder::Paths => "path tracing",
        }
    }
}

/// What is run, and within which limits.
#[derive(Clone, Debug)]
pub struct Plan {
    /// (alpha, tau) of every material that has none of its own.
    pub transport: Transport,
    /// Width and height of the pictures.
    pub size: (usize, usize),
    /// Seconds that each of the two references may take; bounds the steps of the ladders as well.
    pub seconds: f64,
    /// Chooses sample points.
    pub seed: u32,
    /// Seconds that reading the scene took.
    pub load: f64,
    /// Where references are kept.
    pub store: PathBuf,
    /// What to run.
    pub ladders: Vec<Ladder>,
    /// Bytes that K may take: finer steps are left out.
    pub memory: f64,
}

/// One picture's cost and error.
#[derive(Clone, Debug)]
pub struct Point {
    /// What was varied.
    pub ladder: Ladder,
    /// How fine, in words.
    pub effort: String,
    /// The error asked for, where one was.
    pub asked: Option<f64>,
    /// The error estimated while running, where it was.
    pub estimated: Option<f64>,
    /// The error against the reference.
    pub reached: Reached,
    /// Where the time went.
    pub seconds: Seconds,
}

/// Everything measured of one mode.
#[derive(Clone, Debug)]
pub struct Tradeoff {
    /// What the patch methods are held against, and what the path tracer is.
    pub truths: [Truth; 2],
    /// Ladder after ladder, each from coarse to fine.
    pub points: Vec<Point>,
}

/// There is nothing to chart.
#[derive(Debug, thiserror::Error)]
pub enum TradeoffError {
    /// The series diverges.
    #[error(transparent)]
    Diverges(#[from] Diverges),
    /// A reference cannot be read, or not be written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A reference cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The reference does not fit, or it is black.
    #[error(transparent)]
    Metric(#[from] MetricError),
}

impl Tradeoff {
    /// The points of one ladder.
    pub fn of(&self, ladder: Ladder) -> impl Iterator<Item = &Point> {
        self.points.iter().filter(move |p| p.ladder == ladder)
    }

    /// (seconds, reached error) of a ladder.
    pub fn line(&self, ladder: Ladder) -> Vec<(f64, f64)> {
        let place = |p: &Point| (p.seconds.total, p.reached.error);
        self.of(ladder).map(place).collect()
    }

    /// Slope of log error over log seconds; `None` for fewer than two usable points.
    pub fn slope(&self, ladder: Ladder) -> Option<f64> {
        log_slope(&self.line(ladder))
    }

    /// The slope over those points of the tolerance ladder whose tolerance is within `low..=high`.
    pub fn tolerance_slope(&self, (low, high): (f64, f64)) -> Option<f64> {
        let within = |p: &&Point| {
            let factor = 1.0 + 1e-9;
            p.asked.is_some_and(|a| a * factor >= low && a <= high * factor)
        };
        let points = self.of(Ladder::Tolerance).filter(within);
        let line: Vec<_> = points.map(|p| (p.seconds.total, p.reached.error)).collect();
        log_slope(&line)
    }

    /// The least error of a patch method that its reference tells from 0, by two standard errors.
    pub fn least_told(&self) -> Option<f64> {
        let judged = self.points.iter().filter(|p| p.ladder != Ladder::Paths);
        let told = judged.map(|p| {
            let Reached { error, high, .. } = p.reached;
            (high * high - error * error).max(0.0).sqrt()
        });
        told.reduce(f64::min).filter(|&least| least > 0.0)
    }

    /// Numbers of the points that none beats in both time and error, fastest first.
    ///
    /// A point whose error the reference cannot tell from 0 takes no part.
    pub fn front(&self) -> Vec<usize> {
        let place = |&i: &usize| {
            let p = &self.points[i];
            (p.seconds.total, p.reached.error)
        };
        let mut order: Vec<usize> = (0..self.points.len()).filter(|i| place(i).1 > 0.0).collect();
        order.sort_by(|a, b| {
            let (a, b) = (place(a), place(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        let mut least = f64::INFINITY;
        order.retain(|i| {
            let better = place(i).1 < least;
            least = least.min(place(i).1);
            better
        });
        order
    }
}

/// Runs the ladders of one mode, in the order of [`Ladder::ALL`], against references made, or found in the store, or brought by the user.
///
/// # Errors
/// A series that diverges (found before any reference is made), a reference that cannot be read, written or used.
pub fn trade_off(
    scene: &Scene,
    plan: &Plan,
    brought: Option<&Brought>,
    watch: &dyn Watch,
) -> Result<Tradeoff, TradeoffError> {
    let brought = brought.map(|files| crate::study::tradeoff::sources::brought(scene, plan, files));
    let brought = brought.transpose()?;
    let mut runs = Vec::new();
    for ladder in Ladder::ALL.into_iter().filter(|l| plan.ladders.contains(l)) {
        runs.extend(match ladder {
            Ladder::Tolerance => crate::study::tradeoff::ladders::tolerances(scene, plan, watch)?,
            Ladder::Shooting => crate::study::tradeoff::ladders::shooting(scene, plan, watch)?,
            Ladder::Paths => crate::study::tradeoff::ladders::paths(scene, plan, watch),
            knob => crate::study::tradeoff::ladders::one_knob(scene, plan, knob, watch)?,
        });
    }
    let truths = match brought {
        Some(truth) => [truth.clone(), truth],
        None => crate::study::tradeoff::sources::made(scene, plan, watch)?,
    };
    let points = runs.into_iter().map(|run| judged(run, &truths));
    let points = points.collect::<Result<_, MetricError>>()?;
    Ok(Tradeoff { truths, points })
}

/// A picture on its way to be judged.
pub(crate) struct Run {
    ladder: Ladder,
    effort: String,
    asked: Option<f64>,
    estimated: Option<f64>,
    seconds: Seconds,
    picture: Picture,
}

fn judged(run: Run, truths: &[Truth; 2]) -> Result<Point, MetricError> {
    let truth = &truths[usize::from(run.ladder == Ladder::Paths)];
    Ok(Point {
        reached: reached(&run.picture, truth)?,
        ladder: run.ladder,
        effort: run.effort,
        asked: run.asked,
        estimated: run.estimated,
        seconds: run.seconds,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of one ladder at these seconds and errors, the error asked for twice the one reached.
    pub(crate) fn made_up(places: &[(f64, f64)]) -> Tradeoff {
        let point = |&(total, error): &(f64, f64)| Point {
            ladder: Ladder::Tolerance,
            effort: "some".into(),
            asked: Some(2.0 * error),
            estimated: Some(1.5 * error),
            reached: Reached { error, low: error, high: error },
            seconds: Seconds { gather: 0.75 * total, solve: 0.25 * total, total, ..Seconds::default() },
        };
        let truth = Truth::of(Picture::new(1, 1), "nobody");
        Tradeoff { truths: [truth.clone(), truth], points: places.iter().map(point).collect() }
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let found = made_up(&[(1.0, 0.1), (2.0, 0.2), (3.0, 0.0), (4.0, 0.01), (0.5, 0.3)]);
        assert_eq!(found.front(), [4, 0, 3]);
    }

    #[test]
    fn slopes_are_exponents_within_the_tolerances_asked_for() {
        // Tolerances 20 %, 2 % and 0.2 %: slope -1 up to 2 %, -1/2 after it.
        let found = made_up(&[(1.0, 0.1), (10.0, 0.01), (1000.0, 0.001)]);
        let slope = |low, high| found.tolerance_slope((low, high)).unwrap();
        assert!((slope(0.02, 0.2) + 1.0).abs() < 1e-9);
        assert!((slope(0.002, 0.02) + 0.5).abs() < 1e-9);
        assert_eq!(found.tolerance_slope((0.5, 0.6)), None);
    }
}
