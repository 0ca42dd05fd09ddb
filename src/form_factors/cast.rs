//! Rows of F by hemisphere rays, and checks of them.
//!
//! Rays start at Owen-scrambled Sobol points over position × direction. One cast serves several variants of tau: each
//! ray's crossings are found once (all of them when any variant's tau is above 0, the first only when none is) and
//! weighted for each. Rows that reflect nothing, and columns that send nothing, are not stored; where no column
//! remains, no ray is cast.
//!
//! Not handled: numbers of rays that follow from an error; callers give them.

use halflight_team::Loop;

use crate::form_factors::sparse::Rows;
use crate::light::nothing_passes;
use crate::patches::Patches;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::warp::cosine_direction;
use crate::rays::{Hit, Ray, Rays};
use crate::scene::Scene;

/// How many rays, and which.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Hemisphere rays a patch, for the rows of F.
    pub rays: u32,
    /// Receiver points a patch and luminaire, each with one visibility ray, for light as emitted.
    pub emitter_rays: u32,
    /// Chooses the scrambling of the points; the same seed gives the same bits.
    pub seed: u32,
}

impl Default for Sampling {
    fn default() -> Self {
        Sampling { rays: 256, emitter_rays: 64, seed: 0 }
    }
}

/// Called with the number of rows that were just finished.
pub type Progress<'a> = &'a (dyn Fn(u64) + Sync);

/// One choice of tau, and the part of F it needs.
#[derive(Clone, Debug)]
pub struct Variant {
    /// tau of each material.
    pub tau: Vec<f32>,
    /// Which patches receive: those that reflect.
    pub rows: Vec<bool>,
    /// Which patches send: those whose reflected light travels on, or that emit without being a luminaire.
    pub columns: Vec<bool>,
}

impl Variant {
    /// All rows and columns of a tau, whatever patches reflect; nothing is cast from the sky, which has no place.
    pub fn whole(scene: &Scene, patches: &Patches, tau: &[f32]) -> Variant {
        let rows = (0..patches.len()).map(|i| !patches.is_sky(scene, i)).collect();
        Variant { tau: tau.to_vec(), rows, columns: vec![true; patches.len()] }
    }
}

/// `F^tau`, row i = receiver.
#[derive(Clone, Debug)]
pub struct FormFactors {
    /// The stored entries.
    pub rows: Rows,
    /// Sum over *all* columns of each row, stored or not; `None` where no ray was cast from the patch.
    pub row_sums: Vec<Option<f32>>,
}

impl FormFactors {
    /// F of n patches of which none sends or none receives.
    pub fn none(n: usize) -> FormFactors {
        FormFactors { rows: Rows::empty(n), row_sums: vec![None; n] }
    }

    /// F with all its rows in this process ([`Rows::whole`]).
    pub fn whole(self) -> FormFactors {
        FormFactors { rows: self.rows.whole(), ..self }
    }
}

/// Accumulates one row of one variant.
struct Accumulator {
    weights: Vec<f64>,
    touched: Vec<u32>,
    total: f64,
}

impl Accumulator {
    fn new(n: usize) -> Self {
        Accumulator { weights: vec![0.0; n], touched: Vec::new(), total: 0.0 }
    }

    #[inline]
    fn add(&mut self, j: u32, weight: f32) {
        let cell = &mut self.weights[j as usize];
        if *cell == 0.0 {
            self.touched.push(j);
        }
        *cell += weight as f64;
        self.total += weight as f64;
    }

    /// Takes the row out, leaving zeros behind.
    fn take(&mut self, columns: &[bool], rays: u32) -> CastRow {
        let share = 1.0 / rays as f64;
        self.touched.sort_unstable();
        let mut row = CastRow {
            columns: Vec::with_capacity(self.touched.len()),
            values: Vec::with_capacity(self.touched.len()),
            sum: Some((self.total * share) as f32),
        };
        for j in self.touched.drain(..) {
            let weight = std::mem::take(&mut self.weights[j as usize]);
            if columns[j as usize] {
                row.columns.push(j);
                row.values.push((weight * share) as f32);
            }
        }
        self.total = 0.0;
        row
    }
}

