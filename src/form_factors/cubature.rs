//! Exchange between facets with occluders between: the visible form factor integrated over the sender.
//!
//! The sender is cut into triangles, finer towards occluders, along the planes of those that touch it, where the
//! integrand jumps, and along the lines where it has kinks. Each carries Radon's rule of 7 points (degree 5); its
//! difference from the sum over two halves is the error. Where kinks remain, bisection closes in on them, and the error
//! falls as about the square of the number of points.
//!
//! Kinks lie along the lines in which the planes through an edge of an occluder and a corner of the receiver cross the
//! sender, and those through an edge of the receiver and a corner of an occluder. Next to a narrow slit two of them lie
//! close together and light rises from nothing to all between them: a rule whose nodes miss that band agrees with its
//! halves and is wrong. Where edges are parallel to those of the receiver, planes through several of its corners
//! coincide: such lines, where all of an edge appears at once, are the ones that are taken.
//!
//! Sources: J. Radon, *Zur mechanischen Kubatur*, Monatsh. Math. 52, 1948; M. J. Rivara's longest-edge bisection; P. S.
//! Heckbert, *Discontinuity meshing for radiosity*, Eurographics Workshop on Rendering 1992.
//!
//! Not handled: other lines, those past the number that is taken, and events of three edges, whose curves are no lines;
//! adaptive cells close in on both.

use std::collections::HashMap;

use glam::DVec3;
use halflight_team::heed_interrupt;
use rayon::prelude::*;

use crate::form_factors::adaptive_integration::{Cell, Estimate, refine};
use crate::form_factors::facet::{Edge, Facet};
use crate::form_factors::occluders::{Occluder, visible_form};
use crate::form_factors::plane::{Plane, area_vector};

/// A sender, a receiver in front of it, and what may lie between.
pub(crate) struct Link<'a> {
    pub from: Facet,
    pub to: Facet,
    pub occluders: Vec<&'a Occluder>,
}

/// A triangle of a link's sender.
#[derive(Clone, Copy)]
struct SenderPart {
    corners: [DVec3; 3],
    link: u32,
}

/// Planes along which a sender is cut at most.
const MOST_CUTS: usize = 16;

/// Triangles larger than this many times their distance from an occluder's outline are cut before the start.
const NEAR: f64 = 1.5;

/// Share of an occluder's radius below which a distance from its outline makes no finer start.
const TOUCH: f64 = 1.0 / 8.0;

/// Least share of a triangle's error that its halves are given together, with occluders and without: a rule that agrees
/// by accident is not trusted. A smooth integrand gains a factor of 64 with each halving.
const TRUST: [f64; 2] = [1.0 / 8.0, 1.0 / 64.0];

/// `sum of A F` over the links, refined until the error is `goal(sum)` or the triangles are `most`.
pub(crate) fn exchange(links: &[Link], goal: impl Fn(f64) -> f64, most: usize) -> Estimate {
    let start = |(k, link): (usize, &Link)| -> Vec<Cell<SenderPart>> {
        let parts = parts(link, most / (4 * links.len())).into_iter();
        parts.map(|t| first(links, SenderPart { corners: t, link: k as u32 })).collect()
    };
    let cells: Vec<Vec<Cell<SenderPart>>> = links.par_iter().enumerate().map(start).collect();
    let sum = refine(cells.concat(), goal, most, |cell| halves(links, cell));
    Estimate { value: sum.value.max(0.0), error: sum.error + 64.0 * f64::EPSILON * sum.value }
}

/// The triangles a sender starts with, not many more than `most`.
fn parts(link: &Link, most: usize) -> Vec<[DVec3; 3]> {
    let mut sender = link.from.clone();
    let touching = |o: &&&Occluder| {
        let mut heights = o.polygon.iter().map(|&p| sender.plane.height(p));
        heights.any(|h| h <= 0.0)
    };
    let cuts: Vec<_> = link.occluders.iter().filter(touching).take(MOST_CUTS).collect();
    for occluder in cuts {
        if sender.tiles.len() < most {
            sender.cut_along(&occluder.plane);
        }
    }
    for line in kinks(&link.from, &link.to, &link.occluders) {
        if sender.tiles.len() < most {
            sender.cut_along(&line);
        }
    }
    let fan = |tile: &Vec<DVec3>| -> Vec<[DVec3; 3]> {
        let rest = tile[1..].windows(2);
        rest.map(|e| [tile[0], e[0], e[1]]).collect()
    };
    let mut parts: Vec<[DVec3; 3]> = sender.tiles.iter().flat_map(fan).collect();
    for occluder in &link.occluders {
        approach(&mut parts, &occluder.polygon, most);
    }
    parts
}

