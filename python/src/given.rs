//! Scenes made from arrays: polygons, materials with textures, lights without area, as `halflight._scene` gives them.
//!
//! Not handled: masks, colours of vertices and measured intensities, which files have.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2};
use halflight::light::Visibility;
use halflight::pictures::Texels;
use halflight::scene::textures::{Filter, Image, Maps, Texture, Wrap};
use halflight::scene::{
    Beam, GivenFace, Material, PunctualForm, PunctualLight, PunctualPlace, SceneArrays, SceneError, Sides,
};
use numpy::ndarray::ArrayView1;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

use crate::errors::Raise;
use crate::running::briefly;
use crate::scene::Scene;

/// All of a scene: `halflight._scene.Arrays`; polygons have `counts` corners each, one after the other in `corners`.
#[derive(FromPyObject)]
pub struct GivenArrays<'py> {
    name: String,
    vertices: PyReadonlyArray2<'py, f64>,
    uv: Option<PyReadonlyArray2<'py, f32>>,
    corners: PyReadonlyArray1<'py, u32>,
    counts: PyReadonlyArray1<'py, u32>,
    face_material: PyReadonlyArray1<'py, u32>,
    face_object: PyReadonlyArray1<'py, u32>,
    materials: Vec<GivenMaterial<'py>>,
    objects: Vec<String>,
    lights: Vec<GivenLight>,
    unit: String,
}

/// A material: `halflight.Material`.
#[derive(FromPyObject)]
struct GivenMaterial<'py> {
    name: String,
    rho: [f32; 3],
    emission: [f32; 3],
    alpha: Option<f32>,
    tau: Option<f32>,
    two_sided: bool,
    visible_emission: bool,
    rho_texture: Option<GivenTexture<'py>>,
    emission_texture: Option<GivenTexture<'py>>,
}

/// A texture: `halflight.Texture`.
#[derive(FromPyObject)]
struct GivenTexture<'py> {
    codes: PyReadonlyArray3<'py, u8>,
    wrap: String,
    filter: String,
}

/// A light without area: `halflight._lights.Given`. It is a spot where it has a position and a direction, the sun where
/// it has a direction alone.
#[derive(FromPyObject)]
struct GivenLight {
    name: Option<String>,
    intensity: [f32; 3],
    position: Option<[f64; 3]>,
    direction: Option<[f64; 3]>,
    exponent: f64,
    cutoff: f64,
}

impl From<GivenTexture<'_>> for Texture {
    fn from(given: GivenTexture) -> Texture {
        let codes = given.codes.as_array();
        let (height, width, channels) = codes.dim();
        let texels = Texels { width, height, channels, codes: codes.iter().copied().collect() };
        let wrap = match given.wrap.as_str() {
            "mirror" => Wrap::Mirror,
            "clamp" => Wrap::Clamp,
            _ => Wrap::Repeat,
        };
        let filter = if given.filter == "nearest" { Filter::Nearest } else { Filter::Linear };
        let placement = Texture::upright(DVec2::ONE, DVec2::ZERO);
        Texture { image: Arc::new(Image::new(texels)), placement, wrap: [wrap; 2], filter }
    }
}

impl From<GivenMaterial<'_>> for Material {
    fn from(given: GivenMaterial) -> Material {
        let reflectance = given.rho_texture.map(Texture::from);
        let emission = given.emission_texture.map(Texture::from);
        let is_textured = reflectance.is_some() || emission.is_some();
        Material {
            alpha: given.alpha,
            tau: given.tau,
            sides: if given.two_sided { Sides::Two } else { Sides::One },
            visibility: if given.visible_emission { Visibility::Seen } else { Visibility::Hidden },
            maps: is_textured.then(|| Arc::new(Maps { reflectance, emission, ..Maps::default() })),
            ..Material::new(&given.name, given.rho.into(), given.emission.into())
        }
    }
}

impl From<GivenLight> for PunctualLight {
    fn from(given: GivenLight) -> PunctualLight {
        let direction = DVec3::from(given.direction.unwrap_or_default()).normalize_or_zero();
        let place = |position: [f64; 3]| PunctualPlace::new(position.into(), PunctualLight::PHYSICAL, 1.0);
        let form = match (given.position, given.direction) {
            (None, _) => PunctualForm::Directional { direction },
            (Some(position), None) => PunctualForm::even(place(position)),
            (Some(position), Some(_)) => {
                let beam = Beam::Spot { direction, exponent: given.exponent, cutoff: given.cutoff };
                PunctualForm::Point { place: place(position), beam }
            }
        };
        PunctualLight { form, intensity: given.intensity.into(), name: given.name }
    }
}

impl From<GivenArrays<'_>> for SceneArrays {
    fn from(given: GivenArrays) -> SceneArrays {
        let corners = given.corners.as_array();
        let mut next = 0;
        let (counts, materials) = (given.counts.as_array(), given.face_material.as_array());
        let face = |((&count, &material), &object): ((&u32, &u32), &u32)| {
            let own = next..next + count as usize;
            next = own.end;
            GivenFace { corners: own.map(|k| corners[k]).collect(), material, object }
        };
        let faces = counts.into_iter().zip(materials).zip(given.face_object.as_array()).map(face).collect();
        let point = |row: ArrayView1<f64>| DVec3::new(row[0], row[1], row[2]);
        let place = |row: ArrayView1<f32>| Vec2::new(row[0], row[1]);
        SceneArrays {
            name: given.name,
            vertices: given.vertices.as_array().rows().into_iter().map(point).collect(),
            coordinates: given.uv.map_or_else(Vec::new, |uv| uv.as_array().rows().into_iter().map(place).collect()),
            faces,
            materials: given.materials.into_iter().map(Material::from).collect(),
            objects: given.objects,
            lights: given.lights.into_iter().map(PunctualLight::from).collect(),
            unit: given.unit.parse().unwrap_or_default(),
        }
    }
}

/// Makes a scene.
#[pyfunction]
pub fn scene_from_arrays(py: Python, arrays: GivenArrays) -> PyResult<Scene> {
    let arrays = SceneArrays::from(arrays);
    briefly(py, || halflight::Scene::from_arrays(arrays))?.map(Scene::from).map_err(SceneError::raise)
}
