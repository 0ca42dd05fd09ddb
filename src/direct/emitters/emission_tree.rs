//! The light of one emitting triangle with a texture in closed form: a quadtree of sub-triangles with the moments of
//! their emission.
//!
//! With c the centroid of a node of area A, m the mean of its emission E and k = cos cos / (pi r²), its light is
//!
//! ```text
//! ∫ E k dA  =  A sum of w_i k(y_i)  +  rest
//! ```
//!
//! with the three points `y_i` halfway from c to its corners, which integrate what is quadratic, and weights so that
//! `sum of w_i = m` and `sum of w_i (y_i - c) = mean of (E - m)(y - c)`. The rest is of second order, `A Q : ∇∇k / 2`
//! with Q the mean of `E (y - c)(y - c)ᵀ` less that of the weights, and small where a texture is finer than the node.
//! Where it is more than tolerable for a receiver, the node's quarters are integrated instead (a multipole expansion as
//! in J. Barnes, P. Hut, *A hierarchical O(N log N) force-calculation algorithm*, Nature 324, 1986).
//!
//! Worth: a room with a textured screen takes 0.4 to 0.6 of the time at 1 % (docs/theory.md, Textured luminaires).
//!
//! Where something stands between, points are drawn by descent of the same tree ([`EmissionTree::draw`]).
//!
//! Not handled: occlusion; variation within a leaf.

use std::f64::consts::PI;

use glam::{DMat2, DMat3, DVec2, DVec3, Vec3};

use crate::form_factors::point_to_polygon;

/// Nodes as wide as this share of their distance or less follow their moments.
const FAR: f64 = 0.5;

/// The emission of one triangle beyond the mean of its luminaire, in units of that mean.
#[derive(Clone, Debug)]
pub(crate) struct EmissionTree {
    pub(crate) middle: DVec3,
    /// Two unit vectors along its plane, and its normal.
    pub(crate) frame: DMat3,
    /// Its corners from the middle along both, counter-clockwise seen from the emitting side.
    pub(crate) corners: [DVec2; 3],
    pub(crate) area: f64,
    /// The distance of the farthest corner from the middle.
    pub(crate) radius: f64,
    /// The root first, quarters of one node next to each other.
    pub(crate) nodes: Vec<EmissionNode>,
    /// Of all of its emission.
    pub moments: EmissionMoments,
}

/// A node, in single precision.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EmissionNode {
    /// w of its three points, less a third each.
    pub weights: [Vec3; 3],
    /// Frobenius norm of Q, the largest channel's.
    bend: f32,
    /// Standard deviation of the emission from its mean, the largest channel's.
    spread: f32,
    /// The first of its quarters; 0 where there is none.
    pub quarters: u32,
}

/// The place of a node relative to a receiver: the tree's corners, scaled.
#[derive(Clone, Copy)]
pub(crate) struct Placement {
    /// Its middle along the plane, from the receiver's foot.
    pub middle: DVec2,
    /// A power of a half; negative where the node is turned by half a turn.
    pub scale: f64,
}

/// A part of a triangle drawn for a receiver.
pub(crate) struct EmittingPart {
    /// Relative to the receiver, counter-clockwise seen from the emitting side.
    pub corners: [DVec3; 3],
    /// The probability with which it was drawn.
    pub chance: f64,
    /// What remains of the number that drew it, uniform.
    pub rest: f64,
}

/// A receiver relative to the plane of a triangle. A point at p along the plane lies at height `lift + p . rise` above
/// its horizon, and at the distance `sqrt(depth² + p²)`.
pub(crate) struct PlaneReceiver {
    /// Distance from the plane.
    pub depth: f64,
    pub lift: f64,
    pub rise: DVec2,
    /// Tolerable error of a node's form factor.
    pub tolerable: f64,
}

impl PlaneReceiver {
    /// `pi k` of a place.
    #[inline]
    pub(crate) fn kernel(&self, place: DVec2) -> f64 {
        let squared = place.length_squared() + self.depth * self.depth;
        self.depth * (self.lift + place.dot(self.rise)) / (squared * squared)
    }

    /// The receiver's normal.
    pub(crate) fn normal(&self) -> DVec3 {
        self.rise.extend(-self.lift / self.depth)
    }

    /// A place from the receiver.
    pub(crate) fn relative(&self, place: DVec2) -> DVec3 {
        place.extend(-self.depth)
    }

