//! Numbers that compare a picture with a reference.
//!
//! I is the picture, R the reference, se the standard error of R; means run over the counted pixels and, for the
//! relative RMS error, over the channels too. Sums are taken in f64, in pixel order.
//!
//! ```text
//! relative RMS error  sqrt( max(0, mean((I-R)^2) - mean(se^2)) / mean(R^2) )      unbiased by the noise of R
//! mean difference     mean(I) - mean(R) per channel, and the same over mean(R)
//! e_pixel             sqrt((dr^2 + dg^2 + db^2) / 3) of one pixel, both pictures clamped to 0..1 first
//! ```
//!
//! A mask counts the pixels in which its red channel is at least one half. Not handled: perceptual measures.
//! Source of e_pixel: Banks and Beason, *Retro-rendering with vector-valued light*, SPIE 6060, 2006.

use crate::light::Rgb;
use crate::pictures::picture::{Picture, Size};

/// Two pictures cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum MetricError {
    /// The sizes differ.
    #[error("the {what} has {} x {} pixels, the picture {} x {}", found.width, found.height, size.width, size.height)]
    #[diagnostic(
        code(halflight::metric::size),
        help("compare pictures of one size: render one again, or reduce the larger one")
    )]
    Size {
        /// `reference`, `mask` or `standard error`.
        what: &'static str,
        /// Its size.
        found: Size,
        /// The picture's size.
        size: Size,
    },
    /// A pixel is NaN or infinite.
    #[error("the {what} has the value {value} at column {x}, row {y}")]
    #[diagnostic(
        code(halflight::metric::value),
        help("a picture with such a pixel has no meaningful error: find out where it comes from")
    )]
    NotFinite {
        /// `picture`, `reference`, `mask` or `standard error`.
        what: &'static str,
        /// The pixel's channels.
        value: Rgb,
        /// Column, 0 on the left.
        x: usize,
        /// Row, 0 on top.
        y: usize,
    },
    /// No pixel is counted.
    #[error("there is no pixel to compare")]
    #[diagnostic(code(halflight::metric::empty), help("the mask must be at least 0.5 somewhere"))]
    Empty,
    /// The reference is black where it counts, so nothing is relative to it.
    #[error("the reference is black in every counted pixel")]
    #[diagnostic(
        code(halflight::metric::black),
        help("a relative error needs a reference that is not black; check that it is the right file")
    )]
    BlackReference,
}

/// Difference of the means of two pictures, per channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanDifference {
    /// `mean(I) - mean(R)` in W/(m² sr).
    pub absolute: [f64; 3],
    /// The same over `mean(R)`; `None` in a channel where that is 0.
    pub relative: [Option<f64>; 3],
}

/// Relative RMS error of `picture`; with the reference's `standard_error` it is unbiased by the reference's noise.
///
/// # Errors
/// Sizes that differ, values that are not finite, an empty mask, a black reference.
pub fn relative_rms(
    picture: &Picture,
    reference: &Picture,
    mask: Option<&Picture>,
    standard_error: Option<&Picture>,
) -> Result<f64, MetricError> {
    let counted = counted(picture, reference, mask)?;
    if let Some(noise) = standard_error {
        check("standard error", noise, picture)?;
    }
    let [mut apart, mut noise, mut power] = [0.0; 3];
    for &i in &counted {
        apart += square(channels(picture.pixels[i], reference.pixels[i]));
        noise += standard_error.map_or(0.0, |se| square(wide(se.pixels[i])));
        power += square(wide(reference.pixels[i]));
    }
    if power == 0.0 {
        return Err(MetricError::BlackReference);
    }
    Ok(((apart - noise).max(0.0) / power).sqrt())
}

