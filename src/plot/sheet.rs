//! Contact sheets: pictures side by side under their titles, at one exposure, as a figure shows them.
//!
//! Pictures are shown pixel by pixel, never resized, so a tile's codes are those of the picture's own PNG. A tile
//! without picture is a grey box with the reason in it. Not handled: charts among the pictures, several pages.

use std::path::Path;

use glam::dvec2;

use crate::pictures::{Bitmap, Exposure, Picture, Size, write_bitmap};
use crate::plot::drawing::{ChartError, Corner, DrawError, Drawing};
use crate::plot::font;
use crate::plot::shapes::{Align, Colour, FAINT_INK, INK, PAPER};

const ABSENT: Colour = [222; 3];

/// One picture of a sheet, or the reason why there is none.
#[derive(Clone, Debug)]
pub struct Tile<'a> {
    /// What is shown; `None` leaves a grey box.
    pub picture: Option<&'a Picture>,
    /// Above the picture.
    pub title: String,
    /// Below the picture; inside the box where there is none.
    pub note: String,
    /// Brightness over the other tiles'; where it is not 1 the title says so, as in ×8.
    pub gain: f32,
}

/// A contact sheet.
#[derive(Clone, Debug)]
pub struct Sheet<'a> {
    /// Above all tiles; wrapped.
    pub heading: String,
    /// Row by row from the top left.
    pub tiles: Vec<Tile<'a>>,
    /// Tiles in a row, at least 1.
    pub columns: usize,
    /// Brightness of every tile.
    pub exposure: Exposure,
}

/// Where things go, in pixels. A cell is a title, a picture and a note.
struct Layout {
    /// Text size.
    em: f64,
    /// Size of the largest picture.
    tile: Size,
    /// Width of a cell, gap excluded.
    cell: usize,
    title_height: usize,
    cell_height: usize,
    gap: usize,
    heading: Bitmap,
}

impl Tile<'_> {
    fn label(&self) -> String {
        if self.gain == 1.0 { self.title.clone() } else { format!("{} ×{}", self.title, self.gain) }
    }

    /// What stands below the picture: a missing one's note stands in its box.
    fn below(&self) -> &str {
        self.picture.map_or("", |_| &self.note)
    }
}

impl Sheet<'_> {
    /// The sheet as pixels.
    ///
    /// # Errors
    /// Text wider than can be drawn.
    pub fn bitmap(&self) -> Result<Bitmap, DrawError> {
        let layout = self.layout()?;
        let columns = self.used_columns();
        let rows = self.tiles.len().div_ceil(columns);
        let (step, gap) = (layout.cell + layout.gap, layout.gap);
        let top = gap + layout.heading.height;
        let height = top + rows * (layout.cell_height + gap);
        let mut page = Bitmap::filled(gap + columns * step, height, PAPER);
        page.paste(&layout.heading, gap, gap / 2);
        for (number, tile) in self.tiles.iter().enumerate() {
            let left = gap + number % columns * step;
            let top = top + number / columns * (layout.cell_height + gap);
            self.draw_tile(tile, &layout, &mut page, Corner { left, top })?;
        }
        Ok(page)
    }

    /// Writes the sheet as `.png`.
    ///
    /// # Errors
    /// Another extension, or a destination that cannot be written. Nothing is left behind.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), ChartError> {
        Ok(write_bitmap(path, &self.bitmap()?)?)
    }

    /// Columns that hold a tile, at least 1.
    fn used_columns(&self) -> usize {
        self.columns.clamp(1, self.tiles.len().max(1))
    }

    fn layout(&self) -> Result<Layout, DrawError> {
        let sizes = self.tiles.iter().filter_map(|t| t.picture.map(Picture::size));
        let larger = |a: Size, b: Size| Size { width: a.width.max(b.width), height: a.height.max(b.height) };
        let tile = sizes.reduce(larger).unwrap_or(Size { width: 256, height: 256 });
        let em = (0.05 * tile.width as f64).clamp(13.0, 34.0);
        // Narrow tiles get cells wide enough for words.
        let cell = tile.width.max((9.0 * em) as usize);
        let deepest = |text: &dyn Fn(&Tile) -> String, em: f64| {
            let lines = |t| font::wrap(&text(t), em, cell as f64).len();
            line_height(em) * self.tiles.iter().map(lines).max().unwrap_or(0)
        };
        let title_height = deepest(&|t| t.label(), em);
        let below = deepest(&|t| t.below().to_owned(), 0.85 * em);
        let gap = (1.3 * em) as usize;
        let heading_width = self.used_columns() * (cell + gap) - gap;
        Ok(Layout {
            em,
            tile,
            cell,
            title_height,
            cell_height: title_height + tile.height + below,
            gap,
            heading: text_block(&self.heading, heading_width, 1.25 * em, INK, PAPER)?,
        })
    }

    fn draw_tile(
        &self,
        tile: &Tile,
        layout: &Layout,
        page: &mut Bitmap,
        Corner { left, top }: Corner,
    ) -> Result<(), DrawError> {
        let title = text_block(&tile.label(), layout.cell, layout.em, INK, PAPER)?;
        // Titles of one line stand directly above their picture beside taller ones.
        page.paste(&title, left, top + layout.title_height - title.height);
        let top = top + layout.title_height;
        let Some(picture) = tile.picture else {
            return absent(tile, layout, page, Corner { left, top });
        };
        let stops = self.exposure.stops + tile.gain.log2();
        page.paste(&Bitmap::from_picture(picture, Exposure { stops }), left, top);
        let note = text_block(&tile.note, layout.cell, 0.85 * layout.em, FAINT_INK, PAPER)?;
        page.paste(&note, left, top + picture.height);
        Ok(())
    }
}

