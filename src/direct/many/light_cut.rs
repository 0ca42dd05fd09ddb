//! Light cuts: the nodes of the light tree that light a patch, where luminaires are many.
//!
//! Each patch walks the tree of luminaires once. Nodes visible from all of the patch without occlusion are summed: as a
//! polynomial over a flat patch, by their moments for a curved one. The few near or strong luminaires keep their closed
//! form, shadows cut out. The rest is sampled ([`crate::direct::drawn_light`]). Nodes with a small part of the patch's
//! light are sampled without a test of occlusion, at little noise.
//!
//! Worth: rooms under 36 and 324 luminaires of two colours at 2 % take 1.2 and 1.3 times the CPU seconds without
//! polynomials, one with 90 luminaires of many faces 2.1 times (git log). After B. Walter et al., *Lightcuts*, 2005.
//! Not handled: hierarchies of faces; where faces are too many all luminaires are sampled. On curved patches no node is
//! culled, and only nodes far from the patch count as visible.

use glam::{DVec3, Vec2};
use halflight_team::Loop;

use crate::direct::Luminaires;
use crate::direct::emitters::occlusion::Occlusion;
use crate::direct::emitters::shafts::{Body, Shaft, most_faces, patch_body};
use crate::direct::many::light_tree::{Facing, LightTree, Node, draw};
use crate::form_factors::chebyshev::{Rectangle, Tiles};
use crate::form_factors::shadow::Caster;
use crate::patches::Patches;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::{Hit, Rays};

/// Luminaires by closed form at most.
const MOST_EXACT: usize = 48;
/// Faces × patches beyond which occlusion is not tested.
const MOST_TESTS: usize = 20_000_000;
/// The largest misfit of a polynomial, where more is tolerable.
const MISFIT: f64 = 1e-3;

/// The tree of luminaires, and each patch's cut through it.
#[derive(Debug)]
pub(crate) struct LightCuts {
    /// The emitter whose luminaires these are.
    pub(crate) emitter: usize,
    pub(crate) tree: LightTree,
    cuts: Vec<LightCut>,
}

/// A cut through the tree of luminaires for one patch.
#[derive(Debug, Default)]
pub(crate) struct LightCut {
    /// Visible nodes, and the expected shares of sampled ones.
    pub seen: Vec<Seen>,
    /// The sum of those as a polynomial, where there is one.
    pub smooth: Option<Tiles>,
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

impl LightCuts {
    /// Luminaires drawn at a receiver at most.
    pub(crate) const MOST_DRAWN: u32 = MOST_DRAWN;

    /// The cut of each patch that `receives`.
    pub(crate) fn new(inputs: &CutInputs, receives: &[bool]) -> LightCuts {
        let list = &inputs.luminaires.list;
        let numbers: Vec<u32> =
            (0..list.len() as u32).filter(|&l| list[l as usize].emitter == inputs.emitter).collect();
        let tree = LightTree::new(inputs.luminaires, &numbers, inputs.exactness);
        // Faces behind all luminaires do not occlude.
        let root = &tree.nodes[tree.root()].body;
        let reached = |&k: &u32| root.reached_by(&inputs.casters[k as usize]);
        let among: Vec<u32> = (0..inputs.casters.len() as u32).filter(reached).collect();
        let tests_shadows = among.len() * inputs.patches.len() <= MOST_TESTS;
        let cut = |hits: &mut Vec<Hit>, i: usize| {
            if !receives[i] {
                return LightCut::default();
            }
            let mut walk = Walk::new(inputs, &tree, i, tests_shadows);
            walk.visit(tree.root(), &among);
            finish(walk, inputs, i, hits)
        };
        let cuts = Loop::weighed(inputs.patches.len(), |i| f64::from(u8::from(receives[i]))).map_init(Vec::new, cut);
        LightCuts { emitter: inputs.emitter, tree, cuts }
    }

    /// The cut of patch i.
    pub(crate) fn of(&self, i: usize) -> &LightCut {
        &self.cuts[i]
    }
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
    luminaire.light(x, n, luminaire.exact_form(x, n), tree.exactness) * luminaire.radiance.as_dvec3()
}

/// The cut that a walk makes.
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

/// Lists the visible nodes and expected shares, and makes their polynomial.
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
        cut.smooth = Tiles::new(rectangle, MISFIT.min(0.5 * inputs.exactness), sum);
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

/// What the cuts of all patches are made from.
pub(crate) struct CutInputs<'a> {
    pub rays: &'a Rays,
    pub patches: &'a Patches,
    pub luminaires: &'a Luminaires,
    /// The emitter whose luminaires are taken.
    pub emitter: usize,
    pub occlusion: &'a Occlusion,
    /// All faces that occlude.
    pub casters: &'a [Caster],
    /// Relative error that a node may have.
    pub exactness: f64,
}

