//! The series on larger patches, from the form factors of the smaller ones: what patch size does to L.
//!
//! ```text
//! terms of  Π E,  Π KE,  Π K (Π KE),  ...      Π averages over the patches that one larger patch consists of
//! ```
//!
//! Π K Π is the operator of the larger patches, made of all rays of the smaller ones: nothing is cast again, and the
//! noise of both solutions is the same noise. Light seen through one more bounce is of second order in patch size, so
//! the smaller patches' error is about a third of the difference; where it is of first order, it is the difference.
//!
//! Not handled: patches that the larger level leaves alone; they contribute nothing to the difference.

use crate::light::Light;
use crate::operator::LinearOperator;

/// The first `count + 1` terms on the larger patches `parents`, given on the smaller ones, which count by `weights`
/// (areas, or whatever the patches stand for).
pub fn coarse_terms(k: &dyn LinearOperator, weights: &[f64], parents: &[u32], count: usize) -> Vec<Vec<Light>> {
    let mut totals = vec![0.0; parents.iter().max().map_or(0, |&p| p as usize + 1)];
    for (weight, &p) in weights.iter().zip(parents) {
        totals[p as usize] += weight;
    }
    // The mean over the parts of each larger patch, by weight, given on the parts.
    let average = |x: &[Light]| -> Vec<Light> {
        let mut sums = vec![Light::default(); totals.len()];
        for ((l, weight), &p) in x.iter().zip(weights).zip(parents) {
            let share = (weight / totals[p as usize]) as f32;
            let sum = &mut sums[p as usize];
            sum.invisible += share * l.invisible;
            sum.visible += share * l.visible;
        }
        parents.iter().map(|&p| sums[p as usize]).collect()
    };
    let mut terms = vec![average(k.emission())];
    if count > 0 {
        terms.push(average(&k.first_bounce()));
    }
    while terms.len() <= count {
        terms.push(average(&k.apply(&terms[terms.len() - 1])));
    }
    terms
}
