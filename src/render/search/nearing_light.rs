//! How near a picture to a tolerance is to it: first by its light on patches, then by its gather pass.
//!
//! Not handled: what takes how long. Light on patches counts as a third of the work, whatever it takes (a tenth to two
//! thirds of the time in three rooms at 1 and 2 %); rounds that find errors which earlier ones did not see make the
//! error larger again.

use crate::gather::Nearness;
use crate::light::budget::LIGHT;
use crate::render::assembly::Watch;
use crate::render::search::solved::{Rough, patches_for};

/// Share of the work that light on patches counts as.
const WORK: f64 = 1.0 / 3.0;

/// Tells the relative error of light on patches as a rough picture shows it, which is all that there is so far.
pub(crate) fn near_light(watch: &dyn Watch, error: f64, rough: &Rough, tolerance: f64) {
    let done = WORK / patches_for(error / (LIGHT * tolerance)).max(1.0);
    watch.near(Nearness { error: error.hypot(rough.gathered.error.relative()), done });
}

/// Watches the gather pass of light that is off by some share of the picture.
pub(crate) struct NearingPicture<'a> {
    pub watch: &'a dyn Watch,
    pub light: f64,
}

impl Watch for NearingPicture<'_> {
    fn begin(&self, step: &str, length: u64) {
        self.watch.begin(step, length);
    }

    fn tick(&self, done: u64) {
        self.watch.tick(done);
    }

    fn near(&self, Nearness { error, done }: Nearness) {
        let done = WORK + (1.0 - WORK) * done;
        self.watch.near(Nearness { error: error.hypot(self.light), done });
    }
}