/// Difference of the mean radiance per channel, absolute and relative to the reference.
///
/// # Errors
/// Sizes that differ, values that are not finite, an empty mask.
pub fn mean_difference(
    picture: &Picture,
    reference: &Picture,
    mask: Option<&Picture>,
) -> Result<MeanDifference, MetricError> {
    let counted = counted(picture, reference, mask)?;
    let mean = |of: &Picture, channel: usize| {
        let sum: f64 = counted.iter().map(|&i| wide(of.pixels[i])[channel]).sum();
        sum / counted.len() as f64
    };
    let means = [0, 1, 2].map(|c| (mean(picture, c), mean(reference, c)));
    Ok(MeanDifference {
        absolute: means.map(|(i, r)| i - r),
        relative: means.map(|(i, r)| (r != 0.0).then(|| (i - r) / r)),
    })
}

/// The largest difference of one channel at one pixel.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Largest {
    /// `|I - R|` of the channel that differs most, W/(m² sr).
    pub value: f64,
    /// Column, 0 on the left.
    pub x: usize,
    /// Row, 0 on top.
    pub y: usize,
}

/// Where two pictures differ most; the first such pixel in reading order.
///
/// # Errors
/// Sizes that differ, values that are not finite, no pixels.
pub fn largest_difference(picture: &Picture, reference: &Picture) -> Result<Largest, MetricError> {
    let mut largest = Largest { value: -1.0, x: 0, y: 0 };
    for i in counted(picture, reference, None)? {
        let apart = channels(picture.pixels[i], reference.pixels[i]);
        let value = apart.iter().fold(0.0f64, |m, d| m.max(d.abs()));
        if value > largest.value {
            let (x, y) = (i % picture.width, i / picture.width);
            largest = Largest { value, x, y };
        }
    }
    Ok(largest)
}

/// The paper's mean of `e_pixel = sqrt((dr² + dg² + db²)/3)` over all pixels, both pictures clamped to 0..1 first.
///
/// It is a share of full scale: 0 where the pictures are equal, 1 for black against white.
///
/// # Errors
/// Sizes that differ, values that are not finite, no pixels.
pub fn mean_e_pixel(picture: &Picture, reference: &Picture) -> Result<f64, MetricError> {
    let counted = counted(picture, reference, None)?;
    let shown = |p: Rgb| p.clamp(Rgb::ZERO, Rgb::ONE);
    let e_pixel = |&i: &usize| {
        let apart = channels(shown(picture.pixels[i]), shown(reference.pixels[i]));
        (square(apart) / 3.0).sqrt()
    };
    Ok(counted.iter().map(e_pixel).sum::<f64>() / counted.len() as f64)
}

/// The indices of the pixels that count, once everything is known to be comparable.
fn counted(picture: &Picture, reference: &Picture, mask: Option<&Picture>) -> Result<Vec<usize>, MetricError> {
    check("picture", picture, picture)?;
    check("reference", reference, picture)?;
    let all = 0..picture.pixels.len();
    let indices: Vec<usize> = match mask {
        None => all.collect(),
        Some(mask) => {
            check("mask", mask, picture)?;
            all.filter(|&i| mask.pixels[i].x >= 0.5).collect()
        }
    };
    if indices.is_empty() {
        return Err(MetricError::Empty);
    }
    Ok(indices)
}

fn check(what: &'static str, found: &Picture, picture: &Picture) -> Result<(), MetricError> {
    if found.size() != picture.size() {
        return Err(MetricError::Size { what, found: found.size(), size: picture.size() });
    }
    match found.pixels.iter().position(|p| !p.is_finite()) {
        None => Ok(()),
        Some(i) => Err(MetricError::NotFinite { what, value: found.pixels[i], x: i % found.width, y: i / found.width }),
    }
}

fn wide(pixel: Rgb) -> [f64; 3] {
    pixel.to_array().map(f64::from)
}

