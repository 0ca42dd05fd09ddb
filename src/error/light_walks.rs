//! Powers of the terms `KⁿE` by walks of light from the emitters, without patches and so without bias.
//!
//! A walk starts at a point of an emitting side, drawn by power, along a cosine-distributed direction, at the sphere
//! around the scene, where light of the sky enters it, or at a punctual light. Its ray crosses surfaces c = 1, 2,
//! ...; s_c is the product of tau before c. With W the power that the walk carries, per channel,
//!
//! ```text
//! power of KⁿE, visible half   = mean over walks of  sum over crossings c of  W s_c rho_c
//! power of KⁿE, invisible half = mean over walks of  sum over crossings c of  W s_c rho_c alpha_c
//! continues from one crossing,   drawn by p_c in proportion to s_c alpha_c |rho_c|,   with W s_c rho_c alpha_c / p_c
//! ```
//!
//! Both means have no bias (J. Arvo, D. Kirk, *Particle transport and image synthesis*, 1990). Standard errors come
//! from batches of equal size. There is no Russian roulette, so late terms keep all their walks.
//!
//! A light of radiant intensity I has the power `integral of I dω`; where it attenuates otherwise than by the square of
//! the distance, the power of a walk depends on its length: `I d² / (a0 + a1 d + a2 d²)` to the solid angle. Parallel
//! light starts from a disc that shades the whole scene.
//!
//! Not handled: norms of the terms, which need light by position.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use std::time::Instant;

use glam::{DVec3, Vec3};
use halflight_team::{Loop, is_over};

use crate::form_factors::Estimate;
use crate::light::shares::Shares;
use crate::light::{Transport, nothing_passes};
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Stream, hash};
use crate::rays::warp::{cosine_direction, hemisphere_direction, triangle_point};
use crate::rays::{Hit, Ray, Rays, Side};
use crate::scene::{Beam, Emitters, PunctualForm, PunctualLight, PunctualPlace, Scene, Sides};

/// Walks of a batch.
const BATCH: u32 = 4096;
/// Batches at first and at most.
const BATCHES: (u32, u32) = (16, 1024);

/// Powers of both halves of one term, W.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TermPower {
    pub visible: DVec3,
    pub invisible: DVec3,
}

/// Estimates by the walks.
pub(crate) struct WalkedPowers {
    /// KE first.
    pub terms: Vec<TermPower>,
    /// Relative standard errors of the visible half's power, channels added; 0 where nothing arrived.
    pub errors: Vec<f64>,
    /// Terms and relative standard errors of each emitter, where they are kept apart.
    pub emitters: Vec<Vec<(TermPower, f64)>>,
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
}

/// Sums over batches, term by term.
#[derive(Default)]
struct BatchSums {
    count: f64,
    /// Of each term; and of the squares of the visible half's power, channels added.
    terms: Vec<(TermPower, f64)>,
}

impl BatchSums {
    /// Adds the terms of a batch.
    fn add(&mut self, batch: &[TermPower]) {
        self.count += 1.0;
        self.terms.resize(batch.len(), Default::default());
        for ((sum, squares), term) in self.terms.iter_mut().zip(batch) {
            *sum = sum.plus(*term);
            *squares += term.visible.element_sum().powi(2);
        }
    }

    /// The mean of term k, and its relative standard error.
    fn mean(&self, k: usize) -> (TermPower, f64) {
        let (n, (sum, squares)) = (self.count, self.terms[k]);
        let mean = TermPower { visible: sum.visible / n, invisible: sum.invisible / n };
        let power = mean.visible.element_sum();
        let variance = (squares / n - power * power).max(0.0) / (n - 1.0);
        (mean, if power > 0.0 { variance.sqrt() / power } else { 0.0 })
    }
}

/// Terms of emitters that batches keep at a time, at most.
const MOST_TERMS: usize = 1 << 20;

/// A surface that a walk meets.
pub(crate) struct Met {
    pub position: Vec3,
    pub face: u32,
    pub side: Side,
    /// What of the walk the visible half reflects there, W.
    pub reflected: DVec3,
    /// What the walk carries, channels added, W.
    pub carried: f64,
}

/// All walks of a scene in one mode.
pub(crate) struct Walks<'a> {
    scene: &'a Scene,
    rays: &'a Rays,
    transports: Vec<Transport>,
    sources: WalkSources<'a>,
    opaque: bool,
}

