//! Drawings: filled paths, lines and text in pixels from the top left, and pictures under them, as an SVG document or a
//! bitmap.
//!
//! A bitmap's pixel takes the share of the colour that a shape covers of it, on sRGB codes, as is conventional for line
//! art. Text is `<text>` in a document, set by the reader's program, and the embedded font's outlines in a bitmap. Not
//! handled: transparency, gradients, clipping.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec2, dvec2};
use zeno::{Join, Mask, Placement, Stroke};

use crate::font;
use halflight::pictures::{Bitmap, ImageError, Size, WriteError, encode_png, write_bitmap, write_whole};

/// A drawing is too large for a bitmap.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("the chart cannot be drawn: its size is {width} x {height}")]
#[diagnostic(code(halflight::chart), help("a drawing has at most 65,536 pixels a side and 67 million in all"))]
pub struct DrawError {
    /// Its width in pixels.
    pub width: usize,
    /// Its height in pixels.
    pub height: usize,
}

/// A chart or sheet cannot be written.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum ChartError {
    /// It cannot be drawn.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Draw(#[from] DrawError),
    /// Its bitmap cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Image(#[from] ImageError),
    /// Its SVG cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

/// Shapes drawn one over the other on paper.
#[derive(Clone, Debug)]
pub struct Drawing {
    size: Size,
    paper: Colour,
    images: Vec<(Bitmap, Corner)>,
    shapes: Vec<(Shape, Colour)>,
}

/// The top left pixel of something drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Corner {
    /// Pixels from the left edge.
    pub left: usize,
    /// Pixels from the top edge.
    pub top: usize,
}

/// The element of finished pixels in an SVG document, their PNG file inside it; nothing for no pixels.
fn image_element(bitmap: &Bitmap, Corner { left, top }: Corner) -> String {
    let Bitmap { width, height, .. } = bitmap;
    let Ok(file) = encode_png(bitmap) else {
        return String::new();
    };
    format!(
        "<image x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" \
         href=\"data:image/png;base64,{}\"/>\n",
        base64(&file),
    )
}

/// Bytes as text of 64 signs, three bytes in four of them (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const SIGNS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let four = |three: &[u8]| {
        let bits = (0..3).fold(0, |bits, k| bits << 8 | u32::from(three.get(k).copied().unwrap_or(0)));
        let sign = |k: usize| {
            if k <= three.len() { SIGNS[(bits >> (18 - 6 * k) & 63) as usize] as char } else { '=' }
        };
        [0, 1, 2, 3].map(sign)
    };
    bytes.chunks(3).flat_map(four).collect()
}

impl Drawing {
    /// An empty drawing of that width and height.
    pub fn new(size: impl Into<Size>, paper: Colour) -> Self {
        Drawing { size: size.into(), paper, images: Vec::new(), shapes: Vec::new() }
    }

    /// Finished pixels with their top left corner at a pixel, one for one; all shapes are drawn over them.
    pub fn image(&mut self, bitmap: Bitmap, at: Corner) {
        self.images.push((bitmap, at));
    }

    /// A line through all points, straight between them.
    pub fn line(&mut self, points: &[DVec2], colour: Colour, width: f64) {
        self.dashed(points, colour, width, 0.0);
    }

    /// A dashed line: `dash` pixels drawn, `dash` left out, carried on round the corners.
    pub fn dashed(&mut self, points: &[DVec2], colour: Colour, width: f64, dash: f64) {
        self.shapes.push((Shape::Line { path: joined(points), width, dash }, colour));
    }

    /// A filled rectangle between two opposite corners.
    pub fn rectangle(&mut self, corner: DVec2, opposite: DVec2, colour: Colour) {
        let others = [dvec2(opposite.x, corner.y), dvec2(corner.x, opposite.y)];
        self.polygon(&[corner, others[0], opposite, others[1]], colour);
    }

    /// A filled polygon.
    pub fn polygon(&mut self, corners: &[DVec2], colour: Colour) {
        self.shapes.push((Shape::Fill { path: joined(corners) + "Z" }, colour));
    }

    /// A marker of about `size` pixels across.
    pub fn marker(&mut self, marker: Marker, at: DVec2, size: f64, colour: Colour) {
        self.shapes.push((Shape::Fill { path: marker.path(at, 0.5 * size) }, colour));
    }

