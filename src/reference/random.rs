//! Random numbers of the path tracer: one stream for each (seed, pixel, sample), whatever thread draws from it.
//!
//! xoshiro256++ whose state is filled by SplitMix64 from a hash of the three numbers. Kept apart from the sequences
//! the solver samples with, so that a flaw of one is not a flaw of both. Not handled: stratification; cryptography.
//!
//! Sources: D. Blackman, S. Vigna, *Scrambled linear pseudorandom number generators*, ACM TOMS 47(4), 2021; G. Steele,
//! D. Lea, C. Flood, *Fast splittable pseudorandom number generators*, OOPSLA 2014.

use std::f32::consts::TAU;

use glam::Vec3;

/// A stream of random numbers.
pub(crate) struct Random {
    state: [u64; 4],
}

impl Random {
    /// The stream of one path.
    pub(crate) fn new(seed: u32, pixel: u64, sample: u64) -> Random {
        let mut key = u64::from(seed);
        for part in [pixel, sample] {
            key = split_mix(&mut key).wrapping_add(part);
        }
        let mut key = split_mix(&mut key);
        Random { state: std::array::from_fn(|_| split_mix(&mut key)) }
    }

    /// 64 random bits.
    #[inline]
    fn bits(&mut self) -> u64 {
        let s = &mut self.state;
        let bits = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let shifted = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= shifted;
        s[3] = s[3].rotate_left(45);
        bits
    }

    /// Uniform in [0, 1), a multiple of 2^-24.
    #[inline]
    pub(crate) fn uniform(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    #[inline]
    pub(crate) fn fine(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
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

/// The next number of a SplitMix64 stream.
#[inline]
fn split_mix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published test vectors of the two generators.
    #[test]
    fn the_generators_are_the_published_ones() {
        let mut state = 1_234_567;
        let split: [u64; 3] = std::array::from_fn(|_| split_mix(&mut state));
        let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!(split, expected);
        let state = [1, 2, 3, 4];
        let mut random = Random { state };
        let bits: [u64; 4] = std::array::from_fn(|_| random.bits());
        let expected = [41_943_041, 58_720_359, 3_588_806_011_781_223, 3_591_011_842_654_386];
        assert_eq!(bits, expected);
    }

    #[test]
    fn streams_depend_on_all_three_numbers() {
        let first = |seed, pixel, sample| Random::new(seed, pixel, sample).bits();
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
