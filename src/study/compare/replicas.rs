//! The answers of the patch methods on which verdicts rest: repeated for their noise, and coarsened for what patches do.
//!
//! Patches are as fine as time allows, whatever the number of camera rays: solving is cheap beside gathering, and the
//! size of patches makes an error that no number of rays takes away. All three methods work on the same patches, over
//! the same K where they have one, and are gathered by the same rays. Each repetition casts all rays anew.
//!
//! The Neumann solution is repeated with a quarter of the patches as well. An error of first order in patch size halves
//! with the size, one of second order falls to a quarter, so the difference of the two bounds what is left from above
//! in either case. It is the same for all three methods, whose patches are the same, and cancels between them.
//!
//! Not handled: an error that does not fall with the size of patches.

use std::time::Instant;

use crate::pictures::Picture;
use crate::rays::sobol::replica_seed;
use crate::render::{Prepared, Watch};
use crate::solve::Diverges;
use crate::study::compare::arithmetic::{average, combine, map, masked_mean, smoothed, standard_error, sum};
use crate::study::compare::comparison::{CompareError, Plan};
use crate::study::compare::patchwise::{Generations, Rung, cut_within, effort, matrix, pictures, shot_by_rays, solved};
use crate::study::compare::{Estimate, Mean, Method, ORDERS};
use crate::study::statistics::mean_and_error;

/// Repetitions for the standard error.
const REPLICAS: u32 = 4;
/// Half the window, in pixels, over which systematic errors are averaged.
const WINDOW: usize = 3;
/// The methods, in the order of their pictures.
const METHODS: [Method; 3] = [Method::Neumann, Method::ShootingAssembled, Method::ShootingRays];

/// Answers of the three patch methods, with their errors.
///
/// # Errors
/// [`CompareError`] where the series diverges, and where memory would not do.
pub fn answers(
    p: &mut Prepared,
    plan: &Plan,
    mask: &Picture,
    watch: &dyn Watch,
) -> Result<Vec<(Method, Estimate)>, CompareError> {
    let (rung, first) = finest(p, plan, watch)?;
    let start = Instant::now();
    let mut fine = vec![first];
    for replica in 1..REPLICAS {
        fine.push(replicate(p, plan, (replica, rung), &METHODS, watch)?);
    }
    let words = format!("mean of {REPLICAS}: {}", effort(p, rung));
    let coarse_rung = Rung { patches: rung.patches / 4, rays: 4 * rung.rays, ..rung };
    p.recut(coarse_rung.patches);
    let mut coarse = Vec::new();
    for replica in 0..REPLICAS {
        let which = (replica, coarse_rung);
        coarse.push(replicate(p, plan, which, &METHODS[..1], watch)?.remove(0));
    }
    let of = |k: usize| fine.iter().map(|r| r[k].clone()).collect::<Vec<_>>();
    let patches = Systematic::new(&of(0), &coarse, mask);
    let answer = |k: usize| Estimate {
        seconds: start.elapsed().as_secs_f64(),
        effort: words.clone(),
        ..patches.answer(&of(k), mask)
    };
    Ok((0..METHODS.len()).map(|k| (METHODS[k], answer(k))).collect())
}

/// Pictures of each order, E first, all beyond [`ORDERS`] last.
type Orders = Vec<Picture>;

