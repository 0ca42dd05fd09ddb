//! Irradiance at points anywhere in a scene, bounce by bounce, each with its estimated error.
//!
//! ```text
//! E(x) = integral over the hemisphere of L_invisible(x, w) cos dw,     L_invisible = sum of KⁿE
//! ```
//!
//! is what a sensor measures: the half that travels. Light on patches is solved for twice, with independent rays.
//! Hemisphere rays read it where they end, and again after one more ray and direct light at their ends
//! ([`Reading::AfterOneMore`]). The second is the result: what patches mix counts a reflection less in it. The
//! difference to the first is the residual of the light on patches as this point sees it, and its error is taken to be
//! as large: it is less by a reflectance at least, where light on patches is off in the same way everywhere.
//!
//! The error of a point has the standard error of its own rays, that residual, the noise of F, and what the series left
//! out. Where the residual or the noise of F of one point in ten exceeds its share of the tolerance, patches become
//! smaller or their rays more.
//!
//! Not handled: patches divided by light, so that light next to small things takes many patches.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::direct::Lights;
use crate::gather::irradiance::{Enough, Irradiance, IrradianceSampler, REPLICAS, STUDENT, variance};
use crate::light::budget::{FORM_FACTORS, PATCHES, left};
use crate::light::{Light, Rgb};
use crate::patches::Patches;
use crate::reading::patch_light::invisible;
use crate::reading::reflection::Memory;
use crate::reading::{Fields, Linear, Reading, View, linear};
use crate::render::assembly::{Assembled, Discretization, without_luminaires};
use crate::render::fineness::Fineness;
use crate::render::goal::{Spent, timed};
use crate::render::memory::{Held, fewer};
use crate::render::search::solved::{Task, TwoSolutions, half_of, patches_for};
use crate::render::sensors::Sensor;
use crate::scene::UnitFrame;
use crate::solve::Diverges;
use crate::surfaces::SurfacePoint;

/// Bounces that are kept apart; the last holds all that follow.
const APART: usize = 16;
/// Points that the error of the light is measured at in each round.
const SOME: usize = 64;
/// Share of those that may exceed it.
const BEYOND: f64 = 0.1;
/// Error of a round over that of the one before, above which smaller patches are of no use.
const HELPED: f64 = 0.8;
/// Times that patches or rays are chosen.
const ROUNDS: usize = 6;
/// Patches, and rays a patch, at most.
const MOST: Fineness = Fineness { patches: 200_000, rays: 1 << 16 };
/// Two solutions, and F transposed.
const HELD: Held = Held { casts: 3, solutions: 2, bounces: None };
/// How far before a surface points on it lie, unit coordinates: rays take faces closer than half of it for one plane.
const BEFORE: f32 = 4e-6;

/// What arrives at a sensor.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SensorLight {
    /// Irradiance per channel, W/m².
    pub irradiance: [f64; 3],
    /// Its standard error, W/m²: of 100 points 95 are within twice that.
    pub error: [f64; 3],
    /// Irradiance by light that was reflected 0, 1, 2, ... times, W/m²; the last holds all that was reflected more.
    pub bounces: Vec<[f64; 3]>,
}

/// Light at sensors, and what it took.
#[derive(Clone, Debug)]
pub struct SensorLights {
    /// In the order of the sensors.
    pub points: Vec<SensorLight>,
    /// Share of the sensors whose error is at most the tolerance.
    pub met: f64,
    /// Patches at last.
    pub patches: usize,
    /// Rays cast in all.
    pub rays: u64,
    /// Seconds of all steps.
    pub seconds: f64,
}

/// Where a sensor is, in unit coordinates.
fn point(sensor: &Sensor, frame: &UnitFrame) -> SurfacePoint {
    let normal = sensor.normal.normalize_or(DVec3::Y).as_vec3();
    let position = frame.to_unit(sensor.position).as_vec3() + BEFORE * normal;
    SurfacePoint { position, normal, face: SurfacePoint::NO_FACE }
}

/// Solved light on patches, as sensors read it.
struct SensorFields {
    /// Bounces, then half the difference of two scramblings.
    at_once: Fields,
    /// All bounces in one, read after one more ray.
    after: Fields,
    count: usize,
}

