//! Moments of what a part of an emitting triangle emits, and the weights of three points that stand for it
//! ([`crate::direct::emission_tree`]).
//!
//! Not handled: where the triangle lies; places are shares of its edges.

use glam::{DVec2, DVec3};

/// The largest Frobenius norm of `∇∇k / 2` along the triangle's plane times `pi r⁴`, with k = cos cos / (pi r²), over
/// all directions of both normals (2.78 by the test below).
pub(crate) const BENT: f64 = 2.8;
/// What three points miss of the mean of `pi r² k` over a triangle, over the third power of its radius by its distance,
/// at most, where that is a half or less and no part is below the horizon (0.065 by the test below).
pub(crate) const SKEW: f64 = 0.07;

/// The mean of x², y² and x y over the whole triangle, relative to its middle, in shares of its edges.
const SECOND: [f64; 3] = [1.0 / 18.0, 1.0 / 18.0, -1.0 / 36.0];

/// What is known of the emission of a part, with places in shares of the triangle's edges.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moments {
    pub mean: DVec3,
    pub variance: DVec3,
    /// The mean of `(E - m)(y - c)` along both edges.
    pub dipole: [DVec3; 2],
    /// The mean of `(E - m)(y - c)(y - c)ᵀ`: both edges with themselves, and one with the other.
    bend: [DVec3; 3],
}

/// A part of the triangle: places in shares of its edges, and its size over that of the whole, negative where it is
/// turned by half a turn.
#[derive(Clone, Copy)]
pub(crate) struct Part {
    pub corners: [DVec2; 3],
    pub scale: f64,
}

impl Part {
    pub fn middle(&self) -> DVec2 {
        let [a, b, c] = self.corners;
        (a + b + c) / 3.0
    }

    /// The four equal parts: at its corners, and the one in its middle by half a turn.
    pub fn quarters(&self) -> [Part; 4] {
        let [a, b, c] = self.corners;
        let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        let part = |corners, scale| Part { corners, scale: scale * self.scale };
        [part([a, ab, ca], 0.5), part([ab, b, bc], 0.5), part([ca, bc, c], 0.5), part([bc, ca, ab], -0.5)]
    }
}

impl Moments {
    /// Those of a node from those of its quarters.
    pub fn of_quarters(each: &[Moments; 4], whole: &Part, parts: &[Part; 4]) -> Moments {
        let mut sum = Moments { mean: 0.25 * each.iter().map(|m| m.mean).sum::<DVec3>(), ..Moments::default() };
        for (own, part) in each.iter().zip(parts) {
            let (beyond, off) = (own.mean - sum.mean, part.middle() - whole.middle());
            let [uu, vv, uv] = SECOND.map(|mean| mean * part.scale * part.scale);
            let across = own.dipole[0] * off.y + own.dipole[1] * off.x;
            sum.variance += 0.25 * (own.variance + beyond * beyond);
            sum.dipole[0] += 0.25 * (own.dipole[0] + beyond * off.x);
            sum.dipole[1] += 0.25 * (own.dipole[1] + beyond * off.y);
            sum.bend[0] += 0.25 * (own.bend[0] + 2.0 * own.dipole[0] * off.x + beyond * (uu + off.x * off.x));
            sum.bend[1] += 0.25 * (own.bend[1] + 2.0 * own.dipole[1] * off.y + beyond * (vv + off.y * off.y));
            sum.bend[2] += 0.25 * (own.bend[2] + across + beyond * (uv + off.x * off.y));
        }
        sum
    }

    /// The mean of `E (y - c)(y - c)ᵀ` of the whole triangle: both edges with themselves, and one with the other.
    pub fn second(&self) -> [DVec3; 3] {
        let even = SECOND.map(|mean| mean * self.mean);
        std::array::from_fn(|k| even[k] + self.bend[k])
    }

    /// w, less a third each, of a part of this scale.
    ///
    /// With the corners `q_i` of the whole triangle from its middle and d the dipole, `sum of w_i scale q_i / 2 = d`.
    pub fn weights(&self, scale: f64) -> [DVec3; 3] {
        let even = (self.mean - 1.0) / 3.0;
        let [u, v] = self.dipole.map(|d| 2.0 / scale * d);
        [even - u - v, even + u, even + v]
    }

