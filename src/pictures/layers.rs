//! Layers of picture files: in one EXR file, or in files of their own.
//!
//! Channels of a layer have its name before them (`lamp.desk.R`), which is how OpenEXR distinguishes layers of one
//! part, so that every reader finds the picture in R, G and B. A channel's name has 255 bytes at most, all of them
//! ASCII here, and no two are the same. So a layer's name may have to be cut or numbered, that of light last; whole
//! names and what the layers show are in the attribute [`NAMES`]. A file without it, from another program, has layers
//! by the names of its channels, and what is named as the standard error of another layer is that.
//!
//! Not handled: layers in parts of their own, names that differ in case alone; reading layers of other channels than R,
//! G and B.

use std::collections::{BTreeMap, HashSet};
use std::io::Cursor;
use std::path::{Path, PathBuf};

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::LayerAttributes;
use exr::prelude::{ReadChannels, ReadLayers, WritableImage};

use crate::light::Rgb;
use crate::pictures::atomic::write_whole;
use crate::pictures::files::{ImageError, is_exr, write_picture};
use crate::pictures::picture::{Picture, Size};
use crate::pictures::srgb::Exposure;

/// A layer of a picture file.
#[derive(Clone, Debug)]
pub struct NamedPicture<P> {
    /// What it is of: `lamp.desk`, `bounce.2`; empty for the picture itself.
    pub name: String,
    /// What of that it shows.
    pub shows: Shows,
    /// Its pixels.
    pub picture: P,
}

/// What the numbers of a layer are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shows {
    /// Radiance.
    Light,
    /// The standard error of radiance.
    StandardError,
    /// Reflectance.
    Reflectance,
    /// A direction, whose channels are X, Y and Z.
    Direction,
    /// A distance, in the one channel Z: the picture's red.
    Distance,
}

impl<P> NamedPicture<P> {
    /// The same with a picture that is lent.
    pub fn as_ref(&self) -> NamedPicture<&P> {
        NamedPicture { name: self.name.clone(), shows: self.shows, picture: &self.picture }
    }
}

/// What names the standard error of a picture or a layer.
const STANDARD_ERROR: &str = "standard error";
/// The attribute of an EXR file that says of each layer what it shows, what its channels are called by, and its name.
const NAMES: &str = "halflightLayers";
/// Bytes of a channel's name at most, and those that need the file's flag for long names.
const LONGEST: usize = 255;
const LONG: usize = 32;
/// Bytes of a file's name at most.
const LONGEST_FILE: usize = 255;

impl Shows {
    /// All of them, those whose names give way last.
    const ALL: [Shows; 5] = [Shows::Light, Shows::Reflectance, Shows::Direction, Shows::Distance, Shows::StandardError];

    fn word(self) -> &'static str {
        match self {
            Shows::Light => "light",
            Shows::StandardError => STANDARD_ERROR,
            Shows::Reflectance => "reflectance",
            Shows::Direction => "direction",
            Shows::Distance => "distance",
        }
    }

    /// The channels of an EXR file that hold it.
    fn channels(self) -> &'static [&'static str] {
        match self {
            Shows::Light | Shows::StandardError | Shows::Reflectance => &["R", "G", "B"],
            Shows::Direction => &["X", "Y", "Z"],
            Shows::Distance => &["Z"],
        }
    }

    /// What follows the name of what it is of.
    fn ending(self, name: &str) -> &'static str {
        match (self, name) {
            (Shows::StandardError, "") => "standard error",
            (Shows::StandardError, _) => ".standard error",
            _ => "",
        }
    }
}

/// Writes a picture with layers: in one EXR file, or each in a file of its own beside it; returns the files. An EXR
/// file has the picture in its channels R, G and B and each layer under its name, `lamp.desk.R` or `bounce.2.R`.
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
    for (own, layer) in layer_paths(path, layers).into_iter().zip(layers) {
        write_picture(&own, layer.picture, exposure)?;
        files.push(own);
    }
    Ok(files)
}

