//! Luminaires drawn in place of asked: nodes with chances in proportion to what a few rays found, never zero for one that may
//! light the patch, so that drawing is free of bias.
//!
//! A node's luminaires are drawn by power and points on them by area. Not handled: chances that vary over a patch.

use glam::{DVec3, Vec3};

use crate::direct::cut_refinement::Walk;
use crate::direct::light_cut::{Chance, Links, Maker};
use crate::direct::light_tree::Lamps;
use crate::direct::luminaire::Luminaires;
use crate::form_factors::point_kernel;
use crate::rays::Hit;
use crate::rays::sobol::{Sobol, hash};

/// Rays that tell how much of a node arrives.
const TRIALS: u32 = 8;
/// Luminaires drawn at a receiver, where the doubt is as large as its light.
const DRAWS: f64 = 16.0;

/// Chances of the nodes a walk left to be drawn, in proportion to how far what arrives may be from what is expected; and
/// how many to draw at a receiver.
pub(crate) fn weigh(walk: &Walk, maker: &Maker, i: usize, hits: &mut Vec<Hit>) -> (Vec<Chance>, u32) {
    let mut chances = Vec::with_capacity(walk.drawn.len());
    let sobol = Sobol::new(TRIALS as usize, 4);
    let mut until = 0.0;
    for &node in &walk.drawn {
        let seed = hash(node as u32, hash(i as u32, 0x11_6a5b));
        let [all, arrived] = trials(maker, walk.lamps, (i, node), (&sobol, seed), hits);
        let share = if all > 0.0 { arrived / all } else { 1.0 };
        // Laplace's rule: so many trials leave a doubt even where all went alike.
        let likely = (f64::from(TRIALS) * share + 0.5) / f64::from(TRIALS + 1);
        let own = &walk.lamps.nodes[node];
        let (expected, doubt) = match walk.is_near(own) {
            true => (0.0, likely),
            false => (share, likely * (1.0 - likely)),
        };
        until += all.max(walk.estimate(own)) * doubt.sqrt();
        chances.push(Chance { node, until, expected });
    }
    chances.iter_mut().for_each(|d| d.until /= until);
    let wanted = (DRAWS * until / walk.total.max(until)).ceil() as u32;
    let draws = match chances.is_empty() {
        true => 0,
        false => wanted.next_power_of_two().clamp(1, Links::MOST_DRAWN),
    };
    (chances, draws)
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
        let drawn = draw(lamps, maker.luminaires, k, (at(2), at(3)), p.position, p.normal);
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
pub(crate) struct Drawn {
    pub position: Vec3,
    pub face: u32,
    pub light: DVec3,
}

/// Draws a luminaire of a node by power, and a point on it; `None` where that does not face the receiver.
pub(crate) fn draw(
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
    let kernel = point_kernel(x.as_dvec3(), n.as_dvec3(), y.position.as_dvec3(), y.normal);
    (kernel > 0.0).then(|| Drawn {
        position: y.position,
        face: y.face,
        light: luminaire.radiance.as_dvec3() * (luminaire.area * kernel / chance),
    })
}
