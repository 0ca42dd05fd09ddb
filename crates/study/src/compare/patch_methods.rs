//! The patch methods: their pictures, each with its time, and the answers on which verdicts rest.
//!
//! Pictures that are compared show every bounce order; those that are charted are gathered as a whole, as
//! `halflight render` does.
//!
//! Answers are repeated for their noise, and coarsened for the error that the size of patches makes and no number of
//! rays takes away. Patches are as fine as time allows, whatever the number of camera rays: solving is cheap next to
//! gathering. All methods work on the same patches, over the same K where they have one, and are gathered by the same
//! rays; each repetition casts all rays anew. The Neumann solution is repeated with a quarter of the patches as well.
//! An error of first order in patch size halves with the size, one of second order falls to a quarter, so the
//! difference of the two bounds the remaining error from above in either case. It is the same for all three methods,
//! and cancels between them.
//!
//! Not handled: patches cut where they are needed; errors that do not fall with the size of patches.

use std::sync::Arc;
use std::time::Instant;

use crate::bounces::bounce_fields_and_rest;
use crate::compare::arithmetic::{average, combine, map, masked_mean, smoothed, standard_error, sum};
use crate::compare::ladder::{Ladder, LadderStep, Method, ORDERS, StudyError, StudyPlan, lap};
use crate::compare::verdict::{Answer, Mean};
use halflight::direct::{Lights, TOLERABLE};
use halflight::form_factors::{Estimate, Sampling};
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Light, Rgb};
use halflight::pictures::Picture;
use halflight::rays::sobol::replica_seed;
use halflight::render::{Assembled, Discretization, Seconds, Unfit, pictures};
use halflight::solve::{Diverges, RaySettings, Settings, Shooter, Shooting, ShootingSettings, neumann};

/// How fine a patch method works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchEffort {
    /// About how many patches.
    pub patches: usize,
    /// Rays a patch.
    pub rays: u32,
    /// Rays a pixel.
    pub pixel: PixelRays,
    /// Chooses sample points.
    pub seed: u32,
}

/// How many rays a pixel has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PixelRays {
    /// So many over the hemispheres of all its camera rays, as `--samples` requests.
    Samples(u32),
    /// So many camera rays, each with 4 rays to a luminaire and 8 over the hemisphere.
    Camera(u32),
}

/// Patch light of every generation.
pub(crate) type Generations = Vec<Vec<Light>>;

/// Patches that even a slow machine can afford, and that leave an error of some tenths of a percent.
const LEAST: usize = 16_000;
/// Solutions that are held at once: those of the three patch methods that are compared.
const SOLUTIONS: usize = 3;

impl PatchEffort {
    /// The k-th step of a method: one setting four times the last and the others fine, or all twice the last.
    pub(crate) fn step(method: Method, k: u32, seed: u32) -> PatchEffort {
        let fine = PatchEffort { patches: 8000, rays: 1024, pixel: PixelRays::Samples(512), seed };
        match method {
            Method::Patches => PatchEffort { patches: 250 << (2 * k), ..fine },
            Method::Rays => PatchEffort { rays: 16 << (2 * k), ..fine },
            Method::Samples => PatchEffort { pixel: PixelRays::Samples(8 << (2 * k)), ..fine },
            _ => {
                let rays = (64 << k).min(1 << 16);
                PatchEffort { patches: 250 << k, rays, pixel: PixelRays::Camera(2 << k), seed }
            }
        }
    }

    /// The coarsest that verdicts rest on: 16,000 patches, a quarter of them for a plan of less than 2 seconds.
    pub(crate) fn least(plan: &StudyPlan) -> PatchEffort {
        let (patches, rays) = if plan.seconds < 2.0 { (LEAST / 4, 256) } else { (LEAST, 64) };
        PatchEffort { patches, rays, pixel: PixelRays::Camera(2), seed: plan.seed }
    }

    /// The rays of K.
    pub(crate) fn sampling(&self) -> Sampling {
        Sampling { rays: self.rays, seed: self.seed, ..Sampling::default() }
    }

    fn gathering(&self) -> GatherSampling {
        match self.pixel {
            PixelRays::Samples(samples) => GatherSampling::with_samples(samples, self.seed),
            PixelRays::Camera(camera) => GatherSampling { camera, luminaire: 4, hemisphere: 8, seed: self.seed },
        }
    }

