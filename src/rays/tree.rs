//! A bounding volume hierarchy over some of the scene's faces, and the three ways to walk it.
//!
//! Boxes are padded by 1e-5 of the scene's diagonal. Otherwise the boxes of axis-aligned meshes are flat and
//! degenerate, and rounding in the box test could cull what the watertight triangle test would accept.
//!
//! Two habits of the hierarchy are worked around here. It culls every box left before t = 1e-4, which loses hits
//! near edges: its ray therefore starts [`HEAD_START`] behind the true one. It reads a direction of -0.0 as positive
//! and its inverse as negative: zeros are made positive.

use std::time::Duration;

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray as BoxRay, RayHit};

use super::triangle::{Meeting, Shear, Triangle};
use super::{Hit, Side};
use crate::scene::Scene;

/// How far behind the true origin the box tests begin; more than the hierarchy's own 1e-4.
const HEAD_START: f32 = 2.5e-4;

/// Two meetings further apart than this are not taken for the same place of one plane. t errs by about 2e-7 over the
/// cosine between ray and normal, so this covers all but the most grazing rays.
const SAME_PLACE: f32 = 1e-3;

/// No plane: nothing is skipped.
pub(super) const NO_PLANE: u32 = u32::MAX;

/// A hierarchy; triangles and labels stand in the order of its leaves.
pub(super) struct Tree {
    bvh: CwBvh,
    triangles: Vec<Triangle>,
    labels: Vec<Label>,
}

/// What a triangle belongs to.
#[derive(Clone, Copy)]
struct Label {
    face: u32,
    plane: u32,
}

/// A ray made ready: where it runs, how far, and the planes it cannot meet.
pub(super) struct Query {
    shear: Shear,
    boxes: BoxRay,
    end: f32,
    skip: [u32; 2],
}

impl Query {
    /// Meetings with `0 < t < end` of planes other than `skip`.
    #[inline]
    pub(super) fn new(origin: Vec3A, direction: Vec3A, end: f32, skip: [u32; 2]) -> Self {
        let direction = direction + Vec3A::ZERO;
        let start = origin - HEAD_START * direction;
        Query {
            shear: Shear::new(origin, direction),
            boxes: BoxRay::new(start, direction, 0.0, end + HEAD_START),
            end,
            skip,
        }
    }
}

impl Tree {
    /// The hierarchy of `faces`; `planes` holds the plane of every face of the scene.
    pub(super) fn new(scene: &Scene, faces: &[u32], planes: &[u32], pad: f32) -> Self {
        let boxes: Vec<Aabb> = faces.iter().map(|&f| padded_box(scene, f, pad)).collect();
        let bvh = build_cwbvh(&boxes, build_parameters(), &mut Duration::default());
        let order: Vec<u32> = bvh
            .primitive_indices
            .iter()
            .map(|&i| faces[i as usize])
            .collect();
        let label = |&face: &u32| Label {
            face,
            plane: planes[face as usize],
        };
        Tree {
            triangles: order
                .iter()
                .map(|&f| Triangle::new(scene.corners(f)))
                .collect(),
            labels: order.iter().map(label).collect(),
            bvh,
        }
    }

    /// The first meeting.
    #[inline]
    pub(super) fn closest(&self, query: &Query) -> Option<Hit> {
        let mut best: Option<(Meeting, Label)> = None;
        let mut reach = query.end;
        self.bvh
            .ray_traverse(query.boxes, &mut RayHit::none(), |_, leaf| {
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

    /// Every meeting, in no order, edges counted once for each face; appended to `out`.
    #[inline]
    pub(super) fn all(&self, query: &Query, out: &mut Vec<Hit>) {
        self.bvh.ray_traverse_anyhit(query.boxes, |_, leaf| {
            if let Some((meeting, label)) = self.candidate(query, leaf, query.end) {
                out.push(hit(&meeting, &label));
            }
        });
    }

    /// Whether there is no meeting at all.
    #[inline]
    pub(super) fn is_clear(&self, query: &Query) -> bool {
        self.bvh.ray_traverse_miss(query.boxes, |_, leaf| {
            match self.candidate(query, leaf, query.end) {
                Some(_) => 0.0,
                None => f32::INFINITY,
            }
        })
    }

    /// Every meeting as [`Tree::all`], or false as soon as an opaque face is met.
    #[inline]
    pub(super) fn all_unless(
        &self,
        opaque: impl Fn(u32) -> bool,
        query: &Query,
        out: &mut Vec<Hit>,
    ) -> bool {
        self.bvh.ray_traverse_miss(query.boxes, |_, leaf| {
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
        let meeting = query.shear.meet(&self.triangles[leaf])?;
        if !(meeting.t > 0.0 && meeting.t < reach) {
            return None;
        }
        let label = self.labels[leaf];
        let skipped = label.plane == query.skip[0] || label.plane == query.skip[1];
        (!skipped).then_some((meeting, label))
    }
}

/// Sorting key of a meeting: backs count as a few ulps further, so that of a thin sheet the front comes first.
#[inline]
pub(super) fn depth(t: f32, side: Side) -> f32 {
    match side {
        Side::Front => t,
        Side::Back => t + 5e-7 * (1.0 + t),
    }
}

/// Whether `a` is met before `b`: by depth, then front before back, then face.
///
/// Within one plane, which a line meets once, the front comes first whatever the rounding of t.
#[inline]
fn precedes(a: &(Meeting, Label), b: &(Meeting, Label)) -> bool {
    let ((a, of_a), (b, of_b)) = (a, b);
    if of_a.plane == of_b.plane && a.side != b.side {
        return a.side == Side::Front;
    }
    let (near, far) = (depth(a.t, a.side), depth(b.t, b.side));
    near < far || (near == far && (a.side, of_a.face) < (b.side, of_b.face))
}

#[inline]
fn hit(meeting: &Meeting, label: &Label) -> Hit {
    Hit {
        t: meeting.t,
        face: label.face,
        side: meeting.side,
        u: meeting.u,
        v: meeting.v,
    }
}

fn padded_box(scene: &Scene, face: u32, pad: f32) -> Aabb {
    let [a, b, c] = scene.corners(face).map(Vec3A::from);
    Aabb::new(a.min(b).min(c) - pad, a.max(b).max(c) + pad)
}

/// The slowest preset without its splits, which would report one crossing twice.
fn build_parameters() -> BvhBuildParams {
    BvhBuildParams {
        pre_split: false,
        max_prims_per_leaf: 3,
        ..BvhBuildParams::very_slow_build()
    }
}
