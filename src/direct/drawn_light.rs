//! Direct light of many luminaires at one receiver, by its patch's light cut.
//!
//! ```text
//! sum over visible nodes + sum over closed forms + sum over sampled nodes e of c_e F_e L_e
//!     + mean over draws of L A k(x, y) (T - c_e) / p
//! ```
//!
//! with `c_e` the expected visible share of a node, a control variate. The first and third sum are one polynomial on a
//! flat patch. Nodes have probabilities p in proportion to estimates by a few rays, never zero for one that may light
//! the patch, so that sampling has no bias; a node's luminaires are drawn by power and points on them by area.
//!
//! One probability per patch is thousands of times too small at receivers next to a small luminaire. So where
//! luminaires are near a patch, half of the probability is that of an upper bound of what each node contributes at the
//! receiver:
//!
//! ```text
//! p = p_patch / 2 + p_point / 2,    p_point = Q_e g_e / (sum over all sampled nodes of Q g)
//! ```
//!
//! with Q the node's uncertain power and g the largest `cos cos / d²`, d no less than its radius. The sum of both is
//! the balance heuristic (E. Veach, L. Guibas, *Optimally combining sampling techniques*, 1995; the bound: A. Conty
//! Estevez, C. Kulla, *Importance sampling of many lights with adaptive tree splitting*, PACMCGIT 1(2), 2018). One pass
//! over a cut's nodes serves all draws of a receiver. Worth: without it a picture of a table under 24 candles did not
//! reach 5 % in ten minutes.
//!
//! Samples for the error of a picture use neither moments of nodes nor polynomials, which have bias.
//!
//! Not handled: receivers off their patch; a luminaire by closed form whose shadows are too ragged costs one ray and
//! the bias of its ratio, as elsewhere.

use glam::{DVec3, Vec2};

use crate::direct::Luminaires;
use crate::direct::emitters::shafts::Between;
use crate::direct::lights::Lights;
use crate::direct::luminaire_light::{DirectSum, Scratch, SeenLuminaire, point_for};
use crate::direct::many::light_cut::{LightCut, LightCuts, Seen, light};
use crate::direct::many::light_tree::{LightTree, draw};
use crate::light::shares::{self, Drawn};
use crate::rays::sobol::Stream;
use crate::surfaces::SurfacePoint;

/// Luminaires sampled without bias for all visible nodes.
const VISIBLE_DRAWS: u32 = 4;

impl LightCuts {
    /// How many luminaires to draw at a receiver on a patch.
    pub(crate) fn draws(&self, patch: u32) -> u32 {
        self.of(patch as usize).draws
    }

    /// `sum over luminaires of F_l L_l` at a receiver on a patch, with a draw for each point of the unit square.
    pub(crate) fn gather(
        &self,
        lights: &Lights,
        receiver: &SurfacePoint,
        patch: u32,
        points: impl ExactSizeIterator<Item = Vec2>,
        scratch: &mut Scratch,
    ) -> DVec3 {
        let cut = self.of(patch as usize);
        let mut sum = self.visible(cut, &lights.luminaires, receiver);
        for (number, seen) in seen_luminaires(cut, &lights.luminaires) {
            let mut own = DirectSum::default();
            let point = std::iter::once(point_for(receiver.position, number));
            lights.gather_luminaire(seen, receiver, DVec3::ONE, point, scratch, &mut own);
            sum += own.estimate() * seen.luminaire.radiance.as_dvec3();
        }
        sum + self.beyond(cut, lights, receiver, points, scratch)
    }

    /// `sum over luminaires of F_l L_l` without bias, by luminaires drawn one by one in place of nodes and polynomials.
    pub(crate) fn sample(
        &self,
        lights: &Lights,
        receiver: &SurfacePoint,
        patch: u32,
        random: &mut Stream,
        scratch: &mut Scratch,
    ) -> DVec3 {
        let cut = self.of(patch as usize);
        let mut sum = self.one_by_one(cut, &lights.luminaires, receiver, random);
        for (_, seen) in seen_luminaires(cut, &lights.luminaires) {
            sum += lights.sample_luminaire(seen, receiver, random, scratch);
        }
        let points: Vec<Vec2> = (0..cut.draws).map(|_| Vec2::new(random.uniform(), random.uniform())).collect();
        sum + self.beyond(cut, lights, receiver, points.into_iter(), scratch)
    }

