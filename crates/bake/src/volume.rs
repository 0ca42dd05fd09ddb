//! Irradiance volumes: the light that arrives at the points of a grid, for things that move.
//!
//! ```text
//! ambient cube:   E(n) = n.x² E(±x) + n.y² E(±y) + n.z² E(±z)                (J. Mitchell, G. McTaggart, C. Green,
//!                                                                            *Shading in Valve's Source Engine*, 2006)
//! harmonics:      E(n) = sum over l = 0, 1, 2 of c_lm Y_lm(n),    c_lm = 4 pi sum over k of w_k E(n_k) Y_lm(n_k)
//! ```
//!
//! with real Y_lm of unit norm, by the 14 points and weights of Lebedev's rule of degree 5. Irradiance has next to
//! nothing of higher order (R. Ramamoorthi, P. Hanrahan, *An efficient representation for irradiance environment maps*,
//! 2001): 0.4 % of the RMS for one bright point in the dark, which is the worst case.
//!
//! Points are the middles of the cells that a box is divided into. Those inside of solids are marked, and have the mean
//! of those around them that are not.
//!
//! Bevy's layout: a texture of (Rx, 2 Ry, 3 Rz) texels, E/pi of the faces x, y and z one behind another along z, of
//! each the positive half at y, the negative one at Ry + y.
//!
//! Not handled: cells of different sizes; errors of fits to the cells between points.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use halflight::light::Transport;
use halflight::pictures::{make_directory, write_whole};
use halflight::render::{Apart, Sensor, SensorLight, SensorLights, Watch};
use halflight::scene::Bounds;
use halflight::{Scene, Solver};
use halflight_export::{Array, Values, write_npz};
use serde::Serialize;

use crate::bake::Lamps;
use crate::error::BakeError;
use crate::files::endings;
use crate::ktx2_file::ktx2;

/// Cells along x, y and z.
pub type Grid = [usize; 3];

/// What is kept of the light at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Irradiance in six directions.
    #[default]
    Cube,
    /// Spherical harmonics of second order, nine numbers.
    Harmonics,
}

/// What is asked of a volume.
pub struct VolumeGoal<'a> {
    /// (alpha, tau) of materials without their own.
    pub transport: Transport,
    /// Relative error of each irradiance.
    pub tolerance: f64,
    /// Cells.
    pub grid: Grid,
    /// What is kept.
    pub kind: Kind,
    /// Of which luminaires.
    pub lamps: Lamps,
    /// Chooses the sample points.
    pub seed: u32,
    /// Bytes that K may take.
    pub memory: f64,
    /// Who is told of the work.
    pub watch: &'a dyn Watch,
}

/// The light of all luminaires, or of one, at the points of a grid.
#[derive(Clone, Debug)]
pub struct GridLight {
    /// The luminaire; none of all light.
    pub lamp: Option<String>,
    /// Point by point, x running fastest, then y: six irradiances, W/m², towards +x, -x, +y, -y, +z, -z; or the nine
    /// coefficients `c_lm` in the order of l, then m from -l to l, W/m².
    pub values: Vec<Vec<DVec3>>,
}

/// Light on a grid.
#[derive(Clone, Debug)]
pub struct Volume {
    /// Cells along x, y and z.
    pub grid: Grid,
    /// What is kept.
    pub kind: Kind,
    /// The box that is divided, the file's units.
    pub bounds: Bounds<DVec3>,
    /// All light first, then the luminaires.
    pub lights: Vec<GridLight>,
    /// Whether a point is inside of a solid.
    pub inside: Vec<bool>,
    /// The largest standard error of the irradiances of each point, W/m².
    pub errors: Vec<f64>,
    /// Share of the irradiances whose error is at most the tolerance.
    pub met: f64,
    /// Seconds in all.
    pub seconds: f64,
}

/// The directions of the ambient cube.
const CUBE: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
/// Weights of Lebedev's rule of degree 5: of the six axes and of the eight diagonals (V. I. Lebedev, 1976).
const AXIS: f64 = 1.0 / 15.0;
const DIAGONAL: f64 = 3.0 / 40.0;

