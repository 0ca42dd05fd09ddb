//! Layer-resolved form factors: one cast of rays, and `F^tau` for every tau.
//!
//! ```text
//! F^t_ij   = sum over k of t^k F^(k)_ij          all transmissions scaled by one factor t
//! F^(k)_ij = mean over rays from i of  sum over crossings c of the ray that come after k others
//!            [c is a reflecting side of patch j]  P_c,      P_c = product of the own tau before c
//! ```
//!
//! What is kept is finer than the `F^(k)`: every crossing with its column, k and P, ray by ray. It costs no more memory
//! (few crossings of one row share column and layer) and gives what products of crossings of one ray need too:
//! the moments of the light that a random path carries,
//!
//! ```text
//! M^(p)_ij = mean over rays from i of  S^(p-1) X_j
//! X_j = sum over crossings c with j of t^k P_c a_j,     S = sum of X_j
//! ```
//!
//! with `M^(1) = F^t a`. Twelve bytes a crossing. Not handled: light as emitted by luminaires, which no spectral radius
//! depends on.

use rayon::prelude::*;

use crate::form_factors::cast::{Caster, Progress, Sampling, Variant};
use crate::form_factors::sparse::Rows;
use crate::light::nothing_passes;
use crate::light::team::{self, Owners};
use crate::patches::Patches;
use crate::rays::{Hit, Ray, Rays};

/// The crossings of one cast of rays, from which `F^t` is made for any t; where several processes share a solve, each
/// keeps those of some patches.
#[derive(Clone, Debug)]
pub struct Layers {
    owners: Owners,
    /// Of the patches kept here.
    rows: Vec<Row>,
    rays: u32,
    deepest: u32,
    /// Crossings of all patches, wherever they are kept, and columns of all rows.
    crossings: usize,
    columns: usize,
}

/// The crossings of the rays of one patch.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
struct Row {
    /// Columns that any crossing meets, ascending.
    columns: Vec<u32>,
    /// Where the crossings of each ray end; rays that meet nothing that sends are left out.
    ends: Vec<u32>,
    crossings: Vec<Crossing>,
}

/// A crossing with a patch that sends.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
struct Crossing {
    /// Place in [`Row::columns`].
    slot: u32,
    /// Surfaces crossed before.
    depth: u32,
    /// Product of their own tau.
    weight: f32,
}

/// Casts rays from the patches that receive and keeps their crossings with those that send; also returns how many
/// rays were cast.
///
/// `own` has each material's own tau, at the factor t = 1.
pub fn cast_layers(
    rays: &Rays,
    patches: &Patches,
    own: &Variant,
    sampling: &Sampling,
    tick: Progress,
) -> (Layers, u64) {
    let Variant { tau, rows: receives, columns: sends } = own;
    let opaque = nothing_passes(tau.iter().copied());
    let caster = Caster::new(rays, patches, opaque, sampling);
    let count = sampling.rays.max(1);
    let needed = |i: usize| receives[i] && sends.contains(&true);
    let row = |hits: &mut Vec<Hit>, i: usize| {
        tick(1);
        let mut row = Row::default();
        if needed(i) {
            caster.each(i, count, hits, |ray, hits| row.collect(&caster, sends, tau, ray, hits));
            row.number_columns();
        }
        row
    };
    let (owners, rows) = team::keep(patches.len(), |_| 1.0, Vec::new, row);
    let sources = (0..patches.len()).filter(|&i| needed(i)).count();
    (Layers::new(owners, rows, count), sources as u64 * u64::from(count))
}

impl Row {
    /// Adds the crossings of one ray with patches that send; columns stand in for slots until all are known.
    fn collect(&mut self, caster: &Caster, sends: &[bool], tau: &[f32], ray: &Ray, hits: &[Hit]) {
        let before = self.crossings.len();
        let mut depths = 0..;
        caster.rays.transmit(
            hits,
            |m| tau[m],
            |hit, weight| {
                let depth = depths.next().unwrap_or(u32::MAX);
                if let Some(slot) = caster.patches.met(ray, hit).filter(|&j| sends[j as usize]) {
                    self.crossings.push(Crossing { slot, depth, weight });
                }
            },
        );
        if self.crossings.len() > before {
            self.ends.push(self.crossings.len() as u32);
        }
    }

    /// Sorts the columns out and lets crossings point to them.
    fn number_columns(&mut self) {
        self.columns = self.crossings.iter().map(|c| c.slot).collect();
        self.columns.sort_unstable();
        self.columns.dedup();
        for c in &mut self.crossings {
            // Present by construction.
            c.slot = self.columns.partition_point(|&j| j < c.slot) as u32;
        }
        // All are kept to the end: without room to grow.
        self.columns.shrink_to_fit();
        self.ends.shrink_to_fit();
        self.crossings.shrink_to_fit();
    }

    /// The crossings of each ray.
    fn rays(&self) -> impl Iterator<Item = &[Crossing]> {
        let mut start = 0;
        self.ends.iter().map(move |&end| {
            let ray = &self.crossings[start..end as usize];
            start = end as usize;
            ray
        })
    }

    fn form_factors(&self, powers: &[f32], values: &mut [f64]) {
        for c in &self.crossings {
            values[c.slot as usize] += f64::from(c.weight * powers[c.depth as usize]);
        }
    }

