//! The light that the camera rays of one pixel found, sums over them in two halves.
//!
//! Not handled: indirect light that is gathered; until then the light that patches receive stands for it.

use glam::DVec3;

use crate::gather::pixels::pixel_layer::SurfaceKey;
use crate::gather::pixels::textured_light::TexturedLight;

/// Emission of a pixel, a mean over it.
#[derive(Clone, Debug, Default)]
pub(crate) struct SeenEmission {
    pub value: DVec3,
    /// Squared standard error.
    pub variance: DVec3,
    /// The emitters' parts, where they are kept apart.
    pub emitters: Vec<DVec3>,
}

/// Direct light as it is after smoothing.
pub(crate) struct SmoothLight {
    /// Sums over the camera rays of each half.
    pub direct: [DVec3; 2],
    /// Squared error of what the pixel shows.
    pub variance: DVec3,
}

/// Sums of light over the camera rays of a pixel, of each half.
#[derive(Default)]
pub(crate) struct PixelLight {
    /// Light as emitted.
    pub emitted: [DVec3; 2],
    /// Each emitter's part of it; empty where they are not kept apart.
    pub glows: Vec<[DVec3; 2]>,
    /// What stands for both where the pixel shows an outline of an emitter.
    pub outline: Option<Box<SeenEmission>>,
    /// Direct light that points reflect by their own reflectance.
    pub lit: [DVec3; 2],
    /// What that lacks to the mean reflectance, by surfaces with textures.
    pub textured: Vec<(SurfaceKey, TexturedLight)>,
    /// What stands for direct light where that is smoothed.
    pub smooth: Option<Box<SmoothLight>>,
    /// Indirect light: what the patches themselves receive, until it is gathered.
    pub ambient: [DVec3; 2],
    /// Each emitter's part of direct light; empty where they are not kept apart.
    pub emitters: Vec<[DVec3; 2]>,
}

/// The sums of an emitter that is kept apart.
pub(crate) fn of_emitter(all: &mut Vec<[DVec3; 2]>, number: usize) -> &mut [DVec3; 2] {
    if all.len() <= number {
        all.resize(number + 1, [DVec3::ZERO; 2]);
    }
    &mut all[number]
}

impl PixelLight {
    /// Light as emitted of each half, sums over so many camera rays.
    pub(crate) fn emission(&self, count: u32) -> [DVec3; 2] {
        self.outline.as_ref().map_or(self.emitted, |outline| [f64::from(count) * outline.value; 2])
    }

    /// All light of each half of so many camera rays, of which what is emitted counts no more than `most` a ray.
    pub(crate) fn halves(&self, count: u32, most: f64) -> [DVec3; 2] {
        let (emission, most) = (self.emission(count), DVec3::splat(most * f64::from(count)));
        let direct = self.shown_direct();
        [0, 1].map(|half| emission[half].min(most) + direct[half] + self.ambient[half])
    }

    /// An emitter's part of light as emitted of each half, sums over so many camera rays.
    pub(crate) fn glow_of(&self, emitter: usize, count: u32) -> [DVec3; 2] {
        let known = |outline: &SeenEmission| outline.emitters.get(emitter).copied().unwrap_or_default();
        match &self.outline {
            Some(outline) => [f64::from(count) * known(outline); 2],
            None => self.glows.get(emitter).copied().unwrap_or_default(),
        }
    }

    /// An emitter's part of direct light of each half, sums over its camera rays.
    pub(crate) fn direct_of(&self, emitter: usize) -> [DVec3; 2] {
        let lit = self.emitters.get(emitter).copied().unwrap_or_default();
        let due = |half: usize| self.textured.iter().map(|(_, light)| light.due_of(half, emitter)).sum::<DVec3>();
        [0, 1].map(|half| lit[half] + due(half))
    }

    /// The light on a surface with a texture.
    pub(crate) fn textured(&mut self, key: SurfaceKey) -> &mut TexturedLight {
        let known = self.textured.iter().position(|(own, _)| *own == key);
        let k = known.unwrap_or_else(|| {
            self.textured.push((key, TexturedLight::default()));
            self.textured.len() - 1
        });
        &mut self.textured[k].1
    }

    /// Direct light of each half as the picture shows it, sums over its camera rays.
    pub(crate) fn shown_direct(&self) -> [DVec3; 2] {
        self.smooth.as_ref().map_or_else(|| self.direct(), |smooth| smooth.direct)
    }

    /// Direct light of each half that its own rays found, sums over them.
    pub(crate) fn direct(&self) -> [DVec3; 2] {
        let due = |half: usize| self.textured.iter().map(|(_, light)| light.due(half)).sum::<DVec3>();
        [0, 1].map(|half| self.lit[half] + due(half))
    }
}

impl SeenEmission {
    /// Adds light of an emitter, where they are kept apart.
    pub(crate) fn add(&mut self, emitter: Option<usize>, light: DVec3) {
        self.value += light;
        if let Some(emitter) = emitter {
            if self.emitters.len() <= emitter {
                self.emitters.resize(emitter + 1, DVec3::ZERO);
            }
            self.emitters[emitter] += light;
        }
    }
}