/// Cuts triangles that are large against their distance from the outline of an occluder: where its shadow begins to
/// show must not fall between the nodes.
fn approach(parts: &mut Vec<[DVec3; 3]>, outline: &[DVec3], most: usize) {
    let middle = outline.iter().sum::<DVec3>() / outline.len() as f64;
    let radius = outline.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
    let mut next = 0;
    while next < parts.len() && parts.len() < most {
        let t = parts[next];
        let away = distance(outline, (t[0] + t[1] + t[2]) / 3.0);
        if longest(&t).1 > NEAR * away.max(TOUCH * radius) {
            let [a, b] = bisect(&t);
            parts[next] = a;
            parts.push(b);
        } else {
            next += 1;
        }
    }
}

/// Distance of a point from the nearest edge of a polygon.
fn distance(polygon: &[DVec3], p: DVec3) -> f64 {
    let from_edge = |k: usize| {
        let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
        let along = b - a;
        let share = (p - a).dot(along) / along.length_squared();
        p.distance(a + share.clamp(0.0, 1.0) * along)
    };
    (0..polygon.len()).map(from_edge).fold(f64::INFINITY, f64::min)
}

/// The first corner of the longest edge, and its length.
fn longest(t: &[DVec3; 3]) -> (usize, f64) {
    let length = |k: usize| t[k].distance(t[(k + 1) % 3]);
    let longer = |best: (usize, f64), k| {
        if length(k) > best.1 { (k, length(k)) } else { best }
    };
    (1..3).fold((0, length(0)), longer)
}

/// Both halves of a triangle, cut across its longest edge.
fn bisect(t: &[DVec3; 3]) -> [[DVec3; 3]; 2] {
    let k = longest(t).0;
    let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
    let middle = 0.5 * (a + b);
    [[a, middle, c], [middle, b, c]]
}

/// A triangle of the start: nothing is known of its error yet, so all of its value is.
fn first(links: &[Link], part: SenderPart) -> Cell<SenderPart> {
    heed_interrupt();
    let value = radon(links, &part);
    let possible = area_vector(&part.corners).length();
    let hidden = !links[part.link as usize].occluders.is_empty();
    let error = if hidden { value.max(1e-3 * possible) } else { value };
    Cell { place: part, integral: Estimate { value, error } }
}

fn halves(links: &[Link], cell: &Cell<SenderPart>) -> [Cell<SenderPart>; 2] {
    let places = bisect(&cell.place.corners).map(|corners| SenderPart { corners, ..cell.place });
    let values = places.map(|p| radon(links, &p));
    let apart = (values[0] + values[1] - cell.integral.value).abs();
    let open = links[cell.place.link as usize].occluders.is_empty();
    let error = 0.5 * apart.max(TRUST[usize::from(open)] * cell.integral.error);
    let half = |k: usize| Cell { place: places[k], integral: Estimate { value: values[k], error } };
    [half(0), half(1)]
}

/// Radon's rule over a triangle.
fn radon(links: &[Link], part: &SenderPart) -> f64 {
    let link = &links[part.link as usize];
    let [a, b, c] = part.corners;
    let form = |p: DVec3| visible_form(p, link.from.plane.normal, &link.to, &link.occluders);
    let root = 15.0_f64.sqrt();
    let mut mean = 0.225 * form((a + b + c) / 3.0);
    for sign in [-1.0, 1.0] {
        let (u, w) = ((6.0 + sign * root) / 21.0, (155.0 + sign * root) / 1200.0);
        let v = 1.0 - 2.0 * u;
        for node in [u * a + u * b + v * c, u * a + v * b + u * c, v * a + u * b + u * c] {
            mean += w * form(node);
        }
    }
    mean * area_vector(&part.corners).length()
}

/// Lines taken at most: k of them cut a sender into up to k²/2 parts.
const MOST_LINES: usize = 6;
/// Pairs of an edge and a corner tried, at most.
const MOST_PAIRS: usize = 20_000;
/// Lines are one where they are no further apart than so many times the flatness of the sender's plane.
const SAME: f64 = 64.0;

/// The lines of kinks, as planes perpendicular to the sender.
fn kinks(from: &Facet, to: &Facet, occluders: &[&Occluder]) -> Vec<Plane> {
    let edges = |o: &&Occluder| {
        let p = &o.polygon;
        (0..p.len()).map(|k| [p[k], p[(k + 1) % p.len()]]).collect::<Vec<Edge>>()
    };
    let between: Vec<Edge> = occluders.iter().flat_map(edges).collect();
    if 2 * between.len() * to.edges.len() > MOST_PAIRS {
        return Vec::new();
    }
    let mut found = Lines { from, planes: Vec::new(), index: HashMap::new() };
    for edge in &between {
        for other in &to.edges {
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

impl Lines<'_> {
    /// Adds the line in which the plane through an edge and a corner crosses the sender, if it does.
    fn add(&mut self, edge: &Edge, corner: DVec3) {
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
        self.planes.into_iter().map(|p| p.0).take(MOST_LINES).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::facet::facets;
    use crate::form_factors::plane::plane_of;

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
