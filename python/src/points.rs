//! Irradiance at points.

use glam::DVec3;
use halflight::render::{Apart, Sensor, SensorLights};
use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::errors::Raise;
use crate::running::run;
use crate::scene::{Run, Scene, numbers, transport};

/// Irradiance at points: `halflight.Irradiance`.
#[pyclass(frozen, module = "halflight._native")]
pub struct Sensed {
    lights: SensorLights,
}

/// Measures light at points, positions and normals in the file's units.
#[pyfunction]
pub fn points(
    py: Python,
    scene: &Scene,
    mode: (f32, f32),
    sensors: (PyReadonlyArray2<f64>, PyReadonlyArray2<f64>),
    tolerance: f64,
    luminaires: bool,
    asked: Run,
) -> PyResult<Sensed> {
    let point = |row: ArrayView1<f64>| DVec3::new(row[0], row[1], row[2]);
    let (positions, normals) = (sensors.0.as_array(), sensors.1.as_array());
    let pairs = positions.rows().into_iter().zip(normals.rows());
    let sensor = |(at, normal)| Sensor { position: point(at), normal: point(normal) };
    let sensors: Vec<Sensor> = pairs.map(sensor).collect();
    let apart = Apart { emitters: luminaires, bounces: false };
    let found = run(py, asked.progress.as_ref(), |steps| {
        let solver = scene.solver(asked.seed, asked.bytes()).apart(apart);
        solver.points(transport(mode), &sensors).watch(steps).tolerance(tolerance)
    })?;
    Ok(Sensed { lights: found.map_err(Raise::raise)? })
}

/// Illuminance of irradiances.
#[pyfunction]
pub fn lux<'py>(py: Python<'py>, irradiance: PyReadonlyArray2<f64>) -> Bound<'py, PyArray1<f64>> {
    let rows = irradiance.as_array();
    let of = |row: ArrayView1<f64>| halflight_lighting::lux(&[row[0], row[1], row[2]]);
    PyArray1::from_vec(py, rows.rows().into_iter().map(of).collect())
}

#[pymethods]
impl Sensed {
    /// Irradiance, and its standard error, W/m².
    fn irradiance<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>) {
        let of = |own: fn(&halflight::render::SensorLight) -> [f64; 3]| {
            let rows: Vec<[f64; 3]> = self.lights.points.iter().map(own).collect();
            PyArray2::from_owned_array(py, numbers(&rows))
        };
        (of(|light| light.irradiance), of(|light| light.error))
    }

    /// Bounces that are kept apart.
    fn bounces(&self) -> usize {
        self.lights.points.iter().map(|light| light.bounces.len()).max().unwrap_or(0)
    }

    /// Irradiance by light that was reflected n times.
    fn bounce<'py>(&self, py: Python<'py>, n: usize) -> Bound<'py, PyArray2<f64>> {
        let own = |light: &halflight::render::SensorLight| light.bounces.get(n).copied().unwrap_or_default();
        let rows: Vec<[f64; 3]> = self.lights.points.iter().map(own).collect();
        PyArray2::from_owned_array(py, numbers(&rows))
    }

    /// Names of the luminaires that are kept apart.
    fn luminaires(&self) -> Vec<&str> {
        self.lights.points.first().map_or_else(Vec::new, |light| light.luminaires.keys().map(String::as_str).collect())
    }

    /// Irradiance by the light of one.
    fn luminaire<'py>(&self, py: Python<'py>, name: &str) -> Bound<'py, PyArray2<f64>> {
        let own = |light: &halflight::render::SensorLight| light.luminaires.get(name).copied().unwrap_or_default();
        let rows: Vec<[f64; 3]> = self.lights.points.iter().map(own).collect();
        PyArray2::from_owned_array(py, numbers(&rows))
    }

    /// Whether each is inside of a solid.
    fn is_inside(&self) -> Vec<bool> {
        self.lights.points.iter().map(|light| light.is_inside).collect()
    }

    /// Share of the points whose error is at most the tolerance; patches, rays and seconds.
    fn taken(&self) -> (f64, usize, u64, f64) {
        let SensorLights { met, patches, rays, seconds, .. } = &self.lights;
        (*met, *patches, *rays, *seconds)
    }
}
