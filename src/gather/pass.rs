//! The gather pass: the visible half of L at every pixel, from the solution on patches.
//!
//! ```text
//! pixel = mean over the box of   E_visible                                     seen directly
//!                              + rho * sum over luminaires of F(x) V(x) E      closed form × visibility
//!                              + rho * F^tau L'                                hemisphere rays that read the solution
//! ```
//!
//! with `L'` the invisible light of the patches less what luminaires emit. Direct light is evaluated at the points seen;
//! irradiance from patches at points chosen where it varies, with a linear fit between them, so no patch edge shows. Several fields `L'` are gathered from the same rays, one picture each: the bounces of a
//! series cost no more rays than their sum. A camera ray ends at the first surface whatever its tau, as in the paper;
//! the back of a one-sided face is black.
//!
//! No visibility ray is cast where nothing can occlude, and no hemisphere ray where no field has light.
//!
//! Not handled: depth of field, motion, filters other than the box.

use std::time::Instant;

use crate::direct::{Luminaires, Sight};
use crate::form_factors::Progress;
use crate::gather::adaptive_sampling::sample_pixels;
use crate::gather::assembled::Found;
use crate::gather::budget::Settings;
use crate::gather::camera_rays::Pass;
use crate::gather::fields::Fields;
use crate::gather::final_gather::Reader;
use crate::gather::irradiance_cache::Points;
use crate::light::Transport;
use crate::patches::Patches;
use crate::pictures::Picture;
use crate::rays::Rays;
use crate::scene::Scene;

/// What the camera looks at.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// The scene, with its camera.
    pub scene: &'a Scene,
    /// Its rays.
    pub rays: &'a Rays,
    /// Its patches.
    pub patches: &'a Patches,
    /// Emitters evaluated by closed form.
    pub luminaires: &'a Luminaires,
    /// What lies between patches and luminaires.
    pub sight: &'a Sight,
    /// (alpha, tau) of every material.
    pub transports: &'a [Transport],
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

/// How many rays, the same for every pixel.
#[derive(Clone, Copy, Debug)]
pub struct GatherSampling {
    /// Camera rays a pixel, in two halves.
    pub camera: u32,
    /// Visibility rays a camera ray and luminaire.
    pub luminaire: u32,
    /// Hemisphere rays for each camera ray.
    pub hemisphere: u32,
    /// Chooses the scrambling of the points.
    pub seed: u32,
}

impl GatherSampling {
    /// Spreads about `samples` hemisphere rays a pixel over camera rays: 16 of those at least, then one for each 8.
    ///
    /// Measured on the Cornell box: edges in a picture want as many camera rays as its insides want rays to look around.
    pub fn with_samples(samples: u32, seed: u32) -> GatherSampling {
        let samples = samples.clamp(1, 1 << 20).next_power_of_two();
        let camera = (samples / 8).max(samples.min(16));
        let hemisphere = samples / camera;
        GatherSampling { camera, luminaire: (hemisphere / 2).max(1), hemisphere, seed }
    }
}

/// How well the picture is to be gathered.
#[derive(Clone, Copy, Debug)]
pub enum Gathering {
    /// The same rays for every pixel, and irradiance from each pixel's own point.
    Uniform(GatherSampling),
    /// Rays where they are needed until the estimated error is below `error`: RMS, as a share of the RMS picture, over the pixels
    /// that see no luminaire.
    Within {
        /// The error.
        error: f64,
        /// Chooses the scrambling of the points.
        seed: u32,
        /// When to stop, whatever the error is by then.
        deadline: Option<Instant>,
    },
}

impl From<&GatherSampling> for Gathering {
    fn from(sampling: &GatherSampling) -> Gathering {
        Gathering::Uniform(*sampling)
    }
}

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
    /// Bias of the fit between irradiance points.
    pub fit: f64,
    /// RMS of the picture.
    pub signal: f64,
}

impl GatherError {
    /// All parts together, as a share of the picture; 0 for a black picture.
    pub fn relative(&self) -> f64 {
        let sum = self.camera.powi(2) + self.hemisphere.powi(2) + self.fit.powi(2);
        if self.signal > 0.0 { sum.sqrt() / self.signal } else { 0.0 }
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

/// Renders the visible half.
pub fn gather(view: &View, fields: &Fields, gathering: &Gathering, tick: Progress) -> Gathered {
    let settings = Settings::new(view, fields, gathering);
    let pass = Pass::new(view, fields, settings.tabled, settings.seed);
    let mut pixels = sample_pixels(&pass, &settings.plan, tick);
    let reader = Reader::new(view, fields, fields.reading());
    let mut points = Points::new((&pass, &reader), settings.density, &pixels);
    let mut found = Found::default();
    if !fields.is_dark() {
        found = settings.gather_indirect(&pixels, &mut points, fields);
        found.sharpen(&pass, &mut pixels, &points, settings.plan.noise);
    }
    let mut gathered = found.assemble(&pixels, fields, (view.width, view.height));
    gathered.rays += points.cast;
    gathered
}
