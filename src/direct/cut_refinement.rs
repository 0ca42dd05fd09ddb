//! One patch's walk through the tree of luminaires: which nodes it surely sees, which keep their closed form, and which
//! are drawn from.
//!
//! Nodes whose part of the patch's light is small are not asked what lies between: drawing among them costs little
//! noise.
//!
//! Not handled: on curved patches no node is told to light nothing, and only nodes far from the patch are seen whole.

use glam::DVec3;

use crate::direct::convex_body::{Body, patch_body};
use crate::direct::light_tree::{LightTree, Node};
use crate::direct::luminaire::Luminaires;
use crate::direct::normal_cone::Facing;
use crate::direct::occlusion::Occlusion;
use crate::direct::shaft_culling::{most_faces, sieve};
use crate::form_factors::chebyshev::Rectangle;
use crate::form_factors::shadow::Caster;
use crate::patches::Patches;
use crate::rays::Rays;

/// Luminaires nearer to a patch than so many of its radii are no part of a polynomial.
const NEAR: f64 = 2.0;
/// Where a rectangle is looked at beside its centre, in shares of half its sides.
const OFF_CENTER: f64 = 0.7;
/// Shares of a patch's light: below the first what lies between is not asked, below the second nodes are drawn whole,
/// above the third a luminaire keeps its closed form.
const ASKED: f64 = 1.0 / 64.0;
const WHOLE: f64 = 1.0 / 256.0;
const STRONG: f64 = 1.0 / 32.0;

/// What the cuts of all patches are made from.
pub(crate) struct CutInputs<'a> {
    pub rays: &'a Rays,
    pub patches: &'a Patches,
    pub luminaires: &'a Luminaires,
    pub occlusion: &'a Occlusion,
    /// All faces that occlude.
    pub casters: &'a [Caster],
}

/// One patch while it walks the tree.
pub(crate) struct Walk<'a> {
    pub tree: &'a LightTree,
    luminaires: &'a Luminaires,
    casters: &'a [Caster],
    /// None where nothing is to be asked.
    body: Option<Body>,
    pub rectangle: Option<Rectangle>,
    center: DVec3,
    pub normal: DVec3,
    radius: f64,
    /// About all its light, nothing between.
    pub total: f64,
    /// Nodes surely seen by all of the patch.
    pub seen: Vec<usize>,
    /// Luminaires that keep their closed form, with the casters between.
    pub exact: Vec<(usize, Vec<u32>)>,
    /// Nodes to draw from.
    pub drawn: Vec<usize>,
}

impl<'a> Walk<'a> {
    /// A walk of patch i; where what lies between is not `asked`, anything may.
    pub fn new(inputs: &'a CutInputs, tree: &'a LightTree, i: usize, asked: bool) -> Walk<'a> {
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
            body: patch_body(patches, i).filter(|_| asked),
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

    /// About the light of a node, a mean of the channels, never zero.
    pub fn estimate(&self, node: &Node) -> f64 {
        let off = self.distance(node).powi(2) + node.radius().powi(2) + self.radius.powi(2);
        let light = node.moments.light(self.center, self.normal).element_sum() / 3.0;
        let most = node.power / (std::f64::consts::PI * off);
        light.min(most) + 0.02 * most
    }

    /// About the light of a node's luminaires, each part of it estimated from afar.
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

    /// How a node's luminaires face the patch, told by the corners of both; only for luminaires of one direction.
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

    /// Whether moments speak for a node at every point of the patch.
    fn is_far(&self, node: &Node) -> bool {
        let above = |r: &Rectangle| {
            let height = |p: &DVec3| (*p - r.center).dot(r.normal);
            node.body.corners.iter().all(|p| height(p) >= 0.0)
        };
        node.radius() <= self.tree.small * (self.distance(node) - self.radius)
            && self.rectangle.as_ref().is_none_or(above)
            && self.speaks_for_its_halves(node)
            && match self.facing(node) {
                Facing::Towards => true,
                // Of luminaires in one plane the kernel itself knows the side.
                Facing::Both => node.body.plane.is_some(),
                Facing::Away => false,
            }
    }

    /// Whether moments of a node are off by no more than half of what is tolerable in any channel: told by its halves',
    /// which err by an eighth as much where the third order leads, at two places of the patch.
    fn speaks_for_its_halves(&self, node: &Node) -> bool {
        let Some(halves) = node.children else { return true };
        let agrees = |x: DVec3| {
            let of = |node: &Node| node.moments.light(x, self.normal);
            let exact: DVec3 = halves.map(|k| of(&self.tree.nodes[k])).iter().sum();
            (of(node) - exact).abs().cmple(0.5 * self.luminaires.tolerable * exact).all()
        };
        agrees(self.center) && self.rectangle.as_ref().is_none_or(|r| agrees(r.point(OFF_CENTER, OFF_CENTER)))
    }

    /// Whether a node lies so near to the patch that it is no part of a polynomial.
    pub fn is_near(&self, node: &Node) -> bool {
        self.distance(node) - node.radius() < NEAR * self.radius
    }

    /// Sorts a node by how it lights the patch; `among` are the casters that may matter.
    pub fn visit(&mut self, k: usize, among: &[u32]) {
        let node = &self.tree.nodes[k];
        if self.misses(node) {
            return;
        }
        let near = self.is_near(node);
        let estimate = self.estimate(node);
        if !near && node.children.is_some() && among.is_empty() && self.is_far(node) {
            return self.seen.push(k);
        }
        if !near && !among.is_empty() && estimate < ASKED * self.total && node.children.is_some() {
            return self.part(k);
        }
        let between: Option<Vec<u32>> = self.body.as_ref().map(|patch| {
            let among = among.iter().copied();
            sieve(patch, &node.body, self.casters, among).collect()
        });
        let clear = among.is_empty() || between.as_ref().is_some_and(Vec::is_empty);
        let casters = self.casters;
        let is_masked = |&k: &u32| casters[k as usize].masked;
        // Of a leaf, which is one luminaire.
        let most = most_faces(&self.luminaires.list[self.tree.order[node.range.start] as usize]);
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

    /// Leaves a node to be drawn, in parts small enough.
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
