//! What each texel of a map shows: the parts of the triangles that lie in it, by area.
//!
//! ```text
//! x(p) = x_0 + p.x d_u + p.y d_v        p in texels, one affine map a triangle
//! ```
//!
//! A texel that a chart's border crosses shows what of the chart lies in it, so that it has no light from elsewhere.
//!
//! Not handled: which parts are inside of solids; [`crate::visible`] takes them out.

use glam::{DVec2, DVec3, Vec2};
use halflight::pictures::Size;
use halflight::surfaces::{Atlas, SurfacePoint};
use rayon::prelude::*;

use crate::clip::{doubled_area, within};

/// A triangle in the map and in space.
#[derive(Clone, Debug)]
pub(crate) struct LaidTriangle {
    /// Corners in the map, texels.
    pub places: [DVec2; 3],
    /// Normal of the side that is shown, unit length.
    pub normal: DVec3,
    /// The point in space of texel coordinates 0, and what a texel right and down adds; unit coordinates.
    origin: DVec3,
    across: DVec3,
    down: DVec3,
}

impl LaidTriangle {
    /// Of corners in the map and in unit coordinates; none where it has no area in the map.
    pub(crate) fn new(places: [DVec2; 3], corners: [DVec3; 3], normal: DVec3) -> Option<LaidTriangle> {
        let [a, b, c] = places;
        let (u, v) = (b - a, c - a);
        let area = u.perp_dot(v);
        if !(area.abs() > 1e-12 && area.is_finite()) {
            return None;
        }
        let (du, dv) = (corners[1] - corners[0], corners[2] - corners[0]);
        let across = (du * v.y - dv * u.y) / area;
        let down = (dv * u.x - du * v.x) / area;
        let origin = corners[0] - a.x * across - a.y * down;
        Some(LaidTriangle { places, normal, origin, across, down })
    }

    /// The point in space of a point in the map.
    pub(crate) fn point(&self, at: DVec2) -> SurfacePoint {
        let position = self.origin + at.x * self.across + at.y * self.down;
        SurfacePoint { position: position.as_vec3(), normal: self.normal.as_vec3(), face: SurfacePoint::NO_FACE }
    }

    /// How wide a texel is, unit coordinates.
    fn width(&self) -> f64 {
        self.across.cross(self.down).length().sqrt()
    }
}

/// A part of a triangle in a texel.
#[derive(Clone, Debug)]
pub(crate) struct TexelPart {
    pub triangle: u32,
    /// Its corners in the map; none where it is the whole texel.
    pub polygon: Vec<DVec2>,
}

impl TexelPart {
    /// Corners in the map.
    pub(crate) fn corners(&self, texel: usize, texels: usize) -> Vec<DVec2> {
        if !self.polygon.is_empty() {
            return self.polygon.clone();
        }
        let low = corner(texel, texels);
        vec![low, low + DVec2::X, low + DVec2::ONE, low + DVec2::Y]
    }

    /// Share of the texel.
    pub(crate) fn area(&self) -> f64 {
        if self.polygon.is_empty() { 1.0 } else { 0.5 * doubled_area(&self.polygon).abs() }
    }

    /// The point in the map that belongs to a place in the unit square.
    fn place(&self, texel: usize, texels: usize, at: DVec2) -> DVec2 {
        if self.polygon.is_empty() {
            return corner(texel, texels) + at;
        }
        let first = self.polygon[0];
        let all = self.area();
        let mut left = at.x * all;
        let mut chosen = [first; 3];
        for next in self.polygon[1..].windows(2) {
            chosen = [first, next[0], next[1]];
            let own = 0.5 * doubled_area(&chosen).abs();
            if left < own {
                left = (left / own).clamp(0.0, 1.0);
                break;
            }
            left = (left - own).max(0.0);
        }
        // Equal areas of the square are equal areas of the triangle.
        let (root, [a, b, c]) = (left.min(1.0).sqrt(), chosen);
        a * (1.0 - root) + root * (b * (1.0 - at.y) + c * at.y)
    }
}

/// The upper left corner of a texel.
fn corner(texel: usize, texels: usize) -> DVec2 {
    DVec2::new((texel % texels) as f64, (texel / texels) as f64)
}

