//! How much finer than patches the light of charts is kept, and in which planes small faces have charts of their own.
//!
//! Not handled: where that is worth it ([`crate::refining`]).

use std::collections::BTreeMap;

use glam::Vec3;

/// Faces of a cluster that lie in one plane and have a chart there.
#[derive(Clone)]
pub(super) struct Plane {
    pub faces: Vec<u32>,
    pub patch: u32,
    pub origin: Vec3,
    /// Both sides of the rectangle around the faces.
    pub sides: [Vec3; 2],
    pub columns: usize,
    pub rows: usize,
}

/// How much finer than patches the light of charts is kept.
#[derive(Clone, Default)]
pub(super) struct Finer {
    /// By grid, cells to a side of a patch's; those not named have one.
    pub grids: BTreeMap<usize, usize>,
    pub planes: Vec<Plane>,
}
