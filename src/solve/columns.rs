//! L of several E over one K: every product with K is one pass over F for [`TOGETHER`] of them.
//!
//! ```text
//! L = E + R,   R = K E + K R       d_k the steps, r_k what remains of the equation for R_invisible, B = alpha rho F:
//!
//! r_0 = d_0 = (K E)_invisible      r_k+1 = r_k - d_k + B d_k      d_k+1 = a_k d_k + b_k r_k+1
//! R ~ K E + K (d_0 + d_1 + ...)    |error| <= K (I - K)^-1 |r|, the same bound as on what follows a term of the series
//! ```
//!
//! a_k and b_k are those of the Chebyshev iteration for eigenvalues between minus and plus the spectral radius s, where
//! reciprocity puts them, but for the noise of F: errors shrink by s/(1 + sqrt(1 - s²)) a product where the Neumann
//! series has s; at s = 0.8 it takes 17 products in place of 42. Where the bound does not fall all the same, a = 0 and
//! b = 1 make it the Neumann series. Whatever the iteration, the bound on what it leaves is proved.
//!
//! K is the same for all columns, and light is linear in E: a sum of columns, each times any factor, is the light of
//! the sum. Spectrum and bounds are found once; they are those of K on the patches that any column lights.
//!
//! Source: Y. Saad, *Iterative Methods for Sparse Linear Systems*, 2nd ed. 2003, algorithm 12.1. Worth: `cargo bench
//! --bench columns`. Not handled: the bounces of each column.

use rayon::prelude::*;

use crate::form_factors::{Columns, PANEL};
use crate::light::{Light, Rgb};
use crate::operator::linear::reflected;
use crate::operator::{Bounds, LinearOperator, LitPatches, Source, Spectrum};
use crate::solve::neumann::{Diverges, Settings, Verdict, norm, refuse, verdict_on_lit};
use crate::solve::tail::TailBound;

/// Columns of RGB solved together: a panel of [`Columns`].
pub const TOGETHER: usize = PANEL / 3;

/// L of several E.
#[derive(Clone, Debug)]
pub struct ColumnSolution {
    /// `L` of each, both halves, per patch.
    pub light: Vec<Vec<Light>>,
    /// Products with K that a column took at the most, that with E included.
    pub products: usize,
    /// Proved bound on the norm of what is missing, of each.
    pub rest: Vec<f64>,
    /// How the series behaves.
    pub verdict: Verdict,
    /// Proved bounds on the spectral radius; both 0 where the series ends.
    pub radius: Bounds,
}

/// The sum of all columns' magnitudes, whose lit patches are those that any column lights.
fn magnitudes(patches: usize, sources: &[Source], bounces: &[Vec<Light>]) -> Source {
    let [mut emission, mut first_bounce] = [(); 2].map(|_| vec![Light::default(); patches]);
    for (source, bounce) in sources.iter().zip(bounces) {
        add_magnitude(&mut emission, &source.emission);
        add_magnitude(&mut first_bounce, bounce);
    }
    Source { emission, first_bounce: Some(first_bounce) }
}

fn add_magnitude(sum: &mut [Light], light: &[Light]) {
    for (sum, l) in sum.iter_mut().zip(light) {
        sum.invisible += l.invisible.abs();
        sum.visible += l.visible.abs();
    }
}

