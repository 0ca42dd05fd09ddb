//! Pages: pictures in rows and columns under their labels. A page for print has pictures of one size, headed rows and a
//! caption; a contact sheet has pictures of any size and a heading.
//!
//! Pictures are shown pixel by pixel, never resized, so a panel's codes are those of the picture's own PNG at the same
//! exposure. What has no picture is hatched, or grey on a sheet, with the reason in it, so that nobody takes it for
//! light. Not handled: several pages.

use glam::{DVec2, dvec2};

use crate::drawing::{Align, Colour, Corner, Drawing, FAINT_INK, INK, PAPER};
use crate::font;
use halflight::pictures::{Bitmap, Exposure, Picture, Size};

/// Ground and lines of a hatched panel, and the ground of a grey one.
const HATCHED: Colour = [226; 3];
const HATCH: Colour = [190; 3];
const ABSENT: Colour = [222; 3];
/// Lines are so many ems apart.
const LINE: f64 = 1.4;
/// Sizes of the title, and of notes and the caption, in ems of the labels.
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
    /// Width and height of every picture on a page for print, of the largest on a sheet, pixels.
    pub panel: Size,
    /// For print, or a sheet.
    pub style: Style,
}

/// How a page is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// For print: narrow gaps, labels as deep as each row needs.
    Print,
    /// A contact sheet: cells wide enough for words, all of one size.
    Sheet,
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
    /// Below it.
    pub below: String,
}

/// What fills a panel.
#[derive(Clone, Debug)]
pub enum Shown {
    /// Light.
    Image(Bitmap),
    /// No light, and why.
    Absent(String),
    /// Nothing, on paper.
    Blank,
}

/// A line of a label: its text, distance from the panel's left edge in pixels, number from the top, and colour.
type Words = (String, f64, usize, Colour);

/// Where things go, in pixels.
struct Layout {
    /// Size of the labels.
    em: f64,
    /// Width of a cell.
    cell: f64,
    /// Left edges of the columns.
    lefts: Vec<usize>,
    /// Top edges of the pictures of each row.
    tops: Vec<usize>,
    /// Top left corner of the title, and the width that it and the caption have.
    title: DVec2,
    wide: f64,
    /// Distance of two columns, and of two rows.
    gap: usize,
    /// Top of the caption; of the first row until the rows are laid out.
    caption: f64,
    size: Size,
}

impl Heading {
    /// A name and its note.
    pub fn new(name: impl Into<String>, note: impl Into<String>) -> Heading {
        Heading { name: name.into(), note: note.into() }
    }

    /// Its lines: the note after the name where both fit, else below.
    fn words(&self, em: f64, limit: f64) -> Vec<Words> {
        let indent = font::width(&self.name, em) + 0.6 * em;
        if !self.name.is_empty() && indent + font::width(&self.note, em) <= limit {
            return vec![(self.name.clone(), 0.0, 0, INK), (self.note.clone(), indent, 0, FAINT_INK)];
        }
        let name = wrapped(&self.name, em, limit, INK);
        let note = wrapped(&self.note, em, limit, FAINT_INK);
        name.into_iter().chain(note).enumerate().map(|(line, words)| (words.0, 0.0, line, words.3)).collect()
    }
}

impl Shown {
    /// A picture at an exposure.
    pub fn image(picture: &Picture, exposure: Exposure) -> Shown {
        Shown::Image(Bitmap::from_picture(picture, exposure))
    }
}

impl Cell {
    /// A cell with nothing below it.
    pub fn new(above: Heading, shown: Shown) -> Cell {
        Cell { above, shown, below: String::new() }
    }

    /// Height of what fills it, pixels.
    fn height(&self, panel: Size) -> usize {
        if let Shown::Image(bitmap) = &self.shown { bitmap.height } else { panel.height }
    }
}

