//! The cells of a sky: rows from the zenith down, each of equal cells, and which of them lies in a direction.
//!
//! The first cell of a row lies about north, the others follow clockwise seen from above, as Tregenza and Reinhart
//! number patches. Two rows of one cell are the upper and the lower half. A single cell at the top or at the bottom is
//! a cap about that pole.
//!
//! Sources: P. R. Tregenza, *Subdivision of the sky hemisphere for luminance measurements*, Lighting Res. Technol.
//! 19(1), 1987; C. F. Reinhart, O. Walkenhorst, *Validation of dynamic RADIANCE-based daylight simulations*, Energy and
//! Buildings 33(7), 2001. Not handled: radiances ([`crate::scene::Scene::set_sky`]).

use std::f32::consts::TAU;
use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3};

/// Cells in each of the seven rows of MF:1 above the horizon, from the lowest.
const TREGENZA: [u32; 7] = [30, 30, 24, 24, 18, 12, 6];

/// The faces that stand for a scene's sky, one for each of its cells; they are the last of the scene.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Sky {
    /// Unit vector to the zenith.
    pub up: Vec3,
    /// Unit vector to the north, at a right angle to it.
    pub north: Vec3,
    /// From the zenith down.
    pub rows: Vec<SkyRow>,
    /// The face of the first cell.
    pub first: u32,
    /// Radius of the smallest sphere about the origin of unit coordinates that holds all vertices.
    pub radius: f64,
}

/// A row of cells of a sky: directions with a sine of the altitude above `low`, and at most that of the row above.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SkyRow {
    /// Sine of the altitude of its lower edge; -1 of the last row.
    pub low: f32,
    /// How many cells are above.
    pub before: u32,
    /// How many it has.
    pub cells: u32,
}

impl Sky {
    /// The finest n of Reinhart's MF:n that there is.
    pub const FINEST: u32 = 8;

    /// The rows of an upper and a lower half.
    pub(super) fn halves() -> Vec<SkyRow> {
        rows([(1, 0.0), (1, -1.0)])
    }

    /// The rows of Reinhart's MF:n, n from 1 to [`Sky::FINEST`], and the ground as the last.
    pub(super) fn reinhart(n: u32) -> Vec<SkyRow> {
        let all = TREGENZA.len() as u32 * n;
        let sine = |row: u32| (FRAC_PI_2 * f64::from(row) / (f64::from(all) + 0.5)).sin() as f32;
        let below_cap = (0..all).rev().map(|row| (TREGENZA[(row / n) as usize] * n, sine(row)));
        rows(std::iter::once((1, sine(all))).chain(below_cap).chain([(1, -1.0)]))
    }

    /// The part of a direction to the north that is level, at length 1; none where there is none.
    pub fn level(north: DVec3, up: DVec3) -> Option<DVec3> {
        let (north, up) = (north.try_normalize()?, up.try_normalize()?);
        let level = north - north.dot(up) * up;
        (level.length() > 1e-6).then(|| level.normalize())
    }

    /// The north of those who give none: -z where y points up, so that east is +x, and +y where z does; a unit vector
    /// at a right angle to `up`, which is not zero.
    pub fn usual_north(up: DVec3) -> DVec3 {
        let up = up.normalize();
        let near = if up.z.abs() > 0.5 { DVec3::Y } else { DVec3::NEG_Z };
        Sky::level(near, up).unwrap_or(DVec3::X)
    }

    /// How many cells there are.
    pub fn cells(&self) -> u32 {
        self.rows.last().map_or(0, |row| row.before + row.cells)
    }

    /// The face that stands for the sky in a direction.
    #[inline]
    pub fn face(&self, direction: Vec3) -> u32 {
        let sine = direction.dot(self.up);
        let SkyRow { before, cells, .. } = self.rows[first_row(&self.rows, |row| row.low < sine)];
        self.first + before + if cells == 1 { 0 } else { self.clockwise(direction, cells) }
    }

