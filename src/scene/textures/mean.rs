//! The mean of a texture over a triangle, or over what a pixel sees of it: by its texels, or by means of squares of
//! them.
//!
//! The integral of a grid of values over a polygon is exact, by Green's theorem:
//!
//! ```text
//! ∫∫ f dx dy = ∮ P dy,      P(x, y) = ∫ from the left of f(s, y) ds
//! ```
//!
//! Within a texel f is of first degree in x and in y, so P along an edge is of third degree at most, and two Gaussian
//! points integrate it from one texel's border to the next without error. P comes from running sums over the rows that
//! the polygon touches.
//!
//! Triangles on more than [`MOST`] texels read the means of squares of 8 x 8 texels (then 32 x 32, and so on) in place
//! of texels: squares that lie inside the triangle are exact, and of those on its outline, whose share of the triangle
//! is at most a quarter, what is missing is how much the texels within one square differ, in the part that the outline
//! cuts off. What one triangle has too much its neighbour has too little. What a pixel shows of a texture is a mean of
//! many, so it reads squares from [`FEW`] texels on.
//!
//! Where the texels at the edge of an image go on beyond it, what lies inside of the image and what lies beyond each
//! edge are parts of their own. Beyond an edge nothing changes across it, so a part there is pressed into the outer
//! half of the texels at the edge, which leaves its mean as it is and few texels to read.
//!
//! Not handled: triangles whose coordinates lie on one line, which take the mean over some points; where an image goes
//! on beyond one edge and is repeated many times along it, means of squares stand for the texels at that edge.

use glam::{DVec2, DVec3};
use smallvec::SmallVec;

use crate::scene::bounds::Bounds;
use crate::scene::convex_polygon::{area, clip, edges};
use crate::scene::textures::stored_image::Cells;
use crate::scene::textures::texture::{Filter, Texture, Wrap};

/// Texels of the rectangle around a triangle that are read one by one, at most.
const MOST: f64 = 32_768.0;
/// Texels read one by one at most for what a pixel sees: what the outline of one pixel has too much, some hundredth of
/// how much texels within a square differ, the next pixel has too little.
const FEW: f64 = 1024.0;
/// Points to a side of a triangle whose coordinates span no area.
const POINTS: u32 = 16;
/// Area of a triangle over the square of its extent below which its coordinates lie on one line.
const FLAT: f64 = 1e-7;

/// Area in texels below which rounding leaves no mean.
const LEAST: f64 = 1e-12;

/// Gaussian points of the unit interval.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

impl Texture {
    /// The mean of linear RGB over a triangle of coordinates of vertices.
    pub fn mean(&self, triangle: [DVec2; 3]) -> DVec3 {
        self.mean_within(&triangle, MOST).unwrap_or_else(|| {
            let points = subdivided(POINTS).map(|at| self.colour(weighted(triangle, at)).as_dvec3());
            points.sum::<DVec3>() / f64::from(POINTS * POINTS)
        })
    }

    /// The mean of linear RGB over a quadrangle of coordinates that a pixel or a part of it sees.
    pub(crate) fn mean_in_pixel(&self, quadrangle: [DVec2; 4]) -> DVec3 {
        let [a, b, c, d] = quadrangle;
        let halves = || 0.5 * (self.mean([a, b, c]) + self.mean([a, c, d]));
        self.mean_of_part(&quadrangle).unwrap_or_else(halves)
    }

    /// The mean of linear RGB over a convex polygon of coordinates that a pixel sees; none where its corners lie on one
    /// line.
    pub(crate) fn mean_of_part(&self, polygon: &[DVec2]) -> Option<DVec3> {
        self.mean_within(polygon, FEW)
    }

    /// How many texels lie on a triangle of coordinates of vertices.
    pub(crate) fn texels_of(&self, triangle: [DVec2; 3]) -> f64 {
        area(&triangle.map(|at| self.in_texels(at))).abs()
    }

    /// The mean over a polygon that reads so many texels, or squares of them, at most; none where its corners lie on
    /// one line.
    fn mean_within(&self, polygon: &[DVec2], most: f64) -> Option<DVec3> {
        let corners: SmallVec<[DVec2; 7]> = polygon.iter().map(|&at| self.in_texels(at)).collect();
        let area = area(&corners).abs();
        let has_area = area > FLAT * Bounds::of(corners.iter().copied()).size().length_squared() && area > LEAST;
        has_area.then(|| self.mean_in_texels(&corners, most))
    }

