//! Light on textures finer than a pixel: the mean of reflectance times light from the mean of reflectance, which is
//! known, and from light at points.
//!
//! With rho_i the reflectance where ray i of one half of the rays of a surface ends, D_i the light that arrives there,
//! and m_i the mean reflectance over the part of the pixel that the ray stands for (exact, by `scene::textures`), the
//! light reflected is
//!
//! ```text
//! sum over i of   rho_i D_i + (m_i - rho_i) D'                    D'  the mean of D over the rays of the other half
//! ```
//!
//! Ray i is as likely to end anywhere in its part, whatever the other half meets, so the second term is 0 in the mean
//! and nothing is assumed of how light and texture go together, nor of how the rays of a half avoid each other. Light
//! that is even within the pixel leaves no noise (difference estimates: W. G. Cochran, *Sampling Techniques*, 1977,
//! chapter 7).
//!
//! Worth: of stripes whose white halves lie in shadow the product of means is 6 times too bright; with D' of a ray's
//! own half, whose rays are spread evenly, it is 4 % too dark; with D' of a few rays at a time instead of all, the
//! product of its noise and theirs is as large as their difference, which does not show it.
//!
//! Not handled: indirect light, whose mean is multiplied by that of reflectance; a surface that the other half has not
//! met, whose rays keep their own reflectance.

use glam::DVec3;

use crate::direct::LightSum;

/// Sums over the rays of one surface of a pixel whose mean reflectance is known, for each half.
#[derive(Clone, Default)]
pub(crate) struct TexturedLight {
    pub halves: [HalfLight; 2],
}

/// Sums over those of one half.
#[derive(Clone, Default)]
pub(crate) struct HalfLight {
    pub count: u32,
    /// Sum of D_i, emitter by emitter.
    pub light: Vec<DVec3>,
    /// Sum of `m_i - rho_i`.
    pub off: DVec3,
}

impl TexturedLight {
    /// Adds the light at a point that a half sees, and how far its reflectance lies below the mean, `m_i - rho_i`.
    pub(crate) fn add(&mut self, half: usize, light: &LightSum, off: DVec3) {
        let own = &mut self.halves[half];
        own.count += 1;
        own.off += off;
        light.by_emitter(|emitter, light| {
            own.light.resize(own.light.len().max(emitter + 1), DVec3::ZERO);
            own.light[emitter] += light;
        });
    }

    /// What is due to the mean reflectance of the light that a half's points reflect, sum over them, of one emitter.
    pub(crate) fn due_of(&self, half: usize, emitter: usize) -> DVec3 {
        let own = |other: &HalfLight| other.light.get(emitter).copied().unwrap_or_default();
        self.weight(half) * own(&self.halves[1 - half])
    }

    /// The same of all emitters.
    pub(crate) fn due(&self, half: usize) -> DVec3 {
        self.weight(half) * self.halves[1 - half].light.iter().sum::<DVec3>()
    }

    /// The weight of what the other half meets.
    fn weight(&self, half: usize) -> DVec3 {
        let others = self.halves[1 - half].count;
        if others == 0 { DVec3::ZERO } else { self.halves[half].off / f64::from(others) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::sobol::Stream;

    /// What n points a half of a texture of mean reflectance 0.5 reflect under some light, spread evenly or anyhow.
    fn reflected(n: u32, is_even: bool, random: &mut Stream, light: impl Fn(f64) -> f64) -> f64 {
        let (mut sum, mut textured) = (0.0, TexturedLight::default());
        for half in 0..2 {
            for i in 0..n {
                let at = f64::from(random.uniform());
                let at = if is_even { (f64::from(i) + at) / f64::from(n) } else { at };
                let rho = at.round();
                let mut own = LightSum::default();
                own.add(0, DVec3::splat(light(at)));
                sum += rho * light(at);
                textured.add(half, &own, DVec3::splat(0.5 - rho));
            }
        }
        let due = [0, 1].map(|half| textured.due(half).x);
        assert_eq!(due, [0, 1].map(|half| textured.due_of(half, 0).x));
        (sum + due[0] + due[1]) / f64::from(2 * n)
    }

    #[test]
    fn even_light_leaves_no_noise() {
        let mut random = Stream::new(3);
        for n in [1, 3, 8] {
            let found = reflected(n, false, &mut random, |_| 2.0);
            assert!((found - 1.0).abs() < 1e-12, "{n}: {found}");
        }
    }

    /// Light that goes with the texture, against it, and across it: the mean of many estimates is that of the product.
    #[test]
    fn no_correlation_of_light_and_texture_biases_the_mean() {
        let lights: [fn(f64) -> f64; 3] = [|x| x, |x| 1.0 - x.round(), |x| (6.0 * x).fract()];
        for (light, expected) in lights.into_iter().zip([0.375, 0.0, 0.25]) {
            for (n, is_even) in [(1, false), (5, false), (5, true)] {
                let mut random = Stream::new(n);
                let count = 20_000;
                let all: Vec<f64> = (0..count).map(|_| reflected(n, is_even, &mut random, light)).collect();
                let mean = all.iter().sum::<f64>() / f64::from(count);
                let squares: f64 = all.iter().map(|one| (one - mean).powi(2)).sum();
                let error = (squares / f64::from(count)).sqrt() / f64::from(count).sqrt();
                assert!((mean - expected).abs() < 4.0 * error + 1e-12, "{n}: {mean} ± {error}, {expected}");
            }
        }
    }
}
