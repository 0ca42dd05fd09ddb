//! Areas of polygons, and clipping of convex ones by half planes (Sutherland and Hodgman 1974), in double precision.
//!
//! Not handled: polygons that are not convex.

use glam::DVec2;

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
pub(crate) fn half_plane(polygon: &[DVec2], normal: DVec2, offset: f64) -> Vec<DVec2> {
    above(polygon, |p| normal.dot(p) - offset)
}

/// The part of a convex polygon whose height is not negative.
pub(crate) fn above(polygon: &[DVec2], height: impl Fn(DVec2) -> f64) -> Vec<DVec2> {
    let mut part = Vec::with_capacity(polygon.len() + 1);
    put_above(polygon, height, &mut part);
    part
}

/// The part of a convex polygon where no height is negative, and convex ones around that. A part is left out where
/// `is_nothing`; of a polygon that has no part inside the second are those cut off until that was known.
pub(crate) fn parted<H: Fn(DVec2) -> f64>(
    polygon: &[DVec2],
    heights: impl Iterator<Item = H>,
    is_nothing: impl Fn(&[DVec2]) -> bool,
) -> (Option<Vec<DVec2>>, Vec<Vec<DVec2>>) {
    let (mut inside, mut outside) = (polygon.to_vec(), Vec::new());
    for height in heights {
        if inside.iter().all(|&p| height(p) >= 0.0) {
            continue;
        }
        outside.extend(Some(above(&inside, |p| -height(p))).filter(|part| !is_nothing(part)));
        inside = above(&inside, height);
        if is_nothing(&inside) {
            return (None, outside);
        }
    }
    (Some(inside), outside)
}

/// Adds the part of a convex polygon whose height is not negative.
#[inline]
pub(crate) fn put_above(polygon: &[DVec2], height: impl Fn(DVec2) -> f64, out: &mut Vec<DVec2>) {
    let crossing = |(p, h): (DVec2, f64), (q, g): (DVec2, f64)| p.lerp(q, h / (h - g));
    cut(polygon, height, crossing, |p, [above, _]| {
        if above {
            out.push(p);
        }
    });
}

/// The edges of a polygon.
pub(crate) fn edges(corners: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> {
    corners.iter().zip(corners.iter().cycle().skip(1)).map(|(&a, &b)| (a, b))
}

/// The area of a polygon, by triangles from its first corner so that small ones lose no digits; negative where it runs
/// to the right.
pub(crate) fn area(corners: &[DVec2]) -> f64 {
    edges(corners).map(|(a, b)| 0.5 * (a - corners[0]).perp_dot(b - corners[0])).sum()
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
