//! Polygons to triangles, orientation kept, and their points in single precision, each once.
//!
//! Triangles pass as they are, convex quads become two; every other polygon is projected along its Newell normal
//! and goes through ear clipping, so concave ones come out right. A corner on the straight line between its
//! neighbours may be left out. Not handled: holes (OBJ has none); a polygon that crosses itself is cut as well as
//! possible, and reported; points that lie close together without being the same.
//!
//! Source: D. Eberly, *Triangulation by ear clipping*; the `earcut` crate. Only place for `earcut`.

use earcut::utils3d::project3d_to_2d;
use earcut::{Earcut, deviation};
use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

/// The most corners a polygon may have: ear clipping takes quadratic time where a polygon crosses itself.
pub(crate) const MOST_CORNERS: usize = 10_000;

/// Share of a polygon's area by which its triangles may differ from it before it counts as crossing itself.
const CROSSING: f64 = 1e-6;

/// Whether the triangles cover the polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cover {
    /// They do.
    Exact,
    /// The polygon crosses itself, so there is no answer.
    Crossing,
}

/// Triangulates one polygon after the other, reusing its buffers.
#[derive(Default)]
pub(crate) struct Triangulator {
    earcut: Earcut<f64>,
    ring: Vec<u32>,
    points: Vec<[f64; 3]>,
    flat: Vec<[f64; 2]>,
    cut: Vec<u32>,
    /// The triangles of the last polygon, as indices into its corners.
    pub triangles: Vec<[u32; 3]>,
}

impl Triangulator {
    /// Fills [`Self::triangles`]; none where the polygon has no area.
    pub(super) fn run(&mut self, polygon: &[DVec3]) -> Cover {
        self.triangles.clear();
        self.set_ring(polygon);
        match self.ring[..] {
            [] | [_] | [_, _] => Cover::Exact,
            [a, b, c] => {
                self.triangles.push([a, b, c]);
                Cover::Exact
            }
            [a, b, c, d] if is_convex_quad([a, b, c, d].map(|i| polygon[i as usize])) => {
                self.triangles.extend([[a, b, c], [a, c, d]]);
                Cover::Exact
            }
            _ => self.clip_ears(polygon),
        }
    }

    /// The corners without immediate repetitions.
    fn set_ring(&mut self, polygon: &[DVec3]) {
        self.ring.clear();
        for (i, point) in polygon.iter().enumerate() {
            if self.ring.last().is_none_or(|&last| polygon[last as usize] != *point) {
                self.ring.push(i as u32);
            }
        }
        while self.ring.len() > 1 && polygon[self.ring[self.ring.len() - 1] as usize] == polygon[self.ring[0] as usize]
        {
            self.ring.pop();
        }
    }

    fn clip_ears(&mut self, polygon: &[DVec3]) -> Cover {
        self.points.clear();
        self.points.extend(self.ring.iter().map(|&i| polygon[i as usize].to_array()));
        // Seen along its normal a polygon runs counter-clockwise.
        if !project3d_to_2d(&self.points, self.points.len(), &mut self.flat) {
            return Cover::Exact;
        }
        self.earcut.earcut_slice(&self.flat, &[], &mut self.cut);
        for triangle in self.cut.chunks_exact(3) {
            let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
            let [p, q, r] = [a, b, c].map(|i| self.flat[i as usize]);
            let turn = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            let oriented = if turn < 0.0 { [a, c, b] } else { [a, b, c] };
            self.triangles.push(oriented.map(|i| self.ring[i as usize]));
        }
        match deviation(self.flat.iter().copied(), &[], &self.cut) {
            d if d <= CROSSING => Cover::Exact,
            _ => Cover::Crossing,
        }
    }
}

/// Twice the vector area of a closed polygon (Newell): along its normal, as long as twice its area.
pub(crate) fn newell(polygon: &[DVec3]) -> DVec3 {
    let origin = polygon[0];
    let edges = polygon.windows(2).map(|edge| (edge[0] - origin).cross(edge[1] - origin));
    edges.sum()
}

