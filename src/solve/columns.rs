//! L of several E over one K, by one Neumann series of all columns at once.
//!
//! ```text
//! L_e = E_e + K E_e + K² E_e + ...      each product with K in one pass over F
//! ```
//!
//! K is the same for all, and light is linear in E: a sum of columns, each times any factor, is the light of the sum.
//! The series of all columns ends together, where the proved bound on the tail of each is within the tolerance of its
//! own reflected light; the bounds are those of K on the patches that any column lights.
//!
//! Worth: `cargo bench --bench columns`. Not handled: the bounces of each column.

use glam::Vec4;

use crate::form_factors::Columns;
use crate::light::{Light, Rgb};
use crate::operator::{Bounds, LinearOperator, LitPatches};
use crate::solve::neumann::{Diverges, Settings, Verdict, norm, refuse, verdict_on_lit};
use crate::solve::tail::TailBound;

/// One E, and what K makes of it.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// `E`, one light a patch, W/(m² sr).
    pub emission: Vec<Light>,
    /// `K E`, where that is known better than by the product with F.
    pub first_bounce: Option<Vec<Light>>,
}

/// L of several E.
#[derive(Clone, Debug)]
pub struct ColumnSolution {
    /// `L` of each, both halves, per patch.
    pub light: Vec<Vec<Light>>,
    /// Bounces that were summed, E not counted.
    pub bounces: usize,
    /// Proved bound on the norm of what follows, of each.
    pub rest: Vec<f64>,
    /// How the series behaves.
    pub verdict: Verdict,
    /// Proved bounds on the spectral radius; both 0 where the series ends.
    pub radius: Bounds,
}

/// K with the sum of all columns for E, whose lit patches are those that any column lights.
struct OfSum<'a> {
    k: &'a dyn LinearOperator,
    emission: Vec<Light>,
    first_bounce: Vec<Light>,
}

impl LinearOperator for OfSum<'_> {
    fn areas(&self) -> &[f64] {
        self.k.areas()
    }

    fn reflectances(&self) -> &[Rgb] {
        self.k.reflectances()
    }

    fn alphas(&self) -> &[f32] {
        self.k.alphas()
    }

    fn emission(&self) -> &[Light] {
        &self.emission
    }

    fn incident(&self, x: &[Vec4]) -> Vec<Vec4> {
        self.k.incident(x)
    }

    fn incident_columns(&self, x: &Columns) -> Columns {
        self.k.incident_columns(x)
    }

    fn sent(&self, y: &[Vec4]) -> Vec<Vec4> {
        self.k.sent(y)
    }

    fn first_bounce(&self) -> Vec<Light> {
        self.first_bounce.clone()
    }
}

/// Solves `L = E + K L` for each of several E; `settings.tolerance` bounds the tail of each as a share of its own
/// reflected light.
///
/// # Errors
/// [`Diverges`] where the spectral radius is not proved to be below 1 on what any of them lights.
///
/// # Panics
/// If a source does not have one light a patch.
pub fn neumann_columns(
    k: &dyn LinearOperator,
    sources: &[Source],
    settings: &Settings,
) -> Result<ColumnSolution, Diverges> {
    let n = k.areas().len();
    let mut light: Vec<Vec<Light>> = sources.iter().map(|source| source.emission.clone()).collect();
    let mut term = first_bounces(k, sources);
    let sum = |of: &dyn Fn(usize, usize) -> Light| -> Vec<Light> {
        (0..n).map(|i| (0..sources.len()).map(|c| of(c, i)).fold(Light::default(), added)).collect()
    };
    let of_sum = OfSum { k, emission: sum(&|c, i| sources[c].emission[i]), first_bounce: sum(&|c, i| term[c][i]) };
    let k = &LitPatches::of(&of_sum);
    let (verdict, spectrum) = verdict_on_lit(k);
    if matches!(verdict, Verdict::Diverges | Verdict::Undecided) {
        return Err(refuse(k, verdict, spectrum.as_ref()));
    }
    let tail = spectrum.as_ref().and_then(|s| TailBound::new(k, s));
    let radius = spectrum.map(|s| s.worst()).unwrap_or_default();
    let mut reflected = vec![vec![Light::default(); n]; sources.len()];
    let mut rest = vec![f64::INFINITY; sources.len()];
    let mut bounces = 1;
    loop {
        for (c, term) in term.iter().enumerate() {
            for (sum, l) in light[c].iter_mut().chain(&mut reflected[c]).zip(term.iter().chain(term)) {
                *sum = added(*sum, *l);
            }
            rest[c] = tail.as_ref().map_or(0.0, |tail| tail.after(term).unwrap_or(f64::INFINITY));
        }
        let is_enough = |c: usize| rest[c] <= settings.tolerance * norm(k.areas(), &reflected[c]);
        if (0..sources.len()).all(is_enough) || bounces >= settings.max_terms {
            return Ok(ColumnSolution { light, bounces, rest, verdict, radius });
        }
        term = apply_columns(k, &term);
        bounces += 1;
    }
}

/// The first `bounces` of each of several E together, E itself not counted.
pub fn reflected_columns(k: &dyn LinearOperator, sources: &[Source], bounces: usize) -> Vec<Vec<Light>> {
    let mut sums = vec![vec![Light::default(); k.areas().len()]; sources.len()];
    each_bounce(k, sources, bounces, |_, terms| {
        for (sum, term) in sums.iter_mut().zip(terms) {
            sum.iter_mut().zip(term).for_each(|(sum, l)| *sum = added(*sum, *l));
        }
    });
    sums
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

/// `K x` of several x, all in one pass over F.
pub fn apply_columns(k: &dyn LinearOperator, x: &[Vec<Light>]) -> Vec<Vec<Light>> {
    let mut sent = Columns::zeros(k.areas().len(), 3 * x.len());
    sent.for_each(|i, row| {
        row.chunks_exact_mut(3).zip(x).for_each(|(sent, x)| sent.copy_from_slice(&x[i].invisible.to_array()));
    });
    let incident = k.incident_columns(&sent);
    let patches = || k.reflectances().iter().zip(k.alphas()).enumerate();
    let one = |c: usize| {
        let reflected = patches().map(|(i, (rho, alpha))| {
            let visible = *rho * Rgb::from_slice(&incident.of(i)[3 * c..]);
            Light { invisible: *alpha * visible, visible }
        });
        reflected.collect()
    };
    (0..x.len()).map(one).collect()
}

/// `K E` of every source.
fn first_bounces(k: &dyn LinearOperator, sources: &[Source]) -> Vec<Vec<Light>> {
    let unknown = sources.iter().filter(|source| source.first_bounce.is_none());
    let unknown: Vec<Vec<Light>> = unknown.map(|source| source.emission.clone()).collect();
    let mut found = apply_columns(k, &unknown).into_iter();
    sources.iter().map(|source| source.first_bounce.clone().or_else(|| found.next()).unwrap_or_default()).collect()
}

fn added(a: Light, b: Light) -> Light {
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
        let together = neumann_columns(&k, &sources, &settings).expect("it converges");
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

    #[test]
    fn a_first_bounce_that_is_known_is_taken() {
        let emission = vec![Light::default(); PATCHES];
        let known = vec![Light { invisible: Rgb::ONE, visible: Rgb::splat(2.0) }; PATCHES];
        let source = Source { emission: emission.clone(), first_bounce: Some(known) };
        let k = operator(emission);
        let found = neumann_columns(&k, &[source], &Settings::default()).expect("it converges");
        assert!(found.light[0].iter().all(|l| l.visible.min_element() >= 2.0));
    }
}
