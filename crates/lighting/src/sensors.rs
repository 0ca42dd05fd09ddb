//! Sensors: where light is measured, read from a table or laid over an object as a grid.
//!
//! Not handled: the points that a standard asks of a room, or of a task.

use std::path::Path;
use std::{fs, io};

use glam::{DVec2, DVec3};

use halflight::rays::warp::basis;
use halflight::render::Sensor;
use halflight::scene::{Bounds, Place, Scene};

use crate::sensor_table::{TableError, sensors};

/// Sensors as they were laid out.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorLayout {
    /// All sensors: in the table's order, or row by row of the grid.
    pub sensors: Vec<Sensor>,
    /// What the results of each are called by.
    pub names: Vec<Option<String>>,
    /// Of sensors side by side: how they lie.
    pub grid: Option<Grid>,
}

/// How sensors lie over an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// The object.
    pub object: String,
    /// How far over it they are, the file's units.
    pub height: f64,
    /// Column and row of each.
    pub cells: Vec<[usize; 2]>,
    /// Columns and rows.
    pub size: [usize; 2],
    /// The directions of rows and of columns, of length 1.
    pub axes: [DVec3; 2],
    /// From a column or row to the next, the file's units.
    pub spacing: f64,
}

/// Why there are no sensors.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum SensorError {
    /// The table cannot be read.
    #[error("cannot read {file}: {source}")]
    #[diagnostic(help("check the path, and that the file may be read"))]
    Read {
        /// The file.
        file: String,
        /// Why.
        source: io::Error,
    },
    /// A row is none of a sensor.
    #[error("{place}: {message}")]
    #[diagnostic(help(
        "a row is x,y,z,nx,ny,nz and, if you like, a name; a first row may name columns in another order"
    ))]
    Row {
        /// Where.
        place: Place,
        /// What is wrong.
        message: String,
    },
    /// The head of the table does not tell which columns are what.
    #[error("{place}: the head `{words}` cannot be understood: {why}")]
    #[diagnostic(help(
        "name the columns x,y,z,nx,ny,nz and, if you like, name, in any order; others are read over. Without a head \
         they are x,y,z,nx,ny,nz and a name; a line of notes begins with #"
    ))]
    Head {
        /// Where.
        place: Place,
        /// Its fields.
        words: String,
        /// What is wrong.
        why: String,
    },
    /// There is no such object.
    #[error("`{scene}` has no object `{name}`")]
    #[diagnostic(help("its objects are: {known}"))]
    NoObject {
        /// The scene.
        scene: String,
        /// The object.
        name: String,
        /// Those that there are.
        known: String,
    },
    /// No sensor of a grid lies over its object, or too many do.
    #[error("a grid of {spacing} over `{name}` has {count} sensors")]
    #[diagnostic(help("choose another spacing: there may be from 1 to {} sensors", MOST))]
    Count {
        /// The object.
        name: String,
        /// The grid's spacing, the file's units.
        spacing: f64,
        /// Sensors of its box.
        count: f64,
    },
}

/// Sensors of a grid at most.
const MOST: usize = 4_000_000;

impl SensorLayout {
    /// Reads a table of points: with a head, by the names of its columns; without one x, y, z, nx, ny, nz and, if there
    /// is a seventh column, a name. Between fields stand commas, semicolons, tabs or spaces.
    ///
    /// # Errors
    /// [`SensorError`] with the line of the head or of the first row that is none.
    pub fn read(path: &Path) -> Result<SensorLayout, SensorError> {
        let file = path.display().to_string();
        let bytes = fs::read(path).map_err(|source| SensorError::Read { file: file.clone(), source })?;
        let (names, sensors) = sensors(&bytes).map_err(|error| match error {
            TableError::Head(line, words, why) => SensorError::Head { place: Place::line(&file, line), words, why },
            TableError::Row(line, message) => SensorError::Row { place: Place::line(&file, line), message },
        })?;
        Ok(SensorLayout { sensors, names, grid: None })
    }

