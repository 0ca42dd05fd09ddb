//! Lights without area: points, spots and parallel light, by OpenGL's terms.
//!
//! With l the unit vector from a receiver of normal n to the light and d its distance, nothing between,
//!
//! ```text
//! irradiance = intensity max(0, n·l) spot / (a0 + a1 d + a2 d²)      W/m², a point or a spot
//! spot       = max(0, -l·direction)^exponent inside the cutoff, 0 outside it; 1 for a point
//! irradiance = intensity max(0, n·l),  l = -direction                 W/m², parallel light
//! ```
//!
//! Warn's light (D. R. Warn, 1983; equation 24 of Banks and Beason, 2006) is a spot with a cutoff of 90 degrees.
//!
//! Not handled: a face to be seen; the camera does not see these lights, and no surface meets them by chance.

use glam::DVec3;

use crate::light::Rgb;

/// A light without area, in unit coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct PunctualLight {
    /// Where it is, or where it comes from.
    pub form: PunctualForm,
    /// Radiant intensity in W/sr; irradiance in W/m² of what faces it for [`PunctualForm::Directional`].
    pub intensity: Rgb,
}

/// Where a light without area is, and where it shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualForm {
    /// In all directions from a point.
    Point(PunctualPlace),
    /// Around an axis: intensity times the exponent-th power of the cosine to it, within a cone.
    Spot {
        /// The point it shines from.
        place: PunctualPlace,
        /// Unit vector along the axis, away from the light.
        direction: DVec3,
        /// Exponent of the cosine, 0 or more.
        exponent: f64,
        /// Cosine of the cone's half angle; 0 where all of the half space is lit.
        cutoff: f64,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Unit vector, the way the light goes.
        direction: DVec3,
    },
}

/// The place of a light, and how its light weakens with distance.
#[derive(Clone, Copy, Debug, PartialEq)]
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
        self.intensity.max_element() > 0.0
    }
}
