//! Irradiance at points anywhere in a scene, bounce by bounce and emitter by emitter, each with its estimated error.
//!
//! ```text
//! E(x) = integral over the hemisphere of L_invisible(x, w) cos dw,     L_invisible = sum of KⁿE
//! ```
//!
//! is what a sensor measures: the half that travels. Hemisphere rays read the light on patches after one more ray and
//! direct light at their ends, most of them by way of a control variate ([`crate::gather::irradiance`]); at points
//! where that changes more than the tolerance allows, after two, three or four. What the last of them changes is stated
//! for the error of the light on patches, and what is left of one that is alike everywhere is measured by long paths,
//! taken off and stated ([`crate::render::pooled_error`]). So a point is as accurate as requested on patches of any
//! size, and smaller ones only save rays: they are cut as long as their form factors cost less than they may save.
//!
//! Bounces and emitters are read at once and scaled to what all light is together, so each set adds up to it.
//!
//! Not handled: sensors that see less than a hemisphere; patches divided by light; errors of single bounces and
//! emitters.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec3;
use halflight_team::Loop;
use rayon::prelude::*;

use crate::gather::irradiance::{Asked, Irradiance, IrradianceSampler};
use crate::gather::records::final_gather::FinalGather;
use crate::light::budget::{STAND_INS, TRUNCATION};
use crate::patches::Spot;
use crate::rays::Ray;
use crate::rays::sobol::Sobol;
use crate::rays::warp::hemisphere_direction;
use crate::reading::patch_light::to_whole;
use crate::reading::reflection::Memory;
use crate::reading::{Fields, View, linear};
use crate::render::assembly::{Assembled, Discretization, assemble};
use crate::render::fineness::Fineness;
use crate::render::goal::{Spent, timed};
use crate::render::layers::{Apart, LayerLight, with_layers};
use crate::render::memory::Held;
use crate::render::narrow_light::NarrowLight;
use crate::render::pilot::fewer;
use crate::render::pooled_error::{PooledError, PooledPoint};
use crate::render::search::solved::Task;
use crate::scene::UnitFrame;
use crate::solve::{Diverges, Settings, Solution, neumann};
use crate::surfaces::SurfacePoint;

/// Points that are tried on each set of patches.
const SOME: usize = 64;
/// Rays that follow one at most before it reads.
const DEEPEST: usize = 4;
/// How many times as many patches the next set has.
const MORE: usize = 4;
/// Share of the rays of points that go deeper than one more ray which smaller patches are taken to save.
const SAVED: f64 = 0.25;
/// Patches at most.
const MOST: usize = 200_000;
/// One cast, and its solution.
const HELD: Held = Held { casts: 1, solutions: 1, bounces: None };
/// How far before a surface points on it lie, unit coordinates: rays take faces closer than half of it for one plane.
const BEFORE: f32 = 4e-6;
/// Narrow light that patches miss is spread over them where all points are so many of their widths away: nearer ones
/// would see where it is, and rays that go on find it.
const FAR: f32 = 2.0;
/// Rays, half of them to either side, that show whether a point is inside of something.
const ROUND: u32 = 64;

/// A place and a direction to measure light at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Where, in the file's units.
    pub position: DVec3,
    /// The middle of the directions that light is measured from; of any length but 0.
    pub normal: DVec3,
}

/// What arrives at a sensor.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SensorLight {
    /// Irradiance per channel, W/m².
    pub irradiance: [f64; 3],
    /// Its standard error, W/m²: of 100 points 95 are within twice that.
    pub error: [f64; 3],
    /// Irradiance by light that was reflected 0, 1, 2, ... times, W/m²; the last holds all that was reflected more.
    pub bounces: Vec<[f64; 3]>,
    /// Irradiance by the light of each emitter, W/m²; none where the solver does not keep them
    /// [apart](crate::Solver::apart).
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub luminaires: BTreeMap<String, [f64; 3]>,
    /// Whether the sensor is inside of a solid: most of what it sees are the backs of faces.
    pub is_inside: bool,
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
    /// All light; then emitter by emitter, and bounce by bounce.
    at_once: Fields,
    /// All light, read after 1, 2, ... more rays.
    onward: Vec<Fields>,
}

impl SensorFields {
    fn new(mode: &Assembled, solution: &Solution, apart: Apart) -> SensorFields {
        let total = Fields::linear(&[linear(&mode.patches().neighbours(), &mode.reflected(&solution.terms))]);
        let onward = (1..=DEEPEST).map(|depth| total.clone().recording(depth)).collect();
        let layers = LayerLight::new(mode, solution, Apart { bounces: true, ..apart });
        SensorFields { at_once: with_layers(total, mode, &[layers]).0, onward }
    }
}

/// Light at sensors on one set of patches.
struct SensorRound<'a> {
    /// By how many more rays there are before they read.
    samplers: Vec<IrradianceSampler<'a>>,
    points: &'a [SurfacePoint],
    /// Emitters that are kept apart.
    names: &'a [String],
    asked: Asked,
    /// What is left of the error of light on patches, once it is known.
    pooled: PooledError,
}

