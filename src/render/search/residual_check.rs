//! Whether patches of one size stand for a scene at all, as measured at points: the two levels of patches agree where
//! both are wrong alike, the residual does not ([`crate::error::residual`]).
//!
//! A few pixels, each by many paths, estimate the squared error of the picture with its standard error. More of both
//! make sure of an error that is suspected, and of light that is to be accepted.
//!
//! Not handled: errors below the standard error of few paths; it is stated.

use crate::error::sampled_pixels::Brightness;
use crate::error::{SampledPixels, SamplingGoal, SquaredError};
use crate::gather::Gathered;
use crate::light::budget::{MATTERS, SURE};
use crate::rays::purpose::Purpose;
use crate::render::goal::{PictureGoal, Spent, timed};
use crate::render::search::picture_cost::PictureCost;
use crate::render::search::solved::{Rough, Solved, rough_size};

/// Paths at first, and at most where an error is suspected or light is to be accepted, at a tolerance of 2 % or less;
/// of those fewer in proportion at larger ones.
const PATHS: [usize; 2] = [1 << 13, 1 << 16];
/// Paths of a pixel over those of all in the mean, at least and at most.
const DENSITY: (f32, f32) = (0.25, 16.0);
/// Standard errors beyond which an error is certain.
const CERTAIN: f64 = 3.0;
/// Squared error over what the two levels and the noise of F say, beyond which they are contradicted.
const BEYOND: f64 = 2.0;

/// What sampled pixels show of the light on patches, next to what two levels of patches and two scramblings show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Finding {
    /// No more, or nothing that matters.
    Agrees,
    /// More: patches of this size do not stand for the scene.
    Wrong,
    /// An error that matters, which noise of F alone may explain: with fewer rays than this patches cannot be judged.
    Noisy,
}

/// What pixels say of a solution.
struct Judgement {
    finding: Finding,
    /// Chance does not explain that.
    is_certain: bool,
    /// It may be.
    is_suspicious: bool,
}

/// Pixels that check solutions on any patches.
pub(crate) struct Check {
    pixels: SampledPixels,
    /// Squared RMS of the picture.
    signal: f64,
    /// What pixels say of the solution judged last, relative to the picture's square.
    found: SquaredError,
}

impl Check {
    /// Of a solution whose rough picture is given.
    pub(crate) fn new(solved: &Solved, goal: &PictureGoal, rough: &Gathered) -> Check {
        let bright = brightness(rough);
        let bright = Brightness { values: &bright, size: rough_size(goal.size) };
        let pixels = SampledPixels::new(&solved.view(goal), bright, Purpose::SampledPixels.seed(goal.seed));
        Check { pixels, signal: rough.error.signal.powi(2), found: Default::default() }
    }

    /// Errors are relative to the signal of this rough picture from now on.
    pub(crate) fn compare_with(&mut self, rough: &Gathered) {
        self.signal = rough.error.signal.powi(2);
    }

    /// Whether the light is off by more than its two levels of patches and its noise say, and by more than is
    /// tolerable.
    ///
    /// Where the light is to be accepted more paths are followed until the error is certain.
    pub(crate) fn find(&mut self, solved: &Solved, goal: &PictureGoal, accept: bool, spent: &mut Spent) -> Finding {
        if self.signal == 0.0 {
            return Finding::Agrees;
        }
        let [first, most] = PATHS;
        let most = (most as f64 * (0.02 / goal.tolerance).min(1.0)) as usize;
        self.measure(solved, goal, first, spent);
        let mut judgement = self.judge(solved, goal);
        if !judgement.is_certain && (accept || judgement.is_suspicious) {
            self.measure(solved, goal, most, spent);
            judgement = self.judge(solved, goal);
        }
        judgement.finding
    }

    /// The squared error of a solution, relative to the picture's square, from so many paths at most; no
    /// more of them where there is no time.
    pub(crate) fn measure(
        &mut self,
        solved: &Solved,
        goal: &PictureGoal,
        most: usize,
        spent: &mut Spent,
    ) -> SquaredError {
        let certain = self.signal * (SURE * goal.tolerance).powi(2);
        let most = if goal.is_late() { 0 } else { most };
        let effort = SamplingGoal { wanted: certain, most, deadline: goal.deadline };
        let before = self.pixels.rays();
        let (found, seconds) = timed(|| self.pixels.measure(&solved.view(goal), &solved.fields, effort));
        spent.rays += self.pixels.rays() - before;
        spent.seconds.solve += seconds;
        self.found = found.over(self.signal);
        self.found
    }

    /// What a gather ray takes until it has read, in rays.
    pub(crate) fn price(&self, solved: &Solved) -> f64 {
        self.pixels.price(solved.patches(), &solved.fields)
    }

    /// The squared error of the solution judged last, less a standard error.
    pub(crate) fn squared(&self) -> f64 {
        self.found.lower()
    }

    /// What the pixels say of the light.
    fn judge(&self, solved: &Solved, goal: &PictureGoal) -> Judgement {
        let found = self.found;
        let matters = (MATTERS * goal.tolerance).powi(2);
        let [noise, patches] = [solved.error.form_factors, solved.error.patches].map(|e| BEYOND * e.powi(2));
        let tolerable = matters.max(noise + patches);
        let finding = if found.lower() > tolerable {
            Finding::Wrong
        } else if found.lower() > matters.max(patches) {
            Finding::Noisy
        } else {
            Finding::Agrees
        };
        Judgement {
            finding,
            is_certain: finding == Finding::Wrong && found.value > CERTAIN * found.deviation,
            is_suspicious: found.value > tolerable.max(found.deviation),
        }
    }