    /// The middles of the cells that the box around a scene is divided into, x running fastest, then y, all facing up.
    ///
    /// # Errors
    /// [`SensorError`] where there are no cells, or too many.
    pub fn through(scene: &Scene, cells: [usize; 3], up: DVec3) -> Result<SensorLayout, SensorError> {
        let count = cells.iter().map(|n| *n as f64).product::<f64>();
        if count < 1.0 || count > MOST as f64 {
            return Err(SensorError::Count { name: scene.name.clone(), spacing: 0.0, count });
        }
        let bounds = Bounds::of((0..scene.solid_faces()).flat_map(|face| scene.exact_corners(face)));
        let sensor = |k: usize| {
            let cell = [k % cells[0], k / cells[0] % cells[1], k / cells[0] / cells[1]];
            let share = DVec3::from([0, 1, 2].map(|axis| (cell[axis] as f64 + 0.5) / cells[axis] as f64));
            let position = scene.frame.to_file(bounds.low + share * (bounds.high - bounds.low));
            Sensor { position, normal: up }
        };
        let sensors: Vec<Sensor> = (0..count as usize).map(sensor).collect();
        Ok(SensorLayout { names: vec![None; sensors.len()], sensors, grid: None })
    }

    /// Lays sensors over the object of a name, at a height over it and a spacing, both in the file's units: in the
    /// plane of the object's mean normal, above the front of one of its faces.
    ///
    /// # Errors
    /// [`SensorError`] where there is no such object, or no sensor over it.
    pub fn over(scene: &Scene, name: &str, height: f64, spacing: f64) -> Result<SensorLayout, SensorError> {
        let corners = triangles(scene, name)?;
        let cross = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a);
        let normal = corners.iter().map(cross).sum::<DVec3>().normalize_or(DVec3::Y);
        // The axes of the coordinates where the object is level, so that rows follow walls.
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let along = axes.into_iter().find(|axis| axis.dot(normal).abs() < 1e-6);
        let u = along.unwrap_or_else(|| basis(normal.as_vec3()).0.as_dvec3());
        let v = normal.cross(u);
        let (step, lift) = (spacing / scene.frame.scale, height / scene.frame.scale);
        let all = || corners.iter().flatten();
        let range = |axis: DVec3| {
            let along = all().map(|corner| corner.dot(axis));
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let ([low_u, high_u], [low_v, high_v]) = (<[f64; 2]>::from(range(u)), <[f64; 2]>::from(range(v)));
        let count = |low: f64, high: f64| ((high - low) / step + 1e-9).floor().max(1.0);
        let (columns, lines) = (count(low_u, high_u), count(low_v, high_v));
        let refuse = |count: f64| SensorError::Count { name: name.to_owned(), spacing, count };
        if !(columns * lines).is_finite() || columns * lines > MOST as f64 {
            return Err(refuse(columns * lines));
        }
        let size = [columns as usize, lines as usize];
        // The grid stands in the middle of the box.
        let first = [0.5 * (low_u + high_u - (columns - 1.0) * step), 0.5 * (low_v + high_v - (lines - 1.0) * step)];
        let heights = heights(&corners, [u, v, normal], first, step, size);
        let (mut sensors, mut cells) = (Vec::new(), Vec::new());
        for (k, height) in heights.into_iter().enumerate().filter(|(_, height)| height.is_finite()) {
            let cell = [k % size[0], k / size[0]];
            let [x, y] = [0, 1].map(|axis| first[axis] + cell[axis] as f64 * step);
            let position = scene.frame.to_file(x * u + y * v + (height + lift) * normal);
            sensors.push(Sensor { position, normal });
            cells.push(cell);
        }
        if sensors.is_empty() {
            return Err(refuse(0.0));
        }
        let grid = Grid { object: name.to_owned(), height, cells, size, axes: [u, v], spacing };
        Ok(SensorLayout { names: vec![None; sensors.len()], sensors, grid: Some(grid) })
    }
}

/// The corners of an object's triangles, unit coordinates.
fn triangles(scene: &Scene, name: &str) -> Result<Vec<[DVec3; 3]>, SensorError> {
    let number = scene.objects.iter().position(|object| object == name);
    let is_own = |&face: &u32| Some(scene.faces[face as usize].object as usize) == number;
    let corners: Vec<_> = (0..scene.solid_faces()).filter(is_own).map(|face| scene.exact_corners(face)).collect();
    if corners.is_empty() {
        let mut known: Vec<&str> = scene.objects.iter().map(String::as_str).collect();
        known.dedup();
        let known = known.join(", ");
        return Err(SensorError::NoObject { scene: scene.name.clone(), name: name.to_owned(), known });
    }
    Ok(corners)
}

