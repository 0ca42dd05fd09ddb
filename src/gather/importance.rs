//! Which patches the error of a picture comes from.
//!
//! A field e of patch light that is in error makes the error G e of the picture, G the gather pass. What a small part d
//! of that field, on one patch or another, adds to the squared error is
//!
//! ```text
//! |G e|² = <G e, G e>,     share of d = <G e, G d> = <G^T G e, d>
//! ```
//!
//! Shares add up and have signs: parts that undo each other do not count twice. G is sampled by a few rays of each
//! pixel in two halves, e seen through one half and d through the other, so that noise adds nothing in the mean.
//!
//! The adjoint `G^T G e` goes on to the solution: what d does to other patches before the camera sees it is `<K^T ...,
//! d>` of it (the dual-weighted residual: R. Becker, R. Rannacher, *An optimal control approach to a posteriori error
//! estimation*, Acta Numerica 10, 2001).
//!
//! Not handled: light as emitted, which is gathered by closed form.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::gather::camera_rays::{CameraRays, CameraSampling};
use crate::gather::fields::Fields;
use crate::gather::final_gather::{FinalGather, HemisphereRays};
use crate::gather::guiding::Guiding;
use crate::gather::view::View;
use crate::light::Rgb;
use crate::rays::sobol::hash;

/// Hemisphere rays of each half.
const RAYS: u32 = 16;
/// Tells the halves' scramblings apart.
const HALVES: [u32; 2] = [0x1b87_3593, 0xcc9e_2d51];

/// The share of each patch in the squared error of a picture.
#[derive(Clone, Debug)]
pub struct ErrorShares {
    /// Patch by patch the share of its part d of the light in the squared error, summed over pixels and channels.
    pub shares: Vec<f64>,
    /// `G^T G e`: the share of light 1 on the patch, in each channel.
    pub adjoint: Vec<Rgb>,
}

/// Two fields by number: one that is in error, and a part of its error.
#[derive(Clone, Copy, Debug)]
pub struct FieldPair {
    /// The field e.
    pub error: usize,
    /// The field d.
    pub part: usize,
}

/// For each pair of fields the shares of the part in the squared error of a picture.
///
/// # Panics
/// If there is no such field.
pub fn error_shares(view: &View, fields: &Fields, pairs: &[FieldPair], seed: u32) -> Vec<ErrorShares> {
    let camera_rays = CameraRays::new(view, fields, &CameraSampling { tabled: 2, visibility: 1, seed });
    let final_gather = FinalGather::new(view, fields);
    let rows: Vec<Vec<PixelSamples>> = (0..view.height)
        .into_par_iter()
        .map(|y| {
            let pixels = y * view.width..(y + 1) * view.width;
            pixels.filter_map(|k| sampled(k, &camera_rays, &final_gather, seed)).collect()
        })
        .collect();
    let one = |&pair: &FieldPair| {
        let count = view.patches.len();
        let mut found = ErrorShares { shares: vec![0.0; count], adjoint: vec![Rgb::ZERO; count] };
        // One after the other: the sum is the same for any number of threads.
        rows.iter().flatten().for_each(|samples| found.add(samples, fields, pair));
        found
    };
    pairs.par_iter().map(one).collect()
}

/// Light of a patch that one ray sees: where, and its weight in the pixel.
struct PatchSample {
    patch: u32,
    position: Vec3,
    weight: DVec3,
}

/// What one pixel's rays of each half see.
type PixelSamples = [Vec<PatchSample>; 2];

fn sampled(k: usize, camera_rays: &CameraRays, final_gather: &FinalGather, seed: u32) -> Option<PixelSamples> {
    let mut samples = PixelSamples::default();
    for (half, samples) in samples.iter_mut().enumerate() {
        let (_, from) = camera_rays.look(k, half, 0).next()?;
        let rho = camera_rays.view.scene.rho_at(from.face, from.position).as_dvec3();
        let seed = hash(k as u32, seed ^ HALVES[half]);
        let rays = HemisphereRays { from: &[from], indices: 0..RAYS, seed, guiding: Guiding::NONE };
        final_gather.trace(&rays, |patch, position, through| {
            samples.push(PatchSample { patch, position, weight: rho * (f64::from(through) / f64::from(RAYS)) });
        });
    }
    Some(samples)
}

impl ErrorShares {
    /// Adds a pixel: the rays of each half are weighed by the error that the other one saw.
    fn add(&mut self, samples: &PixelSamples, fields: &Fields, pair: FieldPair) {
        let light = |s: &PatchSample, field: usize| fields.of_patch(s.patch)[field].at(s.position).as_dvec3();
        let error = |half: usize| -> DVec3 { samples[half].iter().map(|s| s.weight * light(s, pair.error)).sum() };
        for (half, error) in [error(1), error(0)].into_iter().enumerate() {
            for s in &samples[half] {
                let adjoint = 0.5 * s.weight * error;
                self.adjoint[s.patch as usize] += adjoint.as_vec3();
                self.shares[s.patch as usize] += adjoint.dot(light(s, pair.part));
            }
        }
    }
}
