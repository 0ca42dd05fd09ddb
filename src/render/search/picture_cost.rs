//! What a picture costs beside an error of the light, against what it costs to solve for light that is off by less.
//!
//! Patches can be divided further, but each round of that takes twice the paths of the one before; a gather pass that
//! makes less noise beside a larger error of the light pays at every ray instead. Which is the cheaper depends on how
//! many rays it takes: few where indirect light is even, or the tolerance large. It is extrapolated from a rough
//! picture, whose noise and rays are known, and so is the share of the error that camera rays are to make.
//!
//! Costs only choose between ways to the same accuracy, so it is enough that they are about right: rays predicted in
//! three furnished rooms at 5 and 2 % are within a factor of 2.3 of those cast.
//!
//! Not handled: rays that interpolation between records saves.

use crate::gather::GatherError;
use crate::gather::sampling::{EDGES, RATE};
use crate::light::budget::{CAMERA, FIT_SQUARED, LIGHT, left};
use crate::render::goal::PictureGoal;
use crate::render::search::solved::{ROUGH_RAYS, Rough};

/// What a hemisphere ray takes over a ray of a path, which knows nothing of records: 1.5 us against 0.7 in a bathroom
/// of 367,161 triangles; and what a predicted camera ray does: rays go where the noise is, and a third to an eighth of
/// those predicted are cast there and in two more rooms.
const HEMISPHERE_RAY: f64 = 2.0;
const CAMERA_RAY: f64 = 0.2;
/// Halvings of the interval that the best share lies in.
const HALVINGS: usize = 20;
/// Doublings of the rays of F at most, in one go.
const DENSER: u32 = 5;

/// What a picture takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Priced {
    /// In rays of paths; infinite where the light is off by too much.
    pub rays: f64,
    /// Share of the squared error of the gather pass that camera rays are to make.
    pub camera: f64,
}

/// The predicted rays of a gather pass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PictureCost {
    tolerance: f64,
    /// Rays of the camera, and of hemispheres, that leave noise as large as the picture.
    camera: f64,
    hemisphere: f64,
    /// Rays that a hemisphere ray takes until it has read.
    price: f64,
    /// Rays that a camera ray takes with those to luminaires and punctual lights.
    camera_ray: f64,
}

impl PictureCost {
    /// The cost of a requested picture, from the error of a rough one of the same light and the price of hemisphere
    /// rays.
    pub(crate) fn new(rough: &Rough, goal: &PictureGoal, price: f64) -> PictureCost {
        let Rough { gathered, camera, camera_ray } = rough;
        PictureCost { camera_ray: *camera_ray, ..PictureCost::of(&gathered.error, *camera, goal, price) }
    }

    /// The cost by the error that so many camera rays of each pixel left.
    fn of(rough: &GatherError, rays: u32, goal: &PictureGoal, price: f64) -> PictureCost {
        let pixels = (goal.size.width * goal.size.height) as f64;
        let [camera, hemisphere] = [rough.camera, rough.hemisphere].map(|rms| rough.share(rms));
        PictureCost {
            tolerance: goal.tolerance,
            camera: pixels * f64::from(rays) * camera.powf(2.0 / EDGES),
            hemisphere: pixels * f64::from(ROUGH_RAYS) * hemisphere.powf(2.0 / RATE),
            price,
            camera_ray: 1.0,
        }
    }

    /// What a picture takes with a squared error of the light, relative to the picture.
    pub(crate) fn priced(&self, squared: f64) -> Priced {
        let own = self.beside(squared);
        if squared <= (LIGHT * self.tolerance).powi(2) { own } else { Priced { rays: f64::INFINITY, ..own } }
    }

    /// By how many times more rays F is worth casting with, which `took` some and left `noise` relative to the picture:
    /// they are few next to those of a gather pass that makes up for it.
    pub(crate) fn denser(&self, took: f64, noise: f64) -> u32 {
        let all = |times: u32| f64::from(times) * took + self.beside(noise * noise / f64::from(times)).rays;
        let times = (0..=DENSER).map(|k| 1 << k);
        times.min_by(|&a, &b| all(a).total_cmp(&all(b))).expect("1 is among them")
    }

