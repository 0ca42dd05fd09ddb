//! Scenes: read from files or built in; what they hold, and others made from them.
//!
//! A scene never changes: what changes one makes another. Its rays are made ready when they are first needed, and kept.
//!
//! Not handled: scenes made from arrays (`given`).

use std::sync::{Arc, OnceLock};

use glam::DVec3;
use halflight::light::{Rgb, Visibility};
use halflight::scene::{AddedLight, Camera, Emitters, LoadOptions, Sides, Sky, SkyLight, SkyPatches, Winding, builtin};
use halflight::{Solver, Transport};
use halflight_export::{scene_from_bytes as of_bytes, scene_to_bytes};
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors::Raise;
use crate::running::{briefly, run};

/// A checked scene.
#[pyclass(frozen, module = "halflight._native")]
pub struct Scene {
    pub scene: Arc<halflight::Scene>,
    solver: OnceLock<Solver>,
}

/// What is asked of every solve: `halflight._arguments.Run`.
#[derive(FromPyObject)]
pub struct Run {
    pub seed: u32,
    /// Bytes that K or pictures may take.
    memory: Option<f64>,
    pub progress: Option<Py<PyAny>>,
}

impl Run {
    /// Bytes that may be used.
    pub fn bytes(&self) -> f64 {
        self.memory.unwrap_or_else(halflight::render::usable_memory)
    }
}

impl From<halflight::Scene> for Scene {
    fn from(scene: halflight::Scene) -> Scene {
        Scene { scene: Arc::new(scene), solver: OnceLock::new() }
    }
}

impl Scene {
    /// The solver of the scene, its rays made ready once.
    pub fn solver(&self, seed: u32, bytes: f64) -> Solver {
        let made = self.solver.get_or_init(|| Solver::new(&self.scene));
        made.clone().seed(seed).memory(bytes)
    }
}

/// Reads a file, or a built-in scene, on another thread, so that signals are heard.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the options of `load`")]
pub fn open_scene(
    py: Python,
    scene: &str,
    two_sided: bool,
    reflectance: Option<f32>,
    light: Option<&str>,
    highlights: bool,
    camera: Option<&str>,
    unit: Option<&str>,
    as_modelled: bool,
) -> PyResult<Scene> {
    let winding = if as_modelled { Winding::AsModelled } else { Winding::Turned };
    let unit = unit.and_then(|symbol| symbol.parse().ok());
    let light = light.map(|light| if light == "sky" { AddedLight::Sky } else { AddedLight::Ceiling });
    let two_sided = if two_sided { Sides::Two } else { Sides::One };
    let options = LoadOptions { two_sided, reflectance, light, highlights, unit, winding };
    let read = || {
        let mut scene = halflight::Scene::open_with(scene, options)?;
        if let Some(name) = camera {
            scene.look_through(name)?;
        }
        Ok(scene)
    };
    run(py, None, |_| read())?.map(Scene::from).map_err(halflight::scene::SceneError::raise)
}

/// The names of the built-in scenes, each with a line on it.
#[pyfunction]
pub fn builtin_scenes() -> Vec<(&'static str, &'static str)> {
    builtin::listed().collect()
}

/// The scene that [`Scene::to_bytes`] gave.
#[pyfunction]
pub fn scene_from_bytes(py: Python, bytes: &[u8]) -> PyResult<Scene> {
    briefly(py, || of_bytes(bytes))?.map(Scene::from).map_err(Raise::raise)
}

