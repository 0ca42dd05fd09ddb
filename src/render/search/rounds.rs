//! Light to a tolerance: patches and rays are chosen, the light is solved for, its error is estimated in a rough
//! picture, and that decides what comes next.
//!
//! The relative RMS error of the picture over the pixels that see no luminaire has four parts.
//!
//! * Noise of F: the rows are cast twice with independent scramblings and half the rays each; the picture of half the
//!   difference of the two solutions is the standard error.
//! * Size of patches: the solution on patches four times as large, from the same rays ([`crate::solve::coarse_terms`]).
//!   The error is of order 1.5 ([`ORDER`](crate::render::search::solved::ORDER)), so that of the finer patches is about
//!   half the difference.
//! * Truncation of the series: bounded.
//! * The gather pass: estimated by itself ([`crate::gather::GatherError`]).
//!
//! A rough gather of few pixels first shows the first two parts in the picture, not on the patches: what no pixel sees
//! and no visible surface receives does not count. A few pixels by many paths say whether that is all
//! ([`crate::render::search::residual_check`]). Until the errors are within their shares, all patches become smaller
//! and their rays more, or patches are divided by light ([`crate::render::search::division`]). Then the gather pass
//! gets what remains of the tolerance. Where memory ends first they stay as they are, which the stated error includes.
//!
//! Not handled: patches along lines of contact have no larger patch; detail that neither level of patches resolves.

use std::time::Instant;

use crate::gather::{GatherPass, Gathering};
use crate::light::budget::{FEW_PIXELS, FORM_FACTORS, PATCHES, left};
use crate::render::assembly::{Discretization, render};
use crate::render::fineness::Fineness;
use crate::render::goal::{PictureGoal, Spent, timed};
use crate::render::memory::Held;
use crate::render::narrow_light::NarrowLight;
use crate::render::pilot::fewer;
use crate::render::rendered::{Ended, Rendered};
use crate::render::search::both_sides::least_error;
use crate::render::search::division::Division;
use crate::render::search::layer_errors::LightErrors;
use crate::render::search::nearing_light::{NearingPicture, near_light};
use crate::render::search::residual_check::{Check, Finding};
use crate::render::search::solved::{Next, Rough, Solved, Task, half_of, patches_for};
use crate::scene::{Material, PunctualLight};
use crate::solve::Diverges;

/// Patches, and rays a patch, at most.
const FINEST: Fineness = Fineness { patches: 200_000, rays: 1 << 16 };
/// Pixels that show their errors together; a picture of fewer is the mean of one of more.
const ENOUGH: usize = 256;
/// Times that patches of one size are chosen.
const ROUNDS: usize = 5;
/// Two solutions, and F transposed.
const HELD: Held = Held { casts: 3, solutions: 1, bounces: None };
/// Share of the squared error, as measured at points, that patches half as wide may leave for more of them to be of
/// use: light that is smooth in patches leaves a quarter or less.
const HELPED: f64 = 0.5;
/// Share of the area whose patches have no larger one, beyond which the two levels show too little.
const ALONE: f64 = 0.2;
/// Times as many patches as a round cuts at most.
const MOST_FINER: f64 = 4.0;
/// How far below their shares the next round aims.
const MARGIN: f64 = 1.1;

/// Renders one mode to a tolerance, beginning with the patches of `first`. Work that is late ends after its round.
///
/// A picture of few pixels is the mean of a larger one: what a handful of pixels show of their own errors, each by one
/// difference of halves, is chance. One that walks of light contradict is made once more, with points where they land
/// ([`NarrowLight`]).
pub(crate) fn render_to_tolerance(first: &Discretization, task: &Task) -> Result<Rendered, Diverges> {
    let goal = task.goal;
    let step = goal.size.enlargement(ENOUGH);
    let tolerance = if step > 1 { FEW_PIXELS * goal.tolerance } else { goal.tolerance };
    let goal = &PictureGoal { size: goal.size.times(step), tolerance, ..*goal };
    let of_light = goal.of_light();
    let search = || Search::new(first, &Task { goal: &of_light, ..*task });
    let (solved, spent) = search().run()?.expect("what looks for no spots has light");
    let found = gather_light(solved, spent, (goal, step), task);
    if found.ended != Ended::Contradicted || goal.is_late() {
        return Ok(found);
    }
    let narrow = Search { narrow: Some(NarrowLight::default()), ..search() };
    let again = narrow.run()?.map(|(solved, spent)| gather_light(solved, spent, (goal, step), task));
    Ok(match again {
        Some(again) => found.or(again),
        None => found,
    })
}

