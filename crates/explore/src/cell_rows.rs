//! Rows of F from cells that are finer than patches, or of small faces: what they receive of the light of patches, from
//! their own points.
//!
//! ```text
//! I(cell) = sum over patches j of F^tau_j L_j,     F^tau_j from rays that start at the points of the cell
//! ```
//!
//! One patch stands for many such cells, some lit and some not. With L_h on patches this evaluates `E + K L_h` once
//! more on what is finer, which is a better solution than L_h (I. Sloan, *Improvement by projection methods*, 1976).
//! What was reflected once is read from the texels that the rays meet, which are finer still.
//!
//! Other cells of grids are patches: their row is the one that was solved with.
//!
//! Not handled: cells without points, and those of grids that nothing reaches: they keep what their patch receives.

use glam::Vec3;
use rayon::prelude::*;

use crate::charts::Charts;
use crate::reached::{Place, Reached};
use halflight::light::Rgb;
use halflight::patches::Patches;
use halflight::rays::purpose::Purpose;
use halflight::rays::sobol::{Sobol, hash};
use halflight::rays::warp::hemisphere_direction;
use halflight::rays::{Hit, Ray, Rays};

/// Rays of each cell.
const RAYS: u32 = 512;

/// The rows of some cells at every node of tau.
pub(super) struct CellRows {
    /// The cells.
    cells: Vec<usize>,
    /// By node, then in the order of the cells: patches, and form factors to them.
    rows: Vec<Vec<Vec<(u32, f32)>>>,
    /// By node and lamp what they receive of light that was reflected once.
    once: Vec<Vec<Vec<Rgb>>>,
}

/// Light that leaves texels once reflected, for a node, a lamp, a texel and the patch there.
pub(super) type SentOnce<'a> = &'a (dyn Fn(usize, usize, usize, usize) -> Rgb + Sync);

impl CellRows {
    /// Casts the rays of all cells of small faces; `taus` are those of every material at each node.
    pub fn new(
        (rays, patches): (&Rays, &Patches),
        charts: &Charts,
        reached: &Reached,
        taus: &[Vec<f32>],
        (sent_once, lamps): (SentOnce, usize),
        seed: u32,
    ) -> CellRows {
        let (sobol, seed) = (Sobol::new(RAYS as usize, 2), Purpose::CellRows.seed(seed));
        let cells: Vec<usize> = charts.gathered_cells().collect();
        let opaque = !taus.iter().flatten().any(|&tau| tau > 0.0);
        let row = |hits: &mut Vec<Hit>, &cell: &usize| {
            let is_reached = |texel: &usize| reached.counts[*texel] > 0;
            let any = charts.texels_of(cell).any(|texel| is_reached(&texel));
            let is_hidden = |texel: usize| !any && charts.is_of_grid(texel);
            let texels = charts.texels_of(cell).filter(|texel| is_reached(texel) || !any && !is_hidden(*texel));
            let from: Vec<&Place> = texels.flat_map(|texel| &reached.places[texel]).collect();
            let seed = hash(cell as u32, seed);
            let mut found: Vec<Vec<(u32, f32)>> = vec![Vec::new(); taus.len()];
            let mut once = vec![vec![Rgb::ZERO; lamps]; taus.len()];
            for k in 0..if from.is_empty() { 0 } else { RAYS } {
                let (point, _) = from[k as usize % from.len()];
                let direction: Vec3 =
                    hemisphere_direction(point.normal, sobol.point(k, 0, seed), sobol.point(k, 1, seed));
                let ray = Ray { origin: point.position, direction, source: point.source() };
                rays.light_crossings(&ray, opaque, hits);
                for (q, tau) in taus.iter().enumerate() {
                    let add = |hit: &Hit, through: f32| {
                        let (Some(patch), factor) = (patches.met(&ray, hit), through / RAYS as f32) else { return };
                        found[q].push((patch, factor));
                        let Some(texel) = charts.texel(hit.face, hit.side, ray.at(hit.t)) else { return };
                        for (lamp, sum) in once[q].iter_mut().enumerate() {
                            *sum += factor * sent_once(q, lamp, texel, patch as usize);
                        }
                    };
                    rays.transmit(hits, |m| tau[m], add);
                }
            }
            (found.into_iter().map(merged).collect::<Vec<_>>(), once)
        };
        type OfCell = (Vec<Vec<(u32, f32)>>, Vec<Vec<Rgb>>);
        let by_cell: Vec<OfCell> = cells.par_iter().map_init(Vec::new, row).collect();
        let mut rows: Vec<Vec<Vec<(u32, f32)>>> = vec![Vec::new(); taus.len()];
        let mut once = vec![vec![Vec::new(); lamps]; taus.len()];
        for (own, light) in by_cell {
            rows.iter_mut().zip(own).for_each(|(rows, row)| rows.push(row));
            let each = once.iter_mut().flatten().zip(light.into_iter().flatten());
            each.for_each(|(all, light)| all.push(light));
        }
        CellRows { cells, rows, once }
    }

    /// Puts what the cells receive of a lamp's light that was reflected once into the values of all cells.
    pub fn receive_once(&self, q: usize, lamp: usize, values: &mut [Rgb]) {
        let own = self.cells.iter().zip(&self.rows[q]).zip(&self.once[q][lamp]);
        own.filter(|((_, row), _)| !row.is_empty()).for_each(|((&cell, _), light)| values[cell] = *light);
    }

    /// Puts what the cells receive of light that leaves the patches at node q into the values of all cells.
    pub fn receive(&self, q: usize, sent: impl Fn(usize) -> Rgb, values: &mut [Rgb]) {
        for (&cell, row) in self.cells.iter().zip(&self.rows[q]).filter(|(_, row)| !row.is_empty()) {
            values[cell] = row.iter().map(|&(patch, factor)| factor * sent(patch as usize)).sum();
        }
    }
}

/// Entries of one patch added up.
fn merged(mut row: Vec<(u32, f32)>) -> Vec<(u32, f32)> {
    row.sort_by_key(|entry| entry.0);
    row.dedup_by(|next, entry| {
        let same = next.0 == entry.0;
        if same {
            entry.1 += next.1;
        }
        same
    });
    row
}