impl Page {
    /// A contact sheet of cells, row by row, at least one and at most `columns` to a row.
    pub fn sheet(heading: String, cells: Vec<Cell>, columns: usize) -> Page {
        let sizes = cells.iter().filter_map(|cell| match &cell.shown {
            Shown::Image(bitmap) => Some(Size { width: bitmap.width, height: bitmap.height }),
            _ => None,
        });
        let larger = |a: Size, b: Size| Size { width: a.width.max(b.width), height: a.height.max(b.height) };
        let panel = sizes.reduce(larger).unwrap_or(Size { width: 256, height: 256 });
        let row = |cells: &[Cell]| PageRow { heading: Heading::default(), cells: cells.to_vec() };
        let rows = cells.chunks(columns.max(1)).map(row).collect();
        Page { title: heading, rows, caption: String::new(), panel, style: Style::Sheet }
    }

    /// The page, drawn; written as SVG or PNG by [`Drawing::write`].
    pub fn drawing(&self) -> Drawing {
        let layout = self.layout();
        let em = layout.em;
        let mut drawing = Drawing::new(layout.size, PAPER);
        let title = wrapped(&self.title, TITLE * em, layout.wide, INK);
        let baseline = |line: f64| layout.title.y + (line * LINE + 1.0) * TITLE * em;
        self.draw_words(&title, [layout.title, dvec2(layout.wide, TITLE * em)], &baseline, &mut drawing);
        for (row, &top) in self.rows.iter().zip(&layout.tops) {
            if self.style == Style::Print {
                let (left, middle) = (layout.title.x, top as f64 + 0.5 * self.panel.height as f64);
                drawing.text(&row.heading.name, dvec2(left + em, middle), em, Align::Upwards, INK);
                let note = dvec2(left + 2.2 * em, middle);
                drawing.text(&row.heading.note, note, NOTE * em, Align::Upwards, FAINT_INK);
            }
            for (cell, &left) in row.cells.iter().zip(&layout.lefts) {
                self.draw_cell(cell, &layout, Corner { left, top }, &mut drawing);
            }
        }
        let caption = wrapped(&self.caption, NOTE * em, layout.wide, FAINT_INK);
        let baseline = |line: f64| layout.caption + NOTE * em + line * LINE * NOTE * em;
        let at = dvec2(layout.title.x, layout.caption);
        self.draw_words(&caption, [at, dvec2(layout.wide, NOTE * em)], &baseline, &mut drawing);
        drawing
    }

    /// Height of so many lines of text of `size` ems, pixels.
    fn height(&self, lines: usize, size: f64, em: f64) -> f64 {
        match self.style {
            Style::Print => lines as f64 * LINE * size * em,
            Style::Sheet => lines as f64 * (LINE * (size * em)).ceil(),
        }
    }

    fn layout(&self) -> Layout {
        let columns = self.rows.iter().map(|row| row.cells.len()).max().unwrap_or(0);
        let mut layout = match self.style {
            Style::Print => self.print_columns(columns),
            Style::Sheet => self.sheet_columns(columns),
        };
        let Layout { em, cell, gap, caption: mut y, .. } = layout;
        for row in &self.rows {
            let (mut above, mut below) = (0, 0);
            let all = self.rows.iter().filter(|other| self.style == Style::Sheet || std::ptr::eq(*other, row));
            for labelled in all.flat_map(|row| &row.cells) {
                above = above.max(count(&labelled.above.words(em, cell)));
                below = below.max(font::wrap(&labelled.below, NOTE * em, cell).len());
            }
            y = (y + self.height(above, 1.0, em)).ceil();
            layout.tops.push(y as usize);
            y += self.panel.height as f64 + self.height(below, NOTE, em) + gap as f64;
        }
        layout.caption = y;
        if self.style == Style::Print {
            let lines = wrapped(&self.caption, NOTE * em, layout.wide, FAINT_INK).len();
            y = y + self.height(lines, NOTE, em) + 0.6 * layout.title.x;
        }
        layout.size.height = y.ceil() as usize;
        layout
    }