    /// The mean over a polygon in texels that has an area.
    fn mean_in_texels(&self, corners: &[DVec2], most: f64) -> DVec3 {
        let bounds = Bounds::of(corners.iter().copied());
        let Bounds { low, high } = bounds;
        let size = self.size();
        let fits = |extent: DVec2| (extent.x + 2.0) * (extent.y + 2.0) <= most;
        if fits(bounds.size()) {
            return self.texels(corners);
        }
        let leaves = |axis: usize| self.wrap[axis] == Wrap::Clamp && (low[axis] < 0.0 || high[axis] > size[axis]);
        if leaves(0) || leaves(1) {
            return self.mean_of_parts(&parts(corners, self.wrap, size), most);
        }
        for cells in self.image.means() {
            let scale = DVec2::new(cells.width as f64, cells.height as f64) / size;
            if fits(bounds.size() * scale) {
                return self.cells(cells, corners.iter().map(|p| *p * scale).collect());
            }
        }
        self.image.mean().as_dvec3()
    }

    /// The mean over parts of a polygon.
    fn mean_of_parts(&self, parts: &[Part], most: f64) -> DVec3 {
        // Of a part beyond an edge a row or a column of the image is read whole.
        let whole = most.max(3.0 * (self.size().max_element() + 2.0));
        let mean = |part: &Part| self.mean_in_texels(&part.corners, if part.is_beyond { whole } else { most });
        let total: f64 = parts.iter().map(|part| part.area).sum();
        let sum: DVec3 = parts.iter().map(|part| part.area * mean(part)).sum();
        if total > 0.0 { sum / total } else { self.image.mean().as_dvec3() }
    }

    /// Columns and rows of texels.
    fn size(&self) -> DVec2 {
        DVec2::new(self.image.width() as f64, self.image.height() as f64)
    }

    /// The mean over a polygon in texels.
    fn texels(&self, corners: &[DVec2]) -> DVec3 {
        let off = if self.filter == Filter::Linear { 0.5 } else { 0.0 };
        let middles: Vec<DVec2> = corners.iter().map(|p| *p - off).collect();
        let value = |x, y| self.image.colour(x, y).as_dvec3();
        let wrapped = self.wrapped([self.image.width(), self.image.height()]);
        Window::new(&middles, self.filter, wrapped, value).mean(&middles)
    }

    /// The mean over a polygon in cells.
    fn cells(&self, cells: &Cells, corners: Vec<DVec2>) -> DVec3 {
        let value = |x, y| cells.at(x, y).as_dvec3();
        let wrapped = self.wrapped([cells.width, cells.height]);
        Window::new(&corners, Filter::Nearest, wrapped, value).mean(&corners)
    }

    /// The column (axis 0) or row (axis 1) that stands at an index of a grid of this size.
    fn wrapped(&self, size: [usize; 2]) -> impl Fn(usize, i64) -> usize {
        let wrap = self.wrap;
        move |axis, i| wrap[axis].index(i, size[axis])
    }
}

/// The point of a triangle with these weights of the second and third corner.
pub(crate) fn weighted(triangle: [DVec2; 3], at: DVec2) -> DVec2 {
    triangle[0] + at.x * (triangle[1] - triangle[0]) + at.y * (triangle[2] - triangle[0])
}

/// Weights of the middles of the n² equal triangles that a triangle is made of.
pub(crate) fn subdivided(n: u32) -> impl Iterator<Item = DVec2> {
    let rows = move |i: u32| (0..2 * (n - i) - 1).map(move |k| (i, k));
    (0..n).flat_map(rows).map(move |(i, k)| {
        let off = if k.is_multiple_of(2) { 1.0 / 3.0 } else { 2.0 / 3.0 };
        DVec2::new(f64::from(k / 2) + off, f64::from(i) + off) / f64::from(n)
    })
}

/// What of a polygon lies inside of an image or beyond one of its edges.
struct Part {
    /// Its corners in texels, within the image.
    corners: Vec<DVec2>,
    /// The area that it stands for.
    area: f64,
    /// Whether it lies beyond an edge.
    is_beyond: bool,
}

/// The parts of a convex polygon in texels of an image of some size; without those too small for a mean.
fn parts(corners: &[DVec2], wrap: [Wrap; 2], size: DVec2) -> Vec<Part> {
    let mut found = Vec::new();
    for column in bands(wrap[0], size.x) {
        for row in bands(wrap[1], size.y) {
            let mut part = clip(&clip(corners, DVec2::X, column), DVec2::Y, row);
            if part.len() < 3 {
                continue;
            }
            let own = area(&part).abs();
            press(&mut part, 0, column);
            press(&mut part, 1, row);
            if area(&part).abs() > LEAST {
                let is_beyond = [column, row].iter().any(|[low, high]| low.is_some() != high.is_some());
                found.push(Part { corners: part, area: own, is_beyond });
            }
        }
    }
    found
}

