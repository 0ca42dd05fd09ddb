//! A scene's faces ready for rays: the first face met, every face met in order, and whether two points see each other.
//!
//! Faces that can lie between no two points of the scene are found once and skipped where both ends lie on the scene.
//! Where there is a sky, a ray meets it last of all, and where no face is met; it lies between no two points. Faces
//! with masks are met where there is a surface ([`crate::rays::masked_faces`]).
//!
//! Light along a ray is the sum over its crossings of what they send times the product of tau of the surfaces crossed
//! before; behind tau = 0 nothing is seen.
//!
//! Results depend on the scene and the ray alone, so any number of threads may cast them.
//!
//! Not handled: scenes that change after they were made ready.

use std::ops::Mul;

use glam::{Vec3, Vec3A};
use halflight_team::heed_interrupt;
use obvhs::aabb::Aabb;
use rayon::prelude::*;

use crate::rays::accelerator::{Accelerator, MANY};
use crate::rays::bvh::Bvh;
use crate::rays::bvh_build::Layout;
use crate::rays::hull_faces::occluders;
use crate::rays::masked_faces::{Cell, MaskedFaces, Seen};
use crate::rays::ray::{End, Ray, settle};
use crate::rays::ray_offset::RayOffset;
use crate::rays::triangle::{Hit, Label, NO_PLANE, Query, Side, Triangle};
use crate::scene::planes::Planes;
use crate::scene::{Scene, Sky};

/// A scene made ready for casting rays.
pub struct Rays {
    pub(super) tree: Accelerator,
    occluders: Occluders,
    masked: Option<MaskedFaces>,
    /// The faces that may occlude.
    occluding: Vec<u32>,
    planes: Vec<u32>,
    materials: Vec<u32>,
    anchors: Vec<RayOffset>,
    corners: Vec<[Vec3; 3]>,
    sky: Option<Sky>,
}

/// Distance at which the sky is met, unit coordinates: the longest side of the scene's box. What it lights changes
/// within the scene only because things stand before it, so a hemisphere that sees much of it shows nothing of how near
/// they are: were it at infinity, the irradiance next to the few things in an open scene would count as known far from
/// it, and the dark places below them come out too bright (by 0.4 % of the mean light for a sheet among three, 0.1 %
/// so).
const SKY_DISTANCE: f32 = 2.0;

/// The faces that may lie between two points of the scene.
enum Occluders {
    /// All of them: no face was proved to lie on the hull.
    All,
    /// Some.
    Some(Accelerator),
    /// None: the surfaces all see each other, as far as they face each other.
    None,
}

impl Rays {
    /// Builds what rays are tested against, the plane ids and the proof of what cannot occlude.
    pub fn new(scene: &Scene) -> Rays {
        Rays::with_blocks(scene, MANY)
    }

    /// Rays that test fewer than `many` faces in blocks and others through a hierarchy; there are blocks
    /// for 512 at most. Both find the same; this is for measuring which is faster.
    pub fn with_blocks(scene: &Scene, many: usize) -> Rays {
        let (masked, whole): (Vec<u32>, Vec<u32>) = (0..scene.solid_faces()).partition(|&face| scene.is_masked(face));
        let faces = SceneFaces::new(scene, many);
        let inner = occluders(scene, &faces.planes);
        let occluders = if inner.is_empty() {
            Occluders::None
        } else if inner.len() == scene.solid_faces() as usize {
            Occluders::All
        } else {
            let inner: Vec<u32> = inner.iter().copied().filter(|&face| !scene.is_masked(face)).collect();
            Occluders::Some(faces.tree(&inner))
        };
        Rays {
            occluding: inner,
            tree: faces.tree(&whole),
            masked: MaskedFaces::new(scene, &masked, |some| faces.tree(some)),
            occluders,
            planes: faces.planes.of_face,
            materials: scene.faces.iter().map(|f| f.material).collect(),
            anchors: (0..faces.corners.len() as u32).into_par_iter().map(|f| RayOffset::new(scene, f)).collect(),
            corners: faces.corners,
            sky: scene.sky.clone(),
        }
    }

