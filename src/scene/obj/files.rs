//! The files that an OBJ names: its MTL files, and the images of the textures of materials that faces use.
//!
//! * Names after `mtllib` may hold spaces, and spaces part file names: the longest run of words that is a file is taken
//!   first. `\` counts as `/` where no file has it in its name, and a path that leads nowhere is looked for by its last
//!   part next to the OBJ, since exporters write the paths of their own machine. What is not found is warned of.
//! * An image is looked for next to its MTL file, then next to the scene's files. One that is not there, or is neither
//!   PNG, JPEG, WebP, BMP nor TGA, is warned of, and the material keeps its plain numbers, but for a `Kd` that is but a
//!   factor, nearly 1 or 0; one that is broken is an error. `Kd` and `Ke` are factors on their textures; left out, or
//!   all 0, which would leave nothing of the texture, they count as 1. The opacity is a factor on `map_d`.
//!
//! Not handled: names that differ from the file's in upper and lower case.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::io;
use std::sync::Arc;

use crate::light::Rgb;
use crate::pictures::{Texels, TexelsError};
use crate::scene::error::{About, Effect, Place, SceneError, Tally, Warning, list, shorten};
use crate::scene::model::{DEFAULT_RHO, Material};
use crate::scene::obj::lines::Latin;
use crate::scene::obj::mtl::{Libraries, MapLine};
use crate::scene::other_kinds::{OtherKind, other_kind};
use crate::scene::soup::Reader;
use crate::scene::textures::{Channel, Filter, Image, Maps, Mask, ShareImages, Texture};

/// The most words of an `mtllib` line that are tried as file names.
const MOST_WORDS: usize = 32;

/// Names and bytes of files.
type Files<'a> = Vec<(String, Cow<'a, [u8]>)>;

/// Names of files that could not be read, their lines, and why the first of them could not.
#[derive(Default)]
struct Missing {
    lines: Tally,
    names: Vec<String>,
    failure: Option<io::Error>,
}

/// Reads every library of `lines`, which hold a line number and what follows `mtllib`; `file` names the OBJ. Warnings
/// are left in [`Libraries::warnings`].
///
/// # Errors
/// The first mistake in a library that is there.
pub(super) fn read_libraries(
    file: &str,
    lines: &[(usize, String)],
    reader: Reader,
    latin: &mut Latin,
    libraries: &mut Libraries,
) -> Result<(), SceneError> {
    let mut missing = Missing::default();
    // A repeated line adds nothing; reading its files for each of many lines would take forever.
    let (mut known, mut read) = (HashSet::new(), HashSet::new());
    for (line, names) in lines.iter().filter(|(_, names)| known.insert(names)) {
        for (name, bytes) in missing.find(*line, names, reader) {
            if read.insert(name.clone()) {
                libraries.read(&name, &latin.decode(&name, &bytes)?)?;
            }
        }
    }
    let names = list(missing.names.iter().map(String::as_str));
    let why = missing.failure.map_or(String::new(), |failure| format!(" ({failure})"));
    let consequence = format!("{names}{why}");
    missing.lines.report(
        About::Light(Effect::Guessed),
        (file, "line"),
        "missing MTL file",
        &consequence,
        &mut libraries.warnings,
    );
    Ok(())
}

impl Missing {
    /// Names and bytes of the files that an `mtllib` line stands for.
    fn find<'a>(&mut self, line: usize, names: &str, reader: Reader<'a>) -> Files<'a> {
        let failure = match read_either_way(names, reader) {
            Ok(bytes) => return vec![(names.to_owned(), bytes)],
            Err(failure) => failure,
        };
        self.failure.get_or_insert(failure);
        let words: Vec<&str> = names.split_whitespace().take(MOST_WORDS + 1).collect();
        let (found, missing) = if words.len() <= MOST_WORDS { runs(&words, reader) } else { Default::default() };
        let missing = if found.is_empty() { vec![names.to_owned()] } else { missing };
        missing.iter().for_each(|_| self.lines.add(line));
        self.names.extend(missing);
        found
    }
}