    /// In words, with the number of patches there are.
    pub(crate) fn words(&self, patches: usize) -> String {
        let pixel = match self.pixel {
            PixelRays::Samples(samples) => format!("{samples} samples a pixel"),
            PixelRays::Camera(camera) => format!("{camera} camera rays a pixel"),
        };
        format!("{patches} patches, {} rays a patch, {pixel}", self.rays)
    }
}

/// Patches for which K and its solutions fit in memory.
fn cut_within(p: &Discretization, plan: &StudyPlan, effort: &PatchEffort) -> Result<Discretization, Unfit> {
    let p = p.cut(effort.patches);
    check_fit(&p, plan, effort)?;
    Ok(p)
}

/// Checks that K of the patches as they are, and its solutions, fit in memory.
pub(crate) fn check_fit(p: &Discretization, plan: &StudyPlan, effort: &PatchEffort) -> Result<(), Unfit> {
    p.check_memory(&[plan.transport], &effort.sampling(), SOLUTIONS, plan.memory)
}

/// Patches of a scene, and how finely a study works on them.
#[derive(Clone, Copy)]
pub(crate) struct PatchWork<'a> {
    pub p: &'a Discretization,
    pub plan: &'a StudyPlan<'a>,
    pub effort: PatchEffort,
}

impl PatchWork<'_> {
    /// One step of a method; the time of cutting patches is left for the caller to add.
    pub(crate) fn step(&self, method: Method) -> Result<LadderStep, Diverges> {
        let PatchWork { p, plan, effort } = self;
        let mut clock = Instant::now();
        let mut seconds = Seconds::default();
        let k = (method != Method::ShootingRays).then(|| self.matrix());
        seconds.form_factors = lap(&mut clock);
        let mut orders = match (&k, method) {
            (Some(k), Method::Patches | Method::Rays | Method::Samples) => {
                let solution = neumann(&k.operator, &Settings::default())?;
                seconds.solve = lap(&mut clock);
                vec![k.picture(&solution, &self.pass(), plan.watch).total()]
            }
            _ => {
                let generations = self.generations(method, k.as_ref())?;
                seconds.solve = lap(&mut clock);
                self.by_order(&[generations]).remove(0)
            }
        };
        seconds.gather = lap(&mut clock);
        let picture = sum(&orders);
        orders.truncate(plan.study.orders());
        Ok(LadderStep { effort: effort.words(p.patches.len()), seconds, picture, orders, ..LadderStep::default() })
    }

    /// K.
    fn matrix(&self) -> Assembled {
        let PatchWork { p, plan, effort } = self;
        p.assemble(&[plan.transport], &effort.sampling(), plan.watch).0.remove(0)
    }

    /// What lights the patches.
    fn lights(&self) -> Arc<Lights> {
        self.p.lights(self.p.transports(self.plan.transport), TOLERABLE)
    }

    fn pass(&self) -> GatherPass {
        GatherPass::new(self.plan.size, &self.effort.gathering())
    }

    /// Generations over `k` by the Neumann series or by shooting, or by shooting rays.
    fn generations(&self, method: Method, k: Option<&Assembled>) -> Result<Generations, Diverges> {
        let PatchWork { p, plan, effort } = self;
        match k {
            Some(k) if method == Method::ShootingAssembled => shot(&k.operator, plan),
            Some(k) if method != Method::ShootingRays => {
                let settings = Settings { tolerance: plan.study.rest(), ..Settings::default() };
                Ok(neumann(&k.operator, &settings)?.terms)
            }
            _ => {
                let rays = effort.rays.saturating_mul(p.patches.len() as u32);
                let settings = RaySettings { rays, seed: effort.seed, ..RaySettings::default() };
                shot(&p.ray_shooter(plan.transport, settings), plan)
            }
        }
    }

    /// Generations of several methods over one K.
    fn solve(&self, ladders: &[Ladder]) -> Result<Vec<Generations>, Diverges> {
        let k = self.matrix();
        ladders.iter().map(|ladder| self.generations(ladder.method, Some(&k))).collect()
    }

    /// Pictures of each bounce, then of all later ones together, of several solutions gathered by the same rays.
    fn by_order(&self, solutions: &[Generations]) -> Vec<Orders> {
        let (plan, lights) = (self.plan, self.lights());
        let each = plan.study.orders().max(1);
        let values: Vec<Vec<Rgb>> = solutions
            .iter()
            .flat_map(|generations| {
                let mut fields = bounce_fields_and_rest(&lights, generations, each - 1);
                fields.resize(each, vec![Rgb::ZERO; lights.patches.len()]);
                fields
            })
            .collect();
        let parts = pictures(&lights, &values, &self.pass(), plan.watch);
        let of_one = |indirect: &[Picture]| {
            let mut orders = vec![parts.emission.clone()];
            orders.extend_from_slice(indirect);
            orders[1] = combine(&orders[1], &parts.direct, |a, b| a + b);
            orders
        };
        parts.indirect.chunks(each).map(of_one).collect()
    }
}

