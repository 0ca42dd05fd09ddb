//! Picture files: PNG for the eye, OpenEXR for numbers, chosen by the extension.
//!
//! * `.png`: eight-bit sRGB after an exposure and a clamp ([`Bitmap::from_picture`]). Lossy.
//! * `.exr`: linear 32-bit floats in channels R, G, B. Exact, NaN and infinities included; no exposure. Layers are in
//!   [`layers`](crate::pictures::layers).
//!
//! Files are encoded in memory and written whole or not at all. The bytes depend on the picture alone. Read back:
//! PNG (by the inverse sRGB curve), EXR, and Radiance HDR. Not handled: alpha (dropped), embedded colour profiles,
//! EXR without R, G and B, deep or DWA-compressed EXR, layers other than the picture.

use std::ffi::OsStr;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use ::image::codecs::openexr::OpenExrEncoder;
use ::image::codecs::png::PngEncoder;
use ::image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageFormat, ImageReader};

use crate::light::Rgb;
use crate::pictures::atomic::{WriteError, write_whole};
use crate::pictures::picture::{Picture, Size};
use crate::pictures::srgb::{Bitmap, Exposure, decode_srgb};
use crate::pictures::texels::Texels;

/// What can go wrong with a picture file.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum ImageError {
    /// The extension is of no format that this program reads or writes.
    #[error("{}: {} is not a picture format known here", path.display(), named(extension))]
    #[diagnostic(
        code(halflight::image::extension),
        help("pictures are written as .png or .exr and read from .png, .exr or .hdr")
    )]
    Extension {
        /// The file.
        path: PathBuf,
        /// Its extension, empty where it has none.
        extension: String,
    },
    /// The file is missing or cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    #[diagnostic(code(halflight::image::read), help("check the file's name and permissions"))]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The file's content is not what its extension promises.
    #[error("{} does not hold a readable {format} picture: {reason}", path.display())]
    #[diagnostic(
        code(halflight::image::decode),
        help(
            "the file may be cut short, or be of another format than its extension says; EXR needs channels R, G and B"
        )
    )]
    Decode {
        /// The file.
        path: PathBuf,
        /// `PNG`, `OpenEXR` or `Radiance HDR`.
        format: &'static str,
        /// The decoder's error.
        reason: String,
    },
    /// The picture cannot be encoded.
    #[error("cannot encode a picture of {width} x {height} pixels: {reason}")]
    #[diagnostic(
        code(halflight::image::encode),
        help("a picture needs at least one pixel and at most 2^32 - 1 a side")
    )]
    Encode {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// The encoder's error.
        reason: String,
    },
    /// The encoded file cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

