//! The occluders between a patch, or a point, and luminaires.
//!
//! Everything between a point of the one and one of the other lies in the convex hull of both. A face does not
//! reach into it if it lies on or behind the plane of either, if both lie on one side of its own plane, or if a plane
//! separates it from the hull ([`apart`]): shaft culling (E. A. Haines, J. R. Wallace, 1991).
//!
//! Not handled: hierarchies of faces. Bodies of many corners, which are replaced by boxes.

use glam::DVec3;

use crate::direct::Luminaires;
use crate::direct::emitters::luminaire::Luminaire;
use crate::form_factors::hull::apart;
use crate::form_factors::shadow::Caster;
use crate::patches::Patches;
use crate::rays::{Rays, Side};
use crate::scene::{Bounds, Scene};

/// Corners of a patch, and of a luminaire, at most.
const MOST_CORNERS: usize = 32;
/// Heights below this lie in the plane: a few roundings of unit coordinates.
pub(crate) const FLAT: f64 = 1e-6;

/// A convex body's corners, with the plane it lies in, if in one.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub corners: Vec<DVec3>,
    pub plane: Option<(DVec3, f64)>,
    /// The convex luminaire it belongs to, if to one.
    pub convex_luminaire: Option<u32>,
}

/// A convex body that holds a luminaire: its corners, or a box around them where they are many.
pub(crate) fn luminaire_body(luminaire: &Luminaire) -> Body {
    let body = Body::new(luminaire.corners()).unwrap_or_else(|| Body::of_box(&Bounds::of(luminaire.corners())));
    Body { convex_luminaire: luminaire.convex_luminaire, ..body }
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
    pub(crate) fn new(corners: impl Iterator<Item = DVec3>) -> Option<Body> {
        let mut body = Body { corners: Vec::new(), plane: None, convex_luminaire: None };
        let mut area = DVec3::ZERO;
        let all: Vec<DVec3> = corners.collect();
        for t in all.chunks_exact(3) {
            area += (t[1] - t[0]).cross(t[2] - t[0]);
        }
        for p in all {
            if !body.corners.contains(&p) {
                body.corners.push(p);
            }
            if body.corners.len() > MOST_CORNERS {
                return None;
            }
        }
        let normal = area.normalize_or_zero();
        let offset = normal.dot(*body.corners.first()?);
        let flat = |p: &DVec3| (normal.dot(*p) - offset).abs() <= FLAT;
        // The areas of a closed body add up to 0, which is no plane.
        let lies = normal != DVec3::ZERO && body.corners.iter().all(flat);
        body.plane = lies.then_some((normal, offset));
        Some(body)
    }

    /// A point of a surface with unit normal n.
    pub(crate) fn of_point(x: DVec3, n: DVec3) -> Body {
        Body { corners: vec![x], plane: Some((n, n.dot(x))), convex_luminaire: None }
    }

    /// Mean of the corners, a point of the body.
    pub(crate) fn middle(&self) -> DVec3 {
        self.corners.iter().sum::<DVec3>() / self.corners.len() as f64
    }

    /// A box, and no plane.
    pub(crate) fn of_box(bounds: &Bounds<DVec3>) -> Body {
        let mut corners: Vec<DVec3> = Vec::new();
        for k in 0..8 {
            let side = |bit: usize| k >> bit & 1 == 1;
            let p = DVec3::select(glam::BVec3::new(side(0), side(1), side(2)), bounds.high, bounds.low);
            if !corners.contains(&p) {
                corners.push(p);
            }
        }
        Body { corners, plane: None, convex_luminaire: None }
    }

    /// The plane that this and another body lie in, if in one.
    pub(crate) fn common_plane(&self, other: &Body) -> Option<(DVec3, f64)> {
        let ((n, p), (m, q)) = (self.plane?, other.plane?);
        (n.dot(m) > 1.0 - 1e-12 && (p - q).abs() <= FLAT).then_some((n, p))
    }

    /// Whether a caster may hide the front of the body: it rises above its plane, and is not of the same convex
    /// luminaire, no face of which hides another from where that one's front is seen.
    pub(crate) fn reached_by(&self, caster: &Caster) -> bool {
        if caster.convex_luminaire.is_some() && caster.convex_luminaire == self.convex_luminaire {
            return false;
        }
        let Some((normal, offset)) = self.plane else {
            return true;
        };
        caster.corners.iter().any(|p| normal.dot(*p) - offset > FLAT)
    }
}

/// Occluding faces that are cut out; with more, points are drawn.
const MOST_FACES: usize = 32;
/// Pairs of an occluding face and a polygon of the luminaire that are cut: a pair takes some 40 ns, a visibility ray
/// with its arithmetic about a microsecond.
const MOST_CUTS: usize = 256;

