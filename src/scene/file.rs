//! Scene files: TOML that adds camera, modes and emission to an OBJ or a glTF.
//!
//! ```toml
//! obj = "room.obj"              # beside this file; or mesh = "room.glb", an OBJ or a glTF under either key
//! mode = "global"               # or: alpha = 1.0, tau = 0.0
//! [camera]
//! position = [278, 273, -800]
//! target = [278, 273, 0]
//! up = [0, 1, 0]                # may be left out
//! vertical_fov = 39.3           # degrees; may be left out
//! [materials."short block"]     # any of the mesh's materials
//! mode = "shadowless"           # or alpha, tau, or one of them
//! two_sided = true
//! [materials.light]
//! emission = [17, 12, 4]        # radiance, W/(m² sr); instead of Ke
//! visible_emission = false
//! [[lights]]                    # a light without area; any number of them
//! type = "point"                # "spot", "directional", "warn"
//! position = [0, 2, 0]          # not directional
//! direction = [0, -1, 0]        # spot, directional, warn; of any length
//! intensity = [10, 10, 10]      # W/sr; directional: irradiance, W/m²
//! attenuation = [0, 0, 1]       # a0, a1, a2 of 1/(a0 + a1 d + a2 d²); may be left out; not directional
//! exponent = 4                  # warn, and spot, where 0 if left out
//! cutoff = 30                   # degrees, up to 90; spot
//! [sky]                         # what rays that leave the scene see
//! radiance = [1, 1, 1]          # or upper = [...], lower = [...]; W/(m² sr)
//! ```
//!
//! Unknown keys are errors. `toml` is used here, in [`crate::scene::source`], [`crate::scene::light_table`] and
//! [`crate::scene::sky_table`] only.
//!
//! Not handled: geometry, which is the OBJ's or the glTF's.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;
use serde::Deserialize;
use toml::Spanned;

