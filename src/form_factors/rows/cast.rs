//! Rows of F by hemisphere rays: Owen-scrambled Sobol points over position × direction.
//!
//! One cast serves several variants of tau: each ray's crossings are found once (all of them when any variant's tau
//! is above 0, the first only when none is) and weighted for each. Rows that reflect nothing, and columns that send
//! nothing, are not stored; where no column is left, no ray is cast.

use rayon::prelude::*;

use crate::form_factors::rows::sparse::Rows;
use crate::form_factors::{Progress, Sampling};
use crate::patches::Patches;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::warp::cosine_direction;
use crate::rays::{Hit, Ray, Rays};
use crate::scene::Scene;

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

/// `F^tau`, row i = receiver.
#[derive(Clone, Debug)]
pub struct FormFactors {
    /// The stored entries.
    pub rows: Rows,
    /// Sum over *all* columns of each row, stored or not; `None` where no ray was cast from the patch.
    pub row_sums: Vec<Option<f32>>,
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

/// Casts rays from the patches and fills F for every variant; also tells how many rays were cast.
pub fn cast(
    scene: &Scene,
    path: (&Rays, &Patches),
    variants: &[Variant],
    sampling: &Sampling,
    tick: Progress,
) -> (Vec<FormFactors>, u64) {
    let counts = vec![sampling.rays; path.1.len()];
    cast_counts(scene, path, variants, (sampling, &counts), tick)
}

/// The same with a number of rays for each patch instead of one for all.
///
/// # Panics
/// If there are fewer numbers than patches.
pub fn cast_counts(
    scene: &Scene,
    (rays, patches): (&Rays, &Patches),
    variants: &[Variant],
    (sampling, counts): (&Sampling, &[u32]),
    tick: Progress,
) -> (Vec<FormFactors>, u64) {
    let needed: Vec<&Variant> = variants.iter().filter(|v| needs_rays(v)).collect();
    let through = needed.iter().any(|v| v.tau.iter().any(|&t| t > 0.0));
    let most = Sampling { rays: counts.iter().copied().max().unwrap_or(1), ..*sampling };
    let caster = Caster::new(scene, (rays, patches), through, &most);
    let count = |i: usize| counts[i].max(1);
    let scratch = || {
        let rows = needed.iter().map(|_| Accumulator::new(patches.len()));
        (rows.collect::<Vec<_>>(), Vec::new())
    };
    let rows: Vec<Vec<CastRow>> = (0..patches.len())
        .into_par_iter()
        .map_init(scratch, |(sums, hits), i| {
            tick(1);
            caster.row((i, count(i)), &needed, sums, hits)
        })
        .collect();
    let sources = (0..patches.len()).filter(|&i| needed.iter().any(|v| v.rows[i]));
    let cast = sources.map(|i| u64::from(count(i))).sum();
    (distribute(variants, rows, patches.len()), cast)
}

fn needs_rays(v: &Variant) -> bool {
    v.columns.contains(&true) && v.rows.contains(&true)
}

/// Sorts the rows cast for the needed variants back to all variants.
fn distribute(variants: &[Variant], mut rows: Vec<Vec<CastRow>>, n: usize) -> Vec<FormFactors> {
    let mut k = 0;
    let mut take = |v: &Variant| {
        if !needs_rays(v) {
            return vec![CastRow::default(); n];
        }
        let own = rows.iter_mut().map(|r| std::mem::take(&mut r[k])).collect();
        k += 1;
        own
    };
    variants
        .iter()
        .map(|v| {
            let own: Vec<CastRow> = take(v);
            FormFactors {
                row_sums: own.iter().map(|r| r.sum).collect(),
                rows: Rows::from_rows(own.into_iter().map(|r| (r.columns, r.values)).collect()),
            }
        })
        .collect()
}

/// Casts the rays of a patch, the same for the same seed whatever is done with them.
pub(crate) struct Caster<'a> {
    scene: &'a Scene,
    rays: &'a Rays,
    patches: &'a Patches,
    /// Whether crossings after the first matter.
    all: bool,
    count: u32,
    sobol: Sobol,
    seed: u32,
}

impl<'a> Caster<'a> {
    /// Finds all crossings, or the first only.
    pub(crate) fn new(
        scene: &'a Scene,
        (rays, patches): (&'a Rays, &'a Patches),
        all: bool,
        sampling: &Sampling,
    ) -> Caster<'a> {
        Caster {
            scene,
            rays,
            patches,
            all,
            count: sampling.rays.max(1),
            sobol: Sobol::new(sampling.rays.max(1) as usize, 4),
            seed: sampling.seed,
        }
    }

    /// Row i of every variant, from so many rays.
    fn row(
        &self,
        (i, count): (usize, u32),
        variants: &[&Variant],
        sums: &mut [Accumulator],
        hits: &mut Vec<Hit>,
    ) -> Vec<CastRow> {
        if !variants.iter().any(|v| v.rows[i]) {
            return vec![CastRow::default(); variants.len()];
        }
        self.each_of((i, count), hits, |ray, hits| {
            for (variant, sum) in variants.iter().zip(sums.iter_mut()) {
                self.add(ray, hits, variant, sum);
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

    /// The k-th cosine-distributed ray from patch i.
    fn ray(&self, i: usize, k: u32, seed: u32) -> Ray {
        let at = |d: usize| self.sobol.point(k, d, seed);
        let from = self.patches.point(i, at(0), at(1));
        Ray { origin: from.position, direction: cosine_direction(from.normal, at(2), at(3)), source: Some(from.face) }
    }

    fn find(&self, ray: &Ray, hits: &mut Vec<Hit>) {
        if self.all {
            self.rays.crossings(ray, hits);
        } else {
            hits.clear();
            hits.extend(self.rays.closest(ray));
        }
    }

    /// Calls `each` with every ray of patch i and its crossings in order.
    pub(crate) fn each(&self, i: usize, hits: &mut Vec<Hit>, each: impl FnMut(&Ray, &[Hit])) {
        self.each_of((i, self.count), hits, each);
    }

    /// The same for the first `count` rays.
    fn each_of(&self, (i, count): (usize, u32), hits: &mut Vec<Hit>, mut each: impl FnMut(&Ray, &[Hit])) {
        let seed = hash(i as u32, self.seed);
        for k in 0..count {
            let ray = self.ray(i, k, seed);
            self.find(&ray, hits);
            each(&ray, hits);
        }
    }

    /// Adds what one ray's crossings send along it.
    fn add(&self, ray: &Ray, hits: &[Hit], variant: &Variant, sum: &mut Accumulator) {
        let mut through = 1.0;
        for hit in hits {
            let position = ray.origin + hit.t * ray.direction;
            if let Some(j) = self.patches.at(hit.face, hit.side, position) {
                sum.add(j, through);
            }
            let material = self.scene.faces[hit.face as usize].material;
            through *= variant.tau[material as usize];
            if through == 0.0 {
                break;
            }
        }
    }
}
