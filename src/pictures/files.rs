//! Picture files: PNG for the eye, OpenEXR for numbers, chosen by the extension.
//!
//! * `.png`: eight-bit sRGB after an exposure and a clamp ([`Bitmap::from_picture`]). Lossy.
//! * `.exr`: linear 32-bit floats in channels R, G, B. Exact, NaN and infinities included; no exposure. Channels of
//!   layers have their name before them (`lamp.desk.R`), which is how OpenEXR distinguishes layers of one part, so that
//!   every reader finds the picture.
//!
//! Files are encoded in memory and written whole or not at all. The bytes depend on the picture alone. Read back:
//! PNG (by the inverse sRGB curve), EXR, and Radiance HDR. Not handled: alpha (dropped), embedded colour profiles,
//! EXR without R, G and B, deep or DWA-compressed EXR, layers other than the picture.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use ::image::codecs::openexr::OpenExrEncoder;
use ::image::codecs::png::PngEncoder;
use ::image::{DynamicImage, ExtendedColorType, ImageEncoder, ImageFormat, ImageReader};
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use exr::math::Vec2;
use exr::meta::header::LayerAttributes;
use exr::prelude::{ReadChannels, ReadLayers, WritableImage};

use crate::light::Rgb;
use crate::pictures::atomic::{WriteError, write_whole};
use crate::pictures::names::{spaced, unlike};
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

/// A layer of a picture file.
#[derive(Clone, Debug)]
pub struct NamedPicture<P> {
    /// What stands before the last dot in the names of its channels.
    pub name: String,
    /// Its pixels.
    pub picture: P,
}

/// Writes a picture with layers: in one EXR file, or each in a file of its own beside it; returns the files. An EXR file
/// has the picture in its channels R, G and B and each layer under its name, `lamp.desk.R` or `bounce.2.R`.
///
/// # Errors
/// As [`write_picture`].
pub fn write_layered(
    path: &Path,
    picture: &Picture,
    layers: &[NamedPicture<&Picture>],
    exposure: Exposure,
) -> Result<Vec<PathBuf>, ImageError> {
    let mut files = vec![path.to_path_buf()];
    if is_exr(path) && !layers.is_empty() {
        write_layers(path, picture, layers)?;
        return Ok(files);
    }
    write_picture(path, picture, exposure)?;
    for layer in layers {
        let own = layer_path(path, &layer.name);
        write_picture(&own, layer.picture, exposure)?;
        files.push(own);
    }
    Ok(files)
}

/// The place of a layer's own file beside the picture's; what may not be in a file's name is replaced.
fn layer_path(path: &Path, layer: &str) -> PathBuf {
    let [stem, extension] = [path.file_stem(), path.extension()].map(|s| s.unwrap_or_default().to_string_lossy());
    let safe = |c: char| if c.is_alphanumeric() || "-_.+".contains(c) { c } else { '-' };
    let layer: String = layer.chars().map(safe).collect();
    path.with_file_name(format!("{stem}-{layer}.{extension}"))
}

/// Writes a picture with others of the same size as its layers, an `.exr` file. Names keep what is printable of ASCII;
/// of two that become the same the second has a number.
///
/// # Errors
/// Pictures without pixels or of two sizes, or a destination that cannot be written. Nothing is left behind.
fn write_layers(
    path: impl AsRef<Path>,
    picture: &Picture,
    layers: &[NamedPicture<&Picture>],
) -> Result<(), ImageError> {
    let Size { width, height } = picture.size();
    let refused = |reason: &str| ImageError::Encode { width, height, reason: reason.into() };
    if width == 0 || height == 0 {
        return Err(refused("it has no pixels"));
    }
    if layers.iter().any(|layer| layer.picture.size() != picture.size()) {
        return Err(refused("a layer is of another size"));
    }
    let channel = |name: String, of: &Picture, c: usize| {
        let samples = of.pixels.iter().map(|p| p[c]).collect();
        AnyChannel::new(name.as_str(), FlatSamples::F32(samples))
    };
    let names = unlike(layers.iter().map(|layer| printable(&layer.name)), spaced);
    let colours = ["R", "G", "B"].into_iter().enumerate();
    let all = colours.flat_map(|(c, colour)| {
        let own = channel(colour.into(), picture, c);
        let layer =
            |(name, layer): (&String, &NamedPicture<&Picture>)| channel(format!("{name}.{colour}"), layer.picture, c);
        std::iter::once(own).chain(names.iter().zip(layers).map(layer)).collect::<Vec<_>>()
    });
    let layer = Layer::new(
        (width, height),
        LayerAttributes::default(),
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(all.collect()),
    );
    let mut file = Cursor::new(Vec::new());
    let image = Image::from_layer(layer);
    let writer = image.write().non_parallel();
    writer.to_buffered(&mut file).map_err(|error| refused(&error.to_string()))?;
    Ok(write_whole(path.as_ref(), &file.into_inner())?)
}

