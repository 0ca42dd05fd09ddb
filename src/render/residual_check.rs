//! Whether patches of one size stand for a scene at all, as measured at points: the two levels of patches agree where
//! both are wrong alike, the residual does not ([`crate::gather::Residual`]).
//!
//! A few paths find errors as large as what is asked for; where they find one, more paths make sure of it.
//!
//! Not handled: errors that few paths cannot tell from none; the larger of both estimates is stated.

use std::time::Instant;

use crate::gather::{
    Effort, Gathered, ImportancePaths, READINGS, Reading, Residual, ResidualSums, SampledPixels, SquaredError,
};
use crate::render::assembly::Prepared;
use crate::render::judgement::{Finding, Judgement};
use crate::render::reading_cost::ReadingCost;
use crate::render::solved::{Rough, Solved, Spent};
use crate::render::wanted::Wanted;

/// Paths at first at a tolerance of 2 %, more in proportion at smaller ones; at most, where an error is suspected or
/// small places tell too little; and at most where even the largest blocks of pixels do.
const PATHS: (f64, f64, f64) = (5_000.0, 65_536.0, 786_432.0);
/// Times as many paths at most that are followed before they are asked again, and bytes that they may take.
const STEP: usize = 4;
pub(crate) const HELD: usize = 1_500_000_000;
/// Paths of a pixel over those of all in the mean, at least and at most.
const LEAST: f32 = 0.25;
const MOST: f32 = 16.0;
/// Share of the tolerance that the light on patches, as the gather pass reads it, may be off by.
const SHARE: f64 = 0.5;
/// Share of the tolerance that an error must exceed to matter.
const MATTERS: f64 = 0.7;
/// Share of the tolerance that the standard error of an error is to be below, for it to be stated as it was measured.
const SURE: f64 = 0.5;
/// The same where a few pixels tell it.
const DRAWN: f64 = 0.35;
/// Standard errors beyond which an error is certain.
const CERTAIN: f64 = 3.0;
/// Squared error over what the two levels and the noise of F say, beyond which they are contradicted.
const BEYOND: f64 = 2.0;

/// Paths that check solutions on any patches.
pub(crate) struct Check {
    walks: ImportancePaths,
    /// A few pixels of the picture itself.
    pixels: SampledPixels,
    /// Paths of a pixel at most, and at most where no error can be told without more.
    most: [u32; 2],
    /// Squared RMS of the picture.
    signal: f64,
    /// What the paths say of the solution judged last.
    found: Option<Residual>,
}

impl Check {
    /// A few paths through the rough picture of a solution.
    pub fn new(p: &Prepared, solved: &Solved, wanted: &Wanted, rough: &Gathered, spent: &mut Spent) -> Check {
        let clock = Instant::now();
        let view = solved.rough_view(p, wanted);
        let bright = brightness(rough);
        let drawn = solved.pixels(p, wanted, &bright);
        let mut walks = ImportancePaths::new(&view, bright, wanted.seed ^ 0x2c1b_3c6d);
        let pixels = (view.width * view.height) as f64;
        let paths = PATHS.0 * (0.02 / wanted.tolerance).clamp(0.5, 4.0);
        let each = |paths: f64| (paths / pixels).ceil() as u32;
        walks.extend(&view, each(paths));
        spent.rays += walks.rays;
        spent.seconds.solve += clock.elapsed().as_secs_f64();
        Check {
            most: [PATHS.1, PATHS.2].map(each),
            walks,
            pixels: drawn,
            signal: rough.error.signal.powi(2),
            found: None,
        }
    }

    /// Errors are told beside the signal of this rough picture from now on.
    pub fn compare_with(&mut self, rough: &Gathered) {
        self.signal = rough.error.signal.powi(2);
    }

    /// Whether the light is off by more than its two levels of patches and its noise say, and by more than is
    /// tolerable.
    ///
    /// Where nothing is left to do but to `accept` the light and the paths tell too little, a few pixels of the picture
    /// are asked, then more paths.
    pub fn find(&mut self, p: &Prepared, solved: &Solved, wanted: &Wanted, accept: bool, spent: &mut Spent) -> Finding {
        if self.signal == 0.0 {
            return Finding::Agrees;
        }
        let clock = Instant::now();
        let mut drawn = None;
        let mut sums = ResidualSums::new(&self.walks);
        let finding = loop {
            let began = Instant::now();
            sums.take(&self.walks, &p.patches, &solved.fields);
            let mut residual = sums.residual().beside(drawn);
            let mut judgement = self.judge(&residual, solved, wanted);
            if accept && judgement.is_blind() && drawn.is_none() {
                drawn = Some(self.draw(p, solved, wanted, spent));
                residual = residual.beside(drawn);
                judgement = self.judge(&residual, solved, wanted);
            }
            let paths = judgement.paths(self.walks.each(), self.most, accept);
            self.found = Some(residual);
            let step = (HELD / self.walks.bytes().max(1)).min(STEP) as u32;
            let paths = paths.min(step * self.walks.each());
            if paths <= self.walks.each() || wanted.would_be_late(began) {
                break judgement.finding;
            }
            let before = self.walks.rays;
            self.walks.extend(&solved.rough_view(p, wanted), paths - self.walks.each());
            spent.rays += self.walks.rays - before;
        };
        spent.seconds.solve += clock.elapsed().as_secs_f64();
        finding
    }

