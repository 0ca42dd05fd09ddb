//! What the records say at every layer of every pixel, and how uncertain that is.
//!
//! A fit's value is `sum c_j v_j` over its records. Were those drawn by chance from light that varies about it as they
//! do, the squared error would be
//!
//! ```text
//! sum c_j² * spread,    spread = sum |c_j| (v_j - fit)²
//! ```
//!
//! with the noise of their rays in it. Light that is linear over the records has a spread too, though the fit follows
//! it: this tells where errors may lie, not how large they are. In a room of lamps in cans a hundredth of the layers
//! makes a quarter of it and of the error, a twentieth three quarters of both; in a bathroom a hundredth all of both.
//!
//! Not handled: how far the fit is off; [`crate::gather::fit_error`] and [`crate::gather::cross_validation`] tell that.

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::cached_irradiance::Fitted;
use crate::gather::irradiance_cache::IrradianceCache;
use crate::gather::pixel::Pixel;

/// A layer of a pixel, as one of [`IrradianceCache::layer_fits`].
pub(crate) struct LayerFit {
    pub pixel: usize,
    pub layer: usize,
    /// Irradiance over pi of both halves, the fields that make the picture together.
    pub fitted: [DVec3; 2],
    /// Reflectance in the mean over the pixel's camera rays.
    pub rho: DVec3,
    /// How much the pixel counts.
    pub weight: f64,
    /// Squared light that it reflects, as much as it counts, channels added.
    pub light: f64,
    /// What the spread of its records would leave, as much as it counts.
    pub uncertainty: f64,
    /// Rays of a half that stand behind the fit: as many from here would have its variance.
    pub rays: f64,
}

impl IrradianceCache<'_> {
    /// Every layer of every pixel, in order.
    pub fn layer_fits(&self, pixels: &[Pixel]) -> Vec<LayerFit> {
        let of_pixel = |fitted: &mut Fitted, k: usize| -> Vec<LayerFit> {
            (0..pixels[k].layers.len()).map(|l| self.layer_fit(fitted, &pixels[k], [k, l])).collect()
        };
        let all = (0..pixels.len()).into_par_iter();
        all.map_init(Default::default, of_pixel).flatten_iter().collect()
    }

    /// Layer l of pixel k.
    fn layer_fit(&self, fitted: &mut Fitted, pixel: &Pixel, [k, l]: [usize; 2]) -> LayerFit {
        let layer = &pixel.layers[l];
        self.at(fitted, k, l, layer);
        let fit @ [a, b] = self.total(&fitted.values);
        let (rho, weight) = (layer.mean_reflectance(pixel.camera()), pixel.weight());
        let mean = 0.5 * (a + b);
        let (mut spread, mut variance) = (0.0, 0.0);
        for &(i, coefficient) in &fitted.fit.coefficients {
            let [u, v] = self.total(self.means(i as usize));
            spread += coefficient.abs() * (rho * (0.5 * (u + v) - mean)).length_squared();
            variance += coefficient * coefficient / f64::from(self.records[i as usize].rays.max(1));
        }
        LayerFit {
            pixel: k,
            layer: l,
            fitted: fit,
            rho,
            weight,
            light: weight * (rho * mean).length_squared(),
            uncertainty: weight * fitted.fit.variance() * spread,
            rays: if variance > 0.0 { variance.recip() } else { 1.0 },
        }
    }
}

/// The fewest that hold a share of all uncertainty, the least certain first.
pub(crate) fn least_certain(mut fits: Vec<LayerFit>, share: f64) -> Vec<LayerFit> {
    let all: f64 = fits.iter().map(|fit| fit.uncertainty).sum();
    let place = |fit: &LayerFit| (fit.pixel, fit.layer);
    fits.sort_unstable_by(|a, b| b.uncertainty.total_cmp(&a.uncertainty).then(place(a).cmp(&place(b))));
    let mut sum = 0.0;
    fits.into_iter()
        .take_while(|fit| {
            let before = sum;
            sum += fit.uncertainty;
            fit.uncertainty > 0.0 && before < share * all
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_layers_hold_most_of_what_is_uncertain() {
        let fits = |uncertainties: &[f64]| -> Vec<LayerFit> {
            let fit = |(pixel, &uncertainty): (usize, &f64)| LayerFit {
                pixel,
                layer: 0,
                fitted: [DVec3::ZERO; 2],
                rho: DVec3::ONE,
                weight: 1.0,
                light: 1.0,
                uncertainty,
                rays: 1.0,
            };
            uncertainties.iter().enumerate().map(fit).collect()
        };
        let chosen = |of: &[f64], share: f64| -> Vec<usize> {
            least_certain(fits(of), share).iter().map(|fit| fit.pixel).collect()
        };
        let of = [1.0, 0.0, 6.0, 1.0, 2.0];
        assert_eq!(chosen(&of, 0.5), [2]);
        assert_eq!(chosen(&of, 0.75), [2, 4]);
        // All, though sums in another order may miss the whole by rounding; never those of which all is known.
        assert_eq!(chosen(&of, 1.0), [2, 4, 0, 3]);
        assert!(chosen(&[0.0, 0.0], 1.0).is_empty());
    }
}