    /// The form factor to a triangle of the plane.
    fn form(&self, corners: [DVec2; 3]) -> f64 {
        point_to_polygon(self.normal(), &corners.map(|p| self.relative(p)))
    }
}

impl EmissionTree {
    /// Of a triangle, counter-clockwise seen from the emitting side, with so many levels below the root at most; `mean`
    /// is the mean emission over a sub-triangle with corners in shares of both edges from its first corner.
    pub(crate) fn new(corners: [DVec3; 3], levels: u32, mean: impl Fn([DVec2; 3]) -> DVec3) -> EmissionTree {
        let [a, b, c] = corners;
        let cross = (b - a).cross(c - a);
        let middle = (a + b + c) / 3.0;
        let normal = cross.normalize_or_zero();
        let along = (b - a).normalize_or_zero();
        let frame = DMat3::from_cols(along, normal.cross(along), normal);
        let mut tree = EmissionTree {
            middle,
            frame,
            corners: corners.map(|p| (frame.transpose() * (p - middle)).truncate()),
            area: 0.5 * cross.length(),
            radius: corners.iter().map(|p| p.distance(middle)).fold(0.0, f64::max),
            nodes: vec![EmissionNode::default()],
            moments: EmissionMoments::default(),
        };
        tree.moments =
            tree.grow(0, SubTriangle { corners: [DVec2::ZERO, DVec2::X, DVec2::Y], scale: 1.0 }, levels, &mean);
        tree
    }

    /// The edges from the first corner.
    fn edges(&self) -> [DVec2; 2] {
        [self.corners[1] - self.corners[0], self.corners[2] - self.corners[0]]
    }

    /// The Frobenius norm in space of second moments along the edges.
    fn norm(&self, [uu, vv, uv]: [f64; 3]) -> f64 {
        let [u, v] = self.edges();
        let metric = DMat2::from_cols(DVec2::new(u.dot(u), u.dot(v)), DVec2::new(u.dot(v), v.dot(v)));
        let product = DMat2::from_cols(DVec2::new(uu, uv), DVec2::new(uv, vv)) * metric;
        let square = product * product;
        (square.x_axis.x + square.y_axis.y).max(0.0).sqrt()
    }

    /// Fills node k, with quarters over so many levels where they differ.
    fn grow(
        &mut self,
        k: usize,
        part: SubTriangle,
        levels: u32,
        mean: &impl Fn([DVec2; 3]) -> DVec3,
    ) -> EmissionMoments {
        let first = self.nodes.len();
        let mut moments = EmissionMoments::default();
        if levels == 0 {
            moments.mean = mean(part.corners);
        } else {
            self.nodes.resize(first + 4, EmissionNode::default());
            let parts = part.quarters();
            let each = std::array::from_fn(|i| self.grow(first + i, parts[i], levels - 1, mean));
            moments = EmissionMoments::of_quarters(&each, &part, &parts);
        }
        let is_even = moments.variance == DVec3::ZERO;
        if is_even {
            self.nodes.truncate(first);
        }
        let missed = moments.missed(part.scale);
        let bend = |channel: usize| self.norm(missed.map(|of| of[channel]));
        self.nodes[k] = EmissionNode {
            weights: moments.weights(part.scale).map(DVec3::as_vec3),
            bend: (0..3).map(bend).fold(0.0, f64::max) as f32,
            spread: moments.variance.max_element().sqrt() as f32,
            quarters: if is_even { 0 } else { first as u32 },
        };
        moments
    }

    /// `A / (pi r²)` from a place, 0 behind it.
    pub(crate) fn seen(&self, x: DVec3) -> f64 {
        let middle = self.middle - x;
        let is_behind = middle.dot(self.frame.z_axis) >= 0.0;
        if is_behind { 0.0 } else { self.area / (PI * middle.length_squared()) }
    }

    /// The form factor of the emission beyond 1 from a receiver with unit normal n without occlusion: the error of each
    /// node integrated is at most about `tolerable`.
    pub(crate) fn beyond(&self, x: DVec3, n: DVec3, tolerable: f64) -> DVec3 {
        self.seen_from(x, n, tolerable).map_or(DVec3::ZERO, |(place, receiver)| self.integrate(0, place, &receiver))
    }

