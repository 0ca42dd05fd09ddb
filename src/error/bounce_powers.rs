//! Powers of the terms `KⁿE` by populations of light walks ([`crate::error::light_walks`]), as many for each term.
//!
//! All surfaces that the walks of a batch cross on the way to one term are a population of light with powers w_j. The
//! visible halves of what they reflect add up to the power of the term, the invisible halves go on: N of them are drawn
//! systematically, j on average `N w_j / sum w` times, each with `sum w / N` of the power. So a walk that carries much
//! is split, one that carries little ends by chance, and no term has fewer walks than another or walks of unlike power,
//! whether the series converges or not. Sums over the channels decide; the colour of a walk stays its own.
//!
//! ```text
//! relative variance of the power of KⁿE   about  n c / walks,   c  that of one bounce of one walk
//! ```
//!
//! where walks that only carry their weights on have one that grows as the n-th power of some number, which is infinite
//! in the sum between the two frontiers of a path tracer's series. Means have no bias, whatever is drawn (systematic
//! resampling: A. Doucet, A. Johansen, *A tutorial on particle filtering and smoothing*, 2009, 3.4; splitting: J. Arvo,
//! D. Kirk, *Particle transport and image synthesis*, 1990). Standard errors come from independent batches of equal
//! size, and are widened by what so few of them know of their own spread.
//!
//! Not handled: norms of the terms, which need light by position; a place that no walk of any batch ever enters and
//! that patches do not see either.

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use halflight_team::{Loop, is_over};

use crate::error::light_walks::{Leaving, Walks};
use crate::light::Transport;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Stream, hash};
use crate::rays::{Hit, Ray, Rays};
use crate::scene::{Emitters, Scene};

/// Walks of a batch.
const BATCH: u32 = 4096;
/// Batches at first and at most.
const BATCHES: (usize, usize) = (16, 1024);
/// Terms of emitters that batches keep at a time, at most.
const MOST_TERMS: usize = 1 << 20;

/// Powers of both halves of one term, W.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TermPower {
    pub visible: DVec3,
    pub invisible: DVec3,
}

impl TermPower {
    /// Whether any walk brought light.
    pub(crate) fn is_known(&self) -> bool {
        self.total() > 0.0
    }

    /// Of the visible half, channels added, W.
    pub(crate) fn total(&self) -> f64 {
        self.visible.element_sum()
    }

    fn plus(self, other: TermPower) -> TermPower {
        TermPower { visible: self.visible + other.visible, invisible: self.invisible + other.invisible }
    }

    fn over(self, count: f64) -> TermPower {
        TermPower { visible: self.visible / count, invisible: self.invisible / count }
    }
}

/// A power and the relative standard error of its visible half, channels added; 0 where nothing arrived.
pub(crate) type Walked = (TermPower, f64);

/// Estimates by the walks, KE first.
pub(crate) struct WalkedPowers {
    /// Of all emitters together.
    pub terms: Vec<Walked>,
    /// Of each emitter, where they are kept apart.
    pub emitters: Vec<Vec<Walked>>,
}

/// Which terms the walks estimate, and how precisely.
pub(crate) struct WalkGoal {
    /// Terms from KE on.
    pub count: usize,
    /// Relative standard error at which the walks end.
    pub error: f64,
    /// No batch is begun after it.
    pub deadline: Option<Instant>,
    pub seed: u32,
    /// Whose light is kept apart.
    pub emitters: Arc<Emitters>,
    /// The powers that these terms have on patches, visible half, channels added, W.
    pub on_patches: Vec<f64>,
}

/// Share of a power on patches that walks bring at least unless they miss a place: patches that lie half inside of
/// walls or half in the sun are wrong by some percent a bounce, and not by half.
const MISSED: f64 = 0.5;

impl WalkGoal {
    /// Whether term k has far more light on patches than walks brought.
    pub(crate) fn is_missed(&self, k: usize, (walked, _): &Walked) -> bool {
        walked.total() < MISSED * self.on_patches.get(k).copied().unwrap_or(0.0)
    }

    /// Whether the terms are as near as requested.
    fn is_met(&self, terms: &[Walked]) -> bool {
        terms.iter().enumerate().all(|(k, term)| term.1 <= self.error && !self.is_missed(k, term))
    }
}

