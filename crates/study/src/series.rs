//! The bounce series of one mode on a sheet, and the norms of several modes' terms as a chart.
//!
//! Not handled: the terms and their pictures ([`bounce_pictures`](crate::bounce_pictures)).

use halflight::pictures::{Exposure, Picture};
use halflight::solve::Bounce;
use halflight_plot::{Cell, Chart, Heading, Page, Series, Shown, term_name};

/// A sheet with a row of the terms of a series and, under it, their partial sums.
pub fn bounce_sheet(heading: String, terms: &[Picture], sums: &[Picture], exposure: Exposure) -> Page {
    let term = |(n, picture): (usize, &Picture)| {
        let gain = if n < 2 { 1.0 } else { brightening(&terms[1], picture) };
        Cell::new(
            Heading::new(term_name(n), brightened(gain)),
            Shown::image(picture, Exposure { stops: exposure.stops + gain.log2() }),
        )
    };
    let sum = |(n, picture): (usize, &Picture)| {
        let title = match n {
            0 => "E".to_string(),
            1 => "E + KE".to_string(),
            n => format!("… + {}", term_name(n)),
        };
        Cell::new(Heading::new(title, ""), Shown::image(picture, exposure))
    };
    let cells = terms.iter().enumerate().map(term).chain(sums.iter().enumerate().map(sum));
    Page::sheet(heading, cells.collect(), terms.len())
}

/// The power of two that brings the mean of `own` nearest to that of `reference`; 1 where either is black.
pub fn brightening(reference: &Picture, own: &Picture) -> f32 {
    let mean = |picture: &Picture| {
        let sum: f64 = picture.pixels.iter().map(|p| f64::from(p.element_sum())).sum();
        sum / picture.pixels.len() as f64
    };
    let (reference, own) = (mean(reference), mean(own));
    if reference > 0.0 && own > 0.0 && own.is_finite() {
        (reference / own).log2().round().clamp(-30.0, 30.0).exp2() as f32
    } else {
        1.0
    }
}

/// A factor that a picture is shown brighter by, in words; nothing for 1.
pub fn brightened(gain: f32) -> String {
    match gain {
        1.0 => String::new(),
        gain if gain < 1.0 => format!("shown {} times darker", gain.recip()),
        gain => format!("shown {gain} times brighter"),
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
