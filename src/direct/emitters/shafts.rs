//! What may lie between a patch and a luminaire: nothing, a few faces, or too much to know.
//!
//! Everything between a point of the patch and one of the luminaire lies in the convex hull of both. A face does not
//! reach into it if it lies on or behind the plane of either, if both lie on one side of its own plane, or if a plane
//! separates it from the hull ([`apart`]): shaft culling (E. A. Haines, J. R. Wallace, 1991).
//!
//! Where nothing lies between, the closed form is the answer and no ray is cast; where few faces do, their shadows are
//! cut out of the luminaire ([`crate::form_factors::shadow`]); else points are drawn.
//!
//! Not handled: hierarchies of faces: scenes with too many faces draw points everywhere. Bodies of many corners: boxes
//! stand for them.

use glam::DVec3;
use rayon::prelude::*;

use crate::direct::Luminaires;
use crate::direct::emitters::luminaire::Luminaire;
use crate::form_factors::hull::{apart, bounds};
use crate::form_factors::shadow::Caster;
use crate::patches::Patches;
use crate::rays::{Rays, Side};
use crate::scene::Scene;

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
    pub convex_lamp: Option<u32>,
}

/// A convex body that holds a luminaire: its corners, or a box around them where they are many.
pub(crate) fn luminaire_body(luminaire: &Luminaire) -> Body {
    let body = Body::new(luminaire.corners()).unwrap_or_else(|| {
        let (low, high) = bounds(luminaire.corners());
        Body::of_box(low, high)
    });
    Body { convex_lamp: luminaire.convex_lamp, ..body }
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
        let mut body = Body { corners: Vec::new(), plane: None, convex_lamp: None };
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
        Body { corners, plane: None, convex_lamp: None }
    }

    /// The plane that this and another body lie in, if in one.
    pub fn common_plane(&self, other: &Body) -> Option<(DVec3, f64)> {
        let ((n, p), (m, q)) = (self.plane?, other.plane?);
        (n.dot(m) > 1.0 - 1e-12 && (p - q).abs() <= FLAT).then_some((n, p))
    }

    /// Whether a caster may hide the front of the body: it rises above its plane, and is not of the same convex lamp,
    /// no face of which hides another from where that one's front is seen.
    pub fn reached_by(&self, caster: &Caster) -> bool {
        if caster.convex_lamp.is_some() && caster.convex_lamp == self.convex_lamp {
            return false;
        }
        let Some((normal, offset)) = self.plane else {
            return true;
        };
        caster.corners.iter().any(|p| normal.dot(*p) - offset > FLAT)
    }
}

/// Tests of a face against a patch and a luminaire, for the whole scene.
const MOST_TESTS: usize = 20_000_000;
/// Faces between that are cut out; more are left to drawn points.
const MOST_FACES: usize = 32;
/// Pairs of a face between and a polygon of the luminaire that are cut: a pair takes some 40 ns, a visibility ray and
/// what goes with it about a microsecond. A bulb of 128 polygons in a shade of 48 faces took 9 times as long by cuts.
const MOST_CUTS: usize = 256;

/// What may lie between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Between<'a> {
    /// Nothing: every point of the patch sees all of the luminaire that is above its horizon.
    Nothing,
    /// These faces, as indices into the shafts' casters.
    Faces(&'a [u32]),
    /// Too much to tell.
    Unknown,
}

/// The shafts between patches and luminaires.
#[derive(Debug, Default)]
pub struct Shafts {
    casters: Vec<Caster>,
    luminaires: usize,
    /// Of patch i and luminaire l: `starts[k]..starts[k + 1]` of `faces`, k = i * luminaires + l.
    starts: Vec<u32>,
    faces: Vec<u32>,
    /// Shafts of which nothing is known.
    unknown: Vec<bool>,
}

