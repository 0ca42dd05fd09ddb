//! Direct light of luminaires at one receiver, by a light cut of its patch or of its own.
//!
//! ```text
//! D(x) = sum over visible nodes + sum over closed forms + sum over sampled nodes e of c_e F_e L_e
//!      + mean over draws of L k(x, y) (T - c_e) / p
//! ```
//!
//! with `c_e` the expected visible share of a node, a control variate, T the product of tau between x and y, k the
//! estimate of the form factor by a point y drawn on a luminaire by what it sends
//! ([`crate::direct::emitters::toward`]), and p the probability of its luminaire. The first and third sum are one
//! polynomial on a flat patch. Nodes have probabilities in proportion to estimates by a few rays, never zero for one
//! that may light the patch, so that sampling has no bias; a node's luminaires are drawn by power.
//!
//! One probability per patch is thousands of times too small at receivers next to a small luminaire. So where
//! luminaires are near a patch, half of the probability is that of a descent of the tree at the receiver, at each node
//! by an upper bound of what its halves contribute there:
//!
//! ```text
//! p = p_patch / 2 + p_point / 2,    p_point = product over the way down of  Q g / (Q g + Q' g')
//! ```
//!
//! with Q the uncertain power below a half and g its largest `cos cos / d²`, d no less than its radius. The sum of both
//! is the balance heuristic (E. Veach, L. Guibas, *Optimally combining sampling techniques*, 1995; the descent: A.
//! Conty Estevez, C. Kulla, *Importance sampling of many lights with adaptive tree splitting*, PACMCGIT 1(2), 2018).
//! Worth: without it a picture of a table under 24 candles did not reach 5 % in ten minutes.
//!
//! Samples for the error of a picture use neither moments of nodes nor polynomials, which have bias.
//!
//! Not handled: receivers off their patch.

use glam::{DVec3, Vec2, Vec3};

use crate::direct::agreement::Agreement;
use crate::direct::emitters::luminaire::Luminaire;
use crate::direct::emitters::toward::Toward;
use crate::direct::lights::Lights;
use crate::direct::many::light_cut::{Chance, LightCut, Seen, SeenSum, light};
use crate::direct::many::light_tree::{LightTree, draw};
use crate::direct::systematic::systematic;
use crate::form_factors::shadow::Pieces;
use crate::light::shares::{self, Drawn};
use crate::rays::sobol::{Stream, fraction, hash};
use crate::rays::{End, Hit};
use crate::surfaces::SurfacePoint;

/// Luminaires by closed form that one sample asks.
const ASKED: usize = 2;
/// What is expected of a luminaire whose shadows are too ragged to be cut out.
const GUESS: f64 = 0.5;

/// Memory to use again from receiver to receiver, and the count of the rays cast.
#[derive(Default)]
pub struct Scratch {
    /// Rays cast so far.
    pub cast: u64,
    pub(crate) hits: Vec<Hit>,
    pieces: Pieces,
}

/// One tree of luminaires, the cut through it that serves a receiver, and the receiver.
#[derive(Clone, Copy)]
pub(crate) struct Lit<'a> {
    pub lights: &'a Lights,
    pub tree: &'a LightTree,
    pub cut: &'a LightCut,
    pub receiver: &'a SurfacePoint,
}

impl Lights {
    /// Product of tau between a receiver and a point drawn on a luminaire, by one visibility ray.
    pub(crate) fn transmittance(&self, receiver: &SurfacePoint, end: End, scratch: &mut Scratch) -> f64 {
        scratch.cast += 1;
        let rays = &self.geometry.rays;
        f64::from(self.occlusion.transmittance(rays, receiver.end(), end, &mut scratch.hits))
    }
}

