//! D, the daylight coefficients of points: irradiance by a unit of radiance of each column of the sky.
//!
//! ```text
//! D_xp = S_xp + R_xp     S what x sees of column p, sr (cosine-weighted); R what surfaces reflect of it to x
//! E_x  = sum over p of D_xp L_p                                        irradiance under a sky of radiances L_p
//! ```
//!
//! S is a quadrature ([`crate::barriers`]). R is the mean of [`REPLICAS`] answers, each with rays of F, points on
//! patches and rays of points of its own, so that their differences hold all of its noise; from a column's variance at
//! all points each one's takes as much as one more replica would weigh. What all answers share is the size of patches:
//! that error is measured by the equation itself at places that rays from points meet, twice over
//! ([`crate::residual`]), and added. Patches are divided, and rays added, until the relative error of points is at most
//! the tolerance, or what they cost is more than [`ROUNDS`] times what came before.
//!
//! Not handled: glass that passes less at grazing angles, and surfaces that scatter by a BSDF.

use std::time::Instant;

use glam::{DVec3, Vec3};
use halflight::light::Transport;
use halflight::rays::sobol::{hash, replica_seed};
use halflight::render::{Fineness, Sensor, Watch};
use halflight::surfaces::SurfacePoint;
use halflight::{LinearOperator, Scene, Solver};
use rayon::prelude::*;

use crate::division::{Compass, Division};
use crate::error::DaylightError;
use crate::gather::{Gathered, Reading, Scratch, Surroundings};
use crate::light_on_patches::{OnPatches, Reflecting, adjoint_is_cheaper};
use crate::residual::{Measure, Residual, Solved};
use crate::sight::Sight;

/// Answers of which the mean is taken.
const REPLICAS: usize = 6;
/// Times that rays or patches are added at most.
const ROUNDS: usize = 5;
/// Patches at most.
const MOST_PATCHES: usize = 60_000;
/// What patches are divided by at once.
const FINER: usize = 3;
/// What is added to the variance of each as a share of one replica.
const POOLED: f64 = 1.0;
/// How far before a surface points on it lie, unit coordinates.
const BEFORE: f32 = 4e-6;
/// Told apart from other uses of a seed.
const SALT: u32 = 0x6461_796c;

/// What is asked.
pub struct DaylightGoal<'a> {
    /// (alpha, tau) of materials without their own.
    pub transport: Transport,
    /// The columns.
    pub division: Division,
    /// Which way is up, and which is north.
    pub compass: Compass,
    /// Suns: east, north and up of the directions to their middles.
    pub suns: &'a [DVec3],
    /// Reflections that count: 0 is direct light alone, none all of them.
    pub bounces: Option<usize>,
    /// RMS over the columns of a point's errors over that of its coefficients, in the RMS over points.
    pub tolerance: f64,
    /// Chooses the sample points.
    pub seed: u32,
    /// Bytes that F may take.
    pub memory: f64,
    /// Who is told of the work.
    pub watch: &'a dyn Watch,
}

/// How light on patches was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// Nothing is reflected.
    Direct,
    /// All columns through F, 16 at once.
    Columns,
    /// The importance of each point through F transposed.
    Adjoint,
}

/// D of points.
#[derive(Clone, Debug)]
pub struct Coefficients {
    /// The columns.
    pub division: Division,
    /// Points.
    pub points: usize,
    /// S, points × columns, sr.
    pub direct: Vec<f64>,
    /// Error of S, sr: the quadrature's estimate, or a standard error by rays.
    pub direct_error: Vec<f64>,
    /// R, points × columns, three channels, sr.
    pub reflected: Vec<[f64; 3]>,
    /// Its standard error, sr.
    pub reflected_error: Vec<[f64; 3]>,
    /// Irradiance straight by each sun of unit irradiance on a plane that faces it, points × suns; and its error.
    pub suns: Vec<[f64; 2]>,
    /// Suns.
    pub sun_count: usize,
    /// The relative error of points that the tolerance is held against.
    pub error: f64,
    /// The part of it that is due to the size of patches.
    pub patch_error: f64,
    /// Whether it is at most the tolerance.
    pub met: bool,
    /// Patches at last.
    pub patches: usize,
    /// Rays in all, those of F not counted.
    pub rays: u64,
    /// How the light on patches was found.
    pub way: Way,
    /// Whether S is a closed form along meridians; else it is by rays.
    pub is_exact: bool,
    /// Seconds in all.
    pub seconds: f64,
}

