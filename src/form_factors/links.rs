//! Who lights a patch, where luminaires are many.
//!
//! Each patch walks the tree of luminaires once. What surely sees all of the patch, with nothing between, is summed
//! over nodes of the tree: a polynomial over a flat patch, the nodes themselves for a curved one. The few near or strong
//! ones keep their closed form, shadows cut out. The rest is drawn from: nodes with chances in proportion to
//! what a few rays found, never zero for one that may light the patch, so that drawing is free of bias.
//!
//! Nodes whose part of the patch's light is small are not asked what lies between: drawing among them costs little noise.
//! Not handled: hierarchies of faces; where faces are too many all luminaires are drawn.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::lamps::{Lamps, Node};
use super::luminaire::Luminaires;
use super::shadow::Caster;
use super::shaft::{Body, MOST_FACES, patch_body, sieve};
use super::sight::Occlusion;
use super::smooth::{Rectangle, Tiles};
use crate::patches::Patches;
use crate::rays::sequence::{Sobol, hash};
use crate::rays::{Hit, Rays};

/// Radius of a node over its distance at which its moments speak for it.
const SMALL: f64 = 0.2;
/// Luminaires nearer to a patch than so many of its radii are no part of a polynomial.
const NEAR: f64 = 2.0;
/// Shares of a patch's light: below the first what lies between is not asked, below the second nodes are drawn whole, above
/// the third a luminaire keeps its closed form.
const ASKED: f64 = 1.0 / 64.0;
const WHOLE: f64 = 1.0 / 256.0;
const STRONG: f64 = 1.0 / 32.0;
/// Luminaires by closed form at most.
const MOST_EXACT: usize = 48;
/// Faces × patches beyond which what lies between is not asked.
const MOST_TESTS: usize = 20_000_000;
/// Rays that tell how much of a node arrives.
const TRIALS: u32 = 8;
/// Luminaires drawn at a receiver, where the doubt is as large as its light.
const DRAWS: f64 = 16.0;
/// The largest misfit of a polynomial.
const MISFIT: f64 = 1e-3;

/// Who lights each patch.
#[derive(Debug)]
pub struct Links {
    pub(super) lamps: Lamps,
    links: Vec<Link>,
}

/// Who lights one patch.
#[derive(Debug, Default)]
pub(super) struct Link {
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
pub(super) struct Chance {
    pub node: usize,
    /// The chance of it and those before it.
    pub until: f64,
    /// The share of its light that is summed already: only what arrives beyond it is drawn.
    pub expected: f64,
}

/// What all patches share.
pub(super) struct Maker<'a> {
    pub rays: &'a Rays,
    pub patches: &'a Patches,
    pub luminaires: &'a Luminaires,
    pub occlusion: &'a Occlusion,
    /// All faces that occlude.
    pub casters: &'a [Caster],
}

/// One patch while it walks the tree.
struct Walk<'a> {
    lamps: &'a Lamps,
    casters: &'a [Caster],
    /// None where nothing is to be asked.
    body: Option<Body>,
    rectangle: Option<Rectangle>,
    center: DVec3,
    normal: DVec3,
    radius: f64,
    /// About all its light, nothing between.
    total: f64,
    seen: Vec<usize>,
    exact: Vec<(usize, Vec<u32>)>,
    drawn: Vec<usize>,
}

impl Links {
    /// Luminaires drawn at a receiver at most.
    pub const MOST_DRAWN: u32 = 8;

    pub(super) fn new(maker: &Maker, receives: &[bool]) -> Links {
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
            walk.finish(maker, i, hits)
        };
        let all = (0..maker.patches.len()).into_par_iter();
        let links: Vec<Link> = all.map_init(Vec::new, link).collect();
        Links { lamps, links }
    }

    /// Who lights patch i.
    pub(super) fn of(&self, i: usize) -> &Link {
        &self.links[i]
    }
}

/// `sum of F L` of shares of nodes at a point with unit normal, nothing between.
pub(super) fn light(
    (lamps, luminaires): (&Lamps, &Luminaires),
    nodes: &[(usize, f64)],
    x: DVec3,
    n: DVec3,
) -> DVec3 {
    let light = |k: usize| {
        let node = &lamps.nodes[k];
        let far = node.radius() <= SMALL * x.distance(node.center());
        let above = || n.dot(node.center() - x) > node.radius();
        if node.children.is_some() || (far && above()) {
            return node.moments.light(x, n);
        }
        // A luminaire that is not far has a closed form.
        let luminaire = &luminaires.list[lamps.order[node.range.start] as usize];
        luminaire.exact_form(x.as_vec3(), n.as_vec3()) * luminaire.radiance.as_dvec3()
    };
    nodes.iter().map(|&(k, share)| share * light(k)).sum()
}

