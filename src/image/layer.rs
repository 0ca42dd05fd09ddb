//! What the camera rays of one pixel saw of one surface.
//!
//! A pixel on an edge sees several surfaces: each has its own irradiance, and the share of the camera rays that saw it
//! weighs it in the pixel. Facets of one smooth body that continue each other count as one surface.
//!
//! Not handled: more than one texture of rho within a material; there is none.

use glam::{DVec3, Vec3};

use crate::form_factors::Receiver;
use crate::light::Rgb;
use crate::rays::Side;

/// Normals of facets of one surface agree to this cosine.
const ALIGNED: f32 = 0.99;
/// Facets of one surface lie off each other's plane by at most this share of their distance.
const FLAT: f32 = 0.1;

/// A surface as one pixel sees it.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// Plane, side and material.
    pub key: (u32, Side, u32),
    /// The first point seen, with the normal of the side seen.
    pub first: Receiver,
    /// Reflectance.
    pub rho: Rgb,
    /// Number of camera rays.
    pub count: u32,
    /// Sum of the points seen.
    sum: DVec3,
}

impl Layer {
    /// A layer that no ray has seen yet.
    pub fn new(key: (u32, Side, u32), first: Receiver, rho: Rgb) -> Layer {
        Layer {
            key,
            first,
            rho,
            count: 0,
            sum: DVec3::ZERO,
        }
    }

    /// Adds one camera ray.
    pub fn add(&mut self, position: Vec3) {
        self.count += 1;
        self.sum += position.as_dvec3();
    }

    /// Mean of the points seen.
    pub fn position(&self) -> DVec3 {
        self.sum / f64::from(self.count)
    }

    /// Whether a point belongs to this surface: in its plane, or on a facet that continues it around a bend.
    pub fn holds(&self, key: (u32, Side, u32), seen: &Receiver) -> bool {
        if self.key == key {
            return true;
        }
        let (n, m) = (self.first.normal, seen.normal);
        let d = seen.position - self.first.position;
        (self.key.1, self.key.2) == (key.1, key.2)
            && (ALIGNED..1.0 - 1e-6).contains(&n.dot(m))
            && d.dot(n).abs() <= FLAT * d.length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn receiver(position: Vec3, normal: Vec3) -> Receiver {
        Receiver {
            position,
            normal: normal.normalize(),
            face: 0,
        }
    }

    #[test]
    fn parallel_planes_stay_apart_and_facets_join() {
        let layer = Layer::new((0, Side::Front, 0), receiver(Vec3::ZERO, Vec3::Z), Rgb::ONE);
        let beside = Vec3::new(0.1, 0.0, 0.001);
        let other = (1, Side::Front, 0);
        assert!(layer.holds((0, Side::Front, 0), &receiver(beside, Vec3::Z)));
        assert!(!layer.holds(other, &receiver(beside, Vec3::Z)));
        assert!(layer.holds(other, &receiver(beside, Vec3::new(0.05, 0.0, 1.0))));
        assert!(!layer.holds(other, &receiver(beside, Vec3::new(0.5, 0.0, 1.0))));
        let glass = (1, Side::Front, 7);
        assert!(!layer.holds(glass, &receiver(beside, Vec3::new(0.05, 0.0, 1.0))));
    }
}
