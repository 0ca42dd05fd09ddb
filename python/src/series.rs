//! Solutions of `L = E + K L`: the series, luminaire by luminaire, and as folders.
//!
//! Not handled: pictures to a tolerance, which `picture` renders.

use std::path::PathBuf;
use std::sync::Arc;

use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::render::{Apart, End, Fineness, check_pictures, pixel};
use halflight::solve::{ColumnSolution, Settings, Solution, explore_keeping, neumann, solve_columns};
use halflight_export::kept::{Also, Keeping, KeptError, KeptFolder, KeptRows, NewKept};
use halflight_study::{bounce_fields, bounce_pictures};
use numpy::ndarray::{Array2, Array4};
use numpy::{PyArray2, PyArray3, PyArray4};
use pyo3::prelude::*;

use crate::arrays;
use crate::errors::Raise;
use crate::picture::owned;
use crate::running::run;
use crate::scene::{Run, Scene, transport};
use crate::system::{Recipe, System};

/// A series that was summed, or some of its first terms.
#[pyclass(frozen, module = "halflight._native")]
pub struct Series {
    solution: Solution,
    /// Relative standard errors of the terms' powers, where walks of light measured them.
    errors: Vec<f64>,
    /// Why these are above the tolerance, where they are.
    unmet: Option<&'static str>,
    /// Powers and relative errors of each luminaire's terms, where those are kept apart and measured.
    emitters: Vec<(String, Vec<[f64; 3]>, Vec<f64>)>,
}

impl From<Solution> for Series {
    fn from(solution: Solution) -> Series {
        Series { solution, errors: Vec::new(), unmet: None, emitters: Vec::new() }
    }
}

/// L of each luminaire.
#[pyclass(frozen, module = "halflight._native")]
pub struct Lamps(ColumnSolution);

/// The first bounces, whether the series converges or not, of which so many terms are kept.
#[pyfunction]
pub fn first_terms(py: Python, system: &System, count: usize, keep: usize) -> PyResult<Series> {
    let mode = Arc::clone(&system.mode);
    Ok(run(py, None, |_| explore_keeping(&mode.operator, count, keep))?.into())
}

/// The sum of the series, of which so many terms are kept.
#[pyfunction]
pub fn summed(py: Python, system: &System, truncation: f64, keep: usize) -> PyResult<Series> {
    let mode = Arc::clone(&system.mode);
    let settings = Settings { tolerance: truncation, keep, ..Settings::default() };
    let found = run(py, None, |_| neumann(&mode.operator, &settings))?;
    found.map(Series::from).map_err(Raise::raise)
}

/// L of each luminaire, over one K.
#[pyfunction]
pub fn lamps(py: Python, system: &System, truncation: f64) -> PyResult<Lamps> {
    let mode = Arc::clone(&system.mode);
    let settings = Settings { tolerance: truncation, ..Settings::default() };
    let found = run(py, None, |_| solve_columns(&mode.operator, &mode.sources(), &settings))?;
    found.map(Lamps).map_err(Raise::raise)
}

/// A picture's pixels: `halflight._arguments.Pixels`.
#[derive(FromPyObject)]
pub struct Pixels {
    size: (usize, usize),
    samples: u32,
}

/// A picture, its standard error, rays cast, and the share of the camera's that met black backs.
type Gathered<'py> = (Bound<'py, PyArray3<f32>>, Bound<'py, PyArray3<f32>>, u64, f64);

/// A picture of a solution by the camera of a scene, with so many hemisphere rays a pixel.
#[pyfunction]
pub fn solution_picture<'py>(
    py: Python<'py>,
    system: &System,
    series: &Series,
    scene: &Scene,
    pixels: Pixels,
    asked: Run,
) -> PyResult<Gathered<'py>> {
    let (camera, Pixels { size, samples }) = (scene.scene.camera, pixels);
    check_pictures(size.into(), pixel::RENDER, asked.bytes()).map_err(Raise::raise)?;
    let pass = GatherPass::new(size, &GatherSampling::with_samples(samples, asked.seed));
    let found = run(py, asked.progress.as_ref(), |steps| {
        let gathered = system.mode.picture_by(camera, &series.solution, &pass, steps);
        (gathered.total(), gathered.standard_error, gathered.rays, gathered.backs)
    })?;
    let (picture, standard_error, rays, backs) = found;
    Ok((owned(py, picture)?, owned(py, standard_error)?, rays, backs))
}

