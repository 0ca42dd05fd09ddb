//! When work is to end: questions that every loop asks before it goes on.

use std::time::{Duration, Instant};

/// The moment so many seconds after a start; none where they are too many for the clock to tell, which is never.
pub(crate) fn deadline_after(start: Instant, seconds: f64) -> Option<Instant> {
    start.checked_add(Duration::try_from_secs_f64(seconds).ok()?)
}

/// Whether the time is over; never where there is no deadline.
pub(crate) fn is_over(deadline: Option<Instant>) -> bool {
    deadline.is_some_and(|end| Instant::now() >= end)
}

/// Whether what takes so many times as long as what has begun then, and ends now, would end too late.
pub(crate) fn would_be_over(deadline: Option<Instant>, began: Instant, times: f64) -> bool {
    deadline.is_some_and(|end| Instant::now() + began.elapsed().mul_f64(times) > end)
}