    /// Its placement relative to a receiver with unit normal n, and that receiver; none behind it.
    pub(crate) fn seen_from(&self, x: DVec3, n: DVec3, tolerable: f64) -> Option<(Placement, PlaneReceiver)> {
        let along = self.frame.transpose();
        let (middle, normal) = (along * (self.middle - x), along * n);
        let depth = -middle.z;
        let receiver = PlaneReceiver { depth, lift: -depth * normal.z, rise: normal.truncate(), tolerable };
        (depth > 0.0).then_some((Placement { middle: middle.truncate(), scale: 1.0 }, receiver))
    }

    /// The form factor of the emission beyond 1 of node k without occlusion.
    pub(crate) fn integrate(&self, k: usize, place: Placement, receiver: &PlaneReceiver) -> DVec3 {
        let Placement { middle, scale } = place;
        let (node, radius) = (&self.nodes[k], self.radius * scale.abs());
        let height = receiver.lift + middle.dot(receiver.rise);
        if height <= -radius {
            return DVec3::ZERO;
        }
        let beyond: DVec3 = node.weights.iter().map(|w| w.as_dvec3()).sum();
        let inverse = 1.0 / (middle.length_squared() + receiver.depth * receiver.depth);
        let (area, width) = (self.area * scale * scale, radius * inverse.sqrt());
        let seen = area / PI * inverse;
        let whole = height >= radius && width <= FAR;
        let error = if whole {
            seen * (BENT * f64::from(node.bend) * inverse + SKEW * beyond.abs().max_element() * width.powi(3))
        } else {
            // The part above the horizon is no higher than the node is wide.
            f64::from(node.spread) * seen.min(1.0) * width.min(1.0)
        };
        if node.quarters > 0 && error > receiver.tolerable {
            let places = self.quarters(place).into_iter().zip(node.quarters as usize..);
            return places.map(|(place, k)| self.integrate(k, place, receiver)).sum();
        }
        if !whole || error > receiver.tolerable {
            return beyond * receiver.form(self.corners.map(|p| middle + scale * p));
        }
        let each = node.weights.iter().zip(self.corners);
        let sent = each.map(|(w, p)| w.as_dvec3() * receiver.kernel(middle + 0.5 * scale * p));
        area / PI * sent.sum::<DVec3>()
    }

    /// About what node k sends to a receiver, over what all nodes of one plane have in common; 0 only where it is black
    /// or below the horizon.
    fn sent(&self, k: usize, Placement { middle, scale }: Placement, receiver: &PlaneReceiver) -> f64 {
        let radius = self.radius * scale.abs();
        let beyond: Vec3 = self.nodes[k].weights.iter().sum();
        let mean = 3.0 + f64::from(beyond.element_sum());
        let highest = receiver.lift + middle.dot(receiver.rise) + radius;
        let squared = middle.length_squared() + receiver.depth * receiver.depth + radius * radius;
        mean.max(0.0) * scale * scale * highest.max(0.0) / (squared * squared)
    }

    /// About what all of it sends to a receiver with unit normal n.
    pub(crate) fn sent_to(&self, x: DVec3, n: DVec3) -> f64 {
        let sent =
            |(place, receiver): (Placement, PlaneReceiver)| self.area * receiver.depth * self.sent(0, place, &receiver);
        self.seen_from(x, n, 0.0).map_or(0.0, sent)
    }

    /// The part without quarters that a number u of the unit interval draws for a receiver, by about what each sends;
    /// none where nothing is sent.
    pub(crate) fn draw(&self, x: DVec3, n: DVec3, mut u: f64) -> Option<EmittingPart> {
        let (mut place, receiver) = self.seen_from(x, n, 0.0)?;
        let (mut k, mut chance) = (0, 1.0);
        while self.nodes[k].quarters > 0 {
            let places = self.quarters(place);
            let first = self.nodes[k].quarters as usize;
            let sent: [f64; 4] = std::array::from_fn(|i| self.sent(first + i, places[i], &receiver));
            let all: f64 = sent.iter().sum();
            if all <= 0.0 {
                return None;
            }
            let (mut i, mut at) = (0, u * all);
            while i < 3 && at >= sent[i] {
                at -= sent[i];
                i += 1;
            }
            if sent[i] <= 0.0 {
                return None;
            }
            (k, place, chance, u) = (first + i, places[i], chance * sent[i] / all, (at / sent[i]).clamp(0.0, 1.0));
        }
        let corners = self.corners.map(|p| self.frame * receiver.relative(place.middle + place.scale * p));
        Some(EmittingPart { corners, chance, rest: u })
    }