/// Solves `L = E + K L` for each of several E; `settings.tolerance` bounds what each leaves as a share of its own
/// reflected light, `settings.max_terms` the products.
///
/// # Errors
/// [`Diverges`] where the spectral radius is not proved to be below 1 on what any of them lights.
///
/// # Panics
/// If a source does not have one light a patch.
pub fn solve_columns(
    k: &dyn LinearOperator,
    sources: &[Source],
    settings: &Settings,
) -> Result<ColumnSolution, Diverges> {
    let bounces = first_bounces(k, sources);
    let k = &LitPatches::of_source(k, magnitudes(k.areas().len(), sources, &bounces));
    let (verdict, spectrum) = verdict_on_lit(k);
    if matches!(verdict, Verdict::Diverges | Verdict::Undecided) {
        return Err(refuse(k, verdict, spectrum.as_ref()));
    }
    let tail = spectrum.as_ref().and_then(|s| TailBound::new(k, s));
    let radius = spectrum.as_ref().map(Spectrum::worst).unwrap_or_default();
    let solving = Solving { k, tail, chebyshev: Chebyshev::new(spectrum.as_ref()), settings };
    let groups: Vec<_> = bounces.chunks(TOGETHER).map(|bounces| solving.solve(bounces)).collect();
    let products = groups.iter().map(|(products, _)| *products).max().unwrap_or(1);
    let (mut light, rest): (Vec<_>, Vec<_>) = groups.into_iter().flat_map(|(_, solved)| solved).unzip();
    light.par_iter_mut().zip(sources).for_each(|(light, source)| {
        light.iter_mut().zip(&source.emission).for_each(|(sum, e)| *sum = added(*sum, *e));
    });
    Ok(ColumnSolution { light, products, rest, verdict, radius })
}

/// What all columns share.
struct Solving<'a> {
    k: &'a dyn LinearOperator,
    tail: Option<TailBound>,
    chebyshev: Chebyshev,
    settings: &'a Settings,
}

/// R of a column, and the bound on the norm of what it misses.
type Reflected = (Vec<Light>, f64);

impl Solving<'_> {
    /// R of some columns from their first bounces, and how many products it took.
    ///
    /// One column is asked whether it is good enough, and where it is all others are; the worst of them is asked next.
    fn solve(&self, bounces: &[Vec<Light>]) -> (usize, Vec<Reflected>) {
        let mut running = Running::new(bounces);
        let mut chebyshev = self.chebyshev;
        let (mut products, mut asked, mut before) = (1, 0, f64::INFINITY);
        let mut due = if self.tail.is_some() { 1 + chebyshev.steps(1.0 / self.settings.tolerance) } else { 1 };
        loop {
            let is_last = products >= self.settings.max_terms;
            if products >= due || is_last {
                let mut excess = self.excess(&self.look(&running, asked, &bounces[asked]));
                if excess <= 1.0 || is_last {
                    let all = bounces.par_iter().enumerate().map(|(c, bounce)| self.look(&running, c, bounce));
                    let all: Vec<Reflected> = all.collect();
                    let each = all.iter().map(|own| self.excess(own)).enumerate();
                    (asked, excess) = each.fold((0, 0.0), |worst, own| if own.1 > worst.1 { own } else { worst });
                    if excess <= 1.0 || is_last {
                        return (products, all);
                    }
                } else if excess >= before && !chebyshev.is_plain() {
                    chebyshev = chebyshev.plain();
                    running = Running::new(bounces);
                }
                before = excess;
                due = products + chebyshev.steps(excess);
            }
            running.step(self.k, chebyshev.next());
            products += 1;
        }
    }

    /// The light that column c has come to.
    fn look(&self, running: &Running, c: usize, bounce: &[Light]) -> Reflected {
        let rest = self.tail.as_ref().map_or(0.0, |tail| {
            let left: Vec<Light> = running.left.triples(c).map(Light::unseen).collect();
            tail.after(&left).filter(|rest| !rest.is_nan()).unwrap_or(f64::INFINITY)
        });
        (running.light(self.k, c, bounce), rest)
    }

    /// What is missing over what is tolerable, at least 1.
    fn excess(&self, (reflected, rest): &Reflected) -> f64 {
        let tolerable = self.settings.tolerance * norm(self.k.areas(), reflected);
        if *rest <= tolerable { 1.0 } else { rest / tolerable }
    }
}

/// The coefficients of the steps, channel by channel.
#[derive(Clone, Copy, Default)]
struct Chebyshev {
    /// Spectral radii that they are made for; 0 for those of the Neumann series.
    radius: [f64; 3],
    ratio: [f64; 3],
    /// Errors shrink by so much a step.
    rate: f64,
}