#[derive(Clone, Default)]
struct CastRow {
    columns: Vec<u32>,
    values: Vec<f32>,
    sum: Option<f32>,
}

/// Casts rays from the patches and fills F for every variant; also returns how many rays were cast.
pub fn cast(
    rays: &Rays,
    patches: &Patches,
    variants: &[Variant],
    sampling: &Sampling,
    tick: Progress,
) -> (Vec<FormFactors>, u64) {
    cast_counts(rays, patches, variants, sampling, &vec![sampling.rays; patches.len()], tick)
}

/// Casts a number of rays of its own from each patch, instead of that of `sampling`, and fills F for every variant;
/// also returns how many rays were cast.
///
/// # Panics
/// If there are fewer numbers than patches.
pub fn cast_counts(
    rays: &Rays,
    patches: &Patches,
    variants: &[Variant],
    sampling: &Sampling,
    counts: &[u32],
    tick: Progress,
) -> (Vec<FormFactors>, u64) {
    let needed: Vec<&Variant> = variants.iter().filter(|v| needs_rays(v)).collect();
    let opaque = nothing_passes(needed.iter().flat_map(|v| v.tau.iter().copied()));
    let most = Sampling { rays: counts.iter().copied().max().unwrap_or(1), ..*sampling };
    let caster = Caster::new(rays, patches, opaque, &most);
    let count = |i: usize| counts[i].max(1);
    let scratch = || {
        let rows = needed.iter().map(|_| Accumulator::new(patches.len()));
        (rows.collect::<Vec<_>>(), Vec::new())
    };
    let shared = Loop::in_ranges(patches.len(), |i| f64::from(count(i)));
    let rows = shared.keep(scratch, |(sums, hits), i| {
        tick(1);
        caster.row(i, count(i), &needed, sums, hits)
    });
    let sources = (0..patches.len()).filter(|&i| needed.iter().any(|v| v.rows[i]));
    let cast = sources.map(|i| u64::from(count(i))).sum();
    (distribute(variants, &shared, rows), cast)
}

fn needs_rays(v: &Variant) -> bool {
    v.columns.contains(&true) && v.rows.contains(&true)
}

/// F of every variant from the rows of those that need rays, patch by patch, each kept where it was cast.
fn distribute(variants: &[Variant], shared: &Loop, mut rows: Vec<Vec<CastRow>>) -> Vec<FormFactors> {
    let mut needed = 0..;
    let of_variant = |v: &Variant| {
        let Some(k) = needs_rays(v).then(|| needed.next()).flatten() else { return FormFactors::none(shared.len()) };
        let own: Vec<CastRow> = rows.iter_mut().map(|row: &mut Vec<CastRow>| std::mem::take(&mut row[k])).collect();
        FormFactors {
            row_sums: shared.join(own.iter().map(|row| row.sum).collect()),
            rows: Rows::of_part(shared.clone(), own.into_iter().map(|row| (row.columns, row.values)).collect()),
        }
    };
    variants.iter().map(of_variant).collect()
}

/// Casts the rays of a patch: those of a seed are always the same, whatever is done with them.
pub(crate) struct Caster<'a> {
    pub rays: &'a Rays,
    pub patches: &'a Patches,
    /// Only the first crossing of a ray matters.
    opaque: bool,
    sobol: Sobol,
    seed: u32,
}

