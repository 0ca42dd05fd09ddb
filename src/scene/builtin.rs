//! The scenes built in: the files under `meshes/`, embedded.
//!
//! `cornell-box` is the geometry and reflectance published by the Cornell University Program of Computer Graphics;
//! the others were made for this program.
//!
//! Not handled: scenes that are computed; every one is a file.

/// Names and one-line descriptions of the built-in scenes.
pub const NAMES: [(&str, &str); 5] = [
    ("cornell-box", "the Cornell box: two blocks, a red and a green wall, a lamp in the ceiling"),
    ("furnace", "a closed cube that emits 0.25 and reflects 0.5 everywhere: L = E/(1 - rho) = 0.5"),
    ("concentric-spheres", "a ball of radius 0.5 inside a sphere of radius 1, lit by a cap of the sphere"),
    ("furnished-room", "a closed room full of furniture, rho 0.8: shadowless light diverges here"),
    ("two-rooms", "two rooms joined by a doorway, the lamp in one and the camera in the other"),
];

/// The files of one built-in scene.
#[derive(Clone, Copy, Debug)]
pub struct Files {
    /// Its name; the files are `NAME.toml`, `NAME.obj` and `NAME.mtl`.
    pub name: &'static str,
    /// The scene file.
    pub toml: &'static str,
    /// The geometry.
    pub obj: &'static str,
    /// The materials.
    pub mtl: &'static str,
}

macro_rules! embed {
    ($name:literal) => {
        Files {
            name: $name,
            toml: include_str!(concat!("../../meshes/", $name, ".toml")),
            obj: include_str!(concat!("../../meshes/", $name, ".obj")),
            mtl: include_str!(concat!("../../meshes/", $name, ".mtl")),
        }
    };
}

/// The files of all built-in scenes, in the order of [`NAMES`].
pub const ALL: [Files; 5] = [
    embed!("cornell-box"),
    embed!("furnace"),
    embed!("concentric-spheres"),
    embed!("furnished-room"),
    embed!("two-rooms"),
];

/// The room of the figures for print: not among the scenes to study.
pub const GALLERY: Files = embed!("gallery");

/// Names and lines on all built-in scenes, that of the figures last.
pub fn listed() -> impl Iterator<Item = (&'static str, &'static str)> {
    NAMES.into_iter().chain([(GALLERY.name, "a lamp, a partition, a table and two balls: each mode at a glance")])
}

/// The files of the scene of that name.
pub fn find(name: &str) -> Option<&'static Files> {
    ALL.iter().chain([&GALLERY]).find(|files| files.name == name)
}

/// The bytes of an embedded OBJ or MTL.
pub(crate) fn file(name: &str) -> Option<&'static [u8]> {
    let (stem, extension) = name.rsplit_once('.')?;
    let files = find(stem)?;
    match extension {
        "obj" => Some(files.obj.as_bytes()),
        "mtl" => Some(files.mtl.as_bytes()),
        _ => None,
    }
}