impl Lit<'_> {
    /// `sum over luminaires of F_l L_l`, with a draw for each point of the unit square; what the rays found is noted.
    pub(crate) fn gather(
        &self,
        points: impl ExactSizeIterator<Item = Vec2>,
        scratch: &mut Scratch,
        agreement: &mut Agreement,
    ) -> DVec3 {
        let mut sum = self.visible();
        for (number, faces) in &self.cut.exact {
            sum += self.exact(*number, faces, || point_for(self.receiver.position, *number), scratch);
        }
        sum + self.beyond(points, scratch, agreement)
    }

    /// `sum over luminaires of F_l L_l` without bias, by luminaires drawn one by one in place of nodes and polynomials.
    pub(crate) fn sample(&self, random: &mut Stream, scratch: &mut Scratch) -> DVec3 {
        let mut sum = self.one_of_seen(random);
        let SurfacePoint { position, normal, .. } = *self.receiver;
        let exact = &self.cut.exact;
        let about = exact.iter().map(|(number, _)| f64::from(self.luminaire(*number).roughly(position, normal)));
        let chosen = match exact.len() <= ASKED {
            true => (0..exact.len()).map(|k| (k, 1.0)).collect(),
            false => systematic(about, ASKED, 1.0 - f64::from(random.uniform())),
        };
        for (k, weight) in chosen {
            let (number, faces) = &exact[k];
            let at = || Vec2::new(random.uniform(), random.uniform());
            sum += weight * self.exact(*number, faces, at, scratch);
        }
        let point = (!self.cut.drawn.is_empty()).then(|| Vec2::new(random.uniform(), random.uniform()));
        sum + self.beyond(point.into_iter(), scratch, &mut Agreement::default())
    }

    fn luminaire(&self, number: u32) -> &Luminaire {
        &self.lights.luminaires.list[number as usize]
    }

    /// The light of a luminaire behind some casters: its closed form, or where that is not known by one point drawn on
    /// it.
    fn exact(&self, number: u32, faces: &[u32], at: impl FnOnce() -> Vec2, scratch: &mut Scratch) -> DVec3 {
        let (lights, luminaire) = (self.lights, self.luminaire(number));
        let SurfacePoint { position: x, normal: n, .. } = *self.receiver;
        let casters = faces.iter().map(|&k| lights.casters[k as usize]);
        let known = luminaire.visible_light(x, n, casters, lights.exactness, &mut scratch.pieces);
        let light = known.unwrap_or_else(|| {
            let all = luminaire.light(x, n, luminaire.exact_form(x, n), lights.exactness);
            let Toward { point, form } = luminaire.toward(x, n, at());
            let arrived = if form > 0.0 { lights.transmittance(self.receiver, point.end(), scratch) } else { 0.0 };
            GUESS * all + point.share * (form * (arrived - GUESS))
        });
        light * luminaire.radiance.as_dvec3()
    }

    /// The light of the sampled nodes beyond what is expected of them.
    fn beyond(
        &self,
        points: impl ExactSizeIterator<Item = Vec2>,
        scratch: &mut Scratch,
        agreement: &mut Agreement,
    ) -> DVec3 {
        let mut sum = DVec3::ZERO;
        let share = 1.0 / points.len().max(1) as f64;
        for point in points {
            let Some(chosen) = self.choose(f64::from(point.x)) else { continue };
            let entry = &self.cut.drawn[chosen.index];
            let at = Vec2::new(chosen.again(), point.y);
            if let Some(drawn) = draw(self.tree, &self.lights.luminaires, entry.node, self.receiver, at) {
                let arrived = self.lights.transmittance(self.receiver, drawn.end, scratch);
                let unhidden = drawn.light / chosen.weight;
                agreement.note(unhidden, arrived);
                sum += unhidden * (share * (arrived - entry.expected));
            }
        }
        sum
    }

    /// The light of visible nodes and the expected light of sampled ones.
    fn visible(&self) -> DVec3 {
        let (x, n) = (self.receiver.position.as_dvec3(), self.receiver.normal.as_dvec3());
        match &self.cut.sum {
            SeenSum::Tiles(tiles) => tiles.at(x),
            SeenSum::Known(light) => *light,
            SeenSum::ByNode => light(self.tree, &self.lights.luminaires, &self.cut.seen, x, n),
        }
    }

    /// The light of visible nodes and the expected light of sampled ones, by the closed form of one luminaire drawn
    /// from them: its node by its part of the patch's light, and within it by power.
    fn one_of_seen(&self, random: &mut Stream) -> DVec3 {
        if self.cut.seen.is_empty() {
            return DVec3::ZERO;
        }
        let u = f64::from(random.uniform());
        let Drawn { index, weight: chance, .. } = shares::draw(&self.cut.seen, |seen| seen.until, u);
        let Seen { node, share, .. } = self.cut.seen[index];
        let (l, of_node, _) = self.tree.draw(&self.tree.nodes[node].range, f64::from(random.uniform()));
        let (luminaire, x, n) = (self.luminaire(l), self.receiver.position, self.receiver.normal);
        let form = luminaire.light(x, n, luminaire.exact_form(x, n), self.tree.exactness);
        form * luminaire.radiance.as_dvec3() * (share / (chance * of_node))
    }

    /// Draws one of the sampled nodes by a number u of the unit interval: by the patch's probabilities, where
    /// luminaires are near half of the time by descent; its weight is its probability. None where a descent finds
    /// nothing that sends.
    fn choose(&self, u: f64) -> Option<Drawn<f64>> {
        let drawn = &self.cut.drawn;
        let by_patch = |u: f64| shares::draw(drawn, |d| d.until, u);
        if !self.cut.near {
            return Some(by_patch(u));
        }
        let chosen = match u < 0.5 {
            true => by_patch(2.0 * u),
            false => self.descend(Descent::Drawing(2.0 * u - 1.0))?,
        };
        let before = if chosen.index == 0 { 0.0 } else { drawn[chosen.index - 1].until };
        let of_patch = drawn[chosen.index].until - before;
        let of_point = match u < 0.5 {
            true => self.descend(Descent::To(chosen.index)).map_or(0.0, |found| found.weight),
            false => chosen.weight,
        };
        Some(Drawn { weight: 0.5 * (of_patch + of_point), ..chosen })
    }

    /// Walks down the tree to one of the sampled nodes; its weight is the probability of the way. None where the way
    /// ends as nothing below sends anything here.
    fn descend(&self, descent: Descent) -> Option<Drawn<f64>> {
        let (x, n) = (self.receiver.position.as_dvec3(), self.receiver.normal.as_dvec3());
        let (tree, drawn) = (self.tree, &self.cut.drawn);
        let (mut low, mut high, mut node, mut chance) = (0, drawn.len(), tree.root(), 1.0);
        let mut rest = if let Descent::Drawing(u) = descent { u } else { 0.0 };
        while high - low > 1 {
            let [a, b] = tree.nodes[node].children?;
            let start = tree.nodes[b].range.start;
            let middle = low + drawn[low..high].partition_point(|d| tree.nodes[d.node].range.start < start);
            if middle == low || middle == high {
                node = if middle == low { b } else { a };
                continue;
            }
            let sent =
                |child: usize, from: usize, to: usize| power(drawn, from, to) * tree.bounds[child].largest_kernel(x, n);
            let (first, second) = (sent(a, low, middle), sent(b, middle, high));
            if first + second <= 0.0 {
                return None;
            }
            let p = first / (first + second);
            let is_first = match descent {
                Descent::To(index) => index < middle,
                Descent::Drawing(_) => rest < p || p >= 1.0,
            };
            if is_first {
                (node, high, chance, rest) = (a, middle, chance * p, rest / p);
            } else {
                (node, low, chance, rest) = (b, middle, chance * (1.0 - p), (rest - p) / (1.0 - p));
            }
        }
        Some(Drawn { index: low, weight: chance, rest })
    }
}

/// How the tree is walked.
#[derive(Clone, Copy)]
enum Descent {
    /// By a number of the unit interval.
    Drawing(f64),
    /// To a sampled node, by its index.
    To(usize),
}

/// The uncertain power of a range of sampled nodes.
fn power(drawn: &[Chance], from: usize, to: usize) -> f64 {
    let until = |k: usize| if k == 0 { 0.0 } else { drawn[k - 1].power_until };
    (until(to) - until(from)).max(0.0)
}

/// A point of the unit square that differs from receiver to receiver and from luminaire to luminaire.
pub(crate) fn point_for(x: Vec3, luminaire: u32) -> Vec2 {
    let place = x.to_array().map(f32::to_bits);
    let seed = place.into_iter().fold(luminaire, |seed, bits| hash(bits, seed));
    Vec2::new(fraction(seed), fraction(hash(1, seed)))
}