/// Walks until every term has the standard error requested, or [`BATCHES`] are made.
pub(crate) fn walked_powers(scene: &Scene, rays: &Rays, transport: Transport, goal: &WalkGoal) -> WalkedPowers {
    let walks = Walks::new(scene, rays, transport, &goal.emitters);
    let mut batches: Vec<Vec<TermPower>> = Vec::new();
    let mut apart = BatchSums::default();
    let mut wanted = BATCHES.0;
    let step = (MOST_TERMS / (goal.emitters.count() * goal.count).max(1)).max(1) as u32;
    loop {
        for first in (batches.len() as u32..wanted).step_by(step as usize) {
            let end = wanted.min(first + step);
            for batch in Loop::each((end - first) as usize).map(|k| walks.batch(first + k as u32, goal)) {
                if goal.emitters.are_apart() {
                    apart.add(&batch);
                }
                let total =
                    |k: usize| batch.iter().skip(k).step_by(goal.count).fold(TermPower::default(), |s, t| s.plus(*t));
                batches.push((0..goal.count).map(total).collect());
            }
        }
        let mut powers = WalkedPowers::of(&batches, goal.count);
        let late = is_over(goal.deadline);
        if wanted >= BATCHES.1 || late || powers.errors.iter().all(|&e| e <= goal.error) {
            let terms: Vec<_> = (0..apart.terms.len()).map(|k| apart.mean(k)).collect();
            powers.emitters = terms.chunks(goal.count.max(1)).map(<[_]>::to_vec).collect();
            return powers;
        }
        wanted *= 2;
    }
}

impl WalkedPowers {
    /// Means over batches, and the standard errors of the means.
    fn of(batches: &[Vec<TermPower>], count: usize) -> WalkedPowers {
        let n = batches.len() as f64;
        let mean = |k: usize| {
            let sum = batches.iter().fold(TermPower::default(), |sum, b| sum.plus(b[k]));
            TermPower { visible: sum.visible / n, invisible: sum.invisible / n }
        };
        let terms: Vec<TermPower> = (0..count).map(mean).collect();
        let error = |k: usize| {
            let mean = terms[k].visible.element_sum();
            let found = Estimate::about(mean, batches.iter().map(|b| b[k].visible.element_sum()));
            if mean > 0.0 { found.error / mean } else { 0.0 }
        };
        WalkedPowers { errors: (0..count).map(error).collect(), terms, emitters: Vec::new() }
    }
}

impl TermPower {
    /// Whether any walk brought light.
    pub(crate) fn is_known(&self) -> bool {
        self.visible.element_sum() > 0.0
    }

    fn add(&mut self, visible: DVec3, invisible: DVec3) {
        self.visible += visible;
        self.invisible += invisible;
    }

    fn plus(self, other: TermPower) -> TermPower {
        TermPower { visible: self.visible + other.visible, invisible: self.invisible + other.invisible }
    }
}

