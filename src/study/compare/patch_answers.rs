//! The answers of the patch methods on which verdicts rest: repeated for their noise, and coarsened for what patches
//! do.
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
use crate::render::Prepared;
use crate::solve::Diverges;
use crate::study::compare::answer::{Answer, Mean};
use crate::study::compare::arithmetic::{average, combine, map, masked_mean, smoothed, standard_error, sum};
use crate::study::compare::ladder::{Ladder, ORDERS, StudyError, StudyPlan};
use crate::study::compare::patch_pictures::{
    Generations, PatchEffort, PixelRays, by_order, cut_within, generations, matrix,
};
use crate::study::statistics::mean_and_error;

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
    p: &mut Prepared,
    plan: &StudyPlan,
    ladders: &[Ladder],
    mask: &Picture,
) -> Result<Vec<Answer>, StudyError> {
    let (effort, first) = finest(p, plan, ladders)?;
    let mut fine = vec![first];
    for replica in 1..REPLICAS {
        fine.push(replicate(p, plan, &PatchEffort { seed: seed(plan, replica), ..effort }, ladders)?);
    }
    let words = format!("mean of {REPLICAS}: {}", effort.words(p));
    let coarse_effort = PatchEffort { patches: effort.patches / 4, rays: 4 * effort.rays, ..effort };
    p.recut(coarse_effort.patches);
    let mut coarse = Vec::new();
    for replica in 0..REPLICAS {
        let effort = PatchEffort { seed: seed(plan, replica), ..coarse_effort };
        coarse.push(replicate(p, plan, &effort, &ladders[..1])?.remove(0));
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
fn finest(p: &mut Prepared, plan: &StudyPlan, ladders: &[Ladder]) -> Result<(PatchEffort, Vec<Orders>), StudyError> {
    let share = plan.seconds / f64::from(REPLICAS);
    let solving = ladders.len() as f64 * share;
    let mut effort = PatchEffort { seed: seed(plan, 0), ..PatchEffort::least(plan) };
    cut_within(p, plan, &effort)?;
    let solutions = loop {
        let clock = Instant::now();
        let solutions = solve(p, plan, &effort, ladders)?;
        // Twice the patches with as many rays in all, but 64 a patch, take up to some 2.3 times as long.
        if 2.3 * clock.elapsed().as_secs_f64() >= solving || effort.patches >= 64_000 {
            break solutions;
        }
        let finer = PatchEffort { patches: 2 * effort.patches, rays: (effort.rays / 2).max(64), ..effort };
        if cut_within(p, plan, &finer).is_err() {
            p.recut(effort.patches);
            break solutions;
        }
        effort = finer;
    };
    let mut camera = 2;
    loop {
        effort.pixel = PixelRays::Camera(camera);
        let clock = Instant::now();
        let orders = by_order(p, plan, &effort, &solutions);
        // The repetitions with coarse patches are gathered too.
        if 4.0 * clock.elapsed().as_secs_f64() >= share || camera >= MOST_CAMERA {
            return Ok((effort, orders));
        }
        camera *= 2;
    }
}

fn seed(plan: &StudyPlan, replica: u32) -> u32 {
    replica_seed(plan.seed, replica + 1)
}

/// One repetition of the methods asked for.
fn replicate(
    p: &Prepared,
    plan: &StudyPlan,
    effort: &PatchEffort,
    ladders: &[Ladder],
) -> Result<Vec<Orders>, Diverges> {
    let solutions = solve(p, plan, effort, ladders)?;
    Ok(by_order(p, plan, effort, &solutions))
}

fn solve(
    p: &Prepared,
    plan: &StudyPlan,
    effort: &PatchEffort,
    ladders: &[Ladder],
) -> Result<Vec<Generations>, Diverges> {
    let k = matrix(p, plan, effort);
    ladders.iter().map(|ladder| generations(p, plan, ladder.method, effort, Some(&k))).collect()
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
    let channel = |c: usize| mean_and_error(&each.iter().map(|m| m[c]).collect::<Vec<_>>());
    Mean { value: [0, 1, 2].map(|c| channel(c).0), noise: [0, 1, 2].map(|c| channel(c).1), systematic: [0.0; 3] }
}
