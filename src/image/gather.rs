//! The gather pass: the visible half of L at every pixel, from the solution on patches.
//!
//! ```text
//! pixel = mean over the box of   E_visible                                     seen directly
//!                              + rho * sum over luminaires of F(x) V(x) E      closed form × visibility
//!                              + rho * F^tau L'                                hemisphere rays that read the solution
//! ```
//!
//! with `L'` the invisible light of the patches less what luminaires emit. Shading is evaluated at the points seen,
//! so no patch edge shows. Several fields `L'` are gathered from the same rays, one picture each: the bounces of a
//! series cost no more rays than their sum. A camera ray ends at the first surface whatever its tau, as in the paper;
//! the back of a one-sided face is black.
//!
//! No visibility ray is cast where nothing can occlude, and no hemisphere ray where no field has light.
//!
//! Not handled: depth of field, motion, filters other than the box.

use glam::Vec3;
use rayon::prelude::*;

use super::Picture;
use super::irradiance::{Layer, smooth};
use super::pixel::{Pass, Pixel};
use crate::form_factors::{Luminaires, Progress};
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
    /// (alpha, tau) of every material.
    pub transports: &'a [Transport],
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

/// How many rays a pixel gets.
#[derive(Clone, Copy, Debug)]
pub struct GatherSampling {
    /// Camera rays a pixel.
    pub camera: u32,
    /// Visibility rays a camera ray and luminaire.
    pub luminaire: u32,
    /// Hemisphere rays a camera ray.
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

/// `L'`, the invisible light that hemisphere rays read, one or more fields of it at once.
#[derive(Clone, Debug)]
pub struct Fields {
    pub(super) count: usize,
    /// Patch by patch, field by field.
    values: Vec<Rgb>,
}

impl Fields {
    /// Interleaves fields of one value a patch.
    ///
    /// # Panics
    /// If the fields differ in length.
    pub fn new(fields: &[Vec<Rgb>]) -> Fields {
        let patches = fields.first().map_or(0, Vec::len);
        assert!(fields.iter().all(|f| f.len() == patches));
        let values = (0..patches).flat_map(|i| fields.iter().map(move |f| f[i]));
        Fields {
            count: fields.len(),
            values: values.collect(),
        }
    }

    /// Whether any field has any light.
    pub(super) fn is_dark(&self) -> bool {
        self.values.iter().all(|v| *v == Vec3::ZERO)
    }

    #[inline]
    pub(super) fn of_patch(&self, patch: u32) -> &[Rgb] {
        let start = patch as usize * self.count;
        &self.values[start..start + self.count]
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
    /// Share of the camera rays that met the black back of a one-sided face.
    pub backs: f64,
    /// Rays cast.
    pub rays: u64,
}

impl Gathered {
    /// All parts together.
    pub fn total(&self) -> Picture {
        let mut total = self.emission.clone();
        for part in std::iter::once(&self.direct).chain(&self.indirect) {
            for (sum, p) in total.pixels.iter_mut().zip(&part.pixels) {
                *sum += *p;
            }
        }
        total
    }
}

/// Renders the visible half.
pub fn gather(view: &View, fields: &Fields, sampling: &GatherSampling, tick: Progress) -> Gathered {
    let pass = Pass::new(view, fields, sampling);
    let rows: Vec<Vec<Pixel>> = (0..view.height)
        .into_par_iter()
        .map_init(
            || pass.scratch(),
            |scratch, y| {
                let row = (0..view.width).map(|x| pass.pixel(x, y, scratch)).collect();
                tick(1);
                row
            },
        )
        .collect();
    let mut pixels: Vec<Pixel> = rows.into_iter().flatten().collect();
    let layers: Vec<Vec<Layer>> = pixels
        .iter_mut()
        .map(|p| std::mem::take(&mut p.layers))
        .collect();
    let incident = smooth(&layers, view.width);
    let picture = |pixels: Vec<Rgb>| Picture {
        width: view.width,
        height: view.height,
        pixels,
    };
    let reflected = |k: usize| {
        let pixel = |(layers, incident): (&Vec<Layer>, &Vec<Vec<Rgb>>)| {
            let parts = layers.iter().zip(incident);
            let sum: Vec3 = parts.map(|(l, i)| l.count as f32 * l.rho * i[k]).sum();
            sum / sampling.camera as f32
        };
        layers.iter().zip(&incident).map(pixel).collect()
    };
    let backs: u64 = pixels.iter().map(|p| u64::from(p.backs)).sum();
    Gathered {
        emission: picture(pixels.iter().map(|p| p.emission).collect()),
        direct: picture(pixels.iter().map(|p| p.direct).collect()),
        indirect: (0..fields.count).map(|k| picture(reflected(k))).collect(),
        backs: backs as f64 / (pixels.len() as u64 * u64::from(sampling.camera)) as f64,
        rays: pixels.iter().map(|p| p.rays).sum(),
    }
}

/// The invisible half of patch light, as a field to gather.
pub fn invisible(light: &[Light]) -> Vec<Rgb> {
    light.iter().map(|l| l.invisible).collect()
}