/// The walk of one patch through the tree.
pub(crate) struct Walk<'a> {
    pub tree: &'a LightTree,
    luminaires: &'a Luminaires,
    casters: &'a [Caster],
    /// None where occlusion is not tested.
    body: Option<Body>,
    pub rectangle: Option<Rectangle>,
    center: DVec3,
    pub normal: DVec3,
    radius: f64,
    /// Estimate of all its light without occlusion.
    pub total: f64,
    /// Nodes visible from all of the patch.
    pub seen: Vec<usize>,
    /// Luminaires that keep their closed form, with the casters between.
    pub exact: Vec<(usize, Vec<u32>)>,
    /// Nodes to draw from.
    pub drawn: Vec<usize>,
}

impl<'a> Walk<'a> {
    /// A walk of patch i, with tests of occlusion or not.
    pub(crate) fn new(inputs: &'a CutInputs, tree: &'a LightTree, i: usize, tests_shadows: bool) -> Walk<'a> {
        let patches = inputs.patches;
        let rectangle = Rectangle::new(patches, i);
        let corners: Vec<DVec3> = patches.pieces(i).flat_map(|p| p.1.map(|q| q.as_dvec3())).collect();
        let mean = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
        let reach = |p: &DVec3| p.distance(mean);
        let face = patches.pieces(i).next().map_or(0, |p| p.0);
        let mut walk = Walk {
            tree,
            luminaires: inputs.luminaires,
            casters: inputs.casters,
            body: patch_body(patches, i).filter(|_| tests_shadows),
            center: rectangle.as_ref().map_or(mean, |r| r.center),
            normal: patches.normal(face, patches.side(i)).as_dvec3(),
            radius: match &rectangle {
                Some(r) => r.radius(),
                None => corners.iter().map(reach).fold(0.0, f64::max),
            },
            rectangle,
            total: 0.0,
            seen: Vec::new(),
            exact: Vec::new(),
            drawn: Vec::new(),
        };
        walk.total = walk.roughly(tree.root());
        walk
    }

    fn distance(&self, node: &Node) -> f64 {
        self.center.distance(node.center())
    }

    /// Estimate of the light of a node, mean of the channels, never zero.
    pub(crate) fn estimate(&self, node: &Node) -> f64 {
        let off = self.distance(node).powi(2) + node.radius().powi(2) + self.radius.powi(2);
        let light = node.moments.light(self.center, self.normal).element_sum() / 3.0;
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

    /// Whether no point of the patch can see the front of any of the node.
    fn misses(&self, node: &Node) -> bool {
        let Some(rectangle) = &self.rectangle else {
            return false;
        };
        let height = |p: &DVec3| (*p - self.center).dot(rectangle.normal);
        // Roundings of unit coordinates.
        node.body.corners.iter().all(|p| height(p) <= 1e-7) || self.facing(node) == Facing::Away
    }

    /// How a node's luminaires face the patch.
    fn facing(&self, node: &Node) -> Facing {
        match node.cone_facing(self.center - node.center(), node.radius() + self.radius) {
            Facing::Both => self.facing_near(node),
            sure => sure,
        }
    }

    /// How a node's luminaires face the patch, by the corners of both; only for luminaires of one direction.
    fn facing_near(&self, node: &Node) -> Facing {
        let Some(rectangle) = self.rectangle.as_ref().filter(|_| node.spread < 1e-6) else {
            return Facing::Both;
        };
        let corners = rectangle.corners();
        let heights = corners.iter().flat_map(|x| node.body.corners.iter().map(|y| (*x - *y).dot(node.axis)));
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = heights.fold(none, |(l, h), x| (l.min(x), h.max(x)));
        match (low >= -1e-7, high <= -1e-7) {
            (true, _) => Facing::Towards,
            (_, true) => Facing::Away,
            _ => Facing::Both,
        }
    }

    /// Whether moments of a node are exact enough at every point of the patch.
    fn is_far(&self, node: &Node) -> bool {
        let above = |r: &Rectangle| {
            let height = |p: &DVec3| (*p - r.center).dot(r.normal);
            node.body.corners.iter().all(|p| height(p) >= 0.0)
        };
        node.radius() <= self.tree.small * (self.distance(node) - self.radius)
            && self.rectangle.as_ref().is_none_or(above)
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
            let of = |node: &Node| node.moments.light(x, self.normal);
            let exact: DVec3 = halves.map(|k| of(&self.tree.nodes[k])).iter().sum();
            (of(node) - exact).abs().cmple(0.5 * self.tree.exactness * exact).all()
        };
        agrees(self.center) && self.rectangle.as_ref().is_none_or(|r| agrees(r.point(OFF_CENTER, OFF_CENTER)))
    }

    /// Whether a node lies so near to the patch that it is no part of a polynomial.
    pub(crate) fn is_near(&self, node: &Node) -> bool {
        self.distance(node) - node.radius() < NEAR * self.radius
    }

    /// Sorts a node by how it lights the patch; `among` are the casters that may matter.
    pub(crate) fn visit(&mut self, k: usize, among: &[u32]) {
        let node = &self.tree.nodes[k];
        if self.misses(node) {
            return;
        }
        let near = self.is_near(node);
        let estimate = self.estimate(node);
        if !near && node.children.is_some() && among.is_empty() && self.is_far(node) {
            return self.seen.push(k);
        }
        if !near && !among.is_empty() && estimate < NEGLIGIBLE * self.total && node.children.is_some() {
            return self.part(k);
        }
        let casters = self.casters;
        // Of a leaf, which is one luminaire.
        let most = most_faces(&self.luminaires.list[self.tree.order[node.range.start] as usize]);
        let between: Option<Vec<u32>> = self.body.as_ref().map(|patch| {
            let (shaft, among) = (Shaft::new(patch, &node.body), among.iter().copied());
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
            None => match between.filter(|b| b.len() <= most && !b.iter().any(is_masked)) {
                Some(faces) if near || estimate >= STRONG * self.total => {
                    self.exact.push((k, faces));
                }
                _ => self.drawn.push(k),
            },
        }
    }

    /// Adds a node to sample, in parts small enough.
    fn part(&mut self, k: usize) {
        let node = &self.tree.nodes[k];
        match node.children {
            _ if self.misses(node) => {}
            Some(children) if !self.is_far(node) || self.estimate(node) >= WHOLE * self.total => {
                children.iter().for_each(|&c| self.part(c));
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

/// A node to draw from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chance {
    pub node: usize,
    /// The probability of it and those before it.
    pub until: f64,
    /// Its uncertain power.
    pub power: f64,
    /// The expected visible share, which is summed already: only the difference is sampled.
    pub expected: f64,
}

/// The nodes that a walk leaves to sampling, with probabilities in proportion to the standard deviation of their
/// visible light; and how many to draw at a receiver.
fn weigh(walk: &Walk, inputs: &CutInputs, i: usize, hits: &mut Vec<Hit>) -> (Vec<Chance>, u32) {
    let mut chances = Vec::with_capacity(walk.drawn.len());
    let sobol = Sobol::new(TRIALS as usize, 4);
    let mut until = 0.0;
    for &node in &walk.drawn {
        let seed = hash(node as u32, hash(i as u32, 0x11_6a5b));
        let [all, arrived] = trials(inputs, walk.tree, i, node, |s, d| sobol.point(s, d, seed), hits);
        let share = if all > 0.0 { arrived / all } else { 1.0 };
        // Laplace's rule: the variance is not 0 where all trials agree.
        let likely = (f64::from(TRIALS) * share + 0.5) / f64::from(TRIALS + 1);
        let own = &walk.tree.nodes[node];
        let (expected, variance) = if walk.is_near(own) { (0.0, likely) } else { (share, likely * (1.0 - likely)) };
        until += all.max(walk.estimate(own)) * variance.sqrt();
        chances.push(Chance { node, until, power: own.power * variance.sqrt(), expected });
    }
    chances.iter_mut().for_each(|d| d.until /= until);
    let wanted = (DRAWS * until / walk.total.max(until)).ceil() as u32;
    let draws = wanted.next_power_of_two().clamp(1, MOST_DRAWN);
    let draws = if chances.is_empty() { 0 } else { draws };
    (chances, draws)
}

/// Mean light of a node from points drawn on it, at points of patch i, without and with occlusion. `at(s, d)` is number
/// d of draw s.
fn trials(
    inputs: &CutInputs,
    tree: &LightTree,
    i: usize,
    node: usize,
    at: impl Fn(u32, usize) -> f32,
    hits: &mut Vec<Hit>,
) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for s in 0..TRIALS {
        let receiver = inputs.patches.point(i, at(s, 0), at(s, 1));
        let Some(drawn) = draw(tree, inputs.luminaires, node, &receiver, Vec2::new(at(s, 2), at(s, 3))) else {
            continue;
        };
        let arrived = inputs.occlusion.transmittance(inputs.rays, receiver.end(), drawn.end, hits);
        let light = drawn.light.element_sum() / (3.0 * f64::from(TRIALS));
        sums[0] += light;
        sums[1] += light * f64::from(arrived);
    }
    sums
}
