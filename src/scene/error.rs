//! What can be wrong with a file of a scene: errors, each naming file, line, value and what to do, and warnings of what
//! a file holds that the scene does not, one sentence a kind with a count and the first place.

use std::borrow::Borrow;
use std::ops::Deref;
use std::{fmt, io};

use miette::Diagnostic;
use thiserror::Error;

use crate::light::TransportError;

/// Where in the input something was found: a line of a file, or an item of an array given by a caller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file's path, or the scene's name where there is no file.
    pub file: String,
    /// What is counted: `line`, `face`, `triangle`, `vertex`, `material` or `camera`.
    pub item: &'static str,
    /// Lines from 1; items of arrays from 0.
    pub number: usize,
}

impl Place {
    /// A line of a file, counted from 1.
    pub fn line(file: &str, number: usize) -> Self {
        Place::item(file, "line", number)
    }

    /// An item of an array given by a caller, counted from 0.
    pub fn item(file: &str, item: &'static str, number: usize) -> Self {
        let file = file.to_owned();
        Place { file, item, number }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {} {}", self.file, self.item, self.number)
    }
}

/// Why a scene could not be loaded. The help of each is what to do about it.
#[derive(Debug, Error, Diagnostic)]
#[allow(missing_docs)] // the fields are the values the messages name
pub enum SceneError {
    /// Neither a built-in scene nor a file.
    #[error("there is no scene named `{name}`, and no such file")]
    #[diagnostic(help(
        "{nearest}give a path to an .obj, .glb, .gltf or .toml file, or one of the built-in scenes: {known}"
    ))]
    NoSuchScene { name: String, nearest: String, known: String },

    /// The path is a folder.
    #[error("{file} is a folder, not a scene")]
    #[diagnostic(help("{held}"))]
    Folder { file: String, held: String },

    /// The path's extension is none of `.obj`, `.glb`, `.gltf` and `.toml`.
    #[error("{file} is neither an OBJ nor a scene file nor glTF")]
    #[diagnostic(help("name it *.obj (Wavefront OBJ), *.glb or *.gltf (glTF 2.0), or *.toml (a scene file)"))]
    UnknownKind { file: String },

    /// A file is of another kind than its name says.
    #[error("{file} is {is}, not what its name says")]
    #[diagnostic(help("{advice}"))]
    OtherKind { file: String, is: &'static str, advice: &'static str },

    /// A file is missing or cannot be read.
    #[error("cannot read {file}: {source}")]
    #[diagnostic(help("check the path, and that the file may be read"))]
    Read { file: String, source: io::Error },

    /// The OBJ or glTF that a scene file names is missing or cannot be read.
    #[error("{place}: cannot read the OBJ `{name}`: {source}")]
    #[diagnostic(help("`obj` is a path relative to the scene file's folder"))]
    MissingObj { place: Place, name: String, source: io::Error },

    /// A glTF file breaks a rule of glTF 2.0 that its geometry, materials or cameras rest on.
    #[error("{file}: {message}")]
    #[diagnostic(help("the file cannot be read as glTF 2.0: export it again, or ask a glTF validator what is wrong"))]
    Gltf { file: String, message: String },

    /// A glTF file requires extensions that are not read.
    #[error("{file} requires extensions of glTF that are not supported: {names}")]
    #[diagnostic(help("export it without them: uncompressed, with the core materials"))]
    GltfExtensions { file: String, names: String },

    /// A buffer of a glTF file is missing or cannot be read.
    #[error("{file}: cannot read buffer {number}, `{name}`: {source}")]
    #[diagnostic(help("put the file beside the .gltf, or export a .glb, which holds its buffers"))]
    MissingBuffer { file: String, number: usize, name: String, source: io::Error },

    /// The scene has no camera of that name.
    #[error("`{scene}` has no camera `{name}`")]
    #[diagnostic(help("its cameras are: {known}. Without --camera the first one looks, or [camera] of a scene file"))]
    NoCamera { scene: String, name: String, known: String },

    /// The image of a texture is there and cannot be decoded.
    #[error("{place}: the image `{name}` is broken: {message}")]
    #[diagnostic(help(
        "save the image again as PNG, JPEG, WebP, BMP or TGA, or remove it: without the file the plain colour counts"
    ))]
    Image { place: Place, name: String, message: String },

    /// A file of measured intensities is missing or cannot be read.
    #[error("{place}: cannot read the IES file `{name}`: {source}")]
    #[diagnostic(help("`file` of a light is a path relative to the scene file's folder"))]
    MissingPhotometry { place: Place, name: String, source: io::Error },

    /// A file of measured intensities breaks a rule of LM-63.
    #[error("{place}: {message}")]
    #[diagnostic(help("the file cannot be read as IES LM-63 of type C: ask its maker for another, or convert it"))]
    Photometry { place: Place, message: String },

    /// The file of a sky's patches is missing or cannot be read.
    #[error("{place}: cannot read the sky `{name}`: {source}")]
    #[diagnostic(help("`patches` of [sky] is a path relative to the scene file's folder"))]
    MissingSky { place: Place, name: String, source: io::Error },

    /// A file of a sky's patches is wrong.
    #[error("{place}: {message}")]
    #[diagnostic(help(
        "a sky is a row R G B of radiance, W/(m² sr), for the ground and each patch of Reinhart's MF:n, from the horizon \
         up and from north clockwise, or a matrix as gendaymtx writes it: `halflight daylight --sky-of` makes one"
    ))]
    SkyPatches { place: Place, message: String },

    /// The text is not UTF-8.
    #[error("{place}: byte 0x{byte:02x} is not UTF-8 text")]
    #[diagnostic(help("save the file as UTF-8 text; UTF-16 and binary files cannot be read"))]
    NotUtf8 { place: Place, byte: u8 },

    /// The statements of an OBJ or MTL stand in one line.
    #[error("{file} is a text of one line, so its statements cannot be told apart")]
    #[diagnostic(help(
        "end each statement with a line feed or a carriage return, or both: save the file again as text"
    ))]
    OneLine { file: String },

    /// A word that should be a number is none.
    #[error("{place}: `{word}` in `{statement}` is not a number")]
    #[diagnostic(help("write numbers like 1, -0.5 or 2.5e-3, with a decimal point and without commas"))]
    NotANumber { place: Place, statement: String, word: String },

    /// NaN or infinite.
    #[error("{place}: `{word}` in `{statement}` is not finite")]
    #[diagnostic(help("NaN, infinite and overflowing numbers cannot be used: correct the value, or export again"))]
    NotFinite { place: Place, statement: String, word: String },

    /// A statement has too few or too many values, or no name.
    #[error("{place}: `{statement}` needs {needed}, found {found}")]
    #[diagnostic(help("complete the statement, or remove the line"))]
    Malformed { place: Place, statement: String, needed: &'static str, found: String },

    /// A vertex index is 0 or beyond the vertices.
    #[error("{place}: a face uses vertex {index}, but there are {vertices} vertices")]
    #[diagnostic(help(
        "OBJ indices count from 1 to the number of `v` lines, or from -1 backwards; arrays count from 0"
    ))]
    IndexOutOfRange { place: Place, index: String, vertices: usize },

    /// A face with fewer than three corners.
    #[error("{place}: a face has {found} corners; it needs three or more")]
    #[diagnostic(help("remove the face; `l` and `p` are the statements for lines and points"))]
    TooFewCorners { place: Place, found: usize },

    /// A face with more corners than can be triangulated.
    #[error("{place}: a face has {found} corners; {limit} are the most that can be read")]
    #[diagnostic(help("cut the face into smaller ones"))]
    TooManyCorners { place: Place, found: usize, limit: usize },

    /// A reflectance outside 0..1.
    #[error("{place}: material `{material}` reflects {value}, outside 0..1")]
    #[diagnostic(help(
        "Kd is the reflectance rho, which scales the rows of K: above 1 a bounce would make light. Each of its numbers lies in 0..1"
    ))]
    Rho { place: Place, material: String, value: f64 },

    /// A negative or infinite emission.
    #[error("{place}: material `{material}` emits {value}; emission is finite and not negative")]
    #[diagnostic(help("Ke or `emission` is E, a radiance in W/(m² sr): 0 or more, below 3e38"))]
    Emission { place: Place, material: String, value: f64 },

    /// A Ks or Ns that is negative or infinite.
    #[error("{place}: material `{material}` has {value} for its highlight; Ks and Ns are finite and not negative")]
    #[diagnostic(help("Ks is a share of light and Ns an exponent: 0 or more"))]
    Gloss { place: Place, material: String, value: f64 },

    /// A scene file's name of a material that neither a library defines nor a face uses.
    #[error("{place}: there is no material `{name}`")]
    #[diagnostic(help("the materials are: {known}"))]
    UnknownMaterial { place: Place, name: String, known: String },

    /// A face of a caller's array names a material that does not exist.
    #[error("{place}: a face uses material {index}, but there are {materials} materials")]
    #[diagnostic(help("materials count from 0"))]
    MaterialOutOfRange { place: Place, index: u32, materials: usize },

    /// A face of a caller's array belongs to an object that does not exist.
    #[error("{place}: a face belongs to object {index}, but there are {objects} objects")]
    #[diagnostic(help("objects count from 0"))]
    ObjectOutOfRange { place: Place, index: u32, objects: usize },

    /// Nothing to see: no faces, or only faces without area.
    #[error("{file} has no faces with area ({dropped} without)")]
    #[diagnostic(help(
        "a scene needs at least one polygon (`f` of an OBJ, a triangle of a glTF) whose corners do not lie on one line, of an opacity above 0"
    ))]
    Empty { file: String, dropped: usize },

    /// No material that is used emits.
    #[error("nothing in `{name}` emits light: the picture would be black")]
    #[diagnostic(help(
        "where E = 0, L = E + K L is 0 too: `--light ceiling` adds a luminaire and `--light sky` a sky; or give a material `Ke R G B` in the MTL, an emissiveFactor in the glTF, or `emission = [R, G, B]` under [materials.NAME], a [[lights]] table or a [sky] in a scene file"
    ))]
    Dark { name: String },

    /// The scene file is not TOML, or not of the scene file's form.
    #[error("{place}: {message}")]
    #[diagnostic(help(
        "a scene file holds: obj (or mesh), unit, up, mode (or alpha, tau), [camera] position target up vertical_fov, \
         [materials.NAME] mode (or alpha, tau) two_sided emission visible_emission, \
         [[lights]] type name position direction intensity attenuation exponent cutoff file along, \
         [sky] radiance (or upper, lower, or patches column) north"
    ))]
    SceneFile { place: Place, message: String },

    /// alpha or tau outside 0..1.
    #[error("{place}: {source}")]
    #[diagnostic(help(
        "alpha is the share of reflected light that travels on, tau that of light let through: both lie in 0..1"
    ))]
    Transport { place: Place, source: TransportError },

    /// The camera cannot look that way.
    #[error("{place}: {source}")]
    #[diagnostic(help(
        "position and target must differ, up must not point along the view, vertical_fov is in degrees"
    ))]
    View { place: Place, source: ViewError },

    /// A light's number is out of its range.
    #[error("{place}: `{key}` of a light is {value}; it must be {needed}")]
    #[diagnostic(help(
        "irradiance is intensity cos / (a0 + a1 d + a2 d²), times the exponent-th power of the cosine to the axis within the cutoff"
    ))]
    LightValue { place: Place, key: &'static str, value: String, needed: &'static str },

    /// The OBJ reader disagrees with the check made before it.
    #[error("{file}: the OBJ reader failed: {message}")]
    #[diagnostic(help("this is a fault of the program: please report it together with the file"))]
    Reader { file: String, message: String },
}