impl Coefficients {
    /// Columns.
    pub fn columns(&self) -> usize {
        self.division.columns()
    }

    /// D of a point and a column, three channels, sr.
    pub fn of(&self, point: usize, column: usize) -> [f64; 3] {
        let k = point * self.columns() + column;
        self.reflected[k].map(|own| own + self.direct[k])
    }

    /// The standard error of that, sr.
    pub fn error_of(&self, point: usize, column: usize) -> [f64; 3] {
        let k = point * self.columns() + column;
        self.reflected_error[k].map(|own| own.hypot(self.direct_error[k]))
    }
}

/// How finely R is found.
#[derive(Clone, Copy, Debug)]
struct Effort {
    patches: usize,
    /// Of each patch, and of each point, in every replica.
    rays: u32,
    gather: u32,
    /// Meridians over which each patch sees the sky.
    meridians: usize,
}

impl Effort {
    fn first(tolerance: f64) -> Effort {
        let finer = (0.02 / tolerance).clamp(0.1, 10.0);
        Effort {
            patches: (2000.0 * finer) as usize,
            rays: ((64.0 * finer) as u32).next_power_of_two().max(16),
            gather: ((512.0 * finer * finer.sqrt()) as u32).next_power_of_two().max(64),
            meridians: 30,
        }
    }
}

/// Points as rays leave them.
pub(crate) fn surface_points(scene: &Scene, sensors: &[Sensor]) -> Vec<SurfacePoint> {
    let point = |sensor: &Sensor| {
        let normal = sensor.normal.normalize_or(DVec3::Y).as_vec3();
        let position = scene.frame.to_unit(sensor.position).as_vec3() + BEFORE * normal;
        SurfacePoint { position, normal, face: SurfacePoint::NO_FACE }
    };
    sensors.iter().map(point).collect()
}

/// The scene without light of its own.
pub(crate) fn unlit(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.lights.clear();
    scene.materials.iter_mut().for_each(|material| material.emission = Vec3::ZERO);
    scene
}

/// D of points.
///
/// [`DaylightError`] where there are no points, the series is not proved to converge, or F does not fit in memory.
pub fn coefficients(scene: &Scene, sensors: &[Sensor], goal: &DaylightGoal) -> Result<Coefficients, DaylightError> {
    if sensors.is_empty() {
        return Err(DaylightError::NoPoints);
    }
    let start = Instant::now();
    let scene = unlit(scene);
    let solver = Solver::new(&scene).memory(goal.memory);
    let sight = Sight::new(solver.geometry(), scene.transports(goal.transport), goal.compass, goal.division);
    let points = surface_points(&scene, sensors);
    goal.watch.begin("sky from points", points.len() as u64);
    let seen = |(k, point): (usize, &SurfacePoint)| {
        let found = sight.sky(point, hash(k as u32, goal.seed ^ SALT));
        goal.watch.tick(1);
        found
    };
    let (direct, errors): (Vec<_>, Vec<_>) = points.par_iter().enumerate().map(seen).unzip();
    let (direct, direct_error): (Vec<f64>, Vec<f64>) = (direct.concat(), errors.concat());
    let of_sun = |point: &SurfacePoint, (k, towards): (usize, &DVec3)| {
        if towards.z <= 0.0 {
            return [0.0; 2];
        }
        let (irradiance, error) = sight.sun(point, *towards, hash(k as u32, goal.seed ^ SALT));
        [irradiance, error]
    };
    let own = |point| goal.suns.iter().enumerate().map(move |sun| (point, sun));
    let suns = points.par_iter().flat_map_iter(own).map(|(point, sun)| of_sun(point, sun)).collect();
    let dark = vec![[0.0; 3]; direct.len()];
    let mut found = Coefficients {
        division: goal.division,
        points: points.len(),
        reflected: dark.clone(),
        reflected_error: dark,
        suns,
        sun_count: goal.suns.len(),
        error: 0.0,
        patch_error: 0.0,
        met: true,
        patches: 0,
        rays: 0,
        way: Way::Direct,
        is_exact: sight.is_exact(),
        seconds: 0.0,
        direct,
        direct_error,
    };
    if goal.bounces != Some(0) {
        Reflections { solver, sight: &sight, points: &points, goal }.add_to(&mut found)?;
    }
    found.seconds = start.elapsed().as_secs_f64();
    Ok(found)
}

