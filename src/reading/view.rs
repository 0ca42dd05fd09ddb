//! A view: a prepared scene with its lights, and the size of the picture.
//!
//! Not handled: the light that is gathered ([`crate::reading::Fields`]).

use glam::Vec3;

use crate::direct::Lights;
use crate::patches::Patches;
use crate::pictures::Size;
use crate::rays::{Hit, Ray, Rays, Side};
use crate::scene::Scene;
use crate::surfaces::{Geometry, SurfacePoint};

/// What the camera looks at.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// What lights it, and all that lies between.
    pub lights: &'a Lights,
    /// The scene, with its camera.
    pub scene: &'a Scene,
    /// Its rays.
    pub rays: &'a Rays,
    /// Its patches.
    pub patches: &'a Patches,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

impl<'a> View<'a> {
    /// A picture of some size of a scene in one mode.
    pub fn new(lights: &'a Lights, size: Size) -> View<'a> {
        let Geometry { scene, rays, .. } = &*lights.geometry;
        View { lights, scene, rays, patches: &lights.patches, width: size.width, height: size.height }
    }

    /// The ray from the camera through a point of pixel k, (u, v) in the unit square from the pixel's upper left
    /// corner.
    pub(crate) fn camera_ray(&self, k: usize, u: f32, v: f32) -> Ray {
        let x = ((k % self.width) as f32 + u) / self.width as f32;
        let y = ((k / self.width) as f32 + v) / self.height as f32;
        let aspect = self.width as f32 / self.height as f32;
        let (origin, direction) = self.scene.camera.ray(x, y, aspect);
        Ray { origin, direction, source: None }
    }

    /// Where a ray meets a face, put exactly into the face's plane.
    #[inline]
    pub(crate) fn met_at(&self, ray: &Ray, hit: &Hit) -> Vec3 {
        let position = ray.at(hit.t);
        let normal = self.patches.normal(hit.face, Side::Front);
        let off = (position - self.scene.corners(hit.face)[0]).dot(normal);
        position - off * normal
    }

    /// A point of a face's side.
    #[inline]
    pub(crate) fn surface_point(&self, face: u32, side: Side, position: Vec3) -> SurfacePoint {
        SurfacePoint { position, normal: self.patches.normal(face, side), face }
    }
}

#[cfg(test)]
pub(crate) use ready::lights_of;

#[cfg(test)]
mod ready {
    use std::sync::Arc;

    use crate::direct::{Lights, Luminaires, TOLERABLE};
    use crate::light::Transport;
    use crate::patches::Patches;
    use crate::scene::Scene;
    use crate::surfaces::Geometry;

    /// A built-in scene on some number of patches.
    pub(crate) fn lights_of(scene: &str, transport: Transport, patches: usize) -> Lights {
        let geometry = Geometry::new(Scene::open(scene).expect("a built-in scene"));
        let patches = Arc::new(Patches::cut(&geometry, patches));
        let luminaires = Arc::new(Luminaires::new(&geometry.scene));
        let transports = geometry.scene.transports(transport);
        Lights::new(&geometry, &patches, &luminaires, transports, TOLERABLE)
    }
}