/// Whether all four corners turn left about the quad's normal. Four left turns make one full turn, so it is simple.
fn is_convex_quad(quad: [DVec3; 4]) -> bool {
    let normal = newell(&quad);
    (0..4).all(|i| {
        let [before, here, after] = [quad[(i + 3) % 4], quad[i], quad[(i + 1) % 4]];
        (here - before).cross(after - here).dot(normal) > 0.0
    })
}

/// The least height of a triangle over its longest side, unit coordinates: the rounding of a coordinate near 1.
/// Thinner ones have no normal.
pub const THINNEST: f64 = 1.0 / (1 << 23) as f64;

/// Different points, by number.
#[derive(Default)]
pub(crate) struct Points {
    pub list: Vec<Vec3>,
    index: FxHashMap<[u32; 3], u32>,
}

impl Points {
    /// The number of a point, added if it is new.
    pub(super) fn number(&mut self, point: Vec3) -> u32 {
        // Adding zero makes -0 and 0 one point.
        let point = point + Vec3::ZERO;
        *self.index.entry(point.to_array().map(f32::to_bits)).or_insert_with(|| {
            self.list.push(point);
            self.list.len() as u32 - 1
        })
    }
}

/// Height of a triangle over its longest side: twice the area by the side.
pub(crate) fn height(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|v| v.as_dvec3());
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let double_area = (b - a).cross(c - a).length();
    if longest > 0.0 { double_area / longest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Vector area of the triangles, doubled.
    fn covered(polygon: &[DVec3], triangles: &[[u32; 3]]) -> (DVec3, f64) {
        let areas = triangles.iter().map(|t| newell(&t.map(|i| polygon[i as usize])));
        let list: Vec<DVec3> = areas.collect();
        (list.iter().sum(), list.iter().map(|a| a.length()).sum())
    }

    fn star(radii: &[f64]) -> Vec<DVec3> {
        let step = std::f64::consts::TAU / radii.len() as f64;
        let (u, v) = (DVec3::new(1.0, 2.0, -1.0).normalize(), DVec3::new(1.0, 0.0, 1.0).normalize());
        let points = radii.iter().enumerate().map(|(i, r)| {
            let (sin, cos) = (i as f64 * step).sin_cos();
            r * (cos * u + sin * v)
        });
        points.collect()
    }

    proptest! {
        /// A star-shaped polygon of any number of corners: signed and unsigned areas of the triangles are its own.
        #[test]
        fn stars_are_covered_exactly_once(radii in prop::collection::vec(0.1..1.0f64, 3..120)) {
            let polygon = star(&radii);
            let area = newell(&polygon);
            let mut triangulator = Triangulator::default();
            prop_assert_eq!(triangulator.run(&polygon), Cover::Exact);
            let (vector, total) = covered(&polygon, &triangulator.triangles);
            // Sums of n terms of size <= 1 in double precision.
            prop_assert!((vector - area).length() < 1e-12);
            prop_assert!((total - area.length()).abs() < 1e-12);
        }
    }

    #[test]
    fn a_fan_would_be_wrong_for_this_arrow() {
        let arrow = [(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (0.5, 1.0)].map(|(x, y)| DVec3::new(x, y, 3.0));
        let mut triangulator = Triangulator::default();
        for start in 0..4 {
            let mut turned = arrow;
            turned.rotate_left(start);
            assert_eq!(triangulator.run(&turned), Cover::Exact);
            assert_eq!(covered(&turned, &triangulator.triangles), (DVec3::new(0.0, 0.0, 3.0), 3.0));
        }
    }

    #[test]
    fn crossing_polygons_are_reported() {
        let pentagram: Vec<DVec3> = (0..5).map(|i| star(&[1.0; 5])[i * 2 % 5]).collect();
        let mut triangulator = Triangulator::default();
        assert_eq!(triangulator.run(&pentagram), Cover::Crossing);
    }

    #[test]
    fn polygons_without_area_give_no_triangle_with_area() {
        let mut triangulator = Triangulator::default();
        let line: Vec<DVec3> = (0..6).map(|i| DVec3::splat(f64::from(i % 4))).collect();
        triangulator.run(&line);
        assert!(covered(&line, &triangulator.triangles).1 < 1e-15);
        triangulator.run(&[DVec3::ONE; 5]);
        assert!(triangulator.triangles.is_empty());
    }
}
