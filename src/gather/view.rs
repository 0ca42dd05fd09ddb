//! What the gather pass looks at: a scene made ready, and the size of the picture.
//!
//! Not handled: the light that is gathered; that is [`crate::gather::Fields`].

use glam::Vec3;

use crate::direct::{Lighting, Luminaires, Sight};
use crate::light::Transport;
use crate::patches::Patches;
use crate::rays::{Hit, Ray, Rays, Side};
use crate::scene::Scene;
use crate::surfaces::SurfacePoint;

/// What the camera looks at.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// The scene, with its camera.
    pub scene: &'a Scene,
    /// Its rays.
    pub rays: &'a Rays,
    /// Its patches.
    pub patches: &'a Patches,
    /// Emitters evaluated by closed form.
    pub luminaires: &'a Luminaires,
    /// What lies between patches and luminaires.
    pub sight: &'a Sight,
    /// (alpha, tau) of every material.
    pub transports: &'a [Transport],
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

impl<'a> View<'a> {
    /// What lights the scene.
    pub fn lighting(&self) -> Lighting<'a> {
        Lighting { rays: self.rays, luminaires: self.luminaires, sight: self.sight }
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

/// A built-in scene made ready for tests: what a [`View`] borrows.
#[cfg(test)]
pub(crate) struct Ready {
    scene: Scene,
    rays: Rays,
    patches: Patches,
    transports: Vec<Transport>,
    luminaires: Luminaires,
    sight: Sight,
}

#[cfg(test)]
impl Ready {
    /// A scene on some number of patches, all of which receive light.
    pub(crate) fn new(scene: &str, transport: Transport, patches: usize) -> Ready {
        let scene = Scene::open(scene).expect("a built-in scene");
        let rays = Rays::new(&scene);
        let patches = Patches::new(&scene, &rays, patches);
        let transports = scene.transports(transport);
        let luminaires = Luminaires::new(&scene);
        let receives = vec![true; patches.len()];
        let sight = Sight::new(&scene, &rays, &patches, &luminaires, &transports, &receives);
        Ready { scene, rays, patches, transports, luminaires, sight }
    }

    /// So many pixels of it, across and down.
    pub(crate) fn view(&self, width: usize, height: usize) -> View<'_> {
        let Ready { scene, rays, patches, transports, luminaires, sight } = self;
        View { scene, rays, patches, luminaires, sight, transports, width, height }
    }
}