/// The places of layers' own files beside the picture's; what may not be in a file's name is replaced.
fn layer_paths<P>(path: &Path, layers: &[NamedPicture<P>]) -> Vec<PathBuf> {
    let [stem, extension] = [path.file_stem(), path.extension()].map(|s| s.unwrap_or_default().to_string_lossy());
    let safe = |c: char| if c.is_alphanumeric() || "-_.+".contains(c) { c } else { '-' };
    let room = LONGEST_FILE.saturating_sub(stem.len() + extension.len() + 2);
    unlike(layers, room, safe).iter().map(|name| path.with_file_name(format!("{stem}-{name}.{extension}"))).collect()
}

/// Names of layers, none twice, in so many bytes at most and with what takes the place of each character. Light has its
/// own name where it may, so errors give way.
fn unlike<P>(layers: &[NamedPicture<P>], most: usize, safe: impl Fn(char) -> char) -> Vec<String> {
    let safe = |text: &str| text.chars().map(&safe).collect::<String>();
    let mut names = vec![String::new(); layers.len()];
    let mut taken = HashSet::new();
    for shows in Shows::ALL {
        for (k, layer) in layers.iter().enumerate().filter(|(_, layer)| layer.shows == shows) {
            let (stem, ending) = (safe(&layer.name), safe(shows.ending(&layer.name)));
            let numbers = std::iter::once(String::new()).chain((2..).map(|k| safe(&format!(" {k}"))));
            let mut tried = numbers.map(|number| format!("{}{number}{ending}", cut(&stem, most, &[&number, &ending])));
            names[k] = tried.find(|name| !taken.contains(name)).unwrap_or_default();
            taken.insert(names[k].clone());
        }
    }
    names
}

/// So much of a name that what follows it fits in so many bytes.
fn cut<'a>(name: &'a str, most: usize, rest: &[&str]) -> &'a str {
    let room = most.saturating_sub(rest.iter().map(|text| text.len()).sum());
    let end = (0..=room.min(name.len())).rev().find(|&end| name.is_char_boundary(end));
    &name[..end.unwrap_or(0)]
}

/// Writes a picture with others of the same size as its layers, an `.exr` file.
///
/// # Errors
/// Pictures without pixels or of two sizes, or a destination that cannot be written. Nothing is left behind.
fn write_layers(path: &Path, picture: &Picture, layers: &[NamedPicture<&Picture>]) -> Result<(), ImageError> {
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
    // A dot and the colour follow.
    let names = unlike(layers, LONGEST - 2, |c| if c == ' ' || c.is_ascii_graphic() { c } else { '_' });
    let own = Shows::Light.channels().iter().enumerate().map(|(c, colour)| channel((*colour).into(), picture, c));
    let others = names.iter().zip(layers).flat_map(|(name, layer)| {
        let channels = layer.shows.channels().iter().enumerate();
        channels.map(move |(c, own)| channel(format!("{name}.{own}"), layer.picture, c))
    });
    let (all, size) = (AnyChannels::sort(own.chain(others).collect()), (width, height));
    let mut layer = Layer::new(size, LayerAttributes::default(), Encoding::FAST_LOSSLESS, all);
    layer.attributes.other.insert(Text::new_or_panic(NAMES), described(layers, &names));
    let mut file = Cursor::new(Vec::new());
    let image = Image::from_layer(layer);
    let writer = image.write().non_parallel();
    writer.to_buffered(&mut file).map_err(|error| refused(&error.to_string()))?;
    let mut bytes = file.into_inner();
    if names.iter().any(|name| name.len() + 2 >= LONG) {
        flag_long_names(&mut bytes);
    }
    Ok(write_whole(path, &bytes)?)
}

