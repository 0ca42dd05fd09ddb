//! Walks of light from what emits through a scene, without patches and so without bias.
//!
//! The ray of a walk crosses surfaces c = 1, 2, ...; s_c is the product of tau before c. With W the power that the walk
//! carries, per channel, the visible half of crossing c reflects `W s_c rho_c`, and `W s_c rho_c alpha_c` goes on. A
//! walk continues from one crossing, drawn in proportion to what goes on there, with its weight over that probability
//! (J. Arvo, D. Kirk, *Particle transport and image synthesis*, 1990).
//!
//! Not handled: highlights, which reflect light only towards the camera.

use glam::{DVec3, Vec3};

use crate::error::walk_sources::{WalkSources, leave};
use crate::light::{Transport, nothing_passes};
use crate::rays::sobol::Stream;
use crate::rays::{Hit, Ray, Rays, Side};
use crate::scene::{Emitters, Scene, Sides};

/// A surface that a walk meets.
pub(crate) struct Met {
    pub position: Vec3,
    pub face: u32,
    pub side: Side,
    /// What of the walk the visible half reflects there, W.
    pub reflected: DVec3,
    /// What the walk carries, channels added, W.
    pub carried: f64,
}

/// What goes on from a surface.
#[derive(Clone, Copy)]
pub(crate) struct Leaving {
    position: Vec3,
    face: u32,
    side: Side,
    /// W, per channel.
    pub power: DVec3,
}

impl Leaving {
    /// The same with its power times a weight, 1 over the probability that it was drawn with.
    pub(crate) fn scaled(self, weight: f64) -> Leaving {
        Leaving { power: weight * self.power, ..self }
    }

    /// Power of all channels.
    pub(crate) fn total(&self) -> f64 {
        self.power.element_sum()
    }
}

/// All walks of a scene in one mode.
pub(crate) struct Walks<'a> {
    scene: &'a Scene,
    rays: &'a Rays,
    transports: Vec<Transport>,
    pub sources: WalkSources<'a>,
    opaque: bool,
}

impl<'a> Walks<'a> {
    /// Walks from all that emits.
    pub(crate) fn new(scene: &'a Scene, rays: &'a Rays, transport: Transport, emitters: &Emitters) -> Walks<'a> {
        let transports = scene.transports(transport);
        let opaque = nothing_passes(transports.iter().map(|t| t.tau));
        Walks { scene, rays, transports, sources: WalkSources::new(scene, emitters), opaque }
    }

    /// A ray that leaves a surface.
    pub(crate) fn leave(&self, from: &Leaving, random: &mut Stream) -> Ray {
        leave(self.scene, from.position, from.face, from.side, random)
    }

    /// Follows one walk through at most so many `terms`; `meet` is given what it reflects at each surface it crosses.
    /// Where it would carry less it ends by chance and carries as much.
    pub(crate) fn follow(&self, random: &mut Stream, terms: usize, hits: &mut Vec<Hit>, mut meet: impl FnMut(&Met)) {
        let Some(start) = self.sources.start(random) else { return };
        let (mut ray, mut carried) = (start.ray, None);
        for _ in 0..terms {
            let weight = |hit: &Hit| carried.unwrap_or_else(|| start.power(f64::from(hit.t)));
            let (mut arrived, mut total) = (0.0_f64, 0.0);
            let mut next: Option<Leaving> = None;
            self.cross(&ray, hits, weight, |hit, reflected, leaving| {
                let carried = weight(hit).element_sum();
                arrived = arrived.max(carried);
                let Leaving { position, face, side, .. } = leaving;
                meet(&Met { position, face, side, reflected, carried });
                // Reservoir sampling of one crossing.
                let share = leaving.total();
                total += share;
                if share > 0.0 && (total == share || f64::from(random.uniform()) * total < share) {
                    next = Some(leaving);
                }
            });
            let Some(next) = next else { return };
            let passed = next.scaled(total / next.total());
            let survival = (passed.total() / arrived).min(1.0);
            if f64::from(random.uniform()) >= survival {
                return;
            }
            ray = self.leave(&passed, random);
            carried = Some(passed.power / survival);
        }
    }

    /// Calls `add` with each surface that a ray crosses, what of its `weight` is reflected there and what goes on.
    pub(crate) fn cross(
        &self,
        ray: &Ray,
        hits: &mut Vec<Hit>,
        weight: impl Fn(&Hit) -> DVec3,
        mut add: impl FnMut(&Hit, DVec3, Leaving),
    ) {
        self.rays.light_crossings(ray, self.opaque, hits);
        let tau = |m: usize| f64::from(self.transports[m].tau);
        self.rays.transmit(hits, tau, |hit, through: f64| {
            let (rho, own) = self.reflects(ray, hit);
            let reflected = weight(hit) * through * rho;
            let (position, power) = (ray.at(hit.t), reflected * f64::from(own.alpha));
            add(hit, reflected, Leaving { position, face: hit.face, side: hit.side, power });
        });
    }

    /// rho of the side met, black on the back of a one-sided face, and the (alpha, tau) of its material.
    fn reflects(&self, ray: &Ray, hit: &Hit) -> (DVec3, Transport) {
        let material = self.scene.material(hit.face);
        let own = self.transports[self.scene.faces[hit.face as usize].material as usize];
        let lit = hit.side == Side::Front || material.sides == Sides::Two;
        let rho = || self.scene.rho_at(hit.face, ray.at(hit.t)).as_dvec3();
        (if lit { rho() } else { DVec3::ZERO }, own)
    }
}
