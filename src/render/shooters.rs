//! Shooters of a prepared scene: the assembled one from a mode's K, the matrix-free one from the scene itself.

use crate::light::Transport;
use crate::render::assembly::{Assembled, Prepared};
use crate::solve::{AssembledShooter, RaySettings, RayShooter};

/// Shoots over the K of one mode.
pub fn assembled_shooter(mode: &Assembled) -> AssembledShooter<'_> {
    AssembledShooter::new(&mode.operator)
}

/// Shoots rays under one mode; no F is made. Evaluates light as emitted, if by closed form.
pub fn ray_shooter(p: &Prepared, mode: Transport, settings: RaySettings) -> RayShooter<'_> {
    RayShooter::new(&p.scene, &p.rays, &p.patches, &p.luminaires, &p.scene.transports(mode), settings)
}
