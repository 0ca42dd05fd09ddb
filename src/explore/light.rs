//! The light of charts, layer by layer: what every cell and texel receives of each term, lamp and node of tau.
//!
//! Cells have what their patches receive, by area of those that any light reaches; texels have direct light at their
//! points, and what glows as cells receive it, bilinear between them. What lies hidden under something else, where neither paths nor light come at tau = 0, takes the mean of what is
//! beside it, one cell far, so that it does not darken the light beside it.

use glam::DVec3;

use crate::explore::charts::{Charts, Taps};
use crate::explore::sums::Mixture;
use crate::explore::terms::{Node, Solved, received};
use crate::light::Rgb;

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
    /// Brings solved light to the cells and texels of charts.
    pub fn new(solved: &mut Solved, charts: &Charts, reached: &[u32]) -> Layers {
        let is_lit = lit(solved);
        let cells: Vec<Vec<(u32, f32)>> = charts.cells.iter().map(|own| weights(own, &is_lit)).collect();
        let of_cells: Vec<bool> =
            cells.iter().map(|own| own.iter().any(|(patch, _)| is_lit[*patch as usize])).collect();
        let direct = &solved.nodes[0].direct;
        let of_texel = |t: usize| reached[t] > 0 || direct.iter().any(|lamp| lamp[t] != Rgb::ZERO);
        let of_texels: Vec<bool> = (0..reached.len()).map(of_texel).collect();
        let (fill_cells, fill_texels) =
            (charts.fills(1, &of_cells, 1), charts.fills(charts.fine, &of_texels, charts.fine));
        let rho = &solved.rho;
        let of_term = |term: &Vec<Rgb>| {
            let cell = |own: &Vec<(u32, f32)>| -> Rgb {
                own.iter().map(|&(p, share)| share * received(term[p as usize], rho[p as usize])).sum()
            };
            filled(cells.iter().map(cell).collect(), &fill_cells)
        };
        let of_lamp = |terms: &Vec<Vec<Rgb>>| terms.iter().skip(1).map(of_term).collect();
        let reflected = solved.nodes.iter().map(|node| node.terms.iter().map(of_lamp).collect()).collect();
        let dominant = solved.nodes.iter().map(|node| of_term(&node.dominant)).collect();
        let of_glow = |glow: &Vec<Rgb>| {
            let cell = |own: &Vec<(u32, f32)>| -> Rgb { own.iter().map(|&(p, share)| share * glow[p as usize]).sum() };
            filled(cells.iter().map(cell).collect(), &fill_cells)
        };
        let texels = |(direct, glow): (&mut Vec<Rgb>, &Vec<Rgb>)| {
            let mut texels = filled(std::mem::take(direct), &fill_texels);
            if glow.iter().any(|light| *light != Rgb::ZERO) {
                charts.add_to_texels(&of_glow(glow), &mut texels);
            }
            texels
        };
        let of_node = |node: &mut Node| node.direct.iter_mut().zip(&node.glow).map(texels).collect();
        let direct = solved.nodes.iter_mut().map(of_node).collect();
        Layers { reflected, dominant, direct }
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
