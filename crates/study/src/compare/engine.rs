//! The engine of both studies: every ladder is climbed, every picture is held against a reference of another method,
//! and where methods are compared every pair is judged.
//!
//! Patch methods are held against the path tracer with next-event estimation, path tracers against the Neumann series:
//! a reference is never of the kind under test, and its own noise is subtracted. Where settings are charted each step
//! starts from scratch, but for the path tracer's, and seconds run from the scene's files to the picture in memory.
//! Where methods are compared the hierarchy of rays is built once, its time counts for no method, and references and
//! verdicts rest on [answers](patch_answers) of their own.
//!
//! Not handled: series that diverge.

use std::ops::RangeInclusive;
use std::time::Instant;

use serde::{Serialize, Serializer};

use crate::compare::arithmetic::combine;
use crate::compare::ladder::{
    Ladder, LadderPoint, LadderStep, Method, Study, StudyError, StudyPlan, climb, lap, measured, slope,
};
use crate::compare::patch_methods::{PatchEffort, PatchWork, check_fit, patch_answers};
use crate::compare::references::{Source, brought, made, within};
use crate::compare::tracers::{climb_paths, traced_answer};
use crate::compare::truth::{Truth, or_everywhere};
use crate::compare::verdict::{Answer, Pair, judge};
use halflight::Solver;
use halflight::pictures::Picture;
use halflight::rays::Rays;
use halflight::render::{Discretization, Silent};
use halflight::scene::Scene;

/// The requested errors of the ladder of tolerances.
const TOLERANCES: [f64; 6] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.002];

/// What one ladder reached; in reports with the seconds and errors of its points only.
#[derive(Clone, Debug, Serialize)]
pub struct Climb {
    /// The ladder.
    #[serde(rename = "name")]
    pub ladder: Ladder,
    /// Each step's cost and error; none where the reference is black.
    #[serde(serialize_with = "brief")]
    pub points: Vec<LadderPoint>,
    /// What the errors are taken against.
    pub reference: String,
    /// Slope of log error over log seconds.
    pub slope: Option<f64>,
}

fn brief<S: Serializer>(points: &[LadderPoint], to: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Brief {
        rms: f64,
        seconds: f64,
    }
    to.collect_seq(points.iter().map(|p| Brief { rms: p.reached.error, seconds: p.seconds.total }))
}

/// Everything measured of one mode.
#[derive(Clone, Debug, Default)]
pub struct Measurements {
    /// Ladder after ladder.
    pub climbs: Vec<Climb>,
    /// What patch methods and path tracers were held against; none where methods are compared.
    pub truths: Vec<Truth>,
    /// The best of each compared method, with its errors estimated: what verdicts rest on.
    pub answers: Vec<Answer>,
    /// Every pair's verdict.
    pub pairs: Vec<Pair>,
}

/// Climbs these ladders of one mode, patch methods before path tracers.
///
/// # Errors
/// A series that diverges (found before any path is traced), a reference that cannot be read, written or used, K that
/// does not fit in memory.
pub fn measure(
    scene: &Scene,
    plan: &StudyPlan,
    ladders: &[Ladder],
    source: &Source,
) -> Result<Measurements, StudyError> {
    let (patchwise, paths): (Vec<Ladder>, Vec<Ladder>) = ladders.iter().partition(|l| l.method.is_patchwise());
    match source {
        Source::Answers => compare(scene, plan, &patchwise, &paths),
        Source::Files { picture, error } => {
            let truth = brought(scene, plan, picture, error.as_deref())?;
            chart(scene, plan, &patchwise, &paths, || Ok(vec![truth.clone(), truth]))
        }
        Source::Store(folder) => {
            chart(scene, plan, &patchwise, &paths, || made(scene, plan, folder, !paths.is_empty()))
        }
    }
}

/// Climbs on one set of rays, and judges every pair of answers.
fn compare(
    scene: &Scene,
    plan: &StudyPlan,
    patchwise: &[Ladder],
    paths: &[Ladder],
) -> Result<Measurements, StudyError> {
    let least = PatchEffort::least(plan);
    let p = Solver::new(scene).cut(least.patches);
    check_fit(&p, plan, &least)?;
    let mut climbed = Vec::new();
    for ladder in patchwise {
        (plan.begins)(ladder.name);
        climbed.push(climb_patches(&p, plan, ladder)?);
    }
    let mut tracers = Vec::new();
    for ladder in paths {
        (plan.begins)(ladder.name);
        let (steps, tracer) = climb_paths(scene, &p.geometry.rays, 0.0, plan, ladder);
        climbed.push(steps);
        tracers.push((tracer, ladder.name));
    }
    let mask = tracers.iter().map(|(t, _)| t.mask()).reduce(|a, b| combine(&a, &b, |a, b| a * b));
    let mask = or_everywhere(mask.unwrap_or_default());
    let best: Vec<Answer> = tracers.iter().map(|(t, name)| traced_answer(t, name, &mask)).collect();
    drop(tracers);
    (plan.begins)("the patch methods once more, for the verdicts");
    let mut answers = patch_answers(&p, plan, patchwise, &mask)?;
    answers.extend(best);
    let ladders: Vec<&Ladder> = patchwise.iter().chain(paths).collect();
    Ok(compared(&ladders, climbed, answers, &mask))
}

