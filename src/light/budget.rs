//! Shares of the tolerance T that the parts of a picture's error may take, all of them in one place.
//!
//! ```text
//! T² >= light² + gather²                 light  at most LIGHT T
//! light²  = noise of F² + size of patches² + truncation² + stand-ins²
//! gather² = camera² + hemisphere² + fit²                 GATHER² (T² - light²), as the light turned out
//! ```
//!
//! Errors of the parts are independent, so their squares add up; tests hold the sums below 1.
//!
//! Not handled: effort that is given in place of a tolerance.

/// Where the series is cut.
pub const TRUNCATION: f64 = 0.02;
/// Moments of nodes of many luminaires, and polynomials for them, together; also one node of a textured luminaire's
/// closed form, of which all together are then off by at most twice as much, next to wide luminaires.
pub const STAND_INS: f64 = 0.1;
/// Noise of F that rounds aim at where patches have one size.
pub const FORM_FACTORS: f64 = 0.35;
/// The size of patches that rounds aim at.
pub const PATCHES: f64 = 0.4;
/// Noise of F that rounds aim at where patches are divided by light, whose error is estimated with it.
pub const DIVIDED_FORM_FACTORS: f64 = 0.3;
/// The light on patches, however cheap it is to read.
pub const LIGHT: f64 = 0.85;
/// An error of the light that matters, where two levels of patches and noise of F do not know of it.
pub const MATTERS: f64 = 0.7;
/// Root of the standard error of the squared error of the light, as estimated from a few pixels.
pub const SURE: f64 = 0.35;
/// What the gather pass aims at of what remains.
pub const GATHER: f64 = 0.97;
/// What the gather pass has at least, as a share of T², where the light has used up more.
pub const GATHER_LEAST: f64 = 0.25;
/// Camera rays, as a share of the squared error of the gather pass, where there is indirect light: the least and the
/// most; between them it is what costs least.
pub const CAMERA: [f64; 2] = [0.05, 0.5];
/// Outlines of emitters at most, as a share of the squared error of camera rays: none of those lessens what they keep.
pub const OUTLINES: f64 = 0.5;
/// The fit between irradiance records at most, as a share of the squared error that camera rays leave; where it is
/// larger places gather for themselves, and noise of hemisphere rays may use what it leaves.
pub const FIT_SQUARED: f64 = 0.45;
/// The larger picture that one of few pixels is the mean of: its RMS, which errors are relative to, is larger than that
/// of its means.
pub const FEW_PIXELS: f64 = 0.7;

/// The error that the gather pass may make at a tolerance, given the squared error of the light.
pub fn left(tolerance: f64, squared: f64) -> f64 {
    let squares = tolerance * tolerance;
    GATHER * (squares - squared).max(GATHER_LEAST * squares).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn squares(parts: &[f64]) -> f64 {
        parts.iter().map(|part| part * part).sum()
    }

    #[test]
    fn the_squares_of_all_parts_add_up_to_no_more_than_all() {
        for form_factors in [FORM_FACTORS, DIVIDED_FORM_FACTORS] {
            assert!(squares(&[TRUNCATION, STAND_INS, form_factors, PATCHES]) <= LIGHT * LIGHT);
        }
        assert!(squares(&[LIGHT, left(1.0, LIGHT * LIGHT)]) <= 1.0);
        assert_eq!(left(1.0, 0.0), GATHER);
    }
}
