//! What lies between two points, modelled no further than the scene and the transports need.
//!
//! Not handled: what is known of whole patches and luminaires ([`crate::direct::shaft_culling`]).

use crate::light::Transport;
use crate::rays::{End, Hit, Rays};

/// What lies between two points, as far as the scene needs it modelled.
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
    /// The least that models these materials in this scene.
    pub fn new(rays: &Rays, transports: &[Transport]) -> Occlusion {
        if transports.iter().all(|t| t.tau == 1.0) || !rays.anything_occludes() {
            Occlusion::Nothing
        } else if transports.iter().all(|t| t.tau == 0.0) {
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
