//! Form factors between whole bodies of flat faces, in double precision and to any requested accuracy.
//!
//! ```text
//! A_i F_ij = sum over facets a of i, b of j of  ∫_a ∫_b cos cos / (pi r²) T dA dA
//! ```
//!
//! T is the product of tau of what lies between. Each pair of facets is first cut back to what lies in front of the
//! other's plane. Where nothing can lie between, the double contour integral gives the pair to ten digits;
//! else the visible part of the receiver, exact at every point, is integrated over the sender, adaptively. Bodies of
//! too many facets for that are left to rays ([`crate::form_factors::sampled`]).
//!
//! Faces that coincide: facing apart they exchange nothing and do not hide each other; facing each other they exchange
//! nothing either (a crossing at distance 0 is none); facing the same way each receives as if the other were not there.
//!
//! Not handled: emission that is not uniform over a body.

use glam::DVec3;
use halflight_team::heed_interrupt;
use rayon::prelude::*;

use crate::form_factors::adaptive_integration::{Estimate, Tolerance};
use crate::form_factors::cubature::Link;
use crate::form_factors::facet::{Facet, facets};
use crate::form_factors::occluders::{Occluder, between};
use crate::form_factors::{contour_integral, cubature};
use crate::light::nothing_passes;
use crate::scene::{Scene, Sides};

/// Pairs of facets of two bodies beyond which rays are the better way.
const MOST_PAIRS: usize = 40_000;

/// Tests of an occluder against a pair of facets, for two bodies.
const MOST_TESTS: usize = 20_000_000;

/// Pairs of edges, for two bodies.
const MOST_EDGE_PAIRS: usize = 5_000_000;

/// Pairs of facets with something between, for two bodies.
const MOST_LINKS: usize = 400;

/// Triangles a sender needs at least for a quadrature worth beginning.
const FEWEST: usize = 16;

/// Triangles of a quadrature with nothing between.
const MOST_OPEN: usize = 2000;

/// Distance over size from which the contour integral loses more digits than quadrature over the sender.
const FAR: f64 = 20.0;

/// The objects of a scene as facets, and all that occludes.
pub struct Bodies {
    bodies: Vec<Vec<Facet>>,
    occluders: Vec<Occluder>,
    /// Which of them have masks, as far as each is there only in part.
    masked: Vec<bool>,
    /// No form factor is larger: 1 where all surfaces are opaque, nothing where light is counted at every crossing.
    bound: f64,
}

/// How a form factor was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Method {
    /// Contour integrals: nothing lies between.
    ClosedForm,
    /// Quadrature over the sender of the exact visible part of the receiver.
    Quadrature,
}

impl Bodies {
    /// The objects of a scene; `tau` holds one number per material.
    pub fn new(scene: &Scene, tau: &[f32]) -> Bodies {
        // Some roundings of the file's numbers, which are large where the scene is far from the origin.
        let reach = scene.frame.center.abs().max_element() / scene.frame.scale;
        let flat = 16.0 * f64::EPSILON * (4.0 + reach);
        let groups = groups(scene);
        let faceted: Vec<Vec<Facet>> = groups.par_iter().map(|(_, triangles)| facets(triangles, flat)).collect();
        let mut bodies = vec![Vec::new(); scene.objects.len()];
        let mut masked = vec![false; scene.objects.len()];
        let mut occluders = Vec::new();
        for (((object, material), _), facets) in groups.iter().zip(faceted) {
            let through = tau[*material as usize];
            let is_masked = scene.materials[*material as usize].is_masked();
            masked[*object as usize] |= is_masked;
            if through < 1.0 {
                let shade = |facet: &Facet, tile: &Vec<DVec3>| Occluder {
                    plane: facet.plane,
                    polygon: tile.clone(),
                    tau: f64::from(through),
                    masked: is_masked,
                };
                occluders.extend(facets.iter().flat_map(|f| f.tiles.iter().map(move |tile| shade(f, tile))));
            }
            let body: &mut Vec<Facet> = &mut bodies[*object as usize];
            if scene.materials[*material as usize].sides == Sides::Two {
                body.extend(facets.iter().map(Facet::reversed));
            }
            body.extend(facets);
        }
        let opaque = nothing_passes(tau.iter().copied());
        Bodies { bodies, occluders, masked, bound: if opaque { 1.0 } else { f64::INFINITY } }
    }

    /// Area of a body, unit coordinates squared; both sides where both send and receive.
    pub fn area(&self, body: usize) -> f64 {
        // From 0: the sum of nothing is -0.
        self.bodies[body].iter().fold(0.0, |sum, facet| sum + facet.area)
    }

    /// Number of facets of a body.
    pub fn facets(&self, body: usize) -> usize {
        self.bodies[body].len()
    }

