//! What sampling begins with, and how the error of the gather pass is shared out between its parts.
//!
//! Not handled: errors of the solution that is gathered.

use crate::gather::adaptive_sampling::Plan;
use crate::gather::camera_rays::CameraSampling;
use crate::gather::fields::Fields;
use crate::gather::indirect_light::IndirectLight;
use crate::gather::irradiance_cache::{Density, IrradianceCache};
use crate::gather::pixel::Pixel;
use crate::gather::record_rounds::{Rounds, foreseen};
use crate::gather::sampling::{Gathering, is_over};
use crate::gather::view::View;
use crate::light::budget::CAMERA;

/// Valid radius over the distance to the surroundings where every pixel has records.
const RADIUS: f64 = 0.15;
/// Valid radius over the distance to the surroundings at first, at an error of 1 %. Measured on the Cornell box, the
/// fit's bias grows as its power 1.2.
const WITHIN: f64 = 0.18;
/// The least valid radius at first, in pixels, at an error of 1 %.
const LEAST: f64 = 3.0;
/// Rays of a half at first, at an error of 1 %.
const RAYS: f64 = 128.0;

/// What [`Gathering`] comes to for one picture.
pub(crate) struct Settings {
    pub plan: Plan,
    pub density: Density,
    pub camera: CameraSampling,
    error: Option<f64>,
}

impl Settings {
    /// The first guess; rounds of sampling correct it.
    pub fn new(view: &View, fields: &Fields, gathering: &Gathering) -> Settings {
        match *gathering {
            Gathering::Uniform(sampling) => Settings {
                plan: Plan { first: (sampling.camera / 2).max(1), noise: None, deadline: None },
                density: Density {
                    spacing: 1,
                    rays: (sampling.camera * sampling.hemisphere / 2).max(1),
                    radius: RADIUS,
                    least: 0.0,
                    pixel: view.scene.camera.pixel(view.height),
                    seed: sampling.seed,
                },
                camera: CameraSampling {
                    tabled: sampling.camera.max(1),
                    visibility: sampling.luminaire,
                    seed: sampling.seed,
                },
                error: None,
            },
            Gathering::Within { error, seed, deadline } => {
                // Where there is no time for rounds the first guess is all there is.
                let fineness = if is_over(deadline) { 0.1 } else { (0.01 / error).clamp(0.1, 100.0) };
                let pixel = view.scene.camera.pixel(view.height);
                Settings {
                    plan: Plan {
                        first: ((2.0 * fineness) as u32).clamp(2, 16).next_power_of_two(),
                        noise: Some(error * if fields.is_dark() { 1.0 } else { CAMERA }),
                        deadline,
                    },
                    density: Density {
                        spacing: spacing(view.width.max(view.height)),
                        rays: ((RAYS * fineness.powf(1.4)) as u32).max(16),
                        radius: WITHIN * fineness.powf(-0.5),
                        least: LEAST * fineness.powf(-0.3),
                        pixel,
                        seed,
                    },
                    camera: CameraSampling {
                        tabled: 64,
                        // The ratio of few drawn points is biased.
                        visibility: view.lights.visibility_rays(),
                        seed,
                    },
                    error: Some(error),
                }
            }
        }
    }

    /// Places records and casts their rays until noise and bias are within their parts.
    pub fn gather_indirect(&self, pixels: &[Pixel], cache: &mut IrradianceCache) -> IndirectLight {
        cache.place(pixels);
        let misfit = self.error.map(|error| Rounds::new(cache, pixels, error).run(&self.plan));
        let found = IndirectLight::new(pixels, cache, 1);
        let foreseen = || foreseen(cache, pixels, &cache.biases(), found.measure(pixels).signal);
        let misfit = misfit.unwrap_or_else(foreseen);
        found.biased_by(misfit)
    }
}

/// Pixels between the records of the coarsest lattice: some 32 records across the picture.
fn spacing(length: usize) -> usize {
    let most = (length / 32).clamp(1, 16);
    1 << most.ilog2()
}
