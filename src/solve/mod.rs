//! L, the solution of `L = E + K L`, with every bounce `KⁿE` kept apart.
//!
//! [`neumann`] sums the series and refuses where it is proved to diverge; [`explore`] keeps its first terms without
//! asking, for those who study divergence; [`direct`] solves `(I - K) L = E` densely, the oracle for small scenes.
//!
//! [`Shooting`] reaches the same L from the other side: patches shoot what they have not yet passed on, the brightest
//! first, over an assembled K or with rays alone.
//!
//! [`extrapolated`] gives L alone, without its bounces, in far fewer products where the spectral radius is near 1.

mod adjoint;
mod bounce;
mod coarse;
mod direct;
mod extrapolated;
mod neumann;
mod resolvent;
mod shooting;
mod tail;

pub use adjoint::importance;
pub use bounce::{Bounce, measure, norm};
pub use coarse::{average, coarse_terms};
pub use direct::direct;
pub use extrapolated::{Extrapolated, extrapolated};
pub use neumann::{Diverges, Settings, Solution, Verdict, explore, neumann, terms, verdict};
pub use shooting::{
    AssembledShooter, Balance, Column, Emitted, Fate, Foreknowledge, Progress, RaySettings, RayShooter, Sender,
    Shooter, Shooting, ShootingSettings, Surfaces,
};
pub use tail::TailBound;