/// What is reflected to points.
struct Reflections<'a> {
    solver: Solver,
    sight: &'a Sight,
    points: &'a [SurfacePoint],
    goal: &'a DaylightGoal<'a>,
}

/// One answer.
struct Answer {
    /// Points × columns.
    reflected: Vec<[f32; 3]>,
    solved: Option<Solved>,
    rays: u64,
    way: Way,
}

/// Sums over answers.
struct Sums {
    sum: Vec<[f64; 3]>,
    squares: Vec<[f64; 3]>,
    solved: Option<Solved>,
}

impl Reflections<'_> {
    fn add_to(&self, found: &mut Coefficients) -> Result<(), DaylightError> {
        let mut effort = Effort::first(self.goal.tolerance);
        for round in 0..ROUNDS {
            self.round(&effort, round as u32, found)?;
            found.met = found.error <= self.goal.tolerance;
            let Some(next) = self.next(&effort, found).filter(|_| !found.met) else { break };
            effort = next;
        }
        Ok(())
    }

    /// What more it takes; none where no more can be had.
    fn next(&self, effort: &Effort, found: &Coefficients) -> Option<Effort> {
        let tolerance = self.goal.tolerance;
        let noise = (found.error.powi(2) - found.patch_error.powi(2)).max(0.0).sqrt();
        let mut next = *effort;
        if found.patch_error > 0.6 * tolerance && found.patches < MOST_PATCHES {
            next.patches = (FINER * found.patches).min(MOST_PATCHES);
        }
        if noise > 0.6 * tolerance {
            let more = (noise / (0.6 * tolerance)).powi(2).clamp(2.0, 8.0);
            let more_of = |rays: u32, most: u32| ((f64::from(rays) * more) as u32).next_power_of_two().min(most);
            next.rays = more_of(effort.rays, 4096);
            next.gather = more_of(effort.gather, 1 << 16);
            next.meridians = ((effort.meridians as f64 * more.sqrt()) as usize).min(360);
        }
        let is_more = next.patches > effort.patches || next.rays > effort.rays || next.gather > effort.gather;
        is_more.then_some(next)
    }

    /// R by all replicas of one effort, with its errors.
    fn round(&self, effort: &Effort, round: u32, found: &mut Coefficients) -> Result<(), DaylightError> {
        let entries = found.direct.len();
        let mut sums = Sums { sum: vec![[0.0; 3]; entries], squares: vec![[0.0; 3]; entries], solved: None };
        self.goal.watch.begin("daylight coefficients", REPLICAS as u64);
        self.solver.cut(effort.patches);
        for replica in 0..REPLICAS {
            let seed = replica_seed(hash(round, self.goal.seed ^ SALT), replica as u32);
            let answer = self.answer(effort, seed, replica)?;
            found.rays += answer.rays;
            found.way = answer.way;
            sums.add(answer);
            self.goal.watch.tick(1);
        }
        found.patches = self.solver.last_cut().patches.len();
        let residual = match &sums.solved {
            Some(solved) => {
                let patches = self.solver.last_cut().patches;
                let around = Surroundings { sight: self.sight, patches: &patches, passed_on: &solved.passed_on };
                let seed = hash(round, self.goal.seed ^ SALT ^ 0x7265_7369);
                let measure = Measure::to(self.goal.tolerance, self.points.len(), self.goal.bounces, seed);
                Residual::measure(&around, solved, self.points, measure)
            }
            None => Residual::default(),
        };
        found.rays += residual.rays;
        sums.errors(found, residual.share);
        Ok(())
    }

    fn answer(&self, effort: &Effort, seed: u32, replica: usize) -> Result<Answer, DaylightError> {
        let fineness = Fineness { patches: effort.patches, rays: effort.rays };
        let solver = self.solver.clone().seed(seed);
        let mode = solver.assemble(&[self.goal.transport], fineness, &halflight::render::Silent)?.modes.remove(0);
        let (patches, k) = (mode.patches(), &mode.operator);
        let passed_on: Vec<Vec3> = (0..k.len()).map(|i| k.passed_on(i)).collect();
        let around = Surroundings { sight: self.sight, patches, passed_on: &passed_on };
        let own = |scratch: &mut Scratch, (x, point): (usize, &SurfacePoint)| {
            let seed = hash(x as u32, seed ^ 0x706f_696e);
            around.gather(point, Reading { bounces: self.goal.bounces, rays: effort.gather, seed }, scratch)
        };
        let all = self.points.par_iter().enumerate();
        let gathered: Vec<Gathered> = all.map_init(Scratch::default, own).collect();
        let reached = reached(k, &gathered);
        let sky = self.sky_on(&around, &reached, effort, seed);
        let rays = gathered.iter().map(|own| own.rays).sum();
        let is_grey = is_grey(self.sight.scene(), k);
        let reflecting = Reflecting { k, is_grey };
        let columns = self.sight.division.columns();
        let adjoint =
            replica > 0 && adjoint_is_cheaper(self.points.len(), columns, is_grey) && reflecting.converges(&sky);
        let bounces = self.goal.bounces;
        let fewer = bounces.map(|count| count - 1);
        let mut reflected: Vec<Vec<[f32; 3]>> = gathered.iter().map(|own| own.fresh.clone()).collect();
        reflected.iter_mut().for_each(|own| own.resize(columns, [0.0; 3]));
        if adjoint {
            let first: Vec<_> = gathered.iter().map(|own| &own.first).collect();
            let second: Vec<_> = gathered.iter().map(|own| &own.second).collect();
            let mut add = |read: Vec<Vec<[f32; 3]>>| {
                for (out, own) in reflected.iter_mut().zip(read) {
                    out.iter_mut().zip(own).for_each(|(out, own)| *out = [0, 1, 2].map(|c| out[c] + own[c]));
                }
            };
            add(reflecting.by_adjoint(&first, &sky, bounces));
            if fewer != Some(0) {
                add(reflecting.by_adjoint(&second, &sky, fewer));
            }
            return Ok(Answer { reflected: reflected.concat(), solved: None, rays, way: Way::Adjoint });
        }
        let first = reflecting.travelling(&sky, bounces)?;
        let second = match fewer {
            None | Some(0) => None,
            _ => Some(reflecting.travelling(&sky, fewer)?),
        };
        reflected.par_iter_mut().zip(&gathered).for_each(|(out, own)| {
            own.first.iter().for_each(|(patch, weight)| first.add(*patch as usize, *weight, out));
            let deeper = second.as_ref().unwrap_or(&first);
            own.second.iter().for_each(|(patch, weight)| deeper.add(*patch as usize, *weight, out));
        });
        let solved = Solved { first, second, passed_on, answers: 1 };
        Ok(Answer { reflected: reflected.concat(), solved: Some(solved), rays, way: Way::Columns })
    }

    /// S of the patches that light can come from, each at a random point.
    fn sky_on(&self, around: &Surroundings, reached: &[bool], effort: &Effort, seed: u32) -> OnPatches {
        let columns = self.sight.division.columns();
        let mut values = vec![0.0; around.patches.len() * columns];
        values.par_chunks_exact_mut(columns).enumerate().filter(|(i, _)| reached[*i]).for_each(|(i, row)| {
            let seed = hash(i as u32, seed ^ 0x736b_7900);
            let [u, v, ..] = self.sight.numbers(1, seed);
            let point = around.patches.point(i, u, v);
            self.sight.sampled_sky(&point, (effort.meridians, seed), 1.0, row);
        });
        OnPatches { columns, channels: 1, values }
    }
}

