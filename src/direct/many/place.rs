//! Where a light cut serves: a patch, or a single point.
//!
//! Not handled: the extent of curved patches, around which no corners are known.

use glam::DVec3;

use crate::direct::emitters::shafts::{Body, patch_body};
use crate::form_factors::chebyshev::Rectangle;
use crate::patches::Patches;
use crate::rays::sobol::hash;
use crate::surfaces::SurfacePoint;

/// A patch, or a single point.
pub(crate) struct Place<'a> {
    of: Receivers<'a>,
    /// None where it has too many corners to test what stands between.
    pub body: Option<Body>,
    /// That around a flat patch.
    pub rectangle: Option<Rectangle>,
    /// Corners around all of it, in its plane; none where it is curved.
    pub corners: Vec<DVec3>,
    pub center: DVec3,
    pub normal: DVec3,
    pub radius: f64,
    /// Of the random numbers of its trials.
    pub seed: u32,
}

/// The receivers that a place holds.
enum Receivers<'a> {
    Patch(&'a Patches, usize),
    Point(SurfacePoint),
}

/// Keeps the trials of cuts apart from other random numbers.
const TRIALS: u32 = 0x11_6a5b;

impl<'a> Place<'a> {
    /// Patch i.
    pub(crate) fn of_patch(patches: &'a Patches, i: usize) -> Place<'a> {
        let rectangle = Rectangle::new(patches, i);
        let corners: Vec<DVec3> = patches.pieces(i).flat_map(|p| p.1.map(|q| q.as_dvec3())).collect();
        let mean = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
        let reach = |p: &DVec3| p.distance(mean);
        let face = patches.pieces(i).next().map_or(0, |p| p.0);
        Place {
            of: Receivers::Patch(patches, i),
            body: patch_body(patches, i),
            center: rectangle.as_ref().map_or(mean, |r| r.center),
            normal: patches.normal(face, patches.side(i)).as_dvec3(),
            radius: match &rectangle {
                Some(r) => r.radius(),
                None => corners.iter().map(reach).fold(0.0, f64::max),
            },
            corners: rectangle.as_ref().map_or(Vec::new(), |r| r.corners().to_vec()),
            rectangle,
            seed: hash(i as u32, TRIALS),
        }
    }

    /// A single point.
    pub(crate) fn of_point(point: &SurfacePoint) -> Place<'a> {
        let (center, normal) = (point.position.as_dvec3(), point.normal.as_dvec3());
        let bits = point.position.to_array().into_iter().chain(point.normal.to_array()).map(f32::to_bits);
        Place {
            of: Receivers::Point(*point),
            body: Some(Body::of_point(center, normal)),
            rectangle: None,
            corners: vec![center],
            center,
            normal,
            radius: 0.0,
            seed: bits.fold(TRIALS, |seed, bits| hash(bits, seed)),
        }
    }

    /// Whether it is a single point.
    pub(crate) fn is_point(&self) -> bool {
        matches!(self.of, Receivers::Point(_))
    }

    /// The receiver that belongs to a point of the unit square.
    pub(crate) fn receiver(&self, u: f32, v: f32) -> SurfacePoint {
        match self.of {
            Receivers::Patch(patches, i) => patches.point(i, u, v),
            Receivers::Point(point) => point,
        }
    }
}
