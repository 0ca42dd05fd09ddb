//! L, the solution of `L = E + K L`, with every bounce `KⁿE` kept apart.
//!
//! [`neumann`] sums the series and refuses where it is proved to diverge; [`explore`] keeps its first terms without
//! asking, for those who study divergence; [`direct`] solves `(I - K) L = E` densely, the oracle for small scenes.
//!
//! Not handled: acceleration of the series.

mod bounce;
mod direct;
mod neumann;

pub use bounce::{Bounce, TailBound, measure, norm};
pub use direct::direct;
pub use neumann::{Diverges, Settings, Solution, Verdict, explore, neumann, terms, verdict};
