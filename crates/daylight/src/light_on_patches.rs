//! The light of all sky patches on the patches of a scene, or the importance of these for points.
//!
//! ```text
//! B = a rho (S + F B)     B_ip: pi times the radiance that patch i sends under a radiance of 1 from column p
//! D = S_x + W B           W_xi: what a point receives of a unit of B_i
//!   = S_x + U a rho S     U = W + F^T a rho U
//! ```
//!
//! The first line has as many right sides as there are columns, 16 of which go through F at once
//! ([`halflight::solve::solve_columns`]); the last as many as there are points. Where no reflectance has a colour three
//! columns take the place of the channels, and four points that of one.
//!
//! Not handled: slopes of light within patches.

use glam::Vec4;
use halflight::light::{Light, Rgb};
use halflight::operator::LitPatches;
use halflight::solve::{Settings, Source, Verdict, reflected_columns, solve_columns, verdict};
use halflight::{LinearOperator, Operator};
use rayon::prelude::*;

use crate::error::DaylightError;
use crate::gather::Weights;

/// Sources that are solved at once: what their light takes in memory.
const AT_ONCE: usize = 96;
/// What a solution may leave, as a share of reflected light.
const LEFT: f64 = 1e-4;
/// Products with F at most.
const MOST: usize = 10_000;
/// Products of one point's importance cost as much as those of so many columns.
const A_POINT: usize = 4;

/// Numbers of patches and columns: row by row the columns of a patch, each with `channels` numbers.
pub(crate) struct OnPatches {
    pub columns: usize,
    pub channels: usize,
    pub values: Vec<f32>,
}

impl OnPatches {
    pub fn of(&self, patch: usize) -> &[f32] {
        let width = self.columns * self.channels;
        &self.values[patch * width..(patch + 1) * width]
    }

    /// Adds `weight` times the row of a patch to RGB columns.
    pub fn add(&self, patch: usize, weight: [f32; 3], out: &mut [[f32; 3]]) {
        let row = self.of(patch);
        if self.channels == 1 {
            for (out, value) in out.iter_mut().zip(row) {
                *out = [0, 1, 2].map(|c| out[c] + weight[c] * value);
            }
        } else {
            for (out, value) in out.iter_mut().zip(row.as_chunks::<3>().0) {
                *out = [0, 1, 2].map(|c| out[c] + weight[c] * value[c]);
            }
        }
    }
}

/// K with what is asked of it.
pub(crate) struct Reflecting<'a> {
    pub k: &'a Operator,
    /// Whether the channels are alike.
    pub is_grey: bool,
}

/// Which way is cheaper.
pub(crate) fn adjoint_is_cheaper(points: usize, columns: usize, is_grey: bool) -> bool {
    let (points, columns) = if is_grey { (points.div_ceil(4), columns.div_ceil(3)) } else { (points, columns) };
    A_POINT * points < columns
}