impl SensorFields {
    fn new(two: &TwoSolutions, patches: &Patches) -> SensorFields {
        let neighbours = patches.neighbours();
        let [first, second] = &two.modes;
        let count = two.solutions.iter().map(|s| s.terms.len()).max().unwrap_or(1).min(APART);
        // Bounce n of one solution; the last with all that follow.
        let bounce = |terms: &[Vec<Light>], n: usize| -> Vec<Rgb> {
            let own = if n + 1 == count { n..terms.len().max(n) } else { n..(n + 1).min(terms.len()) };
            let mut sum = vec![Rgb::ZERO; patches.len()];
            for m in own {
                let term = if m == 0 { without_luminaires(&first.lights, &terms[0]) } else { invisible(&terms[m]) };
                sum.iter_mut().zip(term).for_each(|(sum, l)| *sum += l);
            }
            sum
        };
        let each = |k: usize| -> Vec<Vec<Linear>> {
            let terms = &two.solutions[k].terms;
            (0..count).map(|n| linear(&neighbours, &bounce(terms, n))).collect()
        };
        let [a, b] = [each(0), each(1)];
        let mix = |x: &[Linear], y: &[Linear], u: f32, v: f32| -> Vec<Linear> {
            x.iter().zip(y).map(|(x, y)| x.mix(u, y, v)).collect()
        };
        let sum = |bounces: &[Vec<Linear>]| -> Vec<Linear> {
            bounces.iter().skip(1).fold(bounces[0].clone(), |sum, next| mix(&sum, next, 1.0, 1.0))
        };
        let mut fields: Vec<Vec<Linear>> = a.iter().zip(&b).map(|(a, b)| mix(a, b, 0.5, 0.5)).collect();
        let total = sum(&fields);
        let [all_a, all_b] = [sum(&a), sum(&b)];
        fields.push(mix(&all_a, &all_b, 0.5, -0.5));
        let direct = [first, second].map(Assembled::direct);
        let after = Fields::linear(&[total]).with_rest(direct, patches).read_by(Reading::AfterOneMore);
        SensorFields { at_once: Fields::linear(&fields).with_picture_fields(count), after, count }
    }
}

/// Light at sensors on one set of patches.
struct SensorRound<'a> {
    at_once: IrradianceSampler<'a>,
    after: IrradianceSampler<'a>,
    points: &'a [SurfacePoint],
    /// Number of bounces.
    count: usize,
}

/// What one sensor gets, over pi.
struct Sensed {
    at_once: Irradiance,
    after: Irradiance,
}

impl Sensed {
    /// The square of what one more ray changes, channel by channel, less what noise adds to it.
    fn squared_change(&self) -> DVec3 {
        let change = |j: usize| self.after.replicas[j] - self.at_once.replicas[j];
        let changes: [DVec3; REPLICAS] = std::array::from_fn(change);
        let mean = changes.iter().sum::<DVec3>() / REPLICAS as f64;
        (mean * mean - variance(&changes)).max(DVec3::ZERO)
    }
}

