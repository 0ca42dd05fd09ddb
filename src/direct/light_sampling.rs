//! Luminaires drawn in place of asked: nodes with chances in proportion to what a few rays found, never zero for one
//! that may light the patch, so that drawing is free of bias.
//!
//! A node's luminaires are drawn by power and points on them by area. Not handled: chances that vary over a patch
//! ([`crate::direct::light_choice`]).

use glam::{DVec3, Vec2};

use crate::direct::cut_refinement::{CutInputs, Walk};
use crate::direct::light_tree::LightTree;
use crate::direct::luminaire::Luminaires;
use crate::form_factors::point_kernel;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::{End, Hit};
use crate::surfaces::SurfacePoint;

/// Luminaires drawn at a receiver at most.
pub(crate) const MOST_DRAWN: u32 = 8;
/// Rays that tell how much of a node arrives.
const TRIALS: u32 = 8;
/// Luminaires drawn at a receiver, where the doubt is as large as its light.
const DRAWS: f64 = 16.0;

/// A node to draw from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chance {
    pub node: usize,
    /// The chance of it and those before it.
    pub until: f64,
    /// Its doubtful power and that of those before it.
    pub power: f64,
    /// The share of its light that is summed already: only what arrives beyond it is drawn.
    pub expected: f64,
}

/// Chances of the nodes a walk left to be drawn, in proportion to how far what arrives may be from what is expected;
/// and how many to draw at a receiver.
pub(crate) fn weigh(walk: &Walk, inputs: &CutInputs, i: usize, hits: &mut Vec<Hit>) -> (Vec<Chance>, u32) {
    let mut chances = Vec::with_capacity(walk.drawn.len());
    let sobol = Sobol::new(TRIALS as usize, 4);
    let (mut until, mut power) = (0.0, 0.0);
    for &node in &walk.drawn {
        let seed = hash(node as u32, hash(i as u32, 0x11_6a5b));
        let [all, arrived] = trials(inputs, walk.tree, i, node, |s, d| sobol.point(s, d, seed), hits);
        let share = if all > 0.0 { arrived / all } else { 1.0 };
        // Laplace's rule: so many trials leave a doubt even where all went alike.
        let likely = (f64::from(TRIALS) * share + 0.5) / f64::from(TRIALS + 1);
        let own = &walk.tree.nodes[node];
        let (expected, doubt) = if walk.is_near(own) { (0.0, likely) } else { (share, likely * (1.0 - likely)) };
        until += all.max(walk.estimate(own)) * doubt.sqrt();
        power += own.power * doubt.sqrt();
        chances.push(Chance { node, until, power, expected });
    }
    chances.iter_mut().for_each(|d| d.until /= until);
    let wanted = (DRAWS * until / walk.total.max(until)).ceil() as u32;
    let draws = wanted.next_power_of_two().clamp(1, MOST_DRAWN);
    let draws = if chances.is_empty() { 0 } else { draws };
    (chances, draws)
}

/// Mean light of a node from points drawn on it, at points of patch i: nothing between, and what arrives. `at(s, d)` is
/// number d of draw s.
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

/// A point drawn on a node's luminaires, and its light over its density.
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
    let y = luminaire.point((u as f32).min(0.999_999_94), at.y);
    let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
    let kernel = point_kernel(x, n, y.position.as_dvec3(), y.normal);
    let light = luminaire.radiance.as_dvec3() * y.share * (luminaire.area * kernel / chance);
    (kernel > 0.0).then_some(Drawn { end: y.end(), light })
}
