//! Scene files: TOML that adds camera, modes, emission, punctual lights and a sky to an OBJ or a glTF, and says which
//! way is up and how long one of its numbers is.
//!
//! An example with every key is in docs/commands.md. Unknown keys are errors. Values keep their places in the text,
//! which [`Text`] turns into lines. Only place for `toml`.
//!
//! Luminaires by LM-63 hang along the scene's `up`, and the sky's zenith lies there; where only the camera has one,
//! that counts for both. `1/d²` of lights is in metres; an `attenuation` that is given is in the file's units.
//!
//! Not handled: geometry, which is the OBJ's or the glTF's.

use crate::scene::soup::Reader;
mod lm63;

use std::collections::{BTreeMap, HashMap};
use std::fmt::Debug;
use std::io;
use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use serde::Deserialize;
use toml::Spanned;

use crate::light::{Mode, Rgb, Transport, TransportError, Visibility};
use crate::scene::emission::{SkyLight, SkyPatches};
use crate::scene::error::{About, Effect, Place, SceneError, ViewError, list, shorten};
use crate::scene::model::{Camera, DEFAULT_FOV, Material, Scene, Sides};
use crate::scene::punctual::{Beam, PunctualForm, PunctualLight, PunctualPlace};
use crate::scene::scene_file::lm63::Mounting;
use crate::scene::sky_cells::Sky;
use crate::scene::soup::{Soup, check_emission, outside_f32};
use crate::scene::unit::LengthUnit;

/// A scene file's text, to find lines in.
pub(crate) struct Text<'a> {
    pub file: &'a str,
    pub text: &'a str,
}

/// A value with its place in the text, if it is given.
type Given<T> = Option<Spanned<T>>;

