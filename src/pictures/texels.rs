//! The eight-bit texels of a texture's file: PNG, JPEG, WebP, BMP and TGA, known by their bytes and TGA by its name.
//!
//! Deeper channels are rounded to eight bits; of an animation the first picture counts. The encoded bytes are the
//! caller's to free. Memory is bounded by the file's size: images whose headers give more pixels than their bytes can
//! hold, more than [`MOST_PIXELS`] to a side, or more than [`MOST_BYTES`] are refused before they are decoded. WebP
//! packs what repeats itself into next to no bytes, so an image of [`WEBP_PIXELS`] may be of any size.
//!
//! Not handled: what the codes stand for (sRGB or shares), other formats, colour profiles.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, ImageReader, Limits};

/// Pixels to a side at most.
const MOST_PIXELS: u32 = 1 << 15;
/// Pixels that a file may have for each of its bytes, twice what PNG can pack, and whatever its size.
const PIXELS_A_BYTE: u64 = 2048;
const FREE_PIXELS: u64 = 1 << 16;
const WEBP_PIXELS: u64 = 1 << 24;
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
    /// The bytes are those of no format that is read; what they are.
    #[error("{0}, which is not read: PNG, JPEG, WebP, BMP and TGA are")]
    Format(&'static str),
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
        let format = format(name, bytes).ok_or_else(|| TexelsError::Format(other_format(bytes)))?;
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut limits = Limits::default();
        limits.max_image_width = Some(MOST_PIXELS);
        limits.max_image_height = Some(MOST_PIXELS);
        limits.max_alloc = Some(MOST_BYTES);
        reader.limits(limits);
        let (width, height) = reader.into_dimensions().map_err(broken)?;
        let pixels = u64::from(width) * u64::from(height);
        let free = if format == ImageFormat::WebP { WEBP_PIXELS } else { FREE_PIXELS };
        if pixels * 8 > MOST_BYTES || pixels > free + PIXELS_A_BYTE * bytes.len() as u64 {
            return Err(TexelsError::Broken(format!("{width}x{height} pixels are too many")));
        }
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
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

/// The format of a file by its first bytes, else by its name, if it is read.
fn format(name: &str, bytes: &[u8]) -> Option<ImageFormat> {
    let read = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP, ImageFormat::Bmp];
    let marked = image::guess_format(bytes).ok().filter(|format| read.contains(format));
    let tga = || name.to_ascii_lowercase().ends_with(".tga").then_some(ImageFormat::Tga);
    marked.or_else(tga)
}

