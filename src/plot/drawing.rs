//! The two things a drawing becomes: a bitmap, or an SVG document.
//!
//! Both are drawn finer than shown (see [`Canvas`]): the bitmap is averaged down, the document carries a view box.

use plotters::backend::{BitMapBackend, DrawingBackend, SVGBackend};

use crate::pictures::Bitmap;
use crate::plot::canvas::{Canvas, FINENESS, TextBy};

/// A backend refused to draw.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("the chart cannot be drawn: {reason}")]
#[diagnostic(code(halflight::chart), help("a drawing has 1 to 65,536 pixels a side and at most 16 million in all"))]
pub struct DrawError {
    /// What the backend said.
    pub reason: String,
}

impl DrawError {
    /// The error that a backend's error becomes; the backends' own types differ.
    pub fn new(error: impl std::fmt::Display) -> Self {
        DrawError { reason: error.to_string() }
    }
}

/// Draws into a bitmap of that size.
///
/// # Errors
/// [`DrawError`] where the size is out of range or a backend fails.
pub fn draw_bitmap(
    (width, height): (u32, u32),
    draw: impl FnOnce(&mut Canvas<BitMapBackend>) -> Result<(), DrawError>,
) -> Result<Bitmap, DrawError> {
    let (wide, high) = fine_size(width, height)?;
    let mut fine = Bitmap::filled(wide as usize, high as usize, [255; 3]);
    let mut backend = BitMapBackend::with_buffer(&mut fine.bytes, (wide, high));
    draw(&mut Canvas::new(&mut backend, TextBy::Glyphs))?;
    drop(backend);
    Ok(fine.reduced(FINENESS as usize))
}

/// Draws an SVG document that shows itself at that size.
///
/// # Errors
/// [`DrawError`] where the size is out of range or a backend fails.
pub fn draw_svg(
    (width, height): (u32, u32),
    draw: impl FnOnce(&mut Canvas<SVGBackend>) -> Result<(), DrawError>,
) -> Result<String, DrawError> {
    let (wide, high) = fine_size(width, height)?;
    let mut document = String::new();
    let mut backend = SVGBackend::with_string(&mut document, (wide, high));
    draw(&mut Canvas::new(&mut backend, TextBy::Browser))?;
    backend.present().map_err(DrawError::new)?;
    drop(backend);
    let drawn = format!("width=\"{wide}\" height=\"{high}\"");
    let shown = format!("width=\"{width}\" height=\"{height}\"");
    Ok(document.replacen(&drawn, &shown, 1))
}

fn fine_size(width: u32, height: u32) -> Result<(u32, u32), DrawError> {
    let sides = 1..=1 << 16;
    let area = u64::from(width) * u64::from(height);
    if !sides.contains(&width) || !sides.contains(&height) || area > 1 << 24 {
        let reason = format!("its size is {width} x {height}");
        return Err(DrawError { reason });
    }
    Ok((width * FINENESS, height * FINENESS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_out_of_range_are_refused() {
        assert!(draw_bitmap((0, 10), |_| Ok(())).is_err());
        assert!(draw_svg((100_000, 10), |_| Ok(())).is_err());
        let svg = draw_svg((30, 20), |_| Ok(())).unwrap();
        assert!(svg.contains("width=\"30\" height=\"20\" viewBox=\"0 0 120 80\""));
    }
}