/// All of a scene file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneFile {
    #[serde(alias = "mesh")]
    obj: Spanned<String>,
    unit: Option<LengthUnit>,
    up: Given<[f64; 3]>,
    mode: Given<String>,
    alpha: Given<f64>,
    tau: Given<f64>,
    camera: Given<CameraTable>,
    #[serde(default)]
    materials: BTreeMap<Spanned<String>, MaterialTable>,
    #[serde(default)]
    lights: Vec<Spanned<LightTable>>,
    sky: Option<SkyTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraTable {
    position: Spanned<[f64; 3]>,
    target: Spanned<[f64; 3]>,
    up: Given<[f64; 3]>,
    vertical_fov: Given<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialTable {
    mode: Given<String>,
    alpha: Given<f64>,
    tau: Given<f64>,
    two_sided: Option<bool>,
    emission: Given<[f64; 3]>,
    visible_emission: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LightTable {
    #[serde(rename = "type")]
    kind: LightType,
    name: Option<String>,
    position: Given<[f64; 3]>,
    direction: Given<[f64; 3]>,
    /// Where a luminaire's horizontal angles begin.
    along: Given<[f64; 3]>,
    /// Of measured intensities.
    file: Given<String>,
    intensity: Given<[f64; 3]>,
    attenuation: Given<[f64; 3]>,
    exponent: Given<f64>,
    cutoff: Given<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum LightType {
    Point,
    Spot,
    Warn,
    Directional,
    Ies,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SkyTable {
    radiance: Given<[f64; 3]>,
    upper: Given<[f64; 3]>,
    lower: Given<[f64; 3]>,
    /// A file of radiances.
    patches: Given<String>,
    /// Of a file with several columns, from 1.
    column: Given<usize>,
    north: Given<[f64; 3]>,
}

impl Text<'_> {
    /// The line where some bytes begin.
    fn place(&self, span: Range<usize>) -> Place {
        let before = &self.text.as_bytes()[..span.start.min(self.text.len())];
        Place::line(self.file, 1 + before.iter().filter(|&&b| b == b'\n').count())
    }

    fn error(&self, span: Range<usize>, message: impl Into<String>) -> SceneError {
        SceneError::SceneFile { place: self.place(span), message: message.into() }
    }

    /// Reads the file.
    pub(super) fn parse(&self) -> Result<SceneFile, SceneError> {
        toml::from_str(self.text).map_err(|error| self.error(error.span().unwrap_or(0..0), error.message()))
    }

    /// What a value of a light stands for; an error where it is not as `needed`.
    fn checked<T: Copy + Debug, U>(
        &self,
        key: &'static str,
        given: &Spanned<T>,
        needed: &'static str,
        check: impl Fn(T) -> Option<U>,
    ) -> Result<U, SceneError> {
        let value = *given.get_ref();
        let wrong =
            || SceneError::LightValue { place: self.place(given.span()), key, value: format!("{value:?}"), needed };
        check(value).ok_or_else(wrong)
    }

    /// Three numbers, which must be finite.
    fn vector(&self, key: &str, given: &Spanned<[f64; 3]>) -> Result<DVec3, SceneError> {
        let numbers = *given.get_ref();
        let Some(wrong) = numbers.iter().find(|x| !x.is_finite()) else { return Ok(DVec3::from_array(numbers)) };
        Err(SceneError::NotFinite { place: self.place(given.span()), statement: key.into(), word: wrong.to_string() })
    }

    /// The unit vector upwards.
    fn up(&self, given: &Spanned<[f64; 3]>) -> Result<DVec3, SceneError> {
        let vector = self.vector("up", given)?;
        let unit = (vector / vector.abs().max_element()).try_normalize();
        unit.ok_or_else(|| self.error(given.span(), "`up` is zero: it needs a direction, like [0, 0, 1]"))
    }

    /// A vector of a light that is not zero, at length 1.
    fn direction(&self, key: &'static str, given: &Spanned<[f64; 3]>) -> Result<DVec3, SceneError> {
        // The largest number first: squares of very small or large ones would under- or overflow.
        let unit = |vector: DVec3| (vector / vector.abs().max_element()).try_normalize();
        let vector = self.vector(key, given)?;
        self.checked(key, given, "a vector that is not zero", |_| unit(vector))
    }

    /// Radiance or intensity: three numbers, finite and not negative; black where none is given.
    fn light(&self, owner: &str, key: &str, given: Option<&Spanned<[f64; 3]>>) -> Result<Rgb, SceneError> {
        let Some(given) = given else { return Ok(Rgb::ZERO) };
        let message = |wrong| format!("`{key}` of {owner} is {wrong}; it must be finite and not negative");
        let wrong = outside_f32(given.get_ref()).map(|wrong| Err(self.error(given.span(), message(wrong))));
        wrong.unwrap_or_else(|| Ok(DVec3::from_array(*given.get_ref()).as_vec3()))
    }

    /// alpha and tau as given by a mode or by themselves.
    fn transport(
        &self,
        mode: &Given<String>,
        alpha: &Given<f64>,
        tau: &Given<f64>,
    ) -> Result<[Option<f32>; 2], SceneError> {
        let Some(mode) = mode else { return Ok([self.share("alpha", alpha)?, self.share("tau", tau)?]) };
        if alpha.is_some() || tau.is_some() {
            let both = "`mode` and `alpha` or `tau` are given together";
            return Err(self.error(mode.span(), both));
        }
        let unknown = || {
            let name = shorten(mode.get_ref());
            let known = "the modes are global, shadowless, one-bounce and local; or give alpha and tau";
            self.error(mode.span(), format!("there is no mode `{name}`: {known}"))
        };
        let Transport { alpha, tau } = Mode::from_name(mode.get_ref()).ok_or_else(unknown)?.transport();
        Ok([Some(alpha), Some(tau)])
    }

    /// alpha or tau, if given and in 0..=1.
    fn share(&self, name: &'static str, given: &Given<f64>) -> Result<Option<f32>, SceneError> {
        let Some(given) = given else { return Ok(None) };
        let value = *given.get_ref() as f32;
        let outside =
            || SceneError::Transport { place: self.place(given.span()), source: TransportError { name, value } };
        (0.0..=1.0).contains(given.get_ref()).then_some(Some(value)).ok_or_else(outside)
    }
}

impl SceneFile {
    /// The name of the file of geometry.
    pub(super) fn geometry(&self) -> &str {
        self.obj.get_ref()
    }

    /// That the file of geometry cannot be read.
    pub(super) fn missing_geometry(&self, text: &Text, source: io::Error) -> SceneError {
        let name = shorten(self.obj.get_ref());
        SceneError::MissingObj { place: text.place(self.obj.span()), name, source }
    }

    /// Whether it has light that is not a material's.
    pub(super) fn is_lit(&self) -> bool {
        !self.lights.is_empty() || self.sky.is_some()
    }

    /// The unit of all positions, where it is given.
    pub(super) fn unit(&self) -> Option<LengthUnit> {
        self.unit
    }

    /// Whether it has a camera.
    pub(super) fn has_camera(&self) -> bool {
        self.camera.is_some()
    }

    /// Whether it gives the sides of a material.
    pub(super) fn gives_sides(&self, material: &str) -> bool {
        self.materials.get(material).is_some_and(|material| material.two_sided.is_some())
    }

    /// Changes the materials that it names.
    pub(super) fn change_materials(&self, text: &Text, soup: &mut Soup) -> Result<(), SceneError> {
        // Of two materials of one name the first counts, so it comes last.
        let names = soup.materials.iter().enumerate().rev();
        let index: HashMap<String, usize> = names.map(|(i, m)| (m.name.clone(), i)).collect();
        for (name, changes) in &self.materials {
            let found = index.get(name.get_ref()).copied();
            let index = found.ok_or_else(|| SceneError::UnknownMaterial {
                place: text.place(name.span()),
                name: shorten(name.get_ref()),
                known: list(soup.materials.iter().map(|material| material.name.as_str())),
            })?;
            changes.apply(text, &mut soup.materials[index])?;
        }
        Ok(())
    }

    /// Gives a scene its transport, its camera, its lights and its sky.
    ///
    /// `reader` reads files next to the scene file.
    pub(super) fn finish(&self, text: &Text, scene: &mut Scene, reader: Reader) -> Result<(), SceneError> {
        let default = Transport::default();
        let [alpha, tau] = text.transport(&self.mode, &self.alpha, &self.tau)?;
        scene.transport = (alpha.is_some() || tau.is_some())
            .then(|| Transport { alpha: alpha.unwrap_or(default.alpha), tau: tau.unwrap_or(default.tau) });
        let own = self.up.as_ref().map(|up| text.up(up)).transpose()?;
        if let Some(camera) = &self.camera {
            scene.camera = camera.get_ref().camera(text, camera.span(), scene, own.unwrap_or(DVec3::Y))?;
        }
        let of_camera = || self.camera.as_ref()?.get_ref().up.as_ref();
        let up = own.map_or_else(|| of_camera().map_or(Ok(DVec3::Y), |up| text.up(up)), Ok)?;
        for table in &self.lights {
            let read = table.get_ref().light(text, table.span(), (scene, up), reader)?;
            scene.lights.push(read);
        }
        if let Some(sky) = &self.sky {
            sky.put(text, (scene, up), reader)?;
        }
        let turned = self.turned_by_camera(text, up).map(|text| About::Light(Effect::Guessed).warning(text));
        scene.warnings.extend(turned);
        Ok(())
    }

    /// Warns where the camera's `up` turns an uneven sky or luminaires, and is none that a scene is built along.
    fn turned_by_camera(&self, text: &Text, up: DVec3) -> Option<String> {
        let is_usual = self.up.is_some() || [DVec3::Y, DVec3::Z].iter().any(|axis| up.distance(*axis) < 1e-3);
        let is_hung = |table: &Spanned<LightTable>| table.get_ref().hangs_down();
        let is_uneven = self.sky.as_ref().is_some_and(|sky| !sky.is_even());
        if is_usual || !(is_uneven || self.lights.iter().any(is_hung)) {
            return None;
        }
        let place = text.place(self.camera.as_ref().map_or(0..0, Spanned::span));
        let DVec3 { x, y, z } = up;
        Some(format!(
            "{place}: the camera's up ({x:.3}, {y:.3}, {z:.3}) is taken for the scene's: sky and luminaires are turned to \
             it; give the scene its own, like up = [0, 1, 0], before [camera]"
        ))
    }

    /// Whether it has luminaires by LM-63.
    pub(super) fn is_photometric(&self) -> bool {
        self.lights.iter().any(|table| matches!(table.get_ref().kind, LightType::Ies))
    }
}

impl MaterialTable {
    fn apply(&self, text: &Text, material: &mut Material) -> Result<(), SceneError> {
        [material.alpha, material.tau] = text.transport(&self.mode, &self.alpha, &self.tau)?;
        if let Some(emission) = &self.emission {
            check_emission(*emission.get_ref(), &material.name, || text.place(emission.span()))?;
            material.emission = DVec3::from_array(*emission.get_ref()).as_vec3();
        }
        if self.visible_emission == Some(false) {
            material.visibility = Visibility::Hidden;
        }
        if let Some(two_sided) = self.two_sided {
            material.sides = if two_sided { Sides::Two } else { Sides::One };
        }
        Ok(())
    }
}

impl CameraTable {
    /// The camera in unit coordinates. The direction is taken in the file's units: a target close by stays exact.
    /// Its up is `up` where it has none.
    fn camera(&self, text: &Text, span: Range<usize>, scene: &Scene, up: DVec3) -> Result<Camera, SceneError> {
        let (position, target) = (text.vector("position", &self.position)?, text.vector("target", &self.target)?);
        let up = self.up.as_ref().map_or(Ok(up), |up| text.vector("up", up))?;
        let fov = self.vertical_fov.as_ref().map_or(DEFAULT_FOV, |fov| *fov.get_ref());
        let eye = scene.frame.to_unit(position).as_vec3();
        let finite = eye.is_finite().then_some(()).ok_or(ViewError::NotFinite);
        let camera = finite.and_then(|()| Camera::look_at(position, target, up, fov));
        let wrong = |error: ViewError| {
            let fov = self.vertical_fov.as_ref().filter(|_| matches!(error, ViewError::Fov(_)));
            SceneError::View { place: text.place(fov.map_or(span, Spanned::span)), source: error }
        };
        Ok(Camera { position: eye, ..camera.map_err(wrong)? })
    }
}

impl LightTable {
    /// Whether it is a luminaire without a direction of its own.
    fn hangs_down(&self) -> bool {
        matches!(self.kind, LightType::Ies) && self.direction.is_none()
    }

    /// The light in unit coordinates of a scene and its up, once its keys are those of its type.
    fn light(
        &self,
        text: &Text,
        table: Range<usize>,
        (scene, up): (&mut Scene, DVec3),
        reader: Reader,
    ) -> Result<PunctualLight, SceneError> {
        let (needed, optional): (&[&str], &[&str]) = match self.kind {
            LightType::Point => (&["intensity", "position"], &["attenuation"]),
            LightType::Spot => (&["intensity", "cutoff", "position", "direction"], &["attenuation", "exponent"]),
            LightType::Warn => (&["intensity", "exponent", "position", "direction"], &["attenuation"]),
            LightType::Directional => (&["intensity", "direction"], &[]),
            LightType::Ies => (&["file", "position"], &["direction", "along", "intensity"]),
        };
        let kind = format!("{:?}", self.kind).to_lowercase();
        let keys = [
            ("position", self.position.as_ref().map(Spanned::span)),
            ("direction", self.direction.as_ref().map(Spanned::span)),
            ("attenuation", self.attenuation.as_ref().map(Spanned::span)),
            ("exponent", self.exponent.as_ref().map(Spanned::span)),
            ("cutoff", self.cutoff.as_ref().map(Spanned::span)),
            ("intensity", self.intensity.as_ref().map(Spanned::span)),
            ("along", self.along.as_ref().map(Spanned::span)),
            ("file", self.file.as_ref().map(Spanned::span)),
        ];
        for (key, span) in &keys {
            if let Some(span) = span.clone().filter(|_| !needed.contains(key) && !optional.contains(key)) {
                return Err(text.error(span, format!("a light of type `{kind}` has no `{key}`: remove the key")));
            }
        }
        let is_missing = |needed: &&&str| keys.iter().any(|(key, span)| key == *needed && span.is_none());
        if let Some(key) = needed.iter().find(is_missing) {
            return Err(text.error(table, format!("a light of type `{kind}` needs `{key}`")));
        }
        let intensity = match &self.intensity {
            Some(given) => text.light("a light", "intensity", Some(given))?,
            None => Rgb::ONE,
        };
        Ok(PunctualLight { form: self.form(text, (scene, up), reader)?, intensity, name: self.name.clone() })
    }

    /// Its form; keys that are not given have no effect on it.
    fn form(&self, text: &Text, (scene, up): (&mut Scene, DVec3), reader: Reader) -> Result<PunctualForm, SceneError> {
        let frame = scene.frame;
        let direction = given(&self.direction, |given| text.direction("direction", given))?;
        let position = given(&self.position, |given| {
            let unit = frame.to_unit(text.vector("position", given)?);
            let is_near = unit.as_vec3().is_finite();
            text.checked("position", given, "within 3e38 of the scene's size", |_| is_near.then_some(unit))
        })?;
        let attenuation = given(&self.attenuation, |given| {
            let is_one = |a: [f64; 3]| a.into_iter().all(is_weight) && a != [0.0; 3];
            let needed = "0 or more, and finite, with a number above 0 among the three";
            text.checked("attenuation", given, needed, |a| is_one(a).then_some(Some(a)))
        })?;
        let exponent = given(&self.exponent, |given| {
            text.checked("exponent", given, "0 or more, and finite", |x| is_weight(x).then_some(x))
        })?;
        let cutoff = given(&self.cutoff, |given| {
            let needed = "above 0 and at most 90 degrees";
            let cosine = |degrees: f64| if degrees == 90.0 { 0.0 } else { degrees.to_radians().cos() };
            text.checked("cutoff", given, needed, |degrees| (degrees > 0.0 && degrees <= 90.0).then(|| cosine(degrees)))
        })?;
        let place = match attenuation {
            Some(attenuation) => PunctualPlace::new(position, attenuation, frame.scale),
            None => PunctualPlace::new(position, PunctualLight::PHYSICAL, frame.in_metres()),
        };
        Ok(match self.kind {
            LightType::Point => PunctualForm::even(place),
            LightType::Spot | LightType::Warn => {
                PunctualForm::Point { place, beam: Beam::Spot { direction, exponent, cutoff } }
            }
            LightType::Directional => PunctualForm::Directional { direction },
            LightType::Ies => {
                let along = given(&self.along, |given| text.direction("along", given).map(Some))?;
                let axis = if self.direction.is_some() { direction } else { -up };
                if let Some(along) = along.filter(|along| along.cross(axis).length() < 1e-6) {
                    let span = self.along.as_ref().map_or(0..0, Spanned::span);
                    return Err(text.error(span, format!("`along` {along} is the luminaire's own axis")));
                }
                PunctualForm::Point { place, beam: self.measured(text, &Mounting { axis, along, up }, scene, reader)? }
            }
        })
    }

    /// The intensities of the file that it names.
    fn measured(
        &self,
        text: &Text,
        mounting: &Mounting,
        scene: &mut Scene,
        reader: Reader,
    ) -> Result<Beam, SceneError> {
        let Some(file) = &self.file else { return Ok(Beam::Even) };
        let name = file.get_ref();
        let missing =
            |source| SceneError::MissingPhotometry { place: text.place(file.span()), name: shorten(name), source };
        let read = lm63::read(name, &reader(name).map_err(missing)?, mounting)?;
        let named = format!("{name}: ");
        if read.opening > 0.0 && !scene.warnings.iter().any(|warning| warning.starts_with(&named)) {
            let text = format!(
                "{named}a luminous opening of {:.2} m is taken for a point: light nearer than {:.1} m to it is off by \
                 more than one percent",
                read.opening,
                5.0 * read.opening
            );
            scene.warnings.push(About::Light(Effect::Simplified).warning(text));
        }
        Ok(Beam::Measured(Arc::new(read.photometry)))
    }
}

/// What a key that may be missing stands for: nothing where it is.
fn given<T, U: Default>(
    given: &Given<T>,
    read: impl Fn(&Spanned<T>) -> Result<U, SceneError>,
) -> Result<U, SceneError> {
    given.as_ref().map_or_else(|| Ok(U::default()), read)
}

fn is_weight(number: f64) -> bool {
    (0.0..f64::INFINITY).contains(&number)
}

impl SkyTable {
    /// Whether it is the same from everywhere.
    fn is_even(&self) -> bool {
        self.radiance.is_some()
    }

    /// Puts the sky around a scene whose up is given.
    fn put(&self, text: &Text, (scene, up): (&mut Scene, DVec3), reader: Reader) -> Result<(), SceneError> {
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
