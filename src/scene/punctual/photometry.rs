//! The measured intensity of a luminaire by direction.
//!
//! With gamma the angle from the luminaire's axis (0 where it points) and phi that around it the intensity is linear
//! between the angles measured in both, and 0 beyond them. The candela of a file become the radiant intensity of a
//! white light of the same luminance, CIE Y of linear sRGB, by 683 lm/W.
//!
//! Not handled: how files give it ([`crate::scene::scene_file`]).

use std::f64::consts::TAU;

use glam::DVec3;

use crate::light::shares::{Drawn, Shares};

/// Lumens of a watt of white light: the luminous efficacy that CIE Y is scaled by.
pub const EFFICACY: f64 = 683.0;
/// Radiant intensity by direction.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Photometry {
    /// Unit vectors: where phi is 0, where it is 90 degrees, and where gamma is 0.
    frame: [DVec3; 3],
    /// gamma in radians, increasing.
    vertical: Vec<f64>,
    /// phi in radians from 0 to a full turn, increasing.
    horizontal: Vec<f64>,
    /// W/sr of every gamma, for one phi after the other.
    intensity: Vec<f64>,
    /// `Omega I` of the cells between angles, gamma by gamma for one phi after the other, W.
    cells: Shares,
}

/// A direction drawn in proportion to the intensity, nearly.
#[derive(Clone, Copy, Debug)]
pub struct DrawnDirection {
    /// Unit vector away from the light.
    pub direction: DVec3,
    /// The intensity there over that of its chance.
    pub weight: f64,
}

impl Photometry {
    /// The intensity towards a unit vector away from the light, W/sr.
    pub fn intensity(&self, way: DVec3) -> f64 {
        let [x, y, z] = self.frame.map(|axis| axis.dot(way));
        let gamma = x.hypot(y).atan2(z);
        self.at(gamma, y.atan2(x).rem_euclid(TAU))
    }

    fn at(&self, gamma: f64, phi: f64) -> f64 {
        let (Some((i, u)), Some((j, v))) = (between(&self.vertical, gamma), between(&self.horizontal, phi)) else {
            return 0.0;
        };
        let [[a, b], [c, d]] = self.corners(i, j);
        let [low, high] = [a + u * (b - a), c + u * (d - c)];
        low + v * (high - low)
    }

    /// Intensities around the cell that begins with gamma i and phi j: of both gammas for either phi.
    fn corners(&self, i: usize, j: usize) -> [[f64; 2]; 2] {
        [j, j + 1].map(|j| [i, i + 1].map(|i| self.intensity[j * self.vertical.len() + i]))
    }

    /// Power of all directions, as the mean of each cell's corners, W.
    pub fn power(&self) -> f64 {
        self.cells.total()
    }

    /// The direction that belongs to a point of the unit square; without bias by its weight.
    pub fn draw(&self, u: f64, v: f64) -> DrawnDirection {
        let Drawn { index: cell, rest: within, .. } = self.cells.draw(u);
        let (j, i) = (cell / (self.vertical.len() - 1), cell % (self.vertical.len() - 1));
        let [near, far] = [i, i + 1].map(|i| self.vertical[i].cos());
        let cosine = near + within.clamp(0.0, 1.0) * (far - near);
        let phi = self.horizontal[j] + v * (self.horizontal[j + 1] - self.horizontal[j]);
        let (sin, cos) = phi.sin_cos();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let [x, y, z] = self.frame;
        let direction = sine * cos * x + sine * sin * y + cosine * z;
        let mean = 0.25 * self.corners(i, j).as_flattened().iter().sum::<f64>();
        DrawnDirection { direction, weight: self.at(cosine.clamp(-1.0, 1.0).acos(), phi) / mean }
    }

    /// From the intensities of every gamma, for one phi after the other; at least two of both.
    pub(crate) fn new(frame: [DVec3; 3], vertical: Vec<f64>, horizontal: Vec<f64>, intensity: Vec<f64>) -> Photometry {
        let columns = vertical.len() - 1;
        let cells = columns * (horizontal.len() - 1);
        let found = Photometry { frame, vertical, horizontal, intensity, cells: Shares::default() };
        let power = |cell: usize| {
            let (j, i) = (cell / columns, cell % columns);
            let turn = found.horizontal[j + 1] - found.horizontal[j];
            let omega = turn * (found.vertical[i].cos() - found.vertical[i + 1].cos());
            omega * 0.25 * found.corners(i, j).as_flattened().iter().sum::<f64>()
        };
        Photometry { cells: Shares::of((0..cells).map(power)), ..found }
    }
}

/// The interval of increasing numbers that holds x, and where x lies within it; none outside of all.
pub(crate) fn between(numbers: &[f64], x: f64) -> Option<(usize, f64)> {
    let last = numbers.len() - 1;
    if !(numbers[0]..=numbers[last]).contains(&x) {
        return None;
    }
    let i = numbers.partition_point(|&n| n <= x).clamp(1, last) - 1;
    Some((i, (x - numbers[i]) / (numbers[i + 1] - numbers[i])))
}
