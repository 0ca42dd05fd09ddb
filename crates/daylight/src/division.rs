//! Directions, and the division of the sky into patches by Tregenza and Reinhart.
//!
//! ```text
//! MF:n    7 n rows of height 90° / (7 n + 1/2), of n (30, 30, 24, 24, 18, 12, 6) patches, n rows of each, and a cap
//!         patch j of m lies around azimuth 360° j / m, from north by east
//! ```
//!
//! Column 0 is the ground, all that lies below the horizon; then rows from the horizon upwards, each from north by
//! east; the cap around the zenith comes last. That is the order of Radiance's `reinhart.cal` and `gendaymtx`. MF:1 is
//! Tregenza's, 145 patches; MF:2 has 577, MF:4 2,305.
//!
//! Sources: P. R. Tregenza, *Subdivision of the sky hemisphere for luminance measurements*, Lighting Res. Technol.
//! 19(1), 1987; C. F. Reinhart, O. Walkenhorst, *Validation of dynamic RADIANCE-based daylight simulations*, Energy and
//! Buildings 33(7), 2001. Not handled: divisions of the ground.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use halflight::scene::Sky;

/// Patches in each of the seven rows of MF:1.
const TREGENZA: [usize; 7] = [30, 30, 24, 24, 18, 12, 6];

/// Which way is up, and which is north.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compass {
    /// Unit vector.
    pub east: DVec3,
    /// Unit vector.
    pub north: DVec3,
    /// Unit vector.
    pub up: DVec3,
}

impl Compass {
    /// The compass of a direction upwards, and one to the north, of which the part that is level counts; none where
    /// either is zero or no number, or both are parallel.
    pub fn new(up: DVec3, north: DVec3) -> Option<Compass> {
        let north = Sky::level(north, up)?;
        let up = up.normalize();
        Some(Compass { east: north.cross(up), north, up })
    }

    /// The compass of scenes whose y points up: north is -z, so that east is +x. Of those whose z points up: north is
    /// +y and east +x.
    pub fn of_up(up: DVec3) -> Option<Compass> {
        Compass::new(up, Sky::usual_north(up.try_normalize()?))
    }

    /// East, north and up of a vector.
    pub fn of(&self, v: DVec3) -> DVec3 {
        DVec3::new(v.dot(self.east), v.dot(self.north), v.dot(self.up))
    }

    /// The vector of east, north and up.
    pub fn vector(&self, local: DVec3) -> DVec3 {
        local.x * self.east + local.y * self.north + local.z * self.up
    }
}

/// East, north and up of the direction at an altitude and an azimuth, radians, the azimuth from north by east.
pub fn direction(altitude: f64, azimuth: f64) -> DVec3 {
    DVec3::new(altitude.cos() * azimuth.sin(), altitude.cos() * azimuth.cos(), altitude.sin())
}

/// A division of the sky, MF:n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Division {
    n: usize,
}

impl Division {
    /// The finest there is.
    pub const FINEST: usize = 8;

    /// MF:n; none unless n is from 1 to [`Division::FINEST`].
    pub fn new(n: usize) -> Option<Division> {
        (1..=Division::FINEST).contains(&n).then_some(Division { n })
    }

    /// The n of MF:n.
    pub fn fineness(self) -> usize {
        self.n
    }

    /// Columns: the ground, and all patches.
    pub fn columns(self) -> usize {
        2 + TREGENZA.iter().sum::<usize>() * self.n * self.n
    }

    /// Rows above the horizon, the cap counted.
    pub fn rows(self) -> usize {
        1 + TREGENZA.len() * self.n
    }

    /// Patches in a row.
    pub fn in_row(self, row: usize) -> usize {
        TREGENZA.get(row / self.n).map_or(1, |patches| patches * self.n)
    }

    /// The lower end of a row, radians; the end of the last one is the zenith.
    pub fn altitude(self, row: usize) -> f64 {
        if row >= self.rows() { FRAC_PI_2 } else { row as f64 * self.height() }
    }

