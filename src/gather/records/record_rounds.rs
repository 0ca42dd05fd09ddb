//! Rounds of more rays, and of places that gather for themselves, until the noise and the bias of indirect light are
//! within what the picture may be off.
//!
//! Noise is lessened by more rays, cast where they lessen it most. The bias of the fit between records is estimated at
//! places drawn at random ([`crate::gather::records::fit_error`]); where it is too large the least certain places take
//! their own record's light alone, which has none. Noise may use what bias leaves.
//!
//! Not handled: errors of camera rays, and of the solution that is gathered.

use std::time::Instant;

use halflight_team::would_be_over;

use crate::gather::pixels::adaptive_sampling::{Measured, Plan, measure, outlines};
use crate::gather::pixels::pixel::Pixel;
use crate::gather::records::fit_error::{part, validate};
use crate::gather::records::indirect_light::IndirectLight;
use crate::gather::records::irradiance_cache::IrradianceCache;
use crate::gather::records::record_rays::refine;
use crate::light::budget::FIT_SQUARED;

/// Share of the allowed noise that the next round aims at.
const MARGIN: f64 = 0.93;
/// The bias is judged once noise is no more than so many times what is allowed, and again where its standard error,
/// which noise makes, leaves it uncertain.
const JUDGED: [f64; 2] = [1.0, 1.0 - FIT_SQUARED];
/// Times the bias that may be at most, with a standard error, which noise makes room for.
const UNSURE: f64 = 1.5;
/// Share of what is allowed that noise has, whatever the bias.
const LEAST: f64 = 0.25;
/// Share of the bias that may be which fits have left where some places were parted.
const PARTED: f64 = 0.6;
/// The noise of a round is estimated at one pixel in so many.
const SOME: usize = 9;
/// The least share of noise that more rays must take away to go on with them.
const HELPS: f64 = 0.2;
/// Rounds of any kind at most.
const ROUNDS: u32 = 40;

/// The lowest noise of some rounds, and the rays cast by then.
#[derive(Default)]
struct Lowest {
    found: Option<(f64, u64)>,
}

impl Lowest {
    /// Whether noise may fall further that is so high after so many rays: it fell, or there were less than twice as
    /// many since it was lowest.
    fn may_fall(&mut self, noise: f64, rays: u64) -> bool {
        let (before, then) = *self.found.get_or_insert((f64::INFINITY, 0));
        if noise < (1.0 - HELPS) * before {
            self.found = Some((noise, rays));
        }
        noise < (1.0 - HELPS) * before || rays < 2 * then
    }
}

/// The rounds of one picture.
pub(crate) struct RecordRounds<'a, 'b> {
    cache: &'a mut IrradianceCache<'b>,
    pixels: &'a [Pixel],
    /// Pixels as they count.
    count: f64,
    /// Squared error of camera rays, and the light itself squared, summed over the pixels.
    camera: f64,
    signal: f64,
    /// Squared error that indirect light may have, summed over the pixels.
    allowed: f64,
    /// The squared error of the fits as they are, summed over the pixels; none where they have changed.
    bias: Option<f64>,
    /// Noise is estimated at one pixel in so many, in every row and column.
    step: usize,
}

impl<'a, 'b> RecordRounds<'a, 'b> {
    /// Rounds for a picture whose error relative to itself may be `error`, camera rays among it.
    pub(crate) fn new(cache: &'a mut IrradianceCache<'b>, pixels: &'a [Pixel], error: f64) -> RecordRounds<'a, 'b> {
        let Measured { variance, signal, count } = measure(pixels);
        let all = error * error * signal;
        let camera = variance + outlines(pixels);
        let allowed = (all - camera).max(0.25 * all);
        RecordRounds { cache, pixels, count, camera, signal, allowed, bias: None, step: SOME }
    }

    /// Casts rays and parts places until noise and bias are small enough, time is over, or noise does not fall; returns
    /// the squared error of the fit beyond noise, summed over the pixels.
    pub(crate) fn run(mut self, plan: &Plan) -> f64 {
        let mut began = Instant::now();
        let [mut judged, last] = JUDGED;
        let mut best = Lowest::default();
        for round in 0..ROUNDS {
            // A round takes about twice as long as the one before.
            let is_last = plan.limit.is_over(self.cache.caster.cast)
                || would_be_over(plan.limit.deadline, std::mem::replace(&mut began, Instant::now()), 2.0);
            // A picture without light has no relative error.
            if is_last || self.allowed <= 0.0 {
                break;
            }
            let noise = self.noise() / self.allowed;
            let squared = [self.camera, (noise + self.bias.unwrap_or(0.0)) * self.allowed, self.allowed];
            plan.nearing.records(squared.map(|sum| sum / self.signal), self.bias.is_some());
            let goal = self.bias.map_or(judged, |bias| (1.0 - bias / self.allowed).max(LEAST));
            // Noise that twice the rays did not lessen has another cause.
            if noise > goal && best.may_fall(noise, self.cache.caster.cast) {
                refine(self.cache, MARGIN * goal / noise, self.pixels);
            } else if self.bias.is_none() {
                let bias = validate(self.cache, self.pixels, round);
                let (squared, share) = (bias.sum(), FIT_SQUARED * self.allowed);
                best = Lowest::default();
                if squared.value > share {
                    part(self.cache, bias.most_certain(PARTED * share), self.pixels);
                } else if squared.upper() > UNSURE * share && judged > last {
                    judged = last;
                } else {
                    self.bias = Some(squared.upper());
                }
            } else if std::mem::replace(&mut self.step, 1) == 1 {
                // A bright pixel may lie between those evaluated.
                break;
            }
        }
        self.bias.unwrap_or_else(|| validate(self.cache, self.pixels, ROUNDS).sum().upper())
    }

    /// The variance of indirect light, summed over the pixels.
    fn noise(&self) -> f64 {
        let some = IndirectLight::new(self.pixels, self.cache, self.step).measure(self.pixels);
        self.count / some.count.max(1.0) * some.variance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_get_twice_the_rays_before_their_noise_has_another_cause() {
        let mut lowest = Lowest::default();
        assert!(lowest.may_fall(4.0, 100) && lowest.may_fall(2.0, 200));
        // No lower at first, then by little, then after twice the rays.
        assert!(lowest.may_fall(2.0, 300) && lowest.may_fall(1.9, 399) && !lowest.may_fall(1.9, 400));
        assert!(lowest.may_fall(1.5, 400) && lowest.may_fall(1.5, 700));
    }
}
