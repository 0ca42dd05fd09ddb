//! Form factors between objects, and between patches.

use halflight::Transport;
use halflight::render::{Discretization, Fineness};
use halflight_study::{Exchange, FactorMatrix, FactorSettings, PatchFactors, factors, patch_factors as between};
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays;
use crate::errors::Raise;
use crate::running::run;
use crate::scene::{Run, Scene};
use crate::system::{Places, places};

/// Form factors between the objects of a scene: `halflight.Factors`.
#[pyclass(frozen, module = "halflight._native")]
pub struct ObjectFactors {
    matrix: FactorMatrix,
    how: Vec<&'static str>,
    unmet: usize,
}

/// Form factors between patches: `halflight.PatchFactors`.
#[pyclass(frozen, module = "halflight._native")]
pub struct Between {
    found: PatchFactors,
    cut: Discretization,
}

/// tau of each material where those without their own take one.
fn taus(scene: &Scene, tau: f32) -> Vec<f32> {
    scene.scene.transports(Transport { alpha: 1.0, tau }).iter().map(|t| t.tau).collect()
}

/// Finds those between objects.
#[pyfunction]
pub fn object_factors(py: Python, scene: &Scene, tau: f32, tolerance: f64, asked: Run) -> PyResult<ObjectFactors> {
    let (tau, settings) = (taus(scene, tau), FactorSettings { tolerance, seed: asked.seed });
    let table = run(py, asked.progress.as_ref(), |steps| factors(&scene.scene, &tau, &settings, steps))?;
    let how = table.factors.iter().map(|factor| factor.how.name()).collect();
    Ok(ObjectFactors { matrix: FactorMatrix::of(&table), how, unmet: table.unmet })
}

/// Finds those between patches.
#[pyfunction]
pub fn patch_factors(py: Python, scene: &Scene, tau: f32, fineness: (usize, u32), asked: Run) -> PyResult<Between> {
    let fineness = Fineness { patches: fineness.0, rays: fineness.1 };
    let found = run(py, asked.progress.as_ref(), |steps| {
        let bytes = asked.bytes();
        let solver = scene.solver(asked.seed, bytes);
        let (cut, sampling) = (solver.cut(fineness.patches), fineness.sampling(asked.seed));
        cut.check_memory(&[Transport { alpha: 1.0, tau }], &sampling, 1, bytes)?;
        Ok((between(&cut, &taus(scene, tau), &sampling, steps), cut))
    })?;
    let (found, cut) = found.map_err(halflight::render::Unfit::raise)?;
    Ok(Between { found, cut })
}

/// Three matrices, and two numbers of each object.
type Exchanged<'py> = ([Bound<'py, PyArray2<f64>>; 3], [Vec<f64>; 2]);

/// What objects exchange by radiation: Gebhart's factors, conductances and the matrix of the net-radiation method, each
/// n × columns; the sums of rows, and how far conductances are from those back.
#[pyfunction]
pub fn exchange<'py>(
    py: Python<'py>,
    matrix: PyReadonlyArray2<f64>,
    areas: Vec<f64>,
    emissivities: Vec<f64>,
) -> PyResult<Exchanged<'py>> {
    let (n, m) = matrix.as_array().dim();
    let columns: Vec<String> = (0..m).map(|k| k.to_string()).collect();
    let own = FactorMatrix {
        rows: columns[..n].to_vec(),
        columns,
        values: matrix.as_array().iter().copied().collect(),
        errors: vec![0.0; n * m],
        areas,
        closure: vec![0.0; n],
        reciprocity: vec![0.0; n * n],
    };
    let found = Exchange::of(&own, &emissivities).map_err(|error| PyValueError::new_err(error.to_string()))?;
    let of = |numbers: Vec<f64>| {
        let numbers = Array2::from_shape_vec((n, m), numbers).expect("a number for each pair");
        PyArray2::from_owned_array(py, numbers)
    };
    let Exchange { gebhart, conductances, net, row_sums, reciprocity, .. } = found;
    Ok(([gebhart, conductances, net].map(of), [row_sums, reciprocity]))
}

