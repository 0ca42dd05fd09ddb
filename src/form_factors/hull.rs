//! Convex hulls of points: planes between two.
//!
//! Both searches look for the point of the Minkowski difference nearest to the origin: that of E. G. Gilbert, D. W.
//! Johnson and S. S. Keerthi (1988) ends after a few steps, but says nothing about hulls that meet by less than a
//! tolerance, which that of M. Frank and P. Wolfe does.
//!
//! Not handled: the hull's faces; its points are enough.

use glam::DVec3;

/// Whether a plane is found that has the hulls of two sets of points on either side, at least `gap` apart across it.
///
/// M. Frank and P. Wolfe's iteration for the shortest vector of the Minkowski difference, stopped after `steps`: what
/// is not separated by then counts as meeting.
pub(crate) fn separated(hull: &[DVec3], other: &[DVec3], gap: f64, steps: usize) -> bool {
    let mut v = hull[0] - other[0];
    for _ in 0..steps {
        // The point of the difference furthest against v.
        let s = lowest(hull, v) - lowest(other, -v);
        // Where hulls meet, v falls until its length is rounded to nothing and gives no plane.
        if v.length() > 0.0 && v.dot(s) >= gap * v.length() {
            return true;
        }
        let d = s - v;
        let along = -v.dot(d) / d.length_squared();
        if along <= 0.0 || !along.is_finite() {
            return false;
        }
        v += along.min(1.0) * d;
    }
    false
}

/// Hulls that are nearer touch: some roundings of unit coordinates.
const TOUCHING: f64 = 1e-12;
/// Steps of that search at most; four to eight are usual.
const STEPS: usize = 32;

/// Whether a plane has the hulls of two sets of points strictly on either side. Hulls that touch are not apart.
pub(crate) fn apart(hull: &[DVec3], other: &[DVec3]) -> bool {
    way_between(hull, other).is_some()
}

/// A direction in which all of the first hull is further than any of the second.
fn way_between(hull: &[DVec3], other: &[DVec3]) -> Option<DVec3> {
    let mut nearest = Nearest::of_point(hull[0] - other[0]);
    for _ in 0..STEPS {
        let v = nearest.point;
        // The point of the difference furthest against v.
        let s = lowest(hull, v) - lowest(other, -v);
        if v.dot(s) > TOUCHING * v.length() {
            return Some(v);
        }
        nearest = nearest.with(s).filter(|next| next.point.length_squared() < v.length_squared())?;
    }
    None
}

/// The point of a simplex nearest to the origin, with the corners that it lies between.
#[derive(Clone, Copy)]
struct Nearest {
    point: DVec3,
    corners: [DVec3; 3],
    count: usize,
}

impl Nearest {
    fn of_point(a: DVec3) -> Nearest {
        Nearest { point: a, corners: [a; 3], count: 1 }
    }

    fn of_segment(a: DVec3, b: DVec3) -> Nearest {
        let along = -a.dot(b - a) / (b - a).length_squared();
        if along > 0.0 && along < 1.0 {
            return Nearest { point: a.lerp(b, along), corners: [a, b, b], count: 2 };
        }
        Nearest::of_point(if along >= 1.0 { b } else { a })
    }

    fn of_triangle(a: DVec3, b: DVec3, c: DVec3) -> Nearest {
        let normal = (b - a).cross(c - a);
        let is_inside = |p: DVec3, q: DVec3| normal.dot(p.cross(q)) > 0.0;
        if is_inside(a, b) && is_inside(b, c) && is_inside(c, a) {
            let point = normal * (normal.dot(a) / normal.length_squared());
            return Nearest { point, corners: [a, b, c], count: 3 };
        }
        Nearest::of_segment(a, b).or(Nearest::of_segment(b, c)).or(Nearest::of_segment(c, a))
    }

