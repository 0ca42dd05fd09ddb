//! Speed against accuracy: what each setting of each way to a picture costs, and the error it reaches.
//!
//! The ladders of [`Ladder::CHARTED`] are climbed from scratch at each step, and every picture is held against a
//! reference made by another method with far more effort: patch methods against the path tracer, the path tracer
//! against a tightly solved patch picture. Seconds run from the scene's files to the picture in memory.
//!
//! Not handled: series that diverge.

use std::ops::RangeInclusive;
use std::time::Instant;

use crate::pictures::MetricError;
use crate::rays::Rays;
use crate::render::{Silent, check_memory, prepare};
use crate::scene::Scene;
use crate::solve::Diverges;
use crate::study::compare::ladder::{
    Ladder, LadderPoint, LadderStep, Method, StudyError, StudyPlan, climb, lap, measured, slope,
};
use crate::study::compare::patch_pictures::{PatchEffort, patch_step, within};
use crate::study::compare::references::{Source, brought, made};
use crate::study::compare::traced_pictures::climb_paths;
use crate::study::compare::truth::{Reached, Truth};

/// The errors asked for.
const TOLERANCES: [f64; 6] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.002];

/// Everything measured of one mode.
#[derive(Clone, Debug)]
pub struct Tradeoff {
    /// What the patch methods are held against, and what the path tracer is.
    pub truths: [Truth; 2],
    /// Ladder after ladder, each from coarse to fine.
    pub points: Vec<LadderPoint>,
}

/// Runs these ladders of one mode, in the order of [`Ladder::CHARTED`].
///
/// # Errors
/// A series that diverges (found before any reference is made), a reference that cannot be read, written or used.
pub fn trade_off(scene: &Scene, plan: &StudyPlan, ladders: &[Ladder], source: &Source) -> Result<Tradeoff, StudyError> {
    let known = match source {
        Source::Files { picture, error } => Some(brought(scene, plan, picture, error.as_deref())?),
        Source::Store(_) => None,
    };
    let mut climbed = Vec::new();
    for ladder in Ladder::CHARTED.iter().filter(|l| ladders.contains(l)) {
        climbed.extend(steps(scene, plan, ladder)?.into_iter().map(|step| (ladder, step)));
    }
    let truths = match (known, source) {
        (None, Source::Store(folder)) => {
            let judges_paths = ladders.iter().any(|ladder| !ladder.method.is_patchwise());
            made(scene, plan, folder, judges_paths)?
        }
        (known, _) => known.map(|truth| [truth.clone(), truth]).expect("files were read"),
    };
    let point = |(ladder, step): (&Ladder, LadderStep)| {
        let judge = usize::from(!ladder.method.is_patchwise());
        measured(ladder, step, &truths[judge..=judge])
    };
    let mut points = climbed.into_iter().map(point).collect::<Result<Vec<_>, MetricError>>()?;
    for i in front(&points) {
        points[i].on_front = true;
    }
    Ok(Tradeoff { truths, points })
}

/// Climbs one ladder, each step from scratch, but for the path tracer's.
fn steps(scene: &Scene, plan: &StudyPlan, ladder: &Ladder) -> Result<Vec<LadderStep>, Diverges> {
    plan.watch.begin(ladder.name, ladder.steps.into());
    if ladder.method == Method::NextEvent {
        let mut clock = Instant::now();
        let rays = Rays::new(scene);
        return Ok(climb_paths(scene, &rays, lap(&mut clock), plan, ladder).0);
    }
    climb(ladder, plan, |k| {
        if ladder.method == Method::Tolerance {
            return to_tolerance(scene, plan, TOLERANCES[k as usize]).map(Some);
        }
        let effort = PatchEffort::step(ladder.method, k, plan.seed);
        let p = prepare(scene.clone(), effort.patches);
        let matrix = ladder.method != Method::ShootingRays;
        if matrix && check_memory(&p, &[plan.transport], &effort.sampling(), plan.memory).is_err() {
            return Ok(None);
        }
        let mut step = patch_step(&p, &StudyPlan { watch: &Silent, ..*plan }, ladder.method, &effort)?;
        step.seconds.patches = p.seconds;
        Ok(Some(step))
    })
}