    /// A line of text whose baseline passes through the point, at an em of `em` pixels.
    pub fn text(&mut self, line: &str, at: DVec2, em: f64, align: Align, colour: Colour) {
        self.shapes.push((Shape::Text { line: line.into(), at, em, align }, colour));
    }

    /// The drawing as an SVG document.
    pub fn svg(&self) -> String {
        let Size { width, height } = self.size;
        let mut document = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"{}\" stroke-linejoin=\"round\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"{}\"/>\n",
            font::FAMILY,
            hex(self.paper),
        );
        for (bitmap, at) in &self.images {
            document += &image_element(bitmap, *at);
        }
        for (shape, colour) in &self.shapes {
            document += &shape.element(&hex(*colour));
            document.push('\n');
        }
        document + "</svg>\n"
    }

    /// The drawing as pixels.
    ///
    /// # Errors
    /// [`DrawError`] where it is too large.
    pub fn bitmap(&self) -> Result<Bitmap, DrawError> {
        let Size { width, height } = self.size;
        if width.max(height) > 1 << 16 || width.saturating_mul(height) > 1 << 26 {
            return Err(DrawError { width, height });
        }
        let mut page = Bitmap::filled(width, height, self.paper);
        for (bitmap, at) in &self.images {
            page.paste(bitmap, at.left, at.top);
        }
        for (shape, colour) in &self.shapes {
            shape.fill(&mut page, *colour);
        }
        Ok(page)
    }

    /// Writes the drawing, as SVG where the path ends in `.svg` and as PNG where it ends in `.png`.
    ///
    /// # Errors
    /// Another extension, a size out of range, a destination that cannot be written. Nothing is left behind.
    pub fn write(&self, path: &Path) -> Result<(), ChartError> {
        let svg = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("svg"));
        if svg {
            write_whole(path, self.svg().as_bytes())?
        } else {
            write_bitmap(path, &self.bitmap()?)?
        }
        Ok(())
    }
}

/// sRGB codes.
pub type Colour = [u8; 3];

/// What is drawn on.
pub const PAPER: Colour = [255; 3];
/// Lines and text.
pub const INK: Colour = [34; 3];
/// Text that matters less.
pub const FAINT_INK: Colour = [88; 3];

/// Where a text stands relative to its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// It starts there.
    Left,
    /// It is centred there.
    Center,
    /// It ends there.
    Right,
    /// It is centred there and runs upwards.
    Upwards,
}

/// The shape of a data point, so that series differ in more than colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// A disc.
    Disc,
    /// A square.
    Square,
    /// A triangle, point up.
    Triangle,
    /// A diamond.
    Diamond,
    /// A triangle, point down.
    Wedge,
    /// An upright cross.
    Cross,
}

/// What a drawing consists of; paths are SVG path data.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    /// The inside of a path.
    Fill { path: String },
    /// A path of some width; dashes and gaps of length `dash`, or neither where it is 0.
    Line { path: String, width: f64, dash: f64 },
    /// A line of text.
    Text { line: String, at: DVec2, em: f64, align: Align },
}

impl Marker {
    /// Its outline about a point as SVG path data, for a radius of about `r`.
    pub fn path(self, at: DVec2, r: f64) -> String {
        let DVec2 { x, y } = at;
        if self == Marker::Disc {
            let arc = |end: f64| format!("A{r} {r} 0 0 1 {end:.2} {y:.2}");
            return format!("M{:.2} {y:.2}{}{}Z", x - r, arc(x + r), arc(x - r));
        }
        let corners: Vec<_> = self.corners().iter().map(|(dx, dy)| DVec2::new(x + r * dx, y + r * dy)).collect();
        joined(&corners) + "Z"
    }

    /// Its corners about (0, 0) for a marker about 2 across; a disc has none.
    fn corners(self) -> &'static [(f64, f64)] {
        match self {
            Marker::Disc => &[],
            Marker::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
            Marker::Triangle => &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)],
            Marker::Diamond => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
            Marker::Wedge => &[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)],
            #[rustfmt::skip]
            Marker::Cross => &[
                (-0.4, -1.2), (0.4, -1.2), (0.4, -0.4), (1.2, -0.4), (1.2, 0.4), (0.4, 0.4),
                (0.4, 1.2), (-0.4, 1.2), (-0.4, 0.4), (-1.2, 0.4), (-1.2, -0.4), (-0.4, -0.4),
            ],
        }
    }
}

