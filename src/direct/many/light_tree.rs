//! Many luminaires as a binary tree by direction and place ([`crate::direct::emitters::halving`]).
//!
//! A node represents its luminaires by its [`Moments`]. A cone holds all their normals and a box all their corners, for
//! culling.
//!
//! Source of the tree: A. Conty Estevez, C. Kulla, *Importance sampling of many lights with adaptive tree splitting*,
//! PACMCGIT 1(2), 2018. Not handled: hulls closer than boxes; costs of the two parts, as the cut is in the middle.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;

use glam::{DVec3, Vec2};

use crate::direct::Luminaires;
use crate::direct::emitters::halving::{Placed, halve};
use crate::direct::emitters::luminaire::Luminaire;
use crate::direct::emitters::shafts::{Body, luminaire_body};
use crate::direct::emitters::toward::Toward;
use crate::direct::many::moments::{Moments, Sums};
use crate::light::shares::Shares;
use crate::rays::End;
use crate::scene::Bounds;
use crate::surfaces::SurfacePoint;

/// How luminaires face a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Facing {
    /// It is in front of all of them.
    Towards,
    /// None is.
    Away,
    /// Some, or it is not known.
    Both,
}

/// A node of the tree.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Which, in the tree's order.
    pub range: Range<usize>,
    /// The halves; none where there is one luminaire.
    pub children: Option<[usize; 2]>,
    /// Corners of a body that holds them.
    pub body: Body,
    pub bounds: Bounds<DVec3>,
    /// Axis of the cone of normals, and its half angle.
    pub axis: DVec3,
    pub spread: f64,
    /// Mean of the channels' power over pi.
    pub power: f64,
    pub moments: Moments,
}

/// The tree; the last node is the root.
#[derive(Clone, Debug)]
pub(crate) struct LightTree {
    /// The emitter whose luminaires these are.
    pub emitter: usize,
    pub nodes: Vec<Node>,
    /// What bounds the light of each node.
    pub bounds: Vec<NodeBound>,
    /// Luminaires in the tree's order.
    pub order: Vec<u32>,
    /// Their power.
    powers: Shares,
    /// Radius of a node over its distance up to which its moments are used.
    pub small: f64,
    /// Relative error that a node may have.
    pub exactness: f64,
}

/// Radius of a node over its distance at which the error of its moments, of third order, is [`FAR_OFF`] of its light at
/// most in the worst direction (a test below).
const FAR: f64 = 0.2;
const FAR_OFF: f64 = 0.01;
/// Factor on the tolerable error: few nodes have the error of the worst direction.
const MANY: f64 = 10.0;

impl LightTree {
    /// The tree of each emitter that has luminaires; nodes may have the relative error `exactness`.
    pub(crate) fn of_emitters(luminaires: &Luminaires, exactness: f64) -> Vec<LightTree> {
        let mut emitters: Vec<usize> = luminaires.list.iter().map(|luminaire| luminaire.emitter).collect();
        emitters.sort_unstable();
        emitters.dedup();
        emitters.into_iter().map(|emitter| LightTree::new(luminaires, emitter, exactness)).collect()
    }

    /// The tree over the luminaires of one emitter, of which there must be one.
    fn new(luminaires: &Luminaires, emitter: usize, exactness: f64) -> LightTree {
        let list = &luminaires.list;
        let sums: Vec<Sums> = list.iter().map(Sums::of).collect();
        let place = |&number: &u32| {
            let s = &sums[number as usize];
            let weight = s.weight.max(f64::MIN_POSITIVE);
            Placed { place: s.first / weight, direction: s.normal.normalize_or_zero(), number }
        };
        let own = (0..list.len() as u32).filter(|&l| list[l as usize].emitter == emitter);
        let mut things: Vec<Placed> = own.map(|l| place(&l)).collect();
        let small = FAR * (MANY * exactness / FAR_OFF).cbrt().min(1.0);
        let (nodes, bounds, order) = (Vec::new(), Vec::new(), Vec::new());
        let mut tree = LightTree { emitter, nodes, bounds, order, powers: Shares::default(), small, exactness };
        tree.grow(&mut things, list, &sums);
        tree.bounds = tree.nodes.iter().map(NodeBound::new).collect();
        tree.powers = Shares::of(tree.order.iter().map(|&l| sums[l as usize].weight));
        tree
    }