impl<'a> Caster<'a> {
    /// Finds the first crossing of each ray where all is `opaque`, else all of them.
    pub(crate) fn new(rays: &'a Rays, patches: &'a Patches, opaque: bool, sampling: &Sampling) -> Caster<'a> {
        Caster { rays, patches, opaque, sobol: Sobol::new(sampling.rays.max(1) as usize, 4), seed: sampling.seed }
    }

    /// Row i of every variant, from so many rays.
    fn row(
        &self,
        i: usize,
        count: u32,
        variants: &[&Variant],
        sums: &mut [Accumulator],
        hits: &mut Vec<Hit>,
    ) -> Vec<CastRow> {
        if !variants.iter().any(|v| v.rows[i]) {
            return vec![CastRow::default(); variants.len()];
        }
        self.each(i, count, hits, |ray, hits| {
            for (variant, sum) in variants.iter().zip(sums.iter_mut()) {
                self.rays.transmit(
                    hits,
                    |m| variant.tau[m],
                    |hit, through| {
                        if let Some(j) = self.patches.met(ray, hit) {
                            sum.add(j, through);
                        }
                    },
                );
            }
        });
        variants
            .iter()
            .zip(sums)
            .map(|(v, sum)| {
                let row = sum.take(&v.columns, count);
                if v.rows[i] { row } else { CastRow::default() }
            })
            .collect()
    }

    /// Calls `each` with the first `count` rays of patch i and their crossings in order.
    pub(crate) fn each(&self, i: usize, count: u32, hits: &mut Vec<Hit>, mut each: impl FnMut(&Ray, &[Hit])) {
        let seed = hash(i as u32, self.seed);
        for k in 0..count {
            let ray = hemisphere_ray(self.patches, i, |d| self.sobol.point(k, d, seed));
            self.rays.light_crossings(&ray, self.opaque, hits);
            each(&ray, hits);
        }
    }
}

/// The cosine-distributed ray from patch i at a point of the unit cube of four dimensions, given by dimension: two for
/// the place, two for the direction.
pub(crate) fn hemisphere_ray(patches: &Patches, i: usize, at: impl Fn(usize) -> f32) -> Ray {
    let from = patches.point(i, at(0), at(1));
    Ray { origin: from.position, direction: cosine_direction(from.normal, at(2), at(3)), source: Some(from.face) }
}

/// Sums of the rows of F: 1 in a closed opaque scene, less where light escapes or meets black backs, more where
/// surfaces transmit.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct RowSums {
    /// The smallest row sum.
    pub min: f64,
    /// The largest row sum.
    pub max: f64,
    /// The area-weighted mean.
    pub mean: f64,
}

/// Row sums over the patches rays were cast from; `None` where no ray was cast at all.
pub fn row_sums(f: &FormFactors, areas: &[f64]) -> Option<RowSums> {
    let mut found: Option<RowSums> = None;
    let (mut weighted, mut area) = (0.0, 0.0);
    for (sum, a) in f.row_sums.iter().zip(areas) {
        let Some(sum) = sum.map(f64::from) else {
            continue;
        };
        weighted += a * sum;
        area += a;
        let (min, max) = found.map_or((sum, sum), |c| (c.min.min(sum), c.max.max(sum)));
        let mean = weighted / area;
        found = Some(RowSums { min, max, mean });
    }
    found
}

/// Reciprocity residual: the Frobenius norm of `A F - (A F)^T` over that of `A F`, A the diagonal of areas.
///
/// Noise of the rays makes it positive even where F is right; 0 for an empty matrix.
pub fn reciprocity(f: &Rows, areas: &[f64]) -> f64 {
    let transposed = f.transposed();
    let (mut residual, mut norm) = (0.0, 0.0);
    for i in 0..f.len() {
        let (columns, values) = f.row(i);
        for (&j, &value) in columns.iter().zip(values) {
            let sent = areas[i] * value as f64;
            let back = areas[j as usize] * transposed.get(i, j) as f64;
            // A pair stored on one side only is met once: count it for both.
            let twice = if back == 0.0 { 2.0 } else { 1.0 };
            residual += twice * (sent - back).powi(2);
            norm += sent * sent;
        }
    }
    if norm > 0.0 { (residual / norm).sqrt() } else { 0.0 }
}
