//! Whether two pictures agree: a z-test of every pixel, and of the mean.
//!
//! For each pixel and channel `z = |a - b| / sqrt(se_a² + se_b² + sys_a² + sys_b²)`; under agreement z is at most
//! standard normal. With m numbers tested, one may exceed the quantile of 1 - LEVEL/(2m) (Bonferroni) only with
//! probability LEVEL, so any that does is a pixel that fails. The means must agree within their own quantile too.
//! Standard errors of a pixel's own samples are rough and, where light is rare, too small just where the picture is too
//! dark. So the largest variance among a pixel and its eight neighbours counts (a few repetitions often make one pixel of
//! an edge seem free of noise, seldom three), or the mean over a wider window if that is larger. This makes the test
//! conservative: in a picture of even noise by up to 1.6 standard errors for four repetitions, by little for many samples.
//!
//! Not handled: spatial patterns too weak for any pixel and too balanced for the mean.

use super::Estimate;
use super::patchwise::smoothed;
use crate::image::Picture;
use crate::light::Rgb;

/// Probability of calling two equal pictures different.
const LEVEL: f64 = 0.01;

/// Half the window over which variances are pooled, in pixels.
const POOL: usize = 3;

/// Two methods, compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// Whether no pixel fails and the means agree.
    pub agree: bool,
    /// Relative difference of the means, the channel that differs most in standard errors.
    pub mean_difference: f64,
    /// Half the width of its 95 % confidence interval.
    pub mean_difference_error: f64,
    /// Pixels that fail.
    pub failing_pixels: usize,
    /// Pixels tested.
    pub pixels: usize,
}

/// Compares two estimates over the mask.
pub fn judge(a: &Estimate, b: &Estimate, mask: &Picture) -> Pair {
    let (va, vb) = (variance(a, mask), variance(b, mask));
    let counted: Vec<usize> = (0..mask.pixels.len())
        .filter(|&k| mask.pixels[k].x >= 0.5)
        .collect();
    let threshold = normal_quantile(1.0 - LEVEL / (6.0 * counted.len().max(1) as f64));
    let fails = |&&k: &&usize| {
        (0..3).any(|c| {
            let apart = f64::from((a.picture.pixels[k][c] - b.picture.pixels[k][c]).abs());
            // Rounding of the pictures themselves, for scenes without any noise.
            let rounding = 1e-6 * f64::from(a.picture.pixels[k][c].abs());
            apart > threshold * f64::from(va.pixels[k][c] + vb.pixels[k][c]).sqrt() + rounding
        })
    };
    let failing_pixels = counted.iter().filter(fails).count();
    let (difference, error) = mean_difference(a, b, mask);
    // Three channels are tested, at LEVEL together.
    let means_agree = difference.abs() <= normal_quantile(1.0 - LEVEL / 6.0) * error + 1e-6;
    Pair {
        agree: failing_pixels == 0 && means_agree,
        mean_difference: difference,
        mean_difference_error: 1.96 * error,
        failing_pixels,
        pixels: counted.len(),
    }
}

/// Squared errors of a pixel, noise and systematic, per channel.
fn variance(e: &Estimate, mask: &Picture) -> Picture {
    let squared = |p: &Picture| Picture {
        width: p.width,
        height: p.height,
        pixels: p.pixels.iter().map(|v| *v * *v).collect(),
    };
    let black = || Picture::new(e.picture.width, e.picture.height);
    let own = e.noise.as_ref().map_or_else(black, squared);
    let pooled = smoothed(&own, POOL, mask);
    let systematic = e.systematic.as_ref().map_or_else(black, squared);
    let largest = largest_near(&own, mask);
    let at = |k: usize| largest.pixels[k].max(pooled.pixels[k]) + systematic.pixels[k];
    Picture {
        pixels: (0..own.pixels.len()).map(at).collect(),
        ..own
    }
}

/// Largest of each pixel and its eight neighbours, channel by channel, within the mask.
fn largest_near(picture: &Picture, mask: &Picture) -> Picture {
    let (width, height) = picture.size();
    Picture::from_fn(width, height, |x, y| {
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        let near = rows.flat_map(|v| {
            let columns = x.saturating_sub(1)..(x + 2).min(width);
            columns.map(move |u| v * width + u)
        });
        let counted = near.filter(|&k| mask.pixels[k].x >= 0.5);
        counted.fold(Rgb::ZERO, |m, k| m.max(picture.pixels[k]))
    })
}