    /// Height of all rows but the cap, radians.
    fn height(self) -> f64 {
        FRAC_PI_2 / ((TREGENZA.len() * self.n) as f64 + 0.5)
    }

    /// The column of a row's patch at an azimuth, radians.
    pub fn column(self, row: usize, azimuth: f64) -> usize {
        let many = self.in_row(row);
        let patch = (azimuth / TAU * many as f64 + 0.5).floor().rem_euclid(many as f64) as usize;
        self.first(row) + patch
    }

    /// The first column of a row.
    pub fn first(self, row: usize) -> usize {
        1 + (0..row).map(|row| self.in_row(row)).sum::<usize>()
    }

    /// Of each column: the altitude and azimuth of its middle, radians, and its solid angle, sr. The ground's middle is
    /// straight down.
    pub fn patches(self) -> Vec<SkyPatch> {
        let ground = SkyPatch { altitude: -FRAC_PI_2, azimuth: 0.0, solid_angle: TAU };
        let row = |row: usize| {
            let (low, high, many) = (self.altitude(row), self.altitude(row + 1), self.in_row(row));
            let is_cap = row + 1 == self.rows();
            let altitude = if is_cap { FRAC_PI_2 } else { 0.5 * (low + high) };
            let solid_angle = TAU / many as f64 * (high.sin() - low.sin());
            (0..many).map(move |j| SkyPatch { altitude, azimuth: TAU * j as f64 / many as f64, solid_angle })
        };
        std::iter::once(ground).chain((0..self.rows()).flat_map(row)).collect()
    }

    /// The azimuths, radians in 0..2 pi, at which patches of some row meet.
    pub fn meridians(self) -> Vec<f64> {
        let row = |row: usize| {
            let many = self.in_row(row) as f64;
            (0..self.in_row(row)).map(move |j| (j as f64 + 0.5) / many * TAU)
        };
        let mut all: Vec<f64> = (0..self.rows() - 1).step_by(self.n).flat_map(row).collect();
        all.sort_by(f64::total_cmp);
        all.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
        all
    }
}

/// Where a patch of the sky lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyPatch {
    /// Of its middle, radians.
    pub altitude: f64,
    /// Of its middle, radians from north by east.
    pub azimuth: f64,
    /// sr.
    pub solid_angle: f64,
}

impl SkyPatch {
    /// East, north and up of the direction to its middle.
    pub fn direction(&self) -> DVec3 {
        direction(self.altitude, self.azimuth)
    }
}

/// Irradiance of a horizontal plane under a unit radiance all over the sky, which is pi.
pub const OPEN: f64 = PI;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sky_is_covered_once() {
        for (n, columns) in [(1, 146), (2, 578), (4, 2306)] {
            let division = Division::new(n).expect("a division");
            let patches = division.patches();
            assert_eq!((division.columns(), patches.len()), (columns, columns));
            let sum: f64 = patches[1..].iter().map(|patch| patch.solid_angle).sum();
            assert!((sum - TAU).abs() < 1e-12, "{sum}");
            for (column, patch) in patches.iter().enumerate().skip(1) {
                let row = (0..division.rows()).rfind(|&row| division.altitude(row) <= patch.altitude).expect("a row");
                assert_eq!(division.column(row, patch.azimuth), column);
            }
        }
        assert!(Division::new(0).is_none() && Division::new(9).is_none());
    }

    #[test]
    fn compasses_are_right_handed() {
        for up in [DVec3::Y, DVec3::Z, DVec3::new(0.1, 0.2, 3.0)] {
            let Compass { east, north, up } = Compass::of_up(up).expect("a compass");
            assert!((east.cross(north) - up).length() < 1e-12);
        }
        assert!(Compass::new(DVec3::Y, DVec3::Y).is_none() && Compass::new(DVec3::ZERO, DVec3::Y).is_none());
        assert_eq!(Compass::of_up(DVec3::Y).map(|compass| compass.east), Some(DVec3::X));
    }
}