/// The picture of a solution, to what is left of a tolerance, the mean over `step` by `step` pixels.
fn gather_light(solved: Solved, mut spent: Spent, (goal, step): (&PictureGoal, usize), task: &Task) -> Rendered {
    let watch = task.watch;
    let error_of_light = solved.error.sum().total;
    let error = left(goal.tolerance, error_of_light.powi(2));
    let within = Gathering::Within { error, camera: solved.camera, seed: goal.seed, limit: goal.limit() };
    let (layers, seconds) = timed(|| solved.layer_light());
    spent.seconds.solve += seconds;
    let ((fields, emitters), seconds) = timed(|| solved.picture_fields(&layers));
    spent.seconds.solve += seconds;
    let (light, seconds) = timed(|| LightErrors::new(&solved, &layers, goal, watch));
    spent.seconds.gather += seconds;
    drop(layers);
    let watch = &NearingPicture { watch, light: solved.error.total };
    let gather = || render(&solved.mode.lights, &fields, &GatherPass::new(goal.size, within), watch);
    let (gathered, seconds) = timed(gather);
    spent.seconds.gather += seconds;
    let ((least, cast), seconds) = timed(|| least_error(&solved, &gathered, goal, spent.rays + gathered.rays));
    spent.seconds.gather += seconds;
    spent.rays += cast;
    // More rays lessen no error of the light.
    let is_cut_short = gathered.rays >= goal.limit().rays && error_of_light < gathered.error.relative();
    let gathered = if step > 1 { gathered.averaged(step) } else { gathered };
    let scene = solved.mode.scene();
    let lit = scene.materials.iter().any(Material::emits) || scene.lights.iter().any(PunctualLight::shines);
    let signal = gathered.error.signal;
    let mut rendered = Rendered { emitters, ..solved.finish(gathered, spent) };
    if is_cut_short {
        rendered.ended = Ended::ByRays;
    }
    rendered.contradict(least, signal);
    light.state(&mut rendered, signal);
    if lit && rendered.is_black() {
        // Light that no ray found is no proof that there is none.
        rendered.error.gather = 1.0;
        rendered.error = rendered.error.sum();
    }
    rendered
}

/// How far errors exceed their shares of the tolerance; up to 1 they do not.
#[derive(Clone, Copy, Debug)]
struct Excess {
    /// Noise of F.
    noise: f64,
    /// The size of patches.
    size: f64,
}

/// Rounds of patches and rays, and what they showed so far.
pub(crate) struct Search<'a> {
    task: Task<'a>,
    patches: Discretization,
    /// Rays of a patch.
    rays: u32,
    spent: Spent,
    check: Option<Check>,
    /// Once patches are divided by light.
    division: Option<Division>,
    /// Rounds of patches of one size begun.
    count: usize,
    /// Whether this round has all the patches that memory allows, and whether any round had.
    is_full: bool,
    is_tight: bool,
    /// Whether the patches are as they were cut first.
    is_first: bool,
    /// Squared error of the light as the check measured it last.
    squared: f64,
    /// Where spots of narrow light are looked for.
    narrow: Option<NarrowLight>,
}

/// Whether a round of so many patches, after which more of them may be wanted, casts more rays than one that divides
/// them where light is uneven.
fn is_dear(next: Fineness) -> bool {
    next.patches as f64 * f64::from(next.rays) > Division::RAYS
}

