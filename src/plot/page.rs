//! Pages: pictures of one size in rows and columns under their labels, as a figure in print shows them, as PNG and SVG
//! from one drawing.
//!
//! Pictures are shown pixel by pixel, never resized, so a panel's codes are those of the picture's own PNG at the
//! page's exposure. What has no picture is hatched, with the reason in it, so that nobody takes it for light. Not
//! handled: pictures of several sizes ([`Sheet`](crate::plot::Sheet)), several pages.

use std::path::Path;

use glam::dvec2;

use crate::pictures::{Bitmap, Exposure, Picture, Size};
use crate::plot::drawing::{ChartError, Corner, Drawing};
use crate::plot::font;
use crate::plot::shapes::{Align, Colour, FAINT_INK, INK, PAPER};

/// Ground and lines of a hatched panel.
const HATCHED: Colour = [226; 3];
const HATCH: Colour = [190; 3];
/// Lines are so many ems of the labels apart, and so are text and its ground in a hatched panel.
const LINE: f64 = 1.4;
/// Sizes of the title, the notes and the caption, in ems of the labels.
const TITLE: f64 = 1.25;
const NOTE: f64 = 0.85;

/// A page of pictures.
#[derive(Clone, Debug)]
pub struct Page {
    /// Above everything; wrapped.
    pub title: String,
    /// From the top.
    pub rows: Vec<PageRow>,
    /// Below everything; wrapped.
    pub caption: String,
    /// Width and height of every picture, pixels.
    pub panel: Size,
    /// Brightness of every picture.
    pub exposure: Exposure,
}

/// A row of panels.
#[derive(Clone, Debug)]
pub struct PageRow {
    /// To its left, upwards.
    pub heading: Heading,
    /// From the left.
    pub cells: Vec<Cell>,
}

/// A name, and fainter words after it.
#[derive(Clone, Debug, Default)]
pub struct Heading {
    /// In ink.
    pub name: String,
    /// In grey.
    pub note: String,
}

/// A panel and its labels.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Above it.
    pub above: Heading,
    /// What fills it.
    pub shown: Shown,
    /// Brightness over the page's.
    pub gain: f32,
    /// Below it.
    pub below: String,
}

/// What fills a panel.
#[derive(Clone, Debug)]
pub enum Shown {
    /// Light.
    Picture(Picture),
    /// No light, and why.
    Hatched(String),
    /// Nothing, on paper.
    Blank,
}

/// A line of a label.
struct Words {
    text: String,
    /// From the panel's left edge.
    indent: f64,
    /// Its number, from the top.
    line: usize,
    ink: Colour,
}

/// Where things go, in pixels.
struct Layout {
    /// Size of the labels.
    em: f64,
    /// Left edges of the columns.
    lefts: Vec<usize>,
    /// Top edges of the pictures of each row.
    tops: Vec<usize>,
    /// Baseline of the caption's first line.
    caption: f64,
    margin: f64,
    size: Size,
}

impl Heading {
    /// A name and its note.
    pub fn new(name: impl Into<String>, note: impl Into<String>) -> Heading {
        Heading { name: name.into(), note: note.into() }
    }

    /// Its lines: the note beside the name where both fit, else below.
    fn words(&self, em: f64, limit: f64) -> Vec<Words> {
        let indent = font::width(&self.name, em) + 0.6 * em;
        if !self.name.is_empty() && indent + font::width(&self.note, em) <= limit {
            let of = |text: &str, indent, ink| Words { text: text.into(), indent, line: 0, ink };
            return vec![of(&self.name, 0.0, INK), of(&self.note, indent, FAINT_INK)];
        }
        let lines = |text: &str, ink| font::wrap(text, em, limit).into_iter().map(move |line| (line, ink));
        let all = lines(&self.name, INK).chain(lines(&self.note, FAINT_INK)).enumerate();
        all.map(|(line, (text, ink))| Words { text, indent: 0.0, line, ink }).collect()
    }
}