    /// Narrow columns, after a margin and the rows' headings where there are some.
    fn print_columns(&self, columns: usize) -> Layout {
        let wide = self.panel.width;
        let em = (0.03 * wide as f64 + 10.0).min(44.0);
        let (gap, margin) = ((0.7 * em) as usize, 1.2 * em);
        let headed = self.rows.iter().any(|row| !row.heading.name.is_empty());
        let first = (margin + if headed { 3.0 * em } else { 0.0 }) as usize;
        let width = first + columns * (wide + gap) - if columns > 0 { gap } else { 0 } + margin as usize;
        let title = font::wrap(&self.title, TITLE * em, width as f64 - 2.0 * margin).len() as f64;
        Layout {
            em,
            cell: wide as f64,
            lefts: (0..columns).map(|column| first + column * (wide + gap)).collect(),
            tops: Vec::new(),
            title: dvec2(margin, margin),
            wide: width as f64 - 2.0 * margin,
            gap,
            caption: margin + (title * LINE * TITLE + 0.4) * em,
            size: Size { width, height: 0 },
        }
    }

    /// Columns as wide as the pictures or as words need, whichever is wider.
    fn sheet_columns(&self, columns: usize) -> Layout {
        let em = (0.05 * self.panel.width as f64).clamp(13.0, 34.0);
        let (gap, cell) = ((1.3 * em) as usize, self.panel.width.max((9.0 * em) as usize));
        let (columns, step) = (columns.max(1), cell + gap);
        let wide = (columns * step - gap) as f64;
        let title = font::wrap(&self.title, TITLE * em, wide).len();
        Layout {
            em,
            cell: cell as f64,
            lefts: (0..columns).map(|column| gap + column * step).collect(),
            tops: Vec::new(),
            title: dvec2(gap as f64, (gap / 2) as f64),
            wide,
            gap,
            caption: gap as f64 + self.height(title, TITLE, em),
            size: Size { width: gap + columns * step, height: 0 },
        }
    }

    /// Lines of a label from a corner, of that width and em: on a page for print their baselines are at `baseline` of
    /// their number; on a sheet they are a block of their own that is cut off at its edges.
    fn draw_words(
        &self,
        words: &[Words],
        [at, DVec2 { x: wide, y: em }]: [DVec2; 2],
        baseline: &dyn Fn(f64) -> f64,
        drawing: &mut Drawing,
    ) {
        if self.style == Style::Print {
            for (text, indent, line, ink) in words {
                drawing.text(text, dvec2(at.x + indent, baseline(*line as f64)), em, Align::Left, *ink);
            }
            return;
        }
        let high = self.height(1, 1.0, em);
        let size = Size { width: wide as usize, height: count(words) * high as usize };
        let mut block = Drawing::new(size, PAPER);
        for (text, indent, line, ink) in words {
            block.text(text, dvec2(*indent, *line as f64 * high + 0.98 * em), em, Align::Left, *ink);
        }
        place(&block, Corner { left: at.x as usize, top: at.y as usize }, drawing);
    }

    /// A panel with its top left corner at a pixel, and its labels.
    fn draw_cell(&self, cell: &Cell, layout: &Layout, at: Corner, drawing: &mut Drawing) {
        let (em, x, y) = (layout.em, at.left as f64, at.top as f64);
        let words = cell.above.words(em, layout.cell);
        let lines = count(&words);
        let top = dvec2(x, y - self.height(lines, 1.0, em));
        let baseline = |line: f64| y - ((lines as f64 - line) * LINE - 1.0) * em;
        self.draw_words(&words, [top, dvec2(layout.cell, em)], &baseline, drawing);
        match (&cell.shown, self.style) {
            (Shown::Image(bitmap), _) => drawing.image(bitmap.clone(), at),
            (Shown::Absent(why), Style::Print) => {
                hatch(why, em, [x, y, self.panel.width as f64, self.panel.height as f64], drawing);
            }
            (Shown::Absent(why), Style::Sheet) => grey(why, em, self.panel, at, drawing),
            (Shown::Blank, _) => (),
        }
        let below = wrapped(&cell.below, NOTE * em, layout.cell, FAINT_INK);
        let high = cell.height(self.panel) as f64;
        let baseline = |line: f64| y + high + (line * LINE + 1.2) * NOTE * em;
        self.draw_words(&below, [dvec2(x, y + high), dvec2(layout.cell, NOTE * em)], &baseline, drawing);
    }
}

/// Puts a part that was drawn by itself where it belongs; one that is too large makes the whole too large.
fn place(part: &Drawing, at: Corner, drawing: &mut Drawing) {
    if let Ok(bitmap) = part.bitmap() {
        drawing.image(bitmap, at);
    }
}

