//! `L = E + K L` on patches: what K is made of, its products, and where the patches are.
//!
//! Not handled: its solution (`series`).

use std::sync::{Arc, OnceLock};

use halflight::form_factors::{FormFactors, Rows};
use halflight::operator::{Cast, LinearOperator, RowSource, Wanted};
use halflight::patches::Patches;
use halflight::render::{Apart, Assembled, Fineness};
use halflight::solve::apply_columns;
use halflight::{Light, Transport};
use halflight_export::PatchMesh;
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays;
use crate::errors::Raise;
use crate::running::{briefly, run};
use crate::scene::{Run, Scene, numbers, transport};

/// What an equation is made of beside its scene: with it and F it is made again, bit by bit.
#[derive(Clone, Copy)]
pub struct Recipe {
    pub transport: Transport,
    pub fineness: Fineness,
    pub seed: u32,
    pub apart: Apart,
}

/// An equation.
#[pyclass(frozen, module = "halflight._native")]
pub struct System {
    pub mode: Arc<Assembled>,
    pub recipe: Recipe,
    /// Mean, least and largest sum of the rows of F before anything was left out; none where no ray was needed.
    row_sums: Option<(f64, f64, f64)>,
    mesh: OnceLock<PatchMesh>,
}

impl System {
    pub fn new(mode: Assembled, recipe: Recipe) -> System {
        let row_sums = mode.row_sums.map(|sums| (sums.mean, sums.min, sums.max));
        System { mode: Arc::new(mode), recipe, row_sums, mesh: OnceLock::new() }
    }

    fn mesh(&self) -> &PatchMesh {
        self.mesh.get_or_init(|| PatchMesh::new(self.mode.scene(), self.mode.patches()))
    }
}

/// Casts F and puts K together.
#[pyfunction]
pub fn assemble(
    py: Python,
    scene: &Scene,
    mode: (f32, f32),
    fineness: (usize, u32),
    luminaires: bool,
    asked: Run,
) -> PyResult<System> {
    let fineness = Fineness { patches: fineness.0, rays: fineness.1 };
    let apart = Apart { emitters: luminaires, bounces: false };
    let recipe = Recipe { transport: transport(mode), fineness, seed: asked.seed, apart };
    assembled(py, scene, recipe, None, asked)
}

/// The same with rows of F that are known.
#[pyfunction]
#[pyo3(signature = (scene, mode, fineness, luminaires, factors, asked))]
pub fn assemble_kept(
    py: Python,
    scene: &Scene,
    mode: (f32, f32),
    fineness: (usize, u32),
    luminaires: bool,
    factors: KeptFactors,
    asked: Run,
) -> PyResult<System> {
    let fineness = Fineness { patches: fineness.0, rays: fineness.1 };
    let apart = Apart { emitters: luminaires, bounces: false };
    let recipe = Recipe { transport: transport(mode), fineness, seed: asked.seed, apart };
    let starts = factors.indptr.as_slice()?.iter().map(|&start| start as usize).collect();
    let columns = factors.indices.as_slice()?.iter().map(|&column| column as u32).collect();
    let values = factors.data.as_slice()?.to_vec();
    let rows = briefly(py, || Rows::from_parts(starts, columns, values))?;
    let rows = rows.ok_or_else(|| PyValueError::new_err("F is no square matrix of shares: the pickle is broken"))?;
    let known = FormFactors { row_sums: vec![None; rows.len()], rows };
    Ok(System { row_sums: factors.row_sums, ..assembled(py, scene, recipe, Some(known), asked)? })
}

/// F as arrays: `halflight._solution`'s, of which fields are read.
#[derive(FromPyObject)]
pub struct KeptFactors<'py> {
    indptr: PyReadonlyArray1<'py, i64>,
    indices: PyReadonlyArray1<'py, i32>,
    data: PyReadonlyArray1<'py, f32>,
    row_sums: Option<(f64, f64, f64)>,
}

