//! What no choice of patches, light or mode changes: a scene, its rays and its surfaces.
//!
//! Not handled: emitters by closed form, which [`crate::direct::Luminaires`] finds.

use std::sync::Arc;

use crate::rays::Rays;
use crate::scene::Scene;
use crate::surfaces::scene_surfaces::Surfaces;

/// A scene with its rays and surfaces; immutable, and shared by all that is made of it.
pub struct Geometry {
    /// The scene.
    pub scene: Scene,
    /// Its rays.
    pub rays: Rays,
    /// Its surfaces.
    pub surfaces: Arc<Surfaces>,
}

impl Geometry {
    /// Builds the ray hierarchy of a scene and finds its surfaces.
    pub fn new(scene: Scene) -> Arc<Geometry> {
        let rays = Rays::new(&scene);
        let surfaces = Surfaces::new(&scene, &rays);
        Arc::new(Geometry { scene, rays, surfaces })
    }
}
