//! The bounce series as pictures: one of every term `KⁿE`, and their partial sums.

use halflight::direct::Lights;
use halflight::gather::GatherPass;
use halflight::light::{Light, Rgb};
use halflight::pictures::Picture;
use halflight::reading::invisible;
use halflight::render::{Watch, pictures, without_luminaires};
use halflight::solve::Solution;

/// What hemisphere rays read for each of the first `count` bounces: the picture of bounce n shows the patch light of
/// bounce n - 1 reflected once more. Fewer where the series ends.
pub fn bounce_fields(lights: &Lights, solution: &Solution, count: usize) -> Vec<Vec<Rgb>> {
    let terms = &solution.terms;
    (0..count.min(terms.len() - 1)).map(|n| bounce_field(lights, n, &terms[n])).collect()
}

/// What hemisphere rays read of the light of bounce n.
fn bounce_field(lights: &Lights, n: usize, term: &[Light]) -> Vec<Rgb> {
    if n == 0 { without_luminaires(lights, term) } else { invisible(term) }
}

/// What hemisphere rays read for each of the first `count` bounces of a series, and for all later ones together. Fewer
/// where the series ends; then nothing remains for the last.
pub fn bounce_fields_and_rest(lights: &Lights, terms: &[Vec<Light>], count: usize) -> Vec<Vec<Rgb>> {
    let count = count.min(terms.len() - 1);
    let mut values: Vec<Vec<Rgb>> = (0..count).map(|n| bounce_field(lights, n, &terms[n])).collect();
    let mut rest = vec![Rgb::ZERO; lights.patches.len()];
    for (n, term) in terms.iter().enumerate().skip(count) {
        for (sum, light) in rest.iter_mut().zip(bounce_field(lights, n, term)) {
            *sum += light;
        }
    }
    values.push(rest);
    values
}

/// A picture of E, and one of each of the [`bounce_fields`], all from the same rays; the first of these has the
/// luminaires' direct light.
pub fn bounce_pictures(lights: &Lights, values: &[Vec<Rgb>], pass: &GatherPass, watch: &dyn Watch) -> Vec<Picture> {
    let parts = pictures(lights, values, pass, watch);
    let mut all = vec![parts.emission];
    all.extend(parts.indirect);
    if let Some(first) = all.get_mut(1) {
        for (sum, direct) in first.pixels.iter_mut().zip(&parts.direct.pixels) {
            *sum += *direct;
        }
    }
    all
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
