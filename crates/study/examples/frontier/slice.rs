//! One tau of a scene's stability map: where both frontiers lie along alpha, and the equation at any alpha.
//!
//! Not handled: the whole map ([`map`](halflight_study::map::map)).

use crate::common::{Failure, too_large};
use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::light::Transport;
use halflight::render::{Assembled, Silent, usable_memory};
use halflight::scene::Scene;
use halflight_study::map::{Survey, at, check_crossings};

/// A scene at one tau.
pub struct Slice {
    /// Its materials as the files have them.
    pub scene: Scene,
    /// Factor on every tau.
    pub tau: f64,
    /// Patches, about, as requested, and as cut.
    pub patches: [usize; 2],
    /// The rays of each patch.
    pub sampling: Sampling,
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
    pub fn new(scene: Scene, tau: f64, patches: usize, sampling: Sampling) -> Result<Slice, Failure> {
        let p = Solver::new(&scene).cut(patches);
        check_crossings(&p, &sampling, 1, usable_memory()).map_err(too_large)?;
        let survey = Survey::new(&p, &sampling, &Silent);
        let radius = survey.spectrum(tau, &survey.start()).worst();
        let squares = survey.moment(tau, 2.0, &survey.start()).worst();
        let alpha_c = 2.0 / (radius.lower + radius.upper);
        let alpha_variance = (2.0 / (squares.lower + squares.upper)).sqrt();
        let patches = [patches, p.patches.len()];
        Ok(Slice { scene, tau, patches, sampling, alpha_c, alpha_variance, radius: radius.upper, survey })
    }

    /// The scene at this alpha.
    pub fn at(&self, alpha: f64) -> Scene {
        at(&self.scene, alpha, self.tau)
    }

    /// `L = E + K L` at this alpha, always on patches and rays of one seed.
    pub fn equations(&self, alpha: f64) -> Assembled {
        let p = Solver::new(&self.at(alpha)).cut(self.patches[0]);
        p.assemble(&[Transport::default()], &self.sampling, &Silent).0.remove(0)
    }

    /// x of the path tracer's predicted error ~ N^x at this alpha: -(1 - 1/p) for a weight with a tail of index p.
    pub fn exponent(&self, alpha: f64) -> f64 {
        1.0 / self.survey.tail_index(alpha, self.tau).unwrap_or(2.0) - 1.0
    }
}
