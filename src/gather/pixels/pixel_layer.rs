//! One surface that a pixel sees, where indirect light is interpolated and direct light smoothed.
//!
//! Facets of a bent surface join where their normals nearly agree. Not handled: depth within a pixel beyond that of the
//! points kept.

use glam::{DVec3, Vec3};

use crate::rays::Side;
use crate::surfaces::SurfacePoint;

/// Normals of facets of one surface agree to this cosine.
const ALIGNED: f32 = 0.99;

/// Facets of one surface lie off each other's plane by at most this share of their distance.
const FLAT: f32 = 0.1;

/// Points of a half that camera rays leave for hemisphere rays to start from.
const ORIGINS: usize = 16;

/// What camera rays of one surface agree in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SurfaceKey {
    /// The plane of the face.
    pub plane: u32,
    pub side: Side,
    pub material: u32,
}

/// A surface as one pixel sees it.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    /// Plane, side and material.
    pub key: SurfaceKey,
    /// The first point seen, with the normal of the side seen.
    pub first: SurfacePoint,
    /// Number of camera rays of each half.
    pub count: [u32; 2],
    /// Sums of the points seen.
    pub sum: [DVec3; 2],
    /// Sums of the reflectance of the points seen.
    pub reflected: [DVec3; 2],
    /// Sums of direct light there, times that.
    pub lit: [DVec3; 2],
    /// The first points seen by each half.
    pub origins: [Vec<SurfacePoint>; 2],
}

impl Layer {
    /// A layer that no ray has seen yet.
    pub(crate) fn new(key: SurfaceKey, first: SurfacePoint) -> Layer {
        let zero = [DVec3::ZERO; 2];
        Layer { key, first, count: [0; 2], sum: zero, reflected: zero, lit: zero, origins: [Vec::new(), Vec::new()] }
    }

    /// Adds one camera ray of a half, the reflectance where it ended, and direct light times that.
    pub(crate) fn add(&mut self, half: usize, seen: &SurfacePoint, rho: DVec3, lit: DVec3) {
        self.count[half] += 1;
        self.sum[half] += seen.position.as_dvec3();
        self.reflected[half] += rho;
        self.lit[half] += lit;
    }

    /// Sums of the reflectance of the points that each half saw; of one reflectance they are exact, as f64 holds them.
    pub(crate) fn reflected(&self) -> [DVec3; 2] {
        self.reflected
    }

    /// Reflectance, in the mean over so many camera rays of which some met the surface.
    pub(crate) fn mean_reflectance(&self, camera: f64) -> DVec3 {
        let all = f64::from(self.count[0]) + f64::from(self.count[1]);
        // Division by their number gives one reflectance back exactly.
        (self.reflected[0] + self.reflected[1]) / all * (all / camera)
    }

    /// Points that rays of a half may start from: those that it saw first, or the other half's where it saw none.
    pub(crate) fn origins(&self, half: usize) -> &[SurfacePoint] {
        match &self.origins[half][..] {
            [] => &self.origins[1 - half],
            own => own,
        }
    }

    /// Adds a point seen by a camera ray of a half, of which the first ones are kept for hemisphere rays to start from.
    pub(crate) fn keep(&mut self, half: usize, seen: SurfacePoint) {
        if self.origins[half].len() < ORIGINS {
            self.start(half, seen);
        }
    }

    /// Adds a point that rays of a half may start from.
    pub(crate) fn start(&mut self, half: usize, seen: SurfacePoint) {
        self.origins[half].push(seen);
    }

    /// Where its irradiance is interpolated, and from which records.
    pub(crate) fn place(&self) -> Place {
        Place {
            position: self.position(),
            normal: self.first.normal,
            material: 2 * self.key.material + u32::from(self.key.side == Side::Back),
        }
    }

    /// Mean of the points seen.
    pub(crate) fn position(&self) -> DVec3 {
        (self.sum[0] + self.sum[1]) / f64::from(self.count[0] + self.count[1])
    }

    /// The mean of the points seen by one half less that of both.
    pub(crate) fn off(&self, half: usize) -> DVec3 {
        let n = self.count[half];
        if n == 0 { DVec3::ZERO } else { self.sum[half] / f64::from(n) - self.position() }
    }

    /// Whether a point belongs to this surface: in its plane, or on a facet that continues it around a bend.
    pub(crate) fn holds(&self, key: SurfaceKey, seen: &SurfacePoint) -> bool {
        if self.key == key {
            return true;
        }
        let (n, m) = (self.first.normal, seen.normal);
        let d = seen.position - self.first.position;
        (self.key.side, self.key.material) == (key.side, key.material)
            && (ALIGNED..1.0 - 1e-6).contains(&n.dot(m))
            && d.dot(n).abs() <= FLAT * d.length()
    }
}

/// A place on a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub position: DVec3,
    /// Unit normal of the side seen.
    pub normal: Vec3,
    /// Side and material; irradiance is interpolated among places that agree in it.
    pub material: u32,
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn receiver(position: Vec3, normal: Vec3) -> SurfacePoint {
        SurfacePoint { position, normal: normal.normalize(), face: 0 }
    }

    #[test]
    fn parallel_planes_stay_apart_and_facets_join() {
        let key = |plane: u32, material: u32| SurfaceKey { plane, side: Side::Front, material };
        let layer = Layer::new(key(0, 0), receiver(Vec3::ZERO, Vec3::Z));
        let beside = Vec3::new(0.1, 0.0, 0.001);
        let other = key(1, 0);
        assert!(layer.holds(key(0, 0), &receiver(beside, Vec3::Z)));
        assert!(!layer.holds(other, &receiver(beside, Vec3::Z)));
        assert!(layer.holds(other, &receiver(beside, Vec3::new(0.05, 0.0, 1.0))));
        assert!(!layer.holds(other, &receiver(beside, Vec3::new(0.5, 0.0, 1.0))));
        let glass = key(1, 7);
        assert!(!layer.holds(glass, &receiver(beside, Vec3::new(0.05, 0.0, 1.0))));
    }
}
