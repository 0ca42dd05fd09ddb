//! The luminaires and punctual lights of a scene under one choice of (alpha, tau), and the occluders between them and
//! the patches.
//!
//! Few luminaires are evaluated one by one, by closed form or with a ratio estimator
//! ([`crate::direct::luminaire_light`]); many through each patch's light cut ([`crate::direct::many::light_cut`]).
//!
//! Not handled: emitters that are no luminaires, whose light hemisphere rays sample.

use std::sync::Arc;

use crate::direct::emitters::luminaire_texture::{FEW_LUMINAIRES, TOLERABLE};
use crate::direct::emitters::luminaires::Luminaires;
use crate::direct::emitters::occlusion::Occlusion;
use crate::direct::emitters::shafts::{Shafts, casters};
use crate::direct::many::light_cut::{CutInputs, LightCuts};
use crate::light::{Rgb, Transport, nothing_passes};
use crate::patches::Patches;
use crate::scene::Emitters;
use crate::surfaces::Geometry;

/// The luminaires and punctual lights of a scene in one mode, and the occluders between them and the patches.
pub struct Lights {
    /// The scene, its rays and its surfaces.
    pub geometry: Arc<Geometry>,
    /// The patches that receive.
    pub patches: Arc<Patches>,
    /// Emitters by closed form.
    pub luminaires: Arc<Luminaires>,
    /// (alpha, tau) of every material.
    pub transports: Vec<Transport>,
    /// No surface lets light through.
    pub opaque: bool,
    /// Relative error of light that a node of many luminaires, or of a texture, may have.
    pub exactness: f64,
    /// Occlusion between any two points.
    pub(crate) occlusion: Occlusion,
    /// Occlusion of punctual lights.
    pub(crate) punctual: Occlusion,
    /// Occluders between a patch and a luminaire.
    pub(crate) shafts: Shafts,
    /// The light cuts of the patches for each emitter that has luminaires, where luminaires are many.
    pub(crate) cuts: Vec<LightCuts>,
}

impl Lights {
    /// Determines the occluders between every patch that reflects and every luminaire; `exactness` is the relative
    /// error that a node of many luminaires, or of a texture, may have.
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
            let mut emitters: Vec<usize> = luminaires.list.iter().map(|luminaire| luminaire.emitter).collect();
            emitters.sort_unstable();
            emitters.dedup();
            let cuts = emitters.into_iter().map(|emitter| {
                let inputs = CutInputs { rays, patches, luminaires, emitter, occlusion, casters: &casters, exactness };
                LightCuts::new(&inputs, &receives)
            });
            lights.cuts = cuts.collect();
            lights.shafts = Shafts::casting(casters);
        } else if *occlusion != Occlusion::Nothing {
            lights.shafts = Shafts::new(casters, patches, luminaires, &receives);
        }
        lights
    }

    /// Lights without shafts and cuts: luminaires are evaluated one by one, and points are drawn wherever something can
    /// occlude.
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
            opaque: nothing_passes(transports.iter().map(|t| t.tau)),
            transports,
            exactness: TOLERABLE,
            shafts: Shafts::default(),
            cuts: Vec::new(),
        }
    }

    /// These lights behind another model of occlusion, without shafts and cuts.
    pub fn occluded_by(self, occlusion: Occlusion) -> Lights {
        Lights { punctual: occlusion.clone(), occlusion, shafts: Shafts::default(), cuts: Vec::new(), ..self }
    }

    /// The emitters whose light is kept apart.
    pub fn emitters(&self) -> &Emitters {
        &self.luminaires.emitters
    }

    /// Visibility rays for each receiver and luminaire in a mean over few receivers: 4 for the ratio estimator, whose
    /// bias falls with them. Light cuts have no ratio, and their own number of draws.
    pub fn visibility_rays(&self) -> u32 {
        let takes_ratios = self.cuts.is_empty() && self.occlusion != Occlusion::Nothing && !self.shafts.know_all();
        if takes_ratios { 4 } else { 1 }
    }

    /// Points of the unit square that one receiver uses at most for `rays` visibility rays.
    pub fn points(&self, rays: u32) -> u32 {
        if self.cuts.is_empty() { rays } else { rays * LightCuts::MOST_DRAWN }
    }

    /// Relative error that nodes of many luminaires may have; 0 where there are none.
    pub fn stand_ins(&self) -> f64 {
        if self.cuts.is_empty() { 0.0 } else { self.exactness }
    }
}
