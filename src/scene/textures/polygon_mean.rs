//! The integral of a grid of values over a polygon: exact, by Green's theorem.
//!
//! ```text
//! ∫∫ f dx dy = ∮ P dy,      P(x, y) = ∫ from the left of f(s, y) ds
//! ```
//!
//! Within a texel f is of first degree in x and in y, so P along an edge is of third degree at most, and two Gaussian
//! points integrate it from one texel's border to the next without error. P comes from running sums over the rows that
//! the polygon touches.
//!
//! Not handled: which values stand for a texture ([`crate::scene::textures::mean`]).

use glam::{DVec2, DVec3};

use crate::scene::convex_polygon::{area, edges};
use crate::scene::textures::texture::Filter;

/// Gaussian points of the unit interval.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// The lower left and upper right of points.
pub(super) fn extent(points: &[DVec2]) -> (DVec2, DVec2) {
    points.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)))
}

/// The values around a polygon with their running sums along the rows.
pub(super) struct Window {
    /// Column and row of the first value.
    first: [i64; 2],
    columns: usize,
    filter: Filter,
    /// Each value, and the integral over its row from the first one to it.
    values: Vec<(DVec3, DVec3)>,
}

impl Window {
    /// The values that a polygon touches: `value(x, y)` at the texels that `wrapped(axis, index)` says.
    pub fn new(
        corners: &[DVec2],
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

    /// The mean over the polygon.
    pub fn mean(&self, corners: &[DVec2]) -> DVec3 {
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
