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

use super::gather::{Fields, View};
use super::hemisphere::Reader;
use super::pixel::Pass;
use crate::light::Rgb;
use crate::rays::sequence::hash;

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

/// One ray's part: patch, adjoint, share.
type Part = (u32, DVec3, f64);

/// Shares of the second field, d, in the squared error that the first field, e, makes in a picture.
///
/// # Panics
/// If there are not two fields.
pub fn blame(view: &View, fields: &Fields, seed: u32) -> Blame {
    assert_eq!(fields.count(), 2, "e and d");
    let pass = Pass::new(view, fields, (2, 1), seed);
    let reader = Reader::new(view, fields);
    let rows: Vec<Vec<Part>> = (0..view.height)
        .into_par_iter()
        .map(|y| {
            let pixels = y * view.width..(y + 1) * view.width;
            pixels
                .flat_map(|k| of_pixel(k, &pass, &reader, seed))
                .collect()
        })
        .collect();
    let mut blame = Blame {
        shares: vec![0.0; view.patches.len()],
        adjoint: vec![Rgb::ZERO; view.patches.len()],
    };
    // One after the other: the sum is the same for any number of threads.
    for (patch, adjoint, share) in rows.into_iter().flatten() {
        blame.shares[patch as usize] += share;
        blame.adjoint[patch as usize] += adjoint.as_vec3();
    }
    blame
}

/// The parts of one pixel: of its rays each half is weighed by the error that the other one saw.
fn of_pixel(k: usize, pass: &Pass, reader: &Reader, seed: u32) -> Vec<Part> {
    let fields = pass.fields;
    let mut met: [Vec<(u32, Vec3, DVec3)>; 2] = [Vec::new(), Vec::new()];
    for (half, met) in met.iter_mut().enumerate() {
        let Some(((_, _, material), from)) = pass.look(k, half, 0) else {
            return Vec::new();
        };
        let rho = pass.view.scene.materials[material as usize].rho.as_dvec3();
        let seed = hash(k as u32, seed ^ HALVES[half]);
        let weight = |through: f32| rho * (f64::from(through) / f64::from(RAYS));
        reader.trace(&[from], 0..RAYS, seed, &mut Vec::new(), |patch, x, t| {
            met.push((patch, x, weight(t)));
        });
    }
    let error = |half: usize| -> DVec3 {
        let each = met[half].iter();
        each.map(|&(patch, x, w)| w * fields.of_patch(patch)[0].at(x).as_dvec3())
            .sum()
    };
    let errors = [error(0), error(1)];
    let parts = met.iter().zip([errors[1], errors[0]]);
    parts
        .flat_map(|(met, error)| {
            met.iter().map(move |&(patch, x, w)| {
                let adjoint = 0.5 * w * error;
                let part = fields.of_patch(patch)[1].at(x).as_dvec3();
                (patch, adjoint, adjoint.dot(part))
            })
        })
        .collect()
}
