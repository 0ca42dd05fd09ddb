//! The patch methods' ladder: each rung twice as fine in patches, rays and samples, as long as the next fits the time.
//!
//! The hierarchy of rays is built once for the whole comparison, and its time counts for no method.

use std::time::Instant;

use crate::form_factors::Sampling;
use crate::gather::GatherSampling;
use crate::light::{Light, Rgb};
use crate::pictures::Picture;
use crate::render::look::fields;
use crate::render::memory::check_solutions;
use crate::render::{
    Assembled, Prepared, Unfit, Watch, assemble, assembled_shooter, picture, ray_shooter, without_luminaires,
};
use crate::solve::{Diverges, Settings, Shooting, neumann};
use crate::solve::{RaySettings, Shooter, ShootingSettings};
use crate::study::compare::arithmetic::{combine, sum};
use crate::study::compare::comparison::Plan;
use crate::study::compare::{Estimate, Method, ORDERS};

/// How fine a patch method works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    /// About how many patches.
    pub patches: usize,
    /// Rays a patch.
    pub rays: u32,
    /// Camera rays a pixel; each with 4 rays to a luminaire and 8 over the hemisphere.
    pub camera: u32,
}

/// Unshot share, and tail of the series, that count as none beside the errors compared.
pub(crate) const REST: f64 = 2e-5;

/// Patch light of every generation.
pub(crate) type Generations = Vec<Vec<Light>>;

/// Patches that even a slow machine can afford, and that leave an error of some tenths of a percent.
const LEAST: usize = 16_000;
/// Solutions that are held at once: those of the three patch methods.
const SOLUTIONS: usize = 3;

impl Rung {
    /// The coarsest that verdicts rest on: 16,000 patches, a quarter of them for a plan of less than 2 seconds.
    pub fn least(plan: &Plan) -> Rung {
        let (patches, rays) = match plan.seconds < 2.0 {
            true => (LEAST / 4, 256),
            false => (LEAST, 64),
        };
        Rung { patches, rays, camera: 2 }
    }

    fn sampling(self, seed: u32) -> Sampling {
        Sampling { rays: self.rays, seed, ..Sampling::default() }
    }

    /// The k-th rung.
    pub fn new(k: u32) -> Rung {
        Rung { patches: 250 << k, rays: (64 << k).min(1 << 16), camera: 2 << k }
    }
}

/// Cuts the patches of a rung and checks that K and its solutions fit in memory.
pub(crate) fn cut_within(p: &mut Prepared, plan: &Plan, rung: Rung) -> Result<(), Unfit> {
    p.recut(rung.patches);
    check_solutions(p, plan.transport, &rung.sampling(plan.seed), SOLUTIONS)
}

/// Climbs while the time of a rung, as foreseen from the last, is below the plan's, and K fits in memory; the first rung
/// always counts.
///
/// # Errors
/// [`Diverges`] where the series does.
pub fn climb(p: &mut Prepared, method: Method, plan: &Plan, watch: &dyn Watch) -> Result<Vec<Estimate>, Diverges> {
    let mut ladder: Vec<Estimate> = Vec::new();
    for k in 0..12 {
        // A rung costs some two and a half times the one before.
        if ladder.last().is_some_and(|e| 2.5 * e.seconds > plan.seconds) {
            break;
        }
        let matrix = method != Method::ShootingRays;
        if k > 0 && matrix && cut_within(p, plan, Rung::new(k)).is_err() {
            break;
        }
        ladder.push(step(p, method, plan, Rung::new(k), watch)?);
    }
    Ok(ladder)
}

/// One rung from the scene's rays on: patches, the solution, and the pictures of its generations.
fn step(p: &mut Prepared, method: Method, plan: &Plan, rung: Rung, watch: &dyn Watch) -> Result<Estimate, Diverges> {
    let start = Instant::now();
    p.recut(rung.patches);
    let generations = match method {
        Method::ShootingRays => shot_by_rays(p, plan, (plan.seed, rung), watch)?,
        _ => {
            let mode = matrix(p, plan, (plan.seed, rung), watch);
            solved(&mode, method, watch)?
        }
    };
    let mut orders = pictures(p, plan, (plan.seed, rung), &[generations], watch).remove(0);
    let picture = sum(&orders);
    orders.truncate(ORDERS + 1);
    Ok(Estimate {
        seconds: start.elapsed().as_secs_f64(),
        effort: effort(p, rung),
        picture,
        orders,
        ..Estimate::default()
    })
}

