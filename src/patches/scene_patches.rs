//! All patches of a scene: their areas, where the hits of a face find theirs, and points on them.
//!
//! Areas are in unit coordinates squared. Invariants: the patches' areas of one side sum to the faces' area, but for
//! what masks cut away; every
//! point of every face belongs to exactly one patch per reflecting side; numbering depends on the scene only.
//!
//! Not handled: how surfaces are cut; that is [`crate::patches::meshing`].

use std::sync::Arc;

use glam::Vec3;

use crate::patches::grid::Grid;
use crate::patches::parts::Parts;
use crate::patches::pieces::{Fragment, NONE};
use crate::rays::warp::triangle_point;
use crate::rays::{Hit, Ray, Side};
use crate::scene::Means;
use crate::surfaces::SurfacePoint;

/// What the area of a patch without chosen points counts beside those that have some: next to nothing, but more than
/// none.
const UNSEEN: f64 = 1e-6;

/// How a face's hits find their patch.
#[derive(Clone, Copy, Debug)]
pub(super) enum Owner {
    Patch(u32),
    Grid(u32),
}

/// All patches of a scene.
#[derive(Clone, Debug)]
pub struct Patches {
    pub(super) areas: Vec<f64>,
    pub(super) materials: Vec<u32>,
    pub(super) sides: Vec<Side>,
    /// Fragments of patch i: `starts[i]..starts[i + 1]`.
    pub(super) starts: Vec<u32>,
    pub(super) fragments: Vec<Fragment>,
    pub(super) owners: Vec<Owner>,
    pub(super) grids: Vec<Grid>,
    /// About the size of the largest patches, unit coordinates.
    pub(super) size: f64,
    /// The larger patch that each would be part of at twice the size, by any number.
    pub(super) parents: Vec<u32>,
    /// The patch behind a front patch, or NONE.
    pub(super) backs: Vec<u32>,
    /// Front unit normals of the faces.
    pub(super) normals: Arc<[Vec3]>,
    /// Points that the rays of a patch start from, where they are chosen; empty where they are uniform over it.
    pub(super) starts_of_rays: Vec<Vec<SurfacePoint>>,
    /// Patches that are divided further.
    pub(super) parts: Parts,
    /// What each patch with textures reflects and emits; empty where no material has textures.
    pub(super) means: Vec<Option<Means>>,
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

    /// The patch that a point of a face's side belongs to; `None` on the black back of a one-sided face.
    #[inline]
    pub fn at(&self, face: u32, side: Side, position: Vec3) -> Option<u32> {
        let front = match self.owners[face as usize] {
            Owner::Patch(patch) => patch,
            Owner::Grid(grid) => self.grids[grid as usize].patch(position),
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

    /// The patch that a ray meets in a crossing; `None` on the black back of a one-sided face.
    #[inline]
    pub fn met(&self, ray: &Ray, hit: &Hit) -> Option<u32> {
        self.at(hit.face, hit.side, ray.at(hit.t))
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

    /// Has the rays of patches start from some of their points only: a patch then stands for those, as for what a
    /// picture sees of it.
    ///
    /// Patches without such points keep uniform ones.
    pub fn start_from(&mut self, starts: Vec<Vec<SurfacePoint>>) {
        self.starts_of_rays = starts;
    }

    /// What a patch counts when the light of several is averaged: its area, or its chosen points where there are any.
    pub fn weights(&self) -> Vec<f64> {
        let chosen = |i: usize| self.chosen(i).len() as f64 + UNSEEN * self.areas[i];
        if self.starts_of_rays.is_empty() { self.areas.clone() } else { (0..self.len()).map(chosen).collect() }
    }

    /// The points that stand for patch i, if some were chosen.
    pub fn chosen(&self, i: usize) -> &[SurfacePoint] {
        self.starts_of_rays.get(i).map_or(&[], |own| own)
    }

    /// The point of patch `i` at (u, v) in the unit square; uniform over the patch, or over its chosen points, for
    /// uniform (u, v).
    pub fn point(&self, i: usize, u: f32, v: f32) -> SurfacePoint {
        let chosen = self.chosen(i);
        if !chosen.is_empty() {
            return chosen[((u * chosen.len() as f32) as usize).min(chosen.len() - 1)];
        }
        self.cut_point(i, u, v)
    }

    /// The point at (u, v) in the unit square of patch `i` as it was cut, chosen points or none; uniform over it for
    /// uniform (u, v).
    pub(crate) fn cut_point(&self, i: usize, u: f32, v: f32) -> SurfacePoint {
        let whole = self.parts.whole(i);
        let own = &self.fragments[self.starts[whole] as usize..self.starts[whole + 1] as usize];
        let k = own.partition_point(|f| f.share <= u).min(own.len() - 1);
        let before = if k == 0 { 0.0 } else { own[k - 1].share };
        // Stretch u over the chosen fragment, so that one stratified number serves twice.
        let u = ((u - before) / (own[k].share - before)).clamp(0.0, 0.999_999_94);
        let face = own[k].face;
        SurfacePoint { position: triangle_point(own[k].corners, u, v), normal: self.normal(face, self.sides[i]), face }
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