fn to_tolerance(scene: &Scene, plan: &StudyPlan, tolerance: f64) -> Result<LadderStep, Diverges> {
    let found = within(scene, plan, tolerance, plan.seed)?;
    Ok(LadderStep {
        effort: format!("{} patches, {} rays in all", found.patches, found.rays),
        asked: Some(tolerance),
        estimated: Some(found.error.total),
        seconds: found.seconds,
        picture: found.picture,
        orders: Vec::new(),
    })
}

impl Tradeoff {
    /// The points of one ladder.
    pub fn of(&self, method: Method) -> impl Iterator<Item = &LadderPoint> {
        self.points.iter().filter(move |p| p.ladder.method == method)
    }

    /// The slope over those points of the tolerance ladder whose tolerance is within a range.
    pub fn tolerance_slope(&self, range: RangeInclusive<f64>) -> Option<f64> {
        let factor = 1.0 + 1e-9;
        let within =
            |p: &&LadderPoint| p.asked.is_some_and(|a| a * factor >= *range.start() && a <= range.end() * factor);
        slope(self.of(Method::Tolerance).filter(within))
    }

    /// The least error of a patch method that its reference tells from 0, by two standard errors.
    pub fn least_told(&self) -> Option<f64> {
        let judged = self.points.iter().filter(|p| p.ladder.method.is_patchwise());
        let told = judged.map(|p| {
            let Reached { error, high, .. } = p.reached;
            (high * high - error * error).max(0.0).sqrt()
        });
        told.reduce(f64::min).filter(|&least| least > 0.0)
    }

    /// The points that none beats in both time and error, fastest first.
    pub fn front(&self) -> impl Iterator<Item = &LadderPoint> {
        front(&self.points).into_iter().map(|i| &self.points[i])
    }
}

/// Numbers of the points that none beats in both time and error, fastest first. A point whose error the reference
/// cannot tell from 0 takes no part.
fn front(points: &[LadderPoint]) -> Vec<usize> {
    let place = |i: usize| (points[i].seconds.total, points[i].reached.error);
    let mut order: Vec<usize> = (0..points.len()).filter(|&i| place(i).1 > 0.0).collect();
    order.sort_by(|&a, &b| place(a).0.total_cmp(&place(b).0).then(place(a).1.total_cmp(&place(b).1)));
    let mut least = f64::INFINITY;
    order.retain(|&i| {
        let better = place(i).1 < least;
        least = least.min(place(i).1);
        better
    });
    order
}

#[cfg(test)]
/// Points of one ladder at these seconds and errors, the error asked for twice the one reached.
pub(crate) fn made_up(places: &[(f64, f64)]) -> Tradeoff {
    use crate::{pictures::Picture, render::Seconds};
    let point = |&(total, error): &(f64, f64)| LadderPoint {
        ladder: Ladder::CHARTED[0],
        effort: "some".into(),
        asked: Some(2.0 * error),
        estimated: Some(1.5 * error),
        reached: Reached { error, low: error, high: error },
        orders: Vec::new(),
        seconds: Seconds { gather: 0.75 * total, solve: 0.25 * total, total, ..Seconds::default() },
        on_front: false,
    };
    let truth = Truth::of(Picture::new(1, 1), "nobody");
    Tradeoff { truths: [truth.clone(), truth], points: places.iter().map(point).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let found = made_up(&[(1.0, 0.1), (2.0, 0.2), (3.0, 0.0), (4.0, 0.01), (0.5, 0.3)]);
        assert_eq!(front(&found.points), [4, 0, 3]);
    }

    #[test]
    fn slopes_are_exponents_within_the_tolerances_asked_for() {
        // Tolerances 20 %, 2 % and 0.2 %: slope -1 up to 2 %, -1/2 after it.
        let found = made_up(&[(1.0, 0.1), (10.0, 0.01), (1000.0, 0.001)]);
        let slope = |low, high| found.tolerance_slope(low..=high).unwrap();
        assert!((slope(0.02, 0.2) + 1.0).abs() < 1e-9);
        assert!((slope(0.002, 0.02) + 0.5).abs() < 1e-9);
        assert_eq!(found.tolerance_slope(0.5..=0.6), None);
    }
}
