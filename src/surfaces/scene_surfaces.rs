//! What cutting needs to know of a scene and does not depend on the patches: its surfaces, where they touch, its
//! normals.
//!
//! Made once for a scene; all cuts share it.
//!
//! Not handled: patches, which are cut from surfaces.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use crate::rays::Rays;
use crate::scene::Scene;
use crate::surfaces::coplanar;
use crate::surfaces::coplanar::Surface;
use crate::surfaces::discontinuities::Discontinuities;
use crate::surfaces::face_means::FaceMeans;

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
    pub fn new(scene: &Scene, rays: &Rays) -> Arc<Surfaces> {
        let list = coplanar::find(scene, rays);
        let faces = (0..scene.faces.len() as u32).into_par_iter();
        let normals: Vec<Vec3> = faces.map(|f| coplanar::normal(scene.corners(f)).as_vec3()).collect();
        Arc::new(Surfaces {
            discontinuities: Discontinuities::new(scene, list.len()),
            list,
            normals: normals.into(),
            means: FaceMeans::new(scene),
        })
    }
}
