//! Patches: the pieces of surface that carry one value of `L` each.
//!
//! Patch count is decoupled from triangle count. Faces that lie in one plane, touch and share a material form a
//! *surface*; a surface larger than the target size carries a rectangular grid of patches found from the point's
//! (u, v) in the plane, and small surfaces of one material with near-equal normals that lie close together share one
//! patch. Cells are cut further along lines where other faces touch the surface. Rays see only the faces as loaded;
//! [`Patches::at`] finds the patch that a hit belongs to. A two-sided face has a patch on either side.
//!
//! Patches have one size over the scene, until they are divided by light. Not handled: which size the light requires.

pub(crate) mod adjacency;
pub(crate) mod division;
pub mod grid;
pub(crate) mod meshing;
pub(crate) mod scene_patches;
pub(crate) mod spots;
pub(crate) mod stratified;

pub use adjacency::Neighbours;
pub use division::Sample;
pub use scene_patches::{Owner, Patches};
pub use spots::Spot;