/// A picture of E, and of each of the first bounces.
#[pyfunction]
pub fn term_pictures<'py>(
    py: Python<'py>,
    system: &System,
    series: &Series,
    count: usize,
    scene: &Scene,
    pixels: Pixels,
    asked: Run,
) -> PyResult<Vec<Bound<'py, PyArray3<f32>>>> {
    let (camera, Pixels { size, samples }) = (scene.scene.camera, pixels);
    check_pictures(size.into(), pixel::BOUNCES.0 + pixel::BOUNCES.1 * count as f64, asked.bytes())
        .map_err(Raise::raise)?;
    let pass = GatherPass::new(size, &GatherSampling::with_samples(samples, asked.seed));
    let found = run(py, asked.progress.as_ref(), |steps| {
        let lights = system.mode.lights.seen_by(camera);
        let fields = bounce_fields(&lights, &series.solution, count);
        bounce_pictures(&lights, &fields, &pass, steps)
    })?;
    found.into_iter().map(|picture| owned(py, picture)).collect()
}

/// Keeps F, L and all terms in a folder, as the program's `--save` does.
#[pyfunction]
pub fn save_folder(
    py: Python,
    system: &System,
    series: &Series,
    folder: PathBuf,
    also: Vec<String>,
    asked: Run,
) -> PyResult<()> {
    let also = also.iter().map(|kind| if kind == "ply" { Also::Ply } else { Also::Mtx }).collect();
    let kept = run(py, asked.progress.as_ref(), |_| {
        let rows = Arc::new(KeptRows::new(Some(&folder)));
        let new = NewKept::begin(Keeping { folder, also, ..Keeping::default() }, &rows)?;
        new.save(&system.mode.light(&series.solution))?;
        new.finish().map(|_| ())
    })?;
    kept.map_err(Raise::raise)
}

/// The first bounces with their powers to a tolerance.
#[pyfunction]
pub fn bounces(
    py: Python,
    scene: &Scene,
    mode: (f32, f32),
    count: usize,
    aim: (f64, Option<f64>),
    luminaires: bool,
    asked: Run,
) -> PyResult<(System, Series)> {
    let (tolerance, time) = aim;
    let (transport, apart) = (transport(mode), Apart { emitters: luminaires, bounces: false });
    let found = run(py, asked.progress.as_ref(), |steps| {
        let solver = scene.solver(asked.seed, asked.bytes()).apart(apart);
        let mut request = solver.bounces(transport, count).watch(steps);
        if let Some(seconds) = time {
            request = request.time(seconds);
        }
        request.tolerance(tolerance)
    })?;
    let fineness = Fineness { patches: found.mode.patches().requested(), rays: found.mode.sampling.rays };
    let recipe = Recipe { transport, fineness, seed: asked.seed, apart };
    let emitters = found.emitters.into_iter().map(|own| (own.name, own.powers, own.errors));
    let series = Series {
        solution: found.solution,
        errors: found.errors,
        unmet: found.end.and_then(End::why),
        emitters: emitters.collect(),
    };
    Ok((System::new(found.mode, recipe), series))
}

/// What a folder was solved for, made again from its F; the number of bounces is none where it has no light.
#[pyfunction]
pub fn open_folder(py: Python, folder: PathBuf, asked: Run) -> PyResult<(Scene, System, Option<usize>)> {
    let kept = run(py, asked.progress.as_ref(), |steps| {
        let opened = KeptFolder::open(&folder)?;
        let kept = opened.series()?;
        let (solver, rows) = (Solver::new(&kept.scene).seed(kept.seed), KeptRows::new(None));
        let sampling = kept.fineness.sampling(kept.seed);
        opened.read(&solver.cut(kept.fineness.patches), &[kept.transport], &sampling, &rows)?;
        let solver = solver.memory(f64::INFINITY).rows(Arc::new(rows));
        Ok((solver.assemble(&[kept.transport], kept.fineness, steps), kept))
    })?;
    let (equations, kept) = kept.map_err(KeptError::raise)?;
    let mode = equations.map_err(Raise::raise)?.modes.remove(0);
    let apart = Apart::default();
    let recipe = Recipe { transport: kept.transport, fineness: kept.fineness, seed: kept.seed, apart };
    Ok((kept.scene.into(), System::new(mode, recipe), kept.bounces))
}

