//! How the error of the gather pass is divided between camera rays, hemisphere rays and the fit between records, and
//! the rounds of sampling that bring each below its part.
//!
//! Not handled: errors of the solution that is gathered.

use crate::gather::adaptive_sampling::{Plan, measure};
use crate::gather::camera_rays::CameraSampling;
use crate::gather::fields::Fields;
use crate::gather::fit_error::{Bias, relative};
use crate::gather::indirect_light::IndirectLight;
use crate::gather::irradiance_cache::{Density, IrradianceCache};
use crate::gather::pixel::Pixel;
use crate::gather::sampling::{Gathering, is_over};
use crate::gather::view::View;

/// Share of the error that camera rays may make where there is indirect light, which is dearer.
pub(crate) const CAMERA: f64 = 0.5;
/// Share of what camera rays leave that hemisphere rays may make.
const HEMISPHERE: f64 = 0.8;
/// Share of a gather pass's squared error that noise of hemisphere rays may make.
pub(crate) const NOISE: f64 = (1.0 - CAMERA * CAMERA) * HEMISPHERE * HEMISPHERE;
/// Share of what camera rays leave that the fit may make.
const FIT: f64 = 0.55;
/// How far below its share the next round aims.
const MARGIN: f64 = 0.93;
/// One pixel in so many tells the errors of a round.
const SOME: usize = 9;
/// The least and the most that a valid radius too long is multiplied by.
const SHORTER: [f64; 2] = [0.35, 0.6];
/// The power of what is wanted over the squared bias that the factor goes by: the bias grows as the radius's power 1.2.
const POWER: f64 = 0.42;
/// Rounds of more records in a row that leave no less bias than those before, after which there are no more.
const STALLS: usize = 3;
/// Rounds of more rays, or more records.
const ROUNDS: usize = 40;
/// Valid radius over the distance to the surroundings where every pixel has records.
const RADIUS: f64 = 0.15;
/// Valid radius over the distance to the surroundings at first, at an error of 1 %. Measured on the Cornell box, the
/// fit's bias grows as its power 1.2.
const WITHIN: f64 = 0.18;
/// The least valid radius at first, in pixels, at an error of 1 %.
const LEAST: f64 = 3.0;
/// Rays of a half at first, at an error of 1 %.
const RAYS: f64 = 128.0;

/// What [`Gathering`] comes to for one picture.
pub(crate) struct Settings {
    pub plan: Plan,
    pub density: Density,
    pub camera: CameraSampling,
    error: Option<f64>,
}

impl Settings {
    /// The first guess; rounds of sampling correct it.
    pub fn new(view: &View, fields: &Fields, gathering: &Gathering) -> Settings {
        match *gathering {
            Gathering::Uniform(sampling) => Settings {
                plan: Plan { first: (sampling.camera / 2).max(1), noise: None, deadline: None },
                density: Density {
                    spacing: 1,
                    rays: (sampling.camera * sampling.hemisphere / 2).max(1),
                    radius: RADIUS,
                    least: 0.0,
                    pixel: view.scene.camera.pixel(view.height),
                    seed: sampling.seed,
                },
                camera: CameraSampling {
                    tabled: sampling.camera.max(1),
                    visibility: sampling.luminaire,
                    seed: sampling.seed,
                },
                error: None,
            },
            Gathering::Within { error, seed, deadline } => {
                // Where there is no time for rounds the first guess is all there is.
                let fineness = if is_over(deadline) { 0.1 } else { (0.01 / error).clamp(0.1, 100.0) };
                let pixel = view.scene.camera.pixel(view.height);
                Settings {
                    plan: Plan {
                        first: ((2.0 * fineness) as u32).clamp(2, 16).next_power_of_two(),
                        noise: Some(error * if fields.is_dark() { 1.0 } else { CAMERA }),
                        deadline,
                    },
                    density: Density {
                        spacing: spacing(view.width.max(view.height)),
                        rays: ((RAYS * fineness.powf(1.4)) as u32).max(16),
                        radius: WITHIN * fineness.powf(-0.5),
                        least: LEAST * fineness.powf(-0.3),
                        pixel,
                        seed,
                    },
                    camera: CameraSampling {
                        tabled: 64,
                        // The ratio of few drawn points is biased.
                        visibility: if view.sight.takes_ratios() { 4 } else { 1 },
                        seed,
                    },
                    error: Some(error),
                }
            }
        }
    }

