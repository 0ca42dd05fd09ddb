//! What the gather pass looks at: a scene made ready, and the size of the picture.
//!
//! Not handled: the light that is gathered; that is [`crate::gather::Fields`].

use crate::direct::{Lighting, Luminaires, Sight};
use crate::light::Transport;
use crate::patches::Patches;
use crate::rays::Rays;
use crate::scene::Scene;

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
}
