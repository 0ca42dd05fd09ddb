//! Rounds of more rays and records until the noise and the bias of indirect light are within their parts of the error.
//!
//! Noise is lessened by more rays, cast where they lessen it most; bias by shorter valid radii and so by more records.
//! Records predict their own bias by cross-validation, which is biased as they were chosen by it
//! ([`crate::gather::records::fit_error`]). Where the prediction is small enough it is validated at randomly sampled
//! places, and the larger of both counts.
//!
//! Not handled: errors of camera rays, and of the solution that is gathered.

use std::time::Instant;

use crate::error::deadline::{is_over, would_be_over};
use crate::gather::pixels::adaptive_sampling::{Measured, Plan, measure};
use crate::gather::pixels::pixel::Pixel;
use crate::gather::records::fit_error::{Bias, relative};
use crate::gather::records::indirect_light::IndirectLight;
use crate::gather::records::irradiance_cache::IrradianceCache;
use crate::light::budget::{FIT, HEMISPHERE};

/// Share of the allowed noise that the next round aims at.
const MARGIN: f64 = 0.93;
/// Share of the allowed squared error of the fit that may be predicted for places without a record, as predictions are
/// good to a factor of two and larger for light that is merely noisy.
const REST: f64 = 0.25;
/// The least share of the noise that one round of rays may have to leave to compensate for bias.
const LESS: f64 = 0.5;
/// The noise of a round is estimated at one pixel in so many.
const SOME: usize = 9;
/// The least and the most that a valid radius too long is multiplied by.
const SHORTER: [f64; 2] = [0.35, 0.6];
/// The power of allowed over squared bias that the factor is: the bias grows as the radius to the power 1.2.
const POWER: f64 = 0.42;
/// Rounds of more records in a row without less bias after which there are no more.
const STALLS: usize = 3;
/// Rounds of more rays, or more records.
const ROUNDS: u32 = 40;
/// Rounds of more records, and ratio of the rays to those before the first of them, beyond which rounds count as
/// endless.
const MISSED: usize = 3;
const LONGER: f64 = 6.0;

/// The rounds of one picture.
pub(crate) struct RecordRounds<'a, 'b> {
    cache: &'a mut IrradianceCache<'b>,
    pixels: &'a [Pixel],
    /// The picture by camera rays alone.
    camera: Measured,
    /// Squared error that indirect light may have, summed over the pixels.
    allowed: f64,
    progress: Progress,
    validation: Validation,
    /// Noise is estimated at one pixel in so many, in every row and column.
    step: usize,
    /// Noise when rays were last cast to lessen it.
    before: f64,
    /// Whether the places where the first records leave light least certain have records.
    is_probed: bool,
}

/// Variance and squared signal of indirect light, summed over the pixels.
struct Noise {
    variance: f64,
    signal: f64,
}

impl<'a, 'b> RecordRounds<'a, 'b> {
    /// Rounds for a picture whose error relative to itself may be `error`, camera rays among it.
    pub fn new(cache: &'a mut IrradianceCache<'b>, pixels: &'a [Pixel], error: f64) -> RecordRounds<'a, 'b> {
        let camera = measure(pixels);
        let all = error * error * camera.signal;
        let allowed = (all - camera.variance).max(0.25 * all);
        RecordRounds {
            cache,
            pixels,
            camera,
            allowed,
            progress: Progress::default(),
            validation: Validation::default(),
            step: SOME,
            before: f64::INFINITY,
            is_probed: false,
        }
    }