    /// Adds the tree over some luminaires; returns its root and sums.
    fn grow(&mut self, things: &mut [Placed], list: &[Luminaire], sums: &[Sums]) -> (usize, Sums) {
        let first = self.order.len();
        let (node, own) = if let [Placed { number: l, .. }] = *things {
            self.order.push(l);
            let own = sums[l as usize];
            (leaf(first, &list[l as usize], &own), own)
        } else {
            let (left, right) = halve(things);
            let (a, a_sums) = self.grow(left, list, sums);
            let (b, b_sums) = self.grow(right, list, sums);
            let own = a_sums.add(&b_sums);
            (join(first..self.order.len(), [a, b], &self.nodes, &own), own)
        };
        self.nodes.push(node);
        (self.nodes.len() - 1, own)
    }

    /// The node that holds all luminaires.
    pub(crate) fn root(&self) -> usize {
        self.nodes.len() - 1
    }

    /// The luminaire of a node's range at u in the unit interval, by power; its probability, and u within it.
    pub(crate) fn draw(&self, range: &Range<usize>, u: f64) -> (u32, f64, f32) {
        let drawn = self.powers.draw_of(range, u);
        (self.order[drawn.index], drawn.weight / self.powers.weight(range), drawn.again())
    }
}

impl Node {
    /// How its luminaires face a point.
    pub(crate) fn facing(&self, x: DVec3) -> Facing {
        if let Some((normal, offset)) = self.body.plane {
            return if normal.dot(x) > offset { Facing::Towards } else { Facing::Away };
        }
        self.cone_facing(x - self.center(), self.radius())
    }

    /// How its luminaires face points `away` from its centre, by the cone of their normals; `reach` is the sum of the
    /// radii of the node and of the points.
    pub(crate) fn cone_facing(&self, away: DVec3, reach: f64) -> Facing {
        let far = away.length();
        if reach >= far {
            return Facing::Both;
        }
        let angle = (away.dot(self.axis) / far).clamp(-1.0, 1.0).acos();
        let margin = self.spread + (reach / far).asin();
        match (angle + margin <= FRAC_PI_2, angle - margin >= FRAC_PI_2) {
            (true, _) => Facing::Towards,
            (_, true) => Facing::Away,
            _ => Facing::Both,
        }
    }

    /// Centre of the box.
    pub(crate) fn center(&self) -> DVec3 {
        self.bounds.middle()
    }

    /// Half the diagonal of the box.
    pub(crate) fn radius(&self) -> f64 {
        0.5 * self.bounds.size().length()
    }
}

/// A sphere around the luminaires of a node and the cone of their normals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeBound {
    center: DVec3,
    radius: f64,
    axis: DVec3,
    /// Of the cone's half angle.
    sine: f64,
    cosine: f64,
}

impl NodeBound {
    fn new(node: &Node) -> NodeBound {
        let (sine, cosine) = node.spread.sin_cos();
        NodeBound { center: node.center(), radius: node.radius(), axis: node.axis, sine, cosine }
    }

    /// Upper bound of `cos cos / d²` at a point x with unit normal n; d is no less than the radius.
    #[inline]
    pub(crate) fn largest_kernel(&self, x: DVec3, n: DVec3) -> f64 {
        let away = self.center - x;
        let squared = away.length_squared();
        let own = self.radius * self.radius;
        if squared <= own {
            return 1.0 / own;
        }
        let inverse = 1.0 / squared;
        let to = away * inverse.sqrt();
        let (sine, cosine) = ((own * inverse).sqrt(), (1.0 - own * inverse).sqrt());
        let receives = cosine_less(n.dot(to), sine, cosine);
        let emits = cosine_less(cosine_less(-self.axis.dot(to), sine, cosine), self.sine, self.cosine);
        receives.max(0.0) * emits.max(0.0) * inverse
    }
}

/// Cosine of the difference of two angles, the second by its sine and cosine; 1 where it is negative.
#[inline]
fn cosine_less(first: f64, sine: f64, cosine: f64) -> f64 {
    if first >= cosine { 1.0 } else { first * cosine + (1.0 - first * first).max(0.0).sqrt() * sine }
}

fn leaf(place: usize, luminaire: &Luminaire, sums: &Sums) -> Node {
    let axis = sums.normal.normalize_or_zero();
    let angle = |t: [DVec3; 3]| {
        let normal = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
        normal.dot(axis).clamp(-1.0, 1.0).acos()
    };
    Node {
        range: place..place + 1,
        children: None,
        body: luminaire_body(luminaire),
        bounds: Bounds::of(luminaire.corners()),
        axis,
        spread: luminaire.triangles().map(angle).fold(0.0, f64::max),
        power: sums.weight,
        moments: sums.moments(),
    }
}