/// Whether all channels are alike everywhere.
fn is_grey(scene: &Scene, k: &dyn LinearOperator) -> bool {
    let alike = |c: &Vec3| c.x == c.y && c.y == c.z;
    !scene.is_textured() && k.reflectances().iter().all(alike)
}

/// The patches from which light comes to points, by any number of steps.
fn reached(k: &halflight::Operator, gathered: &[Gathered]) -> Vec<bool> {
    let mut reached = vec![false; k.len()];
    let mut next: Vec<u32> = Vec::new();
    let all = gathered.iter().flat_map(|own| own.first.iter().chain(&own.second));
    for (patch, _) in all {
        if !std::mem::replace(&mut reached[*patch as usize], true) {
            next.push(*patch);
        }
    }
    while let Some(patch) = next.pop() {
        for &other in k.form_factors().row(patch as usize).0 {
            if !std::mem::replace(&mut reached[other as usize], true) {
                next.push(other);
            }
        }
    }
    (0..k.len()).for_each(|i| reached[i] &= k.passed_on(i).max_element() > 0.0);
    reached
}

impl Sums {
    fn add(&mut self, answer: Answer) {
        for ((sum, squares), own) in self.sum.iter_mut().zip(&mut self.squares).zip(&answer.reflected) {
            for c in 0..3 {
                sum[c] += f64::from(own[c]);
                squares[c] += f64::from(own[c]).powi(2);
            }
        }
        if let Some(own) = answer.solved {
            self.solved = Some(match self.solved.take() {
                None => own,
                Some(before) => before.plus(own),
            });
        }
    }