    /// The first face met, or the sky. Of a thin sheet (two faces in one place, back to back) it is the one met from
    /// its front.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let query = self.query(ray);
        let whole = self.tree.closest(&query);
        let met = match &self.masked {
            None => whole,
            Some(masked) => masked.first(&query, whole, &self.planes),
        };
        met.or_else(|| self.sky_met(ray))
    }

    /// What a camera ray sees, in order, each with the share of its light that comes from there: the first face met or
    /// the sky, and through masks what is behind them. In the mean over the rays of a cell shares add up to 1 unless
    /// the rest comes from nowhere.
    pub fn seen(&self, ray: &Ray, cell: impl Fn() -> Cell) -> Seen {
        let query = self.query(ray);
        let whole = self.tree.closest(&query);
        let mut seen = Seen::new();
        let remaining = match &self.masked {
            Some(masked) => masked.seen((&query, cell), whole, &self.planes, &mut seen),
            None => {
                seen.extend(whole.map(|hit| (hit, 1.0)));
                if whole.is_some() { 0.0 } else { 1.0 }
            }
        };
        seen.extend(self.sky_met(ray).filter(|_| remaining > 0.0).map(|hit| (hit, remaining)));
        seen
    }

    /// Every crossing in order of t into `out`, cleared first. A crossing through a shared edge or vertex counts once;
    /// of a thin sheet the front comes before the back. The sky comes last.
    #[inline]
    pub fn crossings(&self, ray: &Ray, out: &mut Vec<Hit>) {
        out.clear();
        let query = self.query(ray);
        self.tree.all(&query, out);
        if let Some(masked) = &self.masked {
            masked.meet(&query, out);
        }
        settle(out, &self.planes);
        out.extend(self.sky_met(ray));
    }

    /// The sky where a ray leaves the scene.
    #[inline]
    fn sky_met(&self, ray: &Ray) -> Option<Hit> {
        let face = self.sky.as_ref()?.face(ray.direction);
        Some(Hit { t: SKY_DISTANCE, face, side: Side::Front, u: 0.0, v: 0.0 })
    }

    /// Whether a face stands for a cell of the sky.
    #[inline]
    pub fn is_sky(&self, face: u32) -> bool {
        self.sky.as_ref().is_some_and(|sky| sky.holds(face))
    }

    /// Whether nothing lies strictly between the points (tau = 0 everywhere).
    ///
    /// The planes of the end points' own faces do not count; whether those faces face each other is not checked.
    #[inline]
    pub fn visible(&self, from: End, to: End) -> bool {
        match (self.between(from, to), self.segment(from, to)) {
            (Some(tree), Some(segment)) => {
                tree.is_clear(&segment) && self.masked.as_ref().is_none_or(|masked| masked.is_clear(&segment))
            }
            _ => true,
        }
    }

    /// Product of tau over the surfaces crossed strictly between the points; `tau` holds one number per material.
    /// `scratch` spares an allocation for each call.
    pub fn transmittance(&self, from: End, to: End, tau: &[f32], scratch: &mut Vec<Hit>) -> f32 {
        scratch.clear();
        let (Some(tree), Some(segment)) = (self.between(from, to), self.segment(from, to)) else {
            return 1.0;
        };
        let tau_of = |face: u32| tau[self.material(face)];
        if !tree.all_unless(|face| tau_of(face) == 0.0, &segment, scratch) {
            return 0.0;
        }
        if let Some(masked) = &self.masked {
            masked.meet(&segment, scratch);
        }
        settle(scratch, &self.planes);
        scratch.iter().map(|hit| tau_of(hit.face)).product()
    }

    /// The crossings that light along a ray may come from into `out`, cleared first: all in order, or the closest where
    /// every surface is `opaque`.
    #[inline]
    pub fn light_crossings(&self, ray: &Ray, opaque: bool, out: &mut Vec<Hit>) {
        if opaque {
            out.clear();
            out.extend(self.closest(ray));
        } else {
            self.crossings(ray, out);
        }
    }

    /// Calls `meet` with each crossing in order and the product of tau before it, until that is 0; returns the product
    /// behind the last. `tau` is given the material.
    #[inline]
    pub fn transmit<T: Copy + From<f32> + Mul<Output = T> + PartialEq>(
        &self,
        crossings: &[Hit],
        tau: impl Fn(usize) -> T,
        mut meet: impl FnMut(&Hit, T),
    ) -> T {
        let mut through = T::from(1.0);
        for hit in crossings {
            meet(hit, through);
            through = through * tau(self.material(hit.face));
            if through == T::from(0.0) {
                break;
            }
        }
        through
    }

    /// The faces that may lie between two points of the scene's surface, in order; all others are proved not to.
    pub fn occluders(&self) -> &[u32] {
        &self.occluding
    }

    /// False where it is proved that no face lies between any two points of the scene's surface.
    pub fn anything_occludes(&self) -> bool {
        !matches!(self.occluders, Occluders::None)
    }

    /// The material of a face.
    ///
    /// # Panics
    ///
    /// If the scene has no such face.
    #[inline]
    pub fn material(&self, face: u32) -> usize {
        self.materials[face as usize] as usize
    }

    /// The id of the plane a face lies in: faces whose planes agree within rounding share it, whatever way they face.
    ///
    /// # Panics
    ///
    /// If the scene has no such face.
    pub fn plane(&self, face: u32) -> u32 {
        self.planes[face as usize]
    }

    /// The ray with its start lifted off its source.
    #[inline]
    pub(super) fn query(&self, ray: &Ray) -> Query {
        heed_interrupt();
        let direction = Vec3A::from(ray.direction);
        let (start, skip) = self.start((ray.origin, ray.source), direction);
        Query::new(start, direction, f32::INFINITY, [skip, NO_PLANE])
    }

    /// The ray moved so that it starts twice as far from its face's plane and edges as rounding needs. Where that
    /// changes what it meets by some share of rays, so does starting once as far.
    pub(crate) fn moved_twice(&self, ray: &Ray) -> Ray {
        let Some(face) = ray.source.map(|face| face as usize) else { return *ray };
        let (origin, direction) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
        Ray { origin: self.anchors[face].twice(origin, direction, self.corners[face]).into(), ..*ray }
    }

    /// The segment between two points, both lifted towards the other; `None` if they are one point.
    #[inline]
    pub(super) fn segment(&self, from: End, to: End) -> Option<Query> {
        heed_interrupt();
        let across = Vec3A::from(to.0 - from.0);
        let (start, first) = self.start(from, across);
        let (end, last) = self.start(to, -across);
        let length = (end - start).length();
        let direction = (end - start) * length.recip();
        (length > 0.0).then(|| Query::new(start, direction, length, [first, last]))
    }

    /// Where a ray from a point truly starts, and the plane it cannot meet.
    #[inline]
    fn start(&self, (point, face): End, direction: Vec3A) -> (Vec3A, u32) {
        let point = Vec3A::from(point);
        let Some(face) = face.map(|f| f as usize) else {
            return (point, NO_PLANE);
        };
        let start = self.anchors[face].start(point, direction, || self.corners[face]);
        (start, self.planes[face])
    }

    /// The faces that may lie between two points; `None` if there are none.
    #[inline]
    pub(super) fn between(&self, from: End, to: End) -> Option<&Accelerator> {
        match &self.occluders {
            Occluders::Some(tree) if from.1.is_some() && to.1.is_some() => Some(tree),
            Occluders::None if from.1.is_some() && to.1.is_some() => None,
            _ => Some(&self.tree),
        }
    }
}

