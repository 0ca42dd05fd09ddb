//! A picture by a deadline: coarse first, then as near as what that took lets expect.
//!
//! Rounds of work cannot be stopped half way, and how long one takes is not known before. So a first picture at a
//! tolerance of 10 % shows what the scene takes on this machine, and the next is aimed at what fits in the time that is
//! left. Every picture states its own error, and the best one counts. Where the time suffices the last one is the
//! picture that there would be without a deadline, bit by bit.
//!
//! Not handled: keeping patches or rays of one picture for the next; a deadline so near that not even the first picture
//! is there by then.

use std::time::{Duration, Instant};

use crate::render::assembly::Discretization;
use crate::render::fineness::Fineness;
use crate::render::goal::PictureGoal;
use crate::render::rendered::{Ended, Rendered};
use crate::render::search::rounds::render_to_tolerance;
use crate::render::search::solved::Task;
use crate::solve::Diverges;

/// Tolerance of the first picture, at most as fine.
const COARSE: f64 = 0.1;
/// Work grows as this power of 1 / tolerance: noise of rays falls as the root of their number, and all else falls
/// faster.
const POWER: f64 = 2.0;
/// A tolerance that is not smaller by this factor is not worth another picture.
const GAIN: f64 = 0.7;

/// Renders one mode to a tolerance, beginning with the patches of `first`, which are cut for it. With a deadline the
/// picture is the best one that could be finished by then, and at least one at a tolerance of 10 %.
///
/// # Errors
/// [`Diverges`] where the series does.
pub(crate) fn render_by_deadline(first: &Discretization, task: &Task) -> Result<Rendered, Diverges> {
    let goal = task.goal;
    let Some(deadline) = goal.deadline else {
        return render_to_tolerance(first, task);
    };
    let mut now = PictureGoal { tolerance: goal.tolerance.max(COARSE), ..*goal };
    let mut best: Option<Rendered> = None;
    loop {
        let clock = Instant::now();
        let coarser = now.tolerance > goal.tolerance;
        let cut = coarser.then(|| first.cut(Fineness::first(now.tolerance).patches));
        let found = render_to_tolerance(cut.as_ref().unwrap_or(first), &Task { goal: &now, ..*task })?;
        let left = deadline.saturating_duration_since(Instant::now());
        let next = next_tolerance(now.tolerance, goal.tolerance, clock.elapsed(), left);
        let found = match best.take() {
            Some(before) => before.or(found),
            None => found,
        };
        let Some(tolerance) = next else {
            let short = coarser || goal.is_late();
            return Ok(Rendered { ended: if short { Ended::ByTime } else { found.ended }, ..found });
        };
        now.tolerance = tolerance;
        best = Some(found);
    }
}

/// The tolerance that the time left suffices for, after a picture at some tolerance took so long; none where that gains
/// little, or nothing more is requested.
fn next_tolerance(tolerance: f64, goal: f64, took: Duration, left: Duration) -> Option<f64> {
    let affordable = tolerance * (took.as_secs_f64() / left.as_secs_f64().max(f64::MIN_POSITIVE)).powf(1.0 / POWER);
    let next = affordable.max(goal);
    (tolerance > goal && (next == goal || next < GAIN * tolerance)).then_some(next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_tolerance_fits_in_the_time_left() {
        let next = |goal, took, left| {
            let [took, left] = [took, left].map(Duration::from_secs_f64);
            next_tolerance(0.1, goal, took, left)
        };
        // A hundred times the time is a tenth of the error.
        assert!((next(0.001, 1.0, 100.0).unwrap() - 0.01).abs() < 1e-12);
        // No finer than requested, and that even where it gains little.
        assert_eq!(next(0.02, 1.0, 100.0), Some(0.02));
        assert_eq!(next(0.09, 1.0, 2.0), Some(0.09));
        // What would take longer than is left, or gain little, is not begun.
        assert_eq!(next(0.001, 1.0, 0.5), None);
        assert_eq!(next(0.001, 1.0, 0.0), None);
        assert_eq!(next(0.001, 1.0, 1.5), None);
        assert_eq!(next(0.1, 1.0, 100.0), None);
    }
}
