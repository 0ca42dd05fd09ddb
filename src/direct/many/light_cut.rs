//! Light cuts: the nodes of a light tree that light a patch, or a point.
//!
//! Each patch walks the tree once. Nodes visible from all of the patch without occlusion are summed: as a polynomial
//! over a flat patch, by their moments for a curved one. The few near or strong luminaires keep their closed form,
//! shadows cut out. The rest is sampled ([`crate::direct::drawn_light`]), with the share c that trial rays found of
//! each node as control variate. Nodes with a small part of the patch's light are sampled without a test of occlusion.
//!
//! A point that is asked for itself, and lies on no patch, walks the tree as a patch of no size: all but what is
//! sampled is one number then.
//!
//! Worth: rooms under 36 and 324 luminaires of two colours take 1.3 and 1.5 times the CPU seconds without polynomials,
//! one under 25 balls of 90 faces 1.1 to 1.2 times. After B. Walter et al., *Lightcuts*, 2005.
//! Not handled: hierarchies of faces; where faces are too many all luminaires are sampled. On curved patches no node is
//! culled, and only nodes far from the patch count as visible.

use glam::{DVec3, Vec2};

use crate::direct::Luminaires;
use crate::direct::agreement::LikelyShare;
use crate::direct::emitters::occlusion::Occlusion;
use crate::direct::emitters::shafts::{Shaft, most_faces};
use crate::direct::many::light_tree::{Facing, LightTree, Node, draw};
use crate::direct::many::place::Place;
use crate::form_factors::chebyshev::Tiles;
use crate::form_factors::shadow::{Caster, Pieces};
use crate::rays::sobol::{Sobol, hash};
use crate::rays::{Hit, Rays};

/// Luminaires by closed form at most.
const MOST_EXACT: usize = 48;
/// The largest misfit of a polynomial, where more is tolerable.
const MISFIT: f64 = 1e-3;

/// A cut through a tree of luminaires.
#[derive(Debug, Default)]
pub(crate) struct LightCut {
    /// Visible nodes, and the expected shares of sampled ones.
    pub seen: Vec<Seen>,
    /// The sum of those.
    pub sum: SeenSum,
    /// Luminaires by closed form, with the casters between.
    pub exact: Vec<(u32, Vec<u32>)>,
    /// Nodes to draw from, in the tree's order.
    pub drawn: Vec<Chance>,
    /// Some of those are near the patch, so that probabilities must depend on the receiver.
    pub near: bool,
    /// How many to draw at a receiver.
    pub draws: u32,
}

/// A node with its visible share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub node: usize,
    pub share: f64,
    /// About its part of all that is seen from the patch, and that of those before it; 1 at last.
    pub until: f64,
}

/// How the light of the nodes seen is summed.
#[derive(Debug, Default)]
pub(crate) enum SeenSum {
    /// Node by node at each receiver.
    #[default]
    ByNode,
    /// By polynomials over the patch.
    Tiles(Tiles),
    /// Once, for a single point, with all that has a closed form there.
    Known(DVec3),
}

/// A node to draw from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chance {
    pub node: usize,
    /// The probability of it and those before it.
    pub until: f64,
    /// Its uncertain power, and that of those before it.
    pub power_until: f64,
    /// The expected visible share, which is summed already: only the difference is sampled.
    pub expected: f64,
}

/// What cuts are made from.
#[derive(Clone, Copy)]
pub(crate) struct CutInputs<'a> {
    pub rays: &'a Rays,
    pub luminaires: &'a Luminaires,
    pub occlusion: &'a Occlusion,
    /// All faces that occlude.
    pub casters: &'a [Caster],
    /// Relative error that a node may have.
    pub exactness: f64,
}

/// Memory to use again from cut to cut.
#[derive(Default)]
pub(crate) struct CutMemory {
    hits: Vec<Hit>,
    pieces: Pieces,
}

/// Luminaires whose closed forms cost no more than a polynomial.
const FEW: usize = 2;

impl LightCut {
    /// Whether nodes stand for luminaires, or polynomials do.
    pub(crate) fn approximates(&self, tree: &LightTree) -> bool {
        self.seen.len() > FEW || self.seen.iter().any(|seen| tree.nodes[seen.node].children.is_some())
    }