    /// R and its standard errors: of the replicas, each with a share of its column's, and what patches leave.
    fn errors(self, found: &mut Coefficients, residual: f64) {
        let count = REPLICAS as f64;
        let (points, columns) = (found.points, found.columns());
        let mean = |k: usize, c: usize| self.sum[k][c] / count;
        let own = |k: usize, c: usize| {
            let spread = (self.squares[k][c] - count * mean(k, c).powi(2)).max(0.0);
            spread / (count - 1.0) / count
        };
        for column in 0..columns {
            for c in 0..3 {
                let all = (0..points).map(|x| own(x * columns + column, c));
                let pooled = all.sum::<f64>() / points as f64;
                for k in (0..points).map(|x| x * columns + column) {
                    let degrees = count - 1.0;
                    let noise = (degrees * own(k, c) + POOLED * pooled) / (degrees + POOLED);
                    found.reflected[k][c] = mean(k, c);
                    found.reflected_error[k][c] = (noise + (residual * mean(k, c)).powi(2)).sqrt();
                }
            }
        }
        let relative = |of: &dyn Fn(usize, usize) -> f64| {
            let a_point = |x: usize| {
                let all = || (0..columns).map(move |column| x * columns + column);
                let total: f64 =
                    all().flat_map(|k| [0, 1, 2].map(|c| (found.direct[k] + found.reflected[k][c]).powi(2))).sum();
                let wrong: f64 = all().flat_map(|k| [0, 1, 2].map(|c| of(k, c).powi(2))).sum();
                if total > 0.0 { wrong / total } else { 0.0 }
            };
            ((0..points).map(a_point).sum::<f64>() / points as f64).sqrt()
        };
        let error = relative(&|k, c| found.reflected_error[k][c].hypot(found.direct_error[k]));
        let patch_error = relative(&|k, c| residual * found.reflected[k][c]);
        (found.error, found.patch_error) = (error, patch_error);
    }
}
