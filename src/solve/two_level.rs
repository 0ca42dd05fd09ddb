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
use crate::operator::{LinearOperator, Source};
use crate::solve::columns::{added, apply_columns, first_bounces};

/// The larger patches, as the smaller ones that they are made of.
struct Larger<'a> {
    /// What the smaller patches count by.
    weights: &'a [f64],
    parents: &'a [u32],
    /// Sums of the weights of each larger one.
    totals: Vec<f64>,
}

impl<'a> Larger<'a> {
    fn new(weights: &'a [f64], parents: &'a [u32]) -> Larger<'a> {
        let mut totals = vec![0.0; parents.iter().max().map_or(0, |&p| p as usize + 1)];
        for (weight, &p) in weights.iter().zip(parents) {
            totals[p as usize] += weight;
        }
        Larger { weights, parents, totals }
    }

    /// The mean over the parts of each larger patch, by weight, given on the parts.
    fn average(&self, x: &[Light]) -> Vec<Light> {
        let mut sums = vec![Light::default(); self.totals.len()];
        for ((l, weight), &p) in x.iter().zip(self.weights).zip(self.parents) {
            let share = (weight / self.totals[p as usize]) as f32;
            let sum = &mut sums[p as usize];
            sum.invisible += share * l.invisible;
            sum.visible += share * l.visible;
        }
        self.parents.iter().map(|&p| sums[p as usize]).collect()
    }
}

/// The first `count + 1` terms on the larger patches `parents`, given on the smaller ones, which count by `weights`
/// (areas, or whatever the patches stand for).
pub fn coarse_terms(k: &dyn LinearOperator, weights: &[f64], parents: &[u32], count: usize) -> Vec<Vec<Light>> {
    let larger = Larger::new(weights, parents);
    let mut terms = vec![larger.average(k.emission())];
    if count > 0 {
        terms.push(larger.average(&k.first_bounce()));
    }
    while terms.len() <= count {
        terms.push(larger.average(&k.apply(&terms[terms.len() - 1])));
    }
    terms
}

/// The same of several E at once, whose bounces from the first to number `count` are added up, E itself not counted.
pub(crate) fn coarse_columns(
    k: &dyn LinearOperator,
    weights: &[f64],
    parents: &[u32],
    sources: &[Source],
    count: usize,
) -> Vec<Vec<Light>> {
    let larger = Larger::new(weights, parents);
    let average = |terms: Vec<Vec<Light>>| terms.iter().map(|term| larger.average(term)).collect::<Vec<_>>();
    let mut sums = vec![vec![Light::default(); weights.len()]; sources.len()];
    let mut terms = if count > 0 { average(first_bounces(k, sources)) } else { Vec::new() };
    for n in 1..=count {
        for (sum, term) in sums.iter_mut().zip(&terms) {
            sum.iter_mut().zip(term).for_each(|(sum, l)| *sum = added(*sum, *l));
        }
        if n < count {
            terms = average(apply_columns(k, &terms));
        }
    }
    sums
}