    /// States the error of the light as rays read it, the larger of what the two levels of patches say and of the
    /// pixels sampled last, with their standard error; and what camera rays are to make of the rest.
    pub(crate) fn confirm(&mut self, solved: &mut Solved, goal: &PictureGoal, rough: &Rough, spent: &mut Spent) {
        if self.signal == 0.0 {
            return;
        }
        if !solved.fields.is_read_at_once() {
            self.measure(solved, goal, 0, spent);
        }
        self.state(solved);
        let cost = PictureCost::new(rough, goal, self.price(solved));
        solved.camera = cost.priced(solved.error.sum().total.powi(2)).camera;
    }

    /// States the sampled error, in which the noise of F is as well, which is stated separately.
    fn state(&self, solved: &mut Solved) {
        let noise = solved.error.form_factors.powi(2);
        let patches = (self.found.upper() - noise).max(0.0).sqrt();
        solved.error.patches = solved.error.patches.max(patches);
    }
}

/// The light of every pixel of a rough picture over their mean, within limits: dark pixels are sampled too, and
/// luminaires are no part of the error.
pub(crate) fn brightness(rough: &Gathered) -> Vec<f32> {
    let (picture, emission) = (rough.total(), &rough.emission);
    let light = picture.pixels.iter().zip(&emission.pixels);
    let own = light.map(|(l, e)| if e.max_element() > 0.0 { 0.0 } else { l.element_sum() });
    let own: Vec<f32> = own.collect();
    let mean = own.iter().sum::<f32>() / own.len().max(1) as f32;
    let within = |l: &f32| (l / mean.max(f32::MIN_POSITIVE)).clamp(DENSITY.0, DENSITY.1);
    own.iter().map(within).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Mode;
    use crate::render::assembly::{Discretization, Silent};
    use crate::render::layers::Apart;
    use crate::render::rendered::LightOnPatches;
    use crate::render::search::solved::Task;
    use crate::scene::Scene;

    const TOLERANCE: f64 = 0.02;

    /// The estimate of pixels that sample an error, relative to the picture, with a standard error of the square of
    /// `noise`.
    fn found(error: f64, noise: f64) -> SquaredError {
        SquaredError { value: error * error, deviation: noise * noise }
    }

    /// A solution of the Cornell box with its check, whose picture is 1 in all pixels.
    struct Checked {
        goal: PictureGoal,
        solved: Solved,
        check: Check,
    }

    fn checked() -> Checked {
        let p = Discretization::new(Scene::open("cornell-box").expect("a scene"), 200);
        let (tolerance, size) = (TOLERANCE, (16, 16).into());
        let goal = PictureGoal { tolerance, size, deadline: None, memory: f64::INFINITY.into(), seed: 0 };
        let task = Task {
            transport: Mode::Global.transport(),
            goal: &goal,
            apart: Apart::default(),
            on_patches: LightOnPatches::LeftOut,
            watch: &Silent,
        };
        let (solved, mut spent) = Solved::new(&p, &task, 256).expect("converges");
        let rough = solved.rough(&goal, &Silent);
        let mut check = Check::new(&solved, &goal, &rough.gathered);
        check.find(&solved, &goal, false, &mut spent);
        Checked { goal, solved, check }
    }

    /// As in a street at night: patches mix the direct light of luminaires close to what they light, which two levels
    /// of patches do not show (0.62 % with 1.2 true) and paths do.
    #[test]
    fn what_paths_show_is_stated_with_its_standard_error() {
        let stated = |error: f64, noise: f64| {
            let Checked { mut solved, mut check, .. } = checked();
            solved.error.patches = 0.3 * TOLERANCE;
            check.found = found(error * TOLERANCE, noise * TOLERANCE);
            check.state(&mut solved);
            solved.error.sum().total / TOLERANCE
        };
        assert!(stated(0.8, 0.0) >= 0.799, "{}", stated(0.8, 0.0));
        // What two levels say counts where paths say less, and what noise hides may be as large.
        assert!(stated(0.1, 0.0) >= 0.299 && stated(0.8, 1.0) > 1.0);
    }

    /// A bathroom's first rays left noise of 7.8 %, which explained what the paths saw: it was cut into more patches of
    /// the same kind, which took twice as long and stated 3.7 % with 4.8 true, where other seeds divided them.
    #[test]
    fn noise_that_may_explain_an_error_is_lessened_before_patches_are_judged() {
        let Checked { goal, mut solved, mut check, .. } = checked();
        let mut finding = |error: f64, noise: f64, patches: f64| {
            (solved.error.form_factors, solved.error.patches) = (noise * TOLERANCE, patches * TOLERANCE);
            check.found = found(error * TOLERANCE, 0.0);
            check.judge(&solved, &goal).finding
        };
        assert_eq!(finding(1.9, 1.6, 0.0), Finding::Noisy);
        // Twice the squared error of the rounds is less.
        assert_eq!(finding(1.9, 0.2, 0.2), Finding::Wrong);
        // The two levels of patches know of it, so smaller ones will lessen it.
        assert_eq!(finding(1.9, 0.0, 1.6), Finding::Agrees);
        // It does not matter.
        assert_eq!(finding(0.6, 1.6, 0.0), Finding::Agrees);
    }
}
