//! Pictures: rendered and traced, with their errors and layers; and arrays as files.
//!
//! Not handled: words for what is not met; `halflight._picture` has them.

use std::path::PathBuf;

use halflight::pictures::{
    Bitmap, Exposure, NamedPicture, Picture, Shows, check_extension, encode_png as encode, write_layered, write_picture,
};
use halflight::render::{Apart, Fineness, Rendered as Found, Shortfall, check_pictures, pixel};
use halflight_reference::{NextEvent, TraceSettings, Tracer};
use numpy::ndarray::Array3;
use numpy::{PyArray3, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays;
use crate::errors::Raise;
use crate::running::{briefly, run};
use crate::scene::{Run, Scene, transport};

/// A picture and what is known of it.
#[pyclass(frozen, module = "halflight._native")]
pub struct Rendered(Found);

/// How much is done for a picture: a tolerance and seconds, or patches, rays and samples.
#[derive(FromPyObject)]
pub struct Effort {
    pub tolerance: Option<f64>,
    time: Option<f64>,
    pub patches: usize,
    pub rays: u32,
    pub samples: u32,
}

impl Effort {
    /// Patches and rays, where there is no tolerance.
    pub fn fineness(&self) -> Fineness {
        Fineness { patches: self.patches, rays: self.rays }
    }
}

/// Renders a picture.
#[pyfunction]
pub fn render(
    py: Python,
    scene: &Scene,
    mode: (f32, f32),
    size: (usize, usize),
    effort: Effort,
    apart: (bool, bool),
    asked: Run,
) -> PyResult<Rendered> {
    let bytes = asked.bytes();
    let each = if effort.tolerance.is_some() { pixel::WITHIN } else { pixel::RENDER };
    check_pictures(size.into(), each, bytes).map_err(Raise::raise)?;
    let apart = Apart { bounces: apart.0, emitters: apart.1 };
    let found = run(py, asked.progress.as_ref(), |steps| {
        let solver = scene.solver(asked.seed, bytes).apart(apart);
        let mut request = solver.render(transport(mode), size).watch(steps);
        if let Some(seconds) = effort.time {
            request = request.time(seconds);
        }
        match effort.tolerance {
            Some(tolerance) => request.tolerance(tolerance),
            None => request.fineness(effort.fineness(), effort.samples),
        }
    })?;
    found.map(Rendered).map_err(Raise::raise)
}

/// How paths are traced.
#[derive(FromPyObject)]
pub struct Tracing {
    samples: Option<u32>,
    time: Option<f64>,
    next_event: bool,
    max_bounces: u32,
}

/// Samples of a pass, as the program has them.
const PASS: u32 = 16;

/// What path tracing came to.
type Traced<'py> =
    (Bound<'py, PyArray3<f32>>, Option<Bound<'py, PyArray3<f32>>>, u64, Option<f64>, (u64, u64, u64), f64);

/// Traces paths: the picture, its standard error, samples a pixel, relative standard error; paths, rays and paths cut;
/// and seconds.
#[pyfunction]
pub fn trace<'py>(
    py: Python<'py>,
    scene: &Scene,
    mode: (f32, f32),
    size: (usize, usize),
    tracing: Tracing,
    asked: Run,
) -> PyResult<Traced<'py>> {
    check_pictures(size.into(), pixel::TRACE, asked.bytes()).map_err(Raise::raise)?;
    let next_event = if tracing.next_event { NextEvent::On } else { NextEvent::Off };
    let settings = TraceSettings { next_event, max_bounces: tracing.max_bounces, seed: asked.seed };
    let most = tracing.samples.unwrap_or(u32::MAX);
    let traced = run(py, asked.progress.as_ref(), |steps| {
        use halflight::render::Watch;
        let geometry = scene.solver(asked.seed, f64::INFINITY).geometry();
        let transports = scene.scene.transports(transport(mode));
        let mut tracer = Tracer::new(&scene.scene, &geometry.rays, &transports, size, &settings);
        if tracing.time.is_none() {
            steps.begin("trace", u64::from(most.div_ceil(PASS)));
        }
        let seconds = tracer.sample_within(PASS, most, tracing.time.unwrap_or(f64::INFINITY), |_, _| {
            steps.tick(1);
            true
        });
        tracer.check()?;
        let counts = tracer.counts();
        let counts = (counts.paths, counts.rays, counts.cut);
        let error = tracer.relative_error();
        Ok::<_, halflight_reference::Overflow>((
            tracer.picture(),
            tracer.standard_error(),
            tracer.samples(),
            error,
            counts,
            seconds,
        ))
    })?;
    let (picture, standard_error, samples, error, counts, seconds) = traced.map_err(Raise::raise)?;
    let standard_error = standard_error.map(|picture| owned(py, picture)).transpose()?;
    Ok((owned(py, picture)?, standard_error, samples, error, counts, seconds))
}

/// A picture that nothing else holds, as an array over its memory.
#[pyclass(frozen, module = "halflight._native")]
struct Held(Picture);

/// An array over the memory of a picture.
pub fn owned<'py>(py: Python<'py>, picture: Picture) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let held = Bound::new(py, Held(picture))?;
    Ok(arrays::picture(held.clone().into_any(), &held.get().0))
}

/// Writes a picture: `.exr` holds radiances, `.png` what the eye is to see of them.
#[pyfunction]
pub fn save_picture(py: Python, path: PathBuf, picture: PyReadonlyArray3<f32>, stops: f32) -> PyResult<()> {
    check_extension(&path).map_err(Raise::raise)?;
    let picture = arrays::picture_of(&picture);
    briefly(py, || write_picture(&path, &picture, Exposure { stops }))?.map_err(Raise::raise)
}