    /// The light of the sampled nodes beyond what is expected of them.
    fn beyond(
        &self,
        cut: &LightCut,
        lights: &Lights,
        receiver: &SurfacePoint,
        points: impl ExactSizeIterator<Item = Vec2>,
        scratch: &mut Scratch,
    ) -> DVec3 {
        if cut.drawn.is_empty() {
            return DVec3::ZERO;
        }
        let mut sum = DVec3::ZERO;
        let share = 1.0 / points.len().max(1) as f64;
        let mut until = std::mem::take(&mut scratch.until);
        add_up_chances(cut, &self.tree, receiver, &mut until);
        for point in points {
            let chosen = choose(&until, point.x);
            let entry = &cut.drawn[chosen.index];
            let at = Vec2::new(chosen.again(), point.y);
            if let Some(drawn) = draw(&self.tree, &lights.luminaires, entry.node, receiver, at) {
                let beyond = lights.transmittance(receiver, drawn.end, scratch) - entry.expected;
                sum += drawn.light * (beyond * share / chosen.weight);
            }
        }
        scratch.until = until;
        sum
    }

    /// The light of visible nodes and the expected light of sampled ones, by closed forms of luminaires drawn from
    /// them: of the nodes by their parts of the patch's light, stratified, and within each by power.
    fn one_by_one(
        &self,
        cut: &LightCut,
        luminaires: &Luminaires,
        receiver: &SurfacePoint,
        random: &mut Stream,
    ) -> DVec3 {
        if cut.seen.is_empty() {
            return DVec3::ZERO;
        }
        let first = f64::from(random.uniform());
        let one = |k: u32| {
            let u = (first + f64::from(k)) / f64::from(VISIBLE_DRAWS);
            let Drawn { index, weight: chance, .. } = shares::draw(&cut.seen, |seen| seen.until, u);
            let Seen { node, share, .. } = cut.seen[index];
            let (l, of_node, _) = self.tree.draw(&self.tree.nodes[node].range, f64::from(random.uniform()));
            let (luminaire, x, n) = (&luminaires.list[l as usize], receiver.position, receiver.normal);
            let light =
                luminaire.light(x, n, luminaire.exact_form(x, n), self.tree.exactness) * luminaire.radiance.as_dvec3();
            light * (share / (chance * of_node * f64::from(VISIBLE_DRAWS)))
        };
        (0..VISIBLE_DRAWS).map(one).sum()
    }

    /// The light of visible nodes and the expected light of sampled ones.
    fn visible(&self, cut: &LightCut, luminaires: &Luminaires, receiver: &SurfacePoint) -> DVec3 {
        let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        match &cut.smooth {
            Some(tiles) => tiles.at(x),
            None => light(&self.tree, luminaires, &cut.seen, x, n),
        }
    }
}

/// The luminaires of a cut that keep their closed form, with their numbers.
fn seen_luminaires<'a>(
    cut: &'a LightCut,
    luminaires: &'a Luminaires,
) -> impl Iterator<Item = (u32, SeenLuminaire<'a>)> {
    cut.exact.iter().map(|(number, faces)| {
        let between = if faces.is_empty() { Between::Nothing } else { Between::Faces(faces) };
        (*number, SeenLuminaire { luminaire: &luminaires.list[*number as usize], between })
    })
}

/// The probabilities of a cut's nodes at a receiver, to each those before it added.
fn add_up_chances(cut: &LightCut, tree: &LightTree, receiver: &SurfacePoint, until: &mut Vec<f64>) {
    until.clear();
    if cut.near {
        let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        until.extend(cut.drawn.iter().scan(0.0, |sum, d| {
            *sum += d.power * tree.bounds[d.node].largest_kernel(x, n);
            Some(*sum)
        }));
    }
    match until.last() {
        Some(&all) if all > 0.0 => {
            until.iter_mut().zip(&cut.drawn).for_each(|(until, d)| *until = 0.5 * (*until / all + d.until));
        }
        _ => {
            until.clear();
            until.extend(cut.drawn.iter().map(|d| d.until));
        }
    }
}

