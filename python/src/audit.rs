//! Audits: the error of any picture of a scene, and where it is.

use halflight::pictures::Picture;
use halflight::render::check_pictures;
use halflight_audit::{Audit, AuditError, AuditGoal, Cause, Estimated, Verdict, audit as audited, verdict};
use numpy::{PyArray3, PyReadonlyArray3};
use pyo3::prelude::*;

use crate::arrays;
use crate::errors::Raise;
use crate::picture::owned;
use crate::running::run;
use crate::scene::{Run, Scene, transport};

/// Bytes that are kept of a pixel.
const EACH: f64 = 1000.0;

/// What is told of a picture: `halflight.Audit`.
#[pyclass(frozen, module = "halflight._native")]
pub struct Audited {
    told: Audit,
    at_most: Option<f64>,
}

/// What is aimed at: `halflight._audit.Goal`.
#[derive(FromPyObject)]
pub struct Goal {
    resolve: f64,
    tolerance: f64,
    at_most: Option<f64>,
    time: Option<f64>,
}

/// Tells the error of a picture.
#[pyfunction]
pub fn audit(
    py: Python,
    scene: &Scene,
    mode: (f32, f32),
    picture: PyReadonlyArray3<f32>,
    goal: Goal,
    asked: Run,
) -> PyResult<Audited> {
    let picture = arrays::picture_of(&picture);
    check_pictures(picture.size(), EACH, asked.bytes()).map_err(Raise::raise)?;
    let Goal { resolve, tolerance, at_most, time } = goal;
    let goal = AuditGoal { resolve, tolerance, at_most, seconds: time, seed: asked.seed };
    let found =
        run(py, asked.progress.as_ref(), |steps| audited(&scene.scene, transport(mode), &picture, &goal, steps))?;
    Ok(Audited { told: found.map_err(Raise::raise)?, at_most })
}

impl Raise for AuditError {
    fn raise(self) -> PyErr {
        pyo3::exceptions::PyValueError::new_err(crate::errors::words(&self))
    }
}

/// A number and its standard error.
type Pair = (f64, f64);

/// From the first to before the last.
type Ends = (usize, usize);

fn pair(of: Estimated) -> Pair {
    (of.value, of.standard_error)
}

/// A name, numbers with their standard errors, and the share that is explained.
type Told = (&'static str, Vec<Pair>, f64);

#[pymethods]
impl Audited {
    /// The relative RMS error and its square, each with its standard error.
    fn error(&self) -> (Pair, Pair) {
        let error = &self.told.error;
        (pair(error.relative()), pair(error.squared))
    }

    /// The mean error of all channels, and of each.
    fn mean(&self) -> (Pair, Vec<Option<Pair>>) {
        let mean = &self.told.mean;
        (pair(mean.total), mean.channels.iter().map(|own| own.map(pair)).collect())
    }

    /// What would explain the error.
    fn causes(&self) -> Vec<Told> {
        let told = |cause: &Cause| match *cause {
            Cause::Brightness { factor, explains } => ("brightness", vec![pair(factor)], explains),
            Cause::Gamma { gamma, explains } => ("gamma", vec![pair(gamma)], explains),
            Cause::Shift { right, down, explains } => ("shift", vec![pair(right), pair(down)], explains),
        };
        self.told.causes.iter().map(told).collect()
    }

    /// Parts of the picture: columns, rows, share of the squared error, mean error.
    fn parts(&self) -> Vec<(Ends, Ends, f64, Pair)> {
        let one = |own: &halflight_audit::Part| {
            let ends = |range: &std::ops::Range<usize>| (range.start, range.end);
            (ends(&own.columns), ends(&own.rows), own.share, pair(own.mean))
        };
        self.told.parts.iter().map(one).collect()
    }

    /// The signed map, that of RMS errors, the estimate, its standard error, and the mask.
    fn maps<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray3<f32>>>> {
        let Audit { signed, squared, estimate, standard_error, mask, .. } = &self.told;
        let array = |picture: &Picture| owned(py, picture.clone());
        [signed, squared, estimate, standard_error, mask].into_iter().map(array).collect()
    }

    /// Effective pixels, pixels that count, RMS of the scene, samples a pixel, rays, and seconds of both parts.
    fn taken(&self) -> (f64, usize, f64, f64, u64, [f64; 2]) {
        let Audit { error, samples, rays, seconds, .. } = &self.told;
        (error.effective_pixels, error.pixels, error.rms, *samples, *rays, *seconds)
    }

    /// Whether the error is as well known as was asked, and whether it is at most what was asked about.
    fn answers(&self) -> (bool, Option<bool>) {
        let is_within = |most: f64| match verdict(&self.told.error, most) {
            Verdict::Within => Some(true),
            Verdict::Above => Some(false),
            Verdict::Open => None,
        };
        (self.told.met, self.at_most.and_then(is_within))
    }
}
