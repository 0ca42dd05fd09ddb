//! Random numbers of the path tracer: one stream of xoshiro256++ for each (seed, pixel, sample), whatever thread draws
//! from it, and directions drawn with them.
//!
//! Kept apart from the sequences the solver samples with, so that a flaw of one is not a flaw of both. Only place for
//! `rand_xoshiro`. Not handled: stratification; cryptography.

use std::f32::consts::TAU;

use glam::Vec3;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use rand_xoshiro::{SplitMix64, Xoshiro256PlusPlus};

/// A stream of random numbers.
pub(crate) struct Random(Xoshiro256PlusPlus);

impl Random {
    /// The stream of one path.
    pub(crate) fn new(seed: u32, pixel: u64, sample: u64) -> Random {
        let mixed = |key: u64| SplitMix64::seed_from_u64(key).next_u64();
        let key = mixed(mixed(seed.into()).wrapping_add(pixel)).wrapping_add(sample);
        Random(Xoshiro256PlusPlus::seed_from_u64(mixed(key)))
    }

    /// Uniform in [0, 1), a multiple of 2^-24.
    #[inline]
    pub(crate) fn uniform(&mut self) -> f32 {
        (self.0.next_u64() >> 40) as f32 / (1 << 24) as f32
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    #[inline]
    pub(crate) fn fine(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform weights of a triangle's second and third corner: the half of the unit square beyond the diagonal is
    /// folded back.
    pub(crate) fn triangle(&mut self) -> [f32; 2] {
        let (u, v) = (self.uniform(), self.uniform());
        if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] }
    }

    /// A unit direction about the unit `normal` with density cos(theta)/pi per steradian: a uniform point of the sphere
    /// that touches the surface from above, seen from the point of touch (Nusselt).
    #[inline]
    pub(crate) fn cosine_direction(&mut self, normal: Vec3) -> Vec3 {
        loop {
            let z = 1.0 - 2.0 * self.uniform();
            let (sin, cos) = (TAU * self.uniform()).sin_cos();
            let radius = (1.0 - z * z).max(0.0).sqrt();
            let way = normal + Vec3::new(radius * cos, radius * sin, z);
            let direction = way.normalize_or_zero();
            // Grazing within rounding, once in 10^10 draws: not a direction that leaves the surface.
            if normal.dot(direction) > 1e-6 {
                return direction;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_depend_on_all_three_numbers() {
        let first = |seed, pixel, sample| Random::new(seed, pixel, sample).fine();
        let all = [first(0, 0, 0), first(1, 0, 0), first(0, 1, 0), first(0, 0, 1), first(1, 1, 0)];
        for i in 1..all.len() {
            assert!(!all[..i].contains(&all[i]));
        }
    }

    /// E cos = 2/3 and E cos² = 1/2 under cos/pi; var cos = 1/18 and var cos² = 1/12; the azimuth has mean 0, variance
    /// 1/4.
    #[test]
    fn directions_follow_the_cosine() {
        let n = 200_000;
        let mut random = Random::new(3, 0, 0);
        let normal = Vec3::new(0.36, -0.48, 0.8);
        let aside = Vec3::new(0.8, 0.6, 0.0);
        let mut sums = [0.0_f64; 3];
        for _ in 0..n {
            let direction = random.cosine_direction(normal);
            let cos = f64::from(normal.dot(direction));
            for (sum, x) in sums.iter_mut().zip([cos, cos * cos, f64::from(aside.dot(direction))]) {
                *sum += x / f64::from(n);
            }
        }
        let expected = [(2.0 / 3.0, 1.0 / 18.0), (0.5, 1.0 / 12.0), (0.0, 0.25)];
        for (sum, (mean, variance)) in sums.iter().zip(expected) {
            let error: f64 = f64::sqrt(variance / f64::from(n));
            assert!((sum - mean).abs() < 4.0 * error, "{sum} {mean} {error}");
        }
    }
}
