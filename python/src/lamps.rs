//! Lamps of other strengths, from light that was kept apart: what a run of the program left, and how far each lamp is
//! to be dimmed.
//!
//! Not handled: errors of what is dimmed, which are those of the parts.

use std::path::PathBuf;

use halflight_lighting::{Factors, LampLight, dimmed as dim};
use numpy::{PyArray3, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::errors::Raise;
use crate::picture::owned;
use crate::running::briefly;

/// The light of each lamp as an earlier run left it.
#[pyclass(frozen, module = "halflight._native")]
pub struct KeptLamps(LampLight);

/// Powers of a lamp: its name, emitted and reflected, W.
type Power = (String, [f64; 3], [f64; 3]);

/// A point: its name, position, irradiance, illuminance, and whether it is inside of a solid.
type Point = (Option<String>, [f64; 3], [f64; 3], f64, bool);

/// Reads what a run left: a report, or an EXR file with layers of lamps.
#[pyfunction]
pub fn open_lamps(py: Python, file: PathBuf) -> PyResult<KeptLamps> {
    briefly(py, || LampLight::open(&file))?.map(KeptLamps).map_err(Raise::raise)
}

/// The factors from 0 to 1 of lamps with the illuminances `lit` (points, lamps) that come nearest to `wanted`.
#[pyfunction]
pub fn dimmed(lit: PyReadonlyArray2<f64>, wanted: Vec<f64>) -> Option<Vec<f64>> {
    let rows: Vec<Vec<f64>> = lit.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
    dim(&rows, &wanted)
}

#[pymethods]
impl KeptLamps {
    /// The lamps.
    fn names(&self) -> Vec<String> {
        self.0.names()
    }

    /// How many points were measured, and whether with the light of each lamp.
    fn points(&self) -> (usize, bool) {
        let points = self.0.points();
        (points.len(), points.iter().any(|point| !point.luminaires.is_empty()))
    }

    /// Numbers of the points of a name.
    fn named(&self, name: &str) -> Vec<usize> {
        let points = self.0.points().iter().enumerate();
        points.filter(|(_, point)| point.name.as_deref() == Some(name)).map(|(k, _)| k).collect()
    }

    /// The factors given, and those of all other lamps that light points as wanted, lux.
    fn aimed(&self, wanted: Vec<Option<f64>>, given: Factors) -> Factors {
        self.0.aimed(&wanted, &given)
    }

    /// Factors of all lamps, powers and points with some factors; root mean square and largest difference to what is
    /// wanted.
    fn relit(
        &self,
        given: Factors,
        wanted: Option<Vec<Option<f64>>>,
    ) -> (Factors, Vec<Power>, Vec<Point>, Option<[f64; 2]>) {
        let relit = self.0.relit(&given, wanted.as_deref());
        let powers = relit.luminaires.into_iter().map(|own| (own.name, own.emitted, own.reflected));
        let points = relit.points.into_iter();
        let points = points.map(|p| (p.name, p.position, p.irradiance, p.illuminance, p.is_inside));
        (relit.factors, powers.collect(), points.collect(), relit.left_over)
    }

    /// The estimated error of the picture with some factors, relative to it; none where those of its layers are not
    /// known.
    fn error(&self, given: Factors) -> Option<f64> {
        self.0.error(&given)
    }

    /// The picture with some factors; none where no layers were kept.
    fn picture<'py>(&self, py: Python<'py>, given: Factors) -> PyResult<Option<Bound<'py, PyArray3<f32>>>> {
        briefly(py, || self.0.picture(&given))?.map(|picture| owned(py, picture)).transpose()
    }
}
