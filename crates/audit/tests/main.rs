//! Audits against closed forms, against the path tracer, and against pictures that are wrong in a known way.

mod closed_forms;
mod known_faults;
mod witness;

use halflight::light::{Mode, Transport};
use halflight::pictures::Picture;
use halflight::render::Silent;
use halflight::scene::Scene;
use halflight_audit::{Audit, AuditGoal, Estimated, audit};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// The audit of a picture with one number of samples: all there are after the first round, or more as a share asks for.
pub fn told(scene: &Scene, transport: Transport, picture: &Picture, resolve: f64, seed: u32) -> Audit {
    let goal = AuditGoal { resolve, tolerance: 0.01, seed, ..AuditGoal::default() };
    audit(scene, transport, picture, &goal, &Silent).expect("an audit")
}

/// How many standard errors an estimate is from what is true.
pub fn score(found: Estimated, truth: f64) -> f64 {
    (found.value - truth) / found.standard_error
}

/// Holds scores against the standard normal distribution: their sum and the sum of their squares, each within what has
/// a probability of 1 - 2e-5. Standard errors may be stated too large by the share `cautious` and not too small.
#[track_caller]
pub fn assert_standard_normal(scores: &[f64], cautious: f64) {
    let n = scores.len() as f64;
    let mean = scores.iter().sum::<f64>() / n.sqrt();
    assert!(mean.abs() < 4.3, "the sum of {scores:?} is {mean} standard deviations from 0");
    let squares: f64 = scores.iter().map(|z| z * z).sum();
    let distribution = ChiSquared::new(n).expect("degrees of freedom");
    let [low, high] = [1e-5, 1.0 - 1e-5].map(|p| distribution.inverse_cdf(p));
    assert!(squares < high, "{scores:?}: the sum of squares {squares} is above {high}");
    assert!(squares > low / (1.0 + cautious).powi(2), "{scores:?}: the sum of squares {squares} is far below {low}");
}

/// A built-in scene, and global illumination.
pub fn global(name: &str) -> (Scene, Transport) {
    (Scene::open(name).expect("a built-in scene"), Mode::Global.transport())
}