impl SceneError {
    /// Where in the input the mistake is, if it has one place.
    pub fn place(&self) -> Option<&Place> {
        use SceneError::*;
        match self {
            MissingObj { place, .. }
            | Image { place, .. }
            | MissingPhotometry { place, .. }
            | Photometry { place, .. }
            | MissingSky { place, .. }
            | SkyPatches { place, .. }
            | NotUtf8 { place, .. }
            | NotANumber { place, .. }
            | NotFinite { place, .. }
            | Malformed { place, .. }
            | IndexOutOfRange { place, .. }
            | TooFewCorners { place, .. }
            | TooManyCorners { place, .. }
            | Rho { place, .. }
            | Emission { place, .. }
            | Gloss { place, .. }
            | UnknownMaterial { place, .. }
            | MaterialOutOfRange { place, .. }
            | ObjectOutOfRange { place, .. }
            | SceneFile { place, .. }
            | Transport { place, .. }
            | View { place, .. }
            | LightValue { place, .. } => Some(place),
            _ => None,
        }
    }

    /// The file that the mistake is in, if it is in one.
    pub fn file(&self) -> Option<&str> {
        use SceneError::*;
        match self {
            UnknownKind { file }
            | Folder { file, .. }
            | OtherKind { file, .. }
            | Read { file, .. }
            | Gltf { file, .. }
            | GltfExtensions { file, .. }
            | MissingBuffer { file, .. }
            | OneLine { file }
            | Empty { file, .. }
            | Reader { file, .. } => Some(file),
            other => other.place().map(|place| place.file.as_str()),
        }
    }
}