    /// Casts rays and adds records until noise and bias are small enough, time is over, or they do not fall; returns
    /// the squared error of the fit beyond noise, summed over the pixels.
    pub fn run(mut self, plan: &Plan) -> f64 {
        let mut misfit = 0.0;
        let mut began = Instant::now();
        for round in 0..ROUNDS {
            let Noise { variance, signal } = self.noise();
            // A round takes about twice as long as the one before.
            let is_last = is_over(plan.deadline)
                || would_be_over(plan.deadline, std::mem::replace(&mut began, Instant::now()), 2.0);
            // A picture without light has no relative error.
            if is_last || self.allowed <= 0.0 {
                return predicted_misfit(self.cache, self.pixels, &self.cache.biases(), signal);
            }
            let noise = variance / (HEMISPHERE * HEMISPHERE * self.allowed);
            // Noise that more rays did not lessen has another cause.
            if noise > 1.0 && noise < 0.8 * self.before {
                self.before = noise;
                self.cache.refine(MARGIN / noise, self.pixels);
                continue;
            }
            // Cross-validation shows no bias where there is no record: the least certain places get one first.
            if !self.is_probed {
                self.is_probed = true;
                self.cache.place_uncertain(REST * FIT * FIT * self.allowed, self.pixels, round);
                continue;
            }
            // Only now, as noise makes the estimated bias noisy.
            let biases = self.cache.biases();
            let predicted = predicted_misfit(self.cache, self.pixels, &biases, signal);
            let was_validated = self.validation.is_known();
            misfit = self.confirmed(predicted, noise, round);
            let bias = self.over(misfit);
            if self.progress.stalls == STALLS || self.progress.is_endless(self.cache.cast) {
                break;
            }
            if is_enough(noise, bias) {
                // A bright pixel may lie between those evaluated.
                if self.step == 1 || is_enough(self.noise_of_all(), bias) {
                    break;
                }
                continue;
            }
            // Bias that cross-validation does not show is compensated by rays once, as far as possible.
            let room = (1.0 - FIT * FIT * bias) / (HEMISPHERE * HEMISPHERE * noise);
            if predicted < misfit && room > LESS && !was_validated {
                self.cache.refine(MARGIN * room.min(1.0), self.pixels);
                continue;
            }
            self.add_records(&biases, bias, round);
        }
        misfit
    }

    /// The noise of the indirect light of all pixels over its part; from now on all are evaluated.
    fn noise_of_all(&mut self) -> f64 {
        self.step = 1;
        self.noise().variance / (HEMISPHERE * HEMISPHERE * self.allowed)
    }

    /// The noise of the indirect light.
    fn noise(&self) -> Noise {
        let some = IndirectLight::new(self.pixels, self.cache, self.step).measure(self.pixels);
        let scale = self.camera.count / some.count.max(1.0);
        Noise { variance: scale * some.variance, signal: scale * some.signal }
    }

    /// The squared error of the fit: predicted by the records, and no less than by validation, which takes place where
    /// the prediction is small enough or has stalled.
    fn confirmed(&mut self, predicted: f64, noise: f64, round: u32) -> f64 {
        let known = self.validation.is_known();
        let mut misfit = predicted;
        if known || is_enough(noise, self.over(predicted)) || self.progress.stalls + 1 == STALLS {
            let validated = self.validation.mean_with(|| self.cache.validate(self.pixels, round));
            // NaN stays, where `f64::max` would take the other.
            misfit = if validated > predicted { validated } else { predicted };
        }
        // Progress is judged after more records only.
        if !known {
            self.progress.note(self.over(misfit));
        }
        misfit
    }

    /// Shortens the valid radius of the most biased records, and adds records where the light is least certain.
    fn add_records(&mut self, biases: &[Bias], bias: f64, round: u32) {
        self.progress.note_records(self.cache.cast);
        let worst = self.cache.worst(biases, (1.5 * (1.0 - 1.0 / bias)).clamp(0.3, 1.0));
        self.cache.shorten(&worst, shortening(bias), self.pixels);
        self.cache.place_uncertain(REST * FIT * FIT * self.allowed, self.pixels, round);
        self.validation.outdate();
        self.before = f64::INFINITY;
    }

    /// A squared error of the fit over what it may be.
    fn over(&self, misfit: f64) -> f64 {
        misfit / (FIT * FIT * self.allowed)
    }
}