    /// Places records and casts their rays until noise and bias are within their parts.
    pub fn gather_indirect(&self, pixels: &[Pixel], cache: &mut IrradianceCache) -> IndirectLight {
        cache.place(pixels);
        let camera = measure(pixels);
        let left = self.error.map_or(f64::INFINITY, |error| {
            (error * error * camera.signal - camera.variance).max(0.25 * error * error * camera.signal)
        });
        let (mut before, mut progress) = (f64::INFINITY, Progress::default());
        let mut misfit = 0.0;
        for round in 0..ROUNDS {
            let some = IndirectLight::new(pixels, cache, SOME).measure(pixels);
            let scale = camera.count / some.count.max(1.0);
            let bare = cache.bare() as f64 / cache.record_of.len().max(1) as f64;
            let foreseen = |biases: &[Bias]| bare * scale * relative(biases) * some.signal;
            // A picture without light has no error relative to it.
            if self.error.is_none() || self.plan.is_late() || left <= 0.0 {
                let biases = cache.biases();
                misfit = foreseen(&biases) + cache.misfit(pixels, &biases);
                break;
            }
            let noise = scale * some.variance / (HEMISPHERE * HEMISPHERE * left);
            // Noise that more rays did not lessen is not theirs.
            if noise > 1.0 && noise < 0.8 * before {
                before = noise;
                cache.refine(MARGIN / noise, pixels);
                continue;
            }
            // Only now: a bias measured through much noise is itself noisy.
            let validated = cache.validate(pixels, round as u32);
            let biases = cache.biases();
            let elsewhere = validated.corrected(foreseen(&biases));
            misfit = elsewhere + cache.misfit(pixels, &biases);
            let bias = misfit / (FIT * FIT * left);
            // A bias that more records did not lessen is that of light they cannot follow, or chance. Where it is
            // within its part the noise is not, and that is not theirs to lessen.
            progress.note(bias);
            let both = HEMISPHERE * HEMISPHERE * noise + FIT * FIT * bias;
            if both <= HEMISPHERE * HEMISPHERE + FIT * FIT || progress.stalls == STALLS {
                break;
            }
            let worst = cache.worst(&biases, (1.5 * (1.0 - 1.0 / bias)).clamp(0.3, 1.0));
            cache.shorten(&worst, shortening(bias), pixels);
            before = f64::INFINITY;
        }
        IndirectLight::new(pixels, cache, 1).biased_by(misfit)
    }
}

/// How the bias went from round to round.
struct Progress {
    /// The least so far, over what it may be.
    least: f64,
    /// Rounds since.
    stalls: usize,
}

impl Default for Progress {
    fn default() -> Progress {
        Progress { least: f64::INFINITY, stalls: 0 }
    }
}

impl Progress {
    fn note(&mut self, bias: f64) {
        let helped = bias > 1.0 && bias <= 0.95 * self.least;
        self.stalls = if helped { 0 } else { self.stalls + 1 };
        self.least = self.least.min(bias);
    }
}

/// What a valid radius too long is multiplied by, for a squared bias over what it may be. One measured through noise
/// may be negative.
fn shortening(bias: f64) -> f64 {
    bias.max(f64::MIN_POSITIVE).powf(-POWER).clamp(SHORTER[0], SHORTER[1])
}

/// Pixels between the records of the coarsest lattice: some 32 records across the picture.
fn spacing(length: usize) -> usize {
    let most = (length / 32).clamp(1, 16);
    1 << most.ilog2()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A door ajar by 5 mm ended at 3.8 % where 2 % was asked, as rounds that lessened nothing were counted over all:
    /// its bias was 53, 51, 2.2, 6.0 times what it may be, as places drawn by chance told it, and then the last.
    #[test]
    fn rounds_go_on_as_long_as_some_in_a_row_help() {
        let stalls = |biases: &[f64]| {
            let mut progress = Progress::default();
            biases.iter().for_each(|&bias| progress.note(bias));
            progress.stalls
        };
        assert_eq!(stalls(&[53.3, 50.7, 2.2, 6.0]), 1);
        assert_eq!(stalls(&[53.3, 50.7, 2.2, 6.0, 5.0, 4.0]), STALLS);
        assert_eq!(stalls(&[0.9, 0.5, 0.1]), STALLS);
    }

    /// The power of a negative bias was no number, nor was any valid radius after it: a room with 25 textured lamps
    /// came out black after 90 s.
    #[test]
    fn radii_stay_numbers_whatever_the_bias_measured() {
        let of = [-1.0, -1e-300, 0.0, 1e-9, 1.0, 3.0, 81.0, 1e300].map(shortening);
        assert!(of.iter().all(|&f| (SHORTER[0]..=SHORTER[1]).contains(&f)), "{of:?}");
        assert!(of.is_sorted_by(|a, b| a >= b));
    }
}
