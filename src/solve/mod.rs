//! L, the solution of `L = E + K L`, with every bounce `KⁿE` kept apart.
//!
//! [`neumann`] sums the series and refuses where it is proved to diverge; [`explore`] keeps its first terms without
//! asking, for those who study divergence; [`direct`] solves `(I - K) L = E` densely, the oracle for small scenes.
//!
//! [`Shooting`] reaches the same L from the other side: patches shoot what they have not yet passed on, the brightest
//! first, over an assembled K or with rays alone.
//!
//! [`extrapolated`] gives L alone, without its bounces, in far fewer products where the spectral radius is near 1.

pub(crate) mod columns;
pub(crate) mod dense;
pub(crate) mod extrapolated;
pub(crate) mod neumann;
pub(crate) mod shooting;
pub(crate) mod tail;
pub(crate) mod two_level;

pub use crate::operator::Source;
pub use columns::{ColumnSolution, TOGETHER, apply_columns, each_bounce, reflected_columns, solve_columns};
pub use dense::direct;
pub use extrapolated::{Extrapolated, extrapolated};
pub(crate) use neumann::powers;
pub use neumann::{
    Bounce, Diverges, Settings, Solution, Verdict, explore, explore_keeping, neumann, norm, terms, verdict,
};
pub use shooting::shooters::{Column, Convergence, Emitted, RaySettings, RayShooter, Sender, Shooter, Surfaces};
pub use shooting::{Progress, Shooting, ShootingSettings};
pub use tail::TailBound;
pub(crate) use two_level::coarse_columns;
pub use two_level::coarse_terms;