impl Chebyshev {
    fn new(spectrum: Option<&Spectrum>) -> Chebyshev {
        let radius = spectrum.map_or([0.0; 3], |s| s.channels.map(|c| c.upper));
        let worst = radius.into_iter().fold(0.0, f64::max);
        Chebyshev { radius, ratio: radius, rate: worst / (1.0 + (1.0 - worst * worst).sqrt()) }
    }

    /// That of the Neumann series.
    fn plain(&self) -> Chebyshev {
        Chebyshev { rate: self.radius.into_iter().fold(0.0, f64::max), ..Chebyshev::default() }
    }

    fn is_plain(&self) -> bool {
        self.radius == [0.0; 3]
    }

    /// Steps, one at least, in which errors shrink by `factor` at the rate that is expected.
    fn steps(&self, factor: f64) -> usize {
        let steps = -factor.ln() / self.rate.ln();
        if steps.is_finite() { steps.clamp(1.0, 1e6) as usize } else { 1 }
    }

    /// a and b of the next step.
    fn next(&mut self) -> [[f32; PANEL]; 2] {
        let mut both = [Rgb::ZERO, Rgb::ONE];
        for c in (0..3).filter(|&c| self.radius[c] > 0.0) {
            let next = 1.0 / (2.0 / self.radius[c] - self.ratio[c]);
            both[0][c] = (next * self.ratio[c]) as f32;
            both[1][c] = (2.0 * next / self.radius[c]) as f32;
            self.ratio[c] = next;
        }
        both.map(repeated)
    }
}

/// The iteration of some columns.
struct Running {
    /// d.
    step: Columns,
    /// r.
    left: Columns,
    /// The visible half of K (d_0 + d_1 + ...).
    seen: Columns,
    /// No light is below 0.
    is_positive: bool,
}

impl Running {
    fn new(bounces: &[Vec<Light>]) -> Running {
        let patches = bounces.first().map_or(0, Vec::len);
        let step = invisible(patches, bounces);
        let is_positive = bounces.iter().flatten().all(|l| l.invisible.min_element() >= 0.0);
        Running { left: step.clone(), seen: Columns::zeros(patches, step.count()), step, is_positive }
    }

    /// One product with K.
    fn step(&mut self, k: &dyn LinearOperator, [a, b]: [[f32; PANEL]; 2]) {
        let incident = k.incident_columns(&self.step);
        let Running { step, left, seen, .. } = self;
        Columns::for_each_of([step, left, seen], |i, first, [step, left, seen]| {
            let (rho, alpha) = (repeated(k.reflectances()[i]), k.alphas()[i]);
            let coefficients = rho.iter().zip(a.iter().zip(&b));
            let numbers = incident.of(i, first).iter().zip(coefficients);
            let columns = step.iter_mut().zip(left).zip(seen);
            for (((d, r), seen), (incident, (rho, (a, b)))) in columns.zip(numbers) {
                let visible = rho * incident;
                *seen += visible;
                // Where d = r, what remains is B d to the bit.
                *r = (*r - *d) + alpha * visible;
                *d = a * *d + b * *r;
            }
        });
    }

    /// R of column c, whose first bounce this is.
    fn light(&self, k: &dyn LinearOperator, c: usize, bounce: &[Light]) -> Vec<Light> {
        let least = if self.is_positive { Rgb::ZERO } else { Rgb::NEG_INFINITY };
        let numbers = self.seen.triples(c).zip(k.alphas()).zip(bounce);
        numbers
            .map(|((seen, alpha), bounce)| {
                let visible = seen.max(least);
                added(*bounce, Light { invisible: *alpha * visible, visible })
            })
            .collect()
    }
}

/// A colour for each column of a panel.
#[inline]
fn repeated(colour: Rgb) -> [f32; PANEL] {
    let mut all = [0.0; PANEL];
    all.as_chunks_mut().0.fill(colour.to_array());
    all
}

