//! The sky of a scene file: one radiance, two, or those of patches in a file beside it; and which way is north.
//!
//! Not handled: how patches are laid out ([`SkyPatches`]).

use glam::DVec3;
use serde::Deserialize;
use toml::Spanned;

use crate::scene::emission::{Sky, SkyLight, SkyPatches};
use crate::scene::error::{SceneError, shorten};
use crate::scene::model::Scene;
use crate::scene::scene_file::{Given, Text};
use crate::scene::soup::Reader;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SkyTable {
    radiance: Given<[f64; 3]>,
    upper: Given<[f64; 3]>,
    lower: Given<[f64; 3]>,
    /// A file of radiances.
    patches: Given<String>,
    /// Of a file with several columns, from 1.
    column: Given<usize>,
    north: Given<[f64; 3]>,
}

impl SkyTable {
    /// Whether it is the same from everywhere.
    pub(super) fn is_even(&self) -> bool {
        self.radiance.is_some()
    }

    /// Puts the sky around a scene whose up is given.
    pub(super) fn put(&self, text: &Text, (scene, up): (&mut Scene, DVec3), reader: Reader) -> Result<(), SceneError> {
        let north = self.north(text, up)?;
        match &self.patches {
            Some(patches) => scene.set_patched_sky(&self.patches(text, patches, reader)?, up, north),
            None => scene.set_sky(self.light(text)?, up),
        }
        scene.sky.iter_mut().for_each(|sky| sky.north = north.as_vec3());
        Ok(())
    }

    /// The level unit vector to the north.
    fn north(&self, text: &Text, up: DVec3) -> Result<DVec3, SceneError> {
        let Some(given) = &self.north else { return Ok(Sky::usual_north(up)) };
        let north = text.vector("north", given)?;
        Sky::level(north / north.abs().max_element(), up).ok_or_else(|| {
            let message = format!("`north` of the sky is {north}, zero or along `up`: give a level direction");
            text.error(given.span(), message)
        })
    }

    fn patches(&self, text: &Text, patches: &Spanned<String>, reader: Reader) -> Result<SkyPatches, SceneError> {
        if self.radiance.is_some() || self.upper.is_some() || self.lower.is_some() {
            let twice = "`patches` and `radiance`, `upper` or `lower` of the sky are given together: keep one of them";
            return Err(text.error(patches.span(), twice));
        }
        let name = patches.get_ref();
        let (place, named) = (|| text.place(patches.span()), || shorten(name));
        let bytes = reader(name).map_err(|source| SceneError::MissingSky { place: place(), name: named(), source })?;
        SkyPatches::parse(name, &bytes, self.column.as_ref().map(|own| *own.get_ref()))
    }

    /// The radiance of both halves; black where none is given.
    fn light(&self, text: &Text) -> Result<SkyLight, SceneError> {
        if let Some(column) = &self.column {
            return Err(text.error(column.span(), "`column` of the sky is one of `patches`: give the file too"));
        }
        let half = |key, given: &Given<[f64; 3]>| text.light("the sky", key, given.as_ref());
        let Some(both) = &self.radiance else {
            return Ok(SkyLight { upper: half("upper", &self.upper)?, lower: half("lower", &self.lower)? });
        };
        if self.upper.is_some() || self.lower.is_some() {
            let twice = "`radiance` and `upper` or `lower` of the sky are given together";
            return Err(text.error(both.span(), twice));
        }
        let radiance = text.light("the sky", "radiance", Some(both))?;
        Ok(SkyLight { upper: radiance, lower: radiance })
    }
}