impl Kind {
    /// Directions that irradiance is measured in, with their weights in the coefficients.
    fn directions(self) -> Vec<(DVec3, f64)> {
        let axes = CUBE.into_iter().map(|n| (n, AXIS));
        let sign = |k: usize, bit: usize| if (k >> bit) & 1 == 0 { 1.0 } else { -1.0 };
        let diagonal = |k: usize| DVec3::new(sign(k, 0), sign(k, 1), sign(k, 2)).normalize();
        match self {
            Kind::Cube => axes.collect(),
            Kind::Harmonics => axes.chain((0..8).map(|k| (diagonal(k), DIAGONAL))).collect(),
        }
    }

    /// What is kept of the irradiances in these directions.
    fn kept(self, irradiances: &[DVec3]) -> Vec<DVec3> {
        if self == Kind::Cube {
            return irradiances.to_vec();
        }
        let mut kept = vec![DVec3::ZERO; 9];
        for ((n, weight), light) in self.directions().into_iter().zip(irradiances) {
            kept.iter_mut().zip(harmonics(n)).for_each(|(sum, y)| *sum += 4.0 * PI * weight * y * *light);
        }
        kept
    }
}

/// Real spherical harmonics of unit norm up to second order: l = 0, 1, 2, and m from -l to l.
fn harmonics(n: DVec3) -> [f64; 9] {
    let DVec3 { x, y, z } = n;
    let [zero, one, two] = [0.25 / PI, 0.75 / PI, 3.75 / PI].map(f64::sqrt);
    let [even, flat] = [0.3125 / PI, 0.9375 / PI].map(f64::sqrt);
    [
        zero,
        one * y,
        one * z,
        one * x,
        two * x * y,
        two * y * z,
        even * (3.0 * z * z - 1.0),
        two * x * z,
        flat * (x * x - y * y),
    ]
}

/// The light of a scene at the points of a grid in the box around it.
///
/// # Errors
/// [`BakeError::Render`] where the series is not proved to converge, or K does not fit in memory.
pub fn volume(scene: &Scene, goal: &VolumeGoal) -> Result<Volume, BakeError> {
    let bounds = Bounds::of((0..scene.solid_faces()).flat_map(|face| scene.exact_corners(face)));
    let bounds = Bounds { low: scene.frame.to_file(bounds.low), high: scene.frame.to_file(bounds.high) };
    let directions = goal.kind.directions();
    let points: Vec<DVec3> = points(goal.grid, &bounds).collect();
    let sensors: Vec<Sensor> = points
        .iter()
        .flat_map(|position| directions.iter().map(|(normal, _)| Sensor { position: *position, normal: *normal }))
        .collect();
    let solver = Solver::new(scene).seed(goal.seed).memory(goal.memory);
    let solver = solver.apart(Apart { emitters: goal.lamps == Lamps::Apart, bounces: false });
    let found = solver.points(goal.transport, &sensors).watch(goal.watch).tolerance(goal.tolerance)?;
    Ok(of_sensors(found, (goal.grid, bounds), goal.kind))
}

/// The middles of the cells, x running fastest, then y.
fn points(grid: Grid, bounds: &Bounds<DVec3>) -> impl Iterator<Item = DVec3> {
    let (low, size) = (bounds.low, bounds.high - bounds.low);
    let count = grid[0] * grid[1] * grid[2];
    (0..count).map(move |k| {
        let cell = [k % grid[0], k / grid[0] % grid[1], k / grid[0] / grid[1]];
        let share = DVec3::from([0, 1, 2].map(|axis| (cell[axis] as f64 + 0.5) / grid[axis] as f64));
        low + share * size
    })
}

/// The volume of what sensors measured.
fn of_sensors(found: SensorLights, (grid, bounds): (Grid, Bounds<DVec3>), kind: Kind) -> Volume {
    let each = kind.directions().len();
    let points: Vec<&[SensorLight]> = found.points.chunks_exact(each).collect();
    let is_inside = |own: &&[SensorLight]| 2 * own.iter().filter(|light| light.is_inside).count() > each;
    let inside: Vec<bool> = points.iter().map(is_inside).collect();
    let length = |light: &SensorLight| DVec3::from(light.error).length();
    let errors = points.iter().map(|own| own.iter().map(length).fold(0.0, f64::max)).collect();
    let lamps: Vec<String> =
        found.points.first().map_or(Vec::new(), |first| first.luminaires.keys().cloned().collect());
    let light = |lamp: Option<&String>| {
        let of = |light: &SensorLight| match lamp {
            None => DVec3::from(light.irradiance),
            Some(lamp) => light.luminaires.get(lamp).copied().map(DVec3::from).unwrap_or_default(),
        };
        let kept = |own: &&[SensorLight]| kind.kept(&own.iter().map(of).collect::<Vec<_>>());
        GridLight { lamp: lamp.cloned(), values: filled(points.iter().map(kept).collect(), &inside, grid) }
    };
    let lights = std::iter::once(None).chain(lamps.iter().map(Some)).map(light).collect();
    Volume { grid, kind, bounds, lights, inside, errors, met: found.met, seconds: found.seconds }
}

