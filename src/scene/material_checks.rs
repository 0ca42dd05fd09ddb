//! The ranges of a material's numbers: what breaks them is an error with its place.
//!
//! Not handled: alpha and tau; see [`crate::scene::Material::check_transport`].

use crate::scene::error::{Place, SceneError};
use crate::scene::lines;

/// Refuses numbers of a highlight that are negative, NaN, or infinite in single precision.
pub(crate) fn check_gloss(numbers: &[f64], material: &str, place: impl Fn() -> Place) -> Result<(), SceneError> {
    let limit = 0.0..=f64::from(f32::MAX);
    match numbers.iter().find(|value| !limit.contains(value)) {
        Some(&value) => Err(SceneError::Gloss { place: place(), material: lines::shorten(material), value }),
        None => Ok(()),
    }
}

/// Refuses a reflectance outside 0..=1 (NaN included).
pub(crate) fn check_rho(rho: [f64; 3], material: &str, place: impl Fn() -> Place) -> Result<(), SceneError> {
    match rho.into_iter().find(|value| !(0.0..=1.0).contains(value)) {
        Some(value) => Err(SceneError::Rho { place: place(), material: lines::shorten(material), value }),
        None => Ok(()),
    }
}

/// Refuses an emission that is negative, NaN, or infinite in single precision.
pub(crate) fn check_emission(emission: [f64; 3], material: &str, place: impl Fn() -> Place) -> Result<(), SceneError> {
    let limit = 0.0..=f64::from(f32::MAX);
    match emission.into_iter().find(|value| !limit.contains(value)) {
        Some(value) => Err(SceneError::Emission { place: place(), material: lines::shorten(material), value }),
        None => Ok(()),
    }
}
