//! Which patches the error of a picture comes from.
//!
//! A field e of patch light that is in error makes the error G e of the picture, G the gather pass. What a small part d of
//! that field, on one patch or another, adds to the squared error is
//!
//! ```text
//! |G e|² = <G e, G e>,     share of d = <G e, G d> = <G^T G e, d>
//! ```
//!
//! Shares add up and have signs: parts that undo each other are not blamed twice. G is sampled by a few rays of each pixel
//! in two halves, e seen through one half and d through the other, so that noise adds nothing in the mean.
//!
//! The adjoint `G^T G e` goes on to the solution: what d does to other patches before the camera sees it is `<K^T ..., d>` of
//! it. Source: R. Becker, R. Rannacher, *An optimal control approach to a posteriori error estimation*, Acta Numerica 10, 2001.
//!
//! Not handled: light as emitted, which is gathered by closed form.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::gather::camera_rays::Pass;
use crate::gather::fields::Fields;
use crate::gather::final_gather::Reader;
use crate::gather::reading::Reading;
use crate::gather::view::View;
use crate::light::Rgb;
use crate::rays::sobol::hash;

/// Hemisphere rays of each half.
const RAYS: u32 = 16;
/// Tells the halves' scramblings apart.
const HALVES: [u32; 2] = [0x1b87_3593, 0xcc9e_2d51];

/// What the patches have to do with the error of a picture.
#[derive(Clone, Debug)]
pub struct Blame {
    /// Patch by patch the share of its part d of the light in the squared error, summed over pixels and channels.
    pub shares: Vec<f64>,
    /// `G^T G e`: the same for light 1 on the patch in each channel.
    pub adjoint: Vec<Rgb>,
}

/// For each pair (e, d) of fields by number: shares of d in the squared error that e makes in a picture.
///
/// # Panics
/// If there is no such field.
pub fn blame(view: &View, fields: &Fields, pairs: &[(usize, usize)], seed: u32) -> Vec<Blame> {
    let pass = Pass::new(view, fields, (2, 1), seed);
    let reader = Reader::new(view, fields, Reading::PLAIN);
    let rows: Vec<Vec<Met>> = (0..view.height)
        .into_par_iter()
        .map(|y| {
            let pixels = y * view.width..(y + 1) * view.width;
            pixels.filter_map(|k| met(k, &pass, &reader, seed)).collect()
        })
        .collect();
    let one = |&pair: &(usize, usize)| {
        let mut blame = Blame { shares: vec![0.0; view.patches.len()], adjoint: vec![Rgb::ZERO; view.patches.len()] };
        // One after the other: the sum is the same for any number of threads.
        rows.iter().flatten().for_each(|met| blame.add(met, fields, pair));
        blame
    };
    pairs.par_iter().map(one).collect()
}

/// What one pixel's rays of each half met: patch, position, and weight in the pixel.
type Met = [Vec<(u32, Vec3, DVec3)>; 2];

fn met(k: usize, pass: &Pass, reader: &Reader, seed: u32) -> Option<Met> {
    let mut met = Met::default();
    for (half, met) in met.iter_mut().enumerate() {
        let ((_, _, material), from) = pass.look(k, half, 0)?;
        let rho = pass.view.scene.materials[material as usize].rho.as_dvec3();
        let seed = hash(k as u32, seed ^ HALVES[half]);
        let weight = |through: f32| rho * (f64::from(through) / f64::from(RAYS));
        reader.trace(&from, 0..RAYS, seed, |patch, x, t| {
            met.push((patch, x, weight(t)));
        });
    }
    Some(met)
}

impl Blame {
    /// Adds a pixel: the rays of each half are weighed by the error that the other one saw.
    fn add(&mut self, met: &Met, fields: &Fields, (e, d): (usize, usize)) {
        let light = |patch: u32, field: usize, x: Vec3| {
            let light = fields.of_patch(patch)[field].at(x);
            light.as_dvec3()
        };
        let error = |half: usize| -> DVec3 {
            let each = met[half].iter();
            each.map(|&(patch, x, w)| w * light(patch, e, x)).sum()
        };
        for (half, error) in [error(1), error(0)].into_iter().enumerate() {
            for &(patch, x, w) in &met[half] {
                let adjoint = 0.5 * w * error;
                self.adjoint[patch as usize] += adjoint.as_vec3();
                self.shares[patch as usize] += adjoint.dot(light(patch, d, x));
            }
        }
    }
}
