//! What no choice of patches, light or mode changes, made once for a scene: its rays, its surfaces, where they touch,
//! its normals.
//!
//! Not handled: patches; points ([`crate::surfaces::SurfacePoint`]); emitters by closed form, which
//! [`crate::direct::Luminaires`] finds.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use crate::rays::Rays;
use crate::scene::{Camera, Scene};
use crate::surfaces::atlas::Atlas;
use crate::surfaces::coplanar;
use crate::surfaces::coplanar::Surface;
use crate::surfaces::discontinuities::Discontinuities;
use crate::surfaces::face_means::FaceMeans;

/// A scene with its rays and surfaces; immutable, and shared by all that is made of it.
pub struct Geometry {
    /// The scene.
    pub scene: Scene,
    /// Its rays.
    pub rays: Arc<Rays>,
    /// Its surfaces.
    pub surfaces: Arc<Surfaces>,
    /// What pictures show in place of what the camera sees.
    pub(crate) atlas: Option<Arc<dyn Atlas>>,
}

impl Geometry {
    /// Builds the ray hierarchy of a scene and finds its surfaces.
    pub fn new(scene: Scene) -> Arc<Geometry> {
        let rays = Rays::new(&scene);
        let surfaces = Surfaces::new(&scene, &rays);
        Arc::new(Geometry { scene, rays: Arc::new(rays), surfaces: Arc::new(surfaces), atlas: None })
    }

    /// The same behind another camera: it shares rays and surfaces.
    pub fn seen_by(&self, camera: Camera) -> Arc<Geometry> {
        let Geometry { scene, rays, surfaces, .. } = self;
        let scene = Scene { camera, ..scene.clone() };
        Arc::new(Geometry { scene, rays: Arc::clone(rays), surfaces: Arc::clone(surfaces), atlas: None })
    }

    /// The same laid out as a map: it shares rays and surfaces.
    pub(crate) fn laid_out(&self, atlas: Arc<dyn Atlas>) -> Arc<Geometry> {
        let Geometry { scene, rays, surfaces, .. } = self;
        let (scene, rays, surfaces) = (scene.clone(), Arc::clone(rays), Arc::clone(surfaces));
        Arc::new(Geometry { scene, rays, surfaces, atlas: Some(atlas) })
    }
}

/// The surfaces of a scene.
#[derive(Debug)]
pub struct Surfaces {
    pub(crate) list: Vec<Surface>,
    /// Front unit normals of the faces.
    pub(crate) normals: Arc<[Vec3]>,
    pub(crate) discontinuities: Discontinuities,
    /// What whole faces with textures reflect and emit.
    pub(crate) means: FaceMeans,
}

impl Surfaces {
    /// Finds the surfaces of a scene, in about linear time.
    pub fn new(scene: &Scene, rays: &Rays) -> Surfaces {
        let list = coplanar::find(scene, rays);
        let faces = (0..scene.faces.len() as u32).into_par_iter();
        let normals: Vec<Vec3> = faces.map(|f| coplanar::normal(scene.corners(f)).as_vec3()).collect();
        Surfaces {
            discontinuities: Discontinuities::new(scene, list.len()),
            list,
            normals: normals.into(),
            means: FaceMeans::new(scene),
        }
    }
}
