//! The light that a picture is made of, and by how much it may be off, from two scramblings and from larger patches.
//!
//! K reads light as one value a patch, an error of first order in patch size where surfaces meet. Light on larger
//! patches tells how it falls, so the picture is made of light extrapolated to none of it (Richardson 1911):
//!
//! ```text
//! L = L_h + (Π L_h - L_2h)      Π averages over the larger patches, so detail within them stays as it is
//! ```
//!
//! Measured against path tracing, it leaves a fifth to a half of the error in the mean. The terms of the series are not
//! extrapolated, and the stated error is that of light that is not.
//!
//! Not handled: the terms of the series one by one.

use crate::gather::{Fields, Linear, invisible, linear};
use crate::light::{Light, Rgb};
use crate::patches::Neighbours;
use crate::render::assembly::Prepared;
use crate::solve::average;

/// Errors of patch size go as the size to this power, in pictures and in terms: second where light is smooth within
/// patches, first across what stands close to a surface. Measured on the furnished room against path tracing: 8.1, 2.7,
/// 1.0 % too dark with 250, 1000, 4000 patches, powers of 1.6 and 1.4. What it gets wrong the residual measured at
/// points tells ([`crate::render::residual_check`]), and the rounds correct.
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

/// The light that the picture is made of, with its noise and what larger patches are off by riding along; of two
/// scramblings a and b, and c on larger patches.
pub(crate) fn fields(p: &Prepared, [a, b, c]: [Vec<Rgb>; 3]) -> Fields {
    // Both levels' means over larger patches differ by what K makes of patch size: the light moves on by that much.
    let means = averaged(p, &a);
    let onward: Vec<Rgb> = means.iter().zip(&c).map(|(a, c)| *a - *c).collect();
    let neighbours = p.patches.neighbours();
    let [a, b] = [&a, &b].map(|values| linear(&neighbours, values));
    let [c, onward] = [&c, &onward].map(|values| larger(p, &neighbours, values));
    let mix = |x: &[Linear], y: &[Linear], u: f32, v: f32| -> Vec<Linear> {
        x.iter().zip(y).map(|(x, y)| x.mix(u, y, v)).collect()
    };
    let mean = mix(&a, &b, 0.5, 0.5);
    let light = if p.patches.are_divided() { mean } else { mix(&mean, &onward, 1.0, 1.0) };
    Fields::linear(&[light, mix(&a, &b, 0.5, -0.5), mix(&a, &c, 1.0, -1.0)]).led_by(1)
}

/// The mean over the parts of each larger patch, given on the smaller ones.
fn averaged(p: &Prepared, values: &[Rgb]) -> Vec<Rgb> {
    let light: Vec<Light> = values.iter().copied().map(Light::unseen).collect();
    invisible(&average(&p.patches.weights(), p.patches.parents(), &light))
}

/// Light of larger patches, given on the smaller ones, as linear within the larger.
fn larger(p: &Prepared, neighbours: &Neighbours, values: &[Rgb]) -> Vec<Linear> {
    let parents = p.patches.parents();
    let neighbours = neighbours.larger(parents, &p.patches.weights());
    let mut own = vec![Rgb::ZERO; neighbours.len()];
    for (value, &parent) in values.iter().zip(parents) {
        own[parent as usize] = *value;
    }
    let light = linear(&neighbours, &own);
    parents.iter().map(|&parent| light[parent as usize]).collect()
}