impl<'a> SensorRound<'a> {
    fn new(view: &'a View, fields: &'a SensorFields, points: &'a [SurfacePoint], seed: u32) -> SensorRound<'a> {
        let [at_once, after] = [&fields.at_once, &fields.after].map(|f| IrradianceSampler::new(view, f, seed));
        SensorRound { at_once, after, points, count: fields.count }
    }

    /// Sensor k to a relative standard error of its rays; both readings from the same rays.
    fn sense(&self, k: usize, tolerance: f64, memory: &mut Memory) -> Sensed {
        let point = &self.points[k];
        let after = self.after.at(k as u32, point, Enough::Within(tolerance), memory);
        let at_once = self.at_once.at(k as u32, point, Enough::Like(after.effort), memory);
        Sensed { at_once, after }
    }

    /// Errors of the light on patches at some of the points, relative to all light there, as all but one in ten have
    /// them: the residual, and the noise of F; and the rays cast.
    fn light_error(&self, tolerance: f64) -> ([f64; 2], u64) {
        let step = self.points.len().div_ceil(SOME).max(1);
        let chosen: Vec<usize> = (0..self.points.len()).step_by(step).collect();
        // Noise of rays is a quarter of what the square of the residual may be.
        let one = |memory: &mut Memory, &k: &usize| self.sense(k, 0.5 * PATCHES * tolerance, memory);
        let found: Vec<Sensed> = chosen.par_iter().map_init(Memory::default, one).collect();
        let rays = found.iter().map(|s| s.at_once.rays + s.after.rays).sum();
        let beyond = |of: &dyn Fn(&Sensed) -> f64| {
            let lit = found.iter().filter(|s| s.after.total != DVec3::ZERO);
            let mut shares: Vec<f64> = lit.map(|s| of(s) / s.after.total.length_squared()).collect();
            shares.sort_by(f64::total_cmp);
            let last = ((1.0 - BEYOND) * shares.len() as f64) as usize;
            shares.get(last.min(shares.len().saturating_sub(1))).map_or(0.0, |share| share.max(0.0).sqrt())
        };
        let noise = |s: &Sensed| s.at_once.fields[self.count].length_squared();
        ([beyond(&|s| s.squared_change().element_sum()), beyond(&noise)], rays)
    }

    /// What arrives at every point, given errors of the light of most; and the rays cast.
    fn gather(&self, tolerance: f64, [residual, noise]: [f64; 2], truncation: f64) -> (Vec<SensorLight>, u64) {
        let own = left(tolerance, residual * residual + noise * noise);
        let one = |memory: &mut Memory, k: usize| {
            let found = self.sense(k, own, memory);
            (self.light(&found, truncation), found.at_once.rays + found.after.rays)
        };
        let found = (0..self.points.len()).into_par_iter().map_init(Memory::default, one);
        let (lights, rays): (Vec<_>, Vec<u64>) = found.unzip();
        (lights, rays.into_iter().sum())
    }

    /// Irradiance, its error and its bounces: those that reflect as they are read at once, scaled to what all are after
    /// one more ray.
    fn light(&self, found: &Sensed, truncation: f64) -> SensorLight {
        let Sensed { at_once, after } = found;
        let bounces = &at_once.fields[..self.count];
        let [once, more] = [at_once, after].map(|s| s.total - s.direct);
        let scale = DVec3::from([0, 1, 2].map(|c| if once[c] > 0.0 { (more[c] / once[c]).max(0.0) } else { 0.0 }));
        let noise = at_once.fields[self.count];
        let squared = STUDENT * STUDENT * after.variance
            + found.squared_change()
            + noise.powf(2.0)
            + (truncation * more).powf(2.0);
        let watts = |light: DVec3| (PI * light).to_array();
        let mut bounces: Vec<[f64; 3]> = bounces.iter().map(|bounce| watts(scale * *bounce)).collect();
        bounces[0] = watts(scale * at_once.fields[0] + after.direct);
        SensorLight { irradiance: watts(after.total.max(DVec3::ZERO)), error: watts(squared.powf(0.5)), bounces }
    }
}

/// Light at sensors to a relative error of each, beginning with the patches of `first`.
///
/// # Errors
/// [`Diverges`] where the series does.
pub(crate) fn sense(first: &Discretization, task: &Task, sensors: &[Sensor]) -> Result<SensorLights, Diverges> {
    let goal = task.goal;
    let frame = first.geometry.scene.frame;
    let points: Vec<SurfacePoint> = sensors.iter().map(|sensor| point(sensor, &frame)).collect();
    let transports = first.transports(task.transport);
    let (mut patches, mut rays, mut spent) = (first.clone(), Fineness::first(goal.tolerance).rays, Spent::default());
    // Of the round before, over its share.
    let mut before = f64::INFINITY;
    for round in 1.. {
        let held = fewer(&patches, task.transport, &half_of(rays, goal.seed, 0), HELD, goal.memory);
        let is_full = held.is_some();
        patches = held.unwrap_or(patches);
        let (two, own) = TwoSolutions::new(&patches, task, rays)?;
        spent.add(&own);
        let (fields, seconds) = timed(|| SensorFields::new(&two, &patches.patches));
        spent.seconds.solve += seconds;
        let lights = Lights::by_rays(&patches.geometry, &patches.patches, &patches.luminaires, transports.clone());
        let view = View::new(&lights, (1, 1).into());
        let own = SensorRound::new(&view, &fields, &points, goal.seed);
        let ((error, cast), seconds) = timed(|| own.light_error(goal.tolerance));
        spent.rays += cast;
        spent.seconds.gather += seconds;
        let [size, noise] = [error[0] / (PATCHES * goal.tolerance), error[1] / (FORM_FACTORS * goal.tolerance)];
        let count = patches.patches.len();
        let can_divide = count < MOST.patches && !is_full && size < HELPED * before;
        let is_last = round == ROUNDS || goal.is_late();
        if !is_last && (size > 1.0 && can_divide || noise > 1.0 && rays < MOST.rays) {
            let more = if can_divide { patches_for(1.1 * size).clamp(1.0, 4.0) } else { 1.0 };
            let denser = (1.2 * noise * noise / more).clamp(1.0, 16.0);
            rays = ((f64::from(rays) * denser) as u32).min(MOST.rays);
            if more > 1.0 {
                before = size;
                patches = patches.cut(((count as f64 * more) as usize).min(MOST.patches));
            }
            continue;
        }
        let ((found, cast), seconds) = timed(|| own.gather(goal.tolerance, error, two.truncation()));
        spent.rays += cast;
        spent.seconds.gather += seconds;
        spent.seconds.sum();
        let length = |v: &[f64; 3]| Vec3::from(v.map(|x| x as f32)).length();
        let is_met = |light: &&SensorLight| length(&light.error) <= goal.tolerance as f32 * length(&light.irradiance);
        let met = found.iter().filter(is_met).count() as f64 / found.len().max(1) as f64;
        return Ok(SensorLights { points: found, met, patches: count, rays: spent.rays, seconds: spent.seconds.total });
    }
    unreachable!("the number of rounds is bounded")
}
