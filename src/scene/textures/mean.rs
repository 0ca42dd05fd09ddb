//! The mean of a texture over a triangle: exact, by Green's theorem.
//!
//! ```text
//! ∫∫ f dx dy = ∮ P dy,      P(x, y) = ∫ from the left of f(s, y) ds
//! ```
//!
//! Within a texel f is of first degree in x and in y, so P along an edge is of third degree at most, and two Gaussian
//! points integrate it from one texel's border to the next without error. P comes from running sums over the rows that
//! the triangle touches.
//!
//! Triangles on more than [`MOST`] texels read the means of squares of 8 x 8 texels (then 32 x 32, and so on) in place
//! of texels: squares that lie inside the triangle are exact, and of those on its outline, whose share of the triangle
//! is at most a quarter, what is missing is how much the texels within one square differ, in the part that the outline
//! cuts off. What one triangle has too much its neighbour has too little.
//!
//! What a pixel shows of a texture is a mean of many, so it reads squares from [`FEW`] texels on.
//!
//! Not handled: triangles whose coordinates lie on one line; they take the mean over some points.

use glam::{DVec2, DVec3};

use crate::scene::textures::stored_image::Cells;
use crate::scene::textures::texture::{Filter, Texture};

/// Texels of the rectangle around a triangle that are read one by one, at most.
const MOST: f64 = 32_768.0;
/// The same where the triangle is half of what a pixel sees: what the outline of one pixel has too much, which is a
/// hundredth of how much texels within a square differ, the next pixel has too little.
const FEW: f64 = 1024.0;
/// Points to a side of a triangle whose coordinates span no area.
const POINTS: u32 = 16;
/// Area of a triangle over the square of its extent below which its coordinates lie on one line.
const FLAT: f64 = 1e-7;
/// Gaussian points of the unit interval.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

impl Texture {
    /// The mean of linear RGB over a triangle of coordinates of vertices.
    pub fn mean(&self, triangle: [DVec2; 3]) -> DVec3 {
        self.mean_of_texels(triangle, MOST)
    }

    /// The mean of linear RGB over a triangle that is half of what a pixel sees.
    pub(crate) fn mean_in_pixel(&self, triangle: [DVec2; 3]) -> DVec3 {
        self.mean_of_texels(triangle, FEW)
    }

    /// The mean over a triangle that reads so many texels, or squares of them, at most.
    fn mean_of_texels(&self, triangle: [DVec2; 3], most: f64) -> DVec3 {
        let corners = triangle.map(|at| self.in_texels(at));
        let (low, high) = extent(corners);
        let extent = high - low;
        let area = 0.5 * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
        if !(area.abs() > FLAT * extent.length_squared() && area.abs() > 1e-12) {
            return subdivided(POINTS).map(|at| self.colour(weighted(triangle, at)).as_dvec3()).sum::<DVec3>()
                / f64::from(POINTS * POINTS);
        }
        let size = DVec2::new(self.image.width() as f64, self.image.height() as f64);
        let fits = |extent: DVec2| (extent.x + 2.0) * (extent.y + 2.0) <= most;
        if fits(extent) {
            return self.texels(corners);
        }
        for cells in self.image.means() {
            let scale = DVec2::new(cells.width as f64, cells.height as f64) / size;
            if fits(extent * scale) {
                return self.cells(cells, corners.map(|p| p * scale));
            }
        }
        self.image.mean().as_dvec3()
    }

    /// The mean over a triangle in texels.
    fn texels(&self, corners: [DVec2; 3]) -> DVec3 {
        let middles = if self.filter == Filter::Linear { corners.map(|p| p - 0.5) } else { corners };
        let value = |x, y| self.image.colour(x, y).as_dvec3();
        Window::new(middles, self.filter, self.wrapped([self.image.width(), self.image.height()]), value).mean(middles)
    }

    /// The mean over a triangle in cells.
    fn cells(&self, cells: &Cells, corners: [DVec2; 3]) -> DVec3 {
        let value = |x, y| cells.at(x, y).as_dvec3();
        Window::new(corners, Filter::Nearest, self.wrapped([cells.width, cells.height]), value).mean(corners)
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

fn extent(corners: [DVec2; 3]) -> (DVec2, DVec2) {
    let [a, b, c] = corners;
    (a.min(b).min(c), a.max(b).max(c))
}

/// The values around a triangle with their running sums along the rows.
struct Window {
    /// Column and row of the first value.
    first: [i64; 2],
    columns: usize,
    filter: Filter,
    /// Each value, and the integral over its row from the first one to it.
    values: Vec<(DVec3, DVec3)>,
}

impl Window {
    fn new(
        corners: [DVec2; 3],
        filter: Filter,
        wrapped: impl Fn(usize, i64) -> usize,
        value: impl Fn(usize, usize) -> DVec3,
    ) -> Window {
        let (low, high) = extent(corners);
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

    /// The mean over the triangle.
    fn mean(&self, [a, b, c]: [DVec2; 3]) -> DVec3 {
        // Sums are taken from one corner on, so that small triangles lose no digits.
        let area = 0.5 * (b - a).perp_dot(c - a);
        (self.along(a, b) + self.along(b, c) + self.along(c, a)) / area
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
    use crate::scene::textures::texture::Wrap;

    fn texture(width: usize, height: usize, filter: Filter, wrap: Wrap) -> Texture {
        let codes = (0..width * height * 3).map(|k| (k * k * 7 + k * 13) as u8).collect();
        let image = Arc::new(Image::new(Texels { width, height, channels: 3, codes }));
        Texture { image, placement: Texture::upright(DVec2::ONE, DVec2::ZERO), wrap: [wrap; 2], filter }
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
    fn a_plane_of_light_has_the_light_of_the_middle() {
        // Codes of one row that rise in linear light by nothing but their own steps: between two texels.
        let texels = Texels { width: 2, height: 1, channels: 1, codes: vec![0, 255] };
        let placement = Texture::upright(DVec2::ONE, DVec2::ZERO);
        let texture =
            Texture { image: Arc::new(Image::new(texels)), placement, wrap: [Wrap::Clamp; 2], filter: Filter::Linear };
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

    #[test]
    fn coordinates_on_one_line_take_the_mean_along_it() {
        let texture = texture(4, 4, Filter::Linear, Wrap::Repeat);
        let point = DVec2::new(0.3, 0.6);
        assert!(apart(texture.mean([point; 3]), texture.colour(point).as_dvec3()) < 1e-6);
        let line = [DVec2::ZERO, DVec2::new(0.5, 0.0), DVec2::new(1.0, 0.0)];
        assert!(texture.mean(line).is_finite());
    }
}