/// Shoots until no share that counts is left; a tick for each tenth by which the unshot power falls.
fn shot(shooter: &dyn Shooter, plan: &StudyPlan) -> Result<Generations, Diverges> {
    let rest = plan.study.rest();
    let settings = ShootingSettings { unshot: rest, ..ShootingSettings::default() };
    let ticks = |share: f64| (share.max(rest).ln() / 0.9f64.ln()).max(0.0) as u64;
    plan.watch.begin("shooting", ticks(rest));
    let mut shooting = Shooting::new(shooter, settings)?;
    let mut ticked = 0;
    shooting.run(|s| {
        let now = ticks(s.progress().share).max(ticked);
        plan.watch.tick(now - ticked);
        ticked = now;
    })?;
    let generations = 0..shooting.generations();
    Ok(generations.map(|n| shooting.generation(n)).collect())
}

/// Repetitions for the standard error.
const REPLICAS: u32 = 4;
/// Half the window, in pixels, over which systematic errors are averaged.
const WINDOW: usize = 3;
/// Camera rays a pixel at most.
const MOST_CAMERA: u32 = 512;

/// Pictures of each order, E first, all beyond [`ORDERS`] last.
type Orders = Vec<Picture>;

/// Answers of the patch methods, the series over K first, with their errors.
///
/// # Errors
/// [`StudyError`] where the series diverges, and where memory would not do.
pub(crate) fn patch_answers(
    p: &Discretization,
    plan: &StudyPlan,
    ladders: &[Ladder],
    mask: &Picture,
) -> Result<Vec<Answer>, StudyError> {
    let (p, effort, first) = finest(p, plan, ladders)?;
    let mut fine = vec![first];
    let replicate = |p: &Discretization, effort: PatchEffort, replica: u32, ladders: &[Ladder]| {
        let work = PatchWork { p, plan, effort: PatchEffort { seed: seed(plan, replica), ..effort } };
        work.solve(ladders).map(|solutions| work.by_order(&solutions))
    };
    for replica in 1..REPLICAS {
        fine.push(replicate(&p, effort, replica, ladders)?);
    }
    let words = format!("mean of {REPLICAS}: {}", effort.words(p.patches.len()));
    let coarse_effort = PatchEffort { patches: effort.patches / 4, rays: 4 * effort.rays, ..effort };
    let p = p.cut(coarse_effort.patches);
    let mut coarse = Vec::new();
    for replica in 0..REPLICAS {
        coarse.push(replicate(&p, coarse_effort, replica, &ladders[..1])?.remove(0));
    }
    let of = |k: usize| fine.iter().map(|r| r[k].clone()).collect::<Vec<_>>();
    let patches = Systematic::new(&of(0), &coarse, mask);
    let answer = |(k, ladder): (usize, &Ladder)| Answer {
        name: ladder.name,
        effort: words.clone(),
        ..patches.answer(&of(k), mask)
    };
    Ok(ladders.iter().enumerate().map(answer).collect())
}