    /// `None` where the tetrahedron holds the origin.
    fn of_tetrahedron(corners: [DVec3; 4]) -> Option<Nearest> {
        let beyond = |k: usize| {
            let [a, b, c, d] = std::array::from_fn(|j| corners[(j + k) % 4]);
            let normal = (b - a).cross(c - a);
            // The origin and the fourth corner lie on different sides of the face.
            let is_beyond = normal.dot(a) * normal.dot(d - a) >= 0.0;
            is_beyond.then(|| Nearest::of_triangle(a, b, c))
        };
        (0..4).filter_map(beyond).reduce(Nearest::or)
    }

    /// The nearer of both.
    fn or(self, other: Nearest) -> Nearest {
        if other.point.length_squared() < self.point.length_squared() { other } else { self }
    }

    /// With one more corner; `None` where the origin lies within.
    fn with(&self, s: DVec3) -> Option<Nearest> {
        let [a, b, c] = self.corners;
        match self.count {
            1 => Some(Nearest::of_segment(a, s)),
            2 => Some(Nearest::of_triangle(a, b, s)),
            _ => Nearest::of_tetrahedron([a, b, c, s]),
        }
    }
}

/// The point furthest against a direction.
fn lowest(points: &[DVec3], direction: DVec3) -> DVec3 {
    let mut best = (f64::INFINITY, points[0]);
    for &p in points {
        let height = direction.dot(p);
        if height < best.0 {
            best = (height, p);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::sobol::Stream;

    /// Random hulls, about half of which meet: planes found are planes, and where the other search finds one there is
    /// one.
    #[test]
    fn planes_between_hulls_are_found_wherever_there_are_some() {
        let mut random = Stream::new(3);
        let mut found = [0; 2];
        for _ in 0..4000 {
            let mut point =
                |size: f64, at: DVec3| at + size * DVec3::from_array([0; 3].map(|_| f64::from(random.uniform()) - 0.5));
            let hull: Vec<DVec3> = (0..9).map(|_| point(1.0, DVec3::ZERO)).collect();
            let at = point(1.0, DVec3::ZERO);
            let other = [0; 3].map(|_| point(0.6, at));
            let way = way_between(&hull, &other);
            found[usize::from(way.is_some())] += 1;
            match way {
                Some(v) => {
                    let nearest = hull.iter().map(|p| v.dot(*p)).fold(f64::INFINITY, f64::min);
                    let furthest = other.iter().map(|p| v.dot(*p)).fold(f64::NEG_INFINITY, f64::max);
                    assert!(furthest < nearest, "{v} {furthest} {nearest} {hull:?} {other:?}");
                }
                None => assert!(!separated(&hull, &other, 2.0 * TOUCHING, 3000), "{hull:?} {other:?}"),
            }
        }
        assert!(found.iter().all(|count| *count > 1000), "{found:?}");
    }

    #[test]
    fn hulls_that_touch_are_not_apart() {
        let p = DVec3::new;
        let square = [p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(1.0, 1.0, 0.0), p(0.0, 1.0, 0.0)];
        for z in [0.0, 1e-9] {
            for [x, y] in [[0.3, 0.3], [0.0, 0.0], [1.0, 0.5], [-0.2, -0.1]] {
                let triangle = [p(x, y, z), p(x + 0.5, y + 0.1, z), p(x + 0.5, y + 0.5, 0.4)];
                assert_eq!(apart(&square, &triangle), z > 0.0, "{x} {y} {z}");
            }
        }
    }

    #[test]
    fn hulls_apart_are_distinguished_from_hulls_that_meet() {
        let p = DVec3::new;
        let cube: Vec<DVec3> = (0..8).map(|k| p(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect();
        let triangle = |s: DVec3| [s, s + p(0.3, 0.1, 0.0), s + p(0.1, 0.4, 0.2)];
        let apart = |other: &[DVec3]| separated(&cube, other, -1e-12, 100);
        assert!(!apart(&triangle(p(0.4, 0.4, 0.4))));
        assert!(!apart(&triangle(p(-0.1, 0.4, 0.9))));
        // Beyond a corner, where no box or face separates.
        assert!(apart(&[p(1.6, 0.6, 0.5), p(0.6, 1.6, 0.5), p(1.2, 1.2, 2.0)]));
        assert!(apart(&triangle(p(1.01, 0.2, 0.2))));
    }
}