    /// Standard deviation of the emission of a part of this scale from what is linear in the place and has its dipole,
    /// the largest channel's.
    ///
    /// What is linear differs from m by `e_i = 6 w_i - 2 sum of w` at the corners, whose sum is 0: by
    /// `sum of e_i² / 12` in the mean of squares.
    pub fn rough(&self, scale: f64) -> f64 {
        let weights = self.weights(scale);
        let all: DVec3 = weights.iter().sum();
        let explained: DVec3 = weights.iter().map(|w| (6.0 * *w - 2.0 * all).powf(2.0) / 12.0).sum();
        (self.variance - explained).max_element().max(0.0).sqrt()
    }

    /// What the weights miss of `bend`: they hold `sum of w_i scale² q_i q_iᵀ / 4`, of which what is even is exact.
    pub fn missed(&self, scale: f64) -> [DVec3; 3] {
        let [u, v] = self.dipole.map(|d| scale / 6.0 * d);
        [self.bend[0] - u, self.bend[1] - v, self.bend[2] + u + v]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::sobol::hash;

    /// Directions of a place, and of normals there and at the origin that face each other.
    fn directions() -> impl Iterator<Item = [DVec3; 3]> {
        let uniform = |k: u32, d: u32| 2.0 * f64::from(hash(k, d) >> 8) / f64::from(1 << 24) - 1.0;
        let unit = move |k: u32, d: u32| DVec3::new(uniform(k, d), uniform(k, d + 1), uniform(k, d + 2)).normalize();
        (0..20_000).map(move |k| {
            let [y, n, m] = [0, 3, 6].map(|d| unit(k, d));
            [y, n * n.dot(y).signum(), -m * m.dot(y).signum()]
        })
    }

    /// `pi k`.
    fn kernel(y: DVec3, n: DVec3, m: DVec3) -> f64 {
        -y.dot(n) * y.dot(m) / y.length_squared().powi(2)
    }

    #[test]
    fn the_kernel_bends_no_more_than_that() {
        const H: f64 = 1e-3;
        let mut most = 0.0_f64;
        for [y, n, m] in directions() {
            let (u, v) = m.any_orthonormal_pair();
            let along = |a: DVec3, b: DVec3| {
                let at = |s: f64, t: f64| kernel(y + H * (s * a + t * b), n, m);
                (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) / (4.0 * H * H)
            };
            let [uu, vv, uv] = [(u, u), (v, v), (u, v)].map(|(a, b)| 0.5 * along(a, b));
            most = most.max((uu * uu + vv * vv + 2.0 * uv * uv).sqrt());
        }
        assert!(most < BENT && most > 0.9 * BENT, "{most}");
    }

    #[test]
    fn three_points_miss_no_more_than_that() {
        const LEVELS: usize = 3;
        let mut most = 0.0_f64;
        for corners in [[(0.0, 0.0), (1.0, 0.0), (0.5, 0.866)], [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]] {
            let whole = Part { corners: corners.map(DVec2::from), scale: 1.0 };
            let whole = Part { corners: whole.corners.map(|p| p - whole.middle()), ..whole };
            let radius = whole.corners.iter().map(|p| p.length()).fold(0.0, f64::max);
            let mut parts = vec![whole];
            for _ in 0..LEVELS {
                parts = parts.iter().flat_map(Part::quarters).collect();
            }
            for [y, n, m] in directions().take(2000).filter(|[y, n, _]| n.dot(*y) > 0.5) {
                let (u, v) = m.any_orthonormal_pair();
                let at = |p: DVec2| kernel(2.0 * radius * y + p.x * u + p.y * v, n, m) * (2.0 * radius).powi(2);
                let three = |part: &Part| {
                    let middle = part.middle();
                    part.corners.iter().map(|p| at(0.5 * (*p + middle))).sum::<f64>() / 3.0
                };
                let exact = parts.iter().map(three).sum::<f64>() / parts.len() as f64;
                most = most.max((three(&whole) - exact).abs() / 0.125);
            }
        }
        assert!(most < SKEW && most > 0.7 * SKEW, "{most}");
    }
}