    /// The cut through a tree for a place; `among` are the casters that are tested, none if they are too many.
    pub(crate) fn new(
        inputs: &CutInputs,
        tree: &LightTree,
        place: &Place,
        among: Option<&[u32]>,
        memory: &mut CutMemory,
    ) -> LightCut {
        let mut walk = Walk::new(inputs, tree, place);
        walk.tests_shadows = among.is_some() && place.body.is_some();
        let all = [u32::MAX];
        walk.visit(tree.root(), among.unwrap_or(if inputs.casters.is_empty() { &[] } else { &all }));
        finish(walk, memory)
    }
}

/// The casters that may hide some luminaire of a tree: those that are not behind all of them.
pub(crate) fn reaching(inputs: &CutInputs, tree: &LightTree) -> Vec<u32> {
    let root = &tree.nodes[tree.root()].body;
    (0..inputs.casters.len() as u32).filter(|&k| root.reached_by(&inputs.casters[k as usize])).collect()
}

/// `sum of F L` of shares of nodes at a point x with unit normal n without occlusion.
pub(crate) fn light(tree: &LightTree, luminaires: &Luminaires, nodes: &[Seen], x: DVec3, n: DVec3) -> DVec3 {
    nodes.iter().map(|seen| seen.share * node_light(tree, luminaires, seen.node, x, n)).sum()
}

/// `F L` of node k at a point x with unit normal n without occlusion: by its moments where it is far, above the horizon
/// and faces the point, else the sum over its halves.
fn node_light(tree: &LightTree, luminaires: &Luminaires, k: usize, x: DVec3, n: DVec3) -> DVec3 {
    let node = &tree.nodes[k];
    let away = node.center() - x;
    let (height, facing) = (n.dot(away), node.facing(x));
    if height <= -node.radius() || facing == Facing::Away {
        return DVec3::ZERO;
    }
    let above = || height >= node.radius() || node.body.corners.iter().all(|p| n.dot(*p - x) >= 0.0);
    if let Some(children) = node.children {
        let far = node.radius() <= tree.small * away.length();
        return match far && facing == Facing::Towards && above() {
            true => node.moments.light(x, n),
            false => children.map(|c| node_light(tree, luminaires, c, x, n)).iter().sum(),
        };
    }
    // A single luminaire has a closed form.
    let luminaire = &luminaires.list[tree.order[node.range.start] as usize];
    let (x, n) = (x.as_vec3(), n.as_vec3());
    luminaire.light(x, n, luminaire.exact_form(x, n), tree.exactness) * luminaire.radiance.as_dvec3()
}

/// The cut that a walk makes.
fn finish(mut walk: Walk, memory: &mut CutMemory) -> LightCut {
    let tree = walk.tree;
    let mut exact = std::mem::take(&mut walk.exact);
    let number = |k: usize| tree.order[tree.nodes[k].range.start];
    let mut known = DVec3::ZERO;
    if walk.place.is_point() {
        let (now, drawn): (Vec<_>, Vec<_>) = exact
            .into_iter()
            .map(|(k, faces)| (k, walk.light_behind(number(k), &faces, &mut memory.pieces)))
            .partition(|(_, light)| light.is_some());
        known = now.into_iter().filter_map(|(_, light)| light).sum();
        walk.drawn.extend(drawn.into_iter().map(|(k, _)| k));
        exact = Vec::new();
    }
    // The strongest luminaires keep their closed form.
    let strength = |e: &(usize, Vec<u32>)| walk.estimate(&tree.nodes[e.0]);
    exact.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    let weaker = exact.split_off(MOST_EXACT.min(exact.len()));
    walk.drawn.extend(weaker.into_iter().map(|e| e.0));
    walk.drawn.sort_unstable_by_key(|&k| tree.nodes[k].range.start);
    let (drawn, draws) = weigh(&walk, &mut memory.hits);
    let mut cut = LightCut {
        exact: exact.into_iter().map(|(k, f)| (number(k), f)).collect(),
        near: drawn.len() > 1 && drawn.iter().any(|d| walk.is_near(&tree.nodes[d.node])),
        drawn,
        draws,
        ..LightCut::default()
    };
    sum_up(&walk, known, &mut cut);
    cut
}