/// The grey box of a missing picture, its note in the middle and cut off at its edges.
fn absent(tile: &Tile, layout: &Layout, page: &mut Bitmap, Corner { left, top }: Corner) -> Result<(), DrawError> {
    let Size { width, height } = layout.tile;
    let mut area = Bitmap::filled(width, height, ABSENT);
    let em = (width as f64 / 9.0).clamp(9.0, layout.em);
    let margin = (0.6 * em) as usize;
    let inside = width.saturating_sub(2 * margin).max(1);
    let note = text_block(&tile.note, inside, em, INK, ABSENT)?;
    area.paste(&note, margin, height.saturating_sub(note.height) / 2);
    page.paste(&area, left, top);
    Ok(())
}

fn line_height(em: f64) -> usize {
    (1.4 * em).ceil() as usize
}

/// Wrapped text on a ground of its own, as high as its lines; nothing for no text.
fn text_block(text: &str, width: usize, em: f64, ink: Colour, paper: Colour) -> Result<Bitmap, DrawError> {
    let (lines, height) = (font::wrap(text, em, width as f64), line_height(em));
    let mut block = Drawing::new(Size { width, height: lines.len() * height }, paper);
    for (number, line) in lines.iter().enumerate() {
        block.text(line, dvec2(0.0, (number * height) as f64 + 0.98 * em), em, Align::Left, ink);
    }
    block.bitmap()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Rgb;

    fn tile<'a>(picture: Option<&'a Picture>, title: &str, note: &str, gain: f32) -> Tile<'a> {
        Tile { picture, title: title.into(), note: note.into(), gain }
    }

    fn count(page: &Bitmap, colour: [u8; 3]) -> usize {
        page.bytes.chunks_exact(3).filter(|p| *p == colour).count()
    }

    #[test]
    fn tiles_show_the_codes_of_their_pictures() {
        let plain = Picture::filled(100, 80, Rgb::new(0.5, 0.1, 0.02));
        let faint = plain.scaled(0.125);
        let sheet = Sheet {
            heading: "Cornell box".into(),
            tiles: vec![
                tile(Some(&plain), "global", "", 1.0),
                tile(Some(&faint), "bounce 2", "", 8.0),
                tile(None, "shadowless", "diverges: spectral radius ≥ 1.05", 1.0),
            ],
            columns: 2,
            exposure: Exposure { stops: 0.5 },
        };
        let page = sheet.bitmap().unwrap();
        let codes = Bitmap::from_picture(&plain, sheet.exposure).get(0, 0).unwrap();
        assert_eq!(count(&page, codes), 2 * 100 * 80);
        // The grey box is as large as a picture and has some of its pixels under the note.
        let grey = count(&page, ABSENT);
        assert!(grey > 100 * 80 / 2 && grey < 100 * 80, "{grey}");
        assert_eq!(sheet.tiles[1].label(), "bounce 2 ×8");
    }

    #[test]
    fn odd_sheets_do_not_fail() {
        let mut sheet = Sheet { heading: String::new(), tiles: Vec::new(), columns: 0, exposure: Exposure::default() };
        assert!(sheet.bitmap().is_ok());
        sheet.tiles.push(tile(None, "", "", 1.0));
        let page = sheet.bitmap().unwrap();
        assert_eq!(count(&page, ABSENT), 256 * 256);
    }
}