/// The finest effort, and its first repetition: solving takes up to the plan's time for each method and all
/// repetitions, and gathering, coarse patches included, as long for all methods together, as far as memory goes; but
/// [`PatchEffort::least`] at least.
fn finest(
    p: &Discretization,
    plan: &StudyPlan,
    ladders: &[Ladder],
) -> Result<(Discretization, PatchEffort, Vec<Orders>), StudyError> {
    let share = plan.seconds / f64::from(REPLICAS);
    let solving = ladders.len() as f64 * share;
    let mut effort = PatchEffort { seed: seed(plan, 0), ..PatchEffort::least(plan) };
    let mut p = cut_within(p, plan, &effort)?;
    let solutions = loop {
        let clock = Instant::now();
        let solutions = PatchWork { p: &p, plan, effort }.solve(ladders)?;
        // Twice the patches with as many rays in all, but 64 a patch, take up to some 2.3 times as long.
        if 2.3 * clock.elapsed().as_secs_f64() >= solving || effort.patches >= 64_000 {
            break solutions;
        }
        let finer = PatchEffort { patches: 2 * effort.patches, rays: (effort.rays / 2).max(64), ..effort };
        match cut_within(&p, plan, &finer) {
            Ok(cut) => (p, effort) = (cut, finer),
            Err(_) => break solutions,
        }
    };
    let mut camera = 2;
    loop {
        effort.pixel = PixelRays::Camera(camera);
        let clock = Instant::now();
        let orders = PatchWork { p: &p, plan, effort }.by_order(&solutions);
        // The repetitions with coarse patches are gathered too.
        if 4.0 * clock.elapsed().as_secs_f64() >= share || camera >= MOST_CAMERA {
            return Ok((p, effort, orders));
        }
        camera *= 2;
    }
}

fn seed(plan: &StudyPlan, replica: u32) -> u32 {
    replica_seed(plan.seed, replica + 1)
}

/// What the size of patches does.
struct Systematic {
    /// To each pixel.
    picture: Picture,
    /// To the means of the picture and of its orders.
    means: Vec<[f64; 3]>,
}

impl Systematic {
    fn new(fine: &[Orders], coarse: &[Orders], mask: &Picture) -> Systematic {
        let pairs = fine.iter().zip(coarse).map(|(f, c)| f.iter().zip(c));
        let apart: Vec<Orders> =
            pairs.map(|orders| orders.map(|(f, c)| combine(f, c, |f, c| f - c)).collect()).collect();
        let wholes: Vec<Picture> = apart.iter().map(|orders| sum(orders)).collect();
        let squares = map(&average(&wholes), |d| d * d);
        // A difference that changes sign in a window is not small there.
        let picture = map(&smoothed(&squares, WINDOW, mask), |v| v.map(f32::sqrt));
        let size = |pictures: Vec<Picture>| means(&pictures, mask).value.map(f64::abs);
        let order = |n: usize| size(apart.iter().map(|o| o[n].clone()).collect());
        let mut means = vec![size(wholes)];
        means.extend((0..=ORDERS).map(order));
        Systematic { picture, means }
    }

    /// Mean of the repetitions of one method, with their spread and this.
    fn answer(&self, repeated: &[Orders], mask: &Picture) -> Answer {
        let wholes: Vec<Picture> = repeated.iter().map(|orders| sum(orders)).collect();
        let order = |n: usize| -> Vec<Picture> { repeated.iter().map(|r| r[n].clone()).collect() };
        let orders: Vec<Vec<Picture>> = (0..=ORDERS).map(order).collect();
        let sets = std::iter::once(&wholes).chain(&orders);
        let means = sets.zip(&self.means).map(|(set, &systematic)| Mean { systematic, ..means(set, mask) });
        let picture = average(&wholes);
        let noise = |set: &Vec<Picture>| standard_error(set, &average(set));
        Answer {
            means: means.collect(),
            freedom: f64::from(REPLICAS - 1),
            noise: noise(&wholes),
            systematic: Some(self.picture.clone()),
            order_noise: orders.iter().map(noise).collect(),
            orders: orders.iter().map(|o| average(o)).collect(),
            picture,
            ..Answer::default()
        }
    }
}

/// Mean over the mask and over repetitions, and the standard error of it.
fn means(repeated: &[Picture], mask: &Picture) -> Mean {
    let each: Vec<[f64; 3]> = repeated.iter().map(|p| masked_mean(p, mask)).collect();
    let channels = [0, 1, 2].map(|c| Estimate::of_mean(each.iter().map(|m| m[c])));
    Mean { value: channels.map(|e| e.value), noise: channels.map(|e| e.error), systematic: [0.0; 3] }
}
