//! Convex polygons cut by squares and by one another.
//!
//! Not handled: polygons that are not convex.

use glam::DVec2;

/// Twice the area of a polygon, positive where it runs from x to y.
pub(crate) fn doubled_area(polygon: &[DVec2]) -> f64 {
    let next = |k: usize| polygon[(k + 1) % polygon.len()];
    (0..polygon.len()).map(|k| polygon[k].perp_dot(next(k))).sum()
}

/// The part of a convex polygon where `side` is not negative; `side` is linear.
pub(crate) fn cut(polygon: &[DVec2], side: impl Fn(DVec2) -> f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (k, &a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        let (h, g) = (side(a), side(b));
        if h >= 0.0 {
            kept.push(a);
        }
        if (h > 0.0 && g < 0.0) || (h < 0.0 && g > 0.0) {
            kept.push(a.lerp(b, h / (h - g)));
        }
    }
    kept
}

/// The part of a convex polygon within a rectangle.
pub(crate) fn within(polygon: &[DVec2], low: DVec2, high: DVec2) -> Vec<DVec2> {
    let right = cut(polygon, |p| p.x - low.x);
    let left = cut(&right, |p| high.x - p.x);
    let below = cut(&left, |p| p.y - low.y);
    cut(&below, |p| high.y - p.y)
}

/// Share of the smaller of two triangles that lies in both; 0 where that is rounding.
pub(crate) fn overlap(a: &[DVec2; 3], b: &[DVec2; 3]) -> f64 {
    const ROUNDING: f64 = 1e-6;
    let bounds = |t: &[DVec2; 3]| (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
    let ((low, high), (other_low, other_high)) = (bounds(a), bounds(b));
    if low.cmpge(other_high).any() || other_low.cmpge(high).any() {
        return 0.0;
    }
    let turn = doubled_area(b).signum();
    let mut common = a.to_vec();
    for k in 0..3 {
        let (from, to) = (b[k], b[(k + 1) % 3]);
        common = cut(&common, |p| turn * (to - from).perp_dot(p - from));
    }
    let least = doubled_area(a).abs().min(doubled_area(b).abs());
    let share = if common.len() > 2 && least > 0.0 { doubled_area(&common).abs() / least } else { 0.0 };
    if share > ROUNDING { share } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::Y];

    #[test]
    fn areas_of_what_is_cut_add_up() {
        let low = within(&HALF, DVec2::ZERO, DVec2::splat(0.5));
        assert!((doubled_area(&low) - 0.5).abs() < 1e-12);
        let corner = within(&HALF, DVec2::splat(0.4), DVec2::ONE);
        assert!((doubled_area(&corner) - 0.04).abs() < 1e-12);
        assert!(within(&HALF, DVec2::splat(0.6), DVec2::ONE).len() < 3);
    }

    #[test]
    fn triangles_that_share_an_edge_do_not_overlap() {
        assert_eq!(overlap(&HALF, &[DVec2::X, DVec2::ONE, DVec2::Y]), 0.0);
        assert!((overlap(&HALF, &HALF) - 1.0).abs() < 1e-12);
        // Turned the other way, as a mirrored half is.
        assert!((overlap(&HALF, &[DVec2::ZERO, DVec2::Y, DVec2::X]) - 1.0).abs() < 1e-12);
        let moved = HALF.map(|p| p + DVec2::splat(0.25));
        assert!((overlap(&HALF, &moved) - 0.25).abs() < 1e-12);
    }
}