impl Reflecting<'_> {
    fn passed_on(&self, i: usize) -> Rgb {
        self.k.passed_on(i)
    }

    /// B of light that was reflected 1 to `bounces` times, or any number; `sky` is S, one channel.
    pub fn travelling(&self, sky: &OnPatches, bounces: Option<usize>) -> Result<OnPatches, DaylightError> {
        let (patches, columns) = (self.k.len(), sky.columns);
        let channels = if self.is_grey { 1 } else { 3 };
        let a_source = if self.is_grey { 3 } else { 1 };
        let mut values = vec![0.0; patches * columns * channels];
        let firsts: Vec<usize> = (0..columns).step_by(a_source).collect();
        for some in firsts.chunks(AT_ONCE) {
            let sources: Vec<Source> = some.par_iter().map(|first| self.source(sky, *first)).collect();
            let light = match bounces {
                Some(count) => reflected_columns(self.k, &sources, count),
                None => solve_columns(self.k, &sources, &Settings { tolerance: LEFT, ..Settings::default() })?.light,
            };
            let width = columns * channels;
            values.par_chunks_exact_mut(width).enumerate().for_each(|(i, row)| {
                for (first, light) in some.iter().zip(&light) {
                    let own = light[i].invisible.to_array();
                    let count = (a_source * channels).min(width - first * channels);
                    row[first * channels..][..count].copy_from_slice(&own[..count]);
                }
            });
        }
        Ok(OnPatches { columns, channels, values })
    }

    /// The light of columns from `first` on as it leaves the patches first.
    fn source(&self, sky: &OnPatches, first: usize) -> Source {
        let light = |i: usize| {
            let row = sky.of(i);
            let of = |c: usize| row.get(first + c).copied().unwrap_or_default();
            let incident = if self.is_grey { Rgb::new(of(0), of(1), of(2)) } else { Rgb::splat(of(0)) };
            let visible = self.k.reflectances()[i] * incident;
            Light { invisible: self.k.alphas()[i] * visible, visible }
        };
        let dark = vec![Light::default(); self.k.len()];
        Source { emission: dark, first_bounce: Some((0..self.k.len()).map(light).collect()) }
    }

    /// Whether the importance of points has a finite sum, S being what lights the patches.
    pub fn converges(&self, sky: &OnPatches) -> bool {
        let all = |i: usize| Light::unseen(self.passed_on(i) * sky.of(i).iter().sum::<f32>());
        let lit = Source {
            emission: vec![Light::default(); self.k.len()],
            first_bounce: Some((0..self.k.len()).map(all).collect()),
        };
        matches!(verdict(&LitPatches::of_source(self.k, lit)).0, Verdict::Converges | Verdict::Ends)
    }

    /// What points receive of S by way of patches, from their weights: RGB columns for each point. `bounces` as for
    /// [`Reflecting::travelling`].
    pub fn by_adjoint(&self, weights: &[&Weights], sky: &OnPatches, bounces: Option<usize>) -> Vec<Vec<[f32; 3]>> {
        let mut found = vec![vec![[0.0; 3]; sky.columns]; weights.len()];
        let lanes: Vec<(usize, usize)> = if self.is_grey {
            (0..weights.len()).map(|point| (point, 0)).collect()
        } else {
            (0..weights.len()).flat_map(|point| (0..3).map(move |channel| (point, channel))).collect()
        };
        let a_product = if self.is_grey { 4 } else { 3 };
        for lanes in lanes.chunks(a_product) {
            let importance = self.importance(weights, lanes, bounces);
            let of_lane = |(lane, &(point, channel)): (usize, &(usize, usize))| {
                let mut sums = vec![0.0; sky.columns];
                for (i, importance) in importance.iter().enumerate().filter(|(_, own)| own[lane] != 0.0) {
                    let weight = importance[lane] * self.passed_on(i)[channel];
                    sums.iter_mut().zip(sky.of(i)).for_each(|(sum, own)| *sum += weight * own);
                }
                (point, channel, sums)
            };
            let sums: Vec<_> = lanes.par_iter().enumerate().map(of_lane).collect();
            for (point, channel, sums) in sums {
                let channels = if self.is_grey { 0..3 } else { channel..channel + 1 };
                for (out, sum) in found[point].iter_mut().zip(sums) {
                    channels.clone().for_each(|c| out[c] = sum);
                }
            }
        }
        found
    }

    /// U of some lanes, each a point and a channel.
    fn importance(&self, weights: &[&Weights], lanes: &[(usize, usize)], bounces: Option<usize>) -> Vec<Vec4> {
        let mut term = vec![Vec4::ZERO; self.k.len()];
        for (lane, &(point, channel)) in lanes.iter().enumerate() {
            weights[point].iter().for_each(|(patch, weight)| term[*patch as usize][lane] += weight[channel]);
        }
        let passed = |i: usize| {
            let own = self.passed_on(i);
            Vec4::from([0, 1, 2, 3].map(|lane| lanes.get(lane).map_or(0.0, |(_, channel)| own[*channel])))
        };
        let total = |term: &[Vec4]| term.iter().enumerate().map(|(i, own)| passed(i) * *own).sum::<Vec4>();
        let (mut sum, first) = (term.clone(), total(&term));
        for _ in 1..bounces.unwrap_or(MOST).max(1) {
            let sent: Vec<Vec4> = term.iter().enumerate().map(|(i, own)| passed(i) * *own).collect();
            term = self.k.sent(&sent);
            sum.iter_mut().zip(&term).for_each(|(sum, own)| *sum += *own);
            if bounces.is_none() && total(&term).cmple(LEFT as f32 * first).all() {
                break;
            }
        }
        sum
    }
}