/// Why a camera cannot look that way.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ViewError {
    /// Position and target coincide.
    #[error("the camera's position is its target: the view has no direction")]
    NoDirection,
    /// Up is zero or along the view.
    #[error("the camera's up vector is zero or points along the view")]
    UpAlongView,
    /// A field of view outside (0, 180).
    #[error("vertical_fov = {0} is outside (0, 180) degrees")]
    Fov(f64),
    /// NaN, infinite, or too far away to be represented.
    #[error("the camera has a number that is not finite")]
    NotFinite,
}

/// What a file holds that the scene does not, or what is there in its place: one sentence.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Warning {
    /// What it concerns.
    pub about: About,
    /// The sentence.
    pub text: String,
}

/// What a warning concerns, and what that does to a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum About {
    /// Where surfaces are, and what they hide.
    Shape(Effect),
    /// What surfaces reflect and emit, lights and cameras: what form factors do not depend on.
    Light(Effect),
}

/// What becomes of what a file says, the worst first: in this order warnings are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Effect {
    /// Something that is not there, or cannot be meant, has a guess in its place.
    Guessed,
    /// It is missing from the picture.
    LeftOut,
    /// It is there, but simpler than the file says.
    Simplified,
}

impl Deref for Warning {
    type Target = str;

    fn deref(&self) -> &str {
        &self.text
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl PartialEq<&str> for Warning {
    fn eq(&self, other: &&str) -> bool {
        self.text == *other
    }
}

impl Borrow<str> for Warning {
    fn borrow(&self) -> &str {
        &self.text
    }
}

impl About {
    /// What it does to a picture.
    pub fn effect(self) -> Effect {
        match self {
            About::Shape(effect) | About::Light(effect) => effect,
        }
    }

    /// A warning of this.
    pub(crate) fn warning(self, text: String) -> Warning {
        Warning { about: self, text }
    }
}

/// Occurrences of one kind: how many, where first, and which names.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    pub count: usize,
    first: usize,
    names: Vec<String>,
}

impl Tally {
    /// Counts one occurrence at a line.
    pub(super) fn add(&mut self, line: usize) {
        if self.count == 0 {
            self.first = line;
        }
        self.count += 1;
    }