/// The first `bounces` of each of several E together, E itself not counted.
pub fn reflected_columns(k: &dyn LinearOperator, sources: &[Source], bounces: usize) -> Vec<Vec<Light>> {
    if bounces == 0 {
        return vec![vec![Light::default(); k.areas().len()]; sources.len()];
    }
    let of_group = |first: &[Vec<Light>]| {
        let mut running = Running::new(first);
        (1..bounces).for_each(|_| running.step(k, Chebyshev::default().next()));
        let light = first.iter().enumerate().map(|(c, bounce)| running.light(k, c, bounce));
        light.collect::<Vec<_>>()
    };
    first_bounces(k, sources).chunks(TOGETHER).flat_map(of_group).collect()
}

/// Calls `each(n, KⁿE of every E)` for n from 1 to `bounces`, whether the series converges or not.
pub fn each_bounce(
    k: &dyn LinearOperator,
    sources: &[Source],
    bounces: usize,
    mut each: impl FnMut(usize, &[Vec<Light>]),
) {
    let mut term = first_bounces(k, sources);
    for n in 1..=bounces {
        each(n, &term);
        if n < bounces {
            term = apply_columns(k, &term);
        }
    }
}

/// `K x` of several x, in one pass over F for each [`TOGETHER`] of them.
pub fn apply_columns(k: &dyn LinearOperator, x: &[impl AsRef<[Light]> + Sync]) -> Vec<Vec<Light>> {
    let of_group = |x: &[_]| {
        let incident = k.incident_columns(&invisible(k.areas().len(), x));
        let patches = || k.reflectances().iter().zip(k.alphas());
        let one = |c: usize| {
            let all = patches().zip(incident.triples(c));
            all.map(|((rho, alpha), incident)| reflected(*rho, *alpha, incident)).collect()
        };
        (0..x.len()).into_par_iter().map(one).collect::<Vec<_>>()
    };
    x.chunks(TOGETHER).flat_map(of_group).collect()
}

/// The invisible halves of several lights, three columns of each.
fn invisible(patches: usize, lights: &[impl AsRef<[Light]> + Sync]) -> Columns {
    let mut columns = Columns::zeros(patches, 3 * lights.len());
    columns.for_each(|i, first, row| {
        let own = row.chunks_exact_mut(3).zip(&lights[first / 3..]);
        own.for_each(|(row, light)| row.copy_from_slice(&light.as_ref()[i].invisible.to_array()));
    });
    columns
}

/// `K E` of every source.
pub(crate) fn first_bounces(k: &dyn LinearOperator, sources: &[Source]) -> Vec<Vec<Light>> {
    let unknown = sources.iter().filter(|source| source.first_bounce.is_none());
    let unknown: Vec<&[Light]> = unknown.map(|source| &*source.emission).collect();
    let mut found = apply_columns(k, &unknown).into_iter();
    sources.iter().map(|source| source.first_bounce.clone().or_else(|| found.next()).unwrap_or_default()).collect()
}