/// Climbs from scratch at each step, and takes errors against references of far more effort.
fn chart(
    scene: &Scene,
    plan: &StudyPlan,
    patchwise: &[Ladder],
    paths: &[Ladder],
    references: impl FnOnce() -> Result<Vec<Truth>, StudyError>,
) -> Result<Measurements, StudyError> {
    let begin = |ladder: &Ladder| plan.watch.begin(ladder.name, ladder.steps.into());
    let p = Solver::new(scene).cut(PatchEffort::step(Method::Patches, 0, plan.seed).patches);
    let mut climbed = Vec::new();
    for ladder in patchwise {
        begin(ladder);
        climbed.push((ladder, climb_patches(&p, plan, ladder)?));
    }
    for ladder in paths {
        begin(ladder);
        let mut clock = Instant::now();
        let rays = Rays::new(scene);
        climbed.push((ladder, climb_paths(scene, &rays, lap(&mut clock), plan, ladder).0));
    }
    charted(climbed, references()?)
}

/// Climbs with patches: to tolerances, or cut anew for each step.
fn climb_patches(p: &Discretization, plan: &StudyPlan, ladder: &Ladder) -> Result<Vec<LadderStep>, StudyError> {
    let charted = plan.study == Study::Chart;
    let quiet = StudyPlan { watch: &Silent, ..*plan };
    climb(ladder, plan, |k| {
        if ladder.method == Method::Tolerance {
            return to_tolerance(&p.geometry.scene, plan, TOLERANCES[k as usize]).map(Some);
        }
        let effort = PatchEffort::step(ladder.method, k, plan.seed);
        let clock = Instant::now();
        let p = if charted { Solver::new(&p.geometry.scene).cut(effort.patches) } else { p.cut(effort.patches) };
        // The first step of a comparison always counts, whatever its memory.
        let assembles = ladder.method != Method::ShootingRays && (charted || k > 0);
        if assembles && check_fit(&p, plan, &effort).is_err() {
            return Ok(None);
        }
        let patches = clock.elapsed().as_secs_f64();
        let plan = if charted { &quiet } else { plan };
        let mut step = PatchWork { p: &p, plan, effort }.step(ladder.method)?;
        step.seconds.patches = patches;
        Ok(Some(step))
    })
}

fn to_tolerance(scene: &Scene, plan: &StudyPlan, tolerance: f64) -> Result<LadderStep, StudyError> {
    let found = within(scene, plan, tolerance, plan.seed)?;
    Ok(LadderStep {
        effort: format!("{} patches, {} rays in all", found.patches, found.rays),
        requested: Some(tolerance),
        estimated: Some(found.error.total),
        seconds: found.seconds,
        picture: found.picture,
        orders: Vec::new(),
    })
}

/// Every ladder's errors against the reference for its kind, and the front of all of them.
fn charted(climbed: Vec<(&Ladder, Vec<LadderStep>)>, truths: Vec<Truth>) -> Result<Measurements, StudyError> {
    let mut found = Measurements { truths, ..Measurements::default() };
    for (ladder, steps) in climbed {
        let judge = usize::from(!ladder.method.is_patchwise());
        let truth = &found.truths[judge..=judge];
        let points: Result<Vec<_>, _> = steps.into_iter().map(|step| measured(ladder, step, truth)).collect();
        found.climbs.push(Climb::new(ladder, points?, truth[0].made.by.clone()));
    }
    let front = found.front();
    let on_front: Vec<bool> = found.points().map(|p| front.iter().any(|best| std::ptr::eq(*best, p))).collect();
    for (point, on_front) in found.climbs.iter_mut().flat_map(|climb| &mut climb.points).zip(on_front) {
        point.on_front = on_front;
    }
    Ok(found)
}

/// Every ladder's errors against the answer of the other kind, and every pair's verdict.
fn compared(ladders: &[&Ladder], climbed: Vec<Vec<LadderStep>>, answers: Vec<Answer>, mask: &Picture) -> Measurements {
    let reference = |method| {
        let judge = ladders.iter().zip(&answers).find(|(ladder, _)| ladder.method == method);
        judge.map_or((Vec::new(), String::new()), |(_, a)| (a.truths(mask), format!("{}, {}", a.name, a.effort)))
    };
    let [series, next_event] = [Method::Neumann, Method::NextEvent].map(reference);
    let climb = |(ladder, steps): (&&Ladder, Vec<LadderStep>)| {
        let (truths, reference) = if ladder.method.is_patchwise() { &next_event } else { &series };
        let points = steps.into_iter().filter_map(|step| measured(ladder, step, truths).ok()).collect();
        Climb::new(ladder, points, reference.clone())
    };
    let climbs = ladders.iter().zip(climbed).map(climb).collect();
    let with = |(k, a)| answers[k + 1..].iter().map(move |b| judge(a, b, mask));
    let pairs = answers.iter().enumerate().flat_map(with).collect();
    Measurements { climbs, truths: Vec::new(), answers, pairs }
}

