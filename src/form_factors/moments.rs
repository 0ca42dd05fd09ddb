//! Sums over luminaires, and the few points that stand for them.
//!
//! Up to six points have the power, centroid and covariance of the luminaires, all channels together, and the power and
//! centroid of every channel. The error of the kernel's sum over them is of third order in their extent over their distance
//! for the mean of the channels; of second order for each channel, where luminaires of different colours lie together. One
//! mean normal speaks for all; it is right to that order where the normals are alike.
//!
//! Not handled: what lies between, and points of which only some are above the receiver's horizon.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::luminaire::Luminaire;

/// Sums over the area of luminaires, weighted by radiance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums {
    /// Power by channel over pi.
    power: DVec3,
    /// Mean of the channels' power.
    pub weight: f64,
    /// Centroid times `weight`.
    pub first: DVec3,
    /// Second moments about the origin.
    second: DMat3,
    /// `first` of every channel.
    channels: [DVec3; 3],
    /// Normals, weighted alike.
    pub normal: DVec3,
}

/// Points that stand for a node: the same power, centroid and covariance.
#[derive(Clone, Debug, Default)]
pub(super) struct Moments {
    points: Vec<(DVec3, DVec3)>,
    /// Mean normal, no longer than 1.
    normal: DVec3,
}

impl Sums {
    pub fn of(luminaire: &Luminaire) -> Sums {
        let radiance = luminaire.radiance.as_dvec3();
        // Not the default: a matrix's is one.
        let mut sums = Sums {
            power: DVec3::ZERO,
            weight: 0.0,
            first: DVec3::ZERO,
            second: DMat3::ZERO,
            channels: [DVec3::ZERO; 3],
            normal: DVec3::ZERO,
        };
        for [a, b, c] in luminaire.triangles() {
            let cross = 0.5 * (b - a).cross(c - a);
            let power = radiance * cross.length();
            let weight = power.element_sum() / 3.0;
            let s = a + b + c;
            let outer = |p: DVec3| DMat3::from_cols(p * p.x, p * p.y, p * p.z);
            sums.power += power;
            sums.weight += weight;
            sums.first += weight * s / 3.0;
            sums.second += (outer(a) + outer(b) + outer(c) + outer(s)) * (weight / 12.0);
            for k in 0..3 {
                sums.channels[k] += power[k] * s / 3.0;
            }
            sums.normal += weight * cross.normalize_or_zero();
        }
        sums
    }

    pub fn add(mut self, other: &Sums) -> Sums {
        self.power += other.power;
        self.weight += other.weight;
        self.first += other.first;
        self.second += other.second;
        for (own, more) in self.channels.iter_mut().zip(other.channels) {
            *own += more;
        }
        self.normal += other.normal;
        self
    }

    /// Points along the principal axes of the covariance; each channel's weights tilt to its own centroid.
    pub fn moments(&self) -> Moments {
        if self.weight <= 0.0 {
            return Moments::default();
        }
        let mean = self.first / self.weight;
        let outer = DMat3::from_cols(mean * mean.x, mean * mean.y, mean * mean.z);
        let spread = self.second * (1.0 / self.weight) - outer;
        let matrix = nalgebra::Matrix3::from_column_slice(&spread.to_cols_array());
        let eigen = matrix.symmetric_eigen();
        let most = eigen.eigenvalues.max();
        let axes: Vec<usize> = (0..3)
            .filter(|&k| eigen.eigenvalues[k] > 1e-6 * most)
            .collect();
        let count = axes.len() as f64;
        let mut points = Vec::new();
        for k in axes {
            let axis = DVec3::from_slice(eigen.eigenvectors.column(k).as_slice());
            let reach = (count * eigen.eigenvalues[k]).sqrt();
            let offset = |c: usize| (self.channels[c] - self.power[c] * mean).dot(axis);
            let tilt = DVec3::new(offset(0), offset(1), offset(2)) / (2.0 * reach);
            let even = self.power / (2.0 * count);
            points.push((mean + reach * axis, even + tilt));
            points.push((mean - reach * axis, even - tilt));
        }
        Moments {
            points,
            normal: self.normal / self.weight,
        }
    }
}

impl Moments {
    /// `sum of F L` at a point with unit normal n, nothing between.
    pub fn light(&self, x: DVec3, n: DVec3) -> DVec3 {
        let kernel = |&(y, power): &(DVec3, DVec3)| {
            let d = y - x;
            let square = d.length_squared().max(1e-30);
            let cosines = d.dot(n).max(0.0) * (-d.dot(self.normal)).max(0.0);
            power * (cosines / (square * square))
        };
        self.points.iter().map(kernel).sum::<DVec3>() / PI
    }
}