/// Sets bit 10 of the version and flags, which follow four bytes of magic, little-endian: without it the library of
/// OpenEXR before version 3 reads no name of 32 bytes or more, and the crate exr sets it for attributes alone.
fn flag_long_names(bytes: &mut [u8]) {
    if let Some(byte) = bytes.get_mut(5) {
        *byte |= 1 << 2;
    }
}

/// What [`NAMES`] says: three texts for each layer, UTF-8, in the order of the layers' channels. So a file does not
/// depend on the order in which its layers are given, but where names had to be numbered, as that goes by it.
fn described<P>(layers: &[NamedPicture<P>], names: &[String]) -> AttributeValue {
    let text = |text: &str| Text::from_slice_unchecked(text.as_bytes());
    let by_channels: BTreeMap<&String, &NamedPicture<P>> = names.iter().zip(layers).collect();
    let three = |(own, layer): (&String, &NamedPicture<P>)| [layer.shows.word(), own, &layer.name].map(text);
    AttributeValue::TextVector(by_channels.into_iter().flat_map(three).collect())
}

/// By what stands before the channels of layers: what they show, and their names, as [`NAMES`] says.
fn descriptions(attribute: Option<&AttributeValue>) -> BTreeMap<String, (Shows, String)> {
    let Some(AttributeValue::TextVector(texts)) = attribute else { return BTreeMap::new() };
    let text = |text: &Text| String::from_utf8_lossy(text.as_slice()).into_owned();
    let described = texts.chunks_exact(3).filter_map(|three| {
        let word = text(&three[0]);
        let shows = Shows::ALL.into_iter().find(|shows| shows.word() == word)?;
        Some((text(&three[1]), (shows, text(&three[2]))))
    });
    described.collect()
}

/// Reads the layers of an `.exr` file: its picture, whose name is empty, and all whose channels are named R, G and B,
/// in the order of their channels' names.
///
/// # Errors
/// A file that is missing, or content that is no such picture.
pub fn read_layers(path: impl AsRef<Path>) -> Result<Vec<NamedPicture<Picture>>, ImageError> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(|source| ImageError::Read { path: path.to_path_buf(), source })?;
    let broken = |reason: String| ImageError::Decode { path: path.to_path_buf(), format: "OpenEXR", reason };
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let image = reader.all_attributes().non_parallel().from_buffered(Cursor::new(bytes));
    let layer = image.map_err(|error| broken(error.to_string()))?.layer_data;
    let mut described = descriptions(layer.attributes.other.get(NAMES.as_bytes()));
    let Vec2(width, height) = layer.size;
    let mut planes: BTreeMap<String, [Option<Vec<f32>>; 3]> = BTreeMap::new();
    for channel in layer.channel_data.list {
        let name = channel.name.to_string();
        let (layer, colour) = name.rsplit_once('.').unwrap_or(("", &name));
        if let Some(c) = ["R", "G", "B"].iter().position(|own| *own == colour) {
            planes.entry(layer.to_owned()).or_default()[c] = Some(channel.sample_data.values_as_f32().collect());
        }
    }
    let names: Vec<String> = planes.keys().cloned().collect();
    let picture = |[r, g, b]: [Option<Vec<f32>>; 3]| {
        let (r, g, b) = (r?, g?, b?);
        let pixels = (0..width * height).map(|k| Some(Rgb::new(*r.get(k)?, *g.get(k)?, *b.get(k)?)));
        Some(Picture { width, height, pixels: pixels.collect::<Option<_>>()? })
    };
    let layers = planes.into_iter().filter_map(|(own, planes)| {
        let picture = picture(planes)?;
        let (shows, name) = described.remove(&own).unwrap_or_else(|| guessed(own, &names));
        Some(NamedPicture { name, shows, picture })
    });
    Ok(layers.collect())
}

