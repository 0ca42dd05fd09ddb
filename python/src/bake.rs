//! Lightmaps as arrays.

use std::path::PathBuf;
use std::sync::Arc;

use halflight::render::Unmet;
use halflight_bake::{Bake, BakeError, BakeGoal, Held, Lamps, LightMap, Model, bake as baked_maps, write_maps};
use numpy::ndarray::{Array2, Array3};
use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;

use crate::errors::Raise;
use crate::running::{briefly, run};
use crate::scene::{Run, Scene, transport};

/// Maps of a scene: `halflight.LightMaps`.
#[pyclass(frozen, module = "halflight._native")]
pub struct Baked {
    scene: Arc<halflight::Scene>,
    model: Model,
    bake: Bake,
    held: Held,
    tolerance: f64,
}

/// How a scene is baked: `halflight._bake.Effort`.
#[derive(FromPyObject)]
pub struct Effort {
    texels: usize,
    padding: usize,
    tolerance: f64,
    indirect: bool,
    luminaires: bool,
}

/// Bakes the light of a scene onto its surfaces.
#[pyfunction]
pub fn bake(py: Python, scene: &Scene, mode: (f32, f32), effort: Effort, asked: Run) -> PyResult<Baked> {
    let held = if effort.indirect { Held::Reflected } else { Held::All };
    let lamps = if effort.luminaires { Lamps::Apart } else { Lamps::Together };
    let (own, model, tolerance) = (Arc::clone(&scene.scene), Model::of(&scene.scene), effort.tolerance);
    let found = run(py, asked.progress.as_ref(), |steps| {
        let goal = BakeGoal {
            transport: transport(mode),
            tolerance,
            held,
            lamps,
            texels: effort.texels,
            padding: effort.padding,
            seed: asked.seed,
            memory: asked.bytes(),
            watch: steps,
        };
        baked_maps(&own, model.parts(), &goal)
    })?;
    let bake = found.map_err(Raise::raise)?;
    Ok(Baked { scene: Arc::clone(&scene.scene), model, bake, held, tolerance })
}

impl Raise for BakeError {
    fn raise(self) -> PyErr {
        match self {
            BakeError::Render(error) => error.raise(),
            BakeError::Image(error) => error.raise(),
            BakeError::Write(error) => pyo3::exceptions::PyOSError::new_err(crate::errors::words(&error)),
            own => pyo3::exceptions::PyValueError::new_err(crate::errors::words(&own)),
        }
    }
}

#[pymethods]
impl Baked {
    /// Irradiance, and its standard error, W/m²: of all light, or of luminaire number `lamp`.
    #[pyo3(signature = (lamp=None))]
    fn map<'py>(&self, py: Python<'py>, lamp: Option<usize>) -> (Bound<'py, PyArray3<f32>>, Bound<'py, PyArray3<f32>>) {
        let LightMap { irradiance, standard_error, .. } = &self.bake.maps[lamp.map_or(0, |lamp| lamp + 1)];
        let array = |own: &halflight::pictures::Picture| {
            let numbers = own.pixels.iter().flat_map(|pixel| pixel.to_array()).collect();
            let shaped = Array3::from_shape_vec((own.height, own.width, 3), numbers).expect("three numbers a pixel");
            PyArray3::from_owned_array(py, shaped)
        };
        (array(irradiance), array(standard_error))
    }

    /// RMS irradiance, W/m², and estimated relative error: of all light, then of the luminaires.
    fn errors(&self) -> Vec<(f64, f64)> {
        self.bake.maps.iter().map(|map| (map.rms, map.error)).collect()
    }

    /// Names of the luminaires that are kept apart.
    fn luminaires(&self) -> Vec<&str> {
        self.bake.maps.iter().filter_map(|map| map.lamp.as_deref()).collect()
    }

    /// The share of each texel that shows something.
    fn coverage<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let side = self.bake.layout.texels;
        PyArray2::from_owned_array(
            py,
            Array2::from_shape_fn((side, side), |(y, x)| self.bake.coverage.of(y * side + x)),
        )
    }

    /// Where the corners of every face lie in the map, shares of its sides from the upper left.
    fn uv<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f64>> {
        let places = self.model.face_places(&self.bake.layout, self.scene.solid_faces() as usize);
        let one = |(face, corner, axis): (usize, usize, usize)| places[face][corner][axis];
        PyArray3::from_owned_array(py, Array3::from_shape_fn((places.len(), 3, 2), one))
    }

    /// Texels a unit of the file, patches, rays and seconds; and whether the error is at most the tolerance.
    fn taken(&self) -> (f64, usize, u64, f64, bool) {
        let Bake { layout, patches, rays, seconds, unmet, .. } = &self.bake;
        (layout.scale, *patches, *rays, *seconds, unmet.is_none())
    }

    /// Why the error is above the tolerance.
    fn why(&self) -> Option<String> {
        self.bake.unmet.as_ref().map(Unmet::to_string)
    }

    /// Writes what the program's `bake` writes into a folder; returns the files.
    fn save(&self, py: Python, folder: PathBuf, name: &str, errors: bool) -> PyResult<Vec<PathBuf>> {
        let write = || {
            let place = (&folder as &std::path::Path, name);
            write_maps(place, (&self.scene, &self.model), &self.bake, (self.held, self.tolerance), errors)
        };
        briefly(py, write)?.map(|(_, files)| files).map_err(Raise::raise)
    }
}
