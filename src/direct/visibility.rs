//! How patches see luminaires: shafts to each where they are few, light cuts where they are many.
//!
//! Not handled: what lies between two points at all, which is [`Occlusion`]'s.

use crate::direct::cut_refinement::CutInputs;
use crate::direct::light_cut::LightCuts;
use crate::direct::luminaire::Luminaires;
use crate::direct::luminaire_parts::FEW;
use crate::direct::occlusion::Occlusion;
use crate::direct::shaft_culling::{Shafts, casters};
use crate::light::Transport;
use crate::patches::Patches;
use crate::rays::Rays;
use crate::scene::Scene;

/// How patches see luminaires: what may lie between them at all, and what is known of each pair.
#[derive(Debug)]
pub struct Sight {
    /// What a ray between any two points meets.
    pub occlusion: Occlusion,
    /// What a ray to a light without area meets.
    pub punctual: Occlusion,
    /// What may lie between a patch and a luminaire.
    pub shafts: Shafts,
    /// Who lights each patch, where luminaires are many.
    pub cuts: Option<LightCuts>,
}

/// What lights a scene, and what lies between.
#[derive(Clone, Copy)]
pub struct Lighting<'a> {
    /// The scene's rays.
    pub rays: &'a Rays,
    /// Emitters by closed form.
    pub luminaires: &'a Luminaires,
    /// What lies between patches and luminaires.
    pub sight: &'a Sight,
}

impl Sight {
    /// Finds what may lie between every patch that `receives` and every luminaire.
    pub fn new(
        scene: &Scene,
        rays: &Rays,
        patches: &Patches,
        luminaires: &Luminaires,
        transports: &[Transport],
        receives: &[bool],
    ) -> Sight {
        let occlusion = Occlusion::new(rays, transports);
        let punctual = Occlusion::of_punctual(scene, rays, transports, &luminaires.punctual);
        let tau: Vec<f32> = transports.iter().map(|t| t.tau).collect();
        let casters = if occlusion == Occlusion::Nothing { Vec::new() } else { casters(scene, rays, luminaires, &tau) };
        if luminaires.list.len() > FEW {
            let inputs = CutInputs { rays, patches, luminaires, occlusion: &occlusion, casters: &casters };
            let cuts = Some(LightCuts::new(&inputs, receives));
            return Sight { occlusion, punctual, shafts: Shafts::casting(casters), cuts };
        }
        let shafts = match occlusion {
            Occlusion::Nothing => Shafts::default(),
            _ => Shafts::new(casters, patches, luminaires, receives),
        };
        Sight { occlusion, punctual, shafts, cuts: None }
    }

    /// Whether light at some receivers is closed form times a ratio of drawn points. The ratio of few points is biased.
    /// Light cuts draw without a ratio, and have chosen how many: there one visibility ray for each draw is enough.
    pub fn takes_ratios(&self) -> bool {
        self.cuts.is_none() && self.occlusion != Occlusion::Nothing && !self.shafts.know_all()
    }
}

impl From<Occlusion> for Sight {
    /// Nothing is known of any pair: points are drawn wherever something can occlude. Lights without area are taken to
    /// lie within the scene.
    fn from(occlusion: Occlusion) -> Sight {
        Sight { punctual: occlusion.clone(), occlusion, shafts: Shafts::default(), cuts: None }
    }
}