/// The longest runs of words that are files, and the words in between, each run of them as one name.
fn runs<'a>(words: &[&str], reader: Reader<'a>) -> (Files<'a>, Vec<String>) {
    let (mut found, mut missing, mut start) = (Vec::new(), Vec::new(), 0);
    let mut between: Vec<&str> = Vec::new();
    while start < words.len() {
        let ends = (start + 1..=words.len()).rev().map(|end| (end, words[start..end].join(" ")));
        let mut files = ends.filter_map(|(end, run)| Some((end, read_either_way(&run, reader).ok()?, run)));
        let Some((end, bytes, run)) = files.next() else {
            between.push(words[start]);
            start += 1;
            continue;
        };
        missing.push(std::mem::take(&mut between).join(" "));
        found.push((run, bytes));
        start = end;
    }
    missing.push(between.join(" "));
    missing.retain(|name| !name.is_empty());
    (found, missing)
}

/// The file of that name; else with `/` for `\`; else of its last part. What is of another kind is not there.
fn read_either_way<'a>(name: &str, reader: Reader<'a>) -> io::Result<Cow<'a, [u8]>> {
    let slashes = name.replace('\\', "/");
    let last = slashes.rsplit('/').next().unwrap_or("");
    let found = reader(name).or_else(|failure| {
        let others = [slashes.as_str(), last].into_iter().filter(|other| !other.is_empty() && *other != name);
        others.map(reader).find_map(Result::ok).ok_or(failure)
    })?;
    // What stands in a file's place is no more than no file.
    match other_kind(&found) {
        Some(OtherKind { is, advice }) => Err(io::Error::other(format!("it is {is}: {advice}"))),
        None => Ok(found),
    }
}

/// Images by name, each decoded once.
struct Images<'a, 'f> {
    reader: Reader<'a>,
    /// The folder of the OBJ, with the slash.
    folder: &'f str,
    /// The image, or why there is none.
    known: HashMap<String, Result<Arc<Image>, String>>,
    share_images: ShareImages,
    /// What cannot be read of each kind.
    missing: [MissingImages; 3],
}

/// Images of one kind of texture that cannot be read: their lines, their names, and the first one's library and reason.
#[derive(Default)]
struct MissingImages {
    lines: Tally,
    names: Vec<String>,
    first: Option<(String, String)>,
}

/// A kind of texture.
#[derive(Clone, Copy)]
enum Kind {
    Reflectance,
    Emission,
    Mask,
}

impl Kind {
    /// Its statement, what counts without its image, and what that concerns.
    const ALL: [(Kind, &'static str, &'static str, About); 3] = [
        (
            Kind::Reflectance,
            "missing map_Kd",
            "Kd alone counts: 0.8 of it where it is 1, 0.8 where it is 0",
            About::Light(Effect::Guessed),
        ),
        (Kind::Emission, "missing map_Ke", "all of the surface emits what Ke says", About::Light(Effect::Guessed)),
        (Kind::Mask, "missing map_d", "the surface is there without holes, as d says", About::Shape(Effect::Guessed)),
    ];
}

/// Reflectance from which on a factor on a texture that is not there would reflect nearly everything.
const NEARLY_ALL: f32 = 0.99;

/// Puts textures onto the materials that `used` numbers; `file` names the OBJ. Adds to the warnings.
///
/// # Errors
/// The first image that is there and broken, with the line of its library.
pub(super) fn attach_textures(
    file: &str,
    libraries: &Libraries,
    used: &[usize],
    materials: &mut [Material],
    reader: Reader,
    warnings: &mut Vec<Warning>,
) -> Result<(), SceneError> {
    let (known, share_images) = (HashMap::new(), ShareImages::default());
    let mut images = Images { reader, folder: folder(file), known, share_images, missing: Default::default() };
    for &index in used {
        let (entry, material) = (&libraries.entries[index], &mut materials[index]);
        let mut maps = Maps::default();
        if let Some((line, image)) = images.open(Kind::Reflectance, &entry.map_kd, &material.name)? {
            material.rho = factor(entry.has_kd(), material.rho);
            maps.reflectance = Some(texture(line, image));
        } else if entry.map_kd.is_some() {
            material.rho = without_texture(material.rho);
        }
        if let Some((line, image)) = images.open(Kind::Emission, &entry.map_ke, &material.name)? {
            material.emission = factor(entry.has_ke(), material.emission);
            maps.emission = Some(texture(line, image));
        }
        let mut mask = Mask { factor: entry.opacity, ..Mask::WHOLE };
        if let Some((line, image)) = images.open(Kind::Mask, &entry.map_d, &material.name)? {
            mask.texture = Some(texture(line, images.shares(line, &image)));
        }
        maps.mask = Some(mask);
        material.set_maps(maps);
    }
    for (kind, noun, consequence, about) in Kind::ALL {
        images.missing[kind as usize].report(about, noun, consequence, warnings);
    }
    Ok(())
}

