//! What each method does on both sides of the frontier, at one tau: along alpha = share / radius(1, tau).
//!
//! [`runs`] follows the Neumann series, its proved tail bound and its true tail, the extrapolated solve and progressive
//! shooting; [`formal`] solves (I - K) L = E beyond the frontier; [`scaling`] measures the path tracer's error.
//!
//! Not handled: scenes whose frontier lies beyond alpha = 1 at this tau.

pub(crate) mod charts;
pub(crate) mod formal;
pub(crate) mod series;
pub(crate) mod spread;

pub use charts::{series_chart, shooting_chart, spread_chart};
pub use formal::{Formal, check_dense, formal};
pub use series::{Run, Shot, Timing, runs};
pub use spread::{Scaling, Spread, scaling};

use crate::light::Transport;
use crate::scene::Scene;

/// The scene with every own alpha and tau (1 where a material has none) times these: a point of its stability map.
pub fn at(scene: &Scene, alpha: f64, tau: f64) -> Scene {
    let own = scene.transports(Transport { alpha: 1.0, tau: 1.0 });
    let mut scaled = scene.clone();
    for (material, own) in scaled.materials.iter_mut().zip(own) {
        material.alpha = Some((alpha * f64::from(own.alpha)) as f32);
        material.tau = Some((tau * f64::from(own.tau)) as f32);
    }
    scaled
}