impl<'a> Walks<'a> {
    /// Walks from all that emits.
    pub(crate) fn new(scene: &'a Scene, rays: &'a Rays, transport: Transport, emitters: &Emitters) -> Walks<'a> {
        let transports = scene.transports(transport);
        let opaque = nothing_passes(transports.iter().map(|t| t.tau));
        Walks { scene, rays, transports, sources: WalkSources::new(scene, emitters), opaque }
    }

    /// The mean power of each term over one batch of walks, emitter by emitter.
    fn batch(&self, batch: u32, goal: &WalkGoal) -> Vec<TermPower> {
        let mut sums = vec![TermPower::default(); goal.count * goal.emitters.count()];
        let mut hits = Vec::new();
        for walk in 0..BATCH {
            let own = hash(batch * BATCH + walk, Purpose::Walks.seed(goal.seed));
            self.walk(&mut Stream::new(own), (&mut sums, goal.count), &mut hits);
        }
        for sum in &mut sums {
            sum.visible /= f64::from(BATCH);
            sum.invisible /= f64::from(BATCH);
        }
        sums
    }

    /// Adds one walk to each of the `count` terms of its emitter.
    fn walk(&self, random: &mut Stream, (sums, count): (&mut [TermPower], usize), hits: &mut Vec<Hit>) {
        let Some(start) = self.sources.start(random) else { return };
        let own = &mut sums[start.emitter * count..][..count];
        let Some((first, rest)) = own.split_first_mut() else { return };
        let power = |hit: &Hit| start.power(f64::from(hit.t));
        let arrived = self.arrive(&start.ray, hits, power, random, |_, seen, passed| first.add(seen, passed));
        let Some((mut ray, mut weight)) = arrived else { return };
        for sum in rest {
            let next = self.arrive(&ray, hits, |_| weight, random, |_, seen, passed| sum.add(seen, passed));
            let Some((next, carried)) = next else { return };
            (ray, weight) = (next, carried);
        }
    }

    /// Follows one walk through at most so many `terms`; `meet` is given what it reflects at each surface it crosses.
    /// Where it would carry less it ends by chance and carries as much.
    pub(crate) fn follow(&self, random: &mut Stream, terms: usize, hits: &mut Vec<Hit>, mut meet: impl FnMut(&Met)) {
        let Some(start) = self.sources.start(random) else { return };
        let (mut ray, mut carried) = (start.ray, None);
        for _ in 0..terms {
            let weight = |hit: &Hit| carried.unwrap_or_else(|| start.power(f64::from(hit.t)));
            let mut arrived = 0.0_f64;
            let next = self.arrive(&ray, hits, weight, random, |hit, reflected, _| {
                let carried = weight(hit).element_sum();
                arrived = arrived.max(carried);
                meet(&Met { position: ray.at(hit.t), face: hit.face, side: hit.side, reflected, carried });
            });
            let Some((next, passed)) = next else { return };
            let survival = (passed.element_sum() / arrived).min(1.0);
            if f64::from(random.uniform()) >= survival {
                return;
            }
            (ray, carried) = (next, Some(passed / survival));
        }
    }

    /// Calls `add` with each surface crossed, what it reflects and what of that travels on, and draws the one that the
    /// walk continues from.
    fn arrive(
        &self,
        ray: &Ray,
        hits: &mut Vec<Hit>,
        weight: impl Fn(&Hit) -> DVec3,
        random: &mut Stream,
        mut add: impl FnMut(&Hit, DVec3, DVec3),
    ) -> Option<(Ray, DVec3)> {
        let mut chosen: Option<(Hit, DVec3, f64)> = None;
        let mut total = 0.0;
        self.rays.light_crossings(ray, self.opaque, hits);
        self.rays.transmit(
            hits,
            |m| f64::from(self.transports[m].tau),
            |hit, through: f64| {
                let (rho, own) = self.reflects(ray, hit);
                let seen = weight(hit) * through * rho;
                let passed = seen * f64::from(own.alpha);
                add(hit, seen, passed);
                // Reservoir sampling of one crossing.
                let share = passed.element_sum();
                total += share;
                if share > 0.0 && (total == share || f64::from(random.uniform()) * total < share) {
                    chosen = Some((*hit, passed, share));
                }
            },
        );
        let (hit, passed, share) = chosen?;
        let position = ray.origin + hit.t * ray.direction;
        Some((leave(self.scene, position, hit.face, hit.side, random), passed * (total / share)))
    }

    /// rho of the side met, black on the back of a one-sided face, and the (alpha, tau) of its material.
    fn reflects(&self, ray: &Ray, hit: &Hit) -> (DVec3, Transport) {
        let material = self.scene.material(hit.face);
        let own = self.transports[self.scene.faces[hit.face as usize].material as usize];
        let lit = hit.side == Side::Front || material.sides == Sides::Two;
        let rho = || self.scene.rho_at(hit.face, ray.at(hit.t)).as_dvec3();
        (if lit { rho() } else { DVec3::ZERO }, own)
    }
}

/// All sources that walks start from.
struct WalkSources<'a> {
    scene: &'a Scene,
    list: Vec<Source<'a>>,
    /// By emitted power.
    shares: Shares,
    /// Radius of the ball about the middle of the unit frame that holds the scene, unit coordinates.
    radius: f64,
    /// The emitted power of all, channels added, W.
    total: f64,
}

struct Source<'a> {
    origin: Origin<'a>,
    emitter: usize,
    /// Emitted, channels added, W.
    power: f64,
    /// What a walk from here carries.
    weight: DVec3,
}

#[derive(Clone, Copy)]
enum Origin<'a> {
    /// A side of a face.
    Side(u32, Side),
    /// A punctual light.
    Light(&'a PunctualLight),
}

/// The first ray of a walk.
struct FirstRay<'a> {
    pub ray: Ray,
    /// The power it stands for, W; that of unit distance where it depends on that.
    pub weight: DVec3,
    /// Where it comes from a point.
    place: Option<(&'a PunctualPlace, f64)>,
    /// What sends it.
    emitter: usize,
}

impl FirstRay<'_> {
    /// The power that arrives so far away, W, nothing between.
    pub(crate) fn power(&self, distance: f64) -> DVec3 {
        match self.place {
            Some((place, scale)) => self.weight * spread(place, scale, distance),
            None => self.weight,
        }
    }
}

