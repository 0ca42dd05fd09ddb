//! What lies between two points, modelled no further than the scene and the two places need.

use glam::Vec3;

use crate::direct::light_cut::{Links, Maker};
use crate::direct::luminaire::{FEW, Luminaires};
use crate::direct::shaft_culling::{Shafts, casters};
use crate::light::Transport;
use crate::patches::Patches;
use crate::rays::{Hit, Rays};
use crate::scene::Scene;

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
    pub fn transmittance(
        &self,
        rays: &Rays,
        from: (Vec3, Option<u32>),
        to: (Vec3, Option<u32>),
        scratch: &mut Vec<Hit>,
    ) -> f32 {
        match self {
            Occlusion::Nothing => 1.0,
            Occlusion::Opaque => f32::from(rays.visible(from, to)),
            Occlusion::Partial(tau) => rays.transmittance(from, to, tau, scratch),
        }
    }
}

/// How patches see luminaires: what may lie between them at all, and what is known of each pair.
#[derive(Debug)]
pub struct Sight {
    /// What a ray between any two points meets.
    pub occlusion: Occlusion,
    /// What may lie between a patch and a luminaire.
    pub shafts: Shafts,
    /// Who lights each patch, where luminaires are many.
    pub links: Option<Links>,
}

impl Sight {
    /// Finds what may lie between every patch that `receives` and every luminaire.
    pub fn new(
        scene: &Scene,
        (rays, patches): (&Rays, &Patches),
        luminaires: &Luminaires,
        transports: &[Transport],
        receives: &[bool],
    ) -> Sight {
        let occlusion = Occlusion::new(rays, transports);
        let tau: Vec<f32> = transports.iter().map(|t| t.tau).collect();
        if luminaires.list.len() > FEW {
            return Sight::of_many(occlusion, scene, (rays, patches), luminaires, &tau, receives);
        }
        let shafts = match occlusion {
            Occlusion::Nothing => Shafts::default(),
            _ => Shafts::new(scene, (rays, patches), luminaires, &tau, receives),
        };
        Sight { occlusion, shafts, links: None }
    }

    /// Whether light at some receivers is closed form times a ratio of drawn points. The ratio of few points is biased.
    /// Links draw without a ratio, and have chosen how many: there one visibility ray for each draw is enough.
    pub fn takes_ratios(&self) -> bool {
        self.occlusion != Occlusion::Nothing && self.links.is_none() && !self.shafts.know_all()
    }

    /// Links in place of shafts to each luminaire.
    fn of_many(
        occlusion: Occlusion,
        scene: &Scene,
        (rays, patches): (&Rays, &Patches),
        luminaires: &Luminaires,
        tau: &[f32],
        receives: &[bool],
    ) -> Sight {
        let casters = match occlusion {
            Occlusion::Nothing => Vec::new(),
            _ => casters(scene, rays, luminaires, tau),
        };
        let maker = Maker { rays, patches, luminaires, occlusion: &occlusion, casters: &casters };
        let links = Some(Links::new(&maker, receives));
        Sight { occlusion, shafts: Shafts::casting(casters), links }
    }
}

impl From<Occlusion> for Sight {
    /// Nothing is known of any pair: points are drawn wherever something can occlude.
    fn from(occlusion: Occlusion) -> Sight {
        Sight { occlusion, shafts: Shafts::default(), links: None }
    }
}