    /// What a few pixels tell of a solution.
    fn draw(&mut self, p: &Prepared, solved: &Solved, wanted: &Wanted, spent: &mut Spent) -> [SquaredError; READINGS] {
        let certain = self.signal * (DRAWN * wanted.tolerance).powi(2);
        solved.drawn(
            p,
            wanted,
            &mut self.pixels,
            Effort { wanted: certain, most: PATHS.1 as usize, deadline: wanted.deadline },
            spent,
        )
    }

    /// The squared error of the solution judged last, relative to the picture's, over the blocks surest of one, less a
    /// standard error.
    pub fn squared(&self) -> f64 {
        let found = self.found.as_ref().map_or_else(SquaredError::default, |residual| self.share(surest(residual)));
        (found.value - found.deviation).max(0.0)
    }

    /// What the paths so far say of the light.
    fn judge(&self, residual: &Residual, solved: &Solved, wanted: &Wanted) -> Judgement {
        let found = self.share(surest(residual));
        let matters = (MATTERS * wanted.tolerance).powi(2);
        let [noise, patches] = [solved.error.form_factors, solved.error.patches].map(|e| BEYOND * e.powi(2));
        let tolerable = matters.max(noise + patches);
        let least = found.value - found.deviation;
        let finding = if least > tolerable {
            Finding::Wrong
        } else if least > matters.max(patches) {
            Finding::Noisy
        } else {
            Finding::Agrees
        };
        let small = self.share(residual.of_sizes(Reading::PLAIN).next().unwrap_or_default());
        let certain = (SURE * wanted.tolerance).powi(2);
        let told = self.share(residual.of(Reading::PLAIN, self.signal * certain));
        Judgement {
            finding,
            is_certain: finding == Finding::Wrong && found.value > CERTAIN * found.deviation,
            is_suspicious: found.value > tolerable.max(found.deviation),
            blindness: [small, told].map(|s| s.deviation / certain),
        }
    }

    /// Chooses how the light is read, and states its error: if more than its share is certain, by the reading that the
    /// picture is the cheapest with; else the light is read at once.
    ///
    /// Read at once, its error is the larger of what the two levels of patches say and what the paths last judged do:
    /// by a few pixels with their standard error, or over the smallest blocks of pixels that tell it well enough, or
    /// what larger ones are sure of.
    pub fn confirm(&mut self, p: &Prepared, solved: &mut Solved, wanted: &Wanted, rough: &Rough, spent: &mut Spent) {
        let Some(found) = &self.found else { return };
        let cost = ReadingCost::new(rough, wanted, self.walks.prices(&p.patches, &solved.fields));
        if solved.fields.is_read_at_once() {
            return self.state(found, solved, wanted, &cost);
        }
        let clock = Instant::now();
        let residual = self.walks.residual(&p.patches, &solved.fields);
        let drawn = (self.pixels.rays() > 0).then(|| self.draw(p, solved, wanted, spent));
        let residual = residual.beside(drawn);
        spent.seconds.solve += clock.elapsed().as_secs_f64();
        self.state(&residual, solved, wanted, &cost);
    }

    /// The same from what paths tell of the light as rays read it.
    fn state(&self, residual: &Residual, solved: &mut Solved, wanted: &Wanted, cost: &ReadingCost) {
        let certain = (SURE * wanted.tolerance).powi(2);
        let goal = (SHARE * wanted.tolerance).powi(2);
        let told = self.share(residual.of(Reading::PLAIN, self.signal * certain));
        if told.value - told.deviation > goal {
            let squared = Reading::ALL.map(|reading| residual.upper(reading, self.signal * certain) / self.signal);
            let now = cost.cheapest(squared);
            if now.rays.is_finite() {
                solved.reading = now.reading;
                return solved.state(squared[now.reading.number()]);
            }
        }
        let surest = self.share(surest(residual));
        let sure = surest.value - surest.deviation;
        // What they cannot tell may be as large; nor do few pixels stand for all.
        let unsure = if told.deviation > certain || residual.has_drawn() { told.deviation } else { 0.0 };
        let error = (told.value.max(0.0) + unsure).max(sure);
        // The paths see the noise of F as well, which is stated beside.
        let noise = solved.error.form_factors.powi(2);
        let patches = (error - noise).max(0.0).sqrt();
        solved.error.patches = solved.error.patches.max(patches);
    }

    fn share(&self, squared: SquaredError) -> SquaredError {
        SquaredError { value: squared.value / self.signal, deviation: squared.deviation / self.signal }
    }
}

/// The squared error of light that is read at once, over the blocks of pixels that are surest of one: errors of small
/// places show in small blocks only.
fn surest(residual: &Residual) -> SquaredError {
    let sure = |s: &SquaredError| s.value - CERTAIN * s.deviation;
    let sizes = residual.of_sizes(Reading::PLAIN);
    sizes.max_by(|a, b| sure(a).total_cmp(&sure(b))).unwrap_or_default()
}

