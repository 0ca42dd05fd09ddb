//! Exchange between two facets that see each other, by their contours:
//! `A_1 F_12 = 1/(2 pi) ∮∮ ln r dr_1 · dr_2`.
//!
//! Each contour is a set of directed edges, so polygons may be of any shape, with holes or in parts. The integral along
//! an edge of the second contour is taken in closed form, along the first by Gauss and Kronrod's rules of 7 and 15
//! points with bisection: what the first leaves is as mild as `t ln t`, also where edges touch or coincide.
//!
//! Not handled: parts of either facet behind the other's plane (clip first); occlusion. Far apart (20 diameters) the
//! terms cancel to fewer and fewer digits; the error returned says how many.
//!
//! Source: E. M. Sparrow, *A new and simpler formulation for radiative angle factors*, J. Heat Transfer 85, 1963.

use glam::DVec3;

use crate::form_factors::adaptive_integration::{Cell, Estimate, refine};
use crate::form_factors::facet::Edge;
use crate::scene::Bounds;

/// Nodes of Kronrod's rule, every second one Gauss's.
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
/// Kronrod's weights.
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
/// Gauss's weights at the nodes 1, 3, 5, 7.
const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

/// Relative error sought.
const GOAL: f64 = 1e-10;

/// Intervals at most, beyond those of the edge pairs themselves.
const MOST_INTERVALS: usize = 200_000;

/// `A_1 F_12` from the contours, counter-clockwise seen from the fronts.
pub(crate) fn exchange(first: &[Edge], second: &[Edge]) -> Estimate {
    // A constant factor of r drops out around a contour; one near the mean keeps the terms small.
    let scale = 1.0 / typical_distance(first, second);
    let pairs = first.iter().flat_map(|a| second.iter().map(move |b| Pair::new(a, b, scale)));
    let cells: Vec<Cell<Interval>> = pairs.flatten().map(|pair| measure(pair, 0.0, 1.0)).collect();
    let size: f64 = cells.iter().map(|c| c.place.size()).sum();
    let floor = 16.0 * f64::EPSILON * size;
    let most = cells.len() + MOST_INTERVALS;
    let split = |c: &Cell<Interval>| {
        let Interval { pair, from, to } = c.place;
        let middle = 0.5 * (from + to);
        [measure(pair, from, middle), measure(pair, middle, to)]
    };
    let found = refine(cells, |value| floor.max(GOAL * value.abs()), most, split);
    Estimate {
        value: found.value.max(0.0) / std::f64::consts::TAU,
        error: (found.error + floor) / std::f64::consts::TAU,
    }
}

/// The distance of the middles, or the mean size where the two are near each other.
fn typical_distance(first: &[Edge], second: &[Edge]) -> f64 {
    let [a, b] = [first, second].map(|edges| Bounds::of(edges.iter().map(|e| e[0])));
    let apart = 0.5 * (a.low + a.high - b.low - b.high).length();
    apart.max(0.5 * (a.size().length() + b.size().length()))
}

/// Two edges that are not perpendicular.
#[derive(Clone, Copy)]
struct Pair {
    start: DVec3,
    along: DVec3,
    origin: DVec3,
    /// Unit vector of the second edge.
    unit: DVec3,
    length: f64,
    /// The first edge's component along the second.
    cosine: f64,
    scale: f64,
}

/// A part of the first edge, as parameters in 0..=1.
#[derive(Clone, Copy)]
struct Interval {
    pair: Pair,
    from: f64,
    to: f64,
}

impl Interval {
    /// The size of the terms that cancel in it.
    fn size(&self) -> f64 {
        let p = &self.pair;
        let farthest = (p.start - p.origin).length() + p.along.length() + p.length;
        let nearest_log = (farthest * p.scale).ln().abs().max(1.0);
        p.cosine.abs() * p.length * nearest_log
    }
}

impl Pair {
    fn new(first: &Edge, second: &Edge, scale: f64) -> Option<Pair> {
        let (along, across) = (first[1] - first[0], second[1] - second[0]);
        let length = across.length();
        let unit = across / length;
        let cosine = along.dot(unit);
        (length > 0.0 && cosine != 0.0).then_some(Pair {
            start: first[0],
            along,
            origin: second[0],
            unit,
            length,
            cosine,
            scale,
        })
    }

    /// Integral of `ln(scale r)` along the second edge, from the point t of the first.
    fn potential(&self, t: f64) -> f64 {
        let p = self.start + t * self.along - self.origin;
        let foot = p.dot(self.unit);
        let half = 0.5 * self.length;
        let middle = p - half * self.unit;
        if middle.length_squared() > 4.0 * self.length * self.length {
            return self.seen_from_afar(middle);
        }
        let height = p.cross(self.unit).length();
        let primitive = |x: f64| match x {
            0.0 => 0.0,
            x => x * (self.scale * x.hypot(height)).ln(),
        };
        let (a, b) = (-foot, self.length - foot);
        let angle = (height * self.length).atan2(height * height + a * b);
        primitive(b) - primitive(a) - self.length + height * angle
    }

    /// Integral of `ln(scale r)` along the second edge where it is short against its distance from the point.
    fn seen_from_afar(&self, middle: DVec3) -> f64 {
        let half = 0.5 * self.length;
        let log = |s: f64| {
            let r = middle - (s * half) * self.unit;
            0.5 * (self.scale * self.scale * r.length_squared()).ln()
        };
        half * kronrod(log)[0]
    }
}

/// Kronrod's integral over (-1, 1), and Gauss's at every second of its nodes.
fn kronrod(f: impl Fn(f64) -> f64) -> [f64; 2] {
    let [mut fine, mut coarse] = [0.0; 2];
    for (k, (&x, &w)) in NODES.iter().zip(&KRONROD).enumerate() {
        let sum = if x == 0.0 { f(0.0) } else { f(-x) + f(x) };
        fine += w * sum;
        if k % 2 == 1 {
            coarse += GAUSS[k / 2] * sum;
        }
    }
    [fine, coarse]
}

/// Kronrod's integral over a part of the first edge, its difference from Gauss's as the error.
fn measure(pair: Pair, from: f64, to: f64) -> Cell<Interval> {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let [fine, coarse] = kronrod(|x| pair.potential(middle + half * x));
    let factor = pair.cosine * half;
    Cell {
        place: Interval { pair, from, to },
        integral: Estimate { value: factor * fine, error: (factor * (fine - coarse)).abs() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(z: f64, up: bool) -> Vec<Edge> {
        let p = |x: f64, y: f64| DVec3::new(x, y, z);
        let mut ring = [p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)];
        if !up {
            ring.reverse();
        }
        (0..4).map(|k| [ring[k], ring[(k + 1) % 4]]).collect()
    }

    #[test]
    fn both_rules_integrate_polynomials() {
        for power in [0, 2, 4, 8, 12] {
            let exact = 2.0 / f64::from(power + 1);
            let [fine, coarse] = kronrod(|x| x.powi(power));
            assert!((fine - exact).abs() < 1e-15 && (coarse - exact).abs() < 1e-15, "{power}");
        }
    }

    #[test]
    fn squares_face_to_face() {
        // Howell's catalogue, C-11.
        for (gap, exact) in
            [(1.0, 0.199_824_895_698_387_4), (0.1, 0.826_994_522_397_256_6), (1e-6, 0.999_998_000_010_029_5)]
        {
            let found = exchange(&square(0.0, true), &square(gap, false));
            let apart = (found.value - exact).abs();
            assert!(apart <= 4.0 * found.error && apart < 1e-9, "{gap}: {found:?}");
        }
    }
}
