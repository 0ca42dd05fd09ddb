//! What patches are made of: pieces of faces.
//!
//! Not handled: which pieces belong together; [`crate::patches::grid`] and [`crate::patches::clusters`] tell.

use glam::Vec3;

/// No patch: the black back of a one-sided face.
pub(crate) const NONE: u32 = u32::MAX;

/// A patch before numbering: its material and the pieces of faces it consists of.
pub(crate) struct Draft {
    pub material: u32,
    pub pieces: Vec<Piece>,
}

/// A triangle cut from a face, and its area.
pub(crate) struct Piece {
    pub face: u32,
    pub corners: [Vec3; 3],
    pub area: f64,
}

/// A piece of one face that belongs to a patch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fragment {
    pub corners: [Vec3; 3],
    pub face: u32,
    /// Areas of the patch's fragments up to and including this one, divided by the patch's area.
    pub share: f32,
}