/// The faces of a scene, and what all trees over them have in common.
struct SceneFaces {
    corners: Vec<[Vec3; 3]>,
    planes: Planes,
    /// Over all faces, where there are many.
    layout: Option<Layout>,
    /// What boxes are padded by.
    pad: f32,
    /// From how many on there is a hierarchy.
    many: usize,
}

impl SceneFaces {
    fn new(scene: &Scene, many: usize) -> SceneFaces {
        let all = (0..scene.faces.len() as u32).into_par_iter();
        let corners: Vec<[Vec3; 3]> = all.map(|f| scene.corners(f)).collect();
        let solid = &corners[..scene.solid_faces() as usize];
        let pad = 1e-5 * diagonal(solid);
        // Planes are found one after the other; meanwhile the other threads lay out the tree.
        let layout = || (solid.len() >= many).then(|| Layout::new(&boxes(solid, pad)));
        let (planes, layout) = rayon::join(|| Planes::new(scene), layout);
        SceneFaces { corners, planes, layout, pad, many }
    }

    /// A face ready for rays.
    fn ready(&self, face: u32) -> (Triangle, Label) {
        let plane = self.planes.of_face[face as usize];
        let triangle = Triangle::new(self.corners[face as usize]);
        (triangle, Label { face, plane })
    }

    /// The tree over some faces, in order; many of them share the layout of all.
    fn tree(&self, faces: &[u32]) -> Accelerator {
        match &self.layout {
            Some(layout) if faces.len() >= self.many => {
                let mut among = vec![false; self.corners.len()];
                faces.iter().for_each(|&face| among[face as usize] = true);
                let ready = |face: u32| among[face as usize].then(|| self.ready(face));
                Accelerator::Bvh(Bvh::new(layout, ready))
            }
            _ => {
                let ready: Vec<_> = faces.iter().map(|&face| self.ready(face)).collect();
                Accelerator::of(&ready, self.pad, self.many)
            }
        }
    }
}

/// Length of the diagonal of the box around triangles.
fn diagonal(corners: &[[Vec3; 3]]) -> f32 {
    let whole = boxes(corners, 0.0).into_par_iter().reduce(|| Aabb::INVALID, |a, b| a.union(&b));
    whole.diagonal().length()
}

/// The triangles' boxes, padded.
fn boxes(corners: &[[Vec3; 3]], pad: f32) -> Vec<Aabb> {
    let padded = |c: &[Vec3; 3]| Triangle::new(*c).padded_box(pad);
    corners.par_iter().map(padded).collect()
}
