//! The result of the gather pass: the parts of the picture, and the parts of their error.
//!
//! Not handled: errors of the solution that is gathered.

use crate::pictures::Picture;

/// Share of the RMS of a noisy picture that is taken to be signal at least.
const LEAST_SIGNAL: f64 = 0.25;

/// The parts of the picture.
#[derive(Clone, Debug)]
pub struct Gathered {
    /// `E_visible`.
    pub emission: Picture,
    /// The first bounce of luminaires.
    pub direct: Picture,
    /// What each field sends.
    pub indirect: Vec<Picture>,
    /// Standard error of the picture that the picture fields make.
    pub standard_error: Picture,
    /// Estimated error.
    pub error: GatherError,
    /// The picture taken apart: the emitters, then the bounces, each of which add up to it; empty where it is not.
    pub layers: Vec<GatheredLayer>,
    /// RMS of the picture of each auxiliary field, over the pixels that see no luminaire, W/(m² sr).
    pub auxiliary_rms: Vec<f64>,
    /// Share of the camera rays that met the black back of a one-sided face.
    pub backs: f64,
    /// Share of the camera rays that met a side that reflects.
    pub sees: f64,
    /// Rays of a camera ray to luminaires and punctual lights, in the mean.
    pub luminaire_rays: f64,
    /// Rays cast.
    pub rays: u64,
    pub(crate) picture_fields: usize,
}

/// A part of the picture.
#[derive(Clone, Debug)]
pub struct GatheredLayer {
    /// Linear radiance.
    pub picture: Picture,
    /// What half A of all rays shows less the picture; half B, independent but for the light on patches, lacks as much.
    pub half: Picture,
    /// Standard error of every pixel.
    pub standard_error: Picture,
    /// RMS of what it adds to reflected light, over the pixels that see no luminaire, W/(m² sr).
    pub rms: f64,
    /// RMS of the noise of that and of its part of the fit between irradiance records.
    pub noise: f64,
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
    /// Noise of what all pixels show of light as emitted, and the RMS of that.
    pub emission: [f64; 2],
}

impl GatherError {
    /// All parts together, as a share of the picture; 0 for a black picture.
    pub fn relative(&self) -> f64 {
        self.share((self.camera.powi(2) + self.hemisphere.powi(2) + self.fit.powi(2)).sqrt())
    }

    /// The error of light as emitted, as a share of it; 0 where the picture shows none.
    pub fn of_emission(&self) -> f64 {
        let [noise, shown] = self.emission;
        GatherError { signal: shown, ..GatherError::default() }.share(noise)
    }

    /// These errors over the signal less the noise in it, `sqrt(signal² - camera² - hemisphere²)`; a quarter of the RMS
    /// at least.
    pub(crate) fn over_signal_alone(self) -> GatherError {
        let squared = self.signal.powi(2) - self.camera.powi(2) - self.hemisphere.powi(2);
        GatherError { signal: squared.max((LEAST_SIGNAL * self.signal).powi(2)).sqrt(), ..self }
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
    /// Emission, direct light and the picture fields together.
    pub fn total(&self) -> Picture {
        let mut total = self.emission.clone();
        let parts = std::iter::once(&self.direct).chain(&self.indirect[..self.picture_fields]);
        for part in parts {
            for (sum, p) in total.pixels.iter_mut().zip(&part.pixels) {
                *sum += *p;
            }
        }
        total
    }

    /// The picture whose pixels are the means of `step` by `step` of these. Noise of camera rays is independent from
    /// pixel to pixel, so its variances add up; the RMS of all other errors does not grow by averaging.
    pub(crate) fn averaged(self, step: usize) -> Gathered {
        let mean = |picture: &Picture| picture.averaged(step);
        let squares = |picture: &Picture| picture.pixels.iter().map(|p| p.as_dvec3().length_squared()).sum::<f64>();
        let rms = |picture: &Picture| (squares(picture) / (3 * picture.pixels.len().max(1)) as f64).sqrt();
        let deviation = |of: &Picture| {
            let mut squares = of.clone();
            squares.pixels.iter_mut().for_each(|p| *p *= *p);
            let mut all = mean(&squares);
            all.pixels.iter_mut().for_each(|p| *p = p.map(f32::sqrt) / step as f32);
            all
        };
        let standard_error = deviation(&self.standard_error);
        let layer = |layer: &GatheredLayer| GatheredLayer {
            picture: mean(&layer.picture),
            half: mean(&layer.half),
            standard_error: deviation(&layer.standard_error),
            ..*layer
        };
        let emission = mean(&self.emission);
        let mut reflected = mean(&self.total());
        reflected.pixels.iter_mut().zip(&emission.pixels).for_each(|(p, e)| *p -= *e);
        let shown = [self.error.emission[0] / step as f64, rms(&emission)];
        let error =
            GatherError { camera: rms(&standard_error), signal: rms(&reflected), emission: shown, ..self.error };
        Gathered {
            emission,
            direct: mean(&self.direct),
            indirect: self.indirect.iter().map(mean).collect(),
            layers: self.layers.iter().map(layer).collect(),
            standard_error,
            error,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_no_part_of_the_signal() {
        let signal = |camera: f64, hemisphere: f64| {
            let error =
                GatherError { camera, hemisphere, fit: 3.0, signal: 5.0, emission: [0.0; 2] }.over_signal_alone();
            assert_eq!((error.camera, error.hemisphere, error.fit), (camera, hemisphere, 3.0));
            error.signal
        };
        assert_eq!([signal(0.0, 0.0), signal(4.0, 0.0), signal(0.0, 3.0)], [5.0, 3.0, 4.0]);
        // Noise may be estimated too large, but not all is noise.
        assert_eq!(signal(6.0, 1.0), 1.25);
    }

    #[test]
    fn an_error_that_is_no_number_is_not_small() {
        let error = |camera: f64, signal: f64| GatherError { camera, signal, ..GatherError::default() }.relative();
        assert_eq!([error(1.0, 4.0), error(0.0, 0.0)], [0.25, 0.0]);
        assert_eq!([error(f64::NAN, 1.0), error(1.0, f64::NAN)], [f64::INFINITY; 2]);
    }
}
