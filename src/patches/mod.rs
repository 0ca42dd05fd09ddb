//! Patches: the pieces of surface that carry one value of `L` each.
//!
//! Patch count is decoupled from triangle count. Faces that lie in one plane, touch and share a material form a
//! *surface*; a surface larger than the target size carries a rectangular grid of patches found from the point's
//! (u, v) in the plane, and small surfaces of one material with near-equal normals that lie close together share one
//! patch. Cells are cut further along lines where other faces touch the surface. Rays see only the faces as loaded;
//! [`Patches::at`] tells which patch a hit belongs to. A two-sided face has a patch on either side.
//!
//! Areas are in unit coordinates squared. Invariants: the patches' areas of one side sum to the faces' area; every
//! point of every face belongs to exactly one patch per reflecting side; numbering depends on the scene only.
//!
//! Patches have one size over the scene, or one for each of its zones ([`Zones`]). Not handled: which size light asks for.

pub(crate) mod adjacency;
pub(crate) mod clip;
pub(crate) mod clusters;
pub(crate) mod grid;
pub(crate) mod grid_adjacency;
pub(crate) mod hierarchy;
pub(crate) mod meshing;
pub(crate) mod regression_tree;
pub(crate) mod subdivision;
pub(crate) mod tiles;
pub(crate) mod zones;

pub use adjacency::Neighbours;
pub use regression_tree::Sample;
pub use zones::Zones;

use std::sync::Arc;

use glam::Vec3;

use crate::patches::grid::Grid;
use crate::patches::subdivision::Parts;
use crate::patches::tiles::Tiling;
use crate::rays::Side;
use crate::rays::warp::triangle_point;

/// No patch: the black back of a one-sided face.
const NONE: u32 = u32::MAX;

/// What the area of a patch without chosen points counts beside those that have some: next to nothing, but more than none.
const UNSEEN: f64 = 1e-6;

/// A piece of one face that belongs to a patch.
#[derive(Clone, Copy, Debug)]
struct Fragment {
    corners: [Vec3; 3],
    face: u32,
    /// Areas of the patch's fragments up to and including this one, divided by the patch's area.
    share: f32,
}

/// A point on a patch.
#[derive(Clone, Copy, Debug)]
pub struct PatchPoint {
    /// Unit coordinates.
    pub position: Vec3,
    /// Unit normal of the side the patch lies on.
    pub normal: Vec3,
    /// The face the point lies on.
    pub face: u32,
}

/// How a face's hits find their patch.
#[derive(Clone, Copy, Debug)]
enum Owner {
    Patch(u32),
    Grid(u32),
    Tiling(u32),
}

/// All patches of a scene.
#[derive(Debug)]
pub struct Patches {
    areas: Vec<f64>,
    materials: Vec<u32>,
    sides: Vec<Side>,
    /// Fragments of patch i: `starts[i]..starts[i + 1]`.
    starts: Vec<u32>,
    fragments: Vec<Fragment>,
    owners: Vec<Owner>,
    grids: Vec<Grid>,
    tilings: Vec<Tiling>,
    /// About the size of the largest patches, unit coordinates.
    size: f64,
    /// The larger patch that each would be part of at twice the size, by any number.
    parents: Vec<u32>,
    /// The patch behind a front patch, or NONE.
    backs: Vec<u32>,
    /// Front unit normals of the faces.
    normals: Arc<[Vec3]>,
    /// Points that the rays of a patch start from, where they are chosen; empty where they are uniform over it.
    starts_of_rays: Vec<Vec<PatchPoint>>,
    /// Patches that are divided further.
    parts: Parts,
}

impl Patches {
    /// Number of patches.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Never true for a checked scene; here because a collection with `len` should have it.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// `A_i` of every patch, unit coordinates squared.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Material index of every patch.
    pub fn materials(&self) -> &[u32] {
        &self.materials
    }