impl Shafts {
    /// Finds which casters may lie between every patch that `receives` and every luminaire.
    pub(crate) fn new(casters: Vec<Caster>, patches: &Patches, luminaires: &Luminaires, receives: &[bool]) -> Shafts {
        let count = luminaires.list.len();
        if casters.len() * count * patches.len() > MOST_TESTS {
            return Shafts::default();
        }
        let lamps: Vec<(Body, usize)> = luminaires.list.iter().map(|l| (luminaire_body(l), most_faces(l))).collect();
        let find = |i: usize| -> Vec<Option<Vec<u32>>> {
            if !receives[i] {
                return vec![Some(Vec::new()); count];
            }
            let patch = patch_body(patches, i);
            let one = |(lamp, most): &(Body, usize)| between(patch.as_ref()?, lamp, *most, &casters);
            lamps.iter().map(one).collect()
        };
        let found: Vec<Option<Vec<u32>>> = (0..patches.len()).into_par_iter().flat_map_iter(find).collect();
        let mut shafts = Shafts {
            luminaires: count,
            starts: vec![0],
            unknown: found.iter().map(Option::is_none).collect(),
            faces: Vec::new(),
            casters,
        };
        for faces in found {
            shafts.faces.extend(faces.unwrap_or_default());
            shafts.starts.push(shafts.faces.len() as u32);
        }
        shafts
    }

    /// Casters by number, and nothing known of any pair.
    pub(crate) fn casting(casters: Vec<Caster>) -> Shafts {
        Shafts { casters, ..Shafts::default() }
    }

    /// Whether something is known of every patch and luminaire.
    pub fn know_all(&self) -> bool {
        !self.unknown.is_empty() && self.unknown.iter().all(|u| !u)
    }

    /// What may lie between patch i and luminaire l.
    #[inline]
    pub fn between(&self, patch: u32, luminaire: usize) -> Between<'_> {
        let k = patch as usize * self.luminaires + luminaire;
        if self.unknown.get(k).copied().unwrap_or(true) {
            return Between::Unknown;
        }
        match &self.faces[self.starts[k] as usize..self.starts[k + 1] as usize] {
            [] => Between::Nothing,
            faces => Between::Faces(faces),
        }
    }

    /// The faces of [`Between::Faces`].
    pub(crate) fn casters(&self, faces: &[u32]) -> impl Iterator<Item = Caster> {
        faces.iter().map(|&k| self.casters[k as usize])
    }
}

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
                convex_lamp: luminaires.convex_lamp(face),
            }
        })
        .filter(|c| c.tau < 1.0 && c.normal != DVec3::ZERO)
        .collect()
}

/// Faces between a luminaire and a patch that are cut out of it at most.
pub(crate) fn most_faces(luminaire: &Luminaire) -> usize {
    (MOST_CUTS / luminaire.polygons.len().max(1)).min(MOST_FACES)
}

/// The casters between two bodies; `None` where they are more than `most`, or the outline of one's shadow is not its
/// own.
fn between(patch: &Body, lamp: &Body, most: usize, casters: &[Caster]) -> Option<Vec<u32>> {
    let all = 0..casters.len() as u32;
    let found: Vec<u32> = sieve(patch, lamp, casters, all).take(most + 1).collect();
    let is_masked = |&k: &u32| casters[k as usize].masked;
    (found.len() <= most && !found.iter().any(is_masked)).then_some(found)
}

/// Those `among` the casters that may lie between two bodies.
pub(crate) fn sieve(
    patch: &Body,
    lamp: &Body,
    casters: &[Caster],
    among: impl Iterator<Item = u32>,
) -> impl Iterator<Item = u32> {
    let hull: Vec<DVec3> = patch.corners.iter().chain(&lamp.corners).copied().collect();
    let (low, high) = bounds(hull.iter().copied());
    let [from, to] = [patch, lamp].map(Body::middle);
    among.filter(move |&k| {
        let c = &casters[k as usize];
        let (l, h) = bounds(c.corners);
        l.cmplt(high).all()
            && h.cmpgt(low).all()
            && patch.reached_by(c)
            && lamp.reached_by(c)
            && (pierced(c, from, to) || straddled(c, &hull) && !apart(&hull, &c.corners))
    })
}

/// Whether the segment between two points surely passes through a caster: then there is no plane to search for.
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

    /// One polygon is cut by as many faces as ever, each of many by few.
    #[test]
    fn luminaires_of_many_polygons_are_cut_by_few_faces() {
        let of = |scene: &str| Luminaires::new(&Scene::open(scene).expect("a scene")).list;
        assert_eq!(most_faces(&of("cornell-box")[0]), MOST_FACES);
        let pieces = of("concentric-spheres");
        assert!(pieces.iter().any(|piece| most_faces(piece) < MOST_FACES));
        assert!(pieces.iter().all(|piece| piece.polygons.len() * most_faces(piece) <= MOST_CUTS));
    }
}
