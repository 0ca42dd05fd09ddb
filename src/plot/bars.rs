//! Stacked bars: how a whole divides into parts, one bar beside the other, as SVG and PNG from one drawing.
//!
//! Every bar shows shares of its own whole and reaches 100 %; what the whole amounts to stands above it. So wholes that
//! differ by orders of magnitude stay readable. Parts that are too small to see are not labelled. Not handled: negative parts.

use std::path::Path;

use plotters::backend::DrawingBackend;
use plotters::style::RGBColor;

use crate::pictures::{Bitmap, write_bitmap, write_whole};
use crate::plot::axis::{Range, Scale};
use crate::plot::canvas::{Align, Canvas};
use crate::plot::chart::{ChartError, PALETTE};
use crate::plot::drawing::{DrawError, draw_bitmap, draw_svg};
use crate::plot::font;
use crate::plot::lines::{CAPTION_EM, FAINT_INK, GRID, INK, LABEL_EM, LEGEND_WIDTH, TICK_EM, TITLE_EM};

/// Bars that divide wholes into parts.
#[derive(Clone, Debug)]
pub struct Bars {
    /// What is shown, in one line above.
    pub title: String,
    /// Scene and settings, below; wrapped.
    pub caption: String,
    /// What tells the bars apart, quantity and unit.
    pub x: String,
    /// What is divided, as in "share of the time, %".
    pub y: String,
    /// Names of the parts, from the bottom.
    pub parts: Vec<String>,
    /// The bars from the left.
    pub bars: Vec<Bar>,
    /// Width and height in pixels.
    pub size: (u32, u32),
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

/// The plot's edges.
struct Area {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Bars {
    /// The chart as an SVG document.
    ///
    /// # Errors
    /// A size out of range.
    pub fn svg(&self) -> Result<String, DrawError> {
        draw_svg(self.size, |canvas| draw(self, canvas))
    }

    /// The chart as pixels.
    ///
    /// # Errors
    /// A size out of range.
    pub fn bitmap(&self) -> Result<Bitmap, DrawError> {
        draw_bitmap(self.size, |canvas| draw(self, canvas))
    }

