//! The light of charts, layer by layer: what every cell and texel receives of each term, lamp and node of tau.
//!
//! Cells have what their patches receive, by area of those that any light reaches; texels have direct light at their
//! points, and what glows as cells receive it, bilinear between them. What lies hidden under something else, where
//! neither paths nor light come at tau = 0, takes the mean of what is beside it, one cell far, so that it does not
//! darken the light beside it.

use glam::DVec3;

use crate::cell_rows::CellRows;
use crate::charts::{Charts, Taps};
use crate::reached::Reached;
use crate::sums::Mixture;
use crate::terms::{Solved, received};
use halflight::light::Rgb;

/// Irradiance over pi by node and lamp.
pub(super) struct Layers {
    /// Of cells: of the light of term n = 2, 3, ...
    pub reflected: Vec<Vec<Vec<Vec<Rgb>>>>,
    /// Of cells: of the dominant eigenvector of each node.
    pub dominant: Vec<Vec<Rgb>>,
    /// Of texels: of light as emitted.
    pub direct: Vec<Vec<Vec<Rgb>>>,
}

impl Layers {
    /// Brings solved light to the cells and texels of charts; `direct` is irradiance over pi in the texels, by node and
    /// lamp, and `reached` counts paths that came to each.
    pub fn new(
        (solved, direct): (&Solved, Vec<Vec<Vec<Rgb>>>),
        charts: &Charts,
        rows: &CellRows,
        reached: &Reached,
    ) -> Layers {
        let is_lit = lit(solved);
        let cells: Vec<Vec<(u32, f32)>> = parts(charts, reached).iter().map(|own| weights(own, &is_lit)).collect();
        let of_cells: Vec<bool> =
            cells.iter().map(|own| own.iter().any(|(patch, _)| is_lit[*patch as usize])).collect();
        let reached = &reached.counts;
        let of_texel = |t: usize| reached[t] > 0 || direct[0].iter().any(|lamp| lamp[t] != Rgb::ZERO);
        let of_texels: Vec<bool> = (0..reached.len()).map(of_texel).collect();
        let fill_cells = charts.fills(1, &of_cells, 1);
        let fill_texels = charts.fills(charts.fine, &of_texels, charts.fine);
        let Solved { nodes, rho, alpha, kept, .. } = solved;
        let (rho, alpha) = (&rho[..], &alpha[..]);
        // Light that patches receive and light that leaves them, as cells receive it at node q.
        let cells_of = |q: usize, received: &dyn Fn(usize) -> Rgb, sent: &dyn Fn(usize) -> Rgb| -> Vec<Rgb> {
            let cell = |own: &Vec<(u32, f32)>| own.iter().map(|&(p, share)| share * received(p as usize)).sum();
            let mut values = filled(cells.iter().map(cell).collect(), &fill_cells);
            rows.receive(q, sent, &mut values);
            values
        };
        let mut layers = Layers { reflected: Vec::new(), dominant: Vec::new(), direct: Vec::new() };
        for ((q, node), direct) in nodes.iter().enumerate().zip(direct) {
            let of_terms = |(lamp, terms): (usize, &Vec<Vec<Rgb>>)| {
                let pairs = terms.iter().zip(terms.iter().skip(1));
                let term = |(before, own): (&Vec<Rgb>, &Vec<Rgb>)| {
                    cells_of(q, &|i| received(own[i], rho[i]), &|i| alpha[i] * before[i])
                };
                let mut layers: Vec<Vec<Rgb>> = pairs.map(term).collect();
                layers.first_mut().into_iter().for_each(|twice| rows.receive_once(q, lamp, twice));
                layers
            };
            layers.reflected.push(node.terms.iter().enumerate().map(of_terms).collect());
            let (v, lambda) = (&node.dominant, kept.lambda[q].as_vec3());
            layers.dominant.push(cells_of(q, &|i| received(v[i], rho[i]), &|i| alpha[i] * received(v[i], lambda)));
            let texels = |(direct, (glow, glowing)): (Vec<Rgb>, (&Vec<Rgb>, &Vec<Rgb>))| {
                let mut texels = filled(direct, &fill_texels);
                if glow.iter().any(|light| *light != Rgb::ZERO) {
                    charts.add_to_texels(&cells_of(q, &|i| glow[i], &|i| glowing[i]), &mut texels);
                }
                texels
            };
            let glows = node.glow.iter().zip(&node.glowing);
            layers.direct.push(direct.into_iter().zip(glows).map(texels).collect());
        }
        layers
    }