/// Smaller parts of a texel are rounding.
const LEAST: f64 = 1e-6;

/// What all texels of a square map show.
#[derive(Clone, Debug)]
pub(crate) struct TexelMap {
    /// Texels to a side.
    pub texels: usize,
    pub triangles: Vec<LaidTriangle>,
    /// Where the parts of each texel begin.
    starts: Vec<u32>,
    parts: Vec<TexelPart>,
}

impl TexelMap {
    /// The map of triangles.
    pub(crate) fn new(texels: usize, triangles: Vec<LaidTriangle>) -> TexelMap {
        let of_triangle = |(number, laid): (usize, &LaidTriangle)| parts_of(texels, number as u32, laid);
        let mut all: Vec<(u32, TexelPart)> = triangles.par_iter().enumerate().flat_map_iter(of_triangle).collect();
        all.par_sort_by_key(|(texel, part)| (*texel, part.triangle));
        TexelMap::sorted(texels, triangles, all)
    }

    /// The same with other parts, sorted by texel.
    pub(crate) fn with_parts(self, parts: Vec<(u32, TexelPart)>) -> TexelMap {
        TexelMap::sorted(self.texels, self.triangles, parts)
    }

    fn sorted(texels: usize, triangles: Vec<LaidTriangle>, all: Vec<(u32, TexelPart)>) -> TexelMap {
        let mut starts = vec![0; texels * texels + 1];
        all.iter().for_each(|(texel, _)| starts[*texel as usize + 1] += 1);
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        TexelMap { texels, triangles, starts, parts: all.into_iter().map(|(_, part)| part).collect() }
    }

    /// What a texel shows.
    pub(crate) fn parts(&self, texel: usize) -> &[TexelPart] {
        &self.parts[self.starts[texel] as usize..self.starts[texel + 1] as usize]
    }

    /// The share of a texel that shows something.
    pub(crate) fn coverage(&self, texel: usize) -> f64 {
        self.parts(texel).iter().map(TexelPart::area).sum()
    }