impl<'a> Search<'a> {
    fn new(first: &Discretization, task: &Task<'a>) -> Search<'a> {
        Search {
            task: *task,
            patches: first.clone(),
            rays: Fineness::first(task.goal.tolerance).rays,
            spent: Spent::default(),
            check: None,
            division: None,
            count: 0,
            is_full: false,
            is_tight: false,
            is_first: true,
            squared: f64::INFINITY,
            narrow: None,
        }
    }

    /// Goes through the rounds to the last: its light, and what all took; none where spots are looked for and there are
    /// none.
    fn run(mut self) -> Result<Option<(Solved, Spent)>, Diverges> {
        loop {
            self.keep_within_memory();
            let (mut solved, spent) = Solved::new(&self.patches, &self.task, self.rays)?;
            self.spent.add(&spent);
            if let Some(narrow) = &mut self.narrow {
                if let Some(patches) = narrow.mend(&self.patches, &solved.mode, self.task.goal, &mut self.spent) {
                    self.patches = patches;
                    continue;
                }
                if self.patches.patches.spots().is_empty() {
                    return Ok(None);
                }
            }
            if solved.fields.is_dark() {
                return Ok(Some((solved, self.spent)));
            }
            let rough = self.look(&mut solved);
            match self.judge(solved, &rough) {
                Next::Accept(solved) => return Ok(Some((*solved, self.spent))),
                Next::Rays(rays) => self.rays = rays,
                Next::Finer(next) => self.cut(next),
                Next::Divide(solved, squared) => self.divide(*solved, squared, &rough),
            }
        }
    }

    /// Cuts fewer patches where memory would not do.
    fn keep_within_memory(&mut self) {
        if self.division.is_some() {
            return;
        }
        let Task { transport, goal, .. } = self.task;
        let sampling = half_of(self.rays, goal.seed, 0);
        let (found, seconds) = timed(|| fewer(&self.patches, transport, &sampling, HELD, goal.memory));
        self.spent.seconds.patches += seconds;
        self.count += 1;
        self.is_full = found.is_some();
        self.is_tight |= self.is_full;
        self.patches = found.unwrap_or_else(|| self.patches.clone());
    }

    /// A rough picture, which shows the errors of F and of patch size.
    fn look(&mut self, solved: &mut Solved) -> Rough {
        let Task { goal, watch, .. } = self.task;
        let (rough, seconds) = timed(|| solved.rough(goal, watch));
        self.spent.seconds.gather += seconds;
        self.spent.rays += rough.gathered.rays;
        solved.set_errors(&rough.gathered);
        near_light(watch, solved.error.sum().total, &rough, goal.tolerance);
        if self.division.is_some() {
            self.set_nearest(solved);
        }
        rough
    }

    /// Finds from how near light may be read.
    fn set_nearest(&mut self, solved: &mut Solved) {
        let (cast, seconds) = timed(|| solved.set_nearest(self.task.goal));
        self.spent.seconds.solve += seconds;
        self.spent.rays += cast;
    }

    /// What is to be done with a solution.
    fn judge(&mut self, solved: Solved, rough: &Rough) -> Next {
        self.task.watch.begin("paths", 0);
        match self.division.take() {
            Some(mut division) => {
                let check = self.check.as_mut().expect("patches were checked before they were divided");
                let next = division.judge(&self.task, self.rays, solved, rough, check, &mut self.spent);
                self.division = Some(division);
                next
            }
            None => self.judge_even(solved, rough),
        }
    }

    /// What is to be done with a solution on patches of one size, whose errors two levels of patches and two
    /// scramblings show; states what the check says of one that is accepted.
    fn judge_even(&mut self, solved: Solved, rough: &Rough) -> Next {
        let goal = self.task.goal;
        let patches = solved.patches().len();
        let mut excess = Excess {
            noise: solved.error.form_factors / (FORM_FACTORS * goal.tolerance),
            size: solved.error.patches / (PATCHES * goal.tolerance),
        };
        if self.is_first && solved.patches().alone() > ALONE {
            excess.size = excess.size.max(2.0);
        }
        let last = self.is_full || goal.is_late() || self.count == ROUNDS;
        let check = self.check.get_or_insert_with(|| Check::new(&solved, goal, &rough.gathered));
        check.compare_with(&rough.gathered);
        let is_within = |excess: Excess| excess.noise <= 1.0 && excess.size <= 1.0;
        let finding = check.find(&solved, goal, last || is_within(excess), &mut self.spent);
        if finding == Finding::Noisy && excess.noise > 1.0 && self.rays < FINEST.rays && !last {
            return Next::Rays(self.finer(patches, Excess { size: 0.0, ..excess }).rays);
        }
        let wrong = finding == Finding::Wrong;
        let squared = check.squared();
        let helped = squared < HELPED * std::mem::replace(&mut self.squared, squared);
        // Patches half as wide would be as many as triangles, and so could separate those.
        let are_separated = (solved.mode.scene().faces.len()..=FINEST.patches).contains(&(4 * patches));
        let next = self.finer(patches, Excess { size: f64::INFINITY, ..excess });
        if wrong && helped && !last && are_separated && !is_dear(next) {
            return Next::Finer(next);
        }
        if wrong && !self.is_tight {
            return Next::Divide(Box::new(solved), f64::INFINITY);
        }
        if helped {
            excess.size = excess.size.max(squared.sqrt() / (PATCHES * goal.tolerance));
        }
        if is_within(excess) || last || (excess.size > 1.0 && patches >= FINEST.patches) {
            return self.accept(solved, rough);
        }
        if patches_for(MARGIN * excess.size) > MOST_FINER && is_dear(next) && !self.is_tight {
            return Next::Divide(Box::new(solved), squared);
        }
        if excess.size > 1.0 {
            Next::Finer(self.finer(patches, excess))
        } else {
            Next::Rays(self.finer(patches, Excess { size: 0.0, ..excess }).rays)
        }
    }

    /// Accepts light on patches of one size, unless those divided by light may come nearer and memory is not what is
    /// short.
    fn accept(&mut self, mut solved: Solved, rough: &Rough) -> Next {
        let goal = self.task.goal;
        // Not before: rays that go on hide what patches mix, and dividing those serves all rays.
        self.set_nearest(&mut solved);
        let check = self.check.as_mut().expect("light is checked before it is accepted");
        check.confirm(&mut solved, goal, rough, &mut self.spent);
        let total = solved.error.sum().total;
        if total > goal.tolerance && !self.is_tight && !goal.is_late() {
            return Next::Divide(Box::new(solved), total * total);
        }
        Next::Accept(Box::new(solved))
    }

    /// The patches and rays that errors require: errors of patch size fall as the size to the power
    /// [`ORDER`](crate::render::search::solved::ORDER), noise of F as the root of all rays, at least.
    fn finer(&self, patches: usize, excess: Excess) -> Fineness {
        let more = patches_for(MARGIN * excess.size).clamp(1.0, MOST_FINER);
        let denser = (1.2 * excess.noise * excess.noise / more).clamp(1.0, 16.0);
        Fineness {
            patches: ((patches as f64 * more) as usize).min(FINEST.patches),
            rays: ((f64::from(self.rays) * denser) as u32).min(FINEST.rays),
        }
    }

    /// Cuts all surfaces anew into patches of one size.
    fn cut(&mut self, next: Fineness) {
        let (patches, seconds) = timed(|| self.patches.cut(next.patches));
        self.spent.seconds.patches += seconds;
        (self.patches, self.rays, self.is_first) = (patches, next.rays, false);
    }

    /// Divides the patches by light on them.
    fn divide(&mut self, solved: Solved, squared: f64, rough: &Rough) {
        let (task, spent) = (&self.task, &mut self.spent);
        let began = Instant::now();
        let division = self.division.get_or_insert_with(|| {
            self.rays = Division::first_rays(task.goal.tolerance);
            Division::new(task, &solved, rough, spent)
        });
        self.rays = division.rays(self.rays);
        let samples = division.samples(task, solved, squared, began, spent);
        let (patches, seconds) = timed(|| self.patches.divided(samples));
        self.spent.seconds.patches += seconds;
        self.patches = patches;
    }
}
