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
use crate::gather::pixel_lattice::skewed;

/// Layers looked at, to a factor of two: many times as many as are drawn.
const LOOKED: usize = 16_384;

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
    /// Every layer of some pixels, in order: one in [`IrradianceCache::pixel_stride`] pixels in each row and column,
    /// others from turn to turn.
    pub fn layer_fits(&self, pixels: &[Pixel], turn: u32) -> Vec<LayerFit> {
        let (width, stride) = (self.width(), self.pixel_stride());
        let of_pixel = |fitted: &mut Fitted, k: usize| -> Vec<LayerFit> {
            if !(skewed(k, width) + turn as usize).is_multiple_of(stride) {
                return Vec::new();
            }
            (0..pixels[k].layers.len()).map(|l| self.layer_fit(fitted, &pixels[k], [k, l])).collect()
        };
        let all = (0..pixels.len()).into_par_iter();
        all.map_init(Default::default, of_pixel).flatten_iter().collect()
    }

    /// One in so many pixels is looked at: errors larger than a few pixels show in some of them.
    pub fn pixel_stride(&self) -> usize {
        (self.record_of.len() / LOOKED).max(1)
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

/// The fewest that leave no more uncertainty than `rest` to the others, the least certain first.
pub(crate) fn least_certain(mut fits: Vec<LayerFit>, rest: f64) -> Vec<LayerFit> {
    let mut left: f64 = fits.iter().map(|fit| fit.uncertainty).sum();
    let place = |fit: &LayerFit| (fit.pixel, fit.layer);
    fits.sort_unstable_by(|a, b| b.uncertainty.total_cmp(&a.uncertainty).then(place(a).cmp(&place(b))));
    fits.into_iter()
        .take_while(|fit| {
            let before = left;
            left -= fit.uncertainty;
            fit.uncertainty > 0.0 && before > rest
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::adaptive_sampling::sample_pixels;
    use crate::gather::camera_rays::CameraRays;
    use crate::gather::fields::Fields;
    use crate::gather::final_gather::FinalGather;
    use crate::gather::sampling::Gathering;
    use crate::gather::settings::Settings;
    use crate::light::{Mode, Rgb};

    #[test]
    fn turns_look_at_every_layer_once() {
        let lights = lights_of("cornell-box", Mode::Global.transport(), 100);
        let view = View::new(&lights, (224, 224).into());
        let fields = Fields::new(&[vec![Rgb::ONE; view.patches.len()]]);
        let settings = Settings::new(&view, &fields, &Gathering::Within { error: 0.1, seed: 0, deadline: None });
        let camera_rays = CameraRays::new(&view, &fields, &settings.camera);
        let pixels = sample_pixels(&camera_rays, &settings.plan, &|_| ());
        let final_gather = FinalGather::new(&view, &fields);
        let mut cache = IrradianceCache::new(&camera_rays, &final_gather, settings.density, &pixels);
        cache.place(&pixels);
        let stride = cache.pixel_stride() as u32;
        assert!(stride > 1, "one turn looks at all");
        let mut times = vec![0; cache.record_of.len()];
        for fit in (0..stride).flat_map(|turn| cache.layer_fits(&pixels, turn)) {
            times[cache.starts[fit.pixel] + fit.layer] += 1;
        }
        assert!(times.iter().all(|&n| n == 1));
    }

    #[test]
    fn as_few_layers_are_chosen_as_leave_little_uncertain() {
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
        let chosen = |of: &[f64], rest: f64| -> Vec<usize> {
            least_certain(fits(of), rest).iter().map(|fit| fit.pixel).collect()
        };
        let of = [1.0, 0.0, 6.0, 1.0, 2.0];
        assert_eq!(chosen(&of, 10.0), [0; 0]);
        assert_eq!(chosen(&of, 9.9), [2]);
        assert_eq!(chosen(&of, 3.0), [2, 4]);
        // Never those of which all is known.
        assert_eq!(chosen(&of, -1.0), [2, 4, 0, 3]);
    }
}