/// Both halves added.
pub(crate) fn added(a: Light, b: Light) -> Light {
    Light { invisible: a.invisible + b.invisible, visible: a.visible + b.visible }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::{FormFactors, Rows};
    use crate::operator::{Operator, PatchMaterials};
    use crate::rays::sobol::Stream;
    use crate::solve::neumann;

    const PATCHES: usize = 40;

    /// K of patches that see each other by random rows, and random E.
    fn operator(emission: Vec<Light>) -> Operator {
        let mut random = Stream::new(9);
        let mut row = |_| {
            let values: Vec<f32> = (0..PATCHES).map(|_| random.uniform() / PATCHES as f32).collect();
            ((0..PATCHES as u32).collect(), values)
        };
        let rows = Rows::from_rows((0..PATCHES).map(&mut row).collect());
        let f = FormFactors { rows, row_sums: vec![None; PATCHES] };
        let materials = PatchMaterials {
            rho: (0..PATCHES).map(|i| Rgb::new(0.9, 0.5, 0.1 * (i % 4) as f32)).collect(),
            alpha: (0..PATCHES).map(|i| if i % 3 == 0 { 0.5 } else { 1.0 }).collect(),
            emission,
            glows: vec![true; PATCHES],
        };
        Operator::new(f, materials, vec![1.0; PATCHES], vec![Rgb::ZERO; PATCHES])
    }

    #[test]
    fn every_column_is_solved_as_if_it_were_alone() {
        let one = |c: usize| -> Vec<Light> {
            let lit = |i: usize| if i % 7 == c { Rgb::new(1.0, 2.0, c as f32) } else { Rgb::ZERO };
            (0..PATCHES).map(|i| Light { invisible: lit(i), visible: lit(i) }).collect()
        };
        let sources: Vec<Source> = (0..7).map(|c| Source { emission: one(c), first_bounce: None }).collect();
        let settings = Settings { tolerance: 1e-6, ..Settings::default() };
        let k = operator(one(0));
        let together = solve_columns(&k, &sources, &settings).expect("it converges");
        for (c, source) in sources.iter().enumerate() {
            let alone = neumann(&operator(source.emission.clone()), &settings).expect("it converges");
            // Both are within the tolerance, and rounding, of the same light.
            let bound = (2e-6 * alone.reflected * (PATCHES as f64).sqrt() * 3.0) as f32;
            for (a, b) in together.light[c].iter().zip(&alone.light) {
                assert!((a.visible - b.visible).abs().max_element() <= bound, "{c}: {a:?} {b:?} {bound}");
                assert!((a.invisible - b.invisible).abs().max_element() <= bound, "{c}: {a:?} {b:?} {bound}");
            }
            assert!(together.rest[c] <= 1e-6 * alone.reflected * 1.01);
        }
        assert_eq!(together.verdict, Verdict::Converges);
    }

    /// Light goes around a ring of patches: no eigenvalue but one is real, and Chebyshev's iteration does not converge.
    #[test]
    fn without_reciprocity_it_is_the_neumann_series() {
        let rows = (0..PATCHES as u32).map(|i| (vec![(i + 1) % PATCHES as u32], vec![1.0])).collect();
        let f = FormFactors { rows: Rows::from_rows(rows), row_sums: vec![None; PATCHES] };
        let emission: Vec<Light> = (0..PATCHES).map(|i| Light::unseen(Rgb::X * f32::from(i as u8 % 5))).collect();
        let materials = PatchMaterials {
            rho: vec![Rgb::splat(0.95); PATCHES],
            alpha: vec![1.0; PATCHES],
            emission: emission.clone(),
            glows: vec![true; PATCHES],
        };
        let k = Operator::new(f, materials, vec![1.0; PATCHES], vec![Rgb::ZERO; PATCHES]);
        let settings = Settings { tolerance: 1e-5, ..Settings::default() };
        let source = Source { emission, first_bounce: None };
        let found = solve_columns(&k, &[source], &settings).expect("it converges");
        let alone = neumann(&k, &settings).expect("it converges");
        for (a, b) in found.light[0].iter().zip(&alone.light) {
            assert!((a.invisible - b.invisible).abs().max_element() <= 1e-3, "{a:?} {b:?}");
        }
        assert!(found.rest[0] <= 1e-5 * alone.reflected * 1.01);
    }

    #[test]
    fn a_first_bounce_that_is_known_is_taken() {
        let emission = vec![Light::default(); PATCHES];
        let known = vec![Light { invisible: Rgb::ONE, visible: Rgb::splat(2.0) }; PATCHES];
        let source = Source { emission: emission.clone(), first_bounce: Some(known) };
        let k = operator(emission);
        let found = solve_columns(&k, &[source], &Settings::default()).expect("it converges");
        assert!(found.light[0].iter().all(|l| l.visible.min_element() >= 2.0));
    }
}