    /// The places of a node's quarters.
    pub(crate) fn quarters(&self, Placement { middle, scale }: Placement) -> [Placement; 4] {
        let half = 0.5 * scale;
        let [a, b, c] = self.corners.map(|p| Placement { middle: middle + half * p, scale: half });
        [a, b, c, Placement { middle, scale: -half }]
    }
}

/// The largest Frobenius norm of `∇∇k / 2` along the triangle's plane times `pi r⁴`, with k = cos cos / (pi r²), over
/// all directions of both normals (2.78 by the test below).
pub(crate) const BENT: f64 = 2.8;
/// Error of three points for the mean of `pi r² k` over a triangle, over the third power of its radius by its distance,
/// at most, where that is a half or less and no part is below the horizon (0.065 by the test below).
pub(crate) const SKEW: f64 = 0.07;

/// The mean of x², y² and x y over the whole triangle, relative to its middle, in shares of its edges.
const SECOND: [f64; 3] = [1.0 / 18.0, 1.0 / 18.0, -1.0 / 36.0];

/// Moments of the emission of a sub-triangle, in shares of the triangle's edges.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EmissionMoments {
    pub mean: DVec3,
    pub variance: DVec3,
    /// The mean of `(E - m)(y - c)` along both edges.
    pub dipole: [DVec3; 2],
    /// The mean of `(E - m)(y - c)(y - c)ᵀ`: both edges with themselves, and one with the other.
    bend: [DVec3; 3],
}

/// A sub-triangle: corners in shares of the triangle's edges, and its size over that of the whole, negative where it is
/// turned by half a turn.
#[derive(Clone, Copy)]
pub(crate) struct SubTriangle {
    pub corners: [DVec2; 3],
    pub scale: f64,
}

impl SubTriangle {
    pub(crate) fn middle(&self) -> DVec2 {
        let [a, b, c] = self.corners;
        (a + b + c) / 3.0
    }

    /// The four equal parts: at its corners, and the one in its middle by half a turn.
    pub(crate) fn quarters(&self) -> [SubTriangle; 4] {
        let [a, b, c] = self.corners;
        let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        let part = |corners, scale| SubTriangle { corners, scale: scale * self.scale };
        [part([a, ab, ca], 0.5), part([ab, b, bc], 0.5), part([ca, bc, c], 0.5), part([bc, ca, ab], -0.5)]
    }
}

impl EmissionMoments {
    /// Those of a node from those of its quarters.
    pub(crate) fn of_quarters(
        each: &[EmissionMoments; 4],
        whole: &SubTriangle,
        parts: &[SubTriangle; 4],
    ) -> EmissionMoments {
        let mut sum =
            EmissionMoments { mean: 0.25 * each.iter().map(|m| m.mean).sum::<DVec3>(), ..EmissionMoments::default() };
        for (own, part) in each.iter().zip(parts) {
            let (beyond, off) = (own.mean - sum.mean, part.middle() - whole.middle());
            let [uu, vv, uv] = SECOND.map(|mean| mean * part.scale * part.scale);
            let across = own.dipole[0] * off.y + own.dipole[1] * off.x;
            sum.variance += 0.25 * (own.variance + beyond * beyond);
            sum.dipole[0] += 0.25 * (own.dipole[0] + beyond * off.x);
            sum.dipole[1] += 0.25 * (own.dipole[1] + beyond * off.y);
            sum.bend[0] += 0.25 * (own.bend[0] + 2.0 * own.dipole[0] * off.x + beyond * (uu + off.x * off.x));
            sum.bend[1] += 0.25 * (own.bend[1] + 2.0 * own.dipole[1] * off.y + beyond * (vv + off.y * off.y));
            sum.bend[2] += 0.25 * (own.bend[2] + across + beyond * (uv + off.x * off.y));
        }
        sum
    }

    /// The mean of `E (y - c)(y - c)ᵀ` of the whole triangle: both edges with themselves, and one with the other.
    pub(crate) fn second(&self) -> [DVec3; 3] {
        let even = SECOND.map(|mean| mean * self.mean);
        std::array::from_fn(|k| even[k] + self.bend[k])
    }