/// Walks until every term has the standard error requested and what patches have of it, or all batches are made.
pub(crate) fn walked_powers(scene: &Scene, rays: &Rays, transport: Transport, goal: &WalkGoal) -> WalkedPowers {
    let walks = Walks::new(scene, rays, transport, &goal.emitters);
    let own = if goal.emitters.are_apart() { goal.emitters.count() } else { 0 };
    let (mut together, mut apart) = (BatchMeans::of(goal.count), BatchMeans::of(own * goal.count));
    let step = (MOST_TERMS / (goal.emitters.count() * goal.count).max(1)).max(1);
    let (mut made, mut wanted) = (0, BATCHES.0);
    loop {
        while made < wanted {
            let count = step.min(wanted - made);
            for batch in Loop::each(count).map(|k| Population::new(&walks, goal, made + k).powers()) {
                let all = |k| batch.iter().skip(k).step_by(goal.count).fold(TermPower::default(), |s, t| s.plus(*t));
                together.add((0..goal.count).map(all));
                apart.add(batch.iter().copied().take(own * goal.count));
            }
            made += count;
        }
        let terms = together.walked();
        if wanted >= BATCHES.1 || is_over(goal.deadline) || goal.is_met(&terms) {
            let emitters = apart.walked().chunks(goal.count.max(1)).map(<[_]>::to_vec).collect();
            return WalkedPowers { terms, emitters };
        }
        wanted *= 2;
    }
}

/// Means and spreads over batches of several powers, one pass over each batch (Welford; fourth powers by P. Pébay,
/// *Formulas for robust, one-pass parallel computation of covariances and arbitrary-order statistical moments*, 2008).
struct BatchMeans {
    count: f64,
    moments: Vec<Moments>,
}

#[derive(Clone, Copy, Default)]
struct Moments {
    sum: TermPower,
    mean: f64,
    second: f64,
    third: f64,
    fourth: f64,
}

impl BatchMeans {
    fn of(count: usize) -> BatchMeans {
        BatchMeans { count: 0.0, moments: vec![Moments::default(); count] }
    }

    fn add(&mut self, batch: impl Iterator<Item = TermPower>) {
        self.count += 1.0;
        let n = self.count;
        for (own, power) in self.moments.iter_mut().zip(batch) {
            own.sum = own.sum.plus(power);
            let delta = power.total() - own.mean;
            let (step, square) = (delta / n, delta * delta * (n - 1.0) / n);
            own.mean += step;
            own.fourth += square * step * step * (n * n - 3.0 * n + 3.0) + 6.0 * step * step * own.second
                - 4.0 * step * own.third;
            own.third += square * step * (n - 2.0) - 3.0 * step * own.second;
            own.second += square;
        }
    }

    fn walked(&self) -> Vec<Walked> {
        let n = self.count;
        let one = |own: &Moments| {
            let mean = own.sum.over(n);
            (mean, if own.mean > 0.0 { own.squared_error(n).sqrt() / own.mean } else { 0.0 })
        };
        self.moments.iter().map(one).collect()
    }
}

impl Moments {
    /// Variance of the mean, and one standard error of that: of squares d² it is `sqrt(sum d⁴) / sum d²` of it.
    fn squared_error(&self, n: f64) -> f64 {
        let variance = self.second / (n * (n - 1.0));
        let unsure = if self.second > 0.0 { self.fourth.max(0.0).sqrt() / self.second } else { 0.0 };
        variance * (1.0 + unsure)
    }
}

/// The walks of one batch, term by term.
struct Population<'a> {
    walks: &'a Walks<'a>,
    goal: &'a WalkGoal,
    random: Stream,
    /// What goes on from the last term, and whose light it is.
    leaving: Vec<(Leaving, usize)>,
    /// Each emitter's terms.
    sums: Vec<TermPower>,
    hits: Vec<Hit>,
}

