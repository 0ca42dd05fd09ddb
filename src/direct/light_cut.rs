//! Who lights a patch, where luminaires are many.
//!
//! Each patch walks the tree of luminaires once ([`crate::direct::cut_refinement`]). What surely sees all of the patch, with nothing between,
//! is summed over nodes of the tree: a polynomial over a flat patch, the nodes themselves for a curved one. The few near
//! or strong ones keep their closed form, shadows cut out. The rest is drawn from ([`crate::direct::light_sampling`]).
//!
//! Not handled: hierarchies of faces; where faces are too many all luminaires are drawn.

use glam::DVec3;
use rayon::prelude::*;

use crate::direct::cut_refinement::{SMALL, Walk};
use crate::direct::light_sampling::weigh;
use crate::direct::light_tree::Lamps;
use crate::direct::luminaire::Luminaires;
use crate::direct::normal_cone::Facing;
use crate::direct::visibility::Occlusion;
use crate::form_factors::geometry::chebyshev::Tiles;
use crate::form_factors::geometry::shadow::Caster;
use crate::patches::Patches;
use crate::rays::{Hit, Rays};

/// Luminaires by closed form at most.
const MOST_EXACT: usize = 48;
/// Faces × patches beyond which what lies between is not asked.
const MOST_TESTS: usize = 20_000_000;
/// The largest misfit of a polynomial.
const MISFIT: f64 = 1e-3;

/// Who lights each patch.
#[derive(Debug)]
pub struct Links {
    pub(crate) lamps: Lamps,
    links: Vec<Link>,
}

/// Who lights one patch.
#[derive(Debug, Default)]
pub(crate) struct Link {
    /// What is surely seen and what likely arrives of the rest, as a polynomial.
    pub smooth: Option<Tiles>,
    /// The same as nodes with shares of their light, where there is no polynomial.
    pub seen: Vec<(usize, f64)>,
    /// Luminaires by closed form, with the casters between.
    pub exact: Vec<(u32, Vec<u32>)>,
    /// Nodes to draw from.
    pub drawn: Vec<Chance>,
    /// How many to draw at a receiver.
    pub draws: u32,
}

/// A node to draw from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chance {
    pub node: usize,
    /// The chance of it and those before it.
    pub until: f64,
    /// The share of its light that is summed already: only what arrives beyond it is drawn.
    pub expected: f64,
}

/// What all patches share.
pub(crate) struct Maker<'a> {
    pub rays: &'a Rays,
    pub patches: &'a Patches,
    pub luminaires: &'a Luminaires,
    pub occlusion: &'a Occlusion,
    /// All faces that occlude.
    pub casters: &'a [Caster],
}

impl Links {
    /// Luminaires drawn at a receiver at most.
    pub const MOST_DRAWN: u32 = 8;

    pub(crate) fn new(maker: &Maker, receives: &[bool]) -> Links {
        let lamps = Lamps::new(maker.luminaires);
        // Faces behind all luminaires lie between none and anything.
        let root = &lamps.nodes[lamps.root()].body;
        let reached = |&k: &u32| root.reached_by(&maker.casters[k as usize]);
        let among: Vec<u32> = (0..maker.casters.len() as u32).filter(reached).collect();
        let asked = among.len() * maker.patches.len() <= MOST_TESTS;
        let link = |hits: &mut Vec<Hit>, i: usize| {
            if !receives[i] {
                return Link::default();
            }
            let mut walk = Walk::new(maker, &lamps, i, asked);
            walk.visit(lamps.root(), &among);
            finish(walk, maker, i, hits)
        };
        let all = (0..maker.patches.len()).into_par_iter();
        let links: Vec<Link> = all.map_init(Vec::new, link).collect();
        Links { lamps, links }
    }

    /// Who lights patch i.
    pub(crate) fn of(&self, i: usize) -> &Link {
        &self.links[i]
    }
}

/// `sum of F L` of shares of nodes at a point with unit normal, nothing between.
pub(crate) fn light((lamps, luminaires): (&Lamps, &Luminaires), nodes: &[(usize, f64)], x: DVec3, n: DVec3) -> DVec3 {
    let light = |k: usize| node_light(lamps, luminaires, k, (x, n));
    nodes.iter().map(|&(k, share)| share * light(k)).sum()
}

/// The same of one node: its moments where it is far, above the horizon and faces the point, else its parts.
fn node_light(lamps: &Lamps, luminaires: &Luminaires, k: usize, (x, n): (DVec3, DVec3)) -> DVec3 {
    let node = &lamps.nodes[k];
    let away = node.center() - x;
    let (height, facing) = (n.dot(away), node.facing(x));
    if height <= -node.radius() || facing == Facing::Away {
        return DVec3::ZERO;
    }
    let above = || {
        let corners = || node.body.corners.iter();
        height >= node.radius() || corners().all(|p| n.dot(*p - x) >= 0.0)
    };
    let far = node.radius() <= SMALL * away.length();
    if far && facing == Facing::Towards && above() {
        return node.moments.light(x, n);
    }
    if let Some(children) = node.children {
        return children.map(|c| node_light(lamps, luminaires, c, (x, n))).iter().sum();
    }
    // A luminaire that is not far has a closed form.
    let luminaire = &luminaires.list[lamps.order[node.range.start] as usize];
    luminaire.exact_form(x.as_vec3(), n.as_vec3()) * luminaire.radiance.as_dvec3()
}

/// What a walk found, as a link.
fn finish(mut walk: Walk, maker: &Maker, i: usize, hits: &mut Vec<Hit>) -> Link {
    // The strongest luminaires keep their closed form.
    let lamps = walk.lamps;
    let mut exact = std::mem::take(&mut walk.exact);
    let strength = |e: &(usize, Vec<u32>)| walk.estimate(&lamps.nodes[e.0]);
    exact.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    let weaker = exact.split_off(MOST_EXACT.min(exact.len()));
    walk.drawn.extend(weaker.into_iter().map(|e| e.0));
    let number = |k: usize| lamps.order[lamps.nodes[k].range.start];
    let (drawn, draws) = weigh(&walk, maker, i, hits);
    let mut link =
        Link { exact: exact.into_iter().map(|(k, f)| (number(k), f)).collect(), drawn, draws, ..Link::default() };
    smoothe(&walk, maker, &mut link);
    link
}

/// Makes the polynomial of what is surely seen and likely arrives; keeps the nodes where there is none.
fn smoothe(walk: &Walk, maker: &Maker, link: &mut Link) {
    let (lamps, normal) = ((walk.lamps, maker.luminaires), walk.normal);
    let sure = walk.seen.iter().map(|&k| (k, 1.0));
    let likely = link.drawn.iter().map(|d| (d.node, d.expected));
    let seen: Vec<(usize, f64)> = sure.chain(likely.filter(|d| d.1 > 0.0)).collect();
    let sum = |x: DVec3| light(lamps, &seen, x, normal);
    if let Some(rectangle) = walk.rectangle.as_ref().filter(|_| !seen.is_empty()) {
        link.smooth = Tiles::new(rectangle, MISFIT, sum);
        if link.smooth.is_some() {
            return;
        }
    }
    link.seen = seen;
}
