//! Successive approximation: the terms E, KE, K²E, ... of each mode in a row, and under each the sum up to it.
//!
//! The last column has all later terms together, and L. All sums share one exposure; terms after KE are brightened by
//! powers of two to about the brightness of KE, and say so. Modes whose series diverges have no L and no rows: the
//! caption names them. Not handled: growing terms of such a mode ([`bounce_sheet`](crate::study::bounce_sheet)).

use crate::light::Transport;
use crate::operator::Bounds;
use crate::pictures::Picture;
use crate::plot::{Cell, Heading, Page, PageRow, Shown};
use crate::solve::{Diverges, Verdict};
use crate::study::bounce_figures::{brightness, gain};
use crate::study::figures::panel::{Figure, PageSettings, Panel, exposure_for, exposure_words};
use crate::study::{partial_sums, term_name};

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
}

/// The page of a scene, as bright as suits the sums and the settings.
pub fn successive(settings: &PageSettings, series: &[Successive]) -> Figure {
    let summed: Vec<_> = series.iter().filter(|s| s.count() > 1).map(|s| (s, partial_sums(&s.terms))).collect();
    let mut exposure = exposure_for(summed.iter().filter_map(|(_, sums)| sums.last()));
    exposure.stops += settings.brighter;
    let mut figure = Figure {
        page: Page {
            title: "Successive approximation: L = E + KE + K²E + …".into(),
            rows: Vec::new(),
            caption: format!(
                "Scene {}. Upper row of each mode: single terms of the series, those marked × brightened. Lower \
                 row: their sums. One {} for all sums.{}",
                settings.scene,
                exposure_words(exposure),
                left_out(series),
            ),
            panel: settings.size,
            exposure,
        },
        panels: Vec::new(),
    };
    for (s, sums) in &summed {
        figure.add(s, "terms", (0..s.terms.len()).map(|n| term(s, n)).collect());
        figure.add(s, "sums", (0..s.terms.len()).map(|n| sum(s, sums, n)).collect());
    }
    figure
}

impl Figure {
    /// Adds a row of a series.
    fn add(&mut self, s: &Successive, what: &str, cells: Vec<Cell>) {
        for cell in cells.iter().filter(|cell| !matches!(cell.shown, Shown::Blank)) {
            self.panels.push(Panel {
                label: format!("{}: {}", s.transport.label(), cell.above.name),
                transport: s.transport,
                verdict: s.verdict,
                radius: s.radius,
                error: None,
                gain: cell.gain,
            });
        }
        self.page.rows.push(PageRow { heading: Heading::new(s.transport.label(), what), cells });
    }
}

/// Term n, or all after those with a picture of their own.
fn term(s: &Successive, n: usize) -> Cell {
    let cell = |name: String, gain: f32| {
        let note = if gain == 1.0 { String::new() } else { format!("× {gain}") };
        let shown = Shown::Picture(s.terms[n].clone());
        Cell { above: Heading::new(name, note), shown, gain, below: String::new() }
    };
    let own = gain(brightness(&s.terms[1]), brightness(&s.terms[n]));
    match n {
        0 | 1 => cell(term_name(n), 1.0),
        _ if n < s.count() => cell(term_name(n), own),
        _ if s.verdict == Verdict::Ends => blank(if n == 2 { "K²E = 0" } else { "" }),
        _ => cell("all later terms".into(), own),
    }
}

/// The sum up to term n; L in the last column.
fn sum(s: &Successive, sums: &[Picture], n: usize) -> Cell {
    let name = match n {
        _ if s.verdict == Verdict::Ends && n == 1 => "L = E + KE".to_owned(),
        _ if n >= s.count() => "L".to_owned(),
        0 => term_name(0),
        1 => "E + KE".into(),
        2 => "E + KE + K²E".into(),
        n => format!("E + … + {}", term_name(n)),
    };
    if s.verdict == Verdict::Ends && n >= s.count() {
        return blank("");
    }
    let above = Heading::new(name, "");
    Cell { above, shown: Shown::Picture(sums[n].clone()), gain: 1.0, below: String::new() }
}

fn blank(name: &str) -> Cell {
    Cell { above: Heading::new(name, ""), shown: Shown::Blank, gain: 1.0, below: String::new() }
}

/// The modes without rows, as a sentence.
fn left_out(series: &[Successive]) -> String {
    let words = |s: &Successive| {
        let Bounds { lower, upper } = s.radius;
        format!(" No rows for {}: {}, spectral radius {lower:.3} to {upper:.3}.", s.transport.label(), s.verdict.name())
    };
    series.iter().filter(|s| s.count() < 2).map(words).collect()
}
