//! Light of every patch by generation: what it received, and what of it has not been shot.
//!
//! Generation n is light after n reflections. The ledger keeps the incident light (before rho) of each generation, from
//! which both halves follow: `visible = rho incident`, `invisible = alpha rho incident`. The last generation kept apart
//! also takes all later ones. Several E, the sources, are kept apart in slots: slot `n sources + s` is generation n of
//! source s, so memory is patches times generations times sources. f64 throughout: many small deposits add up.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use crate::light::Light;
use crate::solve::shooting::shooters::{Column, Surfaces};

/// Chunks that receivers are divided into: each searches every column for its own once.
const CHUNKS: usize = 64;
/// Additions below which one thread does all: at a nanosecond each they end before another thread has woken, which
/// takes some 50 microseconds, and far more where the machine has other work.
const ALONE: usize = 1 << 16;

/// Unshot light of one sender: slot and invisible radiance, zeros omitted.
pub(crate) type Shot = Vec<(usize, DVec3)>;

/// The state of all patches.
#[derive(Clone, Debug)]
pub(crate) struct Ledger {
    /// The last generation kept apart.
    last: usize,
    sources: usize,
    patches: Vec<Account>,
    /// Unshot power of every patch, all sources and channels, W.
    power: Vec<f64>,
}

/// Light of one patch, by slot as far as any arrived.
#[derive(Clone, Debug)]
struct Account {
    /// Incident light; that of generation 0 stays 0. Has whole generations.
    incident: Vec<DVec3>,
    /// Unshot invisible radiance.
    unshot: Vec<DVec3>,
}

impl Ledger {
    /// All of the sources' E unshot, nothing received. `last` is at least 1.
    pub(crate) fn new(surfaces: &Surfaces, emissions: &[&[Light]], last: usize) -> Ledger {
        let emitted = |i: usize| emissions.iter().map(move |e| e[i].invisible.as_dvec3());
        let patch = |i: usize| Account { incident: vec![DVec3::ZERO; emissions.len()], unshot: emitted(i).collect() };
        let power = |(i, area): (usize, &f64)| PI * area * emitted(i).sum::<DVec3>().element_sum();
        Ledger {
            last: last.max(1),
            sources: emissions.len(),
            power: surfaces.areas.iter().enumerate().map(power).collect(),
            patches: (0..surfaces.areas.len()).map(patch).collect(),
        }
    }

    /// Unshot power of every patch, W.
    pub(crate) fn power(&self) -> &[f64] {
        &self.power
    }

    /// The generations that light reached, those of E and KE at least.
    pub(crate) fn generations(&self) -> usize {
        let slots = self.patches.iter().map(|own| own.incident.len()).max().unwrap_or(0);
        slots.div_ceil(self.sources.max(1)).max(2)
    }

    /// Generation 0 or a later one of what a patch shoots from a slot.
    pub(crate) fn generation_of(&self, slot: usize) -> usize {
        slot / self.sources
    }

    /// Incident light of patch i in generation n of a source.
    pub(crate) fn incident(&self, i: usize, source: usize, n: usize) -> DVec3 {
        self.patches[i].incident.get(n * self.sources + source).copied().unwrap_or_default()
    }

    /// Incident light of patch i and a source, generations 1 to the last.
    pub(crate) fn all_incident(&self, i: usize, source: usize) -> impl Iterator<Item = &DVec3> {
        self.patches[i].incident.iter().skip(self.sources + source).step_by(self.sources.max(1))
    }

    /// Incident light of patch i that was reflected before, of all sources.
    pub(crate) fn reflected(&self, i: usize) -> DVec3 {
        self.patches[i].incident.iter().skip(2 * self.sources).sum()
    }

    /// Takes all that patch i has not shot.
    pub(crate) fn take(&mut self, i: usize) -> Shot {
        self.power[i] = 0.0;
        let taken = self.patches[i].unshot.iter_mut().map(std::mem::take).enumerate();
        taken.filter(|(_, l)| *l != DVec3::ZERO).collect()
    }

    /// Adds `F_ij L_j` of every column to its receivers, one generation later.
    pub(crate) fn deposit(&mut self, surfaces: &Surfaces, columns: &[Column], shots: &[Shot]) {
        let (last, sources) = (self.last, self.sources);
        let next = |slot: usize| if slot / sources < last { slot + sources } else { slot };
        let later: Vec<Shot> = shots.iter().map(|s| s.iter().map(|&(slot, l)| (next(slot), l)).collect()).collect();
        let most = later.iter().flatten().map(|shot| shot.0 + 1).max().unwrap_or(0);
        let slots = most.next_multiple_of(sources.max(1));
        let size = self.patches.len().div_ceil(CHUNKS).max(1);
        let receive = |(k, (patches, power)): (usize, (&mut [Account], &mut [f64]))| {
            let first = k * size;
            let arrived = arrived(first..first + patches.len(), columns, &later, slots);
            for (k, arrived) in arrived.chunks(slots.max(1)).enumerate() {
                power[k] += patches[k].enter(surfaces, first + k, arrived);
            }
        };
        let additions: usize = columns.iter().map(|c| c.receivers.len() * later[c.sender].len()).sum();
        let (patches, power) = (&mut self.patches, &mut self.power);
        if additions + patches.len() * slots < ALONE {
            patches.chunks_mut(size).zip(power.chunks_mut(size)).enumerate().for_each(receive);
        } else {
            patches.par_chunks_mut(size).zip(power.par_chunks_mut(size)).enumerate().for_each(receive);
        }
    }
}

/// What the columns bring to a run of receivers: `slots` numbers for each.
fn arrived(receivers: std::ops::Range<usize>, columns: &[Column], later: &[Shot], slots: usize) -> Vec<DVec3> {
    let mut arrived = vec![DVec3::ZERO; receivers.len() * slots];
    for column in columns {
        let [from, to] =
            [receivers.start, receivers.end].map(|end| column.receivers.partition_point(|&i| (i as usize) < end));
        for (&i, &f) in column.receivers[from..to].iter().zip(&column.factors[from..to]) {
            let own = (i as usize - receivers.start) * slots;
            for &(n, l) in &later[column.sender] {
                arrived[own + n] += f as f64 * l;
            }
        }
    }
    arrived
}

impl Account {
    /// Enters what arrived at patch i, slot by slot; returns the power of it that is unshot, W.
    fn enter(&mut self, surfaces: &Surfaces, i: usize, arrived: &[DVec3]) -> f64 {
        let rho = surfaces.rho[i].as_dvec3();
        let alpha = surfaces.alpha[i] as f64;
        let mut total = DVec3::ZERO;
        for (n, &incident) in arrived.iter().enumerate().filter(|(_, incident)| **incident != DVec3::ZERO) {
            if n >= self.incident.len() {
                self.incident.resize(arrived.len(), DVec3::ZERO);
                self.unshot.resize(arrived.len(), DVec3::ZERO);
            }
            self.incident[n] += incident;
            self.unshot[n] += alpha * rho * incident;
            total += incident;
        }
        PI * surfaces.areas[i] * alpha * (rho * total).element_sum()
    }
}
