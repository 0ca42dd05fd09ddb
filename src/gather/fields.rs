//! The light on patches that hemisphere rays read: one or more fields at once, and how they are read.
//!
//! Not handled: light that varies within a patch by more than linearly.

use glam::Vec3;

use crate::gather::gradients::{Linear, linear};
use crate::gather::reading::Reading;
use crate::light::{Light, Rgb};
use crate::patches::Patches;

/// `L'`, the invisible light that hemisphere rays read, one or more fields of it at once.
#[derive(Clone, Debug, Default)]
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
        Fields { count: fields.len(), leading: fields.len(), values: values.collect(), ..Fields::default() }
    }

    /// Only the first `leading` fields make the picture; the others ride along on the same rays.
    pub fn led_by(mut self, leading: usize) -> Fields {
        self.leading = leading.min(self.count);
        self
    }

    /// The fields that make the picture, without those that ride along.
    pub fn led(&self) -> Fields {
        let own = self.values.chunks_exact(self.count.max(1));
        let values = own.flat_map(|v| &v[..self.leading]).copied().collect();
        Fields { count: self.leading, values, ..self.clone() }
    }

    /// Adds what the patches themselves receive of these fields, irradiance over pi: it tells edges of indirect light
    /// before any of it is gathered.
    pub fn with_ambient(mut self, ambient: Vec<Rgb>) -> Fields {
        self.ambient = ambient;
        self
    }

    /// Adds what the first field is without the direct light of luminaires, two estimates of that light given, for
    /// readers that ask for it where they read.
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
    pub(crate) fn is_near(&self, patch: u32, distance: f32) -> bool {
        self.near.get(patch as usize).is_some_and(|&near| distance < near)
    }

    /// How gather rays read.
    pub(crate) fn reading(&self) -> Reading {
        self.reading
    }

    /// Whether every ray reads the first patch that it meets.
    pub(crate) fn is_read_at_once(&self) -> bool {
        self.near.is_empty() && self.reading == Reading::AtOnce
    }

    /// The first field at a point of a patch, without the direct light of luminaires.
    #[inline]
    pub(crate) fn without_direct(&self, patch: u32, position: Vec3) -> Rgb {
        match self.without_direct.get(patch as usize) {
            Some(rest) => rest.at(position),
            None => self.of_patch(patch)[0].at(position),
        }
    }

    /// Number of fields.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Number of fields that make the picture.
    pub(crate) fn leading(&self) -> usize {
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
    pub(crate) fn ambient(&self, patch: u32) -> Rgb {
        self.ambient.get(patch as usize).copied().unwrap_or(Rgb::ZERO)
    }
}

/// The invisible half of patch light, as a field to gather.
pub fn invisible(light: &[Light]) -> Vec<Rgb> {
    light.iter().map(|l| l.invisible).collect()
}
