//! What a picture costs by how it reads light, against what it costs to solve for light that may be read at once.
//!
//! Patches can be divided until the mean of each will do where a ray ends, but each round of that takes twice the paths
//! of the one before. A gather pass that makes less noise next to a larger error of the light, or follows another ray
//! first, pays at every ray instead. Which is the cheaper depends on how many rays it takes: few where indirect light
//! is even, or the tolerance large. It is extrapolated from a rough picture, whose noise and rays are known.
//!
//! Costs only choose between ways to the same accuracy, so it is enough that they are about right: rays predicted in
//! three furnished rooms at 5 and 2 % are within a factor of 2.3 of those cast.
//!
//! Not handled: noise that one more ray adds to what a ray reads.

use crate::gather::GatherError;
use crate::gather::pixels::adaptive_sampling::EDGES;
use crate::gather::records::record_rays::RATE;
use crate::light::budget::{CAMERA, HEMISPHERE_SQUARED, LIGHT, left};
use crate::reading::{READINGS, Reading};
use crate::render::goal::PictureGoal;
use crate::render::search::solved::{ROUGH_RAYS, Rough};

/// Errors of the light that are all too large matter where one is so many times another.
pub(crate) const MATTERS: f64 = 1.5;
/// What a hemisphere ray takes over a ray of a path, which knows nothing of records: 1.5 us against 0.7 in a bathroom
/// of 367,161 triangles; and what a predicted camera ray does with its rays to lamps, 0.4 us each: rays go where the
/// noise is, and a third to an eighth of those predicted are cast there and in two more rooms.
const HEMISPHERE_RAY: f64 = 2.0;
const CAMERA_RAY: f64 = 0.5;
/// Doublings of the rays of F at most, in one go.
const DENSER: u32 = 5;

/// A way to read light, and what a picture takes with it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Priced {
    pub reading: Reading,
    /// In rays of paths; infinite where the light is off by too much.
    pub rays: f64,
}

/// The predicted rays of a gather pass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReadingCost {
    tolerance: f64,
    /// Rays of the camera, and of hemispheres, that leave noise as large as the picture.
    camera: f64,
    hemisphere: f64,
    /// By reading: rays that a hemisphere ray takes until it has read.
    prices: [f64; READINGS],
}

impl ReadingCost {
    /// The cost of a requested picture, from the error of a rough one of the same light and the price of hemisphere
    /// rays.
    pub fn new(rough: &Rough, goal: &PictureGoal, prices: [f64; READINGS]) -> ReadingCost {
        ReadingCost::of(&rough.gathered.error, rough.camera, goal, prices)
    }

    /// The same from the error that so many camera rays of each pixel left.
    fn of(rough: &GatherError, rays: u32, goal: &PictureGoal, prices: [f64; READINGS]) -> ReadingCost {
        let pixels = (goal.size.width * goal.size.height) as f64;
        let [camera, hemisphere] = [rough.camera, rough.hemisphere].map(|rms| rough.share(rms));
        ReadingCost {
            tolerance: goal.tolerance,
            camera: pixels * f64::from(rays) * camera.powf(2.0 / EDGES),
            hemisphere: pixels * f64::from(ROUGH_RAYS) * hemisphere.powf(2.0 / RATE),
            prices,
        }
    }

    /// The reading that a picture is the cheapest with, by the squared error of each; where all errors are too large,
    /// the cheapest of those whose error is not [`MATTERS`] times the least.
    pub fn cheapest(&self, squared: [f64; READINGS]) -> Priced {
        let of = |reading: &Reading| squared[reading.number()];
        let most = (LIGHT * self.tolerance).powi(2);
        let rays =
            |reading: Reading| if of(&reading) <= most { self.rays(of(&reading), reading) } else { f64::INFINITY };
        let priced = Reading::ALL.map(|reading| Priced { reading, rays: rays(reading) });
        let best = priced.into_iter().min_by(|a, b| a.rays.total_cmp(&b.rays)).expect("there are readings");
        if best.rays.is_finite() {
            return best;
        }
        let least = squared.into_iter().fold(f64::INFINITY, f64::min);
        let near = priced.into_iter().find(|priced| of(&priced.reading) <= MATTERS * MATTERS * least);
        near.unwrap_or(best)
    }