/// A layer: its name, and its pixels.
type GivenLayer<'py> = (String, PyReadonlyArray3<'py, f32>);

/// Writes a picture with layers and standard errors of them (of the picture, where the name is empty): in an EXR file,
/// or in files of their own beside it; returns the files.
#[pyfunction]
pub fn save_layers(
    py: Python,
    path: PathBuf,
    picture: PyReadonlyArray3<f32>,
    layers: Vec<GivenLayer>,
    errors: Vec<GivenLayer>,
    stops: f32,
) -> PyResult<Vec<PathBuf>> {
    check_extension(&path).map_err(Raise::raise)?;
    let picture = arrays::picture_of(&picture);
    let layers = layers.into_iter().map(|layer| (layer, Shows::Light));
    let all = layers.chain(errors.into_iter().map(|layer| (layer, Shows::StandardError)));
    let named = |((name, pixels), shows): (GivenLayer, Shows)| NamedPicture {
        name,
        shows,
        picture: arrays::picture_of(&pixels),
    };
    let all: Vec<NamedPicture<Picture>> = all.map(named).collect();
    let write = || {
        let layers: Vec<NamedPicture<&Picture>> = all.iter().map(NamedPicture::as_ref).collect();
        write_layered(&path, &picture, &layers, Exposure { stops })
    };
    briefly(py, write)?.map_err(halflight::pictures::ImageError::raise)
}

/// Reads a picture.
#[pyfunction]
pub fn read_picture<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyArray3<f32>>> {
    owned(py, briefly(py, || halflight::pictures::read_picture(path))?.map_err(Raise::raise)?)
}

/// The bytes of a PNG file.
#[pyfunction]
pub fn encode_png<'py>(py: Python<'py>, picture: PyReadonlyArray3<f32>, stops: f32) -> PyResult<Bound<'py, PyBytes>> {
    let picture = arrays::picture_of(&picture);
    let encoded = briefly(py, || encode(&Bitmap::from_picture(&picture, Exposure { stops })))?;
    Ok(PyBytes::new(py, &encoded.map_err(Raise::raise)?))
}

/// The sRGB codes that a PNG file has of a picture: (height, width, 3).
#[pyfunction]
pub fn srgb<'py>(py: Python<'py>, picture: PyReadonlyArray3<f32>, stops: f32) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let picture = arrays::picture_of(&picture);
    let Bitmap { width, height, bytes } = briefly(py, || Bitmap::from_picture(&picture, Exposure { stops }))?;
    let codes = Array3::from_shape_vec((height, width, 3), bytes).expect("three codes a pixel");
    Ok(PyArray3::from_owned_array(py, codes))
}

/// The stops at which a picture is shown well; none where all is dark.
#[pyfunction]
pub fn exposure_of(picture: PyReadonlyArray3<f32>) -> Option<f32> {
    Exposure::of(&arrays::picture_of(&picture)).map(|exposure| exposure.stops)
}

#[pymethods]
impl Rendered {
    /// Linear radiance.
    fn picture(slf: Bound<'_, Self>) -> Bound<'_, PyArray3<f32>> {
        arrays::picture(slf.clone().into_any(), &slf.get().0.picture)
    }

    /// Its standard error from the gather pass.
    fn standard_error(slf: Bound<'_, Self>) -> Bound<'_, PyArray3<f32>> {
        arrays::picture(slf.clone().into_any(), &slf.get().0.standard_error)
    }

    /// Names of the layers.
    fn layers(&self) -> Vec<String> {
        self.0.layers.iter().map(|layer| layer.kind.name()).collect()
    }

    /// Layer k, and its standard error.
    fn layer(slf: Bound<'_, Self>, k: usize) -> (Bound<'_, PyArray3<f32>>, Bound<'_, PyArray3<f32>>) {
        let light = &slf.get().0.layers[k].light;
        let view = |picture| arrays::picture(slf.clone().into_any(), picture);
        (view(&light.picture), view(&light.standard_error))
    }

    /// Name of each luminaire, power emitted and power reflected per channel, W.
    fn luminaires(&self) -> Vec<(&str, [f64; 3], [f64; 3])> {
        self.0.emitters.iter().map(|e| (e.name.as_str(), e.emitted, e.reflected)).collect()
    }

    /// Noise of F, patches, truncation, gather pass, light as emitted, and all but that together.
    fn error(&self) -> [f64; 6] {
        let e = &self.0.error;
        [e.form_factors, e.patches, e.truncation, e.gather, e.emission, e.total]
    }

    /// Why the error is above a tolerance, if it is, and what helps.
    fn unmet(&self, tolerance: f64) -> Option<String> {
        let unmet = self.0.unmet(tolerance)?;
        let helps = match unmet.why {
            Shortfall::Unseen | Shortfall::Unknown | Shortfall::Contradicted => "",
            Shortfall::Time => "; a longer `time` helps",
            Shortfall::Rays => "; a `time` of some minutes allows more",
            Shortfall::Effort => "; a larger `size` leaves less to bend within a pixel",
        };
        Some(format!("{unmet}{helps}"))
    }

    /// Seconds of each step: patches, form factors, solve, gather, and all together.
    fn seconds(&self) -> [f64; 5] {
        let s = &self.0.seconds;
        [s.patches, s.form_factors, s.solve, s.gather, s.total]
    }

    /// Patches and rays.
    fn counts(&self) -> (usize, u64) {
        (self.0.patches, self.0.rays)
    }

    /// Bounds on the spectral radius, and the verdict.
    fn verdict(&self) -> (f64, f64, &'static str) {
        (self.0.radius.lower, self.0.radius.upper, self.0.verdict.name())
    }

    /// Share of the camera's rays that met black backs.
    fn backs(&self) -> f64 {
        self.0.backs
    }
}