/// `d² / (a0 + a1 d + a2 d²)`, d² in the file's units: 1 for physical attenuation.
fn spread(place: &PunctualPlace, scale: f64, distance: f64) -> f64 {
    (scale * distance).powi(2) / place.weakening(distance)
}

impl<'a> WalkSources<'a> {
    /// The emitting sides of a scene and its punctual lights, with the chance of each in proportion to its power,
    /// channels added.
    pub(crate) fn new(scene: &'a Scene, emitters: &Emitters) -> WalkSources<'a> {
        let far = |radius: f64, v: &Vec3| radius.max(v.as_dvec3().length());
        // The faces that stand for a sky lie beyond the scene.
        let radius = scene.sky.map_or_else(|| scene.vertices.iter().fold(0.0, far), |sky| sky.radius);
        let mut sources = WalkSources { scene, list: Vec::new(), shares: Shares::default(), radius, total: 0.0 };
        for face in 0..scene.faces.len() as u32 {
            let material = scene.material(face);
            let emission = match &material.maps {
                None => material.emitted().invisible.as_dvec3(),
                Some(_) => scene.means(face, scene.corners(face)).emission,
            };
            let sides: &[Side] = if material.sides == Sides::Two { &[Side::Front, Side::Back] } else { &[Side::Front] };
            let unit = scene.frame.in_metres().powi(2);
            let power = PI * unit * scene.emitting_area(face) * emission.element_sum();
            for &side in sides.iter().filter(|_| power > 0.0) {
                let weight = emission / emission.element_sum();
                let (origin, emitter) = (Origin::Side(face, side), emitters.of_face(scene, face));
                sources.list.push(Source { origin, emitter, power, weight });
            }
        }
        for (k, light) in scene.lights.iter().enumerate().filter(|(_, light)| light.shines()) {
            let intensity = light.intensity.as_dvec3();
            let (size, at_unit) = sources.sizes(light);
            let power = size * at_unit * intensity.element_sum();
            let weight = intensity / (intensity.element_sum() * at_unit);
            let (origin, emitter) = (Origin::Light(light), emitters.of_light(k));
            sources.list.push(Source { origin, emitter, power, weight });
        }
        let shares = Shares::of(sources.list.iter().map(|source| source.power));
        sources.total = shares.total();
        sources.shares = shares.normalised();
        sources.list.iter_mut().for_each(|source| source.weight *= sources.total);
        sources
    }

    /// Solid angle that a light shines into, weighted by its cosine to the exponent, and its spread at unit distance;
    /// for parallel light the area of the disc and 1.
    fn sizes(&self, light: &PunctualLight) -> (f64, f64) {
        let scale = self.scene.frame.in_metres();
        let PunctualForm::Point { place, beam } = &light.form else {
            return (PI * (scale * self.radius).powi(2), 1.0);
        };
        let angle = match beam {
            Beam::Even => 2.0 * TAU,
            Beam::Spot { exponent, cutoff, .. } => TAU * (1.0 - cutoff.powf(exponent + 1.0)) / (exponent + 1.0),
            Beam::Measured(photometry) => photometry.power(),
        };
        (angle, spread(place, scale, 1.0))
    }

    /// A ray that leaves a source, and the power it stands for; none where nothing emits.
    pub(crate) fn start(&self, random: &mut Stream) -> Option<FirstRay<'a>> {
        if self.list.is_empty() {
            return None;
        }
        let source = &self.list[self.shares.draw(f64::from(random.uniform())).index];
        let (weight, emitter) = (source.weight, source.emitter);
        let light = match source.origin {
            Origin::Light(light) => light,
            Origin::Side(face, _) if self.scene.is_sky(face) => {
                return Some(FirstRay { ray: self.enter(face, random)?, weight, place: None, emitter });
            }
            Origin::Side(face, side) => {
                let position = triangle_point(self.scene.corners(face), random.uniform(), random.uniform());
                let weight = self.textured(face, position).unwrap_or(source.weight);
                return Some(FirstRay {
                    ray: leave(self.scene, position, face, side, random),
                    weight,
                    place: None,
                    emitter,
                });
            }
        };
        let (u, v) = (f64::from(random.uniform()), f64::from(random.uniform()));
        let ray = |origin: DVec3, direction: DVec3| Ray {
            origin: origin.as_vec3(),
            direction: direction.as_vec3(),
            source: None,
        };
        let scale = self.scene.frame.in_metres();
        let (place, beam) = match &light.form {
            PunctualForm::Point { place, beam } => (place, beam),
            PunctualForm::Directional { direction } => {
                let aside = self.radius * u.sqrt() * around(*direction, 0.0, v);
                let ray = ray(aside - 2.0 * self.radius * *direction, *direction);
                return Some(FirstRay { ray, weight, place: None, emitter });
            }
        };
        let (direction, share) = match beam {
            Beam::Even => (around(DVec3::Z, 1.0 - 2.0 * u, v), 1.0),
            Beam::Spot { direction, exponent, cutoff } => {
                let power = exponent + 1.0;
                let cosine = (1.0 - u * (1.0 - cutoff.powf(power))).powf(1.0 / power);
                (around(*direction, cosine, v), 1.0)
            }
            Beam::Measured(photometry) => {
                let drawn = photometry.draw(u, v);
                (drawn.direction, drawn.weight)
            }
        };
        let ray = ray(place.position, direction);
        Some(FirstRay { ray, weight: weight * share, place: Some((place, scale)), emitter })
    }

