//! What of polygons and segments lies in which cells of a grid, and on which side of lines within.
//!
//! Coordinates are in units of a grid's cells. Polygons are split by [`crate::scene::convex_polygon`], segments clipped
//! by intervals (Liang and Barsky 1984), in double precision. Not handled: polygons that are not convex.

use glam::{DVec2, Vec2};

use crate::scene::convex_polygon::half_plane;

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