fn assembled(py: Python, scene: &Scene, recipe: Recipe, known: Option<FormFactors>, asked: Run) -> PyResult<System> {
    let Recipe { transport, fineness, seed, apart } = recipe;
    let bytes = if known.is_some() { f64::INFINITY } else { asked.bytes() };
    let found = run(py, asked.progress.as_ref(), |steps| {
        let mut solver = scene.solver(seed, bytes).apart(apart);
        if let Some(factors) = known {
            solver = solver.rows(Arc::new(KnownRows(factors)));
        }
        solver.assemble(&[transport], fineness, steps)
    })?;
    let mut equations = found.map_err(Raise::raise)?;
    Ok(System::new(equations.modes.remove(0), recipe))
}

/// Rows of F that were cast before, of the one choice of tau that is asked for.
struct KnownRows(FormFactors);

impl RowSource for KnownRows {
    fn rows(&self, wanted: &Wanted) -> (Vec<FormFactors>, u64) {
        if wanted.variants.len() == 1 && self.0.rows.len() == wanted.patches.len() {
            (vec![self.0.clone()], 0)
        } else {
            Cast.rows(wanted)
        }
    }

    fn knows(&self, wanted: &Wanted) -> bool {
        self.0.rows.len() == wanted.patches.len()
    }
}

/// Corners of triangles, and the patch of each.
type Triangles<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray1<u32>>);

/// Middles and normals of patches.
pub type Places<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f32>>);

/// Middles of patches in the file's units, NaN for halves of the sky; and unit normals.
pub fn places<'py>(py: Python<'py>, scene: &halflight::Scene, patches: &Patches) -> PyResult<Places<'py>> {
    let middle = |i: usize| match patches.is_sky(scene, i) {
        true => [f64::NAN; 3],
        false => scene.frame.to_file(patches.middle(i).as_dvec3()).to_array(),
    };
    let (middles, normals): (Vec<[f64; 3]>, Vec<[f32; 3]>) = briefly(py, || {
        let normal = |i: usize| patches.mean_normal(i).to_array();
        (0..patches.len()).map(|i| (middle(i), normal(i))).unzip()
    })?;
    Ok((PyArray2::from_owned_array(py, numbers(&middles)), PyArray2::from_owned_array(py, numbers(&normals))))
}

#[pymethods]
impl System {
    /// Number of patches.
    fn patches(&self) -> usize {
        self.mode.operator.len()
    }

    /// (alpha, tau), patches and rays requested, seed, whether luminaires are apart.
    fn recipe(&self) -> ((f32, f32), (usize, u32), u32, bool) {
        let Recipe { transport, fineness, seed, apart } = self.recipe;
        ((transport.alpha, transport.tau), (fineness.patches, fineness.rays), seed, apart.emitters)
    }

    /// The mode's name, or its numbers.
    fn label(&self) -> String {
        self.recipe.transport.label()
    }

    /// The scene.
    fn scene(&self) -> Scene {
        self.mode.scene().clone().into()
    }

    /// Names of the luminaires, where they are kept apart.
    fn luminaires(&self) -> Vec<String> {
        if self.recipe.apart.emitters { self.mode.lights.emitters().names().to_vec() } else { Vec::new() }
    }