    /// w, less a third each, of a part of this scale.
    ///
    /// With the corners `q_i` of the whole triangle from its middle and d the dipole, `sum of w_i scale q_i / 2 = d`.
    pub(crate) fn weights(&self, scale: f64) -> [DVec3; 3] {
        let even = (self.mean - 1.0) / 3.0;
        let [u, v] = self.dipole.map(|d| 2.0 / scale * d);
        [even - u - v, even + u, even + v]
    }

    /// `bend` less that of the weights, which is `sum of w_i scale² q_i q_iᵀ / 4` and exact for uniform emission.
    pub(crate) fn missed(&self, scale: f64) -> [DVec3; 3] {
        let [u, v] = self.dipole.map(|d| scale / 6.0 * d);
        [self.bend[0] - u, self.bend[1] - v, self.bend[2] + u + v]
    }
}

/// A triangle and receivers for the tests of its light.
#[cfg(test)]
pub(crate) mod samples {
    use super::*;
    use crate::rays::sobol::hash;

    pub(crate) const CORNERS: [DVec3; 3] =
        [DVec3::new(0.1, 0.0, 0.0), DVec3::new(1.3, 0.2, 0.1), DVec3::new(0.3, 1.1, -0.2)];

    /// A number of the unit interval.
    pub(crate) fn uniform(k: u32, d: u32) -> f64 {
        f64::from(hash(k, d) >> 8) / f64::from(1 << 24)
    }