impl Climb {
    fn new(ladder: &Ladder, points: Vec<LadderPoint>, reference: String) -> Climb {
        Climb { ladder: *ladder, slope: slope(&points), points, reference }
    }
}

impl Measurements {
    /// All points, ladder after ladder.
    pub fn points(&self) -> impl Iterator<Item = &LadderPoint> + Clone {
        self.climbs.iter().flat_map(|climb| &climb.points)
    }

    /// The points of one method.
    pub fn of(&self, method: Method) -> impl Iterator<Item = &LadderPoint> {
        self.points().filter(move |p| p.ladder.method == method)
    }

    /// The slope over those points of the tolerance ladder whose tolerance is within a range.
    pub fn tolerance_slope(&self, range: RangeInclusive<f64>) -> Option<f64> {
        let factor = 1.0 + 1e-9;
        let within =
            |p: &&LadderPoint| p.requested.is_some_and(|a| a * factor >= *range.start() && a <= range.end() * factor);
        slope(self.of(Method::Tolerance).filter(within))
    }

    /// The least error of a patch method that its reference distinguishes from 0, by two standard errors.
    pub fn least_distinguished(&self) -> Option<f64> {
        let judged = self.points().filter(|p| p.ladder.method.is_patchwise()).map(|p| p.reached);
        let least = judged.map(|r| (r.high * r.high - r.error * r.error).max(0.0).sqrt());
        least.reduce(f64::min).filter(|&least| least > 0.0)
    }

    /// The points that none beats in both time and error, fastest first. A point whose error the reference cannot
    /// distinguish from 0 takes no part.
    pub fn front(&self) -> Vec<&LadderPoint> {
        let mut order: Vec<&LadderPoint> = self.points().filter(|p| p.reached.error > 0.0).collect();
        let place = |p: &LadderPoint| (p.seconds.total, p.reached.error);
        order.sort_by(|&a, &b| place(a).0.total_cmp(&place(b).0).then(place(a).1.total_cmp(&place(b).1)));
        let mut least = f64::INFINITY;
        order.retain(|p| {
            let better = p.reached.error < least;
            least = least.min(p.reached.error);
            better
        });
        order
    }

    /// The references, one where both are the same.
    pub fn references(&self) -> &[Truth] {
        match &self.truths[..] {
            [one, other] if one.files == other.files => &self.truths[..1],
            all => all,
        }
    }
}

#[cfg(test)]
/// Points of one ladder at these seconds and errors, the requested error twice the one reached.
pub(crate) fn made_up(places: &[(f64, f64)]) -> Measurements {
    use crate::compare::truth::Reached;
    use halflight::render::Seconds;
    let ladder = Ladder::CHARTED[0];
    let point = |&(total, error): &(f64, f64)| LadderPoint {
        ladder,
        effort: "some".into(),
        requested: Some(2.0 * error),
        estimated: Some(1.5 * error),
        reached: Reached { error, low: error, high: error },
        orders: Vec::new(),
        seconds: Seconds { gather: 0.75 * total, solve: 0.25 * total, total, ..Seconds::default() },
        on_front: false,
    };
    let climb = Climb::new(&ladder, places.iter().map(point).collect(), "nobody".into());
    Measurements { climbs: vec![climb], ..Measurements::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let found = made_up(&[(1.0, 0.1), (2.0, 0.2), (3.0, 0.0), (4.0, 0.01), (0.5, 0.3)]);
        let seconds: Vec<f64> = found.front().iter().map(|p| p.seconds.total).collect();
        assert_eq!(seconds, [0.5, 1.0, 4.0]);
    }

    #[test]
    fn slopes_are_exponents_within_the_requested_tolerances() {
        // Tolerances 20 %, 2 % and 0.2 %: slope -1 up to 2 %, -1/2 after it.
        let found = made_up(&[(1.0, 0.1), (10.0, 0.01), (1000.0, 0.001)]);
        let slope = |low, high| found.tolerance_slope(low..=high).unwrap();
        assert!((slope(0.02, 0.2) + 1.0).abs() < 1e-9);
        assert!((slope(0.002, 0.02) + 0.5).abs() < 1e-9);
        assert_eq!(found.tolerance_slope(0.5..=0.6), None);
    }
}
