//! Punctual lights, which have no area: points, spots and parallel light, by OpenGL's terms.
//!
//! With l the unit vector from a receiver of normal n to the light and d its distance, nothing between,
//!
//! ```text
//! irradiance = intensity max(0, n·l) share(-l) / (a0 + a1 d + a2 d²)      W/m², from a point
//! share(w)   = max(0, w·direction)^exponent inside the cutoff, 0 outside it; 1 where it is alike in all directions;
//!              or as measured
//! irradiance = intensity max(0, n·l),  l = -direction                 W/m², parallel light
//! ```
//!
//! Warn's light (D. R. Warn, 1983; equation 24 of Banks and Beason, 2006) is a spot with a cutoff of 90 degrees.
//!
//! Not handled: a face to be seen; the camera does not see these lights, and no surface meets them by chance.

pub(crate) mod photometry;

use std::sync::Arc;

use glam::DVec3;

use crate::light::Rgb;
use crate::scene::punctual::photometry::Photometry;

/// A punctual light, in unit coordinates.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PunctualLight {
    /// Where it is, or where it comes from.
    pub form: PunctualForm,
    /// Radiant intensity in W/sr; irradiance in W/m² of what faces it for [`PunctualForm::Directional`].
    pub intensity: Rgb,
    /// Its name, where the file gives one.
    pub name: Option<String>,
}

/// Where a punctual light is, and where it shines.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum PunctualForm {
    /// From a point.
    Point {
        /// The point.
        place: PunctualPlace,
        /// Where to.
        beam: Beam,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Unit vector, the way the light goes.
        direction: DVec3,
    },
}

/// How the intensity of a light goes with the direction in which it leaves.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Beam {
    /// Alike in all directions.
    Even,
    /// Around an axis: the exponent-th power of the cosine to it, within a cone.
    Spot {
        /// Unit vector along the axis, away from the light.
        direction: DVec3,
        /// Exponent of the cosine, 0 or more.
        exponent: f64,
        /// Cosine of the cone's half angle; 0 where all of the half space is lit.
        cutoff: f64,
    },
    /// As measured, W/sr over the light's intensity, which is its colour then.
    Measured(Arc<Photometry>),
}

impl Beam {
    /// What the intensity is multiplied by towards a unit vector away from the light.
    pub fn share(&self, way: DVec3) -> f64 {
        match self {
            Beam::Even => 1.0,
            Beam::Spot { direction, exponent, cutoff } => {
                let cosine = direction.dot(way);
                if cosine > 0.0 && cosine >= *cutoff { cosine.powf(*exponent) } else { 0.0 }
            }
            Beam::Measured(photometry) => photometry.intensity(way),
        }
    }
}

impl PunctualForm {
    /// A light at a place whose intensity is alike in all directions.
    pub fn even(place: PunctualPlace) -> PunctualForm {
        PunctualForm::Point { place, beam: Beam::Even }
    }

    /// Where it shines; none for parallel light.
    pub fn beam(&self) -> Option<&Beam> {
        match self {
            PunctualForm::Point { beam, .. } => Some(beam),
            PunctualForm::Directional { .. } => None,
        }
    }

    /// Where it is; none for parallel light.
    pub fn place(&self) -> Option<&PunctualPlace> {
        match self {
            PunctualForm::Point { place, .. } => Some(place),
            PunctualForm::Directional { .. } => None,
        }
    }
}

/// The place of a light, and how its light weakens with distance.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PunctualPlace {
    /// Unit coordinates.
    pub position: DVec3,
    /// a0, a1 and a2 of `1/(a0 + a1 d + a2 d²)` for d in unit coordinates: OpenGL's, times the unit frame's scale to
    /// the power of 0, 1 and 2.
    pub attenuation: [f64; 3],
}

impl PunctualPlace {
    /// A place from numbers in the file's units, `scale` being that of the unit frame.
    pub fn new(position: DVec3, [a0, a1, a2]: [f64; 3], scale: f64) -> PunctualPlace {
        PunctualPlace { position, attenuation: [a0, a1 * scale, a2 * scale * scale] }
    }

    /// `a0 + a1 d + a2 d²` at a distance in unit coordinates.
    pub fn weakening(&self, distance: f64) -> f64 {
        let [a0, a1, a2] = self.attenuation;
        a0 + distance * (a1 + distance * a2)
    }
}

impl PunctualLight {
    /// The attenuation of a light that obeys physics: a2 = 1.
    pub const PHYSICAL: [f64; 3] = [0.0, 0.0, 1.0];

    /// Whether any channel shines.
    pub fn shines(&self) -> bool {
        let is_dark = matches!(&self.form, PunctualForm::Point { beam: Beam::Measured(m), .. } if m.power() == 0.0);
        self.intensity.max_element() > 0.0 && !is_dark
    }
}
