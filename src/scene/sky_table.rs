//! `[sky]` of a scene file: one radiance, or one from above and one from below.
//!
//! Not handled: which way is up; the camera's table tells, and +y where it does not.

use glam::DVec3;
use serde::Deserialize;
use toml::Spanned;

use crate::light::Rgb;
use crate::scene::error::SceneError;
use crate::scene::sky::SkyLight;
use crate::scene::source::Source;

/// The table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SkyTable {
    radiance: Option<Spanned<[f64; 3]>>,
    upper: Option<Spanned<[f64; 3]>>,
    lower: Option<Spanned<[f64; 3]>>,
}

impl SkyTable {
    /// The radiance of both halves; black where none is given.
    pub(crate) fn light(&self, source: &Source) -> Result<SkyLight, SceneError> {
        let half = |key, value: &Option<Spanned<[f64; 3]>>| match value {
            Some(value) => radiance(source, key, value),
            None => Ok(Rgb::ZERO),
        };
        let Some(both) = &self.radiance else {
            return Ok(SkyLight { upper: half("upper", &self.upper)?, lower: half("lower", &self.lower)? });
        };
        if self.upper.is_some() || self.lower.is_some() {
            return Err(SceneError::SkyTwice { place: source.of(both) });
        }
        let radiance = radiance(source, "radiance", both)?;
        Ok(SkyLight { upper: radiance, lower: radiance })
    }
}

/// Three numbers, finite and not negative.
fn radiance(source: &Source, key: &'static str, value: &Spanned<[f64; 3]>) -> Result<Rgb, SceneError> {
    let limit = 0.0..=f64::from(f32::MAX);
    match value.get_ref().iter().find(|x| !limit.contains(*x)) {
        None => Ok(DVec3::from_array(*value.get_ref()).as_vec3()),
        Some(wrong) => Err(SceneError::SkyValue { place: source.of(value), key, value: wrong.to_string() }),
    }
}