    /// Positions and normals of receivers near and far, of which some see the triangle at their horizon.
    pub(crate) fn receivers() -> impl Iterator<Item = (DVec3, DVec3)> {
        (0..200).map(|k| {
            let off = DVec3::new(uniform(k, 0), uniform(k, 1), 0.0) * 4.0 - DVec3::new(1.5, 1.5, 0.0);
            let normal = DVec3::new(uniform(k, 2), uniform(k, 3), uniform(k, 4)) * 2.0 - 1.0;
            (off + DVec3::Z * (0.02 + 3.0 * uniform(k, 5).powi(2)), (normal - DVec3::Z).normalize())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::samples::{CORNERS, receivers, uniform};
    use super::*;
    use crate::rays::sobol::hash;

    /// Levels of the tree below.
    const LEVELS: u32 = 5;

    /// Emission of mean 1: even over each leaf, coarse (from end to end) or fine (from leaf to leaf).
    fn emission(fine: bool) -> impl Fn([DVec2; 3]) -> DVec3 {
        move |corners| {
            let at = SubTriangle { corners, scale: 1.0 }.middle();
            let random = |d: u32| uniform((at.x * 1e6) as u32, hash((at.y * 1e6) as u32, d));
            if fine {
                DVec3::new(2.0 * random(0), 1.0, 2.0 * random(1))
            } else {
                DVec3::new(3.0 * at.x, 1.0, 3.0 * at.y)
            }
        }
    }

    fn tree(fine: bool) -> EmissionTree {
        EmissionTree::new(CORNERS, LEVELS, emission(fine))
    }

    /// All leaves one by one.
    fn expected(fine: bool, x: DVec3, n: DVec3) -> DVec3 {
        let emission = emission(fine);
        let mut parts = vec![SubTriangle { corners: [DVec2::ZERO, DVec2::X, DVec2::Y], scale: 1.0 }];
        for _ in 0..LEVELS {
            parts = parts.iter().flat_map(SubTriangle::quarters).collect();
        }
        let place = |at: DVec2| CORNERS[0] + at.x * (CORNERS[1] - CORNERS[0]) + at.y * (CORNERS[2] - CORNERS[0]) - x;
        let sent = |part: SubTriangle| (emission(part.corners) - 1.0) * point_to_polygon(n, &part.corners.map(place));
        parts.into_iter().map(sent).sum()
    }

    #[test]
    fn nodes_have_the_light_of_their_leaves() {
        for (fine, tolerable) in [(false, 1e-3), (true, 1e-3), (false, 1e-5), (true, 1e-5)] {
            let tree = tree(fine);
            let (mut seen, mut squares) = (0.0, 0.0);
            for (x, n) in receivers() {
                let all = point_to_polygon(n, &CORNERS.map(|p| p - x));
                let off = (tree.beyond(x, n, tolerable * all) - expected(fine, x, n)).abs().max_element();
                // So many nodes may have errors of one sign.
                assert!(off <= 20.0 * tolerable * all + 1e-12, "{fine} {tolerable}: {off} of {all} at {x}, {n}");
                if all > 0.0 {
                    (seen, squares) = (seen + 1.0, squares + (off / all).powi(2));
                }
            }
            assert!(seen > 50.0 && (squares / seen).sqrt() < 3.0 * tolerable, "{fine} {tolerable}: {squares} {seen}");
        }
    }

    #[test]
    fn a_fine_texture_is_nearly_uniform() {
        let tree = tree(true);
        assert_eq!(tree.nodes.len(), (4_usize.pow(LEVELS + 1) - 1) / 3);
        let root = tree.nodes[0];
        // Noise of 1024 leaves: its mean and its moments are a 32nd of that of a leaf.
        let beyond: Vec3 = root.weights.into_iter().sum();
        assert!(beyond.abs().max_element() < 0.1 && root.bend < 0.02 && root.spread > 0.5, "{root:?}");
    }

    #[test]
    fn uniform_emission_is_one_node() {
        let even = EmissionTree::new(CORNERS, 10, |_| DVec3::splat(1.25));
        assert_eq!(even.nodes.len(), 1);
        let (x, n) = (DVec3::new(0.4, 0.4, 1.0), -DVec3::Z);
        let all = point_to_polygon(n, &CORNERS.map(|p| p - x));
        // Thirds in single precision.
        assert!((even.beyond(x, n, 0.0) / all - 0.25).abs().max_element() < 1e-6);
    }

    /// Directions of a place, and of normals there and at the origin that face each other.
    fn directions() -> impl Iterator<Item = [DVec3; 3]> {
        let unit =
            |k: u32, d: u32| (2.0 * DVec3::new(uniform(k, d), uniform(k, d + 1), uniform(k, d + 2)) - 1.0).normalize();
        (0..20_000).map(move |k| {
            let [y, n, m] = [0, 3, 6].map(|d| unit(k, d));
            [y, n * n.dot(y).signum(), -m * m.dot(y).signum()]
        })
    }

    /// `pi k`.
    fn kernel(y: DVec3, n: DVec3, m: DVec3) -> f64 {
        -y.dot(n) * y.dot(m) / y.length_squared().powi(2)
    }

    #[test]
    fn the_kernel_bends_no_more_than_that() {
        const H: f64 = 1e-3;
        let mut most = 0.0_f64;
        for [y, n, m] in directions() {
            let (u, v) = m.any_orthonormal_pair();
            let along = |a: DVec3, b: DVec3| {
                let at = |s: f64, t: f64| kernel(y + H * (s * a + t * b), n, m);
                (at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0)) / (4.0 * H * H)
            };
            let [uu, vv, uv] = [(u, u), (v, v), (u, v)].map(|(a, b)| 0.5 * along(a, b));
            most = most.max((uu * uu + vv * vv + 2.0 * uv * uv).sqrt());
        }
        assert!(most < BENT && most > 0.9 * BENT, "{most}");
    }

    #[test]
    fn three_points_miss_no_more_than_that() {
        const LEVELS: usize = 3;
        let mut most = 0.0_f64;
        for corners in [[(0.0, 0.0), (1.0, 0.0), (0.5, 0.866)], [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]] {
            let whole = SubTriangle { corners: corners.map(DVec2::from), scale: 1.0 };
            let whole = SubTriangle { corners: whole.corners.map(|p| p - whole.middle()), ..whole };
            let radius = whole.corners.iter().map(|p| p.length()).fold(0.0, f64::max);
            let mut parts = vec![whole];
            for _ in 0..LEVELS {
                parts = parts.iter().flat_map(SubTriangle::quarters).collect();
            }
            for [y, n, m] in directions().take(2000).filter(|[y, n, _]| n.dot(*y) > 0.5) {
                let (u, v) = m.any_orthonormal_pair();
                let at = |p: DVec2| kernel(2.0 * radius * y + p.x * u + p.y * v, n, m) * (2.0 * radius).powi(2);
                let three = |part: &SubTriangle| {
                    let middle = part.middle();
                    part.corners.iter().map(|p| at(0.5 * (*p + middle))).sum::<f64>() / 3.0
                };
                let exact = parts.iter().map(three).sum::<f64>() / parts.len() as f64;
                most = most.max((three(&whole) - exact).abs() / 0.125);
            }
        }
        assert!(most < SKEW && most > 0.7 * SKEW, "{most}");
    }
}
