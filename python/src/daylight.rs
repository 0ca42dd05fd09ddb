//! Daylight coefficients and a year's illuminance as arrays.

use std::path::PathBuf;

use glam::DVec3;
use halflight::render::Sensor;
use halflight_daylight::{
    Coefficients, Compass, DaylightError, DaylightGoal, Division, Illuminance, Metrics, Occupied, STANDARD, Skies,
    Standard, SunPlace, Weather, coefficients,
};
use numpy::ndarray::{Array2, Array3, ArrayView1};
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray2};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;

use crate::errors::{Raise, words};
use crate::running::run;
use crate::scene::{Run, Scene, transport};

/// Daylight at points: `halflight.Daylight`.
#[pyclass(frozen, module = "halflight._native")]
pub struct Daylit {
    found: Coefficients,
    skies: Option<(Skies, Illuminance)>,
    metrics: Option<Metrics>,
}

/// What is asked of daylight: `halflight._daylight.Asked`.
#[derive(FromPyObject)]
pub struct Asked {
    mf: usize,
    bounces: Option<usize>,
    tolerance: f64,
    up: [f64; 3],
    north: Option<[f64; 3]>,
    sky: Option<String>,
    /// Altitude and azimuth of the sun of a clear sky, degrees.
    sun: Option<(f64, f64)>,
    ground: f64,
    hours: (f64, f64),
}

impl Asked {
    /// The skies: of a file by its extension, or of a kind by its name.
    fn skies(&self, division: Division) -> Result<Option<Skies>, DaylightError> {
        let Some(sky) = &self.sky else { return Ok(None) };
        let standard = |kind| Ok(Some(Skies::standard(kind, division, STANDARD, self.ground)));
        match (sky.as_str(), self.sun) {
            ("overcast", _) => standard(Standard::Overcast),
            ("uniform", _) => standard(Standard::Uniform),
            ("clear", Some((altitude, azimuth))) => {
                standard(Standard::Clear(SunPlace { altitude: altitude.to_radians(), azimuth: azimuth.to_radians() }))
            }
            _ => {
                let path = PathBuf::from(sky);
                if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("mtx")) {
                    return Skies::read_matrix(&path, division).map(Some);
                }
                Ok(Some(Skies::of_weather(&Weather::read(&path)?, division, self.ground)))
            }
        }
    }
}

impl Raise for DaylightError {
    fn raise(self) -> PyErr {
        match self {
            DaylightError::Diverges(error) => error.raise(),
            DaylightError::Memory(error) => error.raise(),
            own @ (DaylightError::Read { .. } | DaylightError::Write(_)) => PyOSError::new_err(words(&own)),
            own => PyValueError::new_err(words(&own)),
        }
    }
}

/// Finds coefficients at points, positions and normals in the file's units, and what skies make of them.
#[pyfunction]
pub fn daylight(
    py: Python,
    scene: &Scene,
    mode: (f32, f32),
    sensors: (PyReadonlyArray2<f64>, PyReadonlyArray2<f64>),
    own: Asked,
    asked: Run,
) -> PyResult<Daylit> {
    let point = |row: ArrayView1<f64>| DVec3::new(row[0], row[1], row[2]);
    let (positions, normals) = (sensors.0.as_array(), sensors.1.as_array());
    let pairs = positions.rows().into_iter().zip(normals.rows());
    let sensors: Vec<Sensor> =
        pairs.map(|(at, normal)| Sensor { position: point(at), normal: point(normal) }).collect();
    let division = Division::new(own.mf).ok_or_else(|| PyValueError::new_err("there is no such division"))?;
    let up = DVec3::from(own.up);
    let compass = own.north.map_or_else(|| Compass::of_up(up), |north| Compass::new(up, north.into()));
    let compass = compass.ok_or_else(|| PyValueError::new_err("north and up must not be parallel, nor 0"))?;
    let found = run(py, asked.progress.as_ref(), |steps| {
        let skies = own.skies(division)?;
        let all_suns = skies.iter().flat_map(|skies| skies.skies.iter().filter_map(|sky| sky.sun));
        let suns: Vec<DVec3> = all_suns.map(|sun| sun.towards).collect();
        let goal = DaylightGoal {
            transport: transport(mode),
            division,
            compass,
            suns: &suns,
            bounces: own.bounces,
            tolerance: own.tolerance,
            seed: asked.seed,
            memory: asked.bytes(),
            watch: steps,
        };
        let found = coefficients(&scene.scene, &sensors, &goal)?;
        let skies = skies.map(|skies| {
            let light = Illuminance::new(&found, &skies);
            (skies, light)
        });
        let occupied = Occupied { from: own.hours.0, until: own.hours.1 };
        let metrics = skies.as_ref().and_then(|(skies, light)| light.metrics(skies, occupied));
        Ok(Daylit { found, skies, metrics })
    })?;
    found.map_err(DaylightError::raise)
}