impl<'a> Walk<'a> {
    fn new(maker: &'a Maker, lamps: &'a Lamps, i: usize, asked: bool) -> Walk<'a> {
        let patches = maker.patches;
        let rectangle = Rectangle::new(patches, i);
        let corners: Vec<DVec3> = patches
            .pieces(i)
            .flat_map(|p| p.1.map(|q| q.as_dvec3()))
            .collect();
        let mean = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
        let reach = |p: &DVec3| p.distance(mean);
        let face = patches.pieces(i).next().map_or(0, |p| p.0);
        let mut walk = Walk {
            lamps,
            casters: maker.casters,
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
        walk.total = walk.roughly(lamps.root());
        walk
    }

    fn distance(&self, node: &Node) -> f64 {
        self.center.distance(node.center())
    }

    /// About the light of a node, a mean of the channels, never zero.
    fn estimate(&self, node: &Node) -> f64 {
        let off = self.distance(node).powi(2) + node.radius().powi(2) + self.radius.powi(2);
        let light = node.moments.light(self.center, self.normal).element_sum() / 3.0;
        let most = node.power / (std::f64::consts::PI * off);
        light.min(most) + 0.02 * most
    }

    /// About the light of a node's luminaires, each part of it estimated from afar.
    fn roughly(&self, node: usize) -> f64 {
        let own = &self.lamps.nodes[node];
        if self.misses(own) {
            return 0.0;
        }
        match own.children {
            Some(children) if own.radius() > 0.5 * self.distance(own) => {
                children.map(|k| self.roughly(k)).iter().sum()
            }
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
        let d = self.center - node.center();
        let far = d.length();
        let reach = node.radius() + self.radius;
        if reach >= far {
            return self.facing_near(node);
        }
        let angle = (d.dot(node.axis) / far).clamp(-1.0, 1.0).acos();
        let margin = node.spread + (reach / far).asin();
        Facing::of(angle + margin, angle - margin).unwrap_or_else(|| self.facing_near(node))
    }

    /// The same from the corners of both; only for luminaires of one direction.
    fn facing_near(&self, node: &Node) -> Facing {
        let Some(rectangle) = self.rectangle.as_ref().filter(|_| node.spread < 1e-6) else {
            return Facing::Both;
        };
        let corners = rectangle.corners();
        let heights = corners
            .iter()
            .flat_map(|x| node.body.corners.iter().map(|y| (*x - *y).dot(node.axis)));
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
        node.radius() <= SMALL * (self.distance(node) - self.radius)
            && self.rectangle.as_ref().is_none_or(above)
            && match self.facing(node) {
                Facing::Towards => true,
                // Of luminaires in one plane the kernel itself knows the side.
                Facing::Both => node.body.plane.is_some(),
                Facing::Away => false,
            }
    }

    fn is_near(&self, node: &Node) -> bool {
        self.distance(node) - node.radius() < NEAR * self.radius
    }

    /// Sorts a node by how it lights the patch; `among` are the casters that may matter.
    fn visit(&mut self, k: usize, among: &[u32]) {
        let node = &self.lamps.nodes[k];
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
        match node.children {
            _ if clear && !near && self.is_far(node) => self.seen.push(k),
            Some(children) => {
                let between = between.unwrap_or_else(|| among.to_vec());
                children.iter().for_each(|&c| self.visit(c, &between));
            }
            None if clear && !near => self.seen.push(k),
            None if clear => self.exact.push((k, Vec::new())),
            None => match between.filter(|b| b.len() <= MOST_FACES) {
                Some(faces) if near || estimate >= STRONG * self.total => {
                    self.exact.push((k, faces));
                }
                _ => self.drawn.push(k),
            },
        }
    }

    /// Leaves a node to be drawn, in parts small enough.
    fn part(&mut self, k: usize) {
        let node = &self.lamps.nodes[k];
        match node.children {
            _ if self.misses(node) => {}
            Some(children) if !self.is_far(node) || self.estimate(node) >= WHOLE * self.total => {
                children.iter().for_each(|&c| self.part(c));
            }
            _ => self.drawn.push(k),
        }
    }

    fn finish(mut self, maker: &Maker, i: usize, hits: &mut Vec<Hit>) -> Link {
        // The strongest luminaires keep their closed form.
        let lamps = self.lamps;
        let mut exact = std::mem::take(&mut self.exact);
        let strength = |e: &(usize, Vec<u32>)| self.estimate(&lamps.nodes[e.0]);
        exact.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
        let weaker = exact.split_off(MOST_EXACT.min(exact.len()));
        self.drawn.extend(weaker.into_iter().map(|e| e.0));
        let number = |k: usize| lamps.order[lamps.nodes[k].range.start];
        let mut link = Link {
            exact: exact.into_iter().map(|(k, f)| (number(k), f)).collect(),
            ..Link::default()
        };
        self.weigh(maker, i, hits, &mut link);
        self.smoothe(maker, &mut link);
        link
    }

    /// Chances of the nodes to draw from: in proportion to how far what arrives may be from what is expected.
    fn weigh(&self, maker: &Maker, i: usize, hits: &mut Vec<Hit>, link: &mut Link) {
        let sobol = Sobol::new(TRIALS as usize, 4);
        let mut until = 0.0;
        for &node in &self.drawn {
            let seed = hash(node as u32, hash(i as u32, 0x11_6a5b));
            let [all, arrived] = trials(maker, self.lamps, (i, node), (&sobol, seed), hits);
            let share = if all > 0.0 { arrived / all } else { 1.0 };
            // Laplace's rule: so many trials leave a doubt even where all went alike.
            let likely = (f64::from(TRIALS) * share + 0.5) / f64::from(TRIALS + 1);
            let own = &self.lamps.nodes[node];
            let (expected, doubt) = match self.is_near(own) {
                true => (0.0, likely),
                false => (share, likely * (1.0 - likely)),
            };
            until += all.max(self.estimate(own)) * doubt.sqrt();
            link.drawn.push(Chance {
                node,
                until,
                expected,
            });
        }
        link.drawn.iter_mut().for_each(|d| d.until /= until);
        let wanted = (DRAWS * until / self.total.max(until)).ceil() as u32;
        link.draws = match link.drawn.is_empty() {
            true => 0,
            false => wanted.next_power_of_two().clamp(1, Links::MOST_DRAWN),
        };
    }

    /// Makes the polynomial of what is surely seen, if there is one.
    fn smoothe(self, maker: &Maker, link: &mut Link) {
        let (lamps, normal) = ((self.lamps, maker.luminaires), self.normal);
        let sure = self.seen.iter().map(|&k| (k, 1.0));
        let likely = link.drawn.iter().map(|d| (d.node, d.expected));
        let seen: Vec<(usize, f64)> = sure.chain(likely.filter(|d| d.1 > 0.0)).collect();
        let sum = |x: DVec3| light(lamps, &seen, x, normal);
        if let Some(rectangle) = self.rectangle.filter(|_| !seen.is_empty()) {
            link.smooth = Tiles::new(&rectangle, MISFIT, sum);
            if link.smooth.is_some() {
                return;
            }
        }
        link.seen = seen;
    }
}

/// Mean light of a node from points drawn on it, at points of a patch: nothing between, and what arrives.
fn trials(
    maker: &Maker,
    lamps: &Lamps,
    (i, k): (usize, usize),
    (sobol, seed): (&Sobol, u32),
    hits: &mut Vec<Hit>,
) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for s in 0..TRIALS {
        let at = |d: usize| sobol.point(s, d, seed);
        let p = maker.patches.point(i, at(0), at(1));
        let drawn = draw(
            lamps,
            maker.luminaires,
            k,
            (at(2), at(3)),
            p.position,
            p.normal,
        );
        let Some(drawn) = drawn else { continue };
        let from = (p.position, Some(p.face));
        let to = (drawn.position, Some(drawn.face));
        let arrived = maker.occlusion.transmittance(maker.rays, from, to, hits);
        let light = drawn.light.element_sum() / (3.0 * f64::from(TRIALS));
        sums[0] += light;
        sums[1] += light * f64::from(arrived);
    }
    sums
}

