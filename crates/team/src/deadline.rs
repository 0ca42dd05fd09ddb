//! When work is to end; every loop checks it before it goes on. Of several processes all go by one's clock.

use std::time::{Duration, Instant};

use crate::members::agree;

/// The moment so many seconds after a start; none (never) where the clock cannot represent it.
pub fn deadline_after(start: Instant, seconds: f64) -> Option<Instant> {
    start.checked_add(Duration::try_from_secs_f64(seconds).ok()?)
}

/// Whether the time is over; never where there is no deadline.
pub fn is_over(deadline: Option<Instant>) -> bool {
    deadline.is_some_and(|end| agree(|| Instant::now() >= end))
}

/// Whether a step `times` as long as the one that began at `began` and ends now would end after the deadline.
pub fn would_be_over(deadline: Option<Instant>, began: Instant, times: f64) -> bool {
    deadline.is_some_and(|end| agree(|| Instant::now() + began.elapsed().mul_f64(times) > end))
}