#[pymethods]
impl Scene {
    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    /// Corner points in the file's units, those of faces that have a place.
    fn vertices<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let scene = &self.scene;
        let count = scene.vertices.len() - 3 * scene.sky.as_ref().map_or(0, |sky| sky.cells() as usize);
        let points: Vec<[f64; 3]> =
            scene.vertices[..count].iter().map(|v| scene.frame.to_file(v.as_dvec3()).to_array()).collect();
        PyArray2::from_owned_array(py, numbers(&points))
    }

    /// Vertices of the triangles, counter-clockwise seen from the front.
    fn faces<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<u32>> {
        let faces: Vec<[u32; 3]> = self.solid().map(|face| face.vertices).collect();
        PyArray2::from_owned_array(py, numbers(&faces))
    }

    /// The material of each triangle.
    fn face_material<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_vec(py, self.solid().map(|face| face.material).collect())
    }

    /// The object of each triangle.
    fn face_object<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_vec(py, self.solid().map(|face| face.object).collect())
    }

    /// Names of the objects, without the sky's.
    fn objects(&self) -> Vec<&str> {
        self.scene.objects[..self.scene.solid_objects()].iter().map(String::as_str).collect()
    }

    /// Name, rho, emission, alpha, tau, whether two-sided, and whether its emission is seen, of each material.
    #[expect(clippy::type_complexity, reason = "the fields of halflight.Material")]
    fn materials(&self) -> Vec<(&str, [f32; 3], [f32; 3], Option<f32>, Option<f32>, bool, bool)> {
        let own = (0..self.scene.materials.len()).filter(|&m| !self.scene.is_sky_material(m));
        let one = |m: usize| {
            let m = &self.scene.materials[m];
            let (two, seen) = (m.sides == Sides::Two, m.visibility == Visibility::Seen);
            (m.name.as_str(), m.rho.to_array(), m.emission.to_array(), m.alpha, m.tau, two, seen)
        };
        own.map(one).collect()
    }

    /// Names of what emits, as light is kept apart by.
    fn luminaires(&self) -> Vec<String> {
        Emitters::of(&self.scene).names().to_vec()
    }

    /// Names of the file's cameras.
    fn cameras(&self) -> Vec<&str> {
        self.scene.cameras.iter().map(|camera| camera.name.as_str()).collect()
    }

    /// Position, target and up of the camera in the file's units, and its vertical field of view, degrees. The target
    /// is as far away as the middle of the scene, or half the scene's size where that is behind.
    fn camera(&self) -> ([f64; 3], [f64; 3], [f64; 3], f64) {
        let Camera { position, forward, up, vertical_fov, .. } = self.scene.camera;
        let (eye, way) = (position.as_dvec3(), forward.as_dvec3());
        let target = eye + (-eye.dot(way)).max(1.0) * way;
        let file = |point: DVec3| self.scene.frame.to_file(point).to_array();
        (file(eye), file(target), up.as_dvec3().to_array(), vertical_fov.into())
    }

    /// (alpha, tau) that the file gives.
    fn transport(&self) -> Option<(f32, f32)> {
        self.scene.transport.map(|t| (t.alpha, t.tau))
    }

    /// What the reader left out, and what else a person should know.
    fn warnings(&self) -> Vec<&str> {
        self.scene.warnings.iter().map(|warning| &**warning).collect()
    }

    /// Raises `SceneError` where nothing emits.
    fn require_emission(&self) -> PyResult<()> {
        self.scene.require_emission().map_err(Raise::raise)
    }

    /// All of it.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &briefly(py, || scene_to_bytes(&self.scene))?))
    }

    /// The same from another camera.
    fn looked_at(&self, position: [f64; 3], target: [f64; 3], up: [f64; 3], vertical_fov: f64) -> PyResult<Scene> {
        let frame = &self.scene.frame;
        let unit = |point: [f64; 3]| frame.to_unit(point.into());
        let camera = Camera::look_at(unit(position), unit(target), up.into(), vertical_fov).map_err(Raise::raise)?;
        Ok(halflight::Scene { camera, ..(*self.scene).clone() }.into())
    }

    /// The same through a camera of its file.
    fn looked_through(&self, name: &str) -> PyResult<Scene> {
        let mut scene = (*self.scene).clone();
        scene.look_through(name).map_err(halflight::scene::SceneError::raise)?;
        Ok(scene.into())
    }

    /// The same under another sky, which has no patch of the old one.
    fn under_sky(&self, upper: [f32; 3], lower: [f32; 3], up: [f64; 3]) -> Scene {
        let mut scene = (*self.scene).clone();
        scene.set_sky(SkyLight { upper: upper.into(), lower: lower.into() }, up.into());
        scene.into()
    }

    /// The same under a sky of patches in Radiance's order; none where they are of another number, or north is along up.
    fn under_patches(&self, radiances: Vec<[f32; 3]>, up: [f64; 3], north: Option<[f64; 3]>) -> Option<Scene> {
        let patches = SkyPatches::new(radiances.into_iter().map(Rgb::from).collect())?;
        let up = DVec3::from(up);
        let north = north.map_or_else(|| Some(Sky::usual_north(up)), |north| Sky::level(north.into(), up))?;
        let mut scene = (*self.scene).clone();
        scene.set_patched_sky(&patches, up, north);
        Some(scene.into())
    }

    /// The same with other numbers of the material of a name; what is `None` stays.
    #[pyo3(signature = (name, rho=None, emission=None, alpha=None, tau=None, two_sided=None))]
    fn with_material(
        &self,
        name: &str,
        rho: Option<[f32; 3]>,
        emission: Option<[f32; 3]>,
        alpha: Option<f32>,
        tau: Option<f32>,
        two_sided: Option<bool>,
    ) -> PyResult<Scene> {
        let mut scene = (*self.scene).clone();
        let found = (0..scene.materials.len()).filter(|&m| !scene.is_sky_material(m));
        let named: Vec<usize> = found.filter(|&m| scene.materials[m].name == name).collect();
        if named.is_empty() {
            return Err(PyKeyError::new_err(name.to_owned()));
        }
        for m in named {
            let material = &mut scene.materials[m];
            material.rho = rho.map_or(material.rho, Rgb::from);
            material.emission = emission.map_or(material.emission, Rgb::from);
            material.alpha = alpha.or(material.alpha);
            material.tau = tau.or(material.tau);
            if let Some(two) = two_sided {
                material.sides = if two { Sides::Two } else { Sides::One };
            }
        }
        Ok(scene.into())
    }
}

impl Scene {
    fn solid(&self) -> impl Iterator<Item = &halflight::scene::Face> {
        self.scene.faces[..self.scene.solid_faces() as usize].iter()
    }
}

/// Rows as an array.
pub fn numbers<T: Clone, const N: usize>(rows: &[[T; N]]) -> Array2<T> {
    Array2::from_shape_vec((rows.len(), N), rows.as_flattened().to_vec()).expect("N numbers a row")
}

/// (alpha, tau), which Python has checked.
pub fn transport((alpha, tau): (f32, f32)) -> Transport {
    Transport { alpha, tau }
}
