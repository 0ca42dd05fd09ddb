//! Whether a picture agrees with walks of light, which come from the other side and share nothing with it
//! ([`crate::error::light_tracing`]).
//!
//! Where they do not, by more than chance explains and by more than is stated, the error is what they show. Walks take
//! a small share of the picture's rays.
//!
//! Not handled: what to mend; the picture stays as it is.

use crate::error::light_tracing::{AtLeast, TracingGoal, traced_parts};
use crate::gather::Gathered;
use crate::render::goal::PictureGoal;
use crate::render::search::solved::Solved;

/// Rays of the picture to one walk, which takes some six.
const RAYS: u64 = 100;

/// The least error of a gathered picture by walks of light, and the rays that these took.
pub(crate) fn least_error(solved: &Solved, gathered: &Gathered, goal: &PictureGoal, cast: u64) -> (AtLeast, u64) {
    let view = solved.view(goal);
    // What is mirrored is no part of these walks, and no camera looks at a map.
    let is_map = view.atlas.is_some();
    if is_map || goal.is_late() || view.scene.materials.iter().any(|material| material.gloss.is_some()) {
        return (AtLeast::default(), 0);
    }
    let goal = TracingGoal { size: goal.size, walks: cast / RAYS, terms: solved.terms(), seed: goal.seed };
    let traced = traced_parts(&view, solved.mode.transport, &goal);
    let total = gathered.total();
    let reflected = |k: usize| (total.pixels[k] - gathered.emission.pixels[k]).as_dvec3();
    (traced.error_of(reflected), traced.rays)
}