    /// The form factor from a body that sends rays to one that receives them, with an estimate of its error; `None`
    /// where they are of too many facets, have too much between them for the `work` allowed, or where one of them or
    /// what lies between has a mask: rays know of holes and of shares.
    ///
    /// The error exceeds the tolerance where it would have taken more than `work`: triangles of the sender times the
    /// occluders seen from each, about a microsecond a piece.
    pub fn factor(&self, from: usize, to: usize, tolerance: &Tolerance, work: usize) -> Option<(Estimate, Method)> {
        let area = self.area(from);
        if area <= 0.0 {
            return Some((Estimate::default(), Method::ClosedForm));
        }
        if self.masked[from] || self.masked[to] {
            return None;
        }
        let links = self.links(from, to)?;
        if links.iter().any(|link| link.occluders.iter().any(|occluder| occluder.masked)) {
            return None;
        }
        let (open, hidden): (Vec<Link>, Vec<Link>) = links.into_iter().partition(|l| l.occluders.is_empty());
        let edges: usize = open.iter().map(|l| l.from.edges.len() * l.to.edges.len()).sum();
        let cuts: usize = hidden.iter().map(|l| 1 + l.occluders.len()).sum();
        if edges > MOST_EDGE_PAIRS || hidden.len() > MOST_LINKS || FEWEST * cuts > work {
            return None;
        }
        let parts: Vec<Estimate> = open.par_iter().map(unoccluded).collect();
        let mut sum = parts.into_iter().fold(Estimate::default(), plus);
        let method = if hidden.is_empty() { Method::ClosedForm } else { Method::Quadrature };
        if method == Method::Quadrature {
            // A quarter, so that an error estimated too small by so much still meets the tolerance.
            let known = sum;
            let goal = |value: f64| 0.25 * area * tolerance.of((known.value + value) / area) - known.error;
            let most = work * hidden.len() / cuts;
            sum = plus(sum, cubature::exchange(&hidden, goal, most));
        }
        let value = (sum.value / area).min(self.bound);
        let error = sum.error / area;
        Some((Estimate { value, error }, method))
    }

    /// All pairs of facets that face each other, cut to what each sees of the other; `None` where they are too many.
    fn links(&self, from: usize, to: usize) -> Option<Vec<Link<'_>>> {
        let (senders, receivers) = (&self.bodies[from], &self.bodies[to]);
        if senders.len() * receivers.len() > MOST_PAIRS {
            return None;
        }
        // The parts of two facets in front of each other's planes.
        let facing = |a: &Facet, b: &Facet| Some((a.in_front_of(&b.plane)?, b.in_front_of(&a.plane)?));
        let pairs: Vec<(Facet, Facet)> =
            senders.par_iter().flat_map_iter(|a| receivers.iter().filter_map(move |b| facing(a, b))).collect();
        if pairs.len() * self.occluders.len() > MOST_TESTS {
            return None;
        }
        let link = |(from, to): (Facet, Facet)| Link { occluders: between(&from, &to, &self.occluders), from, to };
        Some(pairs.into_par_iter().map(link).collect())
    }
}

/// An object and a material, and the faces they have in common.
type Group = ((u32, u32), Vec<[DVec3; 3]>);

/// The faces of each object and material, in order of their numbers.
fn groups(scene: &Scene) -> Vec<Group> {
    let mut found = std::collections::BTreeMap::<_, Vec<_>>::new();
    for (k, face) in scene.faces.iter().enumerate().take(scene.solid_faces() as usize) {
        let group = found.entry((face.object, face.material)).or_default();
        group.push(scene.exact_corners(k as u32));
    }
    found.into_iter().collect()
}

/// `A F` with nothing between.
fn unoccluded(link: &Link) -> Estimate {
    heed_interrupt();
    let (a, b) = (&link.from, &link.to);
    if distance_over_size(a, b) < FAR {
        return contour_integral::exchange(&a.edges, &b.edges);
    }
    // Lambert's formula keeps a share of 1e-16 FAR² of a form factor this small; no more is possible.
    let goal = |value: f64| 1e-8 * value;
    cubature::exchange(std::slice::from_ref(link), goal, MOST_OPEN)
}

/// Distance of the middles of two facets over the larger's size.
fn distance_over_size(a: &Facet, b: &Facet) -> f64 {
    let ball = |f: &Facet| {
        let middle = f.points().sum::<DVec3>() / f.points().count() as f64;
        let radius = f.points().map(|p| p.distance(middle)).fold(0.0, f64::max);
        (middle, radius)
    };
    let ((p, r), (q, s)) = (ball(a), ball(b));
    p.distance(q) / (2.0 * r.max(s))
}

fn plus(a: Estimate, b: Estimate) -> Estimate {
    Estimate { value: a.value + b.value, error: a.error + b.error }
}
