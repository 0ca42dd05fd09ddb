//! Occlusion between two points, by the simplest model for the scene and the transports.
//!
//! Not handled: occlusion between whole patches and luminaires ([`crate::direct::emitters::shafts`]).

use glam::DVec3;

use crate::light::{Transport, nothing_passes};
use crate::rays::{End, Hit, Rays};
use crate::scene::{PunctualLight, PunctualPlace, Scene};

/// Heights below this lie in the plane: a few roundings of unit coordinates.
const FLAT: f64 = 1e-6;

/// A model of the occlusion between two points.
#[derive(Clone, Debug, PartialEq)]
pub enum Occlusion {
    /// Nothing can occlude: tau is 1 everywhere, or every face lies on the scene's convex hull.
    Nothing,
    /// tau is 0 everywhere: the first face ends a ray.
    Opaque,
    /// tau of each material; every crossing counts.
    Partial(Vec<f32>),
}

impl Occlusion {
    /// The simplest model for these materials in this scene.
    pub fn new(rays: &Rays, transports: &[Transport]) -> Occlusion {
        Occlusion::of(transports, rays.anything_occludes())
    }

    /// The simplest model between the scene and punctual lights, which may be outside of it.
    pub(crate) fn of_punctual(
        scene: &Scene,
        rays: &Rays,
        transports: &[Transport],
        lights: &[PunctualLight],
    ) -> Occlusion {
        // The faces that represent a sky have no place.
        let inside = || scene.sky.is_none() && lights.iter().all(|light| is_inside(scene, light));
        Occlusion::of(transports, rays.anything_occludes() || !inside())
    }

    fn of(transports: &[Transport], anything_occludes: bool) -> Occlusion {
        if transports.iter().all(|t| t.tau == 1.0) || !anything_occludes {
            Occlusion::Nothing
        } else if nothing_passes(transports.iter().map(|t| t.tau)) {
            Occlusion::Opaque
        } else {
            Occlusion::Partial(transports.iter().map(|t| t.tau).collect())
        }
    }

    /// Product of tau between two points, each with the face it lies on.
    #[inline]
    pub fn transmittance(&self, rays: &Rays, from: End, to: End, scratch: &mut Vec<Hit>) -> f32 {
        match self {
            Occlusion::Nothing => 1.0,
            Occlusion::Opaque => f32::from(rays.visible(from, to)),
            Occlusion::Partial(tau) => rays.transmittance(from, to, tau, scratch),
        }
    }
}

/// Whether a punctual light lies on the scene's side of every face's plane, all faces lying on the scene's convex hull.
fn is_inside(scene: &Scene, light: &PunctualLight) -> bool {
    let Some(PunctualPlace { position, .. }) = light.form.place() else { return false };
    let middle = scene.vertices.iter().map(|v| v.as_dvec3()).sum::<DVec3>() / scene.vertices.len() as f64;
    (0..scene.faces.len() as u32).all(|face| {
        let [a, b, c] = scene.corners(face).map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let [own, all] = [*position, middle].map(|p| normal.dot(p - a));
        // A scene of one plane has no inside, and hides nothing from what is off it.
        own.abs() > FLAT && (all.abs() <= FLAT || own * all > 0.0)
    })
}
