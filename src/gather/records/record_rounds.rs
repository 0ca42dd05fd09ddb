//! The rounds of rays and records that bring the noise and the bias of indirect light below what they may be.
//!
//! Noise is lessened by more rays, cast where they lessen it most; bias by shorter valid radii and so by more records.
//! Records estimate their own bias, but they were chosen by what they show ([`crate::gather::records::fit_error`]). So
//! where they find it small enough places drawn by chance are evaluated, and the larger of both counts.
//!
//! Not handled: errors of camera rays, and of the solution that is gathered.

use std::time::Instant;

use crate::error::deadline::would_be_over;
use crate::gather::pixels::adaptive_sampling::{Measured, Plan, measure};
use crate::gather::pixels::pixel::Pixel;
use crate::gather::records::fit_error::{Bias, relative};
use crate::gather::records::indirect_light::IndirectLight;
use crate::gather::records::irradiance_cache::IrradianceCache;
use crate::light::budget::{FIT, HEMISPHERE};

/// How far below its share the next round aims.
const MARGIN: f64 = 0.93;
/// Share of the squared error which the fit may make that places without a record may be uncertain by: those foresee it
/// to a factor of two only, and what is predicted is the larger for light that is merely noisy.
const REST: f64 = 0.25;
/// The least share of the noise that one round of rays leaves where the bias asks for less than its part.
const LESS: f64 = 0.5;
/// One pixel in so many tells the errors of a round.
const SOME: usize = 9;
/// The least and the most that a valid radius too long is multiplied by.
const SHORTER: [f64; 2] = [0.35, 0.6];
/// The power of what is wanted over the squared bias that the factor goes by: the bias grows as the radius's power 1.2.
const POWER: f64 = 0.42;
/// RecordRounds of more records in a row that leave no less bias than those before, after which there are no more.
const STALLS: usize = 3;
/// RecordRounds of more rays, or more records.
const ROUNDS: u32 = 40;
/// RecordRounds that were predicted to be the last and were not, and times as many rays as were cast before the first of them,
/// after which no end is predicted.
const MISSED: usize = 3;
const LONGER: f64 = 6.0;

/// Records of a picture and what they are asked.
pub(crate) struct RecordRounds<'a, 'b> {
    cache: &'a mut IrradianceCache<'b>,
    pixels: &'a [Pixel],
    /// The picture by camera rays alone.
    camera: Measured,
    /// Squared error that indirect light may have, summed over the pixels.
    allowed: f64,
    progress: Progress,
    validation: Validation,
    /// One pixel in so many tells the noise, in every row and column.
    step: usize,
    /// Noise when rays were last cast for its sake.
    before: f64,
    /// Whether the places where the first records leave light least certain have records.
    is_probed: bool,
}

/// Variances and squares of what is known of indirect light, summed over the pixels.
struct Noise {
    variance: f64,
    signal: f64,
}

impl<'a, 'b> RecordRounds<'a, 'b> {
    /// RecordRounds for a picture whose error relative to itself may be `error`, camera rays among it.
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

    /// Casts rays and adds records until both are small enough, late, or of no use; returns the squared error of the
    /// fit beyond noise, summed over the pixels.
    pub fn run(mut self, plan: &Plan) -> f64 {
        let mut misfit = 0.0;
        let mut began = Instant::now();
        for round in 0..ROUNDS {
            let found = self.noise();
            // A picture without light has no error relative to it.
            // One round casts up to so many times the rays of the one before.
            let is_last =
                plan.is_late() || would_be_over(plan.deadline, std::mem::replace(&mut began, Instant::now()), 2.0);
            if is_last || self.allowed <= 0.0 {
                return predicted_misfit(self.cache, self.pixels, &self.cache.biases(), found.signal);
            }
            let noise = found.variance / (HEMISPHERE * HEMISPHERE * self.allowed);
            // Noise that more rays did not lessen is not theirs.
            if noise > 1.0 && noise < 0.8 * self.before {
                self.before = noise;
                self.cache.refine(MARGIN / noise, self.pixels);
                continue;
            }
            // Where no record lies a bias shows in none: the least certain places get one first.
            if !self.is_probed {
                self.is_probed = true;
                self.cache.place_uncertain(REST * FIT * FIT * self.allowed, self.pixels, round);
                continue;
            }
            // Only now: a bias measured through much noise is itself noisy.
            let biases = self.cache.biases();
            let predicted = predicted_misfit(self.cache, self.pixels, &biases, found.signal);
            let was_validated = self.validation.is_known();
            misfit = self.confirmed(predicted, noise, round);
            let bias = self.over(misfit);
            if self.progress.stalls == STALLS || self.progress.is_endless(self.cache.cast) {
                break;
            }
            if is_enough(noise, bias) {
                // One bright pixel may lie between those looked at.
                if self.step == 1 || is_enough(self.noise_of_all(), bias) {
                    break;
                }
                continue;
            }
            // What records do not find of themselves is left to rays once, as far as those can make up for it.
            let room = (1.0 - FIT * FIT * bias) / (HEMISPHERE * HEMISPHERE * noise);
            if predicted < misfit && room > LESS && !was_validated {
                self.cache.refine(MARGIN * room.min(1.0), self.pixels);
                continue;
            }
            self.add_records(&biases, bias, round);
        }
        misfit
    }

    /// The noise of the indirect light of all pixels over its part; from now on all are looked at.
    fn noise_of_all(&mut self) -> f64 {
        self.step = 1;
        self.noise().variance / (HEMISPHERE * HEMISPHERE * self.allowed)
    }