/// Lists the visible nodes and expected shares, and sums them up where that serves all receivers.
fn sum_up(walk: &Walk, known: DVec3, cut: &mut LightCut) {
    let sure = walk.seen.iter().map(|&k| (k, 1.0));
    let likely = cut.drawn.iter().map(|d| (d.node, d.expected));
    let mut until = 0.0;
    let with_part = |(node, share): (usize, f64)| {
        until += share * walk.estimate(&walk.tree.nodes[node]);
        Seen { node, share, until }
    };
    cut.seen = sure.chain(likely.filter(|d| d.1 > 0.0)).map(with_part).collect();
    cut.seen.iter_mut().for_each(|seen| seen.until /= until);
    let sum = |x: DVec3| light(walk.tree, walk.inputs.luminaires, &cut.seen, x, walk.place.normal);
    if walk.place.is_point() {
        cut.sum = SeenSum::Known(known + sum(walk.place.center));
        cut.seen = Vec::new();
    } else if let Some(rectangle) = walk.place.rectangle.as_ref().filter(|_| cut.approximates(walk.tree)) {
        let tiles = Tiles::new(rectangle, MISFIT.min(0.5 * walk.inputs.exactness), sum);
        cut.sum = tiles.map_or(SeenSum::ByNode, SeenSum::Tiles);
    }
}

/// Luminaires nearer to a patch than so many of its radii are no part of a polynomial.
const NEAR: f64 = 2.0;
/// Where moments are compared in addition to a rectangle's centre, in shares of half its sides.
const OFF_CENTER: f64 = 0.7;
/// Shares of a patch's light: below the first occlusion is not tested, below the second nodes are sampled whole, above
/// the third a luminaire keeps its closed form.
const NEGLIGIBLE: f64 = 1.0 / 64.0;
const WHOLE: f64 = 1.0 / 256.0;
const STRONG: f64 = 1.0 / 32.0;

/// The walk of one place through the tree.
struct Walk<'a> {
    inputs: &'a CutInputs<'a>,
    tree: &'a LightTree,
    place: &'a Place<'a>,
    tests_shadows: bool,
    /// Estimate of all its light without occlusion.
    total: f64,
    /// Nodes visible from all of the place.
    seen: Vec<usize>,
    /// Luminaires that keep their closed form, with the casters between.
    exact: Vec<(usize, Vec<u32>)>,
    /// Nodes to draw from.
    drawn: Vec<usize>,
}

