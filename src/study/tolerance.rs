//! A picture to a wanted accuracy: the error is estimated while running, and effort goes where it buys most.
//!
//! The relative RMS error of the picture over the pixels that see no luminaire has four parts.
//!
//! * Noise of F: the rows are cast twice with independent scramblings and half the rays each; the picture of half the
//!   difference of the two solutions is the standard error.
//! * Size of patches: the solution on patches four times as large, from the same rays ([`crate::solve::coarse_terms`]). The error is
//!   between first and second order, so that of the finer patches is about half the difference.
//! * Truncation of the series: bounded.
//! * The gather pass: estimated by itself ([`crate::image::GatherError`]).
//!
//! A rough gather of few pixels first tells the first two parts in the picture, not on the patches: what no pixel sees
//! and no visible surface receives does not count. Patches and rays grow until both are within their shares. Then the
//! gather pass gets what is left of the tolerance. Where memory ends first they stay as they are, and the error says so.
//!
//! Not handled: patches along lines of contact have no larger patch; detail that neither level of patches resolves.

use std::sync::Arc;
use std::time::Instant;

use super::look::{ambient, look, reflected};
use super::memory::keep_within;
use super::pipeline::{Assembled, Prepared, Seconds, Watch, assemble_seeing, sight};
use super::within::{ErrorParts, Within};
use crate::form_factors::{Sampling, Sight};
use crate::image::{Fields, GatherSampling, Gathered, Gathering, Linear, linear};
use crate::light::{Rgb, Transport};
use crate::patches::Neighbours;
use crate::solve::{Diverges, Settings, Solution, coarse_terms, neumann, norm};

/// Shares of the tolerance that noise of F, and patch size, may take.
const FORM_FACTORS: f64 = 0.35;
const PATCHES: f64 = 0.4;
/// Share of the tolerance at which the series is cut.
const TRUNCATION: f64 = 0.02;
/// Share of what is left that the gather pass aims at: its own estimate has an error too.
const GATHER: f64 = 0.9;
/// Patches and rays a patch at first, at a tolerance of 1 %.
const FIRST: (f64, f64) = (1000.0, 128.0);
/// Patches, and rays a patch, at most.
const MOST: (usize, u32) = (200_000, 1 << 16);
/// Times patches and rays are chosen anew.
const ROUNDS: usize = 5;
/// The error on the finer patches as a share of the difference between the two levels, if it goes as h^1.5: where light is smooth
/// it goes as h², and across what stands close to a wall as h. Measured on the furnished room: 8.1, 2.7, 1.0 % too dark with
/// 250, 1000, 4000 patches.
const FINER: f64 = 0.547;
/// Share of the area whose patches have no larger one, beyond which the two levels tell too little.
const ALONE: f64 = 0.2;
/// Width and height of the rough gather at most, pixels.
const ROUGH: usize = 64;

/// What is asked.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// Relative RMS error of the picture.
    pub tolerance: f64,
    /// Pixels across and down.
    pub size: (usize, usize),
    /// Chooses the scrambling of all points.
    pub seed: u32,
}

/// Renders one mode to a tolerance; the patches of `p` are cut anew as it needs.
///
/// # Errors
/// [`Diverges`] where the series does.
pub fn render_within(
    p: &mut Prepared,
    transport: Transport,
    wanted: &Wanted,
    watch: &dyn Watch,
) -> Result<Within, Diverges> {
    let mut spent = Spent::default();
    let solved = solve_within(p, transport, wanted, &mut spent, watch)?;
    let clock = Instant::now();
    let left = wanted.tolerance.powi(2) - solved.error.sum().total.powi(2);
    // Where the solution used up the tolerance, the gather pass still has a share.
    let error = GATHER * left.max(0.25 * wanted.tolerance.powi(2)).sqrt();
    let seed = wanted.seed;
    let within = Gathering::Within { error, seed };
    // The rough picture has told the errors of the fields.
    let gathered = solved.gather(p, &solved.fields.led(), wanted.size, within, watch);
    spent.seconds.gather += clock.elapsed().as_secs_f64();
    spent.seconds.patches += p.seconds;
    Ok(solved.finish(p, gathered, spent))
}