/// Relative difference of the masked means and its standard error, of the channel where it is largest in these.
fn mean_difference(a: &Estimate, b: &Estimate, mask: &Picture) -> (f64, f64) {
    let (ma, mb) = (masked_mean(&a.picture, mask), masked_mean(&b.picture, mask));
    let mut worst = (0.0, 0.0);
    for c in 0..3 {
        let size = 0.5 * (ma[c] + mb[c]);
        if size > 0.0 {
            let apart = (ma[c] - mb[c]) / size;
            let error = a.mean_error[c].hypot(b.mean_error[c]) / size;
            let rank = |(d, e): (f64, f64)| d.abs() / e.max(1e-12);
            if worst == (0.0, 0.0) || rank((apart, error)) > rank(worst) {
                worst = (apart, error);
            }
        }
    }
    worst
}

/// Mean radiance of the pixels of a mask, per channel.
pub(super) fn masked_mean(picture: &Picture, mask: &Picture) -> [f64; 3] {
    let counted = |k: &usize| mask.pixels[*k].x >= 0.5;
    let chosen: Vec<Rgb> = (0..picture.pixels.len())
        .filter(counted)
        .map(|k| picture.pixels[k])
        .collect();
    let n = chosen.len().max(1) as f64;
    [0, 1, 2].map(|c| chosen.iter().map(|p| f64::from(p[c])).sum::<f64>() / n)
}

/// Quantile of the standard normal distribution for p in (1/2, 1): bisection on its tail, `erfc` by its continued
/// fraction and series.
fn normal_quantile(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if upper_tail(middle) > 1.0 - p {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

/// Probability that a standard normal number exceeds z >= 0.
fn upper_tail(z: f64) -> f64 {
    let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    if z < 3.0 {
        // 1/2 less the density's Taylor series about 0.
        let (mut term, mut sum, mut k) = (z, z, 1.0);
        while term > 1e-17 * sum {
            term *= z * z / (2.0 * k + 1.0);
            sum += term;
            k += 1.0;
        }
        0.5 - density * sum
    } else {
        // Laplace's continued fraction, from the tail forward.
        density / (1..60).rev().fold(z, |f, k| z + f64::from(k) / f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value: impl Fn(usize) -> f32, noise: f32) -> Estimate {
        let picture = Picture::from_fn(32, 32, |x, y| Rgb::splat(value(y * 32 + x)));
        Estimate {
            seconds: 1.0,
            effort: String::new(),
            noise: Some(Picture::filled(32, 32, Rgb::splat(noise))),
            systematic: None,
            orders: Vec::new(),
            order_noise: None,
            mean_error: [f64::from(noise) / 32.0; 3],
            picture,
        }
    }

    /// A number of zero mean and unit variance from an index.
    fn wobble(k: usize) -> f32 {
        let x = crate::rays::sequence::hash(k as u32, 7) as f32 / u32::MAX as f32;
        12f32.sqrt() * (x - 0.5)
    }

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (p, z) in [
            (0.975, 1.959_963_985),
            (0.999, 3.090_232_306),
            (1.0 - 1e-7, 5.199_337_582),
        ] {
            assert!((normal_quantile(p) - z).abs() < 1e-8, "{p}");
        }
    }

    #[test]
    fn noise_agrees_and_a_shifted_pixel_does_not() {
        let mask = Picture::filled(32, 32, Rgb::ONE);
        let a = estimate(|k| 1.0 + 0.01 * wobble(k), 0.01);
        let b = estimate(|_| 1.0, 0.0);
        assert!(judge(&a, &b, &mask).agree);
        let c = estimate(|k| if k == 100 { 1.1 } else { 1.0 }, 0.0);
        let pair = judge(&a, &c, &mask);
        assert_eq!((pair.agree, pair.failing_pixels), (false, 1));
    }

    #[test]
    fn a_shift_of_the_mean_too_small_for_any_pixel_is_found() {
        let mask = Picture::filled(32, 32, Rgb::ONE);
        let a = estimate(|k| 1.0 + 0.01 * wobble(k), 0.01);
        let b = estimate(|_| 1.004, 0.0);
        let pair = judge(&a, &b, &mask);
        assert_eq!(pair.failing_pixels, 0);
        assert!(!pair.agree);
    }
}