impl<'a> Population<'a> {
    fn new(walks: &'a Walks<'a>, goal: &'a WalkGoal, batch: usize) -> Population<'a> {
        let random = Stream::new(hash(batch as u32, Purpose::Walks.seed(goal.seed)));
        let sums = vec![TermPower::default(); goal.count * goal.emitters.count()];
        Population { walks, goal, random, leaving: Vec::new(), sums, hits: Vec::new() }
    }

    /// The mean power of each term, emitter by emitter.
    fn powers(mut self) -> Vec<TermPower> {
        for term in 0..self.goal.count {
            let before = std::mem::take(&mut self.leaving);
            match term {
                0 => self.start(),
                _ => self.go_on(term, &before),
            }
        }
        self.sums
    }

    /// Walks from what emits.
    fn start(&mut self) {
        for _ in 0..BATCH {
            let Some(start) = self.walks.sources.start(&mut self.random) else { return };
            let power = |hit: &Hit| start.power(f64::from(hit.t)) / f64::from(BATCH);
            self.cross(0, start.emitter, &start.ray, power);
        }
    }

    /// As many from what left the surfaces of the term before.
    fn go_on(&mut self, term: usize, before: &[(Leaving, usize)]) {
        let step = before.iter().map(|(leaving, _)| leaving.total()).sum::<f64>() / f64::from(BATCH);
        // Of terms beyond what a number can hold nothing is known.
        if !step.is_normal() {
            return;
        }
        let mut next = step * f64::from(self.random.uniform());
        let mut until = 0.0;
        for (leaving, emitter) in before {
            let own = leaving.total();
            until += own;
            while next < until && own > 0.0 {
                next += step;
                let walk = leaving.scaled(step / own);
                let ray = self.walks.leave(&walk, &mut self.random);
                self.cross(term, *emitter, &ray, |_| walk.power);
            }
        }
    }

    /// Adds what one ray meets to a term, and keeps what goes on.
    fn cross(&mut self, term: usize, emitter: usize, ray: &Ray, power: impl Fn(&Hit) -> DVec3) {
        let Population { walks, leaving, sums, hits, goal, .. } = self;
        let sum = &mut sums[emitter * goal.count + term];
        walks.cross(ray, hits, power, |_, visible, next| {
            *sum = sum.plus(TermPower { visible, invisible: next.power });
            if next.total() > 0.0 {
                leaving.push((next, emitter));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::light::Mode;
    use crate::scene::{Beam, PunctualForm, PunctualLight, PunctualPlace};

    fn walked(scene: &Scene, transport: Transport) -> WalkedPowers {
        let emitters = Emitters::of(scene);
        let goal = WalkGoal { count: 4, error: 0.01, deadline: None, seed: 3, emitters, on_patches: Vec::new() };
        walked_powers(scene, &Rays::new(scene), transport, &goal)
    }

    /// Every side of a closed cube emits 0.25 and reflects 0.5: the power of KⁿE is pi A 0.25 · 0.5ⁿ, walk by walk.
    #[test]
    fn powers_in_a_furnace_halve_with_every_bounce() {
        let scene = Scene::open("furnace").unwrap();
        let area: f64 = (0..scene.faces.len() as u32).map(|f| scene.area(f)).sum();
        let emitted = std::f64::consts::PI * 0.25 * area * scene.frame.scale.powi(2);
        let powers = walked(&scene, Mode::Global.transport());
        for (n, (term, error)) in powers.terms.iter().enumerate() {
            let power = emitted * 0.5_f64.powi(n as i32 + 1);
            // All walks carry the same: rounding of f32 reflectances and areas remains.
            assert!((term.visible.x / power - 1.0).abs() < 1e-5, "{n}: {} {power}", term.visible.x);
            assert_eq!(term.visible, term.invisible);
            assert!(*error < 1e-6);
        }
    }

    /// Terms of a series that diverges, of ten seeds: their squares about their mean, each over the squared error that
    /// it states, add up to chi-square of 9 degrees of freedom (27.9 in one case of a thousand) or less.
    #[test]
    fn errors_of_a_diverging_series_are_as_stated() {
        let scene = Scene::open("furnished-room").unwrap();
        let (rays, emitters) = (Rays::new(&scene), Emitters::of(&scene));
        let of_seed = |seed| {
            let emitters = Arc::clone(&emitters);
            let goal = WalkGoal { count: 8, error: 0.1, deadline: None, seed, emitters, on_patches: Vec::new() };
            walked_powers(&scene, &rays, Mode::Shadowless.transport(), &goal).terms
        };
        let found: Vec<_> = (0..10).map(of_seed).collect();
        for n in 0..8 {
            let mean = found.iter().map(|terms| terms[n].0.total()).sum::<f64>() / 10.0;
            let apart = |terms: &Vec<Walked>| ((terms[n].0.total() / mean - 1.0) / terms[n].1).powi(2);
            let squares: f64 = found.iter().map(apart).sum();
            assert!(squares < 27.9, "term {n}: {squares}");
        }
        assert!(found.iter().all(|terms| terms[7].1 < 0.02), "16 batches suffice for 2 % of the last");
    }

    /// rho alpha of 0.05: the power of K²⁵⁰E is below the least number.
    #[test]
    fn terms_too_small_for_a_number_end() {
        let mut scene = Scene::open("furnace").unwrap();
        scene.materials.iter_mut().for_each(|material| material.rho = glam::Vec3::splat(0.05));
        let emitters = Emitters::of(&scene);
        let goal = WalkGoal { count: 260, error: 0.1, deadline: None, seed: 0, emitters, on_patches: Vec::new() };
        let terms = walked_powers(&scene, &Rays::new(&scene), Mode::Global.transport(), &goal).terms;
        assert!(terms[200].0.is_known() && !terms[259].0.is_known());
    }

    /// Faces of a cube with corners at ±r: outward, or inward.
    fn cube(first: usize, r: f32, inward: bool) -> String {
        let mut text = String::new();
        for k in 0..8 {
            let at = |bit: usize| if k >> bit & 1 == 1 { r } else { -r };
            text += &format!("v {} {} {}\n", at(0), at(1), at(2));
        }
        for face in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
            let mut corners = face.map(|c: usize| (c + first).to_string());
            if inward {
                corners.reverse();
            }
            text += &format!("f {}\n", corners.join(" "));
        }
        text
    }

    /// A glowing cube in a sheet of a cube in a closed cube: the light of every walk meets the sheet, and tau of it the
    /// walls, so KE has the power P (rho_sheet + tau rho_wall).
    #[test]
    fn light_is_reflected_at_every_surface_that_it_passes() {
        let obj = [
            "mtllib nested.mtl\nusemtl lamp\n".to_string() + &cube(0, 0.1, false),
            "usemtl sheet\n".to_string() + &cube(8, 0.5, true),
            "usemtl wall\n".to_string() + &cube(16, 1.0, true),
        ]
        .concat();
        let mtl = "newmtl lamp\nKd 0 0 0\nKe 1 2 3\nnewmtl sheet\nKd 0.5 0.5 0.5\nnewmtl wall\nKd 0.25 0.25 0.25\n";
        let scene = Scene::from_obj_text("nested", &obj, mtl).unwrap();
        let powers = walked(&scene, Transport { alpha: 0.5, tau: 0.5 });
        let (term, _) = powers.terms[0];
        let emitted = std::f64::consts::PI * 6.0 * 0.2 * 0.2 * DVec3::new(1.0, 2.0, 3.0);
        let expected = (0.5 + 0.5 * 0.25) * emitted;
        assert!((term.visible / expected - 1.0).abs().max_element() < 1e-5, "{term:?}");
        assert!((term.invisible / (0.5 * expected) - 1.0).abs().max_element() < 1e-5);
    }

    /// A closed cube of two units with one light in it; all of its light meets the walls.
    fn lit_cube(form: PunctualForm) -> TermPower {
        let obj = "mtllib cube.mtl\nusemtl wall\n".to_string() + &cube(0, 1.0, true);
        let mut scene = Scene::from_obj_text("cube", &obj, "newmtl wall\nKd 0.5 0.5 0.5\n").unwrap();
        scene.lights.push(PunctualLight { form, intensity: glam::Vec3::new(1.0, 2.0, 3.0), name: None });
        walked(&scene, Transport { alpha: 0.5, tau: 0.5 }).terms[0].0
    }

    #[test]
    fn lights_without_area_send_their_intensity_times_the_solid_angle() {
        let place = |attenuation| PunctualPlace { position: DVec3::new(0.3, -0.5, 0.2), attenuation };
        let spot = |place, cutoff| PunctualForm::Point {
            place,
            beam: Beam::Spot { direction: DVec3::X, exponent: 3.0, cutoff },
        };
        let physical = place([0.0, 0.0, 1.0]);
        let half = place([0.0, 0.0, 2.0]);
        let cases = [
            (PunctualForm::even(physical), 4.0 * PI),
            (PunctualForm::even(half), 2.0 * PI),
            (spot(physical, 0.0), 0.5 * PI),
            (spot(physical, 0.5), 0.5 * PI * (1.0 - 0.0625)),
        ];
        for (form, angle) in cases {
            let expected = 0.5 * angle * DVec3::new(1.0, 2.0, 3.0);
            let found = lit_cube(form.clone());
            assert!((found.visible / expected - 1.0).abs().max_element() < 1e-5, "{form:?} {found:?}");
            assert!((found.invisible / (0.5 * expected) - 1.0).abs().max_element() < 1e-5);
        }
        // Without attenuation E = I cos, whose integral over a wall is known: from the middle of the cube, a wall at
        // distance 1 gets the integral of (1 + x² + y²)^-1/2 over [-1, 1]², 8 ln((1 + sqrt 3) / sqrt 2) - 2 pi / 3.
        let even = PunctualPlace { position: DVec3::ZERO, attenuation: [1.0, 0.0, 0.0] };
        let walls = 6.0 * (8.0 * ((1.0 + 3f64.sqrt()) / 2f64.sqrt()).ln() - 2.0 * PI / 3.0);
        let ratio = lit_cube(PunctualForm::even(even)).visible.x / (0.5 * walls);
        assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
        // Parallel light meets the outside of opaque walls, which is black.
        let form = PunctualForm::Directional { direction: DVec3::NEG_Y };
        assert!(lit_cube(form).visible.x > 0.0, "tau of 0.5 lets it in");
    }
}