    /// The point of a texel nearest to its middle that it shows, and how far from the middle that is, texels.
    pub(crate) fn middle(&self, texel: usize) -> Option<(SurfacePoint, f64)> {
        let middle = corner(texel, self.texels) + 0.5;
        let of = |part: &TexelPart| {
            let corners = part.corners(texel, self.texels);
            let turn = doubled_area(&corners).signum();
            let next = |k: usize| corners[(k + 1) % corners.len()];
            let is_in = (0..corners.len()).all(|k| turn * (next(k) - corners[k]).perp_dot(middle - corners[k]) >= 0.0);
            let center = corners.iter().sum::<DVec2>() / corners.len() as f64;
            let place = if is_in { middle } else { center };
            (self.triangles[part.triangle as usize].point(place), place.distance(middle))
        };
        self.parts(texel).iter().map(of).min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The parts of one triangle.
fn parts_of(texels: usize, number: u32, laid: &LaidTriangle) -> Vec<(u32, TexelPart)> {
    let [a, b, c] = laid.places;
    let turn = doubled_area(&laid.places).signum();
    let most = texels as f64;
    let (low, high) = (a.min(b).min(c).clamp(DVec2::ZERO, DVec2::splat(most)), a.max(b).max(c));
    let high = high.clamp(DVec2::ZERO, DVec2::splat(most));
    let edges = [(a, b), (b, c), (c, a)];
    let mut all = Vec::new();
    for y in low.y as usize..high.y.ceil() as usize {
        for x in low.x as usize..high.x.ceil() as usize {
            let corner = DVec2::new(x as f64, y as f64);
            // Least and largest of each edge function over the texel.
            let side = |(from, to): (DVec2, DVec2)| {
                let (way, at) = (turn * (to - from), corner - from);
                let middle = way.perp_dot(at + 0.5);
                let reach = 0.5 * (way.x.abs() + way.y.abs());
                [middle - reach, middle + reach]
            };
            let sides = edges.map(side);
            if sides.iter().any(|[_, most]| *most <= 0.0) {
                continue;
            }
            let is_whole = sides.iter().all(|[least, _]| *least >= 0.0);
            let polygon = if is_whole { Vec::new() } else { within(&laid.places, corner, corner + DVec2::ONE) };
            let part = TexelPart { triangle: number, polygon };
            if is_whole || (part.polygon.len() > 2 && part.area() > LEAST) {
                all.push(((y * texels + x) as u32, part));
            }
        }
    }
    all
}

impl Atlas for TexelMap {
    fn size(&self) -> Size {
        Size { width: self.texels, height: self.texels }
    }

    fn point(&self, texel: usize, at: Vec2) -> Option<SurfacePoint> {
        let (parts, mut at) = (self.parts(texel), at.as_dvec2());
        let part = match parts {
            [] => return None,
            [part] => part,
            parts => {
                let all: f64 = parts.iter().map(TexelPart::area).sum();
                let mut left = at.x * all;
                let mut chosen = &parts[0];
                for part in parts {
                    chosen = part;
                    if left < part.area() {
                        break;
                    }
                    left -= part.area();
                }
                at.x = (left / chosen.area()).clamp(0.0, 1.0);
                chosen
            }
        };
        Some(self.triangles[part.triangle as usize].point(part.place(texel, self.texels, at)))
    }

    fn width(&self, texel: usize) -> f64 {
        self.parts(texel).first().map_or(0.0, |part| self.triangles[part.triangle as usize].width())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle in a plane z = 0.5 on which a texel is 0.1 wide.
    fn laid(places: [[f64; 2]; 3]) -> LaidTriangle {
        let places = places.map(DVec2::from);
        LaidTriangle::new(places, places.map(|p| (0.1 * p).extend(0.5)), DVec3::Z).expect("an area")
    }

    #[test]
    fn areas_add_up_and_points_lie_where_they_should() {
        let map = TexelMap::new(
            16,
            vec![laid([[1.0, 1.0], [9.5, 1.0], [9.5, 7.25]]), laid([[1.0, 1.0], [9.5, 7.25], [1.0, 7.25]])],
        );
        let all: f64 = (0..256).map(|texel| map.coverage(texel)).sum();
        assert!((all - 8.5 * 6.25).abs() < 1e-9, "{all}");
        assert!((map.width(17) - 0.1).abs() < 1e-12);
        for texel in (0..256).filter(|texel| map.coverage(*texel) > 0.0) {
            let low = corner(texel, 16);
            for at in [[0.01, 0.3], [0.5, 0.5], [0.99, 0.9]] {
                let point = map.point(texel, Vec2::from(at)).expect("covered").position.as_dvec3() * 10.0;
                assert!((point.truncate() - low).cmpge(DVec2::splat(-1e-5)).all(), "{point} {low}");
                assert!((point.truncate() - low).cmple(DVec2::splat(1.0 + 1e-5)).all());
                assert!(point.x <= 9.5 + 1e-5 && point.y <= 7.25 + 1e-5 && (point.z - 5.0).abs() < 1e-5);
            }
        }
        assert!(map.point(0, Vec2::splat(0.5)).is_none());
    }

    /// The mean of a linear function over evenly spread places is its mean over what the texel shows.
    #[test]
    fn equal_areas_of_the_square_are_equal_areas_of_what_is_shown() {
        let map = TexelMap::new(
            4,
            vec![laid([[1.0, 1.0], [1.8, 1.0], [1.0, 1.6]]), laid([[1.9, 1.9], [1.9, 1.2], [1.4, 1.9]])],
        );
        const SIDE: u32 = 400;
        let places =
            (0..SIDE * SIDE).map(|k| Vec2::new((k % SIDE) as f32 + 0.5, (k / SIDE) as f32 + 0.5) / SIDE as f32);
        let sum: DVec3 = places.map(|at| map.point(5, at).expect("shown").position.as_dvec3()).sum();
        let [a, b] = [(0.24, DVec2::new(3.8, 3.6) / 3.0), (0.175, DVec2::new(5.2, 5.0) / 3.0)];
        let exact = 0.1 * (a.0 * a.1 + b.0 * b.1) / (a.0 + b.0);
        let mean = (sum / f64::from(SIDE * SIDE)).truncate();
        assert!((mean - exact).abs().max_element() < 1e-4, "{mean} {exact}");
    }
}
