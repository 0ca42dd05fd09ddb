//! The bounce series as figures: a sheet of the pictures of its terms, and a chart of their norms.

use crate::pictures::{Exposure, Picture};
use crate::plot::chart::term;
use crate::plot::{Chart, Series, Sheet, Tile};
use crate::solve::Bounce;

/// `E`, `KE`, `K²E` and so on.
pub fn term_name(n: usize) -> String {
    term(n)
}

/// A sheet with a row of the terms and, under it, their partial sums; terms are brightened or dimmed by powers of two
/// to about the brightness of KE.
pub fn bounce_sheet<'a>(heading: String, terms: &'a [Picture], sums: &'a [Picture], exposure: Exposure) -> Sheet<'a> {
    let reference = terms.get(1).map_or(0.0, brightness);
    let tile = |picture: &'a Picture, title: String, gain: f32| Tile {
        picture: Some(picture),
        title,
        note: String::new(),
        gain,
    };
    let mut tiles: Vec<Tile> = terms
        .iter()
        .enumerate()
        .map(|(n, t)| {
            let gain = if n < 2 { 1.0 } else { gain(reference, brightness(t)) };
            tile(t, term_name(n), gain)
        })
        .collect();
    tiles.extend(sums.iter().enumerate().map(|(n, s)| {
        let title = match n {
            0 => "E".to_string(),
            1 => "E + KE".to_string(),
            n => format!("… + {}", term_name(n)),
        };
        tile(s, title, 1.0)
    }));
    Sheet { heading, tiles, columns: terms.len(), exposure }
}

/// The mean over the pixels of the sum of the channels.
pub(crate) fn brightness(picture: &Picture) -> f64 {
    let sum: f64 = picture.pixels.iter().map(|p| f64::from(p.element_sum())).sum();
    sum / picture.pixels.len() as f64
}

/// The power of two that brings `own` nearest to `reference`; 1 for black.
pub(crate) fn gain(reference: f64, own: f64) -> f32 {
    if reference > 0.0 && own > 0.0 && own.is_finite() {
        (reference / own).log2().round().clamp(-30.0, 30.0).exp2() as f32
    } else {
        1.0
    }
}

/// The norms of every mode's terms on a logarithmic axis, with the proven bounds on what follows each.
pub fn bounces_chart(title: String, caption: String, modes: &[(String, &[Bounce])]) -> Chart {
    let mut series = Vec::new();
    for (colour, (name, bounces)) in modes.iter().enumerate() {
        let norms: Vec<f64> = bounces.iter().map(|b| b.norm).collect();
        series.push(Series::bounces(name.clone(), colour, &norms));
        let bounds: Vec<(f64, f64)> =
            bounces.iter().filter_map(|b| Some((b.n as f64, b.tail_bound.filter(|&t| t > 0.0)?))).collect();
        if bounds.len() > 1 {
            let name = format!("{name}: bound on all later terms");
            series.push(Series::bound(name, colour, bounds));
        }
    }
    Chart::of_bounces(title, caption, series)
}
