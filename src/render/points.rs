//! Irradiance at points anywhere in a scene, bounce by bounce and emitter by emitter, each with its estimated error.
//!
//! ```text
//! E(x) = integral over the hemisphere of L_invisible(x, w) cos dw,     L_invisible = sum of KⁿE
//! ```
//!
//! is what a sensor measures: the half that travels. Hemisphere rays read the light on patches, paths find what is
//! wrong with it ([`crate::gather::irradiance`]), so that a point is as accurate as requested on patches of any size,
//! and its error is noise alone. Patches that are better save paths.
//!
//! Bounces and emitters are read at once and scaled to what all light is together, so each set adds up to it.
//!
//! Not handled: sensors that see less than a hemisphere; errors of single bounces and emitters.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec3;
use halflight_team::Loop;
use rayon::prelude::*;

use crate::gather::irradiance::{Asked, Irradiance, IrradianceSampler};
use crate::gather::records::final_gather::FinalGather;
use crate::light::budget::{STAND_INS, TRUNCATION};
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
use crate::render::search::solved::Task;
use crate::scene::UnitFrame;
use crate::solve::{Diverges, Settings, Solution, neumann};
use crate::surfaces::SurfacePoint;

/// One cast, and its solution.
const HELD: Held = Held { casts: 1, solutions: 1, bounces: None };
/// How far before a surface points on it lie, unit coordinates: rays take faces closer than half of it for one plane.
const BEFORE: f32 = 4e-6;
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

/// Light at sensors.
struct Sensing<'a> {
    sampler: IrradianceSampler<'a>,
    points: &'a [SurfacePoint],
    /// Emitters that are kept apart.
    names: &'a [String],
    asked: Asked,
}

impl Sensing<'_> {
    /// The light at all points, and the rays cast.
    fn lights(&self, view: &View) -> (Vec<SensorLight>, u64) {
        let sense = |memory: &mut Memory, k: usize| self.sampler.at(k as u32, &self.points[k], &self.asked, memory);
        let found = Loop::each(self.points.len()).map_init(Memory::default, sense);
        let rays = found.iter().map(|found| found.rays).sum();
        let sobol = Sobol::new(ROUND as usize, 2);
        let all = found.par_iter().zip(self.points);
        (all.map(|(found, point)| self.light(found, is_inside(view, &sobol, point))).collect(), rays)
    }

    fn light(&self, found: &Irradiance, is_inside: bool) -> SensorLight {
        let watts = |light: DVec3| (PI * light).to_array();
        let direct: DVec3 = found.direct.iter().sum();
        let total = found.total.max(direct);
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

/// Light on patches as points read it: of everything, then emitter by emitter and bounce by bounce.
fn fields(mode: &Assembled, solution: &Solution, apart: Apart) -> Fields {
    let total = Fields::linear(&[linear(&mode.patches().neighbours(), &mode.reflected(&solution.terms))]);
    let layers = LayerLight::new(mode, solution, Apart { bounces: true, ..apart });
    with_layers(total, mode, &[layers]).0.without_strata(mode.patches())
}

/// Light at sensors to a relative error of each, on patches as those of `first`.
///
/// # Errors
/// [`Diverges`] where the series does.
pub(crate) fn sense(first: &Discretization, task: &Task, sensors: &[Sensor]) -> Result<SensorLights, Diverges> {
    let goal = task.goal;
    let frame = first.geometry.scene.frame;
    let points: Vec<SurfacePoint> = sensors.iter().map(|sensor| point(sensor, &frame)).collect();
    let mut spent = Spent::default();
    let (mode, solution) = solved(first, task, &mut spent)?;
    let (fields, seconds) = timed(|| fields(&mode, &solution, task.apart));
    spent.seconds.solve += seconds;
    let view = View::new(&mode.lights, goal.size);
    let asked = Asked { tolerance: goal.tolerance, brightest: FinalGather::new(&view, &fields).brightest() };
    let sensing = Sensing {
        sampler: IrradianceSampler::new(&view, &fields, goal.seed),
        points: &points,
        names: if task.apart.emitters { mode.lights.emitters().names() } else { &[] },
        asked,
    };
    let ((lights, cast), seconds) = timed(|| sensing.lights(&view));
    spent.rays += cast;
    spent.seconds.gather += seconds;
    spent.seconds.sum();
    Ok(SensorLights {
        met: met(&lights, &asked),
        points: lights,
        patches: mode.patches().len(),
        rays: spent.rays,
        seconds: spent.seconds.total,
    })
}

/// Light on as many patches as memory allows, with spots of narrow light.
fn solved(first: &Discretization, task: &Task, spent: &mut Spent) -> Result<(Assembled, Solution), Diverges> {
    let goal = task.goal;
    let rays = Fineness::first(goal.tolerance).rays;
    let sampling = Fineness { patches: 0, rays }.sampling(goal.seed);
    let fewer = fewer(first, task.transport, &sampling, HELD, goal.memory);
    let (mut patches, mut narrow) = (fewer.unwrap_or_else(|| first.clone()), NarrowLight::default());
    loop {
        let (mode, solution, own) = solve(&patches, task, rays)?;
        spent.add(&own);
        match narrow.mend(&patches, &mode, goal, spent) {
            Some(mended) => patches = mended,
            None => return Ok((mode, solution)),
        }
    }
}

/// Share of the points whose error is at most the tolerance, or as small as light that is none, or to which no ray
/// brought light.
fn met(points: &[SensorLight], asked: &Asked) -> f64 {
    let length = |channels: [f64; 3]| DVec3::from(channels).length();
    let is_met = |light: &&SensorLight| {
        let irradiance = length(light.irradiance);
        let allowed = (asked.tolerance * irradiance).max(PI * asked.dark());
        irradiance == 0.0 || length(light.error) <= (1.0 + 1e-9) * allowed
    };
    points.iter().filter(is_met).count() as f64 / points.len().max(1) as f64
}
