//! Light cuts: who lights a patch, where luminaires are many.
//!
//! Each patch walks the tree of luminaires once ([`crate::direct::cut_refinement`]). What surely sees all of the patch,
//! with nothing between, is summed over nodes of the tree: a polynomial over a flat patch, the nodes themselves for a
//! curved one. The few near or strong ones keep their closed form, shadows cut out. The rest is drawn from
//! ([`crate::direct::light_sampling`]).
//!
//! Not handled: hierarchies of faces; where faces are too many all luminaires are drawn.

use glam::DVec3;
use rayon::prelude::*;

use crate::direct::cut_refinement::{CutInputs, Walk};
use crate::direct::light_sampling::{Chance, MOST_DRAWN, weigh};
use crate::direct::light_tree::LightTree;
use crate::direct::luminaire::Luminaires;
use crate::direct::normal_cone::Facing;
use crate::form_factors::chebyshev::Tiles;
use crate::rays::Hit;

/// Luminaires by closed form at most.
const MOST_EXACT: usize = 48;
/// Faces × patches beyond which what lies between is not asked.
const MOST_TESTS: usize = 20_000_000;
/// The largest misfit of a polynomial, where more is tolerable.
const MISFIT: f64 = 1e-3;

/// The tree of luminaires, and each patch's cut through it.
#[derive(Debug)]
pub struct LightCuts {
    pub(crate) tree: LightTree,
    cuts: Vec<LightCut>,
}

/// A cut through the tree of luminaires: who lights one patch, and how each is asked.
#[derive(Debug, Default)]
pub(crate) struct LightCut {
    /// What is surely seen and what likely arrives of the rest.
    pub seen: Vec<Seen>,
    /// The sum of that as a polynomial, where there is one.
    pub smooth: Option<Tiles>,
    /// Luminaires by closed form, with the casters between.
    pub exact: Vec<(u32, Vec<u32>)>,
    /// Nodes to draw from, in the tree's order.
    pub drawn: Vec<Chance>,
    /// Some of those are near the patch: which of them lights a receiver depends on where it is.
    pub near: bool,
    /// How many to draw at a receiver.
    pub draws: u32,
}

/// A node of which a share arrives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub node: usize,
    pub share: f64,
    /// About its part of all that is seen from the patch, and that of those before it; 1 at last.
    pub until: f64,
}

impl LightCuts {
    /// Luminaires drawn at a receiver at most.
    pub const MOST_DRAWN: u32 = MOST_DRAWN;

    /// The cut of each patch that `receives`.
    pub(crate) fn new(inputs: &CutInputs, receives: &[bool]) -> LightCuts {
        let tree = LightTree::new(inputs.luminaires);
        // Faces behind all luminaires lie between none and anything.
        let root = &tree.nodes[tree.root()].body;
        let reached = |&k: &u32| root.reached_by(&inputs.casters[k as usize]);
        let among: Vec<u32> = (0..inputs.casters.len() as u32).filter(reached).collect();
        let asked = among.len() * inputs.patches.len() <= MOST_TESTS;
        let cut = |hits: &mut Vec<Hit>, i: usize| {
            if !receives[i] {
                return LightCut::default();
            }
            let mut walk = Walk::new(inputs, &tree, i, asked);
            walk.visit(tree.root(), &among);
            finish(walk, inputs, i, hits)
        };
        let all = (0..inputs.patches.len()).into_par_iter();
        let cuts: Vec<LightCut> = all.map_init(Vec::new, cut).collect();
        LightCuts { tree, cuts }
    }

    /// The cut of patch i.
    pub(crate) fn of(&self, i: usize) -> &LightCut {
        &self.cuts[i]
    }
}

/// `sum of F L` of shares of nodes at a point x with unit normal n, nothing between.
pub(crate) fn light(tree: &LightTree, luminaires: &Luminaires, nodes: &[Seen], x: DVec3, n: DVec3) -> DVec3 {
    nodes.iter().map(|seen| seen.share * node_light(tree, luminaires, seen.node, x, n)).sum()
}

/// `F L` of node k at a point x with unit normal n, nothing between: its moments where it is far, above the horizon and
/// faces the point, else the sum over its parts.
fn node_light(tree: &LightTree, luminaires: &Luminaires, k: usize, x: DVec3, n: DVec3) -> DVec3 {
    let node = &tree.nodes[k];
    let away = node.center() - x;
    let (height, facing) = (n.dot(away), node.facing(x));
    if height <= -node.radius() || facing == Facing::Away {
        return DVec3::ZERO;
    }
    let above = || height >= node.radius() || node.body.corners.iter().all(|p| n.dot(*p - x) >= 0.0);
    let far = node.radius() <= tree.small * away.length();
    if far && facing == Facing::Towards && above() {
        return node.moments.light(x, n);
    }
    if let Some(children) = node.children {
        return children.map(|c| node_light(tree, luminaires, c, x, n)).iter().sum();
    }
    // A luminaire that is not far has a closed form.
    let luminaire = &luminaires.list[tree.order[node.range.start] as usize];
    let (x, n) = (x.as_vec3(), n.as_vec3());
    luminaire.light(x, n, luminaire.exact_form(x, n)) * luminaire.radiance.as_dvec3()
}

/// What a walk found, as a cut.
fn finish(mut walk: Walk, inputs: &CutInputs, i: usize, hits: &mut Vec<Hit>) -> LightCut {
    // The strongest luminaires keep their closed form.
    let tree = walk.tree;
    let mut exact = std::mem::take(&mut walk.exact);
    let strength = |e: &(usize, Vec<u32>)| walk.estimate(&tree.nodes[e.0]);
    exact.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    let weaker = exact.split_off(MOST_EXACT.min(exact.len()));
    walk.drawn.extend(weaker.into_iter().map(|e| e.0));
    walk.drawn.sort_unstable_by_key(|&k| tree.nodes[k].range.start);
    let number = |k: usize| tree.order[tree.nodes[k].range.start];
    let (drawn, draws) = weigh(&walk, inputs, i, hits);
    let mut cut = LightCut {
        exact: exact.into_iter().map(|(k, f)| (number(k), f)).collect(),
        near: drawn.len() > 1 && drawn.iter().any(|d| walk.is_near(&tree.nodes[d.node])),
        drawn,
        draws,
        ..LightCut::default()
    };
    smoothe(&walk, inputs, &mut cut);
    cut
}

/// Lists what is surely seen and likely arrives, and makes its polynomial.
fn smoothe(walk: &Walk, inputs: &CutInputs, cut: &mut LightCut) {
    let sure = walk.seen.iter().map(|&k| (k, 1.0));
    let likely = cut.drawn.iter().map(|d| (d.node, d.expected));
    let mut until = 0.0;
    let with_part = |(node, share): (usize, f64)| {
        until += share * walk.estimate(&walk.tree.nodes[node]);
        Seen { node, share, until }
    };
    cut.seen = sure.chain(likely.filter(|d| d.1 > 0.0)).map(with_part).collect();
    cut.seen.iter_mut().for_each(|seen| seen.until /= until);
    let sum = |x: DVec3| light(walk.tree, inputs.luminaires, &cut.seen, x, walk.normal);
    if let Some(rectangle) = walk.rectangle.as_ref().filter(|_| !cut.seen.is_empty()) {
        cut.smooth = Tiles::new(rectangle, MISFIT.min(0.5 * inputs.luminaires.tolerable), sum);
    }
}