/// What a layer shows whose channels are called so, among others.
fn guessed(own: String, all: &[String]) -> (Shows, String) {
    let of = if own == STANDARD_ERROR { Some("") } else { own.strip_suffix(".standard error") };
    match of.filter(|of| all.iter().any(|name| name == of)) {
        Some(of) => (Shows::StandardError, of.to_owned()),
        None => (Shows::Light, own),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::files::read_picture;

    fn awkward() -> Picture {
        let values = [0.0, -1.5, 1e-42, 0.1, f32::MAX, f32::INFINITY, f32::NAN];
        Picture::from_fn(7, 5, |x, y| Rgb::new(values[x], 0.3 * y as f32, -values[6 - x]))
    }

    fn bits(picture: &Picture) -> Vec<[u32; 3]> {
        let bits = |p: &Rgb| p.to_array().map(f32::to_bits);
        picture.pixels.iter().map(bits).collect()
    }

    /// Layers with a value each, in order.
    fn flat(count: usize) -> Vec<Picture> {
        (0..count).map(|k| Picture::from_fn(2, 1, |_, _| Rgb::splat(1.0 + k as f32))).collect()
    }

    /// Layers as they come back, with the value that each has.
    fn back(path: &Path) -> Vec<(String, Shows, f32)> {
        let layers = read_layers(path).expect("layers");
        layers.into_iter().map(|layer| (layer.name, layer.shows, layer.picture.pixels[0].x)).collect()
    }

    /// The names of the channels of a file, cut to what stands before the last dot, and whether it has the flag.
    fn channels(path: &Path) -> (Vec<String>, bool) {
        let bytes = std::fs::read(path).expect("a file");
        let has_flag = u32::from_le_bytes(bytes[4..8].try_into().expect("four")) & 0x400 != 0;
        let meta = exr::meta::MetaData::read_from_file(path, true).expect("a header");
        let names = meta.headers[0].channels.list.iter().map(|channel| channel.name.to_string());
        let red = names.filter_map(|name| name.strip_suffix(".R").map(str::to_owned));
        (red.collect(), has_flag)
    }

    #[test]
    fn readers_of_pictures_find_the_picture_and_layers_come_back() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a.exr");
        let picture = awkward();
        let halves = picture.scaled(0.5);
        let layer = |name: &str| NamedPicture { name: name.into(), shows: Shows::Light, picture: &halves };
        write_layers(&path, &picture, &[layer("lamp.désk"), layer("bounce.2"), layer("lamp.d_sk")]).unwrap();
        assert_eq!(bits(&read_picture(&path).unwrap()), bits(&picture));
        let back = read_layers(&path).unwrap();
        let names: Vec<&str> = back.iter().map(|layer| layer.name.as_str()).collect();
        assert_eq!(names, ["", "bounce.2", "lamp.désk", "lamp.d_sk"]);
        assert_eq!(channels(&path), (["bounce.2", "lamp.d_sk 2", "lamp.d_sk"].map(String::from).to_vec(), false));
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
    fn long_names_stay_apart_from_each_other_and_from_their_errors() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("long.exr");
        let long = |length: usize, end: &str| format!("lamp.{}{end}", "a".repeat(length - end.len()));
        // Of 240 bytes, of more than a file takes, and one that is called as the error of another.
        let names = [
            long(240, "1"),
            long(240, "2"),
            long(300, "1"),
            long(300, "2"),
            "lamp.desk".to_owned(),
            "lamp.desk.standard error".to_owned(),
            "lamp.hall.standard error".to_owned(),
        ];
        let pictures = flat(2 * names.len());
        let all: Vec<_> = names.iter().flat_map(|name| [(name, Shows::Light), (name, Shows::StandardError)]).collect();
        let layers: Vec<_> = all
            .iter()
            .zip(&pictures)
            .map(|((name, shows), picture)| NamedPicture { name: String::clone(name), shows: *shows, picture })
            .collect();
        write_layers(&path, &flat(1)[0].scaled(0.0), &layers).unwrap();
        let found = back(&path);
        assert_eq!(found.len(), 1 + layers.len());
        for ((name, shows), k) in all.iter().zip(1..) {
            assert!(found.contains(&(String::clone(name), *shows, k as f32)), "{name} {shows:?}");
        }
        let (own, has_flag) = channels(&path);
        assert!(has_flag && own.iter().all(|name| name.len() <= 253));
        for name in [&names[0], &names[1], &names[4], &names[5], &names[6]] {
            assert!(own.contains(name), "{name}");
        }
        assert_eq!(own.iter().filter(|name| name.ends_with(".standard error")).count(), 2 + names.len());
    }

    #[test]
    fn the_flag_for_long_names_is_set_from_32_bytes_on() {
        let place = tempfile::tempdir().unwrap();
        let (path, picture) = (place.path().join("a.exr"), flat(1).remove(0));
        for (length, expected) in [(29, false), (30, true)] {
            let layer = NamedPicture { name: "n".repeat(length), shows: Shows::Light, picture: &picture };
            write_layers(&path, &picture, &[layer]).unwrap();
            assert_eq!(channels(&path), (vec!["n".repeat(length)], expected));
        }
    }

    #[test]
    fn layers_of_other_programs_are_known_by_their_channels() {
        let all = ["", "lamp.a", "lamp.a.standard error", "lamp.b.standard error", "standard error"].map(String::from);
        let guess = |name: &str| guessed(name.to_owned(), &all);
        assert_eq!(guess("lamp.a"), (Shows::Light, "lamp.a".to_owned()));
        assert_eq!(guess("lamp.a.standard error"), (Shows::StandardError, "lamp.a".to_owned()));
        assert_eq!(guess("lamp.b.standard error"), (Shows::Light, "lamp.b.standard error".to_owned()));
        assert_eq!(guess("standard error"), (Shows::StandardError, String::new()));
    }

    #[test]
    fn files_of_layers_stay_apart() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a.png");
        let pictures = flat(5);
        let names = ["lamp.a/b", "lamp.a b", "lamp.désk", &"é".repeat(300), &"é".repeat(301)];
        let layer = |(name, picture): (&&str, _)| NamedPicture { name: (*name).into(), shows: Shows::Light, picture };
        let layers: Vec<_> = names.iter().zip(&pictures).map(layer).collect();
        let files = write_layered(&path, &pictures[0], &layers, Exposure::default()).unwrap();
        let own: HashSet<&PathBuf> = files.iter().collect();
        assert!(own.len() == 6 && files.iter().all(|file| file.is_file()), "{files:?}");
        assert_eq!(files[1..3], [path.with_file_name("a-lamp.a-b.png"), path.with_file_name("a-lamp.a-b-2.png")]);
        assert_eq!(files[3], path.with_file_name("a-lamp.désk.png"));
    }

    #[test]
    fn a_file_does_not_depend_on_the_order_of_its_layers() {
        let place = tempfile::tempdir().unwrap();
        let pictures = flat(3);
        let kinds = [("lamp.a", Shows::Light), ("bounce.0", Shows::Light), ("lamp.a", Shows::StandardError)];
        let named = |k: usize| NamedPicture { name: kinds[k].0.into(), shows: kinds[k].1, picture: &pictures[k] };
        let [first, second] = [[0, 1, 2], [2, 0, 1]].map(|order| {
            let path = place.path().join(format!("{}.exr", order[0]));
            write_layers(&path, &pictures[0], &order.map(named)).unwrap();
            std::fs::read(path).unwrap()
        });
        assert!(first == second);
    }

    #[test]
    fn two_sizes_are_refused_and_leave_nothing() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a.exr");
        let layer = NamedPicture { name: "a".into(), shows: Shows::Light, picture: &Picture::new(2, 3) };
        let found = write_layers(&path, &Picture::new(2, 2), &[layer]);
        assert!(matches!(found, Err(ImageError::Encode { .. })) && !path.exists());
    }
}
