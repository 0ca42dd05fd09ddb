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

/// Power that landed in one deposit, W over all channels.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Landed {
    pub absorbed: f64,
    pub held: f64,
    /// Landed from columns whose fate is not known.
    pub unexplained: f64,
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

    /// Unshot power of one generation, W.
    pub fn unshot_power(&self, areas: &[f64], n: usize) -> f64 {
        let at = |i: usize| self.unshot[i * self.stride + n].element_sum();
        let sum = |(i, a): (usize, &f64)| PI * a * at(i);
        if n < self.stride { areas.iter().enumerate().map(sum).sum() } else { 0.0 }
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
    pub fn deposit(&mut self, surfaces: &Surfaces, columns: &[Column], shots: &[Shot]) -> Landed {
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
        let landed: Vec<Landed> = if additions + self.patches * stride < ALONE {
            chunks.iter_mut().map(receive).collect()
        } else {
            chunks.par_iter_mut().map(receive).collect()
        };
        landed.into_iter().fold(Landed::default(), Landed::plus)
    }
}

impl Landed {
    fn plus(self, other: Landed) -> Landed {
        Landed {
            absorbed: self.absorbed + other.absorbed,
            held: self.held + other.held,
            unexplained: self.unexplained + other.unexplained,
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
    fn receive(&mut self, surfaces: &Surfaces, columns: &[Column], later: &[Shot]) -> Landed {
        let mut arrived = vec![DVec3::ZERO; self.incident.len()];
        let unexplained = self.gather(surfaces, columns, later, &mut arrived);
        let mut landed = Landed { unexplained, ..Landed::default() };
        for (k, arrived) in arrived.chunks(self.stride).enumerate() {
            self.credit(surfaces, k, arrived, &mut landed);
        }
        landed
    }

    /// Sums what the columns bring; tells the power brought by those without a known fate.
    fn gather(&self, surfaces: &Surfaces, columns: &[Column], later: &[Shot], arrived: &mut [DVec3]) -> f64 {
        let mut unexplained = 0.0;
        let end = (self.first + self.power.len()) as u32;
        for column in columns {
            let from = column.receivers.partition_point(|&i| (i as usize) < self.first);
            let to = from + column.receivers[from..].partition_point(|&i| i < end);
            let shot = &later[column.sender];
            let mut area = 0.0;
            for (&i, &f) in column.receivers[from..to].iter().zip(&column.factors[from..to]) {
                let k = i as usize - self.first;
                let own = &mut arrived[k * self.stride..(k + 1) * self.stride];
                for &(n, l) in shot {
                    own[n] += f as f64 * l;
                }
                area += f as f64 * surfaces.areas[i as usize];
            }
            if column.fate.is_none() {
                let sum: f64 = shot.iter().map(|(_, l)| l.element_sum()).sum();
                unexplained += PI * area * sum;
            }
        }
        unexplained
    }

    /// Enters what arrived at one patch.
    fn credit(&mut self, surfaces: &Surfaces, k: usize, arrived: &[DVec3], landed: &mut Landed) {
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
        let area = PI * surfaces.areas[i];
        let reflected = (rho * total).element_sum();
        self.power[k] += area * alpha * reflected;
        landed.absorbed += area * ((1.0 - rho) * total).element_sum();
        landed.held += area * (1.0 - alpha) * reflected;
    }
}