/// What was spent so far.
#[derive(Default)]
struct Spent {
    seconds: Seconds,
    rays: u64,
}

/// A solution of one mode, with its difference to another scrambling and to larger patches.
struct Solved {
    mode: Assembled,
    solution: Solution,
    fields: Fields,
    error: ErrorParts,
}

/// Solves on more patches and with more rays until their errors in a rough picture are within their shares.
fn solve_within(
    p: &mut Prepared,
    transport: Transport,
    wanted: &Wanted,
    spent: &mut Spent,
    watch: &dyn Watch,
) -> Result<Solved, Diverges> {
    let fineness = (0.01 / wanted.tolerance).clamp(0.1, 10.0);
    let mut patches = (FIRST.0 * fineness) as usize;
    let mut rays = ((FIRST.1 * fineness.sqrt()) as u32).next_power_of_two();
    for round in 1.. {
        p.recut(patches);
        let most = keep_within(p, transport, &half(rays, wanted.seed, 0), 2);
        let mut solved = solve(p, transport, rays, wanted, spent, watch)?;
        if solved.fields.is_dark() {
            return Ok(solved);
        }
        let rough = solved.rough(p, wanted, spent, watch);
        solved.set_errors(&rough);
        let noise = solved.error.form_factors / (FORM_FACTORS * wanted.tolerance);
        let mut coarse = solved.error.patches / (PATCHES * wanted.tolerance);
        if round == 1 && p.patches.alone() > ALONE {
            coarse = coarse.max(2.0);
        }
        let full = most || (patches >= MOST.0 && rays >= MOST.1);
        if (noise <= 1.0 && coarse <= 1.0) || round == ROUNDS || full {
            return Ok(solved);
        }
        (patches, rays) = finer((p.patches.len(), rays), (noise, coarse), MOST);
    }
    unreachable!("the last round returns")
}

/// The patches and rays a patch of the next round, up to `most`, from how far noise and the error of patch size exceed
/// their shares.
pub(super) fn finer(
    (patches, rays): (usize, u32),
    (noise, coarse): (f64, f64),
    most: (usize, u32),
) -> (usize, u32) {
    // The error of patch size falls about as their number; noise with all rays, as the root at least.
    let more = (1.1 * coarse).clamp(1.0, 4.0);
    let denser = (1.2 * noise * noise / more).clamp(1.0, 16.0);
    (
        ((patches as f64 * more) as usize).min(most.0),
        ((f64::from(rays) * denser) as u32).min(most.1),
    )
}

/// Two solutions of half the rays each: their mean, half their difference, and that to larger patches.
fn solve(
    p: &Prepared,
    transport: Transport,
    rays: u32,
    wanted: &Wanted,
    spent: &mut Spent,
    watch: &dyn Watch,
) -> Result<Solved, Diverges> {
    let clock = Instant::now();
    let sights = [sight(p, &p.scene.transports(transport))];
    let [first, second] =
        [0, 1].map(|half| cast_half(p, transport, &sights, rays, wanted.seed, half, watch));
    spent.rays += first.1 + second.1;
    spent.seconds.form_factors += clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let settings = Settings {
        tolerance: TRUNCATION * wanted.tolerance,
        ..Settings::default()
    };
    let solution = neumann(&first.0.operator, &settings)?;
    let other = neumann(&second.0.operator, &settings)?;
    let operator = &first.0.operator;
    let coarse = coarse_terms(operator, p.patches.parents(), solution.terms.len() - 1);
    let [a, b, c] = [&solution.terms, &other.terms, &coarse].map(|terms| reflected(p, terms));
    let neighbours = p.patches.neighbours();
    let [a, b] = [&a, &b].map(|values| linear(&neighbours, values));
    let c = larger(p, &neighbours, &c);
    let mix = |x: &[Linear], y: &[Linear], u: f32, v: f32| -> Vec<Linear> {
        x.iter().zip(y).map(|(x, y)| x.mix(u, y, v)).collect()
    };
    let fields = [
        mix(&a, &b, 0.5, 0.5),
        mix(&a, &b, 0.5, -0.5),
        mix(&a, &c, 1.0, -1.0),
    ];
    let fields = Fields::linear(&fields).led_by(1);
    let truncation =
        solution.rest() / norm(operator.areas(), &solution.light).max(f64::MIN_POSITIVE);
    let fields = fields.with_ambient(ambient(&first.0, &solution));
    spent.seconds.solve += clock.elapsed().as_secs_f64();
    Ok(Solved {
        mode: first.0,
        solution,
        fields,
        error: ErrorParts {
            truncation,
            ..ErrorParts::default()
        },
    })
}

