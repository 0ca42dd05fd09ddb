//! A bounding volume hierarchy over many faces, and the three ways to walk it.
//!
//! Boxes are padded by 1e-5 of the scene's diagonal. Otherwise the boxes of axis-aligned meshes are flat and
//! degenerate, and rounding in the box test could cull what the watertight triangle test would accept.
//!
//! A habit of the hierarchy is worked around here. It culls every box left before t = 1e-4, which loses hits
//! near edges: its ray therefore starts [`HEAD_START`] behind the true one.

use std::time::Duration;

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray as BoxRay, RayHit};

use super::Hit;
use super::tree::{Label, Query, SAME_PLACE, hit, precedes};
use super::triangle::{Meeting, Triangle};

/// How far behind the true origin the box tests begin; more than the hierarchy's own 1e-4.
const HEAD_START: f32 = 2.5e-4;

/// A hierarchy; triangles and labels stand in the order of its leaves.
pub(super) struct Many {
    bvh: CwBvh,
    triangles: Vec<Triangle>,
    labels: Vec<Label>,
}

impl Many {
    /// The hierarchy over faces and their padded boxes.
    pub(super) fn new(faces: &[(Triangle, Label)], boxes: &[Aabb]) -> Self {
        let bvh = build_cwbvh(boxes, build_parameters(), &mut Duration::default());
        let order = bvh.primitive_indices.iter().map(|&i| faces[i as usize]);
        let (triangles, labels) = order.unzip();
        Many {
            bvh,
            triangles,
            labels,
        }
    }

    /// The first meeting.
    #[inline]
    pub(super) fn closest(&self, query: &Query) -> Option<Hit> {
        let mut best: Option<(Meeting, Label)> = None;
        let mut reach = query.end;
        self.bvh
            .ray_traverse(boxes(query), &mut RayHit::none(), |_, leaf| {
                if let Some(found) = self.candidate(query, leaf, reach)
                    && best.as_ref().is_none_or(|best| precedes(&found, best))
                {
                    let t = found.0.t;
                    reach = t + SAME_PLACE;
                    best = Some(found);
                    return t + HEAD_START;
                }
                f32::INFINITY
            });
        best.map(|(meeting, label)| hit(&meeting, &label))
    }

    /// Whether there is no meeting at all.
    #[inline]
    pub(super) fn is_clear(&self, query: &Query) -> bool {
        self.bvh.ray_traverse_miss(boxes(query), |_, leaf| {
            match self.candidate(query, leaf, query.end) {
                Some(_) => 0.0,
                None => f32::INFINITY,
            }
        })
    }

    /// Every meeting, in no order, edges counted once for each face, appended to `out`; or false as soon as an opaque face is met.
    #[inline]
    pub(super) fn all_unless(
        &self,
        opaque: impl Fn(u32) -> bool,
        query: &Query,
        out: &mut Vec<Hit>,
    ) -> bool {
        self.bvh.ray_traverse_miss(boxes(query), |_, leaf| {
            if let Some((meeting, label)) = self.candidate(query, leaf, query.end) {
                if opaque(label.face) {
                    return 0.0;
                }
                out.push(hit(&meeting, &label));
            }
            f32::INFINITY
        })
    }

    /// The meeting with a leaf's triangle, if it is before `reach` and on no plane to skip.
    #[inline(always)]
    fn candidate(&self, query: &Query, leaf: usize, reach: f32) -> Option<(Meeting, Label)> {
        query.candidate(&self.triangles[leaf], &self.labels[leaf], reach)
    }
}

/// The ray the boxes see.
#[inline]
fn boxes(query: &Query) -> BoxRay {
    let start = query.origin - HEAD_START * query.direction;
    BoxRay::new(start, query.direction, 0.0, query.end + HEAD_START)
}

/// The slowest preset without its splits, which would report one crossing twice.
fn build_parameters() -> BvhBuildParams {
    BvhBuildParams {
        pre_split: false,
        max_prims_per_leaf: 3,
        ..BvhBuildParams::very_slow_build()
    }
}
