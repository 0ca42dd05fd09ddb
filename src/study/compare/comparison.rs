//! Whether five ways to one picture agree: every method climbs in the same time, every error is taken, every pair
//! judged.
//!
//! Patch methods (the Neumann series over K, progressive shooting over K and with rays alone) are held against the path
//! tracer with next-event estimation, path tracers against the Neumann series: a reference is never of the kind under
//! test, and its own noise is subtracted. Verdicts rest on [answers](patch_answers) of their own. The hierarchy of rays
//! is built once, and its time counts for no method.
//!
//! Not handled: adaptive fineness; scenes whose series diverges.

use std::time::Instant;

use crate::pictures::Picture;
use crate::render::{Prepared, prepare};
use crate::scene::Scene;
use crate::solve::Diverges;
use crate::study::compare::answer::Answer;
use crate::study::compare::arithmetic::combine;
use crate::study::compare::ladder::{
    Ladder, LadderPoint, LadderStep, Method, StudyError, StudyPlan, climb, measured, slope,
};
use crate::study::compare::patch_answers::patch_answers;
use crate::study::compare::patch_pictures::{PatchEffort, check_fit, cut_within, patch_step};
use crate::study::compare::traced_pictures::{climb_paths, traced_answer};
use crate::study::compare::truth::{Truth, or_everywhere};
use crate::study::compare::verdict::{Pair, judge};

/// What a method reached.
#[derive(Clone, Debug)]
pub struct Reach {
    /// The method's name.
    pub name: &'static str,
    /// What the errors are taken against.
    pub reference: String,
    /// Errors after each step of the ladder; none where the reference is black.
    pub points: Vec<LadderPoint>,
    /// Slope of log error over log seconds.
    pub slope: Option<f64>,
    /// The best, with its errors estimated: what verdicts rest on.
    pub answer: Answer,
}

/// The result.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// What each method reached, in the order of [`Ladder::COMPARED`].
    pub methods: Vec<Reach>,
    /// Every pair's verdict.
    pub pairs: Vec<Pair>,
}

/// Runs every method; `tell` hears which begins.
///
/// # Errors
/// [`StudyError`] where the series diverges, and where memory would not do.
pub fn compare(scene: &Scene, plan: &StudyPlan, tell: &dyn Fn(&str)) -> Result<Comparison, StudyError> {
    let least = PatchEffort::least(plan);
    let mut p = prepare(scene.clone(), least.patches);
    check_fit(&p, plan, &least)?;
    let (patchwise, tracers) = Ladder::COMPARED.split_at(3);
    // A diverging series is found before any path is traced.
    let mut climbed = Vec::new();
    for ladder in patchwise {
        tell(ladder.name);
        climbed.push(climb_patches(&mut p, plan, ladder)?);
    }
    let traced = tracers.iter().map(|ladder| {
        tell(ladder.name);
        climb_paths(scene, &p.rays, 0.0, plan, ladder)
    });
    let (steps, tracers): (Vec<_>, Vec<_>) = traced.unzip();
    climbed.extend(steps);
    let mask = or_everywhere(combine(&tracers[0].mask(), &tracers[1].mask(), |a, b| a * b));
    let names = Ladder::COMPARED[3..].iter().map(|ladder| ladder.name);
    let best: Vec<Answer> = tracers.iter().zip(names).map(|(t, name)| traced_answer(t, name, &mask)).collect();
    drop(tracers);
    tell("the patch methods once more, for the verdicts");
    let mut answers = patch_answers(&mut p, plan, patchwise, &mask)?;
    answers.extend(best);
    let pairs = pairs(&answers, &mask);
    Ok(Comparison { methods: reaches(climbed, answers, &mask), pairs })
}

/// Climbs with patches cut anew for each step; the first always counts, whatever its memory.
fn climb_patches(p: &mut Prepared, plan: &StudyPlan, ladder: &Ladder) -> Result<Vec<LadderStep>, Diverges> {
    climb(ladder, plan, |k| {
        let effort = PatchEffort::step(ladder.method, k, plan.seed);
        let clock = Instant::now();
        if k == 0 || ladder.method == Method::ShootingRays {
            p.recut(effort.patches);
        } else if cut_within(p, plan, &effort).is_err() {
            return Ok(None);
        }
        let cutting = clock.elapsed().as_secs_f64();
        let mut step = patch_step(p, plan, ladder.method, &effort)?;
        step.seconds.patches = cutting;
        Ok(Some(step))
    })
}

/// Every method's errors against the answer of the other kind.
fn reaches(climbed: Vec<Vec<LadderStep>>, answers: Vec<Answer>, mask: &Picture) -> Vec<Reach> {
    let reference = |method| Ladder::COMPARED.iter().position(|ladder| ladder.method == method);
    let [series, next_event] = [Method::Neumann, Method::NextEvent].map(|method| {
        let answer = &answers[reference(method).expect("it is compared")];
        (answer.truths(mask), format!("{}, {}", answer.name, answer.effort))
    });
    let reach = |((ladder, steps), answer): ((&Ladder, Vec<LadderStep>), Answer)| {
        let (truths, reference): &(Vec<Truth>, String) =
            if ladder.method.is_patchwise() { &next_event } else { &series };
        let points: Vec<LadderPoint> = steps.into_iter().filter_map(|s| measured(ladder, s, truths).ok()).collect();
        Reach { name: ladder.name, reference: reference.clone(), slope: slope(&points), points, answer }
    };
    Ladder::COMPARED.iter().zip(climbed).zip(answers).map(reach).collect()
}

fn pairs(answers: &[Answer], mask: &Picture) -> Vec<Pair> {
    let with = |(k, a)| answers[k + 1..].iter().map(move |b| judge(a, b, mask));
    answers.iter().enumerate().flat_map(with).collect()
}
