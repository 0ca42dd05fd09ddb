//! Each patch's share in the errors that patch size, and noise of F, make in the picture.
//!
//! What is off on a patch is off where the camera sees it read, and goes on by way of other patches
//! ([`crate::gather::importance`], [`crate::solve::importance`]). Patch size is off by what larger patches cannot hold
//! of the light, noise by what a row of F adds:
//!
//! ```text
//! L' - L = (I - K)^-1 r,      r = (I - K) (L' - L)      r_i the noise of row i alone
//! ```
//!
//! Not handled: the size of patches that are part of no larger one; nothing is known of it.

use crate::gather::{FieldPair, Fields, error_shares};
use crate::light::{Light, Rgb};
use crate::operator::LinearOperator;
use crate::render::assembly::Prepared;
use crate::render::solved::Solved;
use crate::render::wanted::Wanted;
use crate::solve::importance;

/// Shares in the squared errors of a rough picture, in its units.
pub(crate) struct Shares {
    /// Of patch size; None for patches that are part of no larger one.
    pub size: Vec<Option<f64>>,
    /// Of the noise of each row of F.
    pub noise: Vec<f64>,
}

/// Tells whose patches and rows the errors come from.
pub(crate) fn shares(p: &Prepared, s: &Solved, wanted: &Wanted) -> Shares {
    let fields = Fields::linear(&s.off.parts);
    let pairs = [FieldPair { error: 0, part: 1 }, FieldPair { error: 2, part: 2 }];
    let mut both = error_shares(&s.rough_view(p, wanted), &fields, &pairs, wanted.seed).into_iter();
    let (Some(size), Some(noise)) = (both.next(), both.next()) else {
        unreachable!("shares for each pair");
    };
    let k = &s.mode.operator;
    let onward = importance(k, size.adjoint);
    let share =
        |(i, alone): (usize, bool)| (!alone).then(|| size.shares[i] + f64::from(onward[i].dot(s.off.detail[i])));
    let alone = p.patches.each_alone().into_iter().enumerate();
    let onward = importance(k, noise.adjoint.clone());
    let rows = own(s);
    let row = |i: usize| f64::from((noise.adjoint[i] + onward[i]).dot(rows[i]));
    Shares { size: alone.map(share).collect(), noise: (0..p.patches.len()).map(row).collect() }
}

/// `(I - K)` of the noise: what each row adds.
fn own(s: &Solved) -> Vec<Rgb> {
    let noise: Vec<Light> = s.off.noise.iter().copied().map(Light::unseen).collect();
    let passed = s.mode.operator.apply(&noise);
    let each = s.off.noise.iter().zip(&passed);
    each.map(|(noise, passed)| *noise - passed.invisible).collect()
}
