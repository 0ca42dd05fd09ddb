//! Spots of narrow light: what walks of light bring and the points of patches missed gets points of its own.
//!
//! Not handled: patches divided by light.

use crate::error::landings::Landings;
use crate::render::assembly::{Assembled, Discretization};
use crate::render::goal::{PictureGoal, Spent, timed};

/// Times that spots are found.
const TIMES: u32 = 3;

/// Walks that look for what patches miss.
#[derive(Default)]
pub(crate) struct NarrowLight {
    landings: Option<Landings>,
    times: u32,
}

impl NarrowLight {
    /// Patches that receive what a mode on these patches has missed as well; none where nothing is known to be missed.
    pub(crate) fn mend(
        &mut self,
        p: &Discretization,
        mode: &Assembled,
        goal: &PictureGoal,
        spent: &mut Spent,
    ) -> Option<Discretization> {
        if self.times == TIMES || p.patches.are_divided() || goal.is_late() {
            return None;
        }
        let look = || {
            let follow = || Landings::new(&mode.lights, mode.transport, goal.tolerance, goal.seed);
            let landings = self.landings.get_or_insert_with(|| {
                let found = follow();
                spent.rays += found.rays;
                found
            });
            let spots = landings.missed(&p.patches, |i| mode.direct_power(i));
            (!spots.is_empty()).then(|| p.with_spots(&spots))
        };
        let (found, seconds) = timed(look);
        spent.seconds.patches += seconds;
        self.times += u32::from(found.is_some());
        found
    }
}
