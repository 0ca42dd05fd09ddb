//! Convex bodies that patches, luminaires and nodes of them lie in, given by their corners.
//!
//! Not handled: bodies of many corners; boxes stand for them.

use glam::DVec3;

use crate::form_factors::shadow::Caster;
use crate::patches::Patches;
use crate::rays::Side;

/// Corners of a patch, and of a luminaire, at most.
const MOST_CORNERS: usize = 32;
/// Heights below this lie in the plane: a few roundings of unit coordinates.
pub(crate) const FLAT: f64 = 1e-6;

/// A convex body's corners, with the plane it lies in, if in one.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub corners: Vec<DVec3>,
    pub plane: Option<(DVec3, f64)>,
    /// The convex lamp it is a part of, if of one.
    pub part: Option<u32>,
}

/// A patch's corners, counter-clockwise seen from the side it lies on.
pub(crate) fn patch_body(patches: &Patches, i: usize) -> Option<Body> {
    let corners = patches.pieces(i).flat_map(|(_, [a, b, c])| match patches.side(i) {
        Side::Front => [a, b, c],
        Side::Back => [a, c, b],
    });
    Body::new(corners.map(|p| p.as_dvec3()))
}

impl Body {
    /// `None` where there are too many corners.
    pub fn new(corners: impl Iterator<Item = DVec3>) -> Option<Body> {
        let mut body = Body { corners: Vec::new(), plane: None, part: None };
        let mut area = DVec3::ZERO;
        let all: Vec<DVec3> = corners.collect();
        for t in all.chunks_exact(3) {
            area += (t[1] - t[0]).cross(t[2] - t[0]);
        }
        for p in all {
            if !body.corners.contains(&p) {
                body.corners.push(p);
            }
            // Patches of thousands of leaves have too many at once.
            if body.corners.len() > MOST_CORNERS {
                return None;
            }
        }
        let normal = area.normalize_or_zero();
        let offset = normal.dot(*body.corners.first()?);
        let flat = |p: &DVec3| (normal.dot(*p) - offset).abs() <= FLAT;
        // The faces of a closed body add up to nothing, which is no plane.
        let lies = normal != DVec3::ZERO && body.corners.iter().all(flat);
        body.plane = lies.then_some((normal, offset));
        Some(body)
    }

    /// Mean of the corners, a point of the body.
    pub fn middle(&self) -> DVec3 {
        self.corners.iter().sum::<DVec3>() / self.corners.len() as f64
    }

    /// A box, and no plane.
    pub fn of_box(low: DVec3, high: DVec3) -> Body {
        let mut corners: Vec<DVec3> = Vec::new();
        for k in 0..8 {
            let side = |bit: usize| k >> bit & 1 == 1;
            let p = DVec3::select(glam::BVec3::new(side(0), side(1), side(2)), high, low);
            if !corners.contains(&p) {
                corners.push(p);
            }
        }
        Body { corners, plane: None, part: None }
    }

    /// The plane that this and another body lie in, if in one.
    pub fn common_plane(&self, other: &Body) -> Option<(DVec3, f64)> {
        let ((n, p), (m, q)) = (self.plane?, other.plane?);
        (n.dot(m) > 1.0 - 1e-12 && (p - q).abs() <= FLAT).then_some((n, p))
    }

    /// Whether a caster may hide the front of the body: it rises above its plane, and is not of the same convex lamp,
    /// no face of which hides another from where that one's front is seen.
    pub fn reached_by(&self, caster: &Caster) -> bool {
        if caster.part.is_some() && caster.part == self.part {
            return false;
        }
        let Some((normal, offset)) = self.plane else {
            return true;
        };
        caster.corners.iter().any(|p| normal.dot(*p) - offset > FLAT)
    }
}