    /// Writes the chart, as SVG where the path ends in `.svg` and as PNG where it ends in `.png`.
    ///
    /// # Errors
    /// Another extension, a size out of range, a destination that cannot be written. Nothing is left behind.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), ChartError> {
        let path = path.as_ref();
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("svg") {
            write_whole(path, self.svg()?.as_bytes())?;
        } else {
            write_bitmap(path, &self.bitmap()?)?;
        }
        Ok(())
    }
}

fn colour(part: usize) -> RGBColor {
    PALETTE[part % PALETTE.len()]
}

fn draw<B: DrawingBackend>(bars: &Bars, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
    let (width, height) = (f64::from(bars.size.0), f64::from(bars.size.1));
    let caption = font::wrap(&bars.caption, CAPTION_EM, width - 84.0 - 24.0);
    let area = Area {
        left: 84.0,
        right: width - LEGEND_WIDTH - 24.0,
        top: 72.0,
        bottom: height - 76.0 - 1.4 * CAPTION_EM * caption.len() as f64,
    };
    canvas.rectangle((0.0, 0.0), (width, height), RGBColor(255, 255, 255))?;
    canvas.text(&bars.title, (area.left, 32.0), TITLE_EM, Align::Left, INK)?;
    draw_shares(bars, &area, canvas)?;
    let place = (area.right - area.left) / bars.bars.len().max(1) as f64;
    for (bar, number) in bars.bars.iter().zip(0..) {
        let middle = area.left + (f64::from(number) + 0.5) * place;
        draw_bar(bar, &area, (middle, 0.5 * FILLED * place), canvas)?;
    }
    let corners = [(area.left, area.top), (area.left, area.bottom), (area.right, area.bottom)];
    canvas.path(&corners, INK, 1.25)?;
    let at = (0.5 * (area.left + area.right), area.bottom + 46.0);
    canvas.text(&bars.x, at, LABEL_EM, Align::Center, INK)?;
    draw_legend(bars, &area, canvas)?;
    for (line, number) in caption.iter().zip(0..) {
        let y = area.bottom + 72.0 + 1.4 * CAPTION_EM * f64::from(number);
        canvas.text(line, (area.left, y), CAPTION_EM, Align::Left, FAINT_INK)?;
    }
    Ok(())
}

/// The vertical axis, 0 to 100 %.
fn draw_shares<B: DrawingBackend>(bars: &Bars, area: &Area, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
    for tick in Range::of(Scale::Linear, [0.0, 100.0]).ticks(5) {
        let y = area.bottom - tick.at * (area.bottom - area.top);
        canvas.line((area.left, y), (area.right, y), GRID, 1.0)?;
        canvas.line((area.left - 6.0, y), (area.left, y), INK, 1.0)?;
        let at = (area.left - 11.0, y + 0.35 * TICK_EM);
        canvas.text(&tick.label.unwrap_or_default(), at, TICK_EM, Align::Right, INK)?;
    }
    let at = (26.0, 0.5 * (area.top + area.bottom));
    canvas.text(&bars.y, at, LABEL_EM, Align::Upwards, INK)
}

/// One bar about `middle`, its parts labelled by their shares where there is room.
fn draw_bar<B: DrawingBackend>(
    bar: &Bar,
    area: &Area,
    (middle, half): (f64, f64),
    canvas: &mut Canvas<B>,
) -> Result<(), DrawError> {
    let whole: f64 = bar.parts.iter().sum();
    let at = (middle, area.bottom + 22.0);
    canvas.text(&bar.name, at, TICK_EM, Align::Center, INK)?;
    let at = (middle, area.top - 8.0);
    canvas.text(&bar.whole, at, TICK_EM, Align::Center, INK)?;
    let mut below = 0.0;
    for (part, &amount) in bar.parts.iter().enumerate() {
        let share = amount / whole;
        if !share.is_finite() || share <= 0.0 {
            continue;
        }
        let y = |at: f64| area.bottom - at * (area.bottom - area.top);
        let (low, high) = (y(below), y(below + share));
        canvas.rectangle((middle - half, high), (middle + half, low), colour(part))?;
        if share >= LABELLED {
            let at = (middle, 0.5 * (low + high) + 0.35 * TICK_EM);
            let label = format!("{:.0} %", 100.0 * share);
            canvas.text(&label, at, TICK_EM, Align::Center, on(colour(part)))?;
        }
        below += share;
    }
    Ok(())
}

/// Black or white, whichever is easier to read on a colour.
fn on(RGBColor(red, green, blue): RGBColor) -> RGBColor {
    let luma = 0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue);
    match luma > 140.0 {
        true => INK,
        false => RGBColor(255, 255, 255),
    }
}

/// The parts, the topmost first as in the bars.
fn draw_legend<B: DrawingBackend>(bars: &Bars, area: &Area, canvas: &mut Canvas<B>) -> Result<(), DrawError> {
    let left = area.right + 24.0;
    let mut y = area.top + 10.0;
    for (part, name) in bars.parts.iter().enumerate().rev() {
        canvas.rectangle((left, y - 7.0), (left + 22.0, y + 7.0), colour(part))?;
        for line in font::wrap(name, TICK_EM, LEGEND_WIDTH - 36.0) {
            let at = (left + 32.0, y + 0.35 * TICK_EM);
            canvas.text(&line, at, TICK_EM, Align::Left, INK)?;
            y += 1.35 * TICK_EM;
        }
        y += 6.0;
    }
    Ok(())
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
            size: (600, 400),
        }
    }

    #[test]
    fn bars_divide_their_height_as_the_numbers_do() {
        let page = bars().bitmap().unwrap();
        // Down the left edge of the first bar, where no label stands.
        let column = 84 + ((600.0 - 84.0 - LEGEND_WIDTH - 24.0) / 4.0 * (1.0 - FILLED)) as usize + 4;
        let of = |part: usize| {
            let RGBColor(r, g, b) = colour(part);
            let pixel = |y: usize| &page.bytes[3 * (y * page.width + column)..][..3];
            (0..page.height).filter(|&y| pixel(y) == [r, g, b]).count() as f64
        };
        // A pixel at either end of a part may be mixed.
        assert!((of(0) - 3.0 * of(1)).abs() <= 8.0, "{} {}", of(0), of(1));
        assert!(of(1) > 20.0);
    }

    #[test]
    fn names_wholes_and_shares_are_written() {
        let svg = bars().svg().unwrap();
        for text in ["1 %", "2 s", "75 %", "25 %", "gather", "form factors", "a room"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("NaN"));
    }
}
