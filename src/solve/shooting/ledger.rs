//! Light of every patch by generation: what it received, and what of it has not been shot.
//!
//! Generation n is light after n reflections. The ledger keeps the incident light (before rho) of each generation, from
//! which both halves follow: `visible = rho incident`, `invisible = alpha rho incident`. The last generation kept apart
//! also takes all later ones, so memory is patches times generations. f64 throughout: many small deposits add up.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use crate::solve::shooting::shooters::{Column, Surfaces};

/// Chunks that receivers are divided into: fixed, so that sums do not depend on the number of threads.
const CHUNKS: usize = 64;
/// Additions below which one thread does all: at a nanosecond each they end before another thread has woken, which
/// takes some 50 microseconds, and far more where the machine has other work.
const ALONE: usize = 1 << 16;

/// Unshot light of one sender: generation and invisible radiance, zeros left out.
pub(crate) type Shot = Vec<(usize, DVec3)>;

/// The state of all patches.
#[derive(Clone, Debug)]
pub(crate) struct Ledger {
    patches: usize,
    /// Generations there is room for, 0 included.
    stride: usize,
    /// The last generation kept apart.
    last: usize,
    /// Incident light, patch by patch; generation 0 stays 0.
    incident: Vec<DVec3>,
    /// Unshot invisible radiance, patch by patch.
    unshot: Vec<DVec3>,
    /// Unshot power of every patch, all channels, W.
    power: Vec<f64>,
}

impl Ledger {
    /// All of E unshot, nothing received. `last` is at least 1.
    pub fn new(surfaces: &Surfaces, last: usize) -> Ledger {
        let patches = surfaces.areas.len();
        let stride = 2;
        let mut ledger = Ledger {
            patches,
            stride,
            last: last.max(1),
            incident: vec![DVec3::ZERO; patches * stride],
            unshot: vec![DVec3::ZERO; patches * stride],
            power: vec![0.0; patches],
        };
        for (i, e) in surfaces.emission.iter().enumerate() {
            let e = e.invisible.as_dvec3();
            ledger.unshot[i * stride] = e;
            ledger.power[i] = PI * surfaces.areas[i] * e.element_sum();
        }
        ledger
    }

    /// Unshot power of every patch, W.
    pub fn power(&self) -> &[f64] {
        &self.power
    }

    /// The generations there is room for; those beyond what was reached are 0.
    pub fn generations(&self) -> usize {
        self.stride
    }

    /// Incident light of patch i in generation n.
    pub fn incident(&self, i: usize, n: usize) -> DVec3 {
        if n < self.stride { self.incident[i * self.stride + n] } else { DVec3::ZERO }
    }

    /// Incident light of patch i, generations 1 to the last.
    pub fn all_incident(&self, i: usize) -> &[DVec3] {
        &self.incident[i * self.stride + 1..(i + 1) * self.stride]
    }

    /// Takes all that patch i has not shot.
    pub fn take(&mut self, i: usize) -> Shot {
        self.power[i] = 0.0;
        let own = &mut self.unshot[i * self.stride..(i + 1) * self.stride];
        let taken = own.iter_mut().map(std::mem::take).enumerate();
        taken.filter(|(_, l)| *l != DVec3::ZERO).collect()
    }

    /// Makes room for the generation after the latest of these shots.
    fn make_room(&mut self, shots: &[Shot]) {
        let latest = shots.iter().filter_map(|s| s.last()).map(|l| l.0).max();
        let needed = (latest.unwrap_or(0) + 1).min(self.last) + 1;
        if needed <= self.stride {
            return;
        }
        let stride = needed.max(self.stride + self.stride / 2).min(self.last + 1);
        for cells in [&mut self.incident, &mut self.unshot] {
            let mut wider = vec![DVec3::ZERO; self.patches * stride];
            let rows = wider.chunks_mut(stride).zip(cells.chunks(self.stride));
            for (wide, row) in rows {
                wide[..row.len()].copy_from_slice(row);
            }
            *cells = wider;
        }
        self.stride = stride;
    }

    /// Adds `F_ij L_j` of every column to its receivers, one generation later.
    pub fn deposit(&mut self, surfaces: &Surfaces, columns: &[Column], shots: &[Shot]) {
        self.make_room(shots);
        let (stride, last) = (self.stride, self.last);
        let later: Vec<Shot> = shots.iter().map(|s| s.iter().map(|&(n, l)| ((n + 1).min(last), l)).collect()).collect();
        let size = self.patches.div_ceil(CHUNKS).max(1);
        let incident = self.incident.chunks_mut(size * stride);
        let cells = incident.zip(self.unshot.chunks_mut(size * stride)).zip(self.power.chunks_mut(size));
        let chunk = |(k, ((incident, unshot), power))| Chunk { first: k * size, stride, incident, unshot, power };
        let mut chunks: Vec<Chunk> = cells.enumerate().map(chunk).collect();
        let receive = |chunk: &mut Chunk| chunk.receive(surfaces, columns, &later);
        let additions: usize = columns.iter().map(|c| c.receivers.len() * later[c.sender].len()).sum();
        // The same chunks either way, so that sums are the same bits.
        if additions + self.patches * stride < ALONE {
            chunks.iter_mut().for_each(receive);
        } else {
            chunks.par_iter_mut().for_each(receive);
        }
    }
}

/// A run of receivers.
struct Chunk<'a> {
    first: usize,
    stride: usize,
    incident: &'a mut [DVec3],
    unshot: &'a mut [DVec3],
    power: &'a mut [f64],
}

impl Chunk<'_> {
    /// Sums what the columns bring, then enters it patch by patch.
    fn receive(&mut self, surfaces: &Surfaces, columns: &[Column], later: &[Shot]) {
        let mut arrived = vec![DVec3::ZERO; self.incident.len()];
        let end = (self.first + self.power.len()) as u32;
        for column in columns {
            let from = column.receivers.partition_point(|&i| (i as usize) < self.first);
            let to = from + column.receivers[from..].partition_point(|&i| i < end);
            for (&i, &f) in column.receivers[from..to].iter().zip(&column.factors[from..to]) {
                let k = i as usize - self.first;
                let own = &mut arrived[k * self.stride..(k + 1) * self.stride];
                for &(n, l) in &later[column.sender] {
                    own[n] += f as f64 * l;
                }
            }
        }
        for (k, arrived) in arrived.chunks(self.stride).enumerate() {
            self.enter(surfaces, k, arrived);
        }
    }

    /// Enters what arrived at patch `first + k`, generation by generation.
    fn enter(&mut self, surfaces: &Surfaces, k: usize, arrived: &[DVec3]) {
        let i = self.first + k;
        let rho = surfaces.rho[i].as_dvec3();
        let alpha = surfaces.alpha[i] as f64;
        let mut total = DVec3::ZERO;
        for (n, &incident) in arrived.iter().enumerate() {
            if incident != DVec3::ZERO {
                self.incident[k * self.stride + n] += incident;
                self.unshot[k * self.stride + n] += alpha * rho * incident;
                total += incident;
            }
        }
        self.power[k] += PI * surfaces.areas[i] * alpha * (rho * total).element_sum();
    }
}
