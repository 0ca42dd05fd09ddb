//! Where the visible form factor of a receiver has kinks as a point moves over the sender: along the lines in which the
//! planes through an edge of what lies between and a corner of the receiver cross it, and those through an edge of the
//! receiver and a corner of what lies between.
//!
//! Beside a narrow slit two of them lie next to each other and light rises from nothing to all between them: a rule
//! whose nodes miss that band agrees with its halves and is wrong. Cut along them, every part has a smooth integrand.
//!
//! Where edges are parallel to those of the receiver, planes through several of its corners coincide: such lines, where
//! all of an edge appears at once, are the ones that are taken.
//!
//! Source: P. S. Heckbert, *Discontinuity meshing for radiosity*, Eurographics Workshop on Rendering 1992. Not handled:
//! other lines, those past the number that is taken, and events of three edges, whose curves are no lines; adaptive
//! cells close in on both.

use std::collections::HashMap;

use glam::DVec3;

use crate::form_factors::geometry::plane::Plane;
use crate::form_factors::objects::facet::Facet;
use crate::form_factors::objects::occluders::Occluder;

/// Lines taken at most: k of them cut a sender into up to k²/2 parts.
const MOST: usize = 6;
/// Pairs of an edge and a corner looked at, at most.
const MOST_PAIRS: usize = 20_000;
/// Lines are one where they are no further apart than so many times the flatness of the sender's plane.
const SAME: f64 = 64.0;

/// The lines, as planes perpendicular to the sender.
pub(crate) fn kinks(from: &Facet, to: &Facet, occluders: &[&Occluder]) -> Vec<Plane> {
    let receiver: Vec<[DVec3; 2]> = to.edges.clone();
    let edges = |o: &Occluder| -> Vec<[DVec3; 2]> {
        let p = &o.polygon;
        (0..p.len()).map(|k| [p[k], p[(k + 1) % p.len()]]).collect()
    };
    let between: Vec<[DVec3; 2]> = occluders.iter().flat_map(|o| edges(o)).collect();
    if 2 * between.len() * receiver.len() > MOST_PAIRS {
        return Vec::new();
    }
    let mut found = Lines::new(from);
    for edge in &between {
        for other in &receiver {
            found.add(edge, other[0]);
            found.add(other, edge[0]);
        }
    }
    found.strongest()
}

/// Lines across the sender, and how many planes cross it there.
struct Lines<'a> {
    from: &'a Facet,
    planes: Vec<(Plane, u32)>,
    /// Places of planes by their rounded numbers.
    index: HashMap<[i64; 4], usize>,
}

impl<'a> Lines<'a> {
    fn new(from: &'a Facet) -> Lines<'a> {
        Lines { from, planes: Vec::new(), index: HashMap::new() }
    }

    /// Adds the line in which the plane through an edge and a corner crosses the sender, if it does.
    fn add(&mut self, edge: &[DVec3; 2], corner: DVec3) {
        let sender = &self.from.plane;
        let through = (edge[1] - edge[0]).cross(corner - edge[0]);
        let along = through - through.dot(sender.normal) * sender.normal;
        // Edges through the corner and planes parallel to the sender have no line.
        if along.length() <= 1e-9 * through.length() || through.length() <= sender.flat {
            return;
        }
        // Where the plane's height is 0 for points of the sender's plane.
        let over = 1.0 / along.length();
        let height = sender.offset * through.dot(sender.normal);
        let mut plane =
            Plane { normal: along * over, offset: (through.dot(corner) - height) * over, flat: sender.flat };
        let largest = plane.normal.to_array().into_iter();
        let turn = largest.fold(0.0, |m: f64, x| if x.abs() > m.abs() + 1e-6 { x } else { m });
        if turn < 0.0 {
            (plane.normal, plane.offset) = (-plane.normal, -plane.offset);
        }
        let heights = || self.from.points().map(|p| plane.height(p));
        if heights().all(|h| h >= 0.0) || heights().all(|h| h <= 0.0) {
            return;
        }
        let step = SAME * sender.flat;
        let numbers = [plane.normal.x, plane.normal.y, plane.normal.z, plane.offset];
        let key = numbers.map(|x| (x / step).round() as i64);
        let next = self.planes.len();
        let place = *self.index.entry(key).or_insert(next);
        match self.planes.get_mut(place) {
            Some(own) => own.1 += 1,
            None => self.planes.push((plane, 1)),
        }
    }

    /// Those that most planes share first.
    fn strongest(mut self) -> Vec<Plane> {
        self.planes.retain(|p| p.1 > 1);
        self.planes.sort_by_key(|p| std::cmp::Reverse(p.1));
        self.planes.into_iter().map(|p| p.0).take(MOST).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::geometry::plane::plane_of;
    use crate::form_factors::objects::facet::facets;

    #[test]
    fn a_slit_has_a_line_for_each_of_its_edges_and_each_side_of_the_receiver() {
        let square = |x: f64, a: f64, b: f64, z: f64| {
            let p = |x: f64, y: f64| DVec3::new(x, y, z);
            [p(x, 0.0), p(x + a, 0.0), p(x + a, b), p(x, b)]
        };
        let facet = |[a, b, c, d]: [DVec3; 4]| facets(&[[a, b, c], [a, c, d]], 1e-12).remove(0);
        let occluder =
            |p: [DVec3; 4]| Occluder { plane: plane_of(&p, 1e-12), polygon: p.to_vec(), tau: 0.0, masked: false };
        let (from, to) = (facet(square(0.0, 1.0, 1.0, 0.0)), facet(square(0.0, 1.0, 1.0, 1.0)));
        // Sheets whose ends are too far to matter, and between them a slit from 0.4 to 0.41.
        let wide = |x: f64, a: f64| square(x, a, 100.0, 0.5).map(|p| p - 50.0 * DVec3::Y);
        let sheets = [occluder(wide(-50.0, 50.4)), occluder(wide(0.41, 50.0))];
        let lines = kinks(&from, &to, &sheets.each_ref());
        let mut offsets: Vec<f64> = lines.iter().map(|l| l.offset / l.normal.x).collect();
        offsets.sort_by(f64::total_cmp);
        // A point sees the side at x where the slit's edge at s is half way: at 2 s - x.
        assert_eq!(offsets.len(), 2, "{offsets:?}");
        for (found, exact) in offsets.iter().zip([0.8, 0.82]) {
            assert!((found - exact).abs() < 1e-12, "{offsets:?}");
        }
    }
}
