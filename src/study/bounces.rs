//! The bounce series as pictures: one of every term `KⁿE`, and their partial sums.

use crate::gather::{Gathering, invisible};
use crate::light::Rgb;
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
    gather_terms(p, mode, &sent(p, solution, count), size, gathering, watch)
}

/// The pictures of E and of the first `count` bounces, and one of all later bounces of the solution together, from the
/// same rays. Fewer where the series ends; then nothing is left for the last.
pub fn bounce_pictures_and_rest(
    p: &Prepared,
    mode: &Assembled,
    solution: &Solution,
    count: usize,
    size: (usize, usize),
    gathering: impl Into<Gathering>,
    watch: &dyn Watch,
) -> Vec<Picture> {
    let mut values = sent(p, solution, count);
    let later = solution.terms.iter().skip(values.len());
    let mut rest = vec![Rgb::ZERO; p.patches.len()];
    for term in later {
        for (sum, l) in rest.iter_mut().zip(term) {
            *sum += l.invisible;
        }
    }
    values.push(rest);
    gather_terms(p, mode, &values, size, gathering, watch)
}

/// What hemisphere rays read for each of the first `count` bounces: the picture of bounce n shows the patch light of
/// bounce n - 1 reflected once more.
fn sent(p: &Prepared, solution: &Solution, count: usize) -> Vec<Vec<Rgb>> {
    let of = |n: usize| match n {
        0 => without_luminaires(p, &solution.terms[0]),
        n => invisible(&solution.terms[n]),
    };
    (0..count.min(solution.terms.len() - 1)).map(of).collect()
}

/// A picture of E, and one of each field reflected once; the first of these has the luminaires' direct light.
fn gather_terms(
    p: &Prepared,
    mode: &Assembled,
    values: &[Vec<Rgb>],
    size: (usize, usize),
    gathering: impl Into<Gathering>,
    watch: &dyn Watch,
) -> Vec<Picture> {
    let parts = picture(p, &mode.transports, &fields(p, values), size, gathering, watch);
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
