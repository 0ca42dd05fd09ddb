//! How near a gather pass to an error is to it, for who waits.
//!
//! Camera rays come first, then the records of indirect light; parts of the error that are not known yet count by their
//! shares.
//!
//! Not handled: what takes how long. Both parts count alike, whichever takes longer: between a third and twice the time
//! of the other in three rooms at 1 and 2 %.

use crate::form_factors::Progress;
use crate::gather::sampling::{EDGES, RATE};

/// How near work to a tolerance is to it.
#[derive(Clone, Copy, Debug)]
pub struct Nearness {
    /// Relative RMS error of what there is, as if all that is to come kept its share; infinite while it is not known.
    pub error: f64,
    /// Share of the work that is done, 0 to 1, by the power of the rays that the error falls as.
    pub done: f64,
}

/// Who is told how far a gather pass is.
#[derive(Clone, Copy)]
pub struct Told<'a> {
    /// Rows of pixels that have their first camera rays.
    pub rows: Progress<'a>,
    /// How near a pass to an error is to it, after each of its rounds.
    pub near: &'a (dyn Fn(Nearness) + Sync),
}

impl Told<'_> {
    /// Nobody.
    pub const NOBODY: Told<'static> = Told { rows: &|_| (), near: &|_| () };
}

/// What a pass may be off by, and who is told how near it is.
#[derive(Clone, Copy)]
pub(crate) struct Nearing<'a> {
    pub told: Told<'a>,
    /// The relative squared error that the pass may make; 0 where it has none to aim at.
    pub squared: f64,
    /// Share of it that camera rays may make.
    pub camera: f64,
}

/// A pass without an error to aim at, of which nobody is told.
#[cfg(test)]
pub(crate) const NOBODY: Nearing<'static> = Nearing { told: Told::NOBODY, squared: 0.0, camera: 0.0 };

impl Nearing<'_> {
    /// Tells the share of the rows of pixels that have their first rays, after one more, also of a pass without an
    /// error.
    pub(crate) fn first(&self, share: f64) {
        (self.told.rows)(1);
        if self.squared > 0.0 {
            self.tell(f64::INFINITY, 0.5 * self.of_camera() * share.min(1.0));
        }
    }

    /// Tells the relative squared error of camera rays, before there are records.
    pub(crate) fn camera(&self, squared: f64) {
        let share = self.camera * self.squared;
        let records = self.squared - share;
        let rays = (share / squared).min(1.0).powf(1.0 / EDGES);
        self.tell(squared.max(share) + records, self.of_camera() * (0.5 + 0.5 * rays));
    }

    /// Tells the relative squared errors of camera rays and of records, which may be `allowed`; the fit between records
    /// is among these once it `is_judged`.
    pub(crate) fn records(&self, [camera, records, allowed]: [f64; 3], is_judged: bool) {
        let rays = (allowed / records).min(1.0).powf(1.0 / RATE);
        let done = if is_judged { rays } else { 0.5 * rays };
        self.tell(camera + records.max(allowed), 0.5 + 0.5 * done);
    }

    /// The part of the work that is the camera's.
    fn of_camera(&self) -> f64 {
        if self.camera < 1.0 { 0.5 } else { 1.0 }
    }

    fn tell(&self, squared: f64, done: f64) {
        (self.told.near)(Nearness { error: squared.sqrt(), done });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn what_is_to_come_counts_by_its_share() {
        let told = Mutex::new(Vec::new());
        let near = |n: Nearness| told.lock().unwrap().push((n.error, n.done));
        let nearing = Nearing { told: Told { near: &near, ..Told::NOBODY }, squared: 0.01, camera: 0.36 };
        nearing.first(0.5);
        nearing.camera(0.36);
        nearing.camera(0.001);
        nearing.records([0.001, 0.039, 0.009], false);
        nearing.records([0.001, 0.001, 0.009], true);
        let told = told.into_inner().unwrap();
        let close = |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).abs() < 1e-12 && (b - d).abs() < 1e-12;
        // Variances fall as rays to the power -3/2 at edges, and to -1.4 in records.
        let times = |share: f64, power: f64| 0.25 * share.powf(1.0 / power);
        assert_eq!(told[0], (f64::INFINITY, 0.125));
        assert!(close(told[1], ((0.36_f64 + 0.0064).sqrt(), 0.25 + times(0.01, 1.5))), "{told:?}");
        assert!(close(told[2], (0.1, 0.5)), "{told:?}");
        assert!(close(told[3], (0.2, 0.5 + times(0.009 / 0.039, 1.4))), "{told:?}");
        assert!(close(told[4], (0.1, 1.0)), "{told:?}");
    }
}
