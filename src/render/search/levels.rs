//! The light that a picture is made of, and by how much it may be off: the mean of two scramblings, half their
//! difference, and the difference to patches four times as large.
//!
//! Not handled: the terms of the series one by one.

use crate::light::Rgb;
use crate::patches::{Neighbours, Patches};
use crate::reading::{Fields, Linear, linear};

/// Errors of patch size go as the size to this power: second where light is smooth within patches, first across what
/// stands close to a surface. Measured on the furnished room against path tracing: 8.1, 2.7, 1.0 % too dark with 250,
/// 1000, 4000 patches, powers of 1.6 and 1.4. What it gets wrong the residual measured at points shows
/// ([`crate::render::search::residual_check`]), and the rounds correct.
pub(crate) const ORDER: f64 = 1.5;

/// The error on the finer patches as a share of the difference between two levels, whose patches differ by a factor of
/// two in size: `1 / (2^ORDER - 1)`.
pub(crate) fn of_finer() -> f64 {
    1.0 / (ORDER.exp2() - 1.0)
}

/// How many times as many patches make an error so many times smaller: their number goes as the size to the power -2.
pub(crate) fn patches_for(smaller: f64) -> f64 {
    smaller.powf(2.0 / ORDER)
}

/// The mean of two scramblings a and b of light on patches, which makes the picture; half their difference, and that of
/// a to c on larger patches ride along on the same rays.
pub(crate) fn fields(patches: &Patches, [a, b, c]: [Vec<Rgb>; 3]) -> Fields {
    let neighbours = patches.neighbours();
    let [a, b] = [&a, &b].map(|values| linear(&neighbours, values));
    let c = larger(patches, &neighbours, &c);
    let mix = |x: &[Linear], y: &[Linear], u: f32, v: f32| -> Vec<Linear> {
        x.iter().zip(y).map(|(x, y)| x.mix(u, y, v)).collect()
    };
    Fields::linear(&[mix(&a, &b, 0.5, 0.5), mix(&a, &b, 0.5, -0.5), mix(&a, &c, 1.0, -1.0)]).with_picture_fields(1)
}

/// Light of larger patches, given on the smaller ones, as linear within the larger.
fn larger(patches: &Patches, neighbours: &Neighbours, values: &[Rgb]) -> Vec<Linear> {
    let parents = patches.parents();
    let neighbours = neighbours.larger(parents, &patches.weights());
    let mut own = vec![Rgb::ZERO; neighbours.len()];
    for (value, &parent) in values.iter().zip(parents) {
        own[parent as usize] = *value;
    }
    let light = linear(&neighbours, &own);
    parents.iter().map(|&parent| light[parent as usize]).collect()
}