/// What the points of a round get, and the rays cast.
struct Sensed {
    found: Vec<(Irradiance, usize)>,
    rays: u64,
}

/// What some points of a round get.
struct Trial {
    /// Those that see light.
    pooled: Vec<PooledPoint>,
    /// The rays that all points would take, and those of points that need more than one more ray.
    of_all: [f64; 2],
    /// Rays cast.
    rays: u64,
}

impl SensorRound<'_> {
    /// What arrives at point k, after as few more rays as do, and the rays cast for it.
    fn sense(&self, k: usize, memory: &mut Memory) -> (Irradiance, usize) {
        let mut rays = 0;
        for (depth, sampler) in self.samplers.iter().enumerate() {
            let [_, variance, own] = self.pooled.after(depth + 1);
            let asked = Asked {
                may_go_deeper: depth + 1 < self.samplers.len(),
                of_reflected: self.asked.of_reflected + variance,
                of_all: own,
                ..self.asked
            };
            let found = sampler.at(k as u32, &self.points[k], &asked, memory);
            rays += found.rays;
            if !(found.is_coarse && asked.may_go_deeper) {
                return (Irradiance { rays, ..found }, depth);
            }
        }
        unreachable!("the last may not go deeper")
    }

    fn sense_all(&self, points: &[usize]) -> Sensed {
        let found = Loop::each(points.len()).map_init(Memory::default, |memory, k| self.sense(points[k], memory));
        let rays = found.iter().map(|(found, _)| found.rays).sum();
        Sensed { found, rays }
    }

    /// The points that are tried, of which there is one in so many.
    fn some(&self) -> (usize, Vec<usize>) {
        let step = self.points.len().div_ceil(SOME).max(1);
        (step, (0..self.points.len()).step_by(step).collect())
    }

    /// What some of the points get.
    fn try_some(&self) -> Trial {
        let (step, chosen) = self.some();
        let Sensed { found, rays } = self.sense_all(&chosen);
        let deeper: u64 = found.iter().filter(|(_, depth)| *depth > 0).map(|(found, _)| found.rays).sum();
        let pooled = chosen.iter().zip(&found).filter_map(|(&k, (found, _))| {
            let direct: DVec3 = found.direct.iter().sum();
            let is_lit = found.total.length() > self.asked.dark;
            let (point, total) = (self.points[k], found.total);
            is_lit.then(|| PooledPoint { number: k as u32, point, total, reflected: total - direct })
        });
        let of_all = [rays, deeper].map(|rays| (rays * step as u64) as f64);
        Trial { pooled: pooled.collect(), of_all, rays }
    }

    /// The light at all points, and the rays cast.
    fn lights(&self, view: &View) -> (Vec<SensorLight>, u64) {
        let Sensed { found, rays } = self.sense_all(&(0..self.points.len()).collect::<Vec<_>>());
        let sobol = Sobol::new(ROUND as usize, 2);
        let all = found.par_iter().zip(self.points);
        (all.map(|(found, point)| self.light(found, is_inside(view, &sobol, point))).collect(), rays)
    }

    fn light(&self, (found, depth): &(Irradiance, usize), is_inside: bool) -> SensorLight {
        let watts = |light: DVec3| (PI * light).to_array();
        let direct: DVec3 = found.direct.iter().sum();
        let [missing, ..] = self.pooled.after(depth + 1);
        let total = (found.total + missing * (found.total - direct)).max(direct);
        let (emitters, bounces) = found.fields.split_at(self.names.len());
        let mut emitters = scaled(emitters, total - direct);
        let mut bounces = scaled(bounces, total - direct);
        emitters.iter_mut().zip(&found.direct).for_each(|(own, direct)| *own += direct);
        if let Some(first) = bounces.first_mut() {
            *first += direct;
        }
        SensorLight {
            irradiance: watts(total),
            error: watts(found.squared_error.powf(0.5)),
            bounces: bounces.into_iter().map(watts).collect(),
            luminaires: self.names.iter().cloned().zip(emitters.into_iter().map(watts)).collect(),
            is_inside,
        }
    }
}

/// Parts of light, none below 0, scaled to add up to all of it.
fn scaled(parts: &[DVec3], total: DVec3) -> Vec<DVec3> {
    let own = || parts.iter().map(|part| part.max(DVec3::ZERO));
    let (scale, rest) = to_whole(own(), total);
    own().map(|part| scale * part + rest).collect()
}

/// Whether a point is inside of something: more than half of what it sees all around are backs of faces that send no
/// light.
fn is_inside(view: &View, sobol: &Sobol, point: &SurfacePoint) -> bool {
    let is_back = |k: &u32| {
        let side = if k.is_multiple_of(2) { point.normal } else { -point.normal };
        let direction = hemisphere_direction(side, sobol.point(k / 2, 0, 0), sobol.point(k / 2, 1, 0));
        let ray = Ray { origin: point.position, direction, source: None };
        let hit = view.rays.closest(&ray);
        hit.is_some_and(|hit| view.patches.at(hit.face, hit.side, ray.at(hit.t)).is_none())
    };
    (0..ROUND).filter(is_back).count() > ROUND as usize / 2
}