    /// What is received where some cells and texels are read.
    pub fn incident(&self, [cells, texels]: &[Taps; 2], mixture: &Mixture) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for (q, lamps) in mixture.weights.iter().enumerate() {
            for (lamp, weights) in lamps.iter().enumerate() {
                if let Some(weight) = weights.first().filter(|weight| **weight != DVec3::ZERO) {
                    sum += *weight * read(&self.direct[q][lamp], texels);
                }
                for (weight, layer) in weights.iter().skip(1).zip(&self.reflected[q][lamp]) {
                    if *weight != DVec3::ZERO {
                        sum += *weight * read(layer, cells);
                    }
                }
            }
        }
        for (layer, weight) in self.dominant.iter().zip(&mixture.dominant) {
            if *weight != DVec3::ZERO {
                sum += *weight * read(layer, cells);
            }
        }
        sum.max(DVec3::ZERO)
    }
}

fn read(layer: &[Rgb], taps: &Taps) -> DVec3 {
    taps.iter().map(|&(k, weight)| f64::from(weight) * layer[k].as_dvec3()).sum()
}

/// Patches that some light reaches at the first node.
fn lit(solved: &Solved) -> Vec<bool> {
    let terms = || solved.nodes[0].terms.iter().flatten();
    let reflects = |i: usize| solved.rho[i].max_element() > 0.0;
    (0..solved.areas.len()).map(|i| !reflects(i) || terms().any(|term| term[i].max_element() > 0.0)).collect()
}

/// The patches of each cell, or what parts of them the points of its texels lie in, with weights that add up to 1.
fn parts(charts: &Charts, reached: &Reached) -> Vec<Vec<(u32, f32)>> {
    let of_cell = |(cell, own): (usize, &Vec<(u32, f32)>)| {
        let any = charts.texels_of(cell).any(|texel| reached.counts[texel] > 0);
        let texels = charts.texels_of(cell).filter(|&texel| !any || reached.counts[texel] > 0);
        let points: Vec<u32> = texels.flat_map(|texel| &reached.places[texel]).map(|place| place.1).collect();
        let share = 1.0 / points.len() as f32;
        // Patches that are not divided have their shares by area.
        let is_whole = points.iter().all(|part| own.iter().any(|(patch, _)| patch == part));
        if is_whole { own.clone() } else { points.into_iter().map(|part| (part, share)).collect() }
    };
    charts.cells.iter().enumerate().map(of_cell).collect()
}

/// The patches of a cell that are lit, with weights that add up to 1; all of them where none is.
fn weights(own: &[(u32, f32)], is_lit: &[bool]) -> Vec<(u32, f32)> {
    let lit: Vec<(u32, f32)> = own.iter().copied().filter(|(patch, _)| is_lit[*patch as usize]).collect();
    let sum: f32 = lit.iter().map(|(_, share)| share).sum();
    if sum > 0.0 { lit.into_iter().map(|(patch, share)| (patch, share / sum)).collect() } else { own.to_vec() }
}

fn filled(mut values: Vec<Rgb>, fills: &[(usize, Vec<usize>)]) -> Vec<Rgb> {
    for (k, others) in fills {
        values[*k] = others.iter().map(|&j| values[j]).sum::<Rgb>() / others.len() as f32;
    }
    values
}