#[pymethods]
impl Daylit {
    /// D and its standard error, points × columns × channels, sr.
    fn coefficients<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray3<f64>>) {
        let shape = (self.found.points, self.found.columns(), 3);
        let of = |own: &dyn Fn(usize, usize) -> [f64; 3]| {
            PyArray3::from_owned_array(py, Array3::from_shape_fn(shape, |(x, p, c)| own(x, p)[c]))
        };
        (of(&|x, p| self.found.of(x, p)), of(&|x, p| self.found.error_of(x, p)))
    }

    /// The direct part and its error, points × columns, sr.
    fn direct<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>) {
        let shape = (self.found.points, self.found.columns());
        let of = |own: &[f64]| {
            let own = Array2::from_shape_vec(shape, own.to_vec()).expect("points times columns");
            PyArray2::from_owned_array(py, own)
        };
        (of(&self.found.direct), of(&self.found.direct_error))
    }

    /// Altitude and azimuth of the middles of the columns, radians, and their solid angles, sr.
    fn columns<'py>(&self, py: Python<'py>) -> [Bound<'py, PyArray1<f64>>; 3] {
        let patches = self.found.division.patches();
        let of =
            |own: fn(&halflight_daylight::SkyPatch) -> f64| PyArray1::from_vec(py, patches.iter().map(own).collect());
        [of(|patch| patch.altitude), of(|patch| patch.azimuth), of(|patch| patch.solid_angle)]
    }

    /// Luminance of the skies' columns without the sun, skies × columns, cd/m².
    fn luminance<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        let (skies, _) = self.skies.as_ref()?;
        let shape = (skies.skies.len(), self.found.columns());
        Some(PyArray2::from_owned_array(py, Array2::from_shape_fn(shape, |(k, p)| skies.skies[k].luminance[p])))
    }

    /// Illuminance, and that straight from the sun, points × skies, lx.
    fn illuminance<'py>(&self, py: Python<'py>) -> Option<[Bound<'py, PyArray2<f32>>; 2]> {
        let (_, light) = self.skies.as_ref()?;
        let of = |own: &[f32]| {
            let own = Array2::from_shape_vec((self.found.points, light.skies), own.to_vec());
            PyArray2::from_owned_array(py, own.expect("points times skies"))
        };
        Some([of(&light.all), of(&light.sunlight)])
    }

    /// Mean illuminance of each point, and its error, lx.
    fn means(&self) -> Option<Vec<[f64; 2]>> {
        self.skies.as_ref().map(|(_, light)| light.means.clone())
    }

    /// Month, day and hour of each sky; none of one without a time.
    fn times(&self) -> Vec<Option<(usize, usize, f64)>> {
        let skies = self.skies.iter().flat_map(|(skies, _)| &skies.skies);
        skies.map(|sky| sky.time.map(|time| (time.month, time.day, time.hour))).collect()
    }

    /// Of each point autonomy, sunlit hours and the four shares of UDI.
    fn points(&self) -> Option<Vec<(f64, f64, [f64; 4])>> {
        let metrics = self.metrics.as_ref()?;
        Some(metrics.points.iter().map(|own| (own.autonomy, own.sunlit, own.useful)).collect())
    }

    /// sDA, ASE, and occupied hours.
    fn year(&self) -> Option<(f64, f64, f64)> {
        self.metrics.as_ref().map(|metrics| (metrics.sda, metrics.ase, metrics.hours))
    }

    /// The error that the tolerance is held against, whether it is met, patches and seconds.
    fn taken(&self) -> (f64, bool, usize, f64) {
        (self.found.error, self.found.met, self.found.patches, self.found.seconds)
    }
}