#[pymethods]
impl Series {
    /// `L`.
    fn light(slf: Bound<'_, Self>) -> Bound<'_, PyArray3<f32>> {
        arrays::lights(slf.clone().into_any(), &slf.get().solution.light)
    }

    /// How many terms are kept.
    fn kept(&self) -> usize {
        self.solution.terms.len()
    }

    /// `KⁿE`, of a term that is kept.
    fn term(slf: Bound<'_, Self>, n: usize) -> Bound<'_, PyArray3<f32>> {
        arrays::lights(slf.clone().into_any(), &slf.get().solution.terms[n])
    }

    /// The proved bound on all that follows the last term, patch by patch; none where there is none.
    fn left(slf: Bound<'_, Self>) -> Option<Bound<'_, PyArray3<f32>>> {
        let left = &slf.get().solution.left;
        (!left.is_empty()).then(|| arrays::lights(slf.clone().into_any(), left))
    }

    /// Of each term: power of the visible half and of the invisible, W per channel.
    fn powers<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>) {
        let of = |own: fn(&halflight::solve::Bounce) -> [f64; 3]| {
            let rows: Vec<f64> = self.solution.bounces.iter().flat_map(own).collect();
            let rows = Array2::from_shape_vec((self.solution.bounces.len(), 3), rows).expect("three channels");
            PyArray2::from_owned_array(py, rows)
        };
        (of(|bounce| bounce.power), of(|bounce| bounce.power_invisible))
    }

    /// Of each term: norm, ratio to the one before, and the proved bound on all later ones; NaN where there is none.
    fn figures(&self) -> Vec<[f64; 3]> {
        let one =
            |b: &halflight::solve::Bounce| [b.norm, b.ratio.unwrap_or(f64::NAN), b.tail_bound.unwrap_or(f64::NAN)];
        self.solution.bounces.iter().map(one).collect()
    }

    /// Relative standard errors of the powers; empty where they are those of patches.
    fn errors(&self) -> Vec<f64> {
        self.errors.clone()
    }

    /// What keeps them above the tolerance.
    fn unmet(&self) -> Option<&'static str> {
        self.unmet
    }

    /// Name, powers and relative errors of each luminaire's terms.
    fn luminaires(&self) -> Vec<(String, Vec<[f64; 3]>, Vec<f64>)> {
        self.emitters.clone()
    }

    /// Bounds on the spectral radius, and the verdict.
    fn verdict(&self) -> (f64, f64, &'static str) {
        let Solution { radius, verdict, .. } = &self.solution;
        (radius.lower, radius.upper, verdict.name())
    }

    /// What the series left out at most, as a share of the reflected light.
    fn truncation(&self) -> f64 {
        self.solution.truncation()
    }
}

#[pymethods]
impl Lamps {
    /// L of each: (lamps, patches, 2, 3).
    fn light<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray4<f32>> {
        let patches = self.0.light.first().map_or(0, Vec::len);
        let all: Vec<f32> = self.0.light.iter().flat_map(|light| arrays::numbers_of_lights(light)).copied().collect();
        let all = Array4::from_shape_vec((self.0.light.len(), patches, 2, 3), all).expect("six numbers a patch");
        PyArray4::from_owned_array(py, all)
    }

    /// Proved bounds on the norm of what is missing of each.
    fn rest(&self) -> Vec<f64> {
        self.0.rest.clone()
    }

    /// Bounds on the spectral radius, and the verdict.
    fn verdict(&self) -> (f64, f64, &'static str) {
        (self.0.radius.lower, self.0.radius.upper, self.0.verdict.name())
    }
}
