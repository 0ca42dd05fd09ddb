//! Textures: images on surfaces, looked up at points and averaged over triangles, and what of a material differs from
//! point to point by them: reflectance, emission, and whether there is a surface at all.
//!
//! ```text
//! rho(x) = rho t_rho(x) c(x),     E(x) = E t_E(x),     tau(x) = 1 - a(x) (1 - tau)
//! ```
//!
//! with t the texture's linear colour, c the colour of the vertices, linear over each triangle, and a the share of the
//! mask: a surface is there with the chance a(x), so that where a is 0 it neither reflects, emits nor hides, and light
//! that meets it is let through by 1 - a in the mean.
//!
//! Not handled: bump and normal maps, textures that are computed.

pub(crate) mod mean;
mod share_images;
mod stored_image;
mod texture;

use glam::{DAffine2, DVec2};

pub(crate) use share_images::ShareImages;
pub use stored_image::{Channel, Coding, Image};
pub use texture::{Filter, Texture, Wrap};

/// The textures of a material, and whether its vertices are coloured: at least one of these.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Maps {
    /// Factor on rho.
    pub reflectance: Option<Texture>,
    /// Factor on the emitted radiance.
    pub emission: Option<Texture>,
    /// Where there is a surface.
    pub mask: Option<Mask>,
    /// Whether rho and the mask go by [`crate::scene::Scene::colours`] too.
    pub vertex_colours: bool,
}

/// Where there is a surface.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Mask {
    /// Its texture, an image of shares; 1 everywhere where there is none.
    pub texture: Option<Texture>,
    /// Factor on it.
    pub factor: f32,
    /// From this share on there is a surface, and below there is none; each share counts as it is without.
    pub cutoff: Option<f32>,
    /// Masks of other faces in the same place, before this one in the file: there is a surface where they have none.
    pub over: Vec<Mask>,
}

impl Maps {
    /// Whether there are images, so that points have coordinates.
    pub(crate) fn has_images(&self) -> bool {
        let of_mask = self.mask.as_ref().is_some_and(Mask::has_images);
        of_mask || self.reflectance.is_some() || self.emission.is_some()
    }
}

impl Mask {
    /// A surface everywhere.
    pub(crate) const WHOLE: Mask = Mask { texture: None, factor: 1.0, cutoff: None, over: Vec::new() };

    /// It in other coordinates, from which `map` leads to its own; alone, without those over it.
    pub(crate) fn seen_through(mut self, map: DAffine2) -> Mask {
        if let Some(texture) = &mut self.texture {
            texture.placement *= map;
        }
        Mask { over: Vec::new(), ..self }
    }

    /// Whether it differs from point to point by an image, its own or one of a mask over it.
    pub(crate) fn has_images(&self) -> bool {
        self.texture.is_some() || self.over.iter().any(|mask| mask.texture.is_some())
    }

    /// Takes an image whose texels are all the same into the factor.
    pub(crate) fn simplify(&mut self) {
        if let Some(even) = self.texture.take_if(|texture| texture.image.is_even()) {
            self.factor *= even.image.mean().x;
        }
    }

    /// The mean share of a surface over a polygon of coordinates of vertices where nothing is over it, at the middle of
    /// which their alpha is `alpha`; none where it has a cutoff, or the polygon no area.
    pub(crate) fn mean_alone(&self, polygon: &[DVec2], alpha: f32) -> Option<f32> {
        let texel = match &self.texture {
            _ if self.cutoff.is_some() => return None,
            None => 1.0,
            Some(texture) => texture.mean_of_part(polygon)?.x as f32,
        };
        Some((self.factor * texel * alpha).clamp(0.0, 1.0))
    }

    /// Whether there is a surface nowhere.
    pub(crate) fn is_nowhere(&self) -> bool {
        self.cutoff.map_or(self.factor <= 0.0, |cutoff| self.factor < cutoff)
    }

    /// Whether there is a surface everywhere.
    pub(crate) fn is_whole(&self) -> bool {
        let least = self.texture.as_ref().map_or(1.0, |texture| texture.image.least());
        let share = self.factor * least;
        self.cutoff.map_or(share >= 1.0, |cutoff| share >= cutoff)
    }

    /// The share a of a surface at coordinates of vertices, 0..=1, where their alpha is `alpha`: of what those over it
    /// leave.
    pub fn at(&self, at: DVec2, alpha: f32) -> f32 {
        let left = self.over.iter().map(|mask| 1.0 - mask.alone_at(at, 1.0));
        left.fold(self.alone_at(at, alpha), |share, left| share * left)
    }

    /// The share of a surface where nothing is over it.
    pub(crate) fn alone_at(&self, at: DVec2, alpha: f32) -> f32 {
        let texel = self.texture.as_ref().map_or(1.0, |texture| texture.colour(at).x);
        let share = (self.factor * texel * alpha).clamp(0.0, 1.0);
        match self.cutoff {
            Some(cutoff) => f32::from(u8::from(share >= cutoff)),
            None => share,
        }
    }
}
