//! The bounce series as pictures: one of every term `KⁿE`, and their partial sums.

use crate::gather::{Gathering, invisible};
use crate::pictures::Picture;
use crate::render::look::fields;
use crate::render::{Assembled, Prepared, Watch, picture, without_luminaires};
use crate::solve::Solution;

/// A picture of each of the first `count` bounces and of E, all from the same rays.
pub fn bounce_pictures(
    p: &Prepared,
    mode: &Assembled,
    solution: &Solution,
    count: usize,
    size: (usize, usize),
    gathering: impl Into<Gathering>,
    watch: &dyn Watch,
) -> Vec<Picture> {
    let count = count.min(solution.terms.len() - 1);
    // The picture of bounce n shows the patch light of bounce n - 1 reflected once more.
    let values: Vec<_> = (0..count)
        .map(|n| match n {
            0 => without_luminaires(p, &solution.terms[0]),
            n => invisible(&solution.terms[n]),
        })
        .collect();
    let fields = fields(p, &values);
    let parts = picture(p, &mode.transports, &fields, size, gathering, watch);
    let mut pictures = vec![parts.emission];
    pictures.extend(parts.indirect);
    if let Some(first) = pictures.get_mut(1) {
        for (sum, direct) in first.pixels.iter_mut().zip(&parts.direct.pixels) {
            *sum += *direct;
        }
    }
    pictures
}

/// Partial sums of pictures.
pub fn partial_sums(terms: &[Picture]) -> Vec<Picture> {
    let mut sums: Vec<Picture> = Vec::with_capacity(terms.len());
    for t in terms {
        let next = sums.last().and_then(|s| s.plus(t)).unwrap_or_else(|| t.clone());
        sums.push(next);
    }
    sums
}