/// A point drawn on a node's luminaires, and its light over its density.
pub(super) struct Drawn {
    pub position: Vec3,
    pub face: u32,
    pub light: DVec3,
}

/// Draws a luminaire of a node by power, and a point on it; `None` where that does not face the receiver.
pub(super) fn draw(
    lamps: &Lamps,
    luminaires: &Luminaires,
    node: usize,
    (u, v): (f32, f32),
    x: Vec3,
    n: Vec3,
) -> Option<Drawn> {
    let (l, chance, u) = lamps.draw(&lamps.nodes[node].range, f64::from(u));
    let luminaire = &luminaires.list[l as usize];
    let y = luminaire.point((u as f32).min(0.999_999_94), v);
    let kernel =
        super::polygon::point_kernel(x.as_dvec3(), n.as_dvec3(), y.position.as_dvec3(), y.normal);
    (kernel > 0.0).then(|| Drawn {
        position: y.position,
        face: y.face,
        light: luminaire.radiance.as_dvec3() * (luminaire.area * kernel / chance),
    })
}

/// How luminaires face a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Facing {
    Towards,
    Away,
    Both,
}

impl Facing {
    /// From the largest and least angle between a normal and the way to the patch.
    fn of(most: f64, least: f64) -> Option<Facing> {
        use std::f64::consts::FRAC_PI_2;
        if most <= FRAC_PI_2 {
            Some(Facing::Towards)
        } else if least >= FRAC_PI_2 {
            Some(Facing::Away)
        } else {
            None
        }
    }
}