/// Values of which those inside have the mean of those around them, layer by layer.
fn filled(mut values: Vec<Vec<DVec3>>, inside: &[bool], grid: Grid) -> Vec<Vec<DVec3>> {
    let mut unknown = inside.to_vec();
    let around = |k: usize| {
        let at = [k % grid[0], k / grid[0] % grid[1], k / grid[0] / grid[1]];
        let step = move |n: usize| [n % 3, n / 3 % 3, n / 9];
        (0..27).filter_map(move |n| {
            let place: Option<Vec<usize>> =
                (0..3).map(|axis| (at[axis] + step(n)[axis]).checked_sub(1).filter(|p| *p < grid[axis])).collect();
            place.map(|p| (p[2] * grid[1] + p[1]) * grid[0] + p[0])
        })
    };
    while unknown.iter().any(|own| *own) {
        let before = unknown.clone();
        for k in (0..values.len()).filter(|k| before[*k]) {
            let known: Vec<usize> = around(k).filter(|j| !before[*j]).collect();
            if !known.is_empty() {
                let mean = |c: usize| known.iter().map(|&j| values[j][c]).sum::<DVec3>() / known.len() as f64;
                values[k] = (0..values[k].len()).map(mean).collect();
                unknown[k] = false;
            }
        }
        if unknown == before {
            break;
        }
    }
    values
}

/// What is written of a volume.
#[derive(Clone, Debug, Serialize)]
pub struct VolumeReport {
    /// The scene's name.
    pub scene: String,
    /// Cells along x, y and z.
    pub grid: Grid,
    /// `ambient cube` or `spherical harmonics`.
    pub kind: &'static str,
    /// The lowest corner of the box, the file's units: Bevy's cube is scaled by the difference and moved to the mean.
    pub low: [f64; 3],
    /// The highest.
    pub high: [f64; 3],
    /// Points inside of solids.
    pub inside: usize,
    /// Relative error that was asked for of each irradiance.
    pub tolerance: f64,
    /// Share of the irradiances whose error is at most that.
    pub met: f64,
    /// Files of all light, then of the luminaires, each with its name.
    pub files: Vec<(Option<String>, PathBuf)>,
    /// What the numbers are.
    pub words: &'static str,
    /// Seconds in all.
    pub seconds: f64,
}

/// Writes a volume: `.ktx2` files for Bevy, or one `.npz`; and a JSON that names them, last.
///
/// # Errors
/// A destination that cannot be written.
pub fn write_volume(
    (folder, stem): (&Path, &str),
    scene: &Scene,
    volume: &Volume,
    tolerance: f64,
) -> Result<(VolumeReport, Vec<PathBuf>), BakeError> {
    make_directory(folder)?;
    let endings = endings(volume.lights.iter().map(|light| light.lamp.as_deref()));
    let mut files = Vec::new();
    for (light, of_lamp) in volume.lights.iter().zip(endings) {
        let file = match volume.kind {
            Kind::Cube => PathBuf::from(format!("{stem}-volume{of_lamp}.ktx2")),
            Kind::Harmonics => PathBuf::from(format!("{stem}-volume{of_lamp}.npz")),
        };
        match volume.kind {
            Kind::Cube => write_whole(folder.join(&file), &volume.bevy(light))?,
            Kind::Harmonics => volume.write_npz(&folder.join(&file), light)?,
        }
        files.push((light.lamp.clone(), file));
    }
    let (kind, words) = match volume.kind {
        Kind::Cube => {
            ("ambient cube", "E / pi, W/(m² sr), of the faces x, y, z along z, negative ones at Ry + y (Bevy)")
        }
        Kind::Harmonics => ("spherical harmonics", "E(n) = sum of coefficients * Y_lm(n), W/m²"),
    };
    let report = VolumeReport {
        scene: scene.name.clone(),
        grid: volume.grid,
        kind,
        low: volume.bounds.low.to_array(),
        high: volume.bounds.high.to_array(),
        inside: volume.inside.iter().filter(|own| **own).count(),
        tolerance,
        met: volume.met,
        files,
        words,
        seconds: volume.seconds,
    };
    let json = serde_json::to_vec_pretty(&report).expect("a report of numbers and text");
    let list = folder.join(format!("{stem}-volume.json"));
    write_whole(&list, &json)?;
    let paths = report.files.iter().map(|(_, file)| folder.join(file)).chain([list]).collect();
    Ok((report, paths))
}

