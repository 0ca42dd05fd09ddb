//! A source of rows that knows those of a folder, and remembers those it casts for another.
//!
//! What is cast to be kept is all of F for its tau: the rows of patches that reflect nothing and the columns of those
//! that send nothing too, so that other materials may use it. A mode gets the part that it needs.
//!
//! Not handled: whether rows that are held are of the scene; [`KeptFolder`](crate::kept::KeptFolder) checks it.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::kept::identity::sum;
use crate::kept::pieces::Pieces;
use halflight::form_factors::{FormFactors, Variant};
use halflight::operator::{Cast, RowSource, Wanted, Whole};

/// Which F: of which scene and patches ([`sum`]), by which rays, for which tau of each material.
#[derive(Clone, Debug, PartialEq)]
pub struct Which {
    pub sum: String,
    pub rays: u32,
    pub seed: u32,
    pub tau: Vec<f32>,
}

/// Rows of F that are kept.
pub struct KeptRows {
    /// Finished rows, where a folder is made.
    pieces: Option<Pieces>,
    /// All rows and columns of each.
    held: Mutex<Vec<(Which, Arc<FormFactors>)>>,
}

impl KeptRows {
    /// None yet; where a folder is made, those that an earlier run left beside it are used.
    pub fn new(save: Option<&Path>) -> KeptRows {
        KeptRows { pieces: save.map(Pieces::beside), held: Mutex::default() }
    }

    /// Takes all of an F that was read.
    pub(super) fn hold(&self, which: Which, factors: FormFactors) {
        self.lock().push((which, Arc::new(factors)));
    }

    /// All of an F, where it is known.
    pub(super) fn held(&self, which: &Which) -> Option<Arc<FormFactors>> {
        self.lock().iter().find(|(own, _)| own == which).map(|(_, factors)| Arc::clone(factors))
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(Which, Arc<FormFactors>)>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All of F for each of several tau, cast unless they are held; and how many rays were.
    pub(super) fn whole(&self, wanted: &Wanted, taus: &[Vec<f32>]) -> (Vec<Arc<FormFactors>>, u64) {
        let (scene, patches) = (&wanted.geometry.scene, wanted.patches);
        let which = of(wanted);
        let which = |tau: &[f32]| Which { tau: tau.to_vec(), ..which.clone() };
        let mut missing: Vec<Variant> = Vec::new();
        for tau in taus {
            if missing.iter().all(|v| v.tau != *tau) && self.held(&which(tau)).is_none() {
                missing.push(Variant::whole(scene, patches, tau));
            }
        }
        let mut rays = 0;
        if !missing.is_empty() {
            let wanted = Wanted { variants: &missing, ..*wanted };
            let (found, cast) = self.cast(&wanted, &which(&[]).sum);
            rays = cast;
            let mut held = self.lock();
            // Rounds of a search go on to other patches and rays.
            let now = which(&[]);
            held.retain(|(own, _)| own.sum == now.sum && own.rays == now.rays);
            held.extend(missing.iter().zip(found).map(|(v, factors)| (which(&v.tau), Arc::new(factors))));
        }
        (taus.iter().filter_map(|tau| self.held(&which(tau))).collect(), rays)
    }

    /// Casts rows, with every process: one of them writes what is kept.
    fn cast(&self, wanted: &Wanted, sum: &str) -> (Vec<FormFactors>, u64) {
        match &self.pieces {
            Some(pieces) => pieces.cast(wanted, sum),
            None => Whole(Arc::new(Cast)).rows(wanted),
        }
    }

    /// Removes the finished rows beside a folder that is in its place now.
    pub(super) fn remove_pieces(&self) {
        self.pieces.iter().for_each(Pieces::remove);
    }
}

/// F of no tau.
fn of(wanted: &Wanted) -> Which {
    let sum = sum(&wanted.geometry.scene, wanted.patches);
    Which { sum, rays: wanted.sampling.rays, seed: wanted.sampling.seed, tau: Vec::new() }
}

/// Whether a variant has any entry.
fn needs_rays(variant: &&Variant) -> bool {
    variant.rows.contains(&true) && variant.columns.contains(&true)
}

/// The part of F that a variant needs.
fn part(all: &FormFactors, variant: &Variant) -> FormFactors {
    let sum = |(sum, &is): (&Option<f32>, &bool)| sum.filter(|_| is);
    FormFactors {
        rows: all.rows.restricted(&variant.rows, &variant.columns),
        row_sums: all.row_sums.iter().zip(&variant.rows).map(sum).collect(),
    }
}

impl RowSource for KeptRows {
    fn rows(&self, wanted: &Wanted) -> (Vec<FormFactors>, u64) {
        if self.pieces.is_none() && !self.knows(wanted) {
            return self.cast(wanted, "");
        }
        let taus: Vec<Vec<f32>> = wanted.variants.iter().filter(needs_rays).map(|v| v.tau.clone()).collect();
        let (all, rays) = self.whole(wanted, &taus);
        let mut all = all.iter();
        let own = |v: &Variant| match needs_rays(&v).then(|| all.next()).flatten() {
            Some(all) => part(all, v),
            None => FormFactors::none(wanted.patches.len()),
        };
        (wanted.variants.iter().map(own).collect(), rays)
    }

    fn knows(&self, wanted: &Wanted) -> bool {
        if self.lock().is_empty() {
            return false;
        }
        let which = of(wanted);
        let mut needed = wanted.variants.iter().filter(needs_rays);
        needed.all(|v| self.held(&Which { tau: v.tau.clone(), ..which.clone() }).is_some())
    }
}