    /// What a walk carries from a point of a face with textures, whose points are drawn alike.
    fn textured(&self, face: u32, position: Vec3) -> Option<DVec3> {
        self.scene.maps(face)?;
        let there = f64::from(self.scene.coverage_at(face, position));
        let own = there * self.scene.emitted_at(face, position).invisible.as_dvec3();
        Some(self.total / self.scene.means(face, self.scene.corners(face)).emission.element_sum() * own)
    }

    /// A ray that enters the sphere around the scene from a half of the sky: of uniform direction, through a uniform
    /// point of the sphere's cross-section.
    fn enter(&self, face: u32, random: &mut Stream) -> Option<Ray> {
        let sky = self.scene.sky?;
        let up = if face == sky.first { sky.up } else { -sky.up };
        let outward = hemisphere_direction(up, random.uniform(), random.uniform());
        let aside = cosine_direction(outward, random.uniform(), random.uniform());
        let origin = sky.radius as f32 * (outward + aside - aside.dot(outward) * outward);
        Some(Ray { origin, direction: -outward, source: None })
    }
}

/// The unit vector of this cosine to an axis, turned about it by the share `turn` of a full turn.
fn around(axis: DVec3, cosine: f64, turn: f64) -> DVec3 {
    let (a, b) = axis.any_orthonormal_pair();
    let (sin, cos) = (TAU * turn).sin_cos();
    axis * cosine + (a * cos + b * sin) * (1.0 - cosine * cosine).max(0.0).sqrt()
}

/// A cosine-distributed ray from a point of a side.
fn leave(scene: &Scene, origin: Vec3, face: u32, side: Side, random: &mut Stream) -> Ray {
    let [a, b, c] = scene.exact_corners(face);
    let front = (b - a).cross(c - a).normalize().as_vec3();
    let normal = if side == Side::Front { front } else { -front };
    Ray { origin, direction: cosine_direction(normal, random.uniform(), random.uniform()), source: Some(face) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Mode;

    fn walked(scene: &Scene, transport: Transport) -> WalkedPowers {
        let emitters = Emitters::of(scene);
        let goal = WalkGoal { count: 4, error: 0.01, deadline: None, seed: 3, emitters };
        walked_powers(scene, &Rays::new(scene), transport, &goal)
    }

    /// Every side of a closed cube emits 0.25 and reflects 0.5: the power of KⁿE is pi A 0.25 · 0.5ⁿ, walk by walk.
    #[test]
    fn powers_in_a_furnace_halve_with_every_bounce() {
        let scene = Scene::open("furnace").unwrap();
        let area: f64 = (0..scene.faces.len() as u32).map(|f| scene.area(f)).sum();
        let emitted = std::f64::consts::PI * 0.25 * area * scene.frame.scale.powi(2);
        let powers = walked(&scene, Mode::Global.transport());
        for (n, (term, error)) in powers.terms.iter().zip(&powers.errors).enumerate() {
            let power = emitted * 0.5_f64.powi(n as i32 + 1);
            // All walks carry the same: rounding of f32 reflectances and areas remains.
            assert!((term.visible.x / power - 1.0).abs() < 1e-5, "{n}: {} {power}", term.visible.x);
            assert_eq!(term.visible, term.invisible);
            assert!(*error < 1e-6);
        }
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
        let term = powers.terms[0];
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
        walked(&scene, Transport { alpha: 0.5, tau: 0.5 }).terms[0]
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