use crate::light::{Mode, Transport, Visibility};
use crate::scene::camera::{DEFAULT_FOV, ViewError};
use crate::scene::ceiling_light::assemble_lit;
use crate::scene::error::{Place, SceneError};
use crate::scene::input::SceneInput;
use crate::scene::light_table::{LightTable, light};
use crate::scene::lines::{list, shorten};
use crate::scene::material_checks::check_emission;
use crate::scene::sky_table::SkyTable;
use crate::scene::source::Source;
use crate::scene::{AddedLight, Camera, Material, Scene, Sides, geometry_file, lines};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneTable {
    #[serde(alias = "mesh")]
    obj: Spanned<String>,
    mode: Option<Spanned<String>>,
    alpha: Option<Spanned<f64>>,
    tau: Option<Spanned<f64>>,
    camera: Option<Spanned<CameraTable>>,
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
    up: Option<Spanned<[f64; 3]>>,
    vertical_fov: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialTable {
    mode: Option<Spanned<String>>,
    alpha: Option<Spanned<f64>>,
    tau: Option<Spanned<f64>>,
    two_sided: Option<bool>,
    emission: Option<Spanned<[f64; 3]>>,
    visible_emission: Option<bool>,
}

/// Reads a scene file and the geometry that it names.
pub(crate) fn read(input: &SceneInput) -> Result<Scene, SceneError> {
    let SceneInput { name, file, bytes, reader, options } = *input;
    let source = Source { file, text: lines::decode(file, bytes)? };
    let table: SceneTable = toml::from_str(source.text).map_err(|error| SceneError::SceneFile {
        place: source.place(error.span().map_or(0, |span| span.start)),
        message: error.message().to_owned(),
    })?;
    let (alpha, tau) = numbers(&source, &table.mode, &table.alpha, &table.tau)?;
    let default = Transport::default();
    let obj_name = table.obj.get_ref();
    let bytes = reader(obj_name).map_err(|error| SceneError::MissingObj {
        place: source.of(&table.obj),
        name: shorten(obj_name),
        source: error,
    })?;
    let mut soup = geometry_file::read_beside(&SceneInput { name, file: obj_name, bytes: &bytes, reader, options })?;
    // Of two materials of one name the first counts, so it comes last.
    let names = soup.materials.iter().enumerate().rev();
    let index: HashMap<String, usize> = names.map(|(i, m)| (m.name.clone(), i)).collect();
    for (name, changes) in &table.materials {
        let found = index.get(name.get_ref()).copied();
        let index = found.ok_or_else(|| SceneError::UnknownMaterial {
            place: source.of(name),
            name: shorten(name.get_ref()),
            known: list(soup.materials.iter().map(|material| material.name.as_str())),
        })?;
        changes.apply(&source, &mut soup.materials[index])?;
    }
    options.apply(&mut soup.materials, |name| table.says_sides(name));
    // Where light is may tell from where a scene is looked at; an added luminaire is not looked at.
    let is_lit = !table.lights.is_empty() || table.sky.is_some();
    let is_framed_lit = is_lit && table.camera.is_none() && options.light != Some(AddedLight::Ceiling);
    soup.has_view = table.camera.is_some() || is_framed_lit;
    let mut scene = assemble_lit(soup, options.light)?;
    scene.transport = (alpha.is_some() || tau.is_some())
        .then(|| Transport { alpha: alpha.unwrap_or(default.alpha), tau: tau.unwrap_or(default.tau) });
    if let Some(camera) = &table.camera {
        scene.camera = camera.get_ref().camera(&source, source.of(camera), &scene)?;
    }
    for table in &table.lights {
        scene.lights.push(light(&source, table, &scene.frame)?);
    }
    if let Some(sky) = &table.sky {
        scene.set_sky(sky.light(&source)?, table.up());
    }
    if is_framed_lit && scene.cameras.is_empty() {
        scene.camera = Camera::framing(&scene);
    }
    Ok(scene)
}

impl SceneTable {
    /// The camera's `up` as given, else +y: which half of the sky is the upper one.
    fn up(&self) -> DVec3 {
        let camera = self.camera.as_ref().and_then(|camera| camera.get_ref().up.as_ref());
        camera.map_or(DVec3::Y, |up| DVec3::from_array(*up.get_ref()))
    }

    fn says_sides(&self, name: &str) -> bool {
        self.materials.get(name).is_some_and(|material| material.two_sided.is_some())
    }
}

impl MaterialTable {
    fn apply(&self, source: &Source, material: &mut Material) -> Result<(), SceneError> {
        (material.alpha, material.tau) = numbers(source, &self.mode, &self.alpha, &self.tau)?;
        if let Some(emission) = &self.emission {
            check_emission(*emission.get_ref(), &material.name, || source.of(emission))?;
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
    fn camera(&self, source: &Source, place: Place, scene: &Scene) -> Result<Camera, SceneError> {
        let position = source.vector("position", &self.position)?;
        let target = source.vector("target", &self.target)?;
        let up = match &self.up {
            Some(up) => source.vector("up", up)?,
            None => DVec3::Y,
        };
        let fov = self.vertical_fov.as_ref().map_or(DEFAULT_FOV, |fov| *fov.get_ref());
        let eye = scene.frame.to_unit(position).as_vec3();
        let finite = eye.is_finite().then_some(()).ok_or(ViewError::NotFinite);
        let camera = finite.and_then(|()| Camera::look_at(position, target, up, fov));
        match (camera, &self.vertical_fov) {
            (Ok(camera), _) => Ok(Camera { position: eye, ..camera }),
            (Err(error @ ViewError::Fov(_)), Some(fov)) => {
                Err(SceneError::View { place: source.of(fov), source: error })
            }
            (Err(error), _) => Err(SceneError::View { place, source: error }),
        }
    }
}

/// alpha and tau as given by a mode or by themselves.
fn numbers(
    source: &Source,
    mode: &Option<Spanned<String>>,
    alpha: &Option<Spanned<f64>>,
    tau: &Option<Spanned<f64>>,
) -> Result<(Option<f32>, Option<f32>), SceneError> {
    let Some(mode) = mode else {
        return Ok((share(source, "alpha", alpha)?, share(source, "tau", tau)?));
    };
    if alpha.is_some() || tau.is_some() {
        return Err(SceneError::ModeAndNumbers { place: source.of(mode) });
    }
    let Some(found) = Mode::from_name(mode.get_ref()) else {
        return Err(SceneError::UnknownMode { place: source.of(mode), value: shorten(mode.get_ref()) });
    };
    let Transport { alpha, tau } = found.transport();
    Ok((Some(alpha), Some(tau)))
}

/// alpha or tau, if given and in 0..=1.
fn share(source: &Source, name: &'static str, value: &Option<Spanned<f64>>) -> Result<Option<f32>, SceneError> {
    let Some(value) = value else { return Ok(None) };
    let number = *value.get_ref();
    if !(0.0..=1.0).contains(&number) {
        let error = crate::light::TransportError { name, value: number as f32 };
        return Err(SceneError::Transport { place: source.of(value), source: error });
    }
    Ok(Some(number as f32))
}
