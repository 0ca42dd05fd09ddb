//! The bounce series in pictures: a sheet of the terms of one mode, a figure of all modes, and a chart of the norms.
//!
//! In the figure the terms E, KE, K²E, ... of each mode stand in a row, and under each the sum up to it; the last
//! column has all later terms together, and L. Sums share one exposure; terms after KE are brightened by powers of two
//! to about the brightness of KE, and say so. Modes whose series diverges have no L and no rows in the figure: its
//! caption names them.

use crate::figures::panel::{Figure, PageSettings, Panel, exposure_for, exposure_words};
use crate::partial_sums;
use halflight::light::Transport;
use halflight::operator::Bounds;
use halflight::pictures::{Exposure, Picture};
use halflight::solve::{Bounce, Diverges, Verdict};
use halflight_plot::{Cell, Chart, Heading, Page, Series, Shown, term_name};

/// A sheet with a row of the terms of a series and, under it, their partial sums.
pub fn bounce_sheet(heading: String, terms: &[Picture], sums: &[Picture], exposure: Exposure) -> Page {
    let term = |(n, picture): (usize, &Picture)| {
        let gain = if n < 2 { 1.0 } else { gain(&terms[1], picture) };
        let title = if gain == 1.0 { term_name(n) } else { format!("{} ×{gain}", term_name(n)) };
        Cell::new(Heading::new(title, ""), Shown::image(picture, brighter(exposure, gain)))
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

fn brighter(exposure: Exposure, gain: f32) -> Exposure {
    Exposure { stops: exposure.stops + gain.log2() }
}

/// The power of two that brings the mean of `own` nearest to that of `reference`; 1 where either is black.
fn gain(reference: &Picture, own: &Picture) -> f32 {
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

/// The series of one mode in pictures, or the proof that it has no sum.
pub struct Successive {
    /// The mode.
    pub transport: Transport,
    /// How the series behaves.
    pub verdict: Verdict,
    /// Proved bounds on the spectral radius.
    pub radius: Bounds,
    /// E, KE, ..., and all later terms together; nothing where the series diverges.
    pub terms: Vec<Picture>,
}

impl Successive {
    /// A series without a sum.
    pub fn diverging(transport: Transport, e: &Diverges) -> Successive {
        Successive { transport, verdict: e.verdict, radius: e.radius, terms: Vec::new() }
    }

    /// Terms with a picture of their own.
    fn count(&self) -> usize {
        if self.verdict == Verdict::Ends { 2.min(self.terms.len()) } else { self.terms.len().saturating_sub(1) }
    }

    /// A cell of the figure, with what it shows.
    fn cell(&self, name: &str, picture: &Picture, gain: f32, exposure: Exposure) -> (Cell, Option<Panel>) {
        let note = if gain == 1.0 { String::new() } else { format!("× {gain}") };
        let label = format!("{}: {name}", self.transport.label());
        let panel = Panel { gain, ..Panel::new(label, self.transport, (self.verdict, self.radius)) };
        (Cell::new(Heading::new(name, note), Shown::image(picture, brighter(exposure, gain))), Some(panel))
    }

    /// Term n, or all after those with a picture of their own.
    fn term(&self, n: usize, exposure: Exposure) -> (Cell, Option<Panel>) {
        let own = |name: &str, gain| self.cell(name, &self.terms[n], gain, exposure);
        let gain = gain(&self.terms[1], &self.terms[n]);
        match n {
            0 | 1 => own(&term_name(n), 1.0),
            _ if n < self.count() => own(&term_name(n), gain),
            _ if self.verdict == Verdict::Ends => blank(if n == 2 { "K²E = 0" } else { "" }),
            _ => own("all later terms", gain),
        }
    }

    /// The sum up to term n; L in the last column.
    fn sum(&self, sums: &[Picture], n: usize, exposure: Exposure) -> (Cell, Option<Panel>) {
        let name = match n {
            _ if self.verdict == Verdict::Ends && n == 1 => "L = E + KE".to_owned(),
            _ if self.verdict == Verdict::Ends && n >= self.count() => return blank(""),
            _ if n >= self.count() => "L".to_owned(),
            0 => term_name(0),
            1 => "E + KE".into(),
            2 => "E + KE + K²E".into(),
            n => format!("E + … + {}", term_name(n)),
        };
        self.cell(&name, &sums[n], 1.0, exposure)
    }
}

fn blank(name: &str) -> (Cell, Option<Panel>) {
    (Cell::new(Heading::new(name, ""), Shown::Blank), None)
}

/// The page of a scene, as bright as suits the sums and the settings.
pub fn successive(settings: &PageSettings, series: &[Successive]) -> Figure {
    let summed: Vec<_> = series.iter().filter(|s| s.count() > 1).map(|s| (s, partial_sums(&s.terms))).collect();
    let exposure = exposure_for(summed.iter().filter_map(|(_, sums)| sums.last()), settings.brighter);
    let mut rows = Vec::new();
    for (s, sums) in &summed {
        let heading = |what| Heading::new(s.transport.label(), what);
        rows.push((heading("terms"), (0..s.terms.len()).map(|n| s.term(n, exposure)).collect()));
        rows.push((heading("sums"), (0..s.terms.len()).map(|n| s.sum(sums, n, exposure)).collect()));
    }
    let without_rows = series.iter().filter(|s| s.count() < 2).map(|s| {
        let Bounds { lower, upper } = s.radius;
        format!(" No rows for {}: {}, spectral radius {lower:.3} to {upper:.3}.", s.transport.label(), s.verdict.name())
    });
    let caption = format!(
        "Scene {}. Upper row of each mode: single terms of the series, those marked × brightened. Lower row: their \
         sums. One {} for all sums.{}",
        settings.scene,
        exposure_words(exposure),
        without_rows.collect::<String>(),
    );
    Figure::new(settings, "Successive approximation: L = E + KE + K²E + …", caption, exposure, rows)
}