fn channels(a: Rgb, b: Rgb) -> [f64; 3] {
    let (a, b) = (wide(a), wide(b));
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn square(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(pixels: &[[f32; 3]]) -> Picture {
        Picture { width: pixels.len(), height: 1, pixels: pixels.iter().map(|&p| Rgb::from_array(p)).collect() }
    }

    /// Equal up to the rounding of a handful of f64 operations.
    fn assert_equal(a: f64, b: f64) {
        assert!((a - b).abs() <= 8.0 * f64::EPSILON * b.abs(), "{a} {b}");
    }

    #[test]
    fn relative_rms_by_hand() {
        let picture = row(&[[1.0, 2.0, 3.0], [9.0, 9.0, 9.0]]);
        let reference = row(&[[1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]);
        let mask = row(&[[1.0; 3], [0.0; 3]]);
        // Masked: squares 0, 1, 4 over 3. All: 5 + 3 * 64 = 197 over 6.
        let masked = relative_rms(&picture, &reference, Some(&mask), None).unwrap();
        assert_equal(masked, (5.0_f64 / 3.0).sqrt());
        let all = relative_rms(&picture, &reference, None, None).unwrap();
        assert_equal(all, (197.0_f64 / 6.0).sqrt());
    }

    #[test]
    fn the_noise_of_the_reference_is_taken_off() {
        let (picture, reference) = (row(&[[3.0, 1.0, 1.0]]), row(&[[1.0, 2.0, 2.0]]));
        let noise = row(&[[1.0, 0.5, 0.5]]);
        // (4 + 1 + 1 - 1.5) / (1 + 4 + 4).
        let unbiased = relative_rms(&picture, &reference, None, Some(&noise)).unwrap();
        assert_equal(unbiased, 0.5_f64.sqrt());
        let loud = noise.scaled(100.0);
        let floor = relative_rms(&picture, &reference, None, Some(&loud)).unwrap();
        assert_eq!(floor, 0.0);
    }

    #[test]
    fn mean_differences_by_hand() {
        let picture = row(&[[2.0, 0.0, 0.5], [4.0, 0.0, 0.5]]);
        let reference = row(&[[1.0, 0.0, 1.0], [3.0, 0.0, 1.0]]);
        let difference = mean_difference(&picture, &reference, None).unwrap();
        assert_eq!(difference.absolute, [1.0, 0.0, -0.5]);
        assert_eq!(difference.relative, [Some(0.5), None, Some(-0.5)]);
    }

    #[test]
    fn e_pixel_by_hand() {
        let picture = row(&[[5.0, 1.0, 2.0], [0.5, 0.25, 0.0]]);
        let reference = row(&[[0.0, 0.0, 0.0], [0.5, 0.25, -3.0]]);
        // Black against white is 1, the second pixel is equal once clamped.
        assert_equal(mean_e_pixel(&picture, &reference).unwrap(), 0.5);
        let (a, b) = (row(&[[0.5, 0.25, 0.5]]), row(&[[0.25, 0.5, 0.0]]));
        let expected = ((0.0625 + 0.0625 + 0.25) / 3.0_f64).sqrt();
        assert_equal(mean_e_pixel(&a, &b).unwrap(), expected);
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let fine = row(&[[1.0; 3], [1.0; 3]]);
        let nan = row(&[[1.0; 3], [0.0, f32::NAN, 0.0]]);
        let short = row(&[[1.0; 3]]);
        let black = row(&[[0.0; 3], [0.0; 3]]);
        let error = mean_e_pixel(&fine, &short).unwrap_err();
        assert!(error.to_string().contains("reference has 1 x 1"));
        let error = relative_rms(&nan, &fine, None, None).unwrap_err();
        assert!(matches!(error, MetricError::NotFinite { x: 1, y: 0, .. }));
        assert!(relative_rms(&fine, &fine, None, Some(&nan)).is_err());
        assert_eq!(relative_rms(&fine, &black, None, None), Err(MetricError::BlackReference));
        let empty = mean_difference(&fine, &fine, Some(&black));
        assert_eq!(empty, Err(MetricError::Empty));
    }
}