/// The faces that may occlude and do; `tau` by material.
pub(crate) fn casters(scene: &Scene, rays: &Rays, luminaires: &Luminaires, tau: &[f32]) -> Vec<Caster> {
    let faces = rays.occluders().iter();
    faces
        .map(|&face| {
            let corners = scene.corners(face).map(|p| p.as_dvec3());
            let [a, b, c] = corners;
            Caster {
                corners,
                normal: (b - a).cross(c - a).normalize_or_zero(),
                tau: f64::from(tau[scene.faces[face as usize].material as usize]),
                masked: scene.is_masked(face),
                convex_luminaire: luminaires.convex_luminaire(face),
            }
        })
        .filter(|c| c.tau < 1.0 && c.normal != DVec3::ZERO)
        .collect()
}

/// Occluding faces that are cut out of a luminaire at most.
pub(crate) fn most_faces(luminaire: &Luminaire) -> usize {
    (MOST_CUTS / luminaire.polygons.len().max(1)).min(MOST_FACES)
}

/// The convex hull of two bodies.
pub(crate) struct Shaft<'a> {
    ends: [&'a Body; 2],
    hull: Vec<DVec3>,
    bounds: Bounds<DVec3>,
}

impl<'a> Shaft<'a> {
    pub(crate) fn new(patch: &'a Body, luminaire: &'a Body) -> Shaft<'a> {
        let hull: Vec<DVec3> = patch.corners.iter().chain(&luminaire.corners).copied().collect();
        Shaft { ends: [patch, luminaire], bounds: Bounds::of(hull.iter().copied()), hull }
    }

    /// Those `among` the casters that may lie between the bodies.
    pub(crate) fn holds_of(&self, casters: &[Caster], among: impl Iterator<Item = u32>) -> impl Iterator<Item = u32> {
        let [from, to] = self.ends.map(Body::middle);
        among.filter(move |&k| {
            let c = &casters[k as usize];
            self.is_near(c) && self.reaches(c, from, to)
        })
    }

    /// Those `among` the casters that may lie between parts of the bodies: none where none lies between the whole ones,
    /// else perhaps more than there are, as only the first is looked for.
    pub(crate) fn holds_any_of(&self, casters: &[Caster], among: impl Iterator<Item = u32>) -> Vec<u32> {
        let [from, to] = self.ends.map(Body::middle);
        let mut any = false;
        let holds = |&k: &u32| {
            let c = &casters[k as usize];
            let holds = self.is_near(c) && (any || self.reaches(c, from, to));
            any |= holds;
            holds
        };
        among.filter(holds).collect()
    }

    /// Whether a caster's box meets that of the hull, and it may hide one body from the other.
    fn is_near(&self, c: &Caster) -> bool {
        Bounds::of(c.corners).meets(&self.bounds) && self.ends.iter().all(|body| body.reached_by(c))
    }

    /// Whether no plane separates a caster from the hull; `from` and `to` are points of the bodies.
    fn reaches(&self, c: &Caster, from: DVec3, to: DVec3) -> bool {
        pierced(c, from, to) || straddled(c, &self.hull) && !apart(&self.hull, &c.corners)
    }
}

/// Whether the segment between two points passes through a caster: then no plane separates them.
fn pierced(c: &Caster, from: DVec3, to: DVec3) -> bool {
    let [h, g] = [from, to].map(|p| c.normal.dot(p - c.corners[0]));
    if !(h > FLAT && g < -FLAT || h < -FLAT && g > FLAT) {
        return false;
    }
    let at = from.lerp(to, h / (h - g));
    let inside = |k: usize| {
        let [a, b] = [c.corners[k], c.corners[(k + 1) % 3]];
        c.normal.dot((b - a).cross(at - a)) > 0.0
    };
    (0..3).all(inside)
}

/// Whether points lie on both sides of a caster's plane.
fn straddled(c: &Caster, points: &[DVec3]) -> bool {
    let height = |p: &DVec3| c.normal.dot(*p - c.corners[0]);
    points.iter().any(|p| height(p) > FLAT) && points.iter().any(|p| height(p) < -FLAT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminaires_of_many_polygons_are_cut_by_few_faces() {
        let of = |scene: &str| Luminaires::new(&Scene::open(scene).expect("a scene")).list;
        assert_eq!(most_faces(&of("cornell-box")[0]), MOST_FACES);
        let pieces = of("concentric-spheres");
        assert!(pieces.iter().any(|piece| most_faces(piece) < MOST_FACES));
        assert!(pieces.iter().all(|piece| piece.polygons.len() * most_faces(piece) <= MOST_CUTS));
    }
}