    /// Areas, the file's units squared.
    fn areas(slf: Bound<'_, Self>) -> Bound<'_, PyArray1<f64>> {
        let areas = slf.get().mode.operator.areas();
        arrays::view(slf.clone().into_any(), areas, areas.len())
    }

    /// Reflectances.
    fn rho(slf: Bound<'_, Self>) -> Bound<'_, PyArray2<f32>> {
        arrays::colours(slf.clone().into_any(), slf.get().mode.operator.reflectances())
    }

    /// Shares of what is reflected that travel on.
    fn alpha(slf: Bound<'_, Self>) -> Bound<'_, PyArray1<f32>> {
        let alphas = slf.get().mode.operator.alphas();
        arrays::view(slf.clone().into_any(), alphas, alphas.len())
    }

    /// `E`.
    fn emission(slf: Bound<'_, Self>) -> Bound<'_, PyArray3<f32>> {
        arrays::lights(slf.clone().into_any(), slf.get().mode.operator.emission())
    }

    /// Numbers of the materials.
    fn materials(slf: Bound<'_, Self>) -> Bound<'_, PyArray1<u32>> {
        let materials = slf.get().mode.patches().materials();
        arrays::view(slf.clone().into_any(), materials, materials.len())
    }

    /// Numbers of the objects.
    fn objects<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        let (scene, patches) = (self.mode.scene(), self.mode.patches());
        let object = |i: usize| patches.pieces(i).next().map_or(0, |piece| scene.faces[piece.0 as usize].object);
        PyArray1::from_vec(py, (0..patches.len()).map(object).collect())
    }

    /// The patch, as it was cut, that each is a part of; itself where it was not divided.
    fn wholes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        let patches = self.mode.patches();
        PyArray1::from_vec(py, (0..patches.len() as u32).map(|i| patches.whole(i)).collect())
    }

    /// Middles in the file's units, NaN for halves of the sky; and unit normals.
    fn places<'py>(&self, py: Python<'py>) -> PyResult<Places<'py>> {
        places(py, self.mode.scene(), self.mode.patches())
    }

    /// Corners of the patches' triangles in the file's units, and the patch of each.
    fn triangles<'py>(slf: Bound<'py, Self>) -> PyResult<Triangles<'py>> {
        let (owner, system) = (slf.clone().into_any(), slf.get());
        let mesh = briefly(slf.py(), || system.mesh())?;
        let corners: Vec<f64> = mesh.corners().iter().flatten().flat_map(|corner| corner.to_array()).collect();
        let corners = numpy::ndarray::Array3::from_shape_vec((mesh.triangles(), 3, 3), corners);
        let corners = PyArray3::from_owned_array(slf.py(), corners.expect("nine numbers a triangle"));
        Ok((corners, arrays::view(owner, mesh.patch(), mesh.triangles())))
    }

    /// Columns and values of F, row by row.
    fn factors(slf: Bound<'_, Self>) -> (Bound<'_, PyArray1<u32>>, Bound<'_, PyArray1<f32>>) {
        let (_, columns, values) = slf.get().mode.operator.form_factors().parts();
        let owner = || slf.clone().into_any();
        (arrays::view(owner(), columns, columns.len()), arrays::view(owner(), values, values.len()))
    }

    /// Where the rows of F begin, and their end.
    fn starts<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let (starts, ..) = self.mode.operator.form_factors().parts();
        PyArray1::from_vec(py, starts.iter().map(|&start| start as i64).collect())
    }

    /// Mean, least and largest sum of the rows of F before anything was left out.
    fn row_sums(&self) -> Option<(f64, f64, f64)> {
        self.row_sums
    }

    /// `K E`, luminaires by closed form.
    fn first_bounce<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        Ok(arrays::taken(py, briefly(py, || self.mode.operator.first_bounce())?))
    }

    /// `K x`.
    fn apply<'py>(&self, py: Python<'py>, x: PyReadonlyArray1<f32>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let x = arrays::lights_of_numbers(x.as_slice()?);
        Ok(arrays::taken(py, briefly(py, || self.mode.operator.apply(x))?))
    }

    /// `K^T y`.
    fn apply_transposed<'py>(&self, py: Python<'py>, y: PyReadonlyArray1<f32>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let y = arrays::lights_of_numbers(y.as_slice()?);
        Ok(arrays::taken(py, briefly(py, || self.mode.operator.apply_transposed(y))?))
    }

    /// `K x` of the columns of a matrix.
    fn apply_columns<'py>(&self, py: Python<'py>, x: PyReadonlyArray2<f32>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let x = x.as_array();
        let (rows, count) = x.dim();
        let column = |c: usize| -> Vec<Light> {
            let numbers: Vec<f32> = x.column(c).iter().copied().collect();
            arrays::lights_of_numbers(&numbers).to_vec()
        };
        let columns: Vec<Vec<Light>> = (0..count).map(column).collect();
        let found = briefly(py, || apply_columns(&self.mode.operator, &columns))?;
        let mut all = Array2::zeros((rows, count));
        for (mut column, found) in all.columns_mut().into_iter().zip(&found) {
            column.iter_mut().zip(arrays::numbers_of_lights(found)).for_each(|(to, from)| *to = *from);
        }
        Ok(PyArray2::from_owned_array(py, all))
    }
}