/// From where to where the bands before, inside of and after an image of so many texels are; one band for all where the
/// image is repeated.
fn bands(wrap: Wrap, size: f64) -> Vec<[Option<f64>; 2]> {
    match wrap {
        Wrap::Clamp => vec![[None, Some(0.0)], [Some(0.0), Some(size)], [Some(size), None]],
        Wrap::Repeat | Wrap::Mirror => vec![[None, None]],
    }
}

/// Presses what lies in a band along an axis into the image.
fn press(part: &mut [DVec2], axis: usize, band: [Option<f64>; 2]) {
    let (edge, inward) = match band {
        [None, None] => return,
        // Rounding may leave a corner beyond the edge that it was cut at.
        [Some(low), Some(high)] => return part.iter_mut().for_each(|p| p[axis] = p[axis].clamp(low, high)),
        // The outer half of the texel at the edge is like all beyond it.
        [None, Some(high)] => (high, 0.5),
        [Some(low), None] => (low, -0.5),
    };
    let far = part.iter().map(|p| (p[axis] - edge).abs()).fold(1.0, f64::max);
    part.iter_mut().for_each(|p| p[axis] = edge + inward * (p[axis] - edge).abs() / far);
}

/// The values around a polygon with their running sums along the rows.
struct Window {
    /// Column and row of the first value.
    first: [i64; 2],
    columns: usize,
    filter: Filter,
    /// Each value, and the integral over its row from the first one to it.
    values: Vec<(DVec3, DVec3)>,
}

impl Window {
    /// The values that a polygon touches: `value(x, y)` at the texels that `wrapped(axis, index)` gives.
    fn new(
        corners: &[DVec2],
        filter: Filter,
        wrapped: impl Fn(usize, i64) -> usize,
        value: impl Fn(usize, usize) -> DVec3,
    ) -> Window {
        let Bounds { low, high } = Bounds::of(corners.iter().copied());
        let first = [low.x.floor() as i64, low.y.floor() as i64];
        let last = [high.x.floor() as i64 + 1, high.y.floor() as i64 + 1];
        let columns = (last[0] - first[0] + 1) as usize;
        let mut values = Vec::with_capacity(columns * (last[1] - first[1] + 1) as usize);
        let across: Vec<usize> = (first[0]..=last[0]).map(|x| wrapped(0, x)).collect();
        for y in first[1]..=last[1] {
            let row = wrapped(1, y);
            let (mut sum, mut before) = (DVec3::ZERO, None);
            for &x in &across {
                let own = value(x, row);
                sum += match before {
                    None => DVec3::ZERO,
                    Some(before) if filter == Filter::Linear => 0.5 * (before + own),
                    Some(before) => before,
                };
                values.push((own, sum));
                before = Some(own);
            }
        }
        Window { first, columns, filter, values }
    }

    /// The mean over the polygon.
    fn mean(&self, corners: &[DVec2]) -> DVec3 {
        edges(corners).map(|(a, b)| self.along(a, b)).sum::<DVec3>() / area(corners)
    }

    /// `∫ P dy` along an edge.
    fn along(&self, a: DVec2, b: DVec2) -> DVec3 {
        let step = b - a;
        let (mut sum, mut t) = (DVec3::ZERO, 0.0);
        let mut next = [0, 1].map(|axis| Borders::new(a[axis], step[axis]));
        while t < 1.0 {
            let until = next[0].t.min(next[1].t).min(1.0);
            if until > t {
                let cell = (a + 0.5 * (t + until) * step).floor();
                let points = GAUSS.map(|g| self.integral(cell, a + (t + g * (until - t)) * step));
                sum += 0.5 * step.y * (until - t) * (points[0] + points[1]);
            }
            t = until;
            next.iter_mut().for_each(|borders| borders.pass(until));
        }
        sum
    }

    /// P at a point of a cell.
    fn integral(&self, cell: DVec2, at: DVec2) -> DVec3 {
        let share = at - cell;
        let k = |row: i64| {
            let (x, y) = (cell.x as i64 - self.first[0], cell.y as i64 - self.first[1] + row);
            y.max(0) as usize * self.columns + x.max(0) as usize
        };
        let row = |row: i64| {
            let k = k(row).min(self.values.len() - 2);
            let ((own, before), (other, _)) = (self.values[k], self.values[k + 1]);
            let bend =
                if self.filter == Filter::Linear { 0.5 * share.x * share.x * (other - own) } else { DVec3::ZERO };
            before + share.x * own + bend
        };
        if self.filter == Filter::Linear { row(0).lerp(row(1), share.y) } else { row(0) }
    }
}