/// The light of every pixel of a rough picture over their mean, within limits: dark pixels are looked at too, and
/// luminaires are no part of the error.
pub(crate) fn brightness(rough: &Gathered) -> Vec<f32> {
    let (picture, lamps) = (rough.total(), &rough.emission);
    let light = picture.pixels.iter().zip(&lamps.pixels);
    let own = light.map(|(l, e)| if e.max_element() > 0.0 { 0.0 } else { l.element_sum() });
    let own: Vec<f32> = own.collect();
    let mean = own.iter().sum::<f32>() / own.len().max(1) as f32;
    let within = |l: &f32| (l / mean.max(f32::MIN_POSITIVE)).clamp(LEAST, MOST);
    own.iter().map(within).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::gather::{Direct, READINGS};
    use crate::light::Mode;
    use crate::rays::sobol::hash;
    use crate::render::assembly::{Silent, prepare};
    use crate::render::solved::{Task, solve};
    use crate::scene::Scene;

    const TOLERANCE: f64 = 0.02;
    const ASKED: Reading = Reading { bounces: 0, direct: Direct::Asked };

    /// Errors of 16 x 16 pixels, relative to a picture of 1, `plain` if light is read at once and none if direct light
    /// is asked for; with noise in the halves.
    fn residual(plain: f64, noise: f64) -> Residual {
        let error = |reading: usize| if reading == ASKED.number() { 0.0 } else { plain };
        let pixel = |k: u32| {
            let of = |half: u32| if hash(k, half).is_multiple_of(2) { noise } else { -noise };
            std::array::from_fn(|reading| [0, 1].map(|half| DVec3::splat(error(reading) + of(half))))
        };
        let pixels: Vec<[[DVec3; 2]; READINGS]> = (0..256).map(pixel).collect();
        Residual::of_pixels(&pixels, 16)
    }

    /// A solution of the Cornell box with its check, whose picture is 1 in all pixels.
    struct Checked {
        wanted: Wanted,
        solved: Solved,
        check: Check,
        cost: ReadingCost,
    }

    fn checked() -> Checked {
        let p = prepare(Scene::open("cornell-box").expect("a scene"), 200);
        let (tolerance, size) = (TOLERANCE, (16, 16).into());
        let wanted = Wanted { tolerance, size, deadline: None, memory: f64::INFINITY, seed: 0 };
        let task = Task { transport: Mode::Global.transport(), wanted: &wanted, watch: &Silent };
        let mut spent = Spent::default();
        let solved = solve(&p, &task, 256, &mut spent).expect("converges");
        let rough = solved.rough(&p, &wanted, &mut spent, &Silent);
        let check = Check { signal: 1.0, ..Check::new(&p, &solved, &wanted, &rough.gathered, &mut spent) };
        let cost = ReadingCost::new(&rough, &wanted, check.walks.prices(&p.patches, &solved.fields));
        Checked { wanted, solved, check, cost }
    }

    /// A street at night stated 0.62 % with 1.2 true: lamps beside what they light, whose direct light patches mixed.
    /// Two levels of patches did not tell; the paths did, and nothing came of it.
    #[test]
    fn direct_light_is_asked_for_where_patches_certainly_mix_it() {
        let confirmed = |found: Residual| {
            let Checked { wanted, mut solved, check, cost } = checked();
            check.state(&found, &mut solved, &wanted, &cost);
            (solved.reading, solved.error.sum().total)
        };
        // More than half of the tolerance is certain.
        let (reading, stated) = confirmed(residual(0.8 * TOLERANCE, 0.0));
        assert_eq!(reading, ASKED);
        assert!(stated < SHARE * TOLERANCE, "{stated}");
        // Less than half is as it may be.
        let (reading, stated) = confirmed(residual(0.3 * TOLERANCE, 0.0));
        assert_eq!(reading, Reading::PLAIN);
        assert!(stated >= 0.299 * TOLERANCE, "{stated}");
        // Noise may be all of it; what it hides may be as large.
        let (reading, stated) = confirmed(residual(0.8 * TOLERANCE, 20.0 * TOLERANCE));
        assert_eq!(reading, Reading::PLAIN);
        assert!(stated > SURE * TOLERANCE, "{stated}");
    }

    /// A bathroom's first rays left noise of 7.8 %, which explained what the paths saw: it was cut into more patches of
    /// the same kind, which took twice as long and stated 3.7 % with 4.8 true, where other seeds divided them.
    #[test]
    fn noise_that_may_explain_an_error_is_lessened_before_patches_are_judged() {
        let Checked { wanted, mut solved, check, .. } = checked();
        let mut finding = |found: f64, noise: f64, patches: f64| {
            (solved.error.form_factors, solved.error.patches) = (noise * TOLERANCE, patches * TOLERANCE);
            check.judge(&residual(found * TOLERANCE, 0.0), &solved, &wanted).finding
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