impl Page {
    /// The page, drawn.
    pub fn drawing(&self) -> Drawing {
        let layout = self.layout();
        let (em, margin) = (layout.em, layout.margin);
        let mut drawing = Drawing::new(layout.size, PAPER);
        for (number, line) in self.title_lines(&layout).iter().enumerate() {
            let y = margin + (number as f64 * LINE + 1.0) * TITLE * em;
            drawing.text(line, dvec2(margin, y), TITLE * em, Align::Left, INK);
        }
        for (row, &top) in self.rows.iter().zip(&layout.tops) {
            let middle = top as f64 + 0.5 * self.panel.height as f64;
            drawing.text(&row.heading.name, dvec2(margin + em, middle), em, Align::Upwards, INK);
            drawing.text(&row.heading.note, dvec2(margin + 2.2 * em, middle), NOTE * em, Align::Upwards, FAINT_INK);
            for (cell, &left) in row.cells.iter().zip(&layout.lefts) {
                self.draw_cell(cell, em, Corner { left, top }, &mut drawing);
            }
        }
        for (number, line) in self.caption_lines(&layout).iter().enumerate() {
            let y = layout.caption + number as f64 * LINE * NOTE * em;
            drawing.text(line, dvec2(margin, y), NOTE * em, Align::Left, FAINT_INK);
        }
        drawing
    }

    /// The top left pixel of every panel, row by row, in pixels of the page.
    pub fn places(&self) -> Vec<Vec<Corner>> {
        let layout = self.layout();
        let row = |(row, &top): (&PageRow, &usize)| {
            layout.lefts.iter().take(row.cells.len()).map(|&left| Corner { left, top }).collect()
        };
        self.rows.iter().zip(&layout.tops).map(row).collect()
    }

    /// Writes the page, as SVG where the path ends in `.svg` and as PNG where it ends in `.png`.
    ///
    /// # Errors
    /// Another extension, a size out of range, a destination that cannot be written. Nothing is left behind.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), ChartError> {
        self.drawing().write(path.as_ref())
    }

    fn layout(&self) -> Layout {
        let Size { width: wide, height: high } = self.panel;
        let em = (0.03 * wide as f64 + 10.0).min(44.0);
        let (gap, margin) = ((0.7 * em) as usize, 1.2 * em);
        let headed = self.rows.iter().any(|row| !row.heading.name.is_empty());
        let first = (margin + if headed { 3.0 * em } else { 0.0 }) as usize;
        let columns = self.rows.iter().map(|row| row.cells.len()).max().unwrap_or(0);
        let lefts: Vec<usize> = (0..columns).map(|column| first + column * (wide + gap)).collect();
        let width = first + columns * (wide + gap) - if columns > 0 { gap } else { 0 } + margin as usize;
        let mut layout = Layout { em, lefts, tops: Vec::new(), caption: 0.0, margin, size: Size { width, height: 0 } };
        let mut y = margin + (self.title_lines(&layout).len() as f64 * LINE * TITLE + 0.4) * em;
        for row in &self.rows {
            let deepest = |lines: &dyn Fn(&Cell) -> usize| row.cells.iter().map(lines).max().unwrap_or(0) as f64;
            let above =
                deepest(&|cell| cell.above.words(em, wide as f64).iter().map(|w| w.line + 1).max().unwrap_or(0));
            y = (y + above * LINE * em).ceil();
            layout.tops.push(y as usize);
            let below = deepest(&|cell| font::wrap(&cell.below, NOTE * em, wide as f64).len());
            y += high as f64 + below * LINE * NOTE * em + gap as f64;
        }
        layout.caption = y + NOTE * em;
        let caption = self.caption_lines(&layout).len() as f64 * LINE * NOTE * em;
        layout.size.height = (y + caption + 0.6 * margin).ceil() as usize;
        layout
    }

    fn title_lines(&self, layout: &Layout) -> Vec<String> {
        font::wrap(&self.title, TITLE * layout.em, layout.size.width as f64 - 2.0 * layout.margin)
    }

    fn caption_lines(&self, layout: &Layout) -> Vec<String> {
        font::wrap(&self.caption, NOTE * layout.em, layout.size.width as f64 - 2.0 * layout.margin)
    }

    /// A panel with its top left corner at a pixel, and its labels.
    fn draw_cell(&self, cell: &Cell, em: f64, at: Corner, drawing: &mut Drawing) {
        let (x, y, wide) = (at.left as f64, at.top as f64, self.panel.width as f64);
        let words = cell.above.words(em, wide);
        let lines = words.iter().map(|w| w.line + 1).max().unwrap_or(0);
        for w in &words {
            let baseline = y - ((lines - w.line) as f64 * LINE - 1.0) * em;
            drawing.text(&w.text, dvec2(x + w.indent, baseline), em, Align::Left, w.ink);
        }
        match &cell.shown {
            Shown::Picture(picture) => {
                let stops = self.exposure.stops + cell.gain.log2();
                drawing.image(Bitmap::from_picture(picture, Exposure { stops }), at);
            }
            Shown::Hatched(why) => hatch(why, em, [x, y, wide, self.panel.height as f64], drawing),
            Shown::Blank => (),
        }
        for (number, line) in font::wrap(&cell.below, NOTE * em, wide).iter().enumerate() {
            let baseline = y + self.panel.height as f64 + (number as f64 * LINE + 1.2) * NOTE * em;
            drawing.text(line, dvec2(x, baseline), NOTE * em, Align::Left, FAINT_INK);
        }
    }
}

