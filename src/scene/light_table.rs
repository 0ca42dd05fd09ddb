//! `[[lights]]` of a scene file: lights without area, every key checked against the light's type.
//!
//! Not handled: lights with area, which are emitting materials.

use glam::DVec3;
use serde::Deserialize;
use toml::Spanned;

use crate::scene::error::SceneError;
use crate::scene::lines::shorten;
use crate::scene::punctual::{PunctualForm, PunctualLight, PunctualPlace};
use crate::scene::source::Source;
use crate::scene::unit_frame::UnitFrame;

/// One table of `[[lights]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LightTable {
    #[serde(rename = "type")]
    kind: Spanned<String>,
    position: Option<Spanned<[f64; 3]>>,
    direction: Option<Spanned<[f64; 3]>>,
    intensity: Spanned<[f64; 3]>,
    attenuation: Option<Spanned<[f64; 3]>>,
    exponent: Option<Spanned<f64>>,
    cutoff: Option<Spanned<f64>>,
}

/// A table with what is needed to read it.
struct Reading<'a> {
    source: &'a Source<'a>,
    table: &'a Spanned<LightTable>,
    frame: &'a UnitFrame,
}

/// The light that a table gives, in the unit coordinates of `frame`.
pub(crate) fn light(
    source: &Source,
    table: &Spanned<LightTable>,
    frame: &UnitFrame,
) -> Result<PunctualLight, SceneError> {
    let reading = Reading { source, table, frame };
    let kind = &table.get_ref().kind;
    let form = match kind.get_ref().as_str() {
        "point" => {
            reading.without(&["direction", "exponent", "cutoff"])?;
            PunctualForm::Point(reading.place()?)
        }
        "spot" => reading.spot(reading.cutoff()?, reading.exponent(Some(0.0))?)?,
        "warn" => {
            reading.without(&["cutoff"])?;
            reading.spot(0.0, reading.exponent(None)?)?
        }
        "directional" => {
            reading.without(&["position", "attenuation", "exponent", "cutoff"])?;
            PunctualForm::Directional { direction: reading.direction()? }
        }
        other => return Err(SceneError::UnknownLight { place: source.of(kind), value: shorten(other) }),
    };
    Ok(PunctualLight { form, intensity: reading.intensity()? })
}