/// Draws one of a cut's nodes by a number u of the unit interval.
fn choose(until: &[f64], u: f32) -> Drawn<f64> {
    shares::draw(until, |&until| until, f64::from(u))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::direct::TOLERABLE;
    use crate::direct::many::light_cut::Chance;
    use crate::light::Rgb;
    use crate::scene::{Material, Scene};

    const SIDE: u32 = 8;
    const COUNT: usize = (SIDE * SIDE) as usize;

    /// A square grid of luminaires that face down, and a cut that samples all of them with equal probabilities.
    fn luminaires(near: bool) -> (LightTree, LightCut) {
        let glow = Material::new("glow", Rgb::ZERO, Rgb::ONE);
        let corner = |k: u32, (u, v): (f64, f64)| {
            DVec3::new(f64::from(k % SIDE) + 0.05 * u, f64::from(k / SIDE) + 0.05 * v, 0.0)
        };
        let square = |k: u32| [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)].map(|at| corner(k, at));
        let corners: Vec<DVec3> = (0..SIDE * SIDE).flat_map(square).collect();
        let faces: Vec<(Vec<u32>, u32)> = (0..SIDE * SIDE).map(|k| ((4 * k..4 * k + 4).collect(), 0)).collect();
        let tree = {
            let scene = Scene::from_faces("", &corners, &faces, vec![glow]).unwrap();
            let luminaires = Luminaires::new(&scene);
            let all: Vec<u32> = (0..luminaires.list.len() as u32).collect();
            LightTree::new(&luminaires, &all, TOLERABLE)
        };
        let mut leaves: Vec<usize> = (0..tree.nodes.len()).filter(|&k| tree.nodes[k].children.is_none()).collect();
        leaves.sort_unstable_by_key(|&k| tree.nodes[k].range.start);
        assert_eq!(leaves.len(), COUNT);
        let until = |k: usize| (k + 1) as f64 / COUNT as f64;
        let chance = |(k, node)| Chance { node, until: until(k), power: 1.0, expected: 0.0 };
        let drawn = leaves.into_iter().enumerate().map(chance).collect();
        (tree, LightCut { drawn, near, draws: 1, ..LightCut::default() })
    }

    /// A point below one of the luminaires, at a depth in units of their spacing.
    fn below(tree: &LightTree, luminaire: usize, depth: f64) -> SurfacePoint {
        let step = tree.nodes[0].center().distance(tree.nodes[1].center());
        let position = tree.nodes[luminaire].center() - DVec3::Z * (depth * step);
        SurfacePoint { position: position.as_vec3(), normal: Vec3::Z, face: 0 }
    }

    /// The probabilities of the luminaires at a receiver, added up.
    fn chances(cut: &LightCut, tree: &LightTree, receiver: &SurfacePoint) -> Vec<f64> {
        let mut until = Vec::new();
        add_up_chances(cut, tree, receiver, &mut until);
        until
    }

    #[test]
    fn nodes_are_drawn_with_their_probability() {
        const DRAWS: u32 = 1 << 16;
        let (tree, cut) = luminaires(true);
        for depth in [0.03, 0.5, 20.0] {
            let until = chances(&cut, &tree, &below(&tree, cut.drawn[11].node, depth));
            let mut counts = [0.0; COUNT];
            for i in 0..DRAWS {
                let choice = choose(&until, (i as f32 + 0.5) / DRAWS as f32);
                counts[choice.index] += 1.0 / (choice.weight * f64::from(DRAWS));
            }
            // A luminaire is drawn a whole number of times, give or take one at each end.
            let off = counts.iter().map(|f| (f - 1.0).abs()).fold(0.0, f64::max);
            assert!(off < 4.0 * COUNT as f64 / f64::from(DRAWS), "{depth}: {off}");
        }
    }

    #[test]
    fn a_luminaire_close_by_is_drawn_as_often_as_it_counts() {
        let (tree, cut) = luminaires(true);
        let receiver = below(&tree, cut.drawn[11].node, 0.1);
        let (x, n) = (receiver.position.as_dvec3(), DVec3::Z);
        let light = |k: usize| tree.nodes[cut.drawn[k].node].moments.light(x, n).element_sum();
        let all: f64 = (0..COUNT).map(light).sum();
        assert!(light(11) > 0.9 * all);
        let until = chances(&cut, &tree, &receiver);
        for k in 0..COUNT {
            let chance = until[k] - if k == 0 { 0.0 } else { until[k - 1] };
            // Half is the patch's; bounds of neighbouring luminaires are loose.
            assert!(chance > 0.3 * light(k) / all, "{k}: {chance} {}", light(k) / all);
        }
        assert!((until[COUNT - 1] - 1.0).abs() < 1e-12, "{}", until[COUNT - 1]);
    }

    #[test]
    fn far_from_all_luminaires_the_patch_decides() {
        let (tree, cut) = luminaires(false);
        let until = chances(&cut, &tree, &below(&tree, cut.drawn[11].node, 0.1));
        for k in 0..COUNT {
            let choice = choose(&until, (k as f32 + 0.25) / COUNT as f32);
            assert_eq!((choice.index, choice.weight), (k, 1.0 / COUNT as f64));
            assert!((choice.rest - 0.25).abs() < 1e-4);
        }
    }
}
