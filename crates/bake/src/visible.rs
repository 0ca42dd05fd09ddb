//! What of a map can be seen at all: points inside of solids, as of a floor that goes on below a wall, are left out, so
//! that a texel half inside has the light of its visible half.
//!
//! A point is inside where a ray straight away from it meets the black back of a one-sided face, and most rays all
//! around do. Texels in which that differs are divided into cells, which are shown or not.
//!
//! Also which side of its faces a chart shows: the front, of one-sided faces; of two-sided ones the back where the
//! front sees next to nothing and the back does, as the shell of a room that faces outward.
//!
//! Not handled: the inside of solids whose faces have two sides; walls thinner than a cell.

use glam::{DVec2, DVec3, Vec3};
use halflight::Scene;
use halflight::rays::{Ray, Rays, Side};
use halflight::scene::Sides;
use halflight::surfaces::SurfacePoint;
use rayon::prelude::*;

use crate::clip::within;
use crate::texels::{TexelMap, TexelPart};

/// How far before a surface rays start, unit coordinates, as sensors do.
const BEFORE: f32 = 4e-6;
/// Rays around a point.
const ROUND: u32 = 16;
/// Cells to a side of a texel that is partly inside.
const CELLS: usize = 8;
/// Rays that choose the side of a triangle, shares of them that the front may see at most and the back at least.
const LOOKS: u32 = 24;
const NOTHING: f64 = 0.1;
const SOMETHING: f64 = 0.5;

/// A scene that rays are cast in.
pub(crate) struct Sight<'a> {
    pub scene: &'a Scene,
    pub rays: &'a Rays,
}

/// Direction number k of so many, spread evenly over the hemisphere around a normal by the cosine (Fibonacci's
/// spiral).
fn direction(normal: Vec3, k: u32, of: u32) -> Vec3 {
    let radius = ((k as f32 + 0.5) / of as f32).sqrt();
    let (sine, cosine) = (2.399_963_2 * k as f32).sin_cos();
    let (u, v) = normal.any_orthonormal_pair();
    (radius * cosine * u + radius * sine * v + (1.0 - radius * radius).max(0.0).sqrt() * normal).normalize()
}

impl Sight<'_> {
    /// Whether a ray meets the black back of a face; none where it meets nothing.
    fn meets_back(&self, from: &SurfacePoint, direction: Vec3) -> Option<bool> {
        let ray = Ray { origin: from.position + BEFORE * from.normal, direction, source: None };
        let hit = self.rays.closest(&ray)?;
        let is_sky = self.scene.is_sky(hit.face);
        (!is_sky).then(|| hit.side == Side::Back && self.scene.material(hit.face).sides == Sides::One)
    }

    /// Whether a point of a surface is inside of a solid.
    fn is_inside(&self, point: &SurfacePoint) -> bool {
        let is_back = |direction: Vec3| self.meets_back(point, direction) == Some(true);
        is_back(point.normal)
            && (0..ROUND).filter(|&k| is_back(direction(point.normal, k, ROUND))).count() > ROUND as usize / 2
    }

    /// The normal of the side of a triangle that a map shows, unit coordinates.
    pub(crate) fn shown_side(&self, corners: [DVec3; 3]) -> DVec3 {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or(DVec3::Y);
        let middle = ((a + b + c) / 3.0).as_vec3();
        let probe = |normal: DVec3| {
            let normal = normal.as_vec3();
            let ray = Ray { origin: middle + BEFORE * normal, direction: -normal, source: None };
            self.rays.closest(&ray).filter(|hit| hit.t < 4.0 * BEFORE)
        };
        let Some(hit) = probe(normal) else { return normal };
        match (self.scene.material(hit.face).sides, hit.side) {
            (Sides::One, Side::Front) => normal,
            (Sides::One, Side::Back) => -normal,
            (Sides::Two, _) => self.open_side(middle, normal),
        }
    }

    /// Of a two-sided face the front, unless it sees next to nothing and the back does.
    fn open_side(&self, middle: Vec3, normal: DVec3) -> DVec3 {
        let sees = |normal: Vec3| {
            let point = SurfacePoint { position: middle, normal, face: SurfacePoint::NO_FACE };
            let met = (0..LOOKS).filter(|&k| self.meets_back(&point, direction(normal, k, LOOKS)).is_some()).count();
            met as f64 / f64::from(LOOKS)
        };
        let front = sees(normal.as_vec3());
        if front <= NOTHING && sees(-normal.as_vec3()) >= SOMETHING { -normal } else { normal }
    }

    /// A map without what is inside of solids.
    pub(crate) fn clear(&self, map: TexelMap) -> TexelMap {
        let texels = map.texels;
        let of_texel = |texel: usize| -> Vec<(u32, TexelPart)> {
            let own = map.parts(texel);
            let kept: Vec<TexelPart> = if self.is_clear(&map, texel) {
                own.to_vec()
            } else {
                own.iter().flat_map(|part| self.cells(&map, texel, part)).collect()
            };
            kept.into_iter().map(|part| (texel as u32, part)).collect()
        };
        let parts: Vec<_> = (0..texels * texels).into_par_iter().flat_map_iter(of_texel).collect();
        map.with_parts(parts)
    }

    /// Whether the middle of each quarter of what a texel shows is outside of solids.
    fn is_clear(&self, map: &TexelMap, texel: usize) -> bool {
        let of_part = |part: &TexelPart| {
            let corners = part.corners(texel, map.texels);
            let middle = corners.iter().sum::<DVec2>() / corners.len() as f64;
            // Near the corners, where contacts lie.
            corners.iter().all(|corner| {
                let at = middle.lerp(*corner, 0.9);
                !self.is_inside(&map.triangles[part.triangle as usize].point(at))
            })
        };
        map.parts(texel).iter().all(of_part)
    }

    /// The cells of a part whose middles are outside.
    fn cells(&self, map: &TexelMap, texel: usize, part: &TexelPart) -> Vec<TexelPart> {
        let (corners, side) = (part.corners(texel, map.texels), 1.0 / CELLS as f64);
        let low = DVec2::new((texel % map.texels) as f64, (texel / map.texels) as f64);
        let cell = |k: usize| {
            let from = low + side * DVec2::new((k % CELLS) as f64, (k / CELLS) as f64);
            let polygon = within(&corners, from, from + side);
            let kept = TexelPart { triangle: part.triangle, polygon };
            if kept.polygon.len() < 3 || kept.area() <= 1e-7 {
                return None;
            }
            let middle = kept.polygon.iter().sum::<DVec2>() / kept.polygon.len() as f64;
            let points = kept.polygon.iter().map(|corner| middle.lerp(*corner, 0.95));
            let is_out = |at: DVec2| !self.is_inside(&map.triangles[part.triangle as usize].point(at));
            points.chain([middle]).all(is_out).then_some(kept)
        };
        (0..CELLS * CELLS).filter_map(cell).collect()
    }
}
