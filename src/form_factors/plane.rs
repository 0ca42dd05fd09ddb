//! Planes, and polygons cut by them.
//!
//! Heights within a plane's flatness are 0, so that what lies in a plane but for rounding is not cut into splinters.

use glam::DVec3;

use crate::scene::convex_polygon::cut;

/// A plane: `normal · x = offset`, the front where it is greater.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub normal: DVec3,
    pub offset: f64,
    /// Largest distance of a point that counts as lying in it: some roundings of the coordinates.
    pub flat: f64,
}

impl Plane {
    /// Height of a point above the plane; 0 within rounding.
    pub(crate) fn height(&self, p: DVec3) -> f64 {
        let height = self.normal.dot(p) - self.offset;
        if height.abs() <= self.flat { 0.0 } else { height }
    }
}

/// Distance from a face's plane within which a point counts as lying on the face, unit coordinates. Points of the
/// scene's surface are kept in single precision, off by about 2e-7. Without it, a point of one side of a glowing face
/// would half of the time lie before the other side by its rounding, and be lit as if that filled its sky.
pub(crate) const ON_FACE: f64 = 1e-6;

/// Whether the origin lies before the front of a polygon, further than a point of it would by its rounding.
pub(crate) fn sees_front(corners: &[DVec3]) -> bool {
    let [a, b, c] = [0, 1, 2].map(|k| corners[k]);
    let across = (b - a).cross(c - a);
    a.dot(across) < -ON_FACE * across.length()
}

/// The plane of a polygon.
pub(crate) fn plane_of(polygon: &[DVec3], flat: f64) -> Plane {
    let normal = area_vector(polygon).normalize();
    let middle = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
    let offset = normal.dot(middle);
    Plane { normal, offset, flat }
}

/// Area times normal of a polygon.
pub(crate) fn area_vector(polygon: &[DVec3]) -> DVec3 {
    let corner = polygon[0];
    let fan = polygon[1..].windows(2);
    let sum: DVec3 = fan.map(|e| (e[0] - corner).cross(e[1] - corner)).sum();
    0.5 * sum
}

/// Parts of a convex polygon where the height is not negative, and not positive. Either may be empty.
pub(crate) fn split(polygon: &[DVec3], height: impl Fn(DVec3) -> f64) -> (Vec<DVec3>, Vec<DVec3>) {
    if polygon.iter().all(|&p| height(p) >= 0.0) {
        return (polygon.to_vec(), Vec::new());
    }
    if polygon.iter().all(|&p| height(p) <= 0.0) {
        return (Vec::new(), polygon.to_vec());
    }
    let mut parts = [Vec::new(), Vec::new()];
    cut(polygon, height, crossing, |p, sides| {
        let belongs = parts.iter_mut().zip(sides).filter(|(_, own)| *own);
        belongs.for_each(|(part, _)| part.push(p));
    });
    parts.into()
}

/// Where a segment has height 0: the same bits whichever end comes first, so that neighbours' edges still cancel.
pub(crate) fn crossing(a: (DVec3, f64), b: (DVec3, f64)) -> DVec3 {
    if a.1 < b.1 { towards(a, b) } else { towards(b, a) }
}

/// Where a segment has height 0, as seen from its first end: cheaper where nothing has to cancel.
pub(crate) fn towards(a: (DVec3, f64), b: (DVec3, f64)) -> DVec3 {
    a.0.lerp(b.0, a.1 / (a.1 - b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_parts_of_a_cut_polygon_share_the_cut() {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let square = [p(0., 0.), p(3., 0.), p(3., 1.), p(0., 1.)];
        let (above, below) = split(&square, |q| q.x - 1.0);
        assert_eq!(area_vector(&above), DVec3::new(0.0, 0.0, 2.0));
        assert_eq!(area_vector(&below), DVec3::new(0.0, 0.0, 1.0));
        let (all, none) = split(&square, |q| q.x);
        assert_eq!((all.len(), none.len()), (4, 0));
        // An edge is cut at one place, to the bit, whichever way it runs.
        let edge = |a: DVec3, b: DVec3| crossing((a, a.x - 0.7), (b, b.x - 0.7));
        let (a, b) = (p(0.1, 0.3), p(2.9, 0.77));
        assert_eq!(edge(a, b), edge(b, a));
    }
}