    /// By how many times more rays F is worth casting with, which `took` some and left `noise` relative to the picture:
    /// they are few next to those of a gather pass that makes up for it.
    pub fn denser(&self, took: f64, noise: f64) -> u32 {
        let all = |times: u32| f64::from(times) * took + self.rays(noise * noise / f64::from(times), Reading::AtOnce);
        let times = (0..=DENSER).map(|k| 1 << k);
        times.min_by(|&a, &b| all(a).total_cmp(&all(b))).expect("1 is among them")
    }

    /// What a pass takes next to a squared error of the light, relative to the picture, that is read in a way; in rays
    /// of paths.
    fn rays(&self, squared: f64, reading: Reading) -> f64 {
        let variance = left(self.tolerance, squared).powi(2);
        let camera = self.camera * (CAMERA * CAMERA * variance).powf(-1.0 / EDGES);
        let hemisphere = self.hemisphere * (HEMISPHERE_SQUARED * variance).powf(-1.0 / RATE);
        CAMERA_RAY * camera + HEMISPHERE_RAY * hemisphere * self.prices[reading.number()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(hemisphere: f64, tolerance: f64) -> ReadingCost {
        let error = GatherError { camera: 0.3, hemisphere, fit: 0.0, signal: 1.0 };
        let goal = PictureGoal { tolerance, size: (100, 100).into(), deadline: None, memory: f64::INFINITY, seed: 0 };
        ReadingCost::of(&error, 2, &goal, std::array::from_fn(|k| 1.0 + k as f64))
    }

    /// Twice the noise takes 2^(2/1.4) times the hemisphere rays, and so does half the tolerance.
    #[test]
    fn rays_go_as_the_noise_over_what_is_left_of_the_tolerance() {
        let hemisphere = |cost: ReadingCost| cost.rays(0.0, Reading::ALL[1]) - cost.rays(0.0, Reading::AtOnce);
        let times = 2.0_f64.powf(2.0 / RATE);
        let first = hemisphere(cost(0.03, 0.02));
        assert!((hemisphere(cost(0.06, 0.02)) / first / times - 1.0).abs() < 1e-9);
        assert!((hemisphere(cost(0.03, 0.01)) / first / times - 1.0).abs() < 1e-9);
    }

    /// F is cast once a round, the gather pass once a picture.
    #[test]
    fn f_is_cast_with_more_rays_where_the_gather_pass_pays_for_its_noise() {
        let times = |took: f64, noise: f64| cost(0.03, 0.02).denser(took, noise);
        // Rays that cost nothing are worth casting, and those that leave nothing to lessen are not.
        assert_eq!([times(0.0, 0.01), times(0.0, 0.0), times(1e12, 0.01)], [1 << DENSER, 1, 1]);
        let between = times(2e4, 0.01);
        assert!(1 < between && between < 1 << DENSER, "{between}");
    }

    /// Of errors that are small enough the price decides, else the error.
    #[test]
    fn a_dearer_reading_is_taken_where_it_leaves_so_much_more_of_the_tolerance() {
        let chosen = |plain: f64, asked: f64| {
            let mut squared = [1.0; READINGS];
            (squared[0], squared[1]) = ((plain * 0.02_f64).powi(2), (asked * 0.02_f64).powi(2));
            let found = cost(0.03, 0.02).cheapest(squared);
            (found.reading.number(), found.rays.is_finite())
        };
        assert_eq!(chosen(0.6, 0.3), (0, true));
        assert_eq!(chosen(0.8, 0.3), (1, true));
        assert_eq!(chosen(0.9, 0.8), (1, true));
        // Of those that are all too large what matters.
        assert_eq!([chosen(0.95, 0.9), chosen(1.9, 0.9)], [(0, false), (1, false)]);
    }
}