impl<'a> Walk<'a> {
    fn new(inputs: &'a CutInputs<'a>, tree: &'a LightTree, place: &'a Place<'a>) -> Walk<'a> {
        let (seen, exact, drawn) = (Vec::new(), Vec::new(), Vec::new());
        let mut walk = Walk { inputs, tree, place, tests_shadows: false, total: 0.0, seen, exact, drawn };
        walk.total = walk.roughly(tree.root());
        walk
    }

    fn distance(&self, node: &Node) -> f64 {
        self.place.center.distance(node.center())
    }

    /// Estimate of the light of a node, mean of the channels, never zero.
    fn estimate(&self, node: &Node) -> f64 {
        let off = self.distance(node).powi(2) + node.radius().powi(2) + self.place.radius.powi(2);
        let light = node.moments.light(self.place.center, self.place.normal).element_sum() / 3.0;
        let most = node.power / (std::f64::consts::PI * off);
        light.min(most) + 0.02 * most
    }

    /// Estimate of the light of a node's luminaires, by parts of it that are far.
    fn roughly(&self, node: usize) -> f64 {
        let own = &self.tree.nodes[node];
        if self.misses(own) {
            return 0.0;
        }
        match own.children {
            Some(children) if own.radius() > 0.5 * self.distance(own) => children.map(|k| self.roughly(k)).iter().sum(),
            _ => self.estimate(own),
        }
    }

    /// Whether no point of the place can see the front of any of the node.
    fn misses(&self, node: &Node) -> bool {
        if self.place.corners.is_empty() {
            return false;
        }
        let height = |p: &DVec3| (*p - self.place.center).dot(self.place.normal);
        // Roundings of unit coordinates.
        node.body.corners.iter().all(|p| height(p) <= 1e-7) || self.facing(node) == Facing::Away
    }

    /// How a node's luminaires face the place.
    fn facing(&self, node: &Node) -> Facing {
        match node.cone_facing(self.place.center - node.center(), node.radius() + self.place.radius) {
            Facing::Both => self.facing_near(node),
            sure => sure,
        }
    }

    /// How a node's luminaires face the place, by the corners of both; only for luminaires of one direction.
    fn facing_near(&self, node: &Node) -> Facing {
        let corners = &self.place.corners;
        if corners.is_empty() || node.spread >= 1e-6 {
            return Facing::Both;
        }
        let heights = corners.iter().flat_map(|x| node.body.corners.iter().map(|y| (*x - *y).dot(node.axis)));
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = heights.fold(none, |(l, h), x| (l.min(x), h.max(x)));
        match (low >= -1e-7, high <= -1e-7) {
            (true, _) => Facing::Towards,
            (_, true) => Facing::Away,
            _ => Facing::Both,
        }
    }

    /// Whether moments of a node are exact enough at every point of the place.
    fn is_far(&self, node: &Node) -> bool {
        let height = |p: &DVec3| (*p - self.place.center).dot(self.place.normal);
        let above = || self.place.corners.is_empty() || node.body.corners.iter().all(|p| height(p) >= 0.0);
        node.radius() <= self.tree.small * (self.distance(node) - self.place.radius)
            && above()
            && self.agrees_with_its_halves(node)
            && match self.facing(node) {
                Facing::Towards => true,
                // Luminaires in one plane have the side in the kernel.
                Facing::Both => node.body.plane.is_some(),
                Facing::Away => false,
            }
    }

    /// Whether moments of a node have an error of no more than half of what is tolerable in any channel, estimated by
    /// the moments of its halves, which have an eighth of it in third order, at two points of the patch.
    fn agrees_with_its_halves(&self, node: &Node) -> bool {
        let Some(halves) = node.children else { return true };
        let agrees = |x: DVec3| {
            let of = |node: &Node| node.moments.light(x, self.place.normal);
            let exact: DVec3 = halves.map(|k| of(&self.tree.nodes[k])).iter().sum();
            (of(node) - exact).abs().cmple(0.5 * self.tree.exactness * exact).all()
        };
        let rectangle = self.place.rectangle.as_ref();
        agrees(self.place.center) && rectangle.is_none_or(|r| agrees(r.point(OFF_CENTER, OFF_CENTER)))
    }

    /// Whether a node lies so near to the patch that it is no part of a polynomial.
    fn is_near(&self, node: &Node) -> bool {
        self.distance(node) - node.radius() < NEAR * self.place.radius
    }

    /// `F L` of a luminaire at a point that is the place, shadows cut out; `None` where those are too ragged, or a part
    /// of a texture.
    fn light_behind(&self, number: u32, faces: &[u32], pieces: &mut Pieces) -> Option<DVec3> {
        let luminaire = &self.inputs.luminaires.list[number as usize];
        let casters = faces.iter().map(|&k| self.inputs.casters[k as usize]);
        let (x, n) = (self.place.center.as_vec3(), self.place.normal.as_vec3());
        let light = luminaire.visible_light(x, n, casters, self.inputs.exactness, pieces)?;
        Some(light * luminaire.radiance.as_dvec3())
    }

    /// Sorts a node by how it lights the place; `among` are the casters that may matter.
    fn visit(&mut self, k: usize, among: &[u32]) {
        let node = &self.tree.nodes[k];
        if self.misses(node) {
            return;
        }
        let near = self.is_near(node);
        let estimate = self.estimate(node);
        if !near && node.children.is_some() && among.is_empty() && self.is_far(node) {
            return self.seen.push(k);
        }
        if !near && !among.is_empty() && node.children.is_some() {
            if !self.tests_shadows {
                return self.part(k, f64::INFINITY);
            }
            if estimate < NEGLIGIBLE * self.total {
                return self.part(k, WHOLE * self.total);
            }
        }
        let casters = self.inputs.casters;
        // Of a leaf, which is one luminaire.
        let luminaire = &self.inputs.luminaires.list[self.tree.order[node.range.start] as usize];
        // A part of a texture has no closed form.
        let (most, is_textured) = (most_faces(luminaire), luminaire.is_textured());
        let body = self.place.body.as_ref().filter(|_| self.tests_shadows);
        let between: Option<Vec<u32>> = body.map(|place| {
            let (shaft, among) = (Shaft::new(place, &node.body), among.iter().copied());
            match node.children {
                Some(_) => shaft.holds_any_of(casters, among),
                None => shaft.holds_of(casters, among).take(most + 1).collect(),
            }
        });
        let clear = among.is_empty() || between.as_ref().is_some_and(Vec::is_empty);
        let is_masked = |&k: &u32| casters[k as usize].masked;
        match node.children {
            _ if clear && !near && self.is_far(node) => self.seen.push(k),
            Some(children) => {
                let between = between.as_deref().unwrap_or(among);
                children.iter().for_each(|&c| self.visit(c, between));
            }
            None if clear && !near => self.seen.push(k),
            None if clear => self.exact.push((k, Vec::new())),
            None => match between.filter(|b| b.len() <= most && !is_textured && !b.iter().any(is_masked)) {
                Some(faces) if near || estimate >= STRONG * self.total => {
                    self.exact.push((k, faces));
                }
                _ => self.drawn.push(k),
            },
        }
    }

    /// Adds a node to sample, in parts that are far and send less than `most`.
    fn part(&mut self, k: usize, most: f64) {
        let node = &self.tree.nodes[k];
        match node.children {
            _ if self.misses(node) => {}
            Some(children) if !self.is_far(node) || self.estimate(node) >= most => {
                children.iter().for_each(|&c| self.part(c, most));
            }
            _ => self.drawn.push(k),
        }
    }
}

/// Luminaires drawn at a receiver at most.
pub(crate) const MOST_DRAWN: u32 = 8;

/// Rays that estimate the visible share of a node.
const TRIALS: u32 = 8;

/// Luminaires drawn at a receiver, where the standard deviation is as large as its light.
const DRAWS: f64 = 16.0;

/// The nodes that a walk leaves to sampling, with probabilities in proportion to the standard deviation of their
/// visible light; and how many to draw at a receiver.
fn weigh(walk: &Walk, hits: &mut Vec<Hit>) -> (Vec<Chance>, u32) {
    let mut chances = Vec::with_capacity(walk.drawn.len());
    let sobol = Sobol::new(TRIALS as usize, 4);
    let (mut until, mut power_until) = (0.0, 0.0);
    for &node in &walk.drawn {
        let seed = hash(node as u32, walk.place.seed);
        let [all, arrived] = trials(walk, node, |s, d| sobol.point(s, d, seed), hits);
        let share = if all > 0.0 { arrived / all } else { 1.0 };
        let likely = LikelyShare::of(f64::from(TRIALS), f64::from(TRIALS) * share);
        let own = &walk.tree.nodes[node];
        // Of what is near nothing is expected, so that its share is drawn, and not its deviation.
        let is_near = walk.is_near(own);
        let (expected, spread) = if is_near { (0.0, likely.share.sqrt()) } else { (share, likely.spread()) };
        until += all.max(walk.estimate(own)) * spread;
        power_until += own.power * spread;
        chances.push(Chance { node, until, power_until, expected });
    }
    chances.iter_mut().for_each(|d| d.until /= until);
    let wanted = (DRAWS * until / walk.total.max(until)).ceil() as u32;
    let draws = wanted.next_power_of_two().clamp(1, MOST_DRAWN);
    let draws = if chances.is_empty() { 0 } else { draws };
    (chances, draws)
}

/// Mean light of a node from points drawn on it, at points of the place, without and with occlusion. `at(s, d)` is
/// number d of draw s.
fn trials(walk: &Walk, node: usize, at: impl Fn(u32, usize) -> f32, hits: &mut Vec<Hit>) -> [f64; 2] {
    let CutInputs { rays, luminaires, occlusion, .. } = *walk.inputs;
    let mut sums = [0.0; 2];
    for s in 0..TRIALS {
        let receiver = walk.place.receiver(at(s, 0), at(s, 1));
        let Some(drawn) = draw(walk.tree, luminaires, node, &receiver, Vec2::new(at(s, 2), at(s, 3))) else {
            continue;
        };
        let arrived = occlusion.transmittance(rays, receiver.end(), drawn.end, hits);
        let light = drawn.light.element_sum() / (3.0 * f64::from(TRIALS));
        sums[0] += light;
        sums[1] += light * f64::from(arrived);
    }
    sums
}
