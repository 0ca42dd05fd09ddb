//! What pictures are held against: a reference with its standard error, and the error that it measures.
//!
//! ```text
//! reached error = sqrt( max(0, mean(d² - se²)) / mean(R²) )     over pixels that see no luminaire, and channels
//! its range     = the same with mean(d² - se²) ± 2 standard errors of that mean, from its spread over the pixels
//! ```
//!
//! Not handled: errors of a reference that its standard error does not show (what a patch picture is off in the mean:
//! its estimated error is stated).

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use halflight::light::Rgb;
use halflight::pictures::{MetricError, Picture, relative_rms};

/// How a reference was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Made {
    /// By which method, or the user's file.
    pub by: String,
    /// How fine, in words.
    pub effort: String,
    /// In how many seconds.
    pub seconds: f64,
    /// Its own relative RMS error: the path tracer's standard error, the patch picture's estimated error; null where
    /// it is not known.
    pub error: Option<f64>,
}

/// A reference.
#[derive(Clone, Debug, Serialize)]
pub struct Truth {
    /// Linear radiance.
    #[serde(skip)]
    pub picture: Picture,
    /// Standard error of every pixel and channel, which is subtracted.
    #[serde(skip)]
    pub noise: Picture,
    /// 1 in pixels that count.
    #[serde(skip)]
    pub mask: Picture,
    /// How it was made.
    #[serde(flatten)]
    pub made: Made,
    /// Whether it was made by an earlier run.
    pub kept: bool,
    /// Its files.
    pub files: Vec<PathBuf>,
}

/// Error against a reference, and the range in which the reference leaves it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reached {
    /// Relative RMS error, the reference's noise subtracted; 0 where that leaves nothing.
    #[serde(rename = "reached")]
    pub error: f64,
    /// Lower end of its range, two standard errors.
    #[serde(rename = "reached_low")]
    pub low: f64,
    /// Upper end.
    #[serde(rename = "reached_high")]
    pub high: f64,
}

impl Truth {
    /// A reference of this run, without files.
    pub(crate) fn new(picture: Picture, noise: Picture, mask: Picture, made: Made) -> Truth {
        Truth { picture, noise, mask, made, kept: false, files: Vec::new() }
    }

    /// The picture, its standard error and its mask.
    pub(crate) fn pictures(&self) -> [&Picture; 3] {
        [&self.picture, &self.noise, &self.mask]
    }
}

/// A mask, or every pixel where it leaves none, as in a furnace, where all see a luminaire.
pub(crate) fn or_everywhere(mask: Picture) -> Picture {
    if mask.pixels.iter().any(|p| p.x >= 0.5) {
        return mask;
    }
    Picture::filled(mask.width, mask.height, Rgb::ONE)
}

/// Relative RMS error of a picture against a reference.
///
/// # Errors
/// Sizes that differ, values that are not finite, an empty mask, a black reference.
pub fn reached(picture: &Picture, truth: &Truth) -> Result<Reached, MetricError> {
    let error = relative_rms(picture, &truth.picture, Some(&truth.mask), Some(&truth.noise))?;
    let counted = (0..picture.pixels.len()).filter(|&k| truth.mask.pixels[k].x >= 0.5);
    let [mut n, mut sum, mut squares, mut power] = [0.0; 4];
    for k in counted {
        let of = |p: &Picture| p.pixels[k].as_dvec3();
        let apart = of(picture) - of(&truth.picture);
        let excess = apart.length_squared() - of(&truth.noise).length_squared();
        n += 1.0;
        sum += excess;
        squares += excess * excess;
        power += of(&truth.picture).length_squared();
    }
    // Channels of one pixel err together, so a pixel is one sample.
    let spread = (squares - sum * sum / n).max(0.0).sqrt();
    let at = |excess: f64| (excess.max(0.0) / power).sqrt();
    Ok(Reached { error, low: at(sum - 2.0 * spread), high: at(sum + 2.0 * spread) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reference of some noise, every pixel of which counts.
    fn truth(picture: Picture, noise: f32) -> Truth {
        let of = |colour: f32| Picture::filled(picture.width, picture.height, Rgb::splat(colour));
        let made = Made { by: String::new(), effort: String::new(), seconds: 0.0, error: None };
        Truth::new(picture.clone(), of(noise), of(1.0), made)
    }

    /// A number of zero mean and unit variance from an index.
    fn wobble(k: usize, seed: u32) -> f32 {
        let x = halflight::rays::sobol::hash(k as u32, seed) as f32 / u32::MAX as f32;
        12f32.sqrt() * (x - 0.5)
    }

    #[test]
    fn the_references_noise_is_subtracted() {
        let noisy = |noise: f32, seed: u32| {
            Picture::from_fn(100, 100, |x, y| Rgb::ONE + noise * Rgb::splat(wobble(y * 100 + x, seed)))
        };
        let truth = truth(noisy(0.05, 1), 0.05);
        let found = reached(&noisy(0.03, 2), &truth).unwrap();
        assert!(found.low < 0.03 && 0.03 < found.high, "{found:?}");
        // mean(d²) is 0.0034 with a relative standard error of about 1 %: twice that on 0.0009 is 4 % of the error.
        assert!(found.high - found.low < 0.2 * 0.03, "{found:?}");
        let exact = reached(&noisy(0.0, 3), &truth).unwrap();
        // No error of its own: within two standard errors of 0.0025/100 · sqrt(0.8) from zero, so below 0.7 %.
        assert!(exact.low == 0.0 && exact.error < 0.01, "{exact:?}");
    }

    #[test]
    fn a_reference_of_another_size_is_refused() {
        let truth = truth(Picture::filled(4, 4, Rgb::ONE), 0.0);
        let found = reached(&Picture::filled(4, 5, Rgb::ONE), &truth);
        assert!(matches!(found, Err(MetricError::Size { .. })));
    }
}
