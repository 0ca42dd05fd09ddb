//! What each method does on both sides of the frontier, at one tau: along alpha = share / radius(1, tau).
//!
//! [`runs`] follows the Neumann series, its proved tail bound and its true tail, the extrapolated solve and progressive
//! shooting; [`formal`] solves (I - K) L = E beyond the frontier; [`scaling`] measures the path tracer's error.
//!
//! Not handled: scenes whose frontier lies beyond alpha = 1 at this tau.

pub(crate) mod charts;
pub(crate) mod series;
pub(crate) mod spread;

pub use charts::{series_chart, shooting_chart, spread_chart};
pub use series::{Approach, SeriesRun, Shot, Timing, runs};
pub use series::{Formal, check_dense, formal};
pub use series::{Slice, at};
pub use spread::{Scaling, Spread, Traced, scaling};