/// How high the fronts of triangles lie along the third axis over each cell of a grid, row by row: the highest where
/// there are several, and no number where there is none.
fn heights(
    triangles: &[[DVec3; 3]],
    [u, v, normal]: [DVec3; 3],
    first: [f64; 2],
    step: f64,
    size: [usize; 2],
) -> Vec<f64> {
    let mut heights = vec![f64::NEG_INFINITY; size[0] * size[1]];
    for corners in triangles {
        let flat = corners.map(|c| DVec2::new(c.dot(u), c.dot(v)));
        let [a, b, c] = flat;
        let area = (b - a).perp_dot(c - a);
        if area <= 0.0 {
            continue;
        }
        let cells = |axis: usize| {
            let low = flat.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
            let high = flat.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
            let cell = |x: f64| (x - first[axis]) / step;
            let last = cell(high).floor().clamp(-1.0, size[axis] as f64 - 1.0);
            cell(low).ceil().max(0.0) as usize..(last + 1.0) as usize
        };
        for j in cells(1) {
            for i in cells(0) {
                let p = DVec2::new(first[0] + i as f64 * step, first[1] + j as f64 * step);
                let weights = [(c - b).perp_dot(p - b), (a - c).perp_dot(p - c), (b - a).perp_dot(p - a)];
                if weights.iter().all(|w| *w >= -1e-9 * area) {
                    let height: f64 = weights.iter().zip(corners).map(|(w, c)| w / area * c.dot(normal)).sum();
                    let own = &mut heights[j * size[0] + i];
                    *own = own.max(height);
                }
            }
        }
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_read_and_what_is_wrong_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let read = |text: &str| {
            let path = folder.path().join("p.csv");
            fs::write(&path, text).expect("a file");
            SensorLayout::read(&path).map_err(|error| error.to_string())
        };
        let found = read("x,y,z,nx,ny,nz,name\n1, 2, 3, 0, 1, 0, desk\n# a note\n4,5,6,0,0,-2\n").expect("a table");
        assert_eq!(found.names, [Some("desk".to_owned()), None]);
        assert_eq!(found.sensors[0].position, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(found.sensors[1].normal, DVec3::new(0.0, 0.0, -2.0));
        for (text, line, what) in [
            ("1,2,3,0,1\n", 1, "5 fields"),
            ("1,2,3,0,1,0\n1,2,x,0,1,0\n", 2, "`x` is not"),
            ("1,2,3,0,0,0\n", 1, "normal is zero"),
            ("1,2,inf,0,1,0\n", 1, "`inf` is not"),
            ("1,2,1e200,0,1,0\n", 1, "beyond"),
            ("x,y,z\n", 1, "the head `x, y, z` cannot be understood: no column is nx"),
            ("\n", 1, "no sensor"),
        ] {
            let error = read(text).expect_err("a broken table");
            assert!(error.contains(&format!("line {line}")) && error.contains(what), "{error}");
        }
    }

    #[test]
    fn a_grid_lies_over_the_fronts_of_its_object() {
        let scene = Scene::open("cornell-box").expect("a scene");
        let SensorLayout { sensors, grid, .. } = SensorLayout::over(&scene, "floor", 80.0, 50.0).expect("a grid");
        assert_eq!(sensors.len(), grid.expect("a grid").size.iter().product::<usize>());
        for sensor in &sensors {
            assert!((sensor.position.y - 80.0).abs() < 1e-3 && sensor.normal.y > 0.999, "{sensor:?}");
        }
        let step = sensors[1].position - sensors[0].position;
        assert!((step.length() - 50.0).abs() < 1e-9);
        assert!(SensorLayout::over(&scene, "roof", 0.8, 0.25).is_err());
        assert!(SensorLayout::over(&scene, "floor", 0.8, 1e-6).is_err());
    }
}
