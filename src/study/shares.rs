//! Each patch's share in the error that patch size makes in the picture.
//!
//! What larger patches cannot hold of the light on a patch is off where the camera sees it read, and goes on by way of other
//! patches ([`crate::image::blame`], [`crate::solve::importance`]).
//!
//! Not handled: patches that are part of no larger one; nothing is known of them.

use super::look::look_for_blame;
use super::pipeline::Prepared;
use super::solved::{Solved, rough};
use super::tolerance::Wanted;
use crate::image::Fields;
use crate::solve::importance;

/// Shares in the squared error of a rough picture, in its units; None for patches that are part of no larger one.
pub(super) fn shares(p: &Prepared, s: &Solved, wanted: &Wanted) -> Vec<Option<f64>> {
    let surfaces = (&s.mode.transports[..], &*s.mode.sight);
    let fields = Fields::linear(&s.coarse);
    let blame = look_for_blame(p, surfaces, &fields, rough(wanted.size), wanted.seed);
    let onward = importance(&s.mode.operator, blame.adjoint);
    let share = |(i, alone): (usize, bool)| {
        (!alone).then(|| blame.shares[i] + f64::from(onward[i].dot(s.detail[i])))
    };
    p.patches
        .each_alone()
        .into_iter()
        .enumerate()
        .map(share)
        .collect()
}
