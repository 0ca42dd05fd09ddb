//! A ray, the ends of a segment, and the crossings of a ray in order, each once.
//!
//! A ray that passes exactly through an edge or a vertex meets every face around it: the watertight test accepts an
//! edge function of exactly 0 on both sides. Such hits carry a barycentric weight of exactly 0 and are the only ones a
//! surface can report twice, so of those that agree in side and place one is kept. Comparing t alone would also swallow
//! distinct surfaces that lie close together.
//!
//! Of faces in one plane that face the same way, which a line meets in one place, the first in the file is met. A scene
//! has such faces only where the first has a mask ([`crate::scene`]).
//!
//! Not handled: rays so grazing that rounding tears the places of one plane apart.

use glam::Vec3;

use crate::rays::triangle::{Hit, SAME_PLACE, Side, depth};

/// A ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts; on `source` if there is one.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// The face it starts on. Faces of the same plane are not met again.
    pub source: Option<u32>,
}

impl Ray {
    /// The point at distance t, unit coordinates.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }
}

/// A point and the face it lies on, if any.
pub type End = (Vec3, Option<u32>);

/// Two hits on an edge within this distance are the same place of the same edge. Each face interpolates t along the
/// edge with its own rounding, about 1e-7 over the edge's projected size.
const SAME_EDGE_PLACE: f32 = 1e-5;

/// Sorts by t (of a thin sheet the front first), then face, and merges hits of one edge or vertex.
pub(crate) fn settle(hits: &mut Vec<Hit>, planes: &[u32]) {
    hits.sort_unstable_by(|a, b| {
        let (near, far) = (depth(a.t, a.side), depth(b.t, b.side));
        near.total_cmp(&far).then_with(|| (a.side, a.face).cmp(&(b.side, b.face)))
    });
    merge_edges(hits);
    merge_planes(hits, planes);
    fronts_first(hits, planes);
}

/// What [`settle`] does, but that all faces of one plane stay, in the order of the file.
pub(crate) fn settle_all(hits: &mut Vec<Hit>, planes: &[u32]) {
    let mut twins = hits.clone();
    settle(hits, planes);
    twins.retain(|hit| !hits.contains(hit) && !on_edge(hit));
    twins.sort_unstable_by_key(|hit| hit.face);
    for twin in twins {
        let over = |hit: &Hit| {
            let is_near = (twin.t - hit.t).abs() <= SAME_PLACE;
            is_near && hit.side == twin.side && planes[hit.face as usize] == planes[twin.face as usize]
        };
        if let Some(last) = hits.iter().rposition(over) {
            hits.insert(last + 1, twin);
        }
    }
}

/// Keeps the first face of each plane and side.
fn merge_planes(hits: &mut Vec<Hit>, planes: &[u32]) {
    let mut kept = 0;
    for i in 0..hits.len() {
        let hit = hits[i];
        let same = |k: &Hit| k.side == hit.side && planes[k.face as usize] == planes[hit.face as usize];
        let near = |k: &usize| hit.t - hits[*k].t <= SAME_PLACE;
        match (0..kept).rev().take_while(near).find(|&k| same(&hits[k])) {
            Some(k) if hits[k].face > hit.face => hits[k] = hit,
            Some(_) => (),
            None => {
                hits[kept] = hit;
                kept += 1;
            }
        }
    }
    hits.truncate(kept);
}

/// Keeps one hit of each edge or vertex and side.
fn merge_edges(hits: &mut Vec<Hit>) {
    let mut kept = 0;
    for i in 0..hits.len() {
        let hit = hits[i];
        let twin = on_edge(&hit)
            && hits[..kept]
                .iter()
                .rev()
                .take_while(|k| hit.t - k.t <= SAME_EDGE_PLACE)
                .any(|k| k.side == hit.side && on_edge(k));
        if !twin {
            hits[kept] = hit;
            kept += 1;
        }
    }
    hits.truncate(kept);
}

/// Of two faces in one plane, which a line meets once, the front comes first whatever the rounding of t.
fn fronts_first(hits: &mut [Hit], planes: &[u32]) {
    for i in 1..hits.len() {
        let (a, b) = (hits[i - 1], hits[i]);
        let same_plane = planes[a.face as usize] == planes[b.face as usize];
        if same_plane && a.side == Side::Back && b.side == Side::Front {
            hits.swap(i - 1, i);
        }
    }
}

/// Whether the hit lies exactly on an edge of its face.
fn on_edge(hit: &Hit) -> bool {
    hit.u == 0.0 || hit.v == 0.0 || hit.u + hit.v >= 1.0
}