/// A rung in words.
pub(crate) fn effort(p: &Prepared, rung: Rung) -> String {
    format!("{} patches, {} rays a patch, {} camera rays a pixel", p.patches.len(), rung.rays, rung.camera)
}

/// K of a rung.
pub(crate) fn matrix(p: &Prepared, plan: &Plan, (seed, rung): (u32, Rung), watch: &dyn Watch) -> Assembled {
    let (mut modes, _) = assemble(p, &[plan.transport], &rung.sampling(seed), watch);
    modes.remove(0)
}

/// Generations over K, by the Neumann series or by shooting.
pub(crate) fn solved(mode: &Assembled, method: Method, watch: &dyn Watch) -> Result<Generations, Diverges> {
    if method == Method::ShootingAssembled {
        return shot(&assembled_shooter(mode), watch);
    }
    let settings = Settings { tolerance: REST, ..Settings::default() };
    Ok(neumann(&mode.operator, &settings)?.terms)
}

/// Generations by shooting rays.
pub(crate) fn shot_by_rays(
    p: &Prepared,
    plan: &Plan,
    (seed, rung): (u32, Rung),
    watch: &dyn Watch,
) -> Result<Generations, Diverges> {
    let settings =
        RaySettings { rays: rung.rays.saturating_mul(p.patches.len() as u32), seed, ..RaySettings::default() };
    shot(&ray_shooter(p, plan.transport, settings), watch)
}

/// Shoots to the end; a tick for each tenth by which the unshot power falls.
fn shot(shooter: &dyn Shooter, watch: &dyn Watch) -> Result<Generations, Diverges> {
    let settings = ShootingSettings { unshot: REST, ..ShootingSettings::default() };
    let ticks = |share: f64| (share.max(REST).ln() / 0.9f64.ln()).max(0.0) as u64;
    watch.begin("shooting", ticks(REST));
    let mut shooting = Shooting::new(shooter, settings)?;
    let mut told = 0;
    shooting.run(|s| {
        let now = ticks(s.progress().share).max(told);
        watch.tick(now - told);
        told = now;
    })?;
    let generations = 0..shooting.generations();
    Ok(generations.map(|n| shooting.generation(n)).collect())
}

/// Pictures of bounces 0 to [`ORDERS`], then of all later ones together, of several solutions gathered by the same rays.
pub(crate) fn pictures(
    p: &Prepared,
    plan: &Plan,
    (seed, rung): (u32, Rung),
    solutions: &[Generations],
    watch: &dyn Watch,
) -> Vec<Vec<Picture>> {
    let values: Vec<Vec<Rgb>> = solutions.iter().flat_map(|g| values(p, g)).collect();
    let sampling = GatherSampling { camera: rung.camera, luminaire: 4, hemisphere: 8, seed };
    let transports = p.scene.transports(plan.transport);
    let fields = fields(p, &values);
    let parts = picture(p, &transports, &fields, plan.size, &sampling, watch);
    let of_one = |indirect: &[Picture]| {
        let mut orders = vec![parts.emission.clone()];
        orders.extend_from_slice(indirect);
        orders[1] = combine(&orders[1], &parts.direct, |a, b| a + b);
        orders
    };
    parts.indirect.chunks(ORDERS + 1).map(of_one).collect()
}

/// What hemisphere rays read of generations 0 to `ORDERS - 1`, then of all later ones together.
fn values(p: &Prepared, generations: &Generations) -> Vec<Vec<Rgb>> {
    let mut fields = vec![vec![Rgb::ZERO; p.patches.len()]; ORDERS + 1];
    fields[0] = without_luminaires(p, &generations[0]);
    for (n, generation) in generations.iter().enumerate().skip(1) {
        for (sum, l) in fields[n.min(ORDERS)].iter_mut().zip(generation) {
            *sum += l.invisible;
        }
    }
    fields
}
