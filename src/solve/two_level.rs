//! The same series on larger patches, from the same form factors: what patch size does to L.
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
    let average = Average::new(weights, parents);
    let mut terms = vec![average.of(k.emission())];
    if count > 0 {
        terms.push(average.of(&k.first_bounce()));
    }
    while terms.len() <= count {
        terms.push(average.of(&k.apply(&terms[terms.len() - 1])));
    }
    terms
}

/// `Π x`: the mean over the parts of each larger patch by area, given on the smaller ones.
pub fn average(areas: &[f64], parents: &[u32], x: &[Light]) -> Vec<Light> {
    Average::new(areas, parents).of(x)
}

/// Π: the mean over the parts of each larger patch, by area.
struct Average<'a> {
    areas: &'a [f64],
    parents: &'a [u32],
    totals: Vec<f64>,
}

impl<'a> Average<'a> {
    fn new(areas: &'a [f64], parents: &'a [u32]) -> Average<'a> {
        let count = parents.iter().max().map_or(0, |&p| p as usize + 1);
        let mut totals = vec![0.0; count];
        for (area, &p) in areas.iter().zip(parents) {
            totals[p as usize] += area;
        }
        Average { areas, parents, totals }
    }

    fn of(&self, x: &[Light]) -> Vec<Light> {
        let mut sums = vec![Light::default(); self.totals.len()];
        for ((l, area), &p) in x.iter().zip(self.areas).zip(self.parents) {
            let share = (area / self.totals[p as usize]) as f32;
            let sum = &mut sums[p as usize];
            sum.invisible += share * l.invisible;
            sum.visible += share * l.visible;
        }
        self.parents.iter().map(|&p| sums[p as usize]).collect()
    }
}