/// Text in lines of at most `limit` pixels.
fn wrapped(text: &str, em: f64, limit: f64, ink: Colour) -> Vec<Words> {
    font::wrap(text, em, limit).into_iter().enumerate().map(|(line, text)| (text, 0.0, line, ink)).collect()
}

/// Number of lines.
fn count(words: &[Words]) -> usize {
    words.iter().map(|words| words.2 + 1).max().unwrap_or(0)
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

/// A grey box, words in its middle and cut off at its edges.
fn grey(why: &str, em: f64, size: Size, at: Corner, drawing: &mut Drawing) {
    let em = (size.width as f64 / 9.0).clamp(9.0, em);
    let (margin, line) = ((0.6 * em) as usize, (LINE * em).ceil());
    let width = size.width.saturating_sub(2 * margin).max(1);
    let lines = font::wrap(why, em, width as f64);
    let height = lines.len() * line as usize;
    let mut words = Drawing::new(Size { width, height }, ABSENT);
    for (number, text) in lines.iter().enumerate() {
        words.text(text, dvec2(0.0, number as f64 * line + 0.98 * em), em, Align::Left, INK);
    }
    let mut area = Drawing::new(size, ABSENT);
    place(&words, Corner { left: margin, top: size.height.saturating_sub(height) / 2 }, &mut area);
    place(&area, at, drawing);
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::light::Rgb;

    fn cell(name: &str, shown: Shown) -> Cell {
        Cell { above: Heading::new(name, "α = 1"), shown, below: "note".into() }
    }

    fn page(style: Style) -> Page {
        let picture = Picture::filled(100, 60, Rgb::new(0.2, 0.1, 0.05));
        let lit = cell("global", Shown::image(&picture, Exposure { stops: 2.0 }));
        let rows = [vec![lit, cell("shadowless", Shown::Absent("diverges".into()))], vec![cell("local", Shown::Blank)]];
        let row = |cells| PageRow { heading: Heading::new("α = 1", ""), cells };
        let (title, caption) = ("Four modes".to_owned(), "a room".to_owned());
        Page { title, rows: rows.map(row).into(), caption, panel: (100, 60).into(), style }
    }

    #[test]
    fn panels_show_the_codes_of_their_pictures() {
        let lit = Bitmap::from_picture(&Picture::filled(1, 1, Rgb::new(0.8, 0.4, 0.2)), Exposure::default());
        for (style, ground) in [(Style::Print, HATCHED), (Style::Sheet, ABSENT)] {
            let page = page(style);
            let (drawn, layout) = (page.drawing().bitmap().unwrap(), page.layout());
            let (left, top) = (layout.lefts[0], layout.tops[0]);
            let count = |colour| drawn.bytes.chunks_exact(3).filter(|p| **p == colour).count();
            assert_eq!([(0, 0), (99, 59)].map(|(x, y)| drawn.get(left + x, top + y)), [lit.get(0, 0); 2]);
            assert_eq!(count(lit.get(0, 0).unwrap()), 100 * 60);
            // The box without a picture has some of its pixels under lines and words.
            assert!((100 * 60 / 3..100 * 60).contains(&count(ground)), "{}", count(ground));
        }
    }

    #[test]
    fn documents_name_what_they_show_and_empty_pages_do_not_fail() {
        let svg = page(Style::Print).drawing().svg();
        for text in ["Four modes", "global", "α = 1", "diverges", "note", "a room", "data:image/png"] {
            assert!(svg.contains(text), "{text}");
        }
        let empty = Page { rows: Vec::new(), title: String::new(), ..page(Style::Print) };
        assert!(empty.drawing().bitmap().is_ok());
        assert!(Page::sheet(String::new(), Vec::new(), 0).drawing().bitmap().is_ok());
        let alone = Page::sheet(String::new(), vec![cell("", Shown::Absent(String::new()))], 2);
        let grey = alone.drawing().bitmap().unwrap().bytes.chunks_exact(3).filter(|p| **p == ABSENT).count();
        assert_eq!(grey, 256 * 256);
    }
}