fn join(range: Range<usize>, children: [usize; 2], nodes: &[Node], sums: &Sums) -> Node {
    let [a, b] = children.map(|k| &nodes[k]);
    let bounds = a.bounds.union(b.bounds);
    let axis = sums.normal.normalize_or_zero();
    let reach = |n: &Node| axis.dot(n.axis).clamp(-1.0, 1.0).acos() + n.spread;
    let mut body = Body::of_box(&bounds);
    body.plane = a.body.common_plane(&b.body);
    if a.body.convex_luminaire == b.body.convex_luminaire {
        body.convex_luminaire = a.body.convex_luminaire;
    }
    Node {
        range,
        children: Some(children),
        body,
        bounds,
        axis,
        spread: reach(a).max(reach(b)).min(PI),
        power: sums.weight,
        moments: sums.moments(),
    }
}

/// A point drawn on a node's luminaires, and its light without occlusion over its density.
pub(crate) struct Drawn {
    pub end: End,
    pub light: DVec3,
}

/// Draws a luminaire of a node by power, and a point on it, `at` in the unit square; `None` where that does not
/// face the receiver.
pub(crate) fn draw(
    tree: &LightTree,
    luminaires: &Luminaires,
    node: usize,
    receiver: &SurfacePoint,
    at: Vec2,
) -> Option<Drawn> {
    let (l, chance, u) = tree.draw(&tree.nodes[node].range, f64::from(at.x));
    let luminaire = &luminaires.list[l as usize];
    let Toward { point: y, form } = luminaire.toward(receiver.position, receiver.normal, Vec2::new(u, at.y));
    let light = luminaire.radiance.as_dvec3() * y.share * (form / chance);
    (form > 0.0).then_some(Drawn { end: y.end(), light })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::TOLERABLE;
    use crate::light::Rgb;
    use crate::scene::{Material, Scene};

    /// Nine small red and blue squares that face down, over a floor.
    fn small_squares() -> Luminaires {
        let floor = Material::new("floor", Rgb::splat(0.5), Rgb::ZERO);
        let red = Material::new("red", Rgb::ZERO, Rgb::new(3.0, 1.0, 0.0));
        let blue = Material::new("blue", Rgb::ZERO, Rgb::new(0.0, 1.0, 2.0));
        let mut corners = Vec::new();
        let mut faces = Vec::new();
        let mut square = |x: f64, y: f64, z: f64, a: f64, material: u32| {
            let first = corners.len() as u32;
            for (u, v) in [(0.0, 0.0), (0.0, a), (a, a), (a, 0.0)] {
                corners.push(DVec3::new(x + u, y + v, z));
            }
            faces.push(((first..first + 4).collect::<Vec<u32>>(), material));
        };
        square(0.0, 0.0, -1.0, 10.0, 0);
        for k in 0..9 {
            let (x, y) = (f64::from(k % 3), f64::from(k / 3));
            square(x, y, 0.1 * x, 0.1 + 0.02 * y, 1 + k % 2);
        }
        let mut scene = Scene::from_faces("", &corners, &faces, vec![floor, red, blue]).unwrap();
        for (f, face) in scene.faces.iter_mut().enumerate() {
            face.object = f as u32 / 2;
        }
        Luminaires::new(&scene)
    }

    #[test]
    fn moments_have_errors_of_third_order_in_every_channel() {
        let luminaires = small_squares();
        let tree = LightTree::new(&luminaires, 0, TOLERABLE);
        let root = &tree.nodes[tree.root()];
        let away = DVec3::new(0.3, -0.2, -1.0).normalize();
        let errors = |distance: f64| {
            let x = root.center() + distance * away;
            let each = luminaires.list.iter().map(|l| {
                let form = l.exact_form(x.as_vec3(), -away.as_vec3());
                form * l.radiance.as_dvec3()
            });
            let exact: DVec3 = each.sum();
            let off = root.moments.light(x, -away) - exact;
            (off / exact).abs().max_element()
        };
        let radius = root.radius();
        let (near, far) = (errors(radius / FAR), errors(2.0 * radius / FAR));
        // At twice the distance an eighth, if the leading term leads.
        assert!(near < FAR_OFF && far < near / 6.0, "{near} {far}");
    }

    #[test]
    fn luminaires_are_drawn_by_power() {
        let luminaires = small_squares();
        let tree = LightTree::new(&luminaires, 0, TOLERABLE);
        let whole = 0..tree.order.len();
        let power = |l: u32| {
            let own = &luminaires.list[l as usize];
            own.area * f64::from(own.radiance.element_sum())
        };
        let all: f64 = tree.order.iter().map(|&l| power(l)).sum();
        let mut sum = 0.0;
        for &l in &tree.order {
            let (drawn, chance, rest) = tree.draw(&whole, sum + 0.25 * power(l) / all);
            sum += power(l) / all;
            assert_eq!(drawn, l);
            assert!((chance - power(l) / all).abs() < 1e-12 && (rest - 0.25).abs() < 1e-9);
        }
    }
}