    /// Which of the cells of a row a direction's azimuth lies in.
    fn clockwise(&self, direction: Vec3, cells: u32) -> u32 {
        let east = self.north.cross(self.up);
        let turn = direction.dot(east).atan2(direction.dot(self.north)) / TAU;
        (turn * cells as f32 + 0.5).floor().rem_euclid(cells as f32) as u32 % cells
    }

    /// Whether a face stands for a cell of the sky.
    #[inline]
    pub fn holds(&self, face: u32) -> bool {
        face >= self.first
    }

    /// The row that a face's cell is in, and the sine at that row's upper edge.
    fn row(&self, face: u32) -> (SkyRow, f32) {
        let row = first_row(&self.rows, |row| face - self.first < row.before + row.cells);
        (self.rows[row], row.checked_sub(1).map_or(1.0, |above| self.rows[above].low))
    }

    /// The solid angle of a face's cell, sr.
    pub(super) fn solid_angle(&self, face: u32) -> f64 {
        let (SkyRow { low, cells, .. }, high) = self.row(face);
        2.0 * PI * (f64::from(high) - f64::from(low)) / f64::from(cells)
    }

    /// Of a cap about a pole: the pole, and the least cosine to it.
    pub(crate) fn cap(&self, face: u32) -> Option<(Vec3, f32)> {
        let (SkyRow { low, cells, .. }, high) = self.row(face);
        match (cells, high, low) {
            (1, 1.0, _) => Some((self.up, low)),
            (1, _, -1.0) => Some((-self.up, -high)),
            _ => None,
        }
    }

    /// The direction at (u, v) of the unit square within a cell that is no cap; uniform in it for uniform (u, v).
    pub(crate) fn within(&self, face: u32, u: f32, v: f32) -> Vec3 {
        let (SkyRow { low, before, cells }, high) = self.row(face);
        let turn = ((face - self.first - before) as f32 + u - 0.5) / cells as f32;
        let (east, north) = (TAU * turn).sin_cos();
        let sine = low + (high - low) * v;
        let level = (1.0 - sine * sine).max(0.0).sqrt();
        level * (east * self.north.cross(self.up) + north * self.north) + sine * self.up
    }
}

/// Rows of so many cells each down to the sine of an altitude.
fn rows(all: impl IntoIterator<Item = (u32, f32)>) -> Vec<SkyRow> {
    let mut next = 0;
    let row = |(cells, low)| {
        next += cells;
        SkyRow { low, before: next - cells, cells }
    };
    all.into_iter().map(row).collect()
}

/// The first row from the zenith down that is wanted, all below which are wanted too; the last where none else is.
fn first_row(rows: &[SkyRow], is_wanted: impl Fn(&SkyRow) -> bool) -> usize {
    rows[..rows.len() - 1].partition_point(|row| !is_wanted(row))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions drawn in a cell lie in it, and the cells cover the sphere once.
    #[test]
    fn directions_within_a_cell_find_it() {
        let up = Vec3::new(0.1, 0.2, 0.9).normalize();
        let north = Sky::level(DVec3::Y, up.as_dvec3()).expect("a north").as_vec3();
        for rows in [Sky::halves(), Sky::reinhart(1), Sky::reinhart(3), Sky::reinhart(Sky::FINEST)] {
            let sky = Sky { up, north, rows, first: 7, radius: 1.0 };
            let faces = 7..7 + sky.cells();
            for face in faces.clone() {
                let places = [(0.01, 0.01), (0.99, 0.5), (0.5, 0.99)];
                let inside = |(u, v)| sky.cap(face).map_or_else(|| sky.within(face, u, v), |(pole, _)| pole);
                assert!(places.into_iter().all(|place| sky.face(inside(place)) == face), "{face}");
            }
            let all: f64 = faces.map(|face| sky.solid_angle(face)).sum();
            assert!((all - 4.0 * PI).abs() < 1e-9, "{all}");
        }
        assert_eq!([1, 2, 4].map(|n| Sky::reinhart(n).iter().map(|row| row.cells).sum::<u32>()), [146, 578, 2306]);
    }
}