fn named(extension: &str) -> String {
    match extension {
        "" => "a name without extension".into(),
        other => format!("\".{other}\""),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Png,
    Exr,
    Hdr,
}

impl Format {
    fn of(path: &Path) -> Result<Format, ImageError> {
        let extension = path.extension().unwrap_or(OsStr::new("")).to_string_lossy();
        match extension.to_ascii_lowercase().as_str() {
            "png" => Ok(Format::Png),
            "exr" => Ok(Format::Exr),
            "hdr" => Ok(Format::Hdr),
            _ => Err(unknown(path)),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Format::Png => "PNG",
            Format::Exr => "OpenEXR",
            Format::Hdr => "Radiance HDR",
        }
    }

    fn codec(self) -> ImageFormat {
        match self {
            Format::Png => ImageFormat::Png,
            Format::Exr => ImageFormat::OpenExr,
            Format::Hdr => ImageFormat::Hdr,
        }
    }
}

fn unknown(path: &Path) -> ImageError {
    let extension = path.extension().unwrap_or(OsStr::new(""));
    ImageError::Extension { path: path.to_path_buf(), extension: extension.to_string_lossy().into_owned() }
}

/// Writes a picture by its extension: `.png` at the exposure, `.exr` as it is.
///
/// # Errors
/// Another extension, a picture without pixels, or a destination that cannot be written. Nothing is left behind.
pub fn write_picture(path: impl AsRef<Path>, picture: &Picture, exposure: Exposure) -> Result<(), ImageError> {
    let path = path.as_ref();
    let bytes = match Format::of(path)? {
        Format::Png => encode_png(&Bitmap::from_picture(picture, exposure))?,
        Format::Exr => encode_exr(picture)?,
        Format::Hdr => return Err(unknown(path)),
    };
    Ok(write_whole(path, &bytes)?)
}

/// Checks that [`write_picture`] takes a path's extension, before hours of work.
///
/// # Errors
/// Another extension than `.png` and `.exr`.
pub fn check_extension(path: &Path) -> Result<(), ImageError> {
    match Format::of(path)? {
        Format::Png | Format::Exr => Ok(()),
        Format::Hdr => Err(unknown(path)),
    }
}

/// Whether a file's name is one of OpenEXR.
pub fn is_exr(path: &Path) -> bool {
    matches!(Format::of(path), Ok(Format::Exr))
}

/// Writes finished sRGB codes as `.png`.
///
/// # Errors
/// Another extension, no pixels, or a destination that cannot be written. Nothing is left behind.
pub fn write_bitmap(path: impl AsRef<Path>, bitmap: &Bitmap) -> Result<(), ImageError> {
    let path = path.as_ref();
    match Format::of(path)? {
        Format::Png => Ok(write_whole(path, &encode_png(bitmap)?)?),
        _ => Err(unknown(path)),
    }
}

/// The bytes of a PNG file, eight bits a channel.
///
/// # Errors
/// [`ImageError::Encode`] where the bitmap has no pixels.
pub fn encode_png(bitmap: &Bitmap) -> Result<Vec<u8>, ImageError> {
    png((bitmap.width, bitmap.height).into(), &bitmap.bytes, ExtendedColorType::Rgb8)
}

/// The bytes of a PNG file of texels, as they are coded.
///
/// # Errors
/// [`ImageError::Encode`] where there are none.
pub fn encode_texels(texels: &Texels) -> Result<Vec<u8>, ImageError> {
    let colour = match texels.channels {
        1 => ExtendedColorType::L8,
        2 => ExtendedColorType::La8,
        3 => ExtendedColorType::Rgb8,
        _ => ExtendedColorType::Rgba8,
    };
    png((texels.width, texels.height).into(), &texels.codes, colour)
}

fn png(size: Size, bytes: &[u8], colour: ExtendedColorType) -> Result<Vec<u8>, ImageError> {
    let mut file = Vec::new();
    encode(PngEncoder::new(&mut file), size, bytes, colour)?;
    Ok(file)
}

fn encode_exr(picture: &Picture) -> Result<Vec<u8>, ImageError> {
    let channels = picture.pixels.iter().flat_map(|p| p.to_array());
    let bytes: Vec<u8> = channels.flat_map(f32::to_ne_bytes).collect();
    let mut file = Cursor::new(Vec::new());
    let encoder = OpenExrEncoder::new(&mut file);
    encode(encoder, picture.size(), &bytes, ExtendedColorType::Rgb32F)?;
    Ok(file.into_inner())
}

/// Runs an encoder, which would panic on a size that does not fit its data.
fn encode(
    encoder: impl ImageEncoder,
    Size { width, height }: Size,
    bytes: &[u8],
    colour: ExtendedColorType,
) -> Result<(), ImageError> {
    let refused = |reason: String| ImageError::Encode { width, height, reason };
    let (Ok(wide), Ok(high)) = (u32::try_from(width), u32::try_from(height)) else {
        return Err(refused("too large for the format".into()));
    };
    if wide == 0 || high == 0 {
        return Err(refused("it has no pixels".into()));
    }
    let channels = usize::from(colour.bits_per_pixel() / 8);
    let expected = width.saturating_mul(height).saturating_mul(channels);
    if expected != bytes.len() {
        return Err(refused("its size does not fit its pixels".into()));
    }
    encoder.write_image(bytes, wide, high, colour).map_err(|error| refused(error.to_string()))
}

/// Reads a picture by its extension: `.exr` and `.hdr` as linear values, `.png` by the inverse sRGB curve.
///
/// NaN and infinities in the file are kept; the metrics report them.
///
/// # Errors
/// Another extension, a file that is missing, or content that is not such a picture.
pub fn read_picture(path: impl AsRef<Path>) -> Result<Picture, ImageError> {
    let path = path.as_ref();
    let format = Format::of(path)?;
    let bytes = std::fs::read(path).map_err(|source| ImageError::Read { path: path.to_path_buf(), source })?;
    let decoded = ImageReader::with_format(Cursor::new(bytes), format.codec()).decode();
    match decoded {
        Ok(image) if format == Format::Png => Ok(linear(image, decode_srgb)),
        Ok(image) => Ok(linear(image, |value| value)),
        Err(error) => {
            Err(ImageError::Decode { path: path.to_path_buf(), format: format.name(), reason: error.to_string() })
        }
    }
}

fn linear(image: DynamicImage, curve: impl Fn(f32) -> f32) -> Picture {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let pixels = match image {
        DynamicImage::ImageRgba32F(image) => colours(image.as_raw(), 4, curve),
        other => colours(other.into_rgb32f().as_raw(), 3, curve),
    };
    Picture { width, height, pixels }
}

/// The first three of every `channels` values.
fn colours(values: &[f32], channels: usize, curve: impl Fn(f32) -> f32) -> Vec<Rgb> {
    let pixels = values.chunks_exact(channels);
    pixels.map(|p| Rgb::new(curve(p[0]), curve(p[1]), curve(p[2]))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn awkward() -> Picture {
        let values = [0.0, -1.5, 1e-42, 0.1, f32::MAX, f32::INFINITY, f32::NAN];
        Picture::from_fn(7, 5, |x, y| Rgb::new(values[x], 0.3 * y as f32, -values[6 - x]))
    }

    fn bits(picture: &Picture) -> Vec<[u32; 3]> {
        let bits = |p: &Rgb| p.to_array().map(f32::to_bits);
        picture.pixels.iter().map(bits).collect()
    }

    #[test]
    fn exr_gives_back_every_bit() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("awkward.EXR");
        write_picture(&path, &awkward(), Exposure { stops: 3.0 }).unwrap();
        let back = read_picture(&path).unwrap();
        assert_eq!((back.width, back.height), (7, 5));
        assert_eq!(bits(&back), bits(&awkward()));
    }

    #[test]
    fn png_comes_back_within_half_a_code() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("ramp.png");
        let ramp = Picture::from_fn(100, 1, |x, _| Rgb::splat(x as f32 / 99.0));
        write_picture(&path, &ramp, Exposure::default()).unwrap();
        let back = read_picture(&path).unwrap();
        for (a, b) in ramp.pixels.iter().zip(&back.pixels) {
            let apart = crate::pictures::srgb::encode_srgb(a.x) - crate::pictures::srgb::encode_srgb(b.x);
            // Half a code, and the rounding of the curve in f32 (its values are below 1).
            assert!(255.0 * apart.abs() <= 0.5 + 255.0 * 8.0 * f32::EPSILON);
        }
    }

    #[test]
    fn a_png_holds_the_codes_of_the_bitmap() {
        let bitmap = Bitmap::from_picture(&awkward(), Exposure { stops: -1.0 });
        let file = encode_png(&bitmap).unwrap();
        let image = ::image::load_from_memory(&file).unwrap();
        assert_eq!(image.into_rgb8().into_raw(), bitmap.bytes);
        assert_eq!(file, encode_png(&bitmap).unwrap());
    }

    #[test]
    fn other_extensions_are_named_and_nothing_is_written() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["a.jpeg", "a", "a.hdr"] {
            let path = directory.path().join(name);
            let error = write_picture(&path, &awkward(), Exposure::default()).unwrap_err();
            assert!(matches!(error, ImageError::Extension { .. }), "{error}");
            assert!(!path.exists());
        }
        let error = read_picture("picture.tiff").unwrap_err();
        assert!(error.to_string().contains("\".tiff\""));
    }

    #[test]
    fn missing_and_broken_files_say_so() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("p.exr");
        let missing = read_picture(&path).unwrap_err();
        assert!(matches!(missing, ImageError::Read { .. }), "{missing}");
        write_picture(&path, &awkward(), Exposure::default()).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for bytes in [&b"not a picture"[..], &whole[..whole.len() / 2], &[]] {
            std::fs::write(&path, bytes).unwrap();
            let broken = read_picture(&path).unwrap_err();
            assert!(matches!(broken, ImageError::Decode { .. }), "{broken}");
        }
    }

    #[test]
    fn a_picture_without_pixels_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["empty.png", "empty.exr"] {
            let path = directory.path().join(name);
            let error = write_picture(&path, &Picture::new(0, 4), Exposure::default()).unwrap_err();
            assert!(matches!(error, ImageError::Encode { .. }), "{error}");
            assert!(!path.exists());
        }
    }
}