/// A grey box of that left edge, top, width and height with lines across it, and words in its middle.
fn hatch(why: &str, em: f64, [x, y, wide, high]: [f64; 4], drawing: &mut Drawing) {
    drawing.rectangle(dvec2(x, y), dvec2(x + wide, y + high), HATCHED);
    let step = 0.8 * em;
    for number in 1..((wide + high) / step).ceil() as usize {
        // The points of the box whose distances from the left and the top sum to this.
        let sum = number as f64 * step;
        let [from, to] = [(sum - high).max(0.0), sum.min(wide)];
        drawing.line(&[dvec2(x + from, y + sum - from), dvec2(x + to, y + sum - to)], HATCH, 1.0);
    }
    let lines = font::wrap(why, NOTE * em, 0.86 * wide);
    let line = LINE * NOTE * em;
    let first = y + 0.5 * (high - lines.len() as f64 * line);
    let widest = lines.iter().map(|text| font::width(text, NOTE * em)).fold(0.0, f64::max);
    let [half, middle] = [0.5 * widest + 0.5 * em, x + 0.5 * wide];
    let last = first + lines.len() as f64 * line;
    drawing.rectangle(dvec2(middle - half, first - 0.3 * em), dvec2(middle + half, last + 0.3 * em), HATCHED);
    for (number, text) in lines.iter().enumerate() {
        let baseline = first + (number as f64 + 0.72) * line;
        drawing.text(text, dvec2(middle, baseline), NOTE * em, Align::Center, INK);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Rgb;

    fn page() -> Page {
        let cell = |shown, gain| Cell { above: Heading::new("global", "α = 1"), shown, gain, below: "note".into() };
        let picture = Picture::filled(100, 60, Rgb::new(0.2, 0.1, 0.05));
        let lit = cell(Shown::Picture(picture), 2.0);
        let rows = [vec![lit, cell(Shown::Hatched("diverges".into()), 1.0)], vec![cell(Shown::Blank, 1.0)]];
        let row = |cells| PageRow { heading: Heading::new("α = 1", ""), cells };
        let (title, caption) = ("Four modes".to_owned(), "a room".to_owned());
        let exposure = Exposure { stops: 1.0 };
        Page { title, rows: rows.map(row).into(), caption, panel: (100, 60).into(), exposure }
    }

    #[test]
    fn panels_stand_where_places_says_and_are_as_bright_as_their_gain() {
        let page = page();
        let (drawn, places) = (page.drawing().bitmap().unwrap(), page.places());
        assert_eq!(places.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
        let lit = Bitmap::from_picture(&Picture::filled(1, 1, Rgb::new(0.8, 0.4, 0.2)), Exposure::default());
        let Corner { left, top } = places[0][0];
        let count = |colour| drawn.bytes.chunks_exact(3).filter(|p| **p == colour).count();
        assert_eq!([(0, 0), (99, 59)].map(|(x, y)| drawn.get(left + x, top + y)), [lit.get(0, 0); 2]);
        assert_eq!(count(lit.get(0, 0).unwrap()), 100 * 60);
        assert!(count(HATCHED) > 100 * 60 / 3, "{}", count(HATCHED));
    }

    #[test]
    fn documents_name_what_they_show() {
        let svg = page().drawing().svg();
        for text in ["Four modes", "global", "α = 1", "diverges", "note", "a room", "data:image/png"] {
            assert!(svg.contains(text), "{text}");
        }
        let empty = Page { rows: Vec::new(), title: String::new(), ..page() };
        assert!(empty.drawing().bitmap().is_ok());
    }
}