    /// The noise of the indirect light, and the light.
    fn noise(&self) -> Noise {
        let some = IndirectLight::new(self.pixels, self.cache, self.step).measure(self.pixels);
        let scale = self.camera.count / some.count.max(1.0);
        Noise { variance: scale * some.variance, signal: scale * some.signal }
    }

    /// What the fit may be off by: what records foresee, and no less than places tell that were drawn by chance. Those
    /// are asked where records find nothing wrong, or know no better.
    fn confirmed(&mut self, predicted: f64, noise: f64, round: u32) -> f64 {
        let known = self.validation.is_known();
        let mut misfit = predicted;
        if known || is_enough(noise, self.over(predicted)) || self.progress.stalls + 1 == STALLS {
            let validation = self.validation.by(|| self.cache.validate(self.pixels, round));
            // What is no number stays so, where `f64::max` would take the other.
            misfit = if validation > predicted { validation } else { predicted };
        }
        // A bias that more records did not lessen is that of light they cannot follow, or chance. Where only rays
        // became more it says nothing.
        if !known {
            self.progress.note(self.over(misfit));
        }
        misfit
    }

    /// Shortens the valid radius of the records that are off most, and adds records where the light is least certain.
    fn add_records(&mut self, biases: &[Bias], bias: f64, round: u32) {
        self.progress.foresee(self.cache.cast);
        let worst = self.cache.worst(biases, (1.5 * (1.0 - 1.0 / bias)).clamp(0.3, 1.0));
        self.cache.shorten(&worst, shortening(bias), self.pixels);
        self.cache.place_uncertain(REST * FIT * FIT * self.allowed, self.pixels, round);
        self.validation.is_over();
        self.before = f64::INFINITY;
    }

    /// A squared error of the fit over what it may be.
    fn over(&self, misfit: f64) -> f64 {
        misfit / (FIT * FIT * self.allowed)
    }
}

/// The squared error of the fit that records tell, of indirect light whose squares add up to `signal`.
pub(crate) fn predicted_misfit(cache: &IrradianceCache, pixels: &[Pixel], biases: &[Bias], signal: f64) -> f64 {
    let bare = cache.bare() as f64 / cache.record_of.len().max(1) as f64;
    bare * relative(biases) * signal + cache.misfit(pixels, biases)
}

/// Whether noise and bias, each over its part, leave no more than all that they may.
fn is_enough(noise: f64, bias: f64) -> bool {
    HEMISPHERE * HEMISPHERE * noise + FIT * FIT * bias <= 1.0
}

/// What places drawn by chance validation of the squared error of the fit.
#[derive(Default)]
struct Validation {
    /// Of the records there are now.
    now: Option<f64>,
    /// Of the records there were before.
    before: Option<f64>,
}

impl Validation {
    fn is_known(&self) -> bool {
        self.now.is_some()
    }

    /// The mean of what is validation now and was validation before, or what would be stated is that at which rounds ended because
    /// it was small by chance.
    fn by(&mut self, ask: impl FnOnce() -> f64) -> f64 {
        let now = *self.now.get_or_insert_with(ask);
        0.5 * (now + self.before.unwrap_or(now))
    }

    /// Records have become others.
    fn is_over(&mut self) {
        self.before = self.now.take().or(self.before);
    }
}

/// How the bias went from round to round.
struct Progress {
    /// RecordRounds that were to bring it down to what it may be, and did not.
    missed: usize,
    /// Rays cast before the first of those.
    first: f64,
    /// The least so far, over what it may be.
    least: f64,
    /// RecordRounds since.
    stalls: usize,
}

impl Default for Progress {
    fn default() -> Progress {
        Progress { missed: 0, first: f64::INFINITY, least: f64::INFINITY, stalls: 0 }
    }
}

impl Progress {
    /// Takes note of records added after so many rays, which are predicted to be the last.
    fn foresee(&mut self, cast: u64) {
        self.missed += 1;
        self.first = self.first.min(cast as f64);
    }

    /// Whether ever more records are added, for ever more rays.
    fn is_endless(&self, cast: u64) -> bool {
        self.missed > MISSED && cast as f64 > LONGER * self.first
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    /// A door ajar by 5 mm ended at 3.8 % where 2 % was asked, as rounds that lessened nothing were counted over all:
    /// its bias was 53, 51, 2.2, 6.0 times what it may be, as places drawn by chance validation it, and then the last.
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

    /// RecordRounds that end where places drawn by chance tell little would state that little: a room of lamps in cans validation
    /// 4.6 % and then 2.1 %, and was 3.9 % off.
    #[test]
    fn what_is_told_counts_with_what_was_told_before() {
        let mut validation = Validation::default();
        assert_eq!([validation.by(|| 9.0), validation.by(|| unreachable!("asked again of the same records"))], [9.0, 9.0]);
        validation.is_over();
        assert!(!validation.is_known());
        assert_eq!(validation.by(|| 1.0), 5.0);
        // Not asked of those in between.
        validation.is_over();
        validation.is_over();
        assert_eq!(validation.by(|| 3.0), 2.0);
    }

    #[test]
    fn noise_may_use_what_bias_leaves_and_bias_what_noise_leaves() {
        let half = 0.5 / (HEMISPHERE * HEMISPHERE);
        let rest = 0.5 / (FIT * FIT);
        assert!(is_enough(half, 0.999 * rest) && !is_enough(half, 1.001 * rest));
        assert!(is_enough(half, -1.0));
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
