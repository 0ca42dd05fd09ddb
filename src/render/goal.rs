//! The requested accuracy of a picture, and what was spent on it.

use std::time::Instant;

use halflight_team::{is_over, would_be_over};

use crate::gather::Limit;
use crate::pictures::Size;
use crate::render::assembly::Seconds;
use crate::render::memory::MemoryLimit;

/// Share of the remaining time that the light on patches may take; the rest is the gather pass's.
const LIGHT: f64 = 2.0 / 3.0;

/// The requested accuracy of a picture, and what it may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PictureGoal {
    /// Relative RMS error of the picture.
    pub tolerance: f64,
    /// Pixels across and down.
    pub size: Size,
    /// When the picture is to be there, whatever is reached by then; no end where there is none.
    pub deadline: Option<Instant>,
    /// Bytes that K may take; patches that are cut anew stay within.
    pub memory: MemoryLimit,
    /// Chooses the scrambling of all points.
    pub seed: u32,
}

/// Rays of a pixel of the gather pass at most, in the mean, at a tolerance of [`COARSE`] or more, where no deadline is
/// given: some five times what the most demanding of four furnished rooms takes at 2 %. Smaller tolerances may take
/// more as their square.
const MOST_RAYS: f64 = 16_384.0;
const COARSE: f64 = 0.02;

impl PictureGoal {
    /// Where the gather pass ends at any error: at the deadline, or else where it took so many rays that more are not
    /// known to help.
    pub(super) fn limit(&self) -> Limit {
        let pixels = (self.size.width * self.size.height) as f64;
        let rays = MOST_RAYS * pixels * (COARSE / self.tolerance).powi(2).max(1.0);
        Limit { deadline: self.deadline, rays: if self.deadline.is_some() { u64::MAX } else { rays as u64 } }
    }

    /// Whether the time is over.
    pub(super) fn is_late(&self) -> bool {
        is_over(self.deadline)
    }

    /// Whether twice what has begun then, and ends now, would end too late.
    pub(super) fn would_be_late(&self, began: Instant) -> bool {
        would_be_over(self.deadline, began, 2.0)
    }

    /// The goal of the light that a picture shows: two thirds of the remaining time are for that.
    pub(super) fn of_light(&self) -> PictureGoal {
        let now = Instant::now();
        let deadline = self.deadline.map(|end| now + end.saturating_duration_since(now).mul_f64(LIGHT));
        PictureGoal { deadline, ..*self }
    }
}

/// What was spent so far.
#[derive(Clone, Default)]
pub(crate) struct Spent {
    pub seconds: Seconds,
    pub rays: u64,
}

impl Spent {
    /// Adds what something else took.
    pub(crate) fn add(&mut self, other: &Spent) {
        self.seconds = self.seconds.plus(&other.seconds);
        self.rays += other.rays;
    }
}

/// What some work gives, and the seconds that it took.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let given = work();
    (given, start.elapsed().as_secs_f64())
}