/// What is asked of every point where the series left out so much of the reflected light.
fn asked(tolerance: f64, truncation: f64, dark: f64) -> Asked {
    let of_reflected = DVec3::splat(truncation * truncation);
    Asked { tolerance, of_reflected, of_all: DVec3::ZERO, dark, may_go_deeper: true }
}

/// K of a mode, solved; and what that took.
fn solve(p: &Discretization, task: &Task, rays: u32) -> Result<(Assembled, Solution, Spent), Diverges> {
    let mut spent = Spent::default();
    let sampling = Fineness { patches: 0, rays }.sampling(task.goal.seed);
    let cast = || {
        let lights = p.lights(p.transports(task.transport), STAND_INS * task.goal.tolerance);
        assemble(&[(task.transport, lights)], &*p.rows, &sampling, task.watch)
    };
    let ((mut modes, rays), seconds) = timed(cast);
    (spent.seconds.form_factors, spent.rays) = (seconds, rays);
    let mode = modes.remove(0);
    let settings = Settings { tolerance: TRUNCATION * task.goal.tolerance, ..Settings::default() };
    let (solution, seconds) = timed(|| neumann(&mode.operator, &settings));
    spent.seconds.solve = seconds;
    Ok((mode, solution?, spent))
}

/// Light at sensors to a relative error of each, beginning with the patches of `first`.
///
/// # Errors
/// [`Diverges`] where the series does.
pub(crate) fn sense(first: &Discretization, task: &Task, sensors: &[Sensor]) -> Result<SensorLights, Diverges> {
    let goal = task.goal;
    let frame = first.geometry.scene.frame;
    let points: Vec<SurfacePoint> = sensors.iter().map(|sensor| point(sensor, &frame)).collect();
    let rays = Fineness::first(goal.tolerance).rays;
    let sampling = Fineness { patches: 0, rays }.sampling(goal.seed);
    let (mut patches, mut spent, mut narrow) = (first.clone(), Spent::default(), NarrowLight::default());
    loop {
        let held = fewer(&patches, task.transport, &sampling, HELD, goal.memory);
        let is_full = held.is_some();
        patches = held.unwrap_or(patches);
        let (mode, solution, own) = solve(&patches, task, rays)?;
        spent.add(&own);
        let is_far = |spot: &Spot, width: f32| {
            let middle = 0.5 * (spot.low + spot.high);
            points.iter().all(|point| point.position.distance(middle) >= FAR * width)
        };
        if let Some(mended) = narrow.mend((&patches, &mode), goal, is_far, &mut spent) {
            patches = mended;
            continue;
        }
        let (fields, seconds) = timed(|| SensorFields::new(&mode, &solution, task.apart));
        spent.seconds.solve += seconds;
        let lights = &mode.lights;
        let view = View::new(lights, goal.size);
        let sampler = |onward| IrradianceSampler::new(&view, (&fields.at_once, onward), goal.seed);
        let dark = f64::from(f32::EPSILON) * FinalGather::new(&view, &fields.at_once).brightest();
        let round = SensorRound {
            samplers: fields.onward.iter().map(sampler).collect(),
            points: &points,
            names: if task.apart.emitters { lights.emitters().names() } else { &[] },
            asked: asked(goal.tolerance, solution.truncation(), dark),
            pooled: PooledError::default(),
        };
        let count = patches.patches.len();
        let (trial, seconds) = timed(|| round.try_some());
        spent.rays += trial.rays;
        spent.seconds.gather += seconds;
        let can_divide = !is_full && MORE * count <= MOST && points.len() > SOME;
        if can_divide && SAVED * trial.of_all[1] > (MORE as u64 * own.rays) as f64 {
            patches = patches.cut(MORE * count);
            continue;
        }
        let measure =
            || PooledError::new(&view, &fields.onward[0], &trial.pooled, DEEPEST, (goal.tolerance, goal.seed));
        let (pooled, seconds) = timed(measure);
        spent.rays += pooled.rays;
        let round = SensorRound { pooled, ..round };
        spent.seconds.solve += seconds;
        let ((lights, cast), seconds) = timed(|| round.lights(&view));
        spent.rays += cast;
        spent.seconds.gather += seconds;
        spent.seconds.sum();
        return Ok(SensorLights {
            met: met(&lights, goal.tolerance, PI * dark),
            points: lights,
            patches: count,
            rays: spent.rays,
            seconds: spent.seconds.total,
        });
    }
}

/// Share of the points whose error is at most the tolerance, or as small as `dark`, which is no light.
fn met(points: &[SensorLight], tolerance: f64, dark: f64) -> f64 {
    let length = |channels: [f64; 3]| DVec3::from(channels).length();
    let allowed = |light: &SensorLight| (tolerance * length(light.irradiance)).max(dark);
    let is_met = |light: &&SensorLight| length(light.error) <= (1.0 + 1e-9) * allowed(light);
    points.iter().filter(is_met).count() as f64 / points.len().max(1) as f64
}
