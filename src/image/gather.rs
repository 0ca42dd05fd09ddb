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

use glam::Vec3;

use super::Picture;
use super::budget::Settings;
use super::found::Found;
use super::hemisphere::Reader;
use super::linear::{Linear, linear};
use super::pixel::Pass;
use super::points::Points;
use super::residual::Reading;
use super::spread::sample_pixels;
use crate::form_factors::{Luminaires, Progress, Sight};
use crate::light::{Light, Rgb, Transport};
use crate::patches::Patches;
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
        GatherSampling {
            camera,
            luminaire: (hemisphere / 2).max(1),
            hemisphere,
            seed,
        }
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
    },
}

impl From<&GatherSampling> for Gathering {
    fn from(sampling: &GatherSampling) -> Gathering {
        Gathering::Uniform(*sampling)
    }
}

/// `L'`, the invisible light that hemisphere rays read, one or more fields of it at once.
#[derive(Clone, Debug)]
pub struct Fields {
    count: usize,
    /// The fields that add up to the picture come first.
    leading: usize,
    /// Patch by patch, field by field.
    values: Vec<Linear>,
    /// Irradiance over pi of the patches themselves; empty where it is not known.
    ambient: Vec<Rgb>,
    /// The first field without what luminaires send there directly; empty where it is not known.
    without_direct: Vec<Linear>,
    /// How gather rays read.
    reading: Reading,
    /// Patches met by shorter rays than this are not read, the rays go on; empty where all are.
    near: Vec<f32>,
}

impl Fields {
    /// Fields of one value a patch.
    ///
    /// # Panics
    /// If the fields differ in length.
    pub fn new(fields: &[Vec<Rgb>]) -> Fields {
        let constant = |field: &Vec<Rgb>| field.iter().map(|v| Linear::constant(*v)).collect();
        Fields::linear(&fields.iter().map(constant).collect::<Vec<_>>())
    }

    /// Interleaves fields that are linear within each patch.
    ///
    /// # Panics
    /// If the fields differ in length.
    pub fn linear(fields: &[Vec<Linear>]) -> Fields {
        let patches = fields.first().map_or(0, Vec::len);
        assert!(fields.iter().all(|f| f.len() == patches));
        let values = (0..patches).flat_map(|i| fields.iter().map(move |f| f[i]));
        Fields {
            count: fields.len(),
            leading: fields.len(),
            values: values.collect(),
            ambient: Vec::new(),
            without_direct: Vec::new(),
            reading: Reading::PLAIN,
            near: Vec::new(),
        }
    }

    /// Only the first `leading` fields make the picture; the others ride along on the same rays.
    pub fn led_by(mut self, leading: usize) -> Fields {
        self.leading = leading.min(self.count);
        self
    }

    /// The fields that make the picture, without those that ride along.
    pub fn led(&self) -> Fields {
        let own = self.values.chunks_exact(self.count.max(1));
        Fields {
            count: self.leading,
            leading: self.leading,
            values: own.flat_map(|v| &v[..self.leading]).copied().collect(),
            ambient: self.ambient.clone(),
            without_direct: self.without_direct.clone(),
            reading: self.reading,
            near: self.near.clone(),
        }
    }

    /// Adds what the patches themselves receive of these fields, irradiance over pi: it tells edges of indirect light before
    /// any of it is gathered.
    pub fn with_ambient(mut self, ambient: Vec<Rgb>) -> Fields {
        self.ambient = ambient;
        self
    }

    /// Adds what the first field is without the direct light of luminaires, two estimates of that light given, for readers that
    /// ask for it where they read.
    pub fn with_rest(mut self, direct: [Vec<Rgb>; 2], patches: &Patches) -> Fields {
        let neighbours = patches.neighbours();
        let [a, b] = direct.map(|values| linear(&neighbours, &values));
        let rest = |i: usize| {
            let direct = a[i].mix(0.5, &b[i], 0.5);
            self.of_patch(i as u32)[0].mix(1.0, &direct, -1.0)
        };
        self.without_direct = (0..a.len()).map(rest).collect();
        self
    }

    /// Has gather rays read in some way; asked light and further rays tell the first field only.
    pub fn read_by(mut self, reading: Reading) -> Fields {
        self.reading = reading;
        self
    }

    /// Has rays go on that meet a patch nearer than its number, in unit coordinates.
    pub fn not_read_nearer(mut self, near: Vec<f32>) -> Fields {
        self.near = near;
        self
    }

    /// Whether a ray of this length is too short to read the patch it meets.
    #[inline]
    pub(super) fn is_near(&self, patch: u32, distance: f32) -> bool {
        self.near
            .get(patch as usize)
            .is_some_and(|&near| distance < near)
    }

    /// Whether every ray reads the first patch that it meets.
    pub(super) fn is_read_at_once(&self) -> bool {
        self.near.is_empty() && self.reading == Reading::PLAIN
    }

    /// The first field at a point of a patch, without the direct light of luminaires.
    #[inline]
    pub(super) fn without_direct(&self, patch: u32, position: Vec3) -> Rgb {
        match self.without_direct.get(patch as usize) {
            Some(rest) => rest.at(position),
            None => self.of_patch(patch)[0].at(position),
        }
    }

    /// Number of fields.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Number of fields that make the picture.
    pub(super) fn leading(&self) -> usize {
        self.leading
    }

    /// Whether no field has any light.
    pub fn is_dark(&self) -> bool {
        self.values.iter().all(|v| *v == Linear::DARK)
    }

    #[inline]
    pub(crate) fn of_patch(&self, patch: u32) -> &[Linear] {
        let start = patch as usize * self.count;
        &self.values[start..start + self.count]
    }

    #[inline]
    pub(super) fn ambient(&self, patch: u32) -> Rgb {
        self.ambient
            .get(patch as usize)
            .copied()
            .unwrap_or(Rgb::ZERO)
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
    pub(super) leading: usize,
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
        if self.signal > 0.0 {
            sum.sqrt() / self.signal
        } else {
            0.0
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

/// Renders the visible half.
pub fn gather(view: &View, fields: &Fields, gathering: &Gathering, tick: Progress) -> Gathered {
    let settings = Settings::new(view, fields, gathering);
    let pass = Pass::new(view, fields, settings.tabled, settings.seed);
    let mut pixels = sample_pixels(&pass, &settings.plan, tick);
    let reader = Reader::new(view, fields, fields.reading);
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

/// The invisible half of patch light, as a field to gather.
pub fn invisible(light: &[Light]) -> Vec<Rgb> {
    light.iter().map(|l| l.invisible).collect()
}