#[pymethods]
impl ObjectFactors {
    /// Names of the rows, and of the columns.
    fn names(&self) -> (Vec<String>, Vec<String>) {
        (self.matrix.rows.clone(), self.matrix.columns.clone())
    }

    /// `F_ij`, and their standard errors.
    fn matrix<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>) {
        let shape = (self.matrix.rows.len(), self.matrix.columns.len());
        let of = |numbers: &[f64]| {
            let numbers = Array2::from_shape_vec(shape, numbers.to_vec()).expect("a number for each pair");
            PyArray2::from_owned_array(py, numbers)
        };
        (of(&self.matrix.values), of(&self.matrix.errors))
    }

    /// How each was found, row by row.
    fn how(&self) -> Vec<&'static str> {
        self.how.clone()
    }

    /// Areas, the file's units squared, and what is missing of 1 in each row.
    fn rows<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
        (PyArray1::from_slice(py, &self.matrix.areas), PyArray1::from_slice(py, &self.matrix.closure))
    }

    /// Residuals of reciprocity of each pair.
    fn reciprocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let n = self.matrix.rows.len();
        let numbers = Array2::from_shape_vec((n, n), self.matrix.reciprocity.clone()).expect("n times n");
        PyArray2::from_owned_array(py, numbers)
    }

    /// Form factors whose standard error exceeds the tolerance.
    fn unmet(&self) -> usize {
        self.unmet
    }
}

#[pymethods]
impl Between {
    /// Columns and values of F, row by row.
    fn factors(slf: Bound<'_, Self>) -> (Bound<'_, PyArray1<u32>>, Bound<'_, PyArray1<f32>>) {
        let (_, columns, values) = slf.get().found.factors.rows.parts();
        let owner = || slf.clone().into_any();
        (arrays::view(owner(), columns, columns.len()), arrays::view(owner(), values, values.len()))
    }

    /// Where the rows of F begin, and their end.
    fn starts<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let (starts, ..) = self.found.factors.rows.parts();
        PyArray1::from_vec(py, starts.iter().map(|&start| start as i64).collect())
    }

    /// Share of each patch's rays that reach the sky, what is missing of 1 in its row, and its residual of reciprocity.
    fn shares(slf: Bound<'_, Self>) -> [Bound<'_, PyArray1<f32>>; 3] {
        let found = &slf.get().found;
        [&found.sky, &found.closure, &found.reciprocity]
            .map(|numbers| arrays::view(slf.clone().into_any(), &numbers[..], numbers.len()))
    }

    /// Areas, the file's units squared.
    fn areas(slf: Bound<'_, Self>) -> Bound<'_, PyArray1<f64>> {
        let areas = &slf.get().found.areas;
        arrays::view(slf.clone().into_any(), &areas[..], areas.len())
    }

    /// The object of each patch.
    fn objects(slf: Bound<'_, Self>) -> Bound<'_, PyArray1<u32>> {
        let objects = &slf.get().found.objects;
        arrays::view(slf.clone().into_any(), &objects[..], objects.len())
    }

    /// Middles in the file's units, NaN for halves of the sky; and unit normals.
    fn places<'py>(&self, py: Python<'py>) -> PyResult<Places<'py>> {
        places(py, &self.cut.geometry.scene, &self.cut.patches)
    }

    /// Number of patches that are no sky's, which come last.
    fn solid(&self) -> usize {
        let (scene, patches) = (&self.cut.geometry.scene, &self.cut.patches);
        (0..patches.len()).take_while(|&i| !patches.is_sky(scene, i)).count()
    }

    /// The residual of reciprocity of all rows together, and rays cast.
    fn taken(&self) -> (f64, u64) {
        (self.found.residual, self.found.rays)
    }
}