/// The finest rung, and its first repetition: solving takes up to the plan's time for each method and all repetitions, and
/// gathering, coarse patches included, as long for all methods together, as far as memory goes; but [`Rung::least`] at least.
fn finest(p: &mut Prepared, plan: &Plan, watch: &dyn Watch) -> Result<(Rung, Vec<Orders>), CompareError> {
    let share = plan.seconds / f64::from(REPLICAS);
    let solving = METHODS.len() as f64 * share;
    let mut rung = Rung::least(plan);
    cut_within(p, plan, rung)?;
    loop {
        let clock = Instant::now();
        let solutions = solve(p, plan, (0, rung), &METHODS, watch)?;
        // Twice the patches with as many rays in all, but 64 a patch, take up to some 2.3 times as long.
        if 2.3 * clock.elapsed().as_secs_f64() < solving && rung.patches < 64_000 {
            let finer = Rung { patches: 2 * rung.patches, rays: (rung.rays / 2).max(64), ..rung };
            if cut_within(p, plan, finer).is_ok() {
                rung = finer;
                continue;
            }
            p.recut(rung.patches);
        }
        loop {
            let clock = Instant::now();
            let seed = seed(plan, 0);
            let orders = pictures(p, plan, (seed, rung), &solutions, watch);
            // The repetitions with coarse patches are gathered too.
            if 4.0 * clock.elapsed().as_secs_f64() >= share || rung.camera >= 512 {
                return Ok((rung, orders));
            }
            rung.camera *= 2;
        }
    }
}

fn seed(plan: &Plan, replica: u32) -> u32 {
    replica_seed(plan.seed, replica + 1)
}

/// One repetition of the methods asked for.
fn replicate(
    p: &Prepared,
    plan: &Plan,
    (replica, rung): (u32, Rung),
    methods: &[Method],
    watch: &dyn Watch,
) -> Result<Vec<Orders>, Diverges> {
    let solutions = solve(p, plan, (replica, rung), methods, watch)?;
    let seed = seed(plan, replica);
    Ok(pictures(p, plan, (seed, rung), &solutions, watch))
}

fn solve(
    p: &Prepared,
    plan: &Plan,
    (replica, rung): (u32, Rung),
    methods: &[Method],
    watch: &dyn Watch,
) -> Result<Vec<Generations>, Diverges> {
    let seed = seed(plan, replica);
    let mode = matrix(p, plan, (seed, rung), watch);
    let one = |&method: &Method| match method {
        Method::ShootingRays => shot_by_rays(p, plan, (seed, rung), watch),
        _ => solved(&mode, method, watch),
    };
    methods.iter().map(one).collect()
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
        let apart: Vec<Orders> = fine
            .iter()
            .zip(coarse)
            .map(|(f, c)| {
                let pairs = f.iter().zip(c);
                pairs.map(|(f, c)| combine(f, c, |f, c| f - c)).collect()
            })
            .collect();
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
    fn answer(&self, repeated: &[Orders], mask: &Picture) -> Estimate {
        let wholes: Vec<Picture> = repeated.iter().map(|orders| sum(orders)).collect();
        let order = |n: usize| -> Vec<Picture> { repeated.iter().map(|r| r[n].clone()).collect() };
        let orders: Vec<Vec<Picture>> = (0..=ORDERS).map(order).collect();
        let sets = std::iter::once(&wholes).chain(&orders);
        let means = sets.zip(&self.means).map(|(set, &systematic)| Mean { systematic, ..means(set, mask) });
        let picture = average(&wholes);
        let noise = |set: &Vec<Picture>| standard_error(set, &average(set));
        Estimate {
            means: means.collect(),
            freedom: f64::from(REPLICAS - 1),
            noise: Some(noise(&wholes)),
            systematic: Some(self.picture.clone()),
            order_noise: Some(orders.iter().map(noise).collect()),
            orders: orders.iter().map(|o| average(o)).collect(),
            picture,
            ..Estimate::default()
        }
    }
}

/// Mean over the mask and over repetitions, and the standard error of it.
fn means(repeated: &[Picture], mask: &Picture) -> Mean {
    let each: Vec<[f64; 3]> = repeated.iter().map(|p| masked_mean(p, mask)).collect();
    let channel = |c: usize| mean_and_error(&each.iter().map(|m| m[c]).collect::<Vec<_>>());
    Mean { value: [0, 1, 2].map(|c| channel(c).0), noise: [0, 1, 2].map(|c| channel(c).1), systematic: [0.0; 3] }
}
