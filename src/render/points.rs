//! Irradiance at points anywhere in a scene, bounce by bounce, each with its estimated error.
//!
//! ```text
//! E(x) = integral over the hemisphere of L_invisible(x, w) cos dw,     L_invisible = sum of KⁿE
//! ```
//!
//! is what a sensor measures: the half that travels. Light on patches is solved for twice, with independent rays, and
//! on larger patches; hemisphere rays at each point read all of it at once. The relative error of a point has the
//! standard error of its own rays; the noise of F and the size of patches as they show at this point, or at all points
//! in the RMS where that is more; and what the series left out. Where the last three exceed their shares of the
//! tolerance, patches become smaller or their rays more.
//!
//! The size of patches counts as the larger of what two levels of them say and of the residual: what one more ray and
//! direct light at its end change ([`Reading::AfterOneMore`]), as measured at some of the points.
//!
//! Not handled: patches divided by light, so that light next to small things takes many patches; light from under the
//! surface that a point lies on.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::direct::Lights;
use crate::error::halves::Halves;
use crate::gather::irradiance::{Irradiance, IrradianceSampler, REPLICAS, STUDENT};
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
use crate::render::search::solved::{Task, TwoSolutions, half_of, larger, of_finer, patches_for};
use crate::render::sensors::Sensor;
use crate::scene::UnitFrame;
use crate::solve::Diverges;
use crate::surfaces::SurfacePoint;

/// Bounces that are kept apart; the last holds all that follow.
const APART: usize = 16;
/// Points that the error of the light is measured at.
const SOME: usize = 64;
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

/// Errors of the light on patches, as shares of the irradiance, RMS over points.
#[derive(Clone, Copy, Debug, Default)]
struct LightError {
    /// Noise of F.
    noise: f64,
    /// Size of patches.
    size: f64,
}

/// Solved light on patches, as sensors read it.
struct SensorFields {
    /// Bounces, then half the difference of two scramblings, then the difference to larger patches.
    bounces: Fields,
    /// All bounces in one, read after one more ray.
    residual: Fields,
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
        let coarse = larger(patches, &neighbours, &first.reflected(&two.coarse));
        fields.push(mix(&all_a, &all_b, 0.5, -0.5));
        fields.push(mix(&all_a, &coarse, 1.0, -1.0));
        let direct = [first, second].map(Assembled::direct);
        let residual = Fields::linear(&[total]).with_rest(direct, patches).read_by(Reading::AfterOneMore);
        SensorFields { bounces: Fields::linear(&fields).with_picture_fields(count), residual, count }
    }
}

/// Light at sensors on one set of patches.
struct SensorRound<'a> {
    view: View<'a>,
    fields: &'a SensorFields,
    points: &'a [SurfacePoint],
    seed: u32,
}

impl SensorRound<'_> {
    /// The error of the light on patches, as some of the points see it; and the rays cast.
    fn light_error(&self, tolerance: f64) -> (LightError, u64) {
        let step = self.points.len().div_ceil(SOME);
        let chosen: Vec<usize> = (0..self.points.len()).step_by(step.max(1)).collect();
        // Of the mean square of n differences noise leaves so much that it is a quarter of what may be.
        let noise = 0.5 * PATCHES * tolerance * (chosen.len() as f64).powf(0.25);
        let at_once = IrradianceSampler::new(&self.view, &self.fields.bounces, self.seed);
        let after = IrradianceSampler::new(&self.view, &self.fields.residual, self.seed);
        let one = |memory: &mut Memory, &k: &usize| {
            // The same rays, so that only what is read at their ends differs.
            let own = at_once.at(k as u32, &self.points[k], noise, memory);
            let more = after.at(k as u32, &self.points[k], noise, memory);
            let half = |estimate: &Irradiance, half: usize| {
                let own = &estimate.replicas[half * REPLICAS / 2..(half + 1) * REPLICAS / 2];
                own.iter().sum::<DVec3>() / own.len() as f64
            };
            let halves = |estimate: &Irradiance| Halves(half(estimate, 0), half(estimate, 1));
            let residual = halves(&more).less(halves(&own)).squared();
            (own, residual, more.rays)
        };
        let found: Vec<_> = chosen.par_iter().map_init(Memory::default, one).collect();
        let signal: f64 = found.iter().map(|(own, ..)| own.total.length_squared()).sum();
        if signal == 0.0 {
            return (LightError::default(), 0);
        }
        let share = |f: usize| {
            let squares = found.iter().map(|(own, ..)| own.fields[self.fields.count + f].length_squared());
            (squares.sum::<f64>() / signal).sqrt()
        };
        let count = found.len() as f64;
        let mean = found.iter().map(|f| f.1).sum::<f64>() / count;
        let spread: f64 = found.iter().map(|f| (f.1 - mean).powi(2)).sum::<f64>();
        let deviation = (spread / (count * (count - 1.0).max(1.0))).sqrt();
        let residual = ((mean.max(0.0) + deviation) * count / signal).sqrt();
        let rays = found.iter().map(|(own, _, more)| own.rays + more).sum();
        (LightError { noise: share(0), size: residual.max(of_finer() * share(1)) }, rays)
    }

    /// What arrives at every point, next to an error of the light; and the rays cast.
    fn gather(&self, tolerance: f64, light: LightError, truncation: f64) -> (Vec<SensorLight>, u64) {
        let sampler = IrradianceSampler::new(&self.view, &self.fields.bounces, self.seed);
        let own = left(tolerance, light.noise.powi(2) + light.size.powi(2));
        let pi = std::f64::consts::PI;
        let one = |memory: &mut Memory, (k, point): (usize, &SurfacePoint)| {
            let found = sampler.at(k as u32, point, own, memory);
            let count = self.fields.count;
            let [noise, coarse] = [0, 1].map(|f| found.fields[count + f].abs());
            let squared = STUDENT * STUDENT * found.variance
                + noise.max(light.noise * found.total).powf(2.0)
                + (of_finer() * coarse).max(light.size * found.total).powf(2.0)
                + (truncation * found.total).powf(2.0);
            let mut bounces: Vec<[f64; 3]> = found.fields[..count].iter().map(|f| (pi * *f).to_array()).collect();
            bounces[0] = (pi * (found.fields[0] + found.direct)).to_array();
            let irradiance = (pi * found.total).to_array();
            (SensorLight { irradiance, error: (pi * squared.powf(0.5)).to_array(), bounces }, found.rays)
        };
        let found = self.points.par_iter().enumerate().map_init(Memory::default, one);
        let (lights, rays): (Vec<_>, Vec<u64>) = found.unzip();
        (lights, rays.into_iter().sum())
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
        let own = SensorRound { view, fields: &fields, points: &points, seed: goal.seed };
        let ((error, cast), seconds) = timed(|| own.light_error(goal.tolerance));
        spent.rays += cast;
        spent.seconds.gather += seconds;
        let noise = error.noise / (FORM_FACTORS * goal.tolerance);
        let size = error.size / (PATCHES * goal.tolerance);
        let count = patches.patches.len();
        let can_divide = count < MOST.patches && !is_full;
        let is_last = round == ROUNDS || goal.is_late();
        if !is_last && (size > 1.0 && can_divide || noise > 1.0 && rays < MOST.rays) {
            let more = if can_divide { patches_for(1.1 * size).clamp(1.0, 4.0) } else { 1.0 };
            let denser = (1.2 * noise * noise / more).clamp(1.0, 16.0);
            rays = ((f64::from(rays) * denser) as u32).min(MOST.rays);
            if more > 1.0 {
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