impl Shape {
    /// Its element of an SVG document.
    pub fn element(&self, colour: &str) -> String {
        match self {
            Shape::Fill { path } => format!("<path d=\"{path}\" fill=\"{colour}\"/>"),
            Shape::Line { path, width, dash } => {
                let dash = if *dash > 0.0 { format!(" stroke-dasharray=\"{dash}\"") } else { String::new() };
                format!("<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"{dash}/>")
            }
            Shape::Text { line, at: DVec2 { x, y }, em, align } => {
                let line = line.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
                let (anchor, turn) = match align {
                    Align::Left => ("start", String::new()),
                    Align::Center => ("middle", String::new()),
                    Align::Right => ("end", String::new()),
                    Align::Upwards => ("middle", format!(" transform=\"rotate(-90 {x:.2} {y:.2})\"")),
                };
                format!(
                    "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{em}\" text-anchor=\"{anchor}\" \
                     fill=\"{colour}\"{turn}>{line}</text>"
                )
            }
        }
    }

    /// Mixes the colour into the pixels by how much of each the shape covers.
    pub fn fill(&self, page: &mut Bitmap, colour: Colour) {
        let (cover, place) = self.cover();
        let (wide, high) = (page.width as i32, page.height as i32);
        for (row, y) in cover.chunks_exact(place.width.max(1) as usize).zip(place.top..high) {
            for (&share, x) in row.iter().zip(place.left..wide) {
                if share > 0 && x >= 0 && y >= 0 {
                    let first = 3 * (y as usize * page.width + x as usize);
                    mix(&mut page.bytes[first..first + 3], colour, share);
                }
            }
        }
    }

    /// How much of each pixel it covers, of 255, and where these pixels are.
    fn cover(&self) -> (Vec<u8>, Placement) {
        match self {
            Shape::Fill { path } => Mask::new(path.as_str()).render(),
            Shape::Line { path, width, dash } => {
                let dashes = [*dash as f32; 2];
                let dashes = if *dash > 0.0 { &dashes[..] } else { &[] };
                let mut stroke = Stroke::new(*width as f32);
                stroke.join(Join::Round).dash(dashes, 0.0);
                Mask::new(path.as_str()).style(stroke).render()
            }
            Shape::Text { line, at: DVec2 { x, y }, em, align } => {
                let back = font::width(line, *em)
                    * match align {
                        Align::Left => 0.0,
                        Align::Center | Align::Upwards => 0.5,
                        Align::Right => 1.0,
                    };
                let path = font::outline(line, *em, |along, up| match align {
                    Align::Upwards => (x - up, y + back - along),
                    _ => (x - back + along, y - up),
                });
                Mask::new(path.as_str()).render()
            }
        }
    }
}

/// Moves codes towards a colour by share/255.
fn mix(codes: &mut [u8], colour: Colour, share: u8) {
    for (code, own) in codes.iter_mut().zip(colour) {
        let sum = u32::from(*code) * u32::from(255 - share) + u32::from(own) * u32::from(share);
        *code = ((sum + 127) / 255) as u8;
    }
}

/// Path data of straight lines from point to point.
pub fn joined(points: &[DVec2]) -> String {
    let mut path = String::new();
    for DVec2 { x, y } in points {
        let _ = write!(path, "{}{x:.2} {y:.2}", if path.is_empty() { 'M' } else { 'L' });
    }
    path
}

/// The colour as SVG names it.
pub fn hex([red, green, blue]: Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The box of everything that is not white: left, top, right, bottom.
    fn inked(draw: impl Fn(&mut Drawing)) -> [usize; 4] {
        let mut drawing = Drawing::new((200, 200), PAPER);
        draw(&mut drawing);
        let page = drawing.bitmap().unwrap();
        let dark = |i: &usize| page.bytes[3 * i..3 * i + 3] != PAPER;
        let grow = |[l, t, r, b]: [usize; 4], i| {
            let (x, y) = (i % page.width, i / page.width);
            [l.min(x), t.min(y), r.max(x), b.max(y)]
        };
        (0..page.width * page.height).filter(dark).fold([usize::MAX, usize::MAX, 0, 0], grow)
    }

    #[test]
    fn text_stands_on_its_baseline_and_ends_at_its_point() {
        let [left, top, right, bottom] = inked(|d| d.text("HEH", dvec2(150.0, 60.0), 20.0, Align::Right, INK));
        // Capitals are about 0.7 em high; side bearings are up to 0.1 em.
        assert!((59..=60).contains(&bottom) && (44..=47).contains(&top), "{top} {bottom}");
        let expected = 150.0 - font::width("HEH", 20.0);
        assert!((146..=150).contains(&right) && (left as f64 - expected).abs() <= 3.0, "{left} {right}");
    }

    #[test]
    fn upward_text_is_centred_next_to_its_baseline() {
        let [left, top, right, bottom] = inked(|d| d.text("HEH", dvec2(60.0, 100.0), 20.0, Align::Upwards, INK));
        assert!((44..=47).contains(&left) && (59..=60).contains(&right), "{left} {right}");
        let middle = 0.5 * (top + bottom + 1) as f64;
        assert!((middle - 100.0).abs() <= 2.0, "{middle}");
    }

    #[test]
    fn shapes_cover_what_they_should_and_are_cut_off_at_the_edges() {
        assert_eq!(inked(|d| d.rectangle(dvec2(20.0, 30.0), dvec2(41.0, 52.0), INK)), [20, 30, 40, 51]);
        assert_eq!(inked(|d| d.rectangle(dvec2(-9.0, -7.0), dvec2(3.0, 900.0), INK)), [0, 0, 2, 199]);
        assert_eq!(inked(|d| d.marker(Marker::Disc, dvec2(50.0, 60.0), 20.0, INK)), [40, 50, 59, 69]);
        assert_eq!(inked(|d| d.dashed(&[dvec2(10.0, 8.5), dvec2(33.0, 8.5)], INK, 1.0, 6.0)), [10, 8, 27, 8]);
        let mut half = Drawing::new((1, 1), PAPER);
        half.rectangle(dvec2(0.0, 0.0), dvec2(0.5, 1.0), [55; 3]);
        assert_eq!(half.bitmap().unwrap().bytes, [155; 3]);
    }

    #[test]
    fn documents_name_every_shape() {
        let mut drawing = Drawing::new((30, 20), PAPER);
        drawing.text("a < b & c", dvec2(1.0, 2.0), 14.0, Align::Upwards, INK);
        drawing.dashed(&[dvec2(0.0, 0.0), dvec2(5.0, 0.25)], INK, 1.25, 5.0);
        let svg = drawing.svg();
        assert!(svg.starts_with("<svg") && svg.contains("width=\"30\" height=\"20\" viewBox=\"0 0 30 20\""));
        assert!(svg.contains("rotate(-90 1.00 2.00)") && svg.contains(">a &lt; b &amp; c</text>"));
        assert!(svg.contains("d=\"M0.00 0.00L5.00 0.25\"") && svg.contains("stroke-dasharray=\"5\""));
    }

    #[test]
    fn documents_hold_their_images() {
        let texts = ["", "f", "fo", "foo", "foob"].map(|text| base64(text.as_bytes()));
        assert_eq!(texts, ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg=="]);
        let mut drawing = Drawing::new((9, 9), PAPER);
        drawing.rectangle(dvec2(3.0, 3.0), dvec2(4.0, 9.0), INK);
        drawing.image(Bitmap::filled(2, 3, [9; 3]), Corner { left: 3, top: 4 });
        let page = drawing.bitmap().unwrap();
        assert_eq!([(3, 4), (4, 6), (4, 7)].map(|(x, y)| page.get(x, y)), [Some(INK), Some([9; 3]), Some(PAPER)]);
        assert!(
            drawing
                .svg()
                .contains("<image x=\"3\" y=\"4\" width=\"2\" height=\"3\" href=\"data:image/png;base64,iVBORw0KGgo")
        );
    }

    #[test]
    fn sizes_out_of_range_are_refused() {
        assert!(Drawing::new((100_000, 10), PAPER).bitmap().is_err());
        assert!(Drawing::new((60_000, 60_000), PAPER).bitmap().is_err());
        assert!(Drawing::new((10, 0), PAPER).bitmap().unwrap().bytes.is_empty());
    }
}