impl Reading<'_> {
    /// Refuses keys that a light of this type has no use for.
    fn without(&self, keys: &[&'static str]) -> Result<(), SceneError> {
        let table = self.table.get_ref();
        let given = [
            ("position", table.position.as_ref().map(|v| self.source.of(v))),
            ("direction", table.direction.as_ref().map(|v| self.source.of(v))),
            ("attenuation", table.attenuation.as_ref().map(|v| self.source.of(v))),
            ("exponent", table.exponent.as_ref().map(|v| self.source.of(v))),
            ("cutoff", table.cutoff.as_ref().map(|v| self.source.of(v))),
        ];
        let stray = given.into_iter().find_map(|(key, place)| Some((key, place?)).filter(|_| keys.contains(&key)));
        match stray {
            None => Ok(()),
            Some((key, place)) => Err(SceneError::StrayLightKey { place, key, kind: table.kind.get_ref().clone() }),
        }
    }

    /// A key that a light of this type needs.
    fn needed<'t, T>(&self, key: &'static str, value: &'t Option<Spanned<T>>) -> Result<&'t Spanned<T>, SceneError> {
        value.as_ref().ok_or_else(|| SceneError::MissingLightKey {
            place: self.source.of(self.table),
            key,
            kind: self.table.get_ref().kind.get_ref().clone(),
        })
    }

    /// A number within `range`, which `needed` describes.
    fn number(
        &self,
        key: &'static str,
        value: &Spanned<f64>,
        range: impl Fn(f64) -> bool,
        needed: &'static str,
    ) -> Result<f64, SceneError> {
        let number = *value.get_ref();
        let wrong = || SceneError::LightValue { place: self.source.of(value), key, value: number.to_string(), needed };
        range(number).then_some(number).ok_or_else(wrong)
    }

    /// Three numbers, each within `range`.
    fn numbers(
        &self,
        key: &'static str,
        value: &Spanned<[f64; 3]>,
        range: impl Fn(f64) -> bool,
        needed: &'static str,
    ) -> Result<[f64; 3], SceneError> {
        let numbers = *value.get_ref();
        match numbers.into_iter().find(|&x| !range(x)) {
            None => Ok(numbers),
            Some(wrong) => {
                Err(SceneError::LightValue { place: self.source.of(value), key, value: wrong.to_string(), needed })
            }
        }
    }

    fn spot(&self, cutoff: f64, exponent: f64) -> Result<PunctualForm, SceneError> {
        Ok(PunctualForm::Spot { place: self.place()?, direction: self.direction()?, exponent, cutoff })
    }

    fn place(&self) -> Result<PunctualPlace, SceneError> {
        let table = self.table.get_ref();
        let given = self.needed("position", &table.position)?;
        let position = self.frame.to_unit(self.source.vector("position", given)?);
        if !position.as_vec3().is_finite() {
            let needed = "within 3e38 of the scene's size";
            let value = format!("{:?}", given.get_ref());
            return Err(SceneError::LightValue { place: self.source.of(given), key: "position", value, needed });
        }
        let Some(given) = &table.attenuation else {
            return Ok(PunctualPlace::new(position, PunctualLight::PHYSICAL, self.frame.scale));
        };
        let finite = |a: f64| (0.0..f64::INFINITY).contains(&a);
        let attenuation = self.numbers("attenuation", given, finite, "0 or more, and finite")?;
        if attenuation == [0.0; 3] {
            let (value, needed) = ("[0, 0, 0]".to_owned(), "a number above 0 among the three");
            return Err(SceneError::LightValue { place: self.source.of(given), key: "attenuation", value, needed });
        }
        Ok(PunctualPlace::new(position, attenuation, self.frame.scale))
    }

    /// The axis, made a unit vector.
    fn direction(&self) -> Result<DVec3, SceneError> {
        let given = self.needed("direction", &self.table.get_ref().direction)?;
        let vector = self.source.vector("direction", given)?;
        // The largest number first: squares of very small or large ones would under- or overflow.
        let unit = (vector / vector.abs().max_element()).try_normalize();
        unit.ok_or_else(|| SceneError::LightValue {
            place: self.source.of(given),
            key: "direction",
            value: format!("{:?}", given.get_ref()),
            needed: "a vector that is not zero",
        })
    }

    fn intensity(&self) -> Result<glam::Vec3, SceneError> {
        let range = |x: f64| (0.0..=f64::from(f32::MAX)).contains(&x);
        let given = &self.table.get_ref().intensity;
        let numbers = self.numbers("intensity", given, range, "finite and not negative")?;
        Ok(DVec3::from_array(numbers).as_vec3())
    }

    /// The exponent; `default` where none is given, or none.
    fn exponent(&self, default: Option<f64>) -> Result<f64, SceneError> {
        let given = &self.table.get_ref().exponent;
        match (given, default) {
            (None, Some(default)) => Ok(default),
            _ => {
                let range = |x: f64| (0.0..f64::INFINITY).contains(&x);
                self.number("exponent", self.needed("exponent", given)?, range, "0 or more, and finite")
            }
        }
    }

    /// Cosine of the cutoff, exactly 0 at 90 degrees.
    fn cutoff(&self) -> Result<f64, SceneError> {
        let given = self.needed("cutoff", &self.table.get_ref().cutoff)?;
        let degrees = self.number("cutoff", given, |x| x > 0.0 && x <= 90.0, "above 0 and at most 90 degrees")?;
        Ok(if degrees == 90.0 { 0.0 } else { degrees.to_radians().cos() })
    }
}
