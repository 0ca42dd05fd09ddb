//! One tau of a scene's stability map: where both frontiers lie along alpha, and the scene at any point.
//!
//! Not handled: the whole map ([`map`](crate::study::map::map)).

use crate::form_factors::Sampling;
use crate::light::Transport;
use crate::render::{Prepared, Watch};
use crate::scene::Scene;
use crate::study::map::Survey;

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

/// Where the frontiers lie at one tau.
pub struct Slice {
    /// Factor on every tau.
    pub tau: f64,
    /// The mean diverges beyond: 1 over the spectral radius at alpha = 1.
    pub alpha_c: f64,
    /// The path tracer's variance is infinite beyond.
    pub alpha_variance: f64,
    /// Upper bound on the spectral radius at alpha = 1.
    pub radius: f64,
    survey: Survey,
}

impl Slice {
    /// Casts the rays, and finds both frontiers from the middle of their bounds.
    pub fn new(p: &Prepared, tau: f64, sampling: &Sampling, watch: &dyn Watch) -> Slice {
        let survey = Survey::new(p, sampling, watch);
        let radius = survey.spectrum(tau, &survey.start()).worst();
        let squares = survey.moment(tau, 2.0, &survey.start()).worst();
        Slice {
            tau,
            alpha_c: 2.0 / (radius.lower + radius.upper),
            alpha_variance: (2.0 / (squares.lower + squares.upper)).sqrt(),
            radius: radius.upper,
            survey,
        }
    }

    /// x of the path tracer's predicted error ~ N^x at this alpha: -(1 - 1/p) for a weight with a tail of index p.
    pub fn exponent(&self, alpha: f64) -> f64 {
        1.0 / self.survey.tail_index(alpha, self.tau).unwrap_or(2.0) - 1.0
    }
}
