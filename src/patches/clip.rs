//! Clipping in the plane: convex polygons against bands and lines, segments against cells.
//!
//! Coordinates are in units of a grid's cells. Polygons are clipped by half planes (Sutherland and Hodgman 1974),
//! segments by intervals (Liang and Barsky 1984), in double precision. Not handled: polygons that are not convex.

use glam::{DVec2, Vec2};

/// The line `normal · (u, v) = offset`, in units of cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub normal: Vec2,
    pub offset: f32,
}

/// Bit k tells on which side of line k a point lies.
#[inline]
pub(crate) fn side_bits(lines: &[Line], at: Vec2) -> usize {
    let bit = |(k, l): (usize, &Line)| usize::from(l.normal.dot(at) >= l.offset) << k;
    lines.iter().enumerate().map(bit).sum()
}

/// The cells that an interval touches, at least one.
pub(crate) fn span(low: f64, high: f64, n: usize) -> std::ops::Range<usize> {
    (low.floor().max(0.0) as usize).min(n - 1)..(high.ceil().max(1.0) as usize).min(n)
}

/// Whether a segment passes through the inside of the unit square, not merely along its rim.
pub(crate) fn passes_inside(a: DVec2, b: DVec2) -> bool {
    const RIM: f64 = 1e-4;
    let d = b - a;
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        if d[axis].abs() < 1e-12 {
            if a[axis] <= RIM || a[axis] >= 1.0 - RIM {
                return false;
            }
            continue;
        }
        let (t, u) = ((RIM - a[axis]) / d[axis], (1.0 - RIM - a[axis]) / d[axis]);
        enter = enter.max(t.min(u));
        leave = leave.min(t.max(u));
    }
    enter < leave
}

/// The parts of a convex polygon on each side of the lines.
pub(crate) fn split(polygon: Vec<DVec2>, lines: &[Line]) -> Vec<(usize, Vec<DVec2>)> {
    let mut parts = vec![(0, polygon)];
    for (k, line) in lines.iter().enumerate() {
        let (normal, offset) = (line.normal.as_dvec2(), f64::from(line.offset));
        parts = parts
            .into_iter()
            .flat_map(|(bits, part)| {
                [(bits, half_plane(&part, -normal, -offset)), (bits | 1 << k, half_plane(&part, normal, offset))]
            })
            .filter(|(_, part)| part.len() > 2)
            .collect();
    }
    parts
}

/// The part of a convex polygon between two limits along an axis, as far as there are any.
pub(crate) fn clip(polygon: &[DVec2], axis: DVec2, [low, high]: [Option<f64>; 2]) -> Vec<DVec2> {
    let mut inside = polygon.to_vec();
    if let Some(low) = low {
        inside = half_plane(&inside, axis, low);
    }
    if let Some(high) = high {
        inside = half_plane(&inside, -axis, -high);
    }
    inside
}

/// The part of a convex polygon where `normal · q >= offset`.
fn half_plane(polygon: &[DVec2], normal: DVec2, offset: f64) -> Vec<DVec2> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    let crossing = |(p, h): (DVec2, f64), (q, g): (DVec2, f64)| p.lerp(q, h / (h - g));
    cut(
        polygon,
        |p| normal.dot(p) - offset,
        crossing,
        |p, [above, _]| {
            if above {
                out.push(p);
            }
        },
    );
    out
}

/// Cuts a convex polygon where its height changes sign: calls `put` with every corner and every crossing in order, and
/// whether it belongs to the part above and to that below. What has height 0 belongs to both. `crossing` finds the
/// point of height 0 between two corners, given with their heights.
#[inline]
pub(crate) fn cut<P: Copy>(
    polygon: &[P],
    height: impl Fn(P) -> f64,
    crossing: impl Fn((P, f64), (P, f64)) -> P,
    mut put: impl FnMut(P, [bool; 2]),
) {
    let Some(&first) = polygon.first() else {
        return;
    };
    let start = (first, height(first));
    let mut here = start;
    for k in 1..=polygon.len() {
        let next = polygon.get(k).map_or(start, |&q| (q, height(q)));
        let (h, g) = (here.1, next.1);
        put(here.0, [h >= 0.0, h <= 0.0]);
        if (h > 0.0 && g < 0.0) || (h < 0.0 && g > 0.0) {
            put(crossing(here, next), [true; 2]);
        }
        here = next;
    }
}