impl MissingImages {
    fn report(&self, about: About, noun: &str, consequence: &str, warnings: &mut Vec<Warning>) {
        let Some((file, why)) = &self.first else { return };
        let names = list(self.names.iter().map(String::as_str));
        let consequence = format!("{names} ({why}): {consequence}");
        self.lines.report(about, (file, "line"), noun, &consequence, warnings);
    }
}

/// What a material reflects whose texture is not there: its factor, or where that is none or would reflect nearly
/// everything, [`DEFAULT_RHO`] of it.
fn without_texture(factor: Rgb) -> Rgb {
    match factor {
        Rgb::ZERO => Rgb::splat(DEFAULT_RHO),
        factor if factor.max_element() >= NEARLY_ALL => DEFAULT_RHO * factor,
        factor => factor,
    }
}

/// The folder that a file's name gives, with the slash.
fn folder(file: &str) -> &str {
    file.rfind(['/', '\\']).map_or("", |end| &file[..=end])
}

/// The factor on a texture.
fn factor(is_given: bool, own: Rgb) -> Rgb {
    if is_given && own != Rgb::ZERO { own } else { Rgb::ONE }
}

fn texture(line: &MapLine, image: Arc<Image>) -> Texture {
    let placement = Texture::upright(line.scale, line.offset);
    Texture { image, placement, wrap: [line.wrap; 2], filter: Filter::Linear }
}

impl Images<'_, '_> {
    /// The image of a line, where there is one that can be read.
    fn open<'l>(
        &mut self,
        kind: Kind,
        line: &'l Option<MapLine>,
        material: &str,
    ) -> Result<Option<(&'l MapLine, Arc<Image>)>, SceneError> {
        let Some(line) = line else { return Ok(None) };
        let library = folder(&line.file);
        let key = format!("{library}\n{}", line.name);
        if !self.known.contains_key(&key) {
            let found = self.decoded(library, line)?;
            self.known.insert(key.clone(), found);
        }
        match &self.known[&key] {
            Ok(image) => Ok(Some((line, image.clone()))),
            Err(why) => {
                let missing = &mut self.missing[kind as usize];
                missing.lines.add_named(line.line, material);
                if !missing.names.contains(&line.name) {
                    missing.names.push(line.name.clone());
                }
                missing.first.get_or_insert_with(|| (line.file.clone(), why.clone()));
                Ok(None)
            }
        }
    }

    /// The shares that an image of a mask gives: those of the channel requested, else of its alpha if that says
    /// anything, else of its grey.
    fn shares(&mut self, line: &MapLine, image: &Arc<Image>) -> Arc<Image> {
        let mut has_holes = || image.has_alpha() && self.share_images.of(image, Channel::Alpha).least() < 1.0;
        let own = || if has_holes() { Channel::Alpha } else { Channel::Luminance };
        let channel = line.channel.unwrap_or_else(own);
        self.share_images.of(image, channel)
    }

    /// The image of a line, or why there is none.
    fn decoded(&self, library: &str, line: &MapLine) -> Result<Result<Arc<Image>, String>, SceneError> {
        let decoded = self.bytes(library, &line.name).map_err(|error| error.to_string());
        match decoded.map(|bytes| Texels::decode(&line.name, &bytes)) {
            Ok(Ok(texels)) => Ok(Ok(Arc::new(Image::new(texels)))),
            Ok(Err(TexelsError::Broken(message))) => {
                let (place, name) = (Place::line(&line.file, line.line), shorten(&line.name));
                Err(SceneError::Image { place, name, message })
            }
            Ok(Err(error)) => Ok(Err(error.to_string())),
            Err(why) => Ok(Err(why)),
        }
    }

    /// The file of that name, or of its last part, in the folder of the library, next to the scene, or next to the OBJ.
    fn bytes(&self, library: &str, name: &str) -> io::Result<Cow<'_, [u8]>> {
        let last = name.rsplit(['/', '\\']).next().unwrap_or(name);
        let folders = [library, "", self.folder];
        let names = folders.iter().flat_map(|folder| [name, last].map(|name| format!("{folder}{name}")));
        let mut failure = None;
        for name in names {
            match read_either_way(&name, self.reader) {
                Ok(bytes) => return Ok(bytes),
                Err(error) => failure = failure.or(Some(error)),
            }
        }
        Err(failure.unwrap_or_else(|| io::ErrorKind::NotFound.into()))
    }
}