    fn moment(&self, powers: &[f32], passed: &[f32], order: f64, values: &mut [f64]) {
        let carried = |c: &Crossing| {
            let passed = passed[self.columns[c.slot as usize] as usize];
            f64::from(c.weight * powers[c.depth as usize] * passed)
        };
        for ray in self.rays() {
            let sum: f64 = ray.iter().map(carried).sum();
            let factor = match order {
                1.0 => 1.0,
                2.0 => sum,
                _ if sum > 0.0 => sum.powf(order - 1.0),
                _ => 0.0,
            };
            for c in ray {
                values[c.slot as usize] += factor * carried(c);
            }
        }
    }
}

/// All crossings as numbers, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerNumbers {
    /// Rays of each patch.
    pub rays: u32,
    /// Columns, and rays that meet something, of each row.
    pub columns_of: Vec<usize>,
    /// See `columns_of`.
    pub rays_of: Vec<usize>,
    /// Columns that a row meets, ascending.
    pub columns: Vec<u32>,
    /// Where the crossings of each ray end, counted from the row's first.
    pub ends: Vec<u32>,
    /// Of each crossing its place in the row's columns, the surfaces crossed before, and the product of their tau.
    pub slots: Vec<u32>,
    /// See `slots`.
    pub depths: Vec<u32>,
    /// See `slots`.
    pub weights: Vec<f32>,
}

impl Layers {
    /// All processes are to call it together, each with its own rows.
    fn new(owners: Owners, rows: Vec<Row>, rays: u32) -> Layers {
        let deepest = rows.iter().flat_map(|row| &row.crossings).map(|c| c.depth).max().unwrap_or(0);
        let sum = |own: fn(&Row) -> usize| owners.sum(rows.iter().map(own).sum::<usize>() as u64) as usize;
        let (crossings, columns) = (sum(|row| row.crossings.len()), sum(|row| row.columns.len()));
        Layers { deepest: owners.largest(deepest), owners, rows, rays, crossings, columns }
    }

    /// The crossings of all patches here; all processes are to call it together.
    pub fn whole(self) -> Layers {
        if self.owners.is_everyone() {
            return self;
        }
        let rows = team::all(self.rows).into_iter().flatten().collect();
        Layers { owners: Owners::everyone(self.owners.len()), rows, ..self }
    }

    /// All crossings as numbers.
    ///
    /// # Panics
    /// If other processes keep some ([`Layers::whole`]).
    pub fn numbers(&self) -> LayerNumbers {
        assert!(self.owners.is_everyone(), "crossings of some patches are not here");
        let crossings = || self.rows.iter().flat_map(|row| &row.crossings);
        LayerNumbers {
            rays: self.rays,
            columns_of: self.rows.iter().map(|row| row.columns.len()).collect(),
            rays_of: self.rows.iter().map(|row| row.ends.len()).collect(),
            columns: self.rows.iter().flat_map(|row| row.columns.iter().copied()).collect(),
            ends: self.rows.iter().flat_map(|row| row.ends.iter().copied()).collect(),
            slots: crossings().map(|c| c.slot).collect(),
            depths: crossings().map(|c| c.depth).collect(),
            weights: crossings().map(|c| c.weight).collect(),
        }
    }

    /// Crossings kept, by all processes together.
    pub fn crossings(&self) -> usize {
        self.crossings
    }

    /// Columns of all rows together.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Surfaces crossed before the deepest of them.
    pub fn deepest(&self) -> u32 {
        self.deepest
    }

    /// `F^t`, every own tau scaled by t; columns that do not send are empty.
    pub fn form_factors(&self, t: f32) -> Rows {
        let powers = self.powers(t);
        self.rows_by(|row, values| row.form_factors(&powers, values))
    }

    /// `M^(order)`, whose power n maps to the moments of that order of the light that random paths of n reflections
    /// carry, before any roulette; `passed` is `a`, one number a patch.
    pub fn moment(&self, t: f32, passed: &[f32], order: f64) -> Rows {
        let powers = self.powers(t);
        self.rows_by(|row, values| row.moment(&powers, passed, order, values))
    }

    /// `t^k` for every k that occurs.
    fn powers(&self, t: f32) -> Vec<f32> {
        let next = |power: &f64| Some(power * f64::from(t));
        let powers = std::iter::successors(Some(1.0), next);
        powers.take(self.deepest as usize + 1).map(|p| p as f32).collect()
    }

    /// A matrix whose rows are means over the rays; entries that are 0 are left out.
    fn rows_by(&self, fill: impl Fn(&Row, &mut [f64]) + Sync) -> Rows {
        let share = 1.0 / f64::from(self.rays);
        let row = |values: &mut Vec<f64>, row: &Row| {
            values.clear();
            values.resize(row.columns.len(), 0.0);
            fill(row, values);
            let entries = row.columns.iter().zip(values.iter());
            entries.filter(|(_, v)| **v > 0.0).map(|(&j, &v)| (j, (v * share) as f32)).unzip()
        };
        let rows = self.rows.par_iter().map_init(Vec::new, row);
        Rows::of_part(self.owners.clone(), rows.collect())
    }
}