/// Characters of a layer's name at most, so that a channel's fits the format.
const NAME: usize = 200;

/// A name of printable ASCII.
fn printable(name: &str) -> String {
    name.chars().take(NAME).map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '_' }).collect()
}

/// Reads the layers of an `.exr` file: its picture, whose name is empty, and all whose channels are named R, G and B,
/// in the order of their names.
///
/// # Errors
/// A file that is missing, or content that is no such picture.
pub fn read_layers(path: impl AsRef<Path>) -> Result<Vec<NamedPicture<Picture>>, ImageError> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(|source| ImageError::Read { path: path.to_path_buf(), source })?;
    let broken = |reason: String| ImageError::Decode { path: path.to_path_buf(), format: Format::Exr.name(), reason };
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let image = reader.all_attributes().non_parallel().from_buffered(Cursor::new(bytes));
    let image = image.map_err(|error| broken(error.to_string()))?;
    let Vec2(width, height) = image.layer_data.size;
    let mut planes: BTreeMap<String, [Option<Vec<f32>>; 3]> = BTreeMap::new();
    for channel in image.layer_data.channel_data.list {
        let name = channel.name.to_string();
        let (layer, colour) = name.rsplit_once('.').unwrap_or(("", &name));
        if let Some(c) = ["R", "G", "B"].iter().position(|own| *own == colour) {
            planes.entry(layer.to_owned()).or_default()[c] = Some(channel.sample_data.values_as_f32().collect());
        }
    }
    let picture = |[r, g, b]: [Option<Vec<f32>>; 3]| {
        let (r, g, b) = (r?, g?, b?);
        let pixels = (0..width * height).map(|k| Some(Rgb::new(*r.get(k)?, *g.get(k)?, *b.get(k)?)));
        Some(Picture { width, height, pixels: pixels.collect::<Option<_>>()? })
    };
    let layers =
        planes.into_iter().filter_map(|(name, planes)| picture(planes).map(|picture| NamedPicture { name, picture }));
    Ok(layers.collect())
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

    #[test]
    fn readers_of_pictures_find_the_picture_and_layers_come_back() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a.exr");
        let picture = awkward();
        let halves = picture.scaled(0.5);
        let layer = |name: &str| NamedPicture { name: name.into(), picture: &halves };
        write_layers(&path, &picture, &[layer("lamp.désk"), layer("bounce.2"), layer("lamp.dask")]).unwrap();
        assert_eq!(bits(&read_picture(&path).unwrap()), bits(&picture));
        let back = read_layers(&path).unwrap();
        let names: Vec<&str> = back.iter().map(|layer| layer.name.as_str()).collect();
        assert_eq!(names, ["", "bounce.2", "lamp.d_sk", "lamp.dask"]);
        assert_eq!(bits(&back[0].picture), bits(&picture));
        assert!(back[1..].iter().all(|layer| bits(&layer.picture) == bits(&halves)));
        // Whatever is damaged is refused or read, without a panic.
        let whole = std::fs::read(&path).unwrap();
        for k in (0..whole.len().min(1200)).step_by(7) {
            let mut bytes = whole.clone();
            bytes[k] ^= 0x55;
            std::fs::write(&path, &bytes).unwrap();
            let _ = read_layers(&path);
            std::fs::write(&path, &whole[..k]).unwrap();
            assert!(read_layers(&path).is_err());
        }
    }

    #[test]
    fn two_sizes_are_refused_and_leave_nothing() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a.exr");
        let layer = NamedPicture { name: "a".into(), picture: &Picture::new(2, 3) };
        let found = write_layers(&path, &Picture::new(2, 2), &[layer]);
        assert!(matches!(found, Err(ImageError::Encode { .. })) && !path.exists());
    }
}
