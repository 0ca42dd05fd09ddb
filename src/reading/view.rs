//! A view: a prepared scene with its lights, and the size of the picture.
//!
//! Not handled: the light that is gathered ([`crate::reading::Fields`]).

use glam::Vec3;

use crate::direct::Lights;
use crate::light::Rgb;
use crate::patches::Patches;
use crate::pictures::Size;
use crate::rays::{Hit, Ray, Rays, Side};
use crate::scene::Scene;
use crate::surfaces::atlas::{is_meant, ray_to, width_at};
use crate::surfaces::{Atlas, Geometry, SurfacePoint};

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
    /// What is looked at in place of what the camera sees.
    pub(crate) atlas: Option<&'a dyn Atlas>,
}

impl<'a> View<'a> {
    /// A picture of some size of a scene in one mode.
    pub fn new(lights: &'a Lights, size: Size) -> View<'a> {
        let Geometry { scene, rays, atlas, .. } = &*lights.geometry;
        let (Size { width, height }, atlas) = (size, atlas.as_deref());
        View { lights, scene, rays, patches: &lights.patches, width, height, atlas }
    }

    /// The ray from the camera through a point of pixel k, (u, v) in the unit square from the pixel's upper left
    /// corner.
    pub(crate) fn camera_ray(&self, k: usize, u: f32, v: f32) -> Ray {
        let x = ((k % self.width) as f32 + u) / self.width as f32;
        let y = ((k / self.width) as f32 + v) / self.height as f32;
        if let Some(atlas) = self.atlas {
            return ray_to(atlas, x, y);
        }
        let aspect = self.width as f32 / self.height as f32;
        let (origin, direction) = self.scene.camera.ray(x, y, aspect);
        Ray { origin, direction, source: None }
    }

    /// Whether what a ray from the camera meets is what is looked at.
    #[inline]
    pub(crate) fn is_looked_at(&self, ray: &Ray, hit: &Hit) -> bool {
        self.atlas.is_none() || is_meant(ray, hit, self.patches.normal(hit.face, hit.side))
    }

    /// The reflectance that the camera sees at a point of a face.
    #[inline]
    pub(crate) fn shown_rho(&self, face: u32, position: Vec3) -> Rgb {
        if self.atlas.is_some() { Rgb::ONE } else { self.scene.rho_at(face, position) }
    }

    /// The light as emitted that the camera sees at a point of a face.
    #[inline]
    pub(crate) fn shown_emission(&self, face: u32, position: Vec3) -> Rgb {
        if self.atlas.is_some() { Rgb::ZERO } else { self.scene.emitted_at(face, position).visible }
    }

    /// The width of a pixel at a point seen in pixel k, head on.
    pub(crate) fn pixel_at(&self, k: usize, position: Vec3) -> f64 {
        let [x, y] = [k % self.width, k / self.width].map(|p| p as f32 + 0.5);
        match self.atlas {
            Some(atlas) => width_at(atlas, x / self.width as f32, y / self.height as f32, self.width),
            None => {
                let eye = self.scene.camera.position.as_dvec3();
                self.scene.camera.pixel(self.height) * position.as_dvec3().distance(eye)
            }
        }
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
