//! Exchange between facets with occluders between: the visible form factor integrated over the sender.
//!
//! The sender is cut into triangles, finer towards occluders, along the planes of those that touch it, where the
//! integrand jumps, and along the lines where it has kinks ([`crate::form_factors::objects::discontinuity_lines`]).
//! Each carries Radon's rule of 7 points (degree 5); its difference from the sum over two halves is the error. Where
//! kinks are left, bisection closes in on them, and the error falls as about the square of the number of points.
//!
//! Sources: J. Radon, *Zur mechanischen Kubatur*, Monatsh. Math. 52, 1948; M. J. Rivara's longest-edge bisection.

use glam::DVec3;

use crate::form_factors::geometry::plane::area_vector;
use crate::form_factors::objects::adaptive_integration::{Cell, Estimate, refine};
use crate::form_factors::objects::discontinuity_lines::kinks;
use crate::form_factors::objects::facet::Facet;
use crate::form_factors::objects::occluders::Occluder;
use crate::form_factors::objects::visible_form::visible_form;

/// A sender, a receiver in front of it, and what may lie between.
pub(crate) struct Link<'a> {
    pub from: Facet,
    pub to: Facet,
    pub occluders: Vec<&'a Occluder>,
}

/// A triangle of a link's sender.
#[derive(Clone, Copy)]
struct Part {
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
    use rayon::prelude::*;
    let start = |(k, link): (usize, &Link)| -> Vec<Cell<Part>> {
        let parts = parts(link, most / (4 * links.len())).into_iter();
        parts.map(|t| first(links, Part { corners: t, link: k as u32 })).collect()
    };
    let cells: Vec<Vec<Cell<Part>>> = links.par_iter().enumerate().map(start).collect();
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
fn first(links: &[Link], part: Part) -> Cell<Part> {
    let value = radon(links, &part);
    let possible = area_vector(&part.corners).length();
    let hidden = !links[part.link as usize].occluders.is_empty();
    let error = if hidden { value.max(1e-3 * possible) } else { value };
    Cell { place: part, integral: Estimate { value, error } }
}

fn halves(links: &[Link], cell: &Cell<Part>) -> [Cell<Part>; 2] {
    let places = bisect(&cell.place.corners).map(|corners| Part { corners, ..cell.place });
    let values = places.map(|p| radon(links, &p));
    let apart = (values[0] + values[1] - cell.integral.value).abs();
    let open = links[cell.place.link as usize].occluders.is_empty();
    let error = 0.5 * apart.max(TRUST[usize::from(open)] * cell.integral.error);
    let half = |k: usize| Cell { place: places[k], integral: Estimate { value: values[k], error } };
    [half(0), half(1)]
}

/// Radon's rule over a triangle.
fn radon(links: &[Link], part: &Part) -> f64 {
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