    /// For every patch the number of the larger patch that it is part of, about four to one.
    ///
    /// Patches along lines of contact are their own, and so are surfaces of a single patch.
    pub fn parents(&self) -> &[u32] {
        &self.parents
    }

    /// Which patches lie beside each other.
    pub fn neighbours(&self) -> Neighbours {
        Neighbours::new(self)
    }

    /// The patch that a point of a face's side belongs to; `None` on the black back of a one-sided face.
    #[inline]
    pub fn at(&self, face: u32, side: Side, position: Vec3) -> Option<u32> {
        let front = match self.owners[face as usize] {
            Owner::Patch(patch) => patch,
            Owner::Grid(grid) => self.grids[grid as usize].patch(position),
            Owner::Tiling(tiling) => {
                let grid = self.tilings[tiling as usize].grid(position);
                self.grids[grid as usize].patch(position)
            }
        };
        let patch = match side {
            Side::Front => front,
            Side::Back => self.backs[front as usize],
        };
        if patch == NONE {
            return None;
        }
        Some(self.parts.at(patch, position, self.normal(face, side)))
    }

    /// The patch that the front of a face is part of, where it is one patch only.
    fn of_face(&self, face: u32) -> Option<u32> {
        match self.owners[face as usize] {
            Owner::Patch(patch) => Some(patch),
            _ => None,
        }
    }

    /// About the size of the largest patches, unit coordinates.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Unit normal of a face's side.
    #[inline]
    pub fn normal(&self, face: u32, side: Side) -> Vec3 {
        let normal = self.normals[face as usize];
        match side {
            Side::Front => normal,
            Side::Back => -normal,
        }
    }

    /// Has the rays of patches start from some of their points only: a patch then stands for those, as for what a picture sees of it.
    ///
    /// Patches without such points keep uniform ones.
    pub fn start_from(&mut self, starts: Vec<Vec<PatchPoint>>) {
        self.starts_of_rays = starts;
    }

    /// What a patch counts when the light of several is averaged: its area, or its chosen points where there are any.
    pub fn weights(&self) -> Vec<f64> {
        let chosen = |i: usize| self.chosen(i).len() as f64 + UNSEEN * self.areas[i];
        match self.starts_of_rays.is_empty() {
            true => self.areas.clone(),
            false => (0..self.len()).map(chosen).collect(),
        }
    }

    /// The points that stand for patch i, if some were chosen.
    pub fn chosen(&self, i: usize) -> &[PatchPoint] {
        self.starts_of_rays.get(i).map_or(&[], |own| own)
    }

    /// The point of patch `i` at (u, v) in the unit square; uniform over the patch, or over its chosen points, for uniform (u, v).
    pub fn point(&self, i: usize, u: f32, v: f32) -> PatchPoint {
        let chosen = self.chosen(i);
        if !chosen.is_empty() {
            return chosen[((u * chosen.len() as f32) as usize).min(chosen.len() - 1)];
        }
        let whole = self.parts.whole(i);
        let own = &self.fragments[self.starts[whole] as usize..self.starts[whole + 1] as usize];
        let k = own.partition_point(|f| f.share <= u).min(own.len() - 1);
        let before = if k == 0 { 0.0 } else { own[k - 1].share };
        // Stretch u over the chosen fragment, so that one stratified number serves twice.
        let u = ((u - before) / (own[k].share - before)).clamp(0.0, 0.999_999_94);
        let face = own[k].face;
        PatchPoint { position: triangle_point(own[k].corners, u, v), normal: self.normal(face, self.sides[i]), face }
    }

    /// The triangles a patch consists of, with the face each is a part of.
    pub fn pieces(&self, i: usize) -> impl Iterator<Item = (u32, [Vec3; 3])> {
        let whole = self.parts.whole(i);
        let range = self.starts[whole] as usize..self.starts[whole + 1] as usize;
        self.fragments[range].iter().map(|f| (f.face, f.corners))
    }

    /// Which side of its faces a patch lies on.
    pub fn side(&self, i: usize) -> Side {
        self.sides[i]
    }
}