    /// Counts one occurrence and keeps the name it belongs to, once.
    pub(super) fn add_named(&mut self, line: usize, name: &str) {
        self.add(line);
        if !self.names.iter().rev().any(|known| known == name) && self.names.len() < 100 {
            self.names.push(name.to_owned());
        }
    }

    /// `2 statements a, b (first: FILE, line 7): CONSEQUENCE`, where the names are keywords.
    pub(super) fn report_keywords(&self, about: About, file: &str, consequence: &str, warnings: &mut Vec<Warning>) {
        if self.count > 0 {
            let names = list(self.names.iter().map(String::as_str));
            let (count, first, plural) = (self.count, self.first, plural(self.count));
            let text = format!("{count} statement{plural} {names} (first: {file}, line {first}): {consequence}");
            warnings.push(about.warning(text));
        }
    }

    /// `2 NOUN (first: FILE, ITEM 7): CONSEQUENCE`, naming the names; nothing where nothing was counted.
    pub(super) fn report(
        &self,
        about: About,
        (file, item): (&str, &str),
        noun: &str,
        consequence: &str,
        warnings: &mut Vec<Warning>,
    ) {
        if self.count == 0 {
            return;
        }
        let of = match self.names.len() {
            0 => String::new(),
            1 => format!(" of material `{}`", shorten(&self.names[0])),
            _ => format!(" of materials {}", list(self.names.iter().map(String::as_str))),
        };
        let (count, first, plural) = (self.count, self.first, plural(self.count));
        let text = format!("{count} {noun}{plural}{of} (first: {file}, {item} {first}): {consequence}");
        warnings.push(about.warning(text));
    }
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

/// At most 40 characters of a word, for a message.
pub(crate) fn shorten(word: &str) -> String {
    match word.char_indices().nth(40) {
        Some((end, _)) => format!("{}...", &word[..end]),
        None => word.to_owned(),
    }
}

/// At most twelve names of a list, for a message.
pub(crate) fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.map(shorten).collect();
    match names.len() {
        0 => "(none)".to_owned(),
        1..=12 => names.join(", "),
        n => format!("{} and {} more", names[..12].join(", "), n - 12),
    }
}