/// Where an edge crosses the whole numbers along one axis, as parameters of the edge.
struct Borders {
    /// The next crossing.
    t: f64,
    start: f64,
    step: f64,
    /// The number crossed next.
    number: f64,
}

impl Borders {
    fn new(start: f64, step: f64) -> Borders {
        let number = if step > 0.0 { start.floor() + 1.0 } else { start.ceil() - 1.0 };
        Borders { t: if step == 0.0 { f64::INFINITY } else { (number - start) / step }, start, step, number }
    }

    fn pass(&mut self, t: f64) {
        while self.t <= t {
            self.number += self.step.signum();
            self.t = (self.number - self.start) / self.step;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::*;
    use crate::pictures::Texels;
    use crate::scene::textures::stored_image::Image;

    fn of(texels: Texels, filter: Filter, wrap: Wrap) -> Texture {
        let placement = Texture::upright(DVec2::ONE, DVec2::ZERO);
        Texture { image: Arc::new(Image::new(texels)), placement, wrap: [wrap; 2], filter }
    }

    fn texture(width: usize, height: usize, filter: Filter, wrap: Wrap) -> Texture {
        let codes = (0..width * height * 3).map(|k| (k * k * 7 + k * 13) as u8).collect();
        of(Texels { width, height, channels: 3, codes }, filter, wrap)
    }

    /// By 1024² points.
    fn sampled(texture: &Texture, triangle: [DVec2; 3]) -> DVec3 {
        const N: u32 = 1024;
        let sum: DVec3 = subdivided(N).map(|at| texture.colour(weighted(triangle, at)).as_dvec3()).sum();
        sum / f64::from(N * N)
    }

    fn apart(a: DVec3, b: DVec3) -> f64 {
        (a - b).abs().max_element()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn the_mean_is_that_of_many_points(corners in prop::array::uniform3(prop::array::uniform2(-1.5..2.5f64))) {
            let triangle = corners.map(DVec2::from_array);
            for filter in [Filter::Linear, Filter::Nearest] {
                for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                    let texture = texture(5, 3, filter, wrap);
                    // A million points see the borders of texels within 1e-3 of their length.
                    let (found, expected) = (texture.mean(triangle), sampled(&texture, triangle));
                    prop_assert!(apart(found, expected) < 1e-3, "{filter:?} {wrap:?} {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn the_mean_over_what_a_pixel_sees_is_that_of_its_halves() {
        for (filter, wrap) in
            [(Filter::Linear, Wrap::Repeat), (Filter::Nearest, Wrap::Mirror), (Filter::Linear, Wrap::Clamp)]
        {
            let texture = texture(64, 48, filter, wrap);
            let [a, b, c, d] = [(0.1, 0.2), (0.4, 0.15), (0.5, 0.4), (0.2, 0.5)].map(|(x, y)| DVec2::new(x, y));
            let halves = [[a, b, c], [a, c, d]].map(|half| (texture.mean(half), area(&half)));
            let expected = (halves[0].0 * halves[0].1 + halves[1].0 * halves[1].1) / area(&[a, b, c, d]);
            assert!(apart(texture.mean_in_pixel([a, b, c, d]), expected) < 1e-12);
            // Repeated until squares of texels stand for them: by chance of the part of a square that lies outside.
            let large = [a, b, c, d].map(|p| 5.0 * p);
            let halves =
                [[0, 1, 2], [0, 2, 3]].map(|k| k.map(|k: usize| large[k])).map(|h| (texture.mean(h), area(&h)));
            let expected = (halves[0].0 * halves[0].1 + halves[1].0 * halves[1].1) / area(&large);
            assert!(apart(texture.mean_in_pixel(large), expected) < 0.02, "{filter:?}");
            // On one line, where there is no area to take a mean over.
            assert!(texture.mean_in_pixel([a, b, b, a]).is_finite());
        }
    }

    #[test]
    fn a_plane_of_light_has_the_light_of_the_middle() {
        // Codes of one row that rise in linear light by nothing but their own steps: between two texels.
        let texels = Texels { width: 2, height: 1, channels: 1, codes: vec![0, 255] };
        let texture = of(texels, Filter::Linear, Wrap::Clamp);
        let triangle = [DVec2::new(0.3, 0.1), DVec2::new(0.7, 0.2), DVec2::new(0.44, 5.0)];
        let middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
        assert!((texture.mean(triangle).x - 2.0 * (middle.x - 0.25)).abs() < 1e-12);
        let turned = [triangle[1], triangle[0], triangle[2]];
        assert!(apart(texture.mean(triangle), texture.mean(turned)) < 1e-12);
    }

    #[test]
    fn squares_stand_for_texels_within_the_bound() {
        let texture = texture(512, 384, Filter::Linear, Wrap::Repeat);
        let square = |a: f64, side: f64| {
            let p = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)].map(|(x, y)| DVec2::new(a + x, 0.3 * a + y));
            0.5 * (texture.mean([p[0], p[1], p[2]]) + texture.mean([p[0], p[2], p[3]]))
        };
        let all = texture.image.mean().as_dvec3();
        // Whole periods, by squares of each size and by the mean alone: halves err by opposite amounts.
        for periods in [1.0, 3.0, 40.0, 3000.0] {
            assert!(apart(square(0.0, periods), all) < 2e-3, "{periods} {}", apart(square(0.0, periods), all));
        }
        let triangle = [DVec2::new(0.11, 0.13), DVec2::new(0.93, 0.2), DVec2::new(0.4, 0.97)];
        assert!(apart(texture.mean(triangle), sampled(&texture, triangle)) < 4e-3);
    }

    /// Squares once stood for the texels at the edge as well: a poster whose dark rim went on was a quarter too bright
    /// on large patches, and the whole picture 1.6 % off.
    #[test]
    fn texels_at_the_edge_go_on_beyond_it_however_large_the_triangle() {
        // Dark at the rim, noise within.
        let (width, height) = (200, 136);
        let rim = |x: usize, y: usize| x == 0 || y == 0 || x == width - 1 || y == height - 1;
        let code = |k: usize| if rim(k % width, k / width) { 20 } else { (k * k % 256) as u8 };
        let codes: Vec<u8> = (0..width * height).map(code).collect();
        let texels = Texels { width, height, channels: 1, codes };
        let size = DVec2::new(width as f64, height as f64);
        for filter in [Filter::Linear, Filter::Nearest] {
            for side in [3.0, 20.0, 1e4] {
                let clamped = of(texels.clone(), filter, Wrap::Clamp);
                let image = clamped.image.clone();
                let edge = image.colour(0, 0).as_dvec3();
                let [low, high] = [0.5 - 0.5 * side, 0.5 + 0.5 * side];
                let corners = [(low, low), (high, low), (high, high), (low, high)].map(|(x, y)| DVec2::new(x, y));
                let [a, b, c, d] = corners;
                let found = 0.5 * (clamped.mean([a, b, c]) + clamped.mean([a, c, d]));
                // All of the image, and its rim everywhere else; interpolation takes from the rim what it gives to it.
                let inside =
                    clamped.mean_in_texels(&[DVec2::ZERO, DVec2::new(size.x, 0.0), size, DVec2::new(0.0, size.y)], 1e9);
                let expected = edge + (inside - edge) / (side * side);
                // Halves of the square cut squares of texels by opposite amounts.
                let bound = 2e-3 / (side * side) + 1e-7;
                assert!(apart(found, expected) < bound, "{filter:?} {side}: {found} {expected}");
                let pixel = clamped.mean_in_pixel(corners);
                assert!(apart(pixel, expected) < bound, "{filter:?} {side}: {pixel} {expected}");
                // Repeated upwards, its columns at the edges go on to both sides.
                let repeated = Texture { wrap: [Wrap::Clamp, Wrap::Repeat], ..clamped };
                let column =
                    |x: usize| (0..height).map(|y| image.colour(x, y).as_dvec3()).sum::<DVec3>() / height as f64;
                let periods = [(low, 0.0), (high, 0.0), (high, 2.0), (low, 2.0)].map(|(x, y)| DVec2::new(x, y));
                let beyond = 0.5 * (column(0) + column(width - 1));
                let expected = beyond + (inside - beyond) / side;
                let found = repeated.mean_in_pixel(periods);
                assert!(apart(found, expected) < 2e-2 / side, "{filter:?} {side}: {found} {expected}");
            }
        }
    }

    #[test]
    fn coordinates_on_one_line_take_the_mean_along_it() {
        let texture = texture(4, 4, Filter::Linear, Wrap::Repeat);
        let point = DVec2::new(0.3, 0.6);
        assert!(apart(texture.mean([point; 3]), texture.colour(point).as_dvec3()) < 1e-6);
        let line = [DVec2::ZERO, DVec2::new(0.5, 0.0), DVec2::new(1.0, 0.0)];
        assert!(texture.mean(line).is_finite());
    }
}
