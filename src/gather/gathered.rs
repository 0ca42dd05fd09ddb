//! What the gather pass gives: the parts of the picture, and the parts of their error.
//!
//! Not handled: errors of the solution that is gathered.

use crate::pictures::Picture;

/// The parts of the picture.
#[derive(Clone, Debug)]
pub struct Gathered {
    /// `E_visible`.
    pub emission: Picture,
    /// The first bounce of luminaires.
    pub direct: Picture,
    /// What each field sends.
    pub indirect: Vec<Picture>,
    /// Standard error of the picture that the leading fields make.
    pub standard_error: Picture,
    /// Estimated error.
    pub error: GatherError,
    /// RMS of what each field beyond the leading ones sends, over the pixels that see no luminaire, W/(m² sr).
    pub riders: Vec<f64>,
    /// Share of the camera rays that met the black back of a one-sided face.
    pub backs: f64,
    /// Share of the camera rays that met a side that reflects.
    pub sees: f64,
    /// Rays cast.
    pub rays: u64,
    pub(crate) leading: usize,
}

/// Estimated RMS errors over the pixels that see no luminaire, W/(m² sr), and the RMS picture they compare with.
#[derive(Clone, Copy, Debug, Default)]
pub struct GatherError {
    /// Noise of camera rays and visibility.
    pub camera: f64,
    /// Noise of hemisphere rays.
    pub hemisphere: f64,
    /// Bias of the fit between irradiance records.
    pub fit: f64,
    /// RMS of the picture.
    pub signal: f64,
}

impl GatherError {
    /// All parts together, as a share of the picture; 0 for a black picture.
    pub fn relative(&self) -> f64 {
        self.share((self.camera.powi(2) + self.hemisphere.powi(2) + self.fit.powi(2)).sqrt())
    }

    /// An RMS error as a share of the picture: 0 for a black picture, infinite where it is not a number.
    pub fn share(&self, rms: f64) -> f64 {
        if rms.is_nan() || self.signal.is_nan() {
            f64::INFINITY
        } else if self.signal == 0.0 {
            0.0
        } else {
            rms / self.signal
        }
    }
}

impl Gathered {
    /// Emission, direct light and the leading fields together.
    pub fn total(&self) -> Picture {
        let mut total = self.emission.clone();
        let parts = std::iter::once(&self.direct).chain(&self.indirect[..self.leading]);
        for part in parts {
            for (sum, p) in total.pixels.iter_mut().zip(&part.pixels) {
                *sum += *p;
            }
        }
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Light that was no number once stated an error of 0 %.
    #[test]
    fn an_error_that_is_no_number_is_not_small() {
        let error = |camera: f64, signal: f64| GatherError { camera, signal, ..GatherError::default() }.relative();
        assert_eq!([error(1.0, 4.0), error(0.0, 0.0)], [0.25, 0.0]);
        assert_eq!([error(f64::NAN, 1.0), error(1.0, f64::NAN)], [f64::INFINITY; 2]);
    }
}