/// What a file is that is not read.
fn other_format(bytes: &[u8]) -> &'static str {
    let marks: [(&[u8], &'static str); 6] = [
        (b"\xabKTX 2", "KTX2"),
        (b"\xabKTX 1", "KTX"),
        (b"DDS ", "DDS"),
        (b"8BPS", "a Photoshop file"),
        (b"version https://git-lfs", "a Git LFS pointer"),
        (b"<", "a text (SVG or HTML)"),
    ];
    if let Some((_, what)) = marks.iter().find(|(mark, _)| bytes.starts_with(mark)) {
        return what;
    }
    match image::guess_format(bytes) {
        Ok(ImageFormat::Avif) => "AVIF",
        Ok(ImageFormat::Gif) => "GIF",
        Ok(ImageFormat::Tiff) => "TIFF",
        Ok(ImageFormat::Hdr) => "HDR",
        Ok(ImageFormat::OpenExr) => "EXR",
        _ => "an unknown format",
    }
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
        // These have no grey of their own.
        for format in [ImageFormat::WebP, ImageFormat::Bmp] {
            let texels = Texels::decode("any", &encoded(&grey, format)).unwrap();
            assert_eq!((texels.channels, &texels.codes[..]), (3, &[7, 7, 7, 250, 250, 250][..]), "{format:?}");
            let texels = Texels::decode("any", &encoded(&both, format)).unwrap();
            assert_eq!((texels.channels, &texels.codes[..]), (4, &[1, 2, 3, 4][..]), "{format:?}");
        }
        let flat = DynamicImage::ImageRgb8(image::RgbImage::from_pixel(8, 8, image::Rgb([200, 100, 50])));
        let texels = Texels::decode("any", &encoded(&flat, ImageFormat::Jpeg)).unwrap();
        assert!(texels.codes.chunks(3).all(|p| p[0].abs_diff(200) < 4 && p[2].abs_diff(50) < 4));
    }

    #[test]
    fn what_is_no_image_is_told_from_what_is_broken() {
        for (bytes, what) in [
            (b"no image".as_slice(), "an unknown format"),
            (b"\xabKTX 20\xbb\r\n\x1a\n", "KTX2"),
            (b"\0\0\0\x20ftypavif\0\0\0\0", "AVIF"),
            (b"DDS \x7c\0\0\0", "DDS"),
            (b"GIF89a", "GIF"),
            (b"version https://git-lfs.github.com/spec/v1", "a Git LFS pointer"),
        ] {
            let found = Texels::decode("a.png", bytes);
            assert!(matches!(found, Err(TexelsError::Format(found)) if found == what), "{what}: {:?}", found.err());
        }
        let grey = DynamicImage::ImageLuma8(image::GrayImage::from_raw(2, 1, vec![7, 250]).unwrap());
        let png = encoded(&grey, ImageFormat::Png);
        assert!(matches!(Texels::decode("a.png", &png[..30]), Err(TexelsError::Broken(_))));
        assert!(matches!(Texels::decode("a.tga", b""), Err(TexelsError::Broken(_))));
    }

    #[test]
    fn pixels_are_counted_before_they_are_there() {
        let even = |side: u32| DynamicImage::ImageRgb8(image::RgbImage::from_pixel(side, side, image::Rgb([9, 8, 7])));
        // One colour, 1024 by 1024, as libwebp packs it.
        let webp = [
            b"RIFF".as_slice(),
            &80u32.to_le_bytes(),
            b"WEBPVP8L",
            &67u32.to_le_bytes(),
            b"\x2f\xff\xc3\xff\x00\x07\x50\x84\x26\xf4\xa0\xff\x01\x81\x40\xb2\xbf\xf9\x04\x45\xf4\x3f\xe3\x3f",
            b"\xff\xf9\xcf\x7f\xfe\xf3\x9f\xff\xfc\xe7\x3f\xff\xf9\xcf\x7f\xfe\xf3\x9f\xff\xfc\xe7\x3f\xff\xf9",
            b"\xcf\x7f\xfe\xf3\x9f\xff\xfc\xe7\x3f\xff\xf9\xcf\x7f\xfe\xf3\x9f\xff\xfc\xdf\x00",
        ]
        .concat();
        assert!(FREE_PIXELS + PIXELS_A_BYTE * (webp.len() as u64) < 1024 * 1024);
        let texels = Texels::decode("a", &webp).unwrap();
        assert_eq!((texels.width, texels.channels, &texels.codes[..3]), (1024, 3, &[9, 8, 7][..]));
        let mut bmp = encoded(&even(2), ImageFormat::Bmp);
        bmp[18..22].copy_from_slice(&1024u32.to_le_bytes());
        bmp[22..26].copy_from_slice(&1024u32.to_le_bytes());
        assert!(matches!(Texels::decode("a", &bmp), Err(TexelsError::Broken(what)) if what.contains("too many")));
        // 14 bits of width less one, and as many of height: 8192 by 8192.
        let sizes = 21..25;
        let webp = [&webp[..sizes.start], &[0xff, 0xdf, 0xff, 0x07], &webp[sizes.end..]].concat();
        let error = Texels::decode("a", &webp).err().unwrap().to_string();
        assert!(error.contains("too many"), "{error}");
    }
}