    /// What a pass takes beside a squared error of the light, however large, relative to the picture. Camera rays make
    /// the share s of its variance for which all rays together are least: of `a s^(-1/p) + b (1-s)^(-1/q)` that is
    /// where both terms are as `p s` to `q (1-s)`.
    fn beside(&self, squared: f64) -> Priced {
        let variance = left(self.tolerance, squared).powi(2);
        let [mut low, mut high] = CAMERA;
        for _ in 0..HALVINGS {
            let s = 0.5 * (low + high);
            let [camera, hemisphere] = self.parts(s, variance);
            let is_low = camera / (EDGES * s) > hemisphere / (RATE * (1.0 - s));
            *(if is_low { &mut low } else { &mut high }) = s;
        }
        Priced { rays: self.parts(low, variance).iter().sum(), camera: low }
    }

    /// Camera rays that leave a share of a variance, and hemisphere rays that leave the rest beside the fit between
    /// records; in rays of paths.
    fn parts(&self, share: f64, variance: f64) -> [f64; 2] {
        let price = HEMISPHERE_RAY * self.price;
        let rest = (1.0 - FIT_SQUARED) * (1.0 - share) * variance;
        let camera = CAMERA_RAY * self.camera_ray * self.camera * (share * variance).powf(-1.0 / EDGES);
        [camera, price * self.hemisphere * rest.powf(-1.0 / RATE)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(hemisphere: f64, tolerance: f64) -> PictureCost {
        let error = GatherError { camera: 0.3, hemisphere, signal: 1.0, ..GatherError::default() };
        let goal =
            PictureGoal { tolerance, size: (100, 100).into(), deadline: None, memory: f64::INFINITY.into(), seed: 0 };
        PictureCost::of(&error, 2, &goal, 1.0)
    }

    /// Twice the noise takes 2^(2/1.4) times the hemisphere rays, and so does half the tolerance.
    #[test]
    fn rays_go_as_the_noise_over_what_is_left_of_the_tolerance() {
        let hemisphere = |noise: f64, tolerance: f64| {
            let variance = left(tolerance, 0.0).powi(2);
            cost(noise, tolerance).parts(0.25, variance)[1]
        };
        let times = 2.0_f64.powf(2.0 / RATE);
        let first = hemisphere(0.03, 0.02);
        assert!((hemisphere(0.06, 0.02) / first / times - 1.0).abs() < 1e-9);
        assert!((hemisphere(0.03, 0.01) / first / times - 1.0).abs() < 1e-9);
    }

    #[test]
    fn camera_rays_make_the_share_that_costs_least() {
        let cost = cost(0.03, 0.02);
        let Priced { rays, camera, .. } = cost.priced(0.0);
        assert!(CAMERA[0] < camera && camera < CAMERA[1], "{camera}");
        let variance = left(0.02, 0.0).powi(2);
        let at = |share: f64| cost.parts(share, variance).iter().sum::<f64>();
        assert!((at(camera) / rays - 1.0).abs() < 1e-12 && at(1.1 * camera) > rays && at(camera / 1.1) > rays);
        // Where either takes next to nothing the other may have as much as there is.
        let share = |camera: f64, hemisphere: f64| {
            let mut own = cost;
            (own.camera, own.hemisphere) = (camera, hemisphere);
            own.priced(0.0).camera
        };
        let [least, most] = CAMERA;
        assert!((share(0.0, 1.0) - least).abs() < 1e-5 && (share(1.0, 0.0) - most).abs() < 1e-5);
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

    /// Light that is off by more than its share has no price.
    #[test]
    fn errors_of_the_light_cost_the_more_the_larger_they_are() {
        let rays = |error: f64| cost(0.03, 0.02).priced((error * 0.02_f64).powi(2)).rays;
        assert!(rays(0.3) < rays(0.6) && rays(0.6) < rays(0.84) && rays(0.84).is_finite());
        assert_eq!(rays(0.9), f64::INFINITY);
    }
}