/// The squared error of the fit predicted by records, of indirect light whose squares add up to `signal`.
pub(crate) fn predicted_misfit(cache: &IrradianceCache, pixels: &[Pixel], biases: &[Bias], signal: f64) -> f64 {
    let bare = cache.bare() as f64 / cache.record_of.len().max(1) as f64;
    bare * relative(biases) * signal + cache.misfit(pixels, biases)
}

/// Whether noise and bias, each over its part, are together no more than allowed.
fn is_enough(noise: f64, bias: f64) -> bool {
    HEMISPHERE * HEMISPHERE * noise + FIT * FIT * bias <= 1.0
}

/// Squared errors of the fit by validation.
#[derive(Default)]
struct Validation {
    /// Of the present records.
    now: Option<f64>,
    /// Of the records validated before.
    before: Option<f64>,
}

impl Validation {
    fn is_known(&self) -> bool {
        self.now.is_some()
    }

    /// The mean of the present and the previous validation: the present one alone would be small by chance where it
    /// ends the rounds.
    fn mean_with(&mut self, validate: impl FnOnce() -> f64) -> f64 {
        let now = *self.now.get_or_insert_with(validate);
        0.5 * (now + self.before.unwrap_or(now))
    }

    /// Records have changed.
    fn outdate(&mut self) {
        self.before = self.now.take().or(self.before);
    }
}

/// The bias from round to round.
struct Progress {
    /// Rounds of more records.
    missed: usize,
    /// Rays cast before the first of those.
    first: f64,
    /// The least bias so far, over the allowed one.
    least: f64,
    /// Rounds since.
    stalls: usize,
}

impl Default for Progress {
    fn default() -> Progress {
        Progress { missed: 0, first: f64::INFINITY, least: f64::INFINITY, stalls: 0 }
    }
}

impl Progress {
    /// Notes that records are added after so many rays.
    fn note_records(&mut self, cast: u64) {
        self.missed += 1;
        self.first = self.first.min(cast as f64);
    }

    /// Whether many rounds have added records, for many more rays.
    fn is_endless(&self, cast: u64) -> bool {
        self.missed > MISSED && cast as f64 > LONGER * self.first
    }

    /// Notes the bias of a round.
    fn note(&mut self, bias: f64) {
        let helped = bias > 1.0 && bias <= 0.95 * self.least;
        self.stalls = if helped { 0 } else { self.stalls + 1 };
        self.least = self.least.min(bias);
    }
}

/// The factor on valid radii that are too long, for a squared bias over the allowed one, which noise may make negative.
fn shortening(bias: f64) -> f64 {
    bias.max(f64::MIN_POSITIVE).powf(-POWER).clamp(SHORTER[0], SHORTER[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounds without progress count only in a row.
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

    #[test]
    fn a_validation_counts_with_the_one_before() {
        let mut validation = Validation::default();
        assert_eq!(validation.mean_with(|| 9.0), 9.0);
        assert_eq!(validation.mean_with(|| unreachable!("the records are the same")), 9.0);
        validation.outdate();
        assert!(!validation.is_known());
        assert_eq!(validation.mean_with(|| 1.0), 5.0);
        // Records in between are not validated.
        validation.outdate();
        validation.outdate();
        assert_eq!(validation.mean_with(|| 3.0), 2.0);
    }

    #[test]
    fn noise_may_use_what_bias_leaves_and_bias_what_noise_leaves() {
        let half = 0.5 / (HEMISPHERE * HEMISPHERE);
        let rest = 0.5 / (FIT * FIT);
        assert!(is_enough(half, 0.999 * rest) && !is_enough(half, 1.001 * rest));
        assert!(is_enough(half, -1.0));
    }

    #[test]
    fn radii_stay_numbers_whatever_the_bias() {
        let of = [-1.0, -1e-300, 0.0, 1e-9, 1.0, 3.0, 81.0, 1e300].map(shortening);
        assert!(of.iter().all(|&f| (SHORTER[0]..=SHORTER[1]).contains(&f)), "{of:?}");
        assert!(of.is_sorted_by(|a, b| a >= b));
    }
}