impl Volume {
    /// Point by point, where.
    pub fn points(&self) -> Vec<DVec3> {
        points(self.grid, &self.bounds).collect()
    }

    /// The bytes of a `.ktx2` file as Bevy lays it out.
    fn bevy(&self, light: &GridLight) -> Vec<u8> {
        let [rx, ry, rz] = self.grid;
        let mut texels = vec![Vec3::ZERO; 6 * rx * ry * rz];
        for (k, six) in light.values.iter().enumerate() {
            let [x, y, z] = [k % rx, k / rx % ry, k / rx / ry];
            for (face, light) in six.iter().enumerate() {
                let (axis, is_negative) = (face / 2, face % 2);
                let place = ((axis * rz + z) * 2 * ry + is_negative * ry + y) * rx + x;
                texels[place] = (*light / PI).as_vec3();
            }
        }
        ktx2([rx, 2 * ry, 3 * rz], &texels)
    }

    /// Writes arrays z × y × x × 9 × 3 of coefficients, with the points, and which of them are inside.
    fn write_npz(&self, path: &Path, light: &GridLight) -> Result<(), BakeError> {
        let [x, y, z] = self.grid;
        let flat = |values: Vec<DVec3>| values.into_iter().flat_map(|v| v.to_array()).collect::<Vec<f64>>();
        let coefficients = flat(light.values.concat());
        let points = flat(self.points());
        let inside: Vec<u32> = self.inside.iter().map(|own| u32::from(*own)).collect();
        let array = |shape: Vec<usize>, values| Array { shape, values };
        let arrays = [
            ("coefficients", array(vec![z, y, x, 9, 3], Values::F64(coefficients.into()))),
            ("points", array(vec![z, y, x, 3], Values::F64(points.into()))),
            ("inside", array(vec![z, y, x], Values::I32(inside.into()))),
            ("error", array(vec![z, y, x], Values::F64(self.errors.clone().into()))),
        ];
        Ok(write_npz(path, &arrays)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Irradiance of a distant point, `max(0, n . s)`, and of light from everywhere.
    #[test]
    fn harmonics_give_back_irradiance() {
        let kept = Kind::Harmonics.kept(&vec![DVec3::splat(2.0); 14]);
        let back = |kept: &[DVec3], n: DVec3| kept.iter().zip(harmonics(n)).map(|(c, y)| *c * y).sum::<DVec3>().x;
        assert!((back(&kept, DVec3::new(0.6, 0.0, 0.8)) - 2.0).abs() < 1e-12);
        // Linear and quadratic functions are exact.
        let exact = |n: DVec3| 3.0 + n.x - 0.5 * n.z + 0.7 * n.x * n.y + 0.2 * n.z * n.z;
        let given: Vec<DVec3> = Kind::Harmonics.directions().iter().map(|(n, _)| DVec3::splat(exact(*n))).collect();
        let kept = Kind::Harmonics.kept(&given);
        for n in [DVec3::new(0.48, 0.6, 0.64), DVec3::NEG_Y, DVec3::new(-0.8, 0.0, 0.6)] {
            assert!((back(&kept, n) - exact(n)).abs() < 1e-12, "{n}");
        }
    }

    #[test]
    fn points_inside_take_the_mean_of_those_around() {
        let values: Vec<Vec<DVec3>> = (0..27).map(|k| vec![DVec3::splat(f64::from(k))]).collect();
        let mut inside = vec![false; 27];
        inside[13] = true;
        assert_eq!(filled(values.clone(), &inside, [3, 3, 3])[13][0], DVec3::splat(13.0));
        // All inside: nothing to take.
        assert_eq!(filled(values.clone(), &[true; 27], [3, 3, 3]), values);
    }
}
