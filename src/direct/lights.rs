//! What lights a scene under one choice of (alpha, tau): luminaires, lights without area, and what lies between them
//! and the patches.
//!
//! Few luminaires are evaluated one by one, by closed form or with a ratio estimator
//! ([`crate::direct::luminaire_light`]); many through each patch's light cut ([`crate::direct::many::light_cut`]).
//!
//! Not handled: emitters that are no luminaires; hemisphere rays find those.

use std::sync::Arc;

use crate::direct::emitters::luminaire_texture::FEW_LUMINAIRES;
use crate::direct::emitters::luminaires::Luminaires;
use crate::direct::emitters::occlusion::Occlusion;
use crate::direct::emitters::shafts::{Shafts, casters};
use crate::direct::many::light_cut::{CutInputs, LightCuts};
use crate::light::{Rgb, Transport};
use crate::patches::Patches;
use crate::surfaces::Geometry;

/// What lights a scene in one mode, and what lies between lights and patches.
pub struct Lights {
    /// The scene, its rays and its surfaces.
    pub geometry: Arc<Geometry>,
    /// The patches that receive.
    pub patches: Arc<Patches>,
    /// Emitters by closed form.
    pub luminaires: Arc<Luminaires>,
    /// (alpha, tau) of every material.
    pub transports: Vec<Transport>,
    /// Share of its light that what stands for many luminaires, or for a texture, may be off by.
    pub exactness: f64,
    /// What a ray between any two points meets.
    pub(crate) occlusion: Occlusion,
    /// What a ray to a light without area meets.
    pub(crate) punctual: Occlusion,
    /// What may lie between a patch and a luminaire.
    pub(crate) shafts: Shafts,
    /// Who lights each patch, where luminaires are many.
    pub(crate) cuts: Option<LightCuts>,
}

impl Lights {
    /// Finds what may lie between every patch that reflects and every luminaire; `exactness` is the share of its light
    /// that what stands for many luminaires, or for a texture, may be off by.
    pub fn new(
        geometry: &Arc<Geometry>,
        patches: &Arc<Patches>,
        luminaires: &Arc<Luminaires>,
        transports: Vec<Transport>,
        exactness: f64,
    ) -> Lights {
        let mut lights = Lights { exactness, ..Lights::by_rays(geometry, patches, luminaires, transports) };
        let Geometry { scene, rays, .. } = &**geometry;
        let reflects = |&m: &u32| scene.materials[m as usize].rho != Rgb::ZERO;
        let receives: Vec<bool> = patches.materials().iter().map(reflects).collect();
        let occlusion = &lights.occlusion;
        let tau: Vec<f32> = lights.transports.iter().map(|t| t.tau).collect();
        let casters =
            if *occlusion == Occlusion::Nothing { Vec::new() } else { casters(scene, rays, luminaires, &tau) };
        if luminaires.list.len() > FEW_LUMINAIRES {
            let inputs = CutInputs { rays, patches, luminaires, occlusion, casters: &casters, exactness };
            lights.cuts = Some(LightCuts::new(&inputs, &receives));
            lights.shafts = Shafts::casting(casters);
        } else if *occlusion != Occlusion::Nothing {
            lights.shafts = Shafts::new(casters, patches, luminaires, &receives);
        }
        lights
    }

    /// The same with nothing known of any pair: luminaires are evaluated one by one, and points are drawn wherever
    /// something can occlude.
    pub fn by_rays(
        geometry: &Arc<Geometry>,
        patches: &Arc<Patches>,
        luminaires: &Arc<Luminaires>,
        transports: Vec<Transport>,
    ) -> Lights {
        let Geometry { scene, rays, .. } = &**geometry;
        Lights {
            occlusion: Occlusion::new(rays, &transports),
            punctual: Occlusion::of_punctual(scene, rays, &transports, &luminaires.punctual),
            geometry: Arc::clone(geometry),
            patches: Arc::clone(patches),
            luminaires: Arc::clone(luminaires),
            transports,
            exactness: crate::direct::emitters::luminaire_texture::TOLERABLE,
            shafts: Shafts::default(),
            cuts: None,
        }
    }

    /// Models what lies between two points by this in place of the least that the scene needs, and knows of no pair.
    pub fn occluded_by(self, occlusion: Occlusion) -> Lights {
        Lights { punctual: occlusion.clone(), occlusion, shafts: Shafts::default(), cuts: None, ..self }
    }

    /// Visibility rays for each receiver and luminaire that a mean over few receivers takes: the ratio of few drawn
    /// points is biased. Light cuts draw without a ratio, and have chosen how many.
    pub fn visibility_rays(&self) -> u32 {
        let takes_ratios = self.cuts.is_none() && self.occlusion != Occlusion::Nothing && !self.shafts.know_all();
        if takes_ratios { 4 } else { 1 }
    }

    /// Points of the unit square that one receiver uses at most for `rays` visibility rays.
    pub fn points(&self, rays: u32) -> u32 {
        rays * self.cuts.as_ref().map_or(1, |_| LightCuts::MOST_DRAWN)
    }

    /// Share of the light that stand-ins for many luminaires may be off by; 0 where there are none.
    pub fn stand_ins(&self) -> f64 {
        if self.cuts.is_some() { self.exactness } else { 0.0 }
    }
}
