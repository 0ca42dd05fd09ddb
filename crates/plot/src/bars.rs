//! Stacked bars: how wholes divide into parts, one bar next to the other.
//!
//! Every bar shows shares of its own whole and reaches 100 %; what the whole amounts to stands above it. So wholes that
//! differ by orders of magnitude stay readable. Parts that are too small to see are not labelled. Not handled: negative
//! parts.

use glam::dvec2;

use crate::axes::{Frame, Range, Scale, TICK_EM};
use crate::chart::PALETTE;
use crate::drawing::{Align, Colour, Drawing, INK, PAPER};
use halflight::pictures::Size;

/// Bars that divide wholes into parts.
#[derive(Clone, Debug)]
pub struct Bars {
    /// What is shown, in one line above.
    pub title: String,
    /// Scene and settings, below; wrapped.
    pub caption: String,
    /// What the bars differ by, quantity and unit.
    pub x: String,
    /// What is divided, as in "share of the time, %".
    pub y: String,
    /// Names of the parts, from the bottom.
    pub parts: Vec<String>,
    /// The bars from the left.
    pub bars: Vec<Bar>,
    /// Width and height in pixels.
    pub size: Size,
}

/// One bar.
#[derive(Clone, Debug)]
pub struct Bar {
    /// Below it.
    pub name: String,
    /// Above it: what the whole amounts to.
    pub whole: String,
    /// One number a part, in any unit.
    pub parts: Vec<f64>,
}

/// Share of a bar's place that it fills.
const FILLED: f64 = 0.62;
/// Parts below this share are not labelled.
const LABELLED: f64 = 0.06;

impl Bars {
    /// The chart, drawn.
    pub fn drawing(&self) -> Drawing {
        let ranges = [[0.0, 1.0], [0.0, 100.0]].map(|ends| Range::of(Scale::Linear, ends));
        let mut frame = Frame::new(self.size, [&self.title, &self.caption], ranges, 72.0);
        frame.y_ticks();
        for (number, bar) in self.bars.iter().enumerate() {
            let side = |at: f64| frame.across((number as f64 + 0.5 + 0.5 * at) / self.bars.len() as f64).round();
            draw_bar(bar, [side(-FILLED), side(FILLED)], &mut frame);
        }
        frame.axes([&self.x, &self.y]);
        // The topmost first, as in the bars.
        let (left, mut y) = (frame.right + 24.0, frame.top + 10.0);
        for (part, name) in self.parts.iter().enumerate().rev() {
            frame.drawing.rectangle(dvec2(left, y - 7.0), dvec2(left + 22.0, y + 7.0), colour(part));
            y = frame.entry(name, y, 56.0);
        }
        frame.drawing
    }
}

fn colour(part: usize) -> Colour {
    PALETTE[part % PALETTE.len()]
}

/// One bar, its parts labelled by their shares where there is room.
///
/// Each part is drawn up to the top and covered by those above it, so that no seam shows.
fn draw_bar(bar: &Bar, [left, right]: [f64; 2], frame: &mut Frame) {
    let middle = 0.5 * (left + right);
    frame.drawing.text(&bar.name, dvec2(middle, frame.bottom + 22.0), TICK_EM, Align::Center, INK);
    frame.drawing.text(&bar.whole, dvec2(middle, frame.top - 8.0), TICK_EM, Align::Center, INK);
    let whole: f64 = bar.parts.iter().sum();
    let (mut below, mut labels) = (0.0, Vec::new());
    for (part, share) in bar.parts.iter().map(|amount| amount / whole).enumerate() {
        if !share.is_finite() || share <= 0.0 {
            continue;
        }
        frame.drawing.rectangle(dvec2(left, frame.up(below)), dvec2(right, frame.up(1.0)), colour(part));
        if share >= LABELLED {
            let at = dvec2(middle, frame.up(below + 0.5 * share) + 0.35 * TICK_EM);
            labels.push((format!("{:.0} %", 100.0 * share), at, on(colour(part))));
        }
        below += share;
    }
    for (label, at, colour) in labels {
        frame.drawing.text(&label, at, TICK_EM, Align::Center, colour);
    }
}

/// Black or white, whichever is easier to read on a colour.
fn on([red, green, blue]: Colour) -> Colour {
    let luma = 0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue);
    if luma > 140.0 { INK } else { PAPER }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bars() -> Bars {
        let bar = |name: &str, parts: &[f64]| Bar { name: name.into(), whole: "2 s".into(), parts: parts.to_vec() };
        Bars {
            title: "Where the time went".into(),
            caption: "a room".into(),
            x: "tolerance".into(),
            y: "share of the time, %".into(),
            parts: vec!["form factors".into(), "gather".into()],
            bars: vec![bar("1 %", &[1.5, 0.5]), bar("none", &[0.0, 0.0])],
            size: (600, 400).into(),
        }
    }

    #[test]
    fn bars_divide_their_height_as_the_numbers_do() {
        let page = bars().drawing().bitmap().unwrap();
        // Down the left edge of the first bar, where no label stands.
        let column = 84 + (302.0 / 4.0 * (1.0 - FILLED)) as usize + 4;
        let of = |part: usize| (0..page.height).filter(|&y| page.get(column, y) == Some(colour(part))).count() as f64;
        // A pixel at either end of a part may be mixed.
        assert!((of(0) - 3.0 * of(1)).abs() <= 8.0, "{} {}", of(0), of(1));
        assert!(of(1) > 20.0);
    }

    #[test]
    fn names_wholes_and_shares_are_written() {
        let svg = bars().drawing().svg();
        for text in ["1 %", "2 s", "75 %", "25 %", "gather", "form factors", "a room"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("NaN"));
    }
}
