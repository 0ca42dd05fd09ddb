//! The eight-bit texels of a texture's file: PNG, JPEG and TGA, known by their bytes and TGA by its name.
//!
//! Deeper channels are rounded to eight bits. The encoded bytes are the caller's to free. Memory is bounded by the
//! file's size: images whose headers give more pixels than their bytes can hold, more than [`MOST_PIXELS`] to a side,
//! or more than [`MOST_BYTES`] are refused before they are decoded.
//!
//! Not handled: what the codes stand for (sRGB or shares), other formats, colour profiles.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, ImageReader, Limits};

/// Pixels to a side at most.
const MOST_PIXELS: u32 = 1 << 15;
/// Pixels that a file may have for each of its bytes, twice what PNG can pack, and whatever its size.
const PIXELS_A_BYTE: u64 = 2048;
const FREE_PIXELS: u64 = 1 << 16;
/// Bytes that decoding may take at most.
const MOST_BYTES: u64 = 1 << 29;

/// An image as it was stored, row by row from the top left.
#[derive(Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Texels {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// 1 for grey, 2 for grey and alpha, 3 for RGB, 4 for RGB and alpha.
    pub channels: usize,
    /// `channels * width * height` codes.
    pub codes: Vec<u8>,
}

/// Why an image gives no texels.
#[derive(Debug, thiserror::Error)]
pub enum TexelsError {
    /// The bytes are those of no format that is read.
    #[error("neither PNG, JPEG nor TGA")]
    Format,
    /// The bytes break the rules of their format, or would take too much memory.
    #[error("{0}")]
    Broken(String),
}

impl Texels {
    /// Decodes a file; its name identifies TGA, which has no mark of its own.
    ///
    /// # Errors
    /// [`TexelsError`]; an image without pixels is broken.
    pub fn decode(name: &str, bytes: &[u8]) -> Result<Texels, TexelsError> {
        let broken = |error: image::ImageError| TexelsError::Broken(error.to_string().chars().take(200).collect());
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format(name, bytes).ok_or(TexelsError::Format)?);
        let mut limits = Limits::default();
        limits.max_image_width = Some(MOST_PIXELS);
        limits.max_image_height = Some(MOST_PIXELS);
        limits.max_alloc = Some(MOST_BYTES);
        reader.limits(limits);
        let (width, height) = reader.into_dimensions().map_err(broken)?;
        let pixels = u64::from(width) * u64::from(height);
        if pixels * 8 > MOST_BYTES || pixels > FREE_PIXELS + PIXELS_A_BYTE * bytes.len() as u64 {
            return Err(TexelsError::Broken(format!("{width}x{height} pixels are too many")));
        }
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format(name, bytes).ok_or(TexelsError::Format)?);
        reader.no_limits();
        let texels = Texels::of(reader.decode().map_err(broken)?);
        let whole = texels.width > 0 && texels.height > 0;
        whole.then_some(texels).ok_or_else(|| TexelsError::Broken("it has no pixels".to_owned()))
    }

    fn of(image: DynamicImage) -> Texels {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let colour = image.color();
        let (channels, codes) = match (colour.has_color(), colour.has_alpha()) {
            (false, false) => (1, image.into_luma8().into_raw()),
            (false, true) => (2, image.into_luma_alpha8().into_raw()),
            (true, false) => (3, image.into_rgb8().into_raw()),
            (true, true) => (4, image.into_rgba8().into_raw()),
        };
        Texels { width, height, channels, codes }
    }
}

/// The format of a file by its first bytes, else by its name.
fn format(name: &str, bytes: &[u8]) -> Option<ImageFormat> {
    let marked = image::guess_format(bytes).ok().filter(|f| matches!(f, ImageFormat::Png | ImageFormat::Jpeg));
    let tga = || name.to_ascii_lowercase().ends_with(".tga").then_some(ImageFormat::Tga);
    marked.or_else(tga)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn grey_and_colour_keep_their_channels() {
        let grey = DynamicImage::ImageLuma8(image::GrayImage::from_raw(2, 1, vec![7, 250]).unwrap());
        let both = DynamicImage::ImageRgba8(image::RgbaImage::from_raw(1, 1, vec![1, 2, 3, 4]).unwrap());
        for format in [ImageFormat::Png, ImageFormat::Tga] {
            let name = format!("a.{}", format.extensions_str()[0]);
            let texels = Texels::decode(&name, &encoded(&grey, format)).unwrap();
            assert_eq!((texels.width, texels.height, texels.channels, &texels.codes[..]), (2, 1, 1, &[7, 250][..]));
            let texels = Texels::decode(&name, &encoded(&both, format)).unwrap();
            assert_eq!((texels.channels, &texels.codes[..]), (4, &[1, 2, 3, 4][..]));
        }
        let flat = DynamicImage::ImageRgb8(image::RgbImage::from_pixel(8, 8, image::Rgb([200, 100, 50])));
        let texels = Texels::decode("any", &encoded(&flat, ImageFormat::Jpeg)).unwrap();
        assert!(texels.codes.chunks(3).all(|p| p[0].abs_diff(200) < 4 && p[2].abs_diff(50) < 4));
    }

    #[test]
    fn what_is_no_image_is_told_from_what_is_broken() {
        assert!(matches!(Texels::decode("a.png", b"BM no"), Err(TexelsError::Format)));
        let grey = DynamicImage::ImageLuma8(image::GrayImage::from_raw(2, 1, vec![7, 250]).unwrap());
        let png = encoded(&grey, ImageFormat::Png);
        assert!(matches!(Texels::decode("a.png", &png[..30]), Err(TexelsError::Broken(_))));
        assert!(matches!(Texels::decode("a.tga", b""), Err(TexelsError::Broken(_))));
    }
}