/// Light of larger patches, given on the smaller ones, as linear within the larger.
fn larger(p: &Prepared, neighbours: &Neighbours, values: &[Rgb]) -> Vec<Linear> {
    let parents = p.patches.parents();
    let neighbours = neighbours.larger(parents, p.patches.areas());
    let mut own = vec![Rgb::ZERO; neighbours.len()];
    for (value, &parent) in values.iter().zip(parents) {
        own[parent as usize] = *value;
    }
    let light = linear(&neighbours, &own);
    parents
        .iter()
        .map(|&parent| light[parent as usize])
        .collect()
}

/// K from half the rays.
fn cast_half(
    p: &Prepared,
    transport: Transport,
    sights: &[Arc<Sight>],
    rays: u32,
    seed: u32,
    half: u32,
    watch: &dyn Watch,
) -> (Assembled, u64) {
    let sampling = self::half(rays, seed, half);
    let (mut modes, cast) = assemble_seeing(p, &[transport], sights, &sampling, watch);
    (modes.remove(0), cast)
}

fn half(rays: u32, seed: u32, half: u32) -> Sampling {
    Sampling {
        rays: (rays / 2).max(1),
        seed: seed.wrapping_add(half.wrapping_mul(0x9e37_79b9)),
        ..Sampling::default()
    }
}

impl Solved {
    fn gather(
        &self,
        p: &Prepared,
        fields: &Fields,
        size: (usize, usize),
        gathering: impl Into<Gathering>,
        watch: &dyn Watch,
    ) -> Gathered {
        let surfaces = (&self.mode.transports[..], &*self.mode.sight);
        look(p, surfaces, fields, size, gathering, watch)
    }

    /// A small picture, enough to tell the errors of the fields.
    fn rough(
        &self,
        p: &Prepared,
        wanted: &Wanted,
        spent: &mut Spent,
        watch: &dyn Watch,
    ) -> Gathered {
        let clock = Instant::now();
        let (width, height) = wanted.size;
        let divisor = width.max(height).div_ceil(ROUGH);
        let size = (width.div_ceil(divisor), height.div_ceil(divisor));
        let sampling = GatherSampling {
            camera: 2,
            luminaire: 1,
            hemisphere: 16,
            seed: wanted.seed,
        };
        let gathered = self.gather(p, &self.fields, size, &sampling, watch);
        spent.rays += gathered.rays;
        spent.seconds.gather += clock.elapsed().as_secs_f64();
        gathered
    }

    /// Takes the errors of F and of patch size from a picture.
    fn set_errors(&mut self, gathered: &Gathered) {
        let share = |rms: f64| {
            if gathered.error.signal > 0.0 {
                rms / gathered.error.signal
            } else {
                0.0
            }
        };
        if let [noise, coarse] = gathered.riders[..] {
            self.error.form_factors = share(noise);
            self.error.patches = FINER * share(coarse);
        }
    }

    fn finish(mut self, p: &Prepared, gathered: Gathered, mut spent: Spent) -> Within {
        self.error.gather = gathered.error.relative();
        spent.seconds.sum();
        Within {
            picture: gathered.total(),
            error: self.error.sum(),
            seconds: spent.seconds,
            patches: p.patches.len(),
            rays: spent.rays + gathered.rays,
            radius: self.solution.radius,
            verdict: self.solution.verdict,
            closure: self.mode.closure,
            backs: gathered.backs,
            standard_error: gathered.standard_error,
        }
    }
}
