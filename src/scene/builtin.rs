//! The scenes built in: the files under `meshes/`, embedded.
//!
//! `cornell-box` is the geometry and reflectance published by the Cornell University Program of Computer Graphics;
//! the others were made for this program.
//!
//! Not handled: scenes that are computed; every one is a file.

/// The files of one built-in scene.
#[derive(Clone, Copy, Debug)]
pub struct Files {
    /// Its name; the files are `NAME.toml`, `NAME.obj` and `NAME.mtl`.
    pub name: &'static str,
    /// What it shows, in one line.
    pub description: &'static str,
    /// The scene file.
    pub toml: &'static str,
    /// The geometry.
    pub obj: &'static str,
    /// The materials.
    pub mtl: &'static str,
}

macro_rules! embed {
    ($name:literal, $description:literal) => {
        Files {
            name: $name,
            description: $description,
            toml: include_str!(concat!("../../meshes/", $name, ".toml")),
            obj: include_str!(concat!("../../meshes/", $name, ".obj")),
            mtl: include_str!(concat!("../../meshes/", $name, ".mtl")),
        }
    };
}

/// The built-in scenes; whatever lists them reads this.
pub const ALL: &[Files] = &[
    embed!("cornell-box", "the Cornell box: two blocks, a red and a green wall, a lamp in the ceiling"),
    embed!("furnace", "a closed cube that emits 0.25 and reflects 0.5 everywhere: L = E/(1 - rho) = 0.5"),
    embed!("concentric-spheres", "a ball of radius 0.5 inside a sphere of radius 1, lit by a cap of the sphere"),
    embed!("furnished-room", "a closed room full of furniture, rho 0.8: shadowless light diverges here"),
    embed!("two-rooms", "two rooms joined by a doorway, the lamp in one and the camera in the other"),
    embed!("gallery", "a lamp, a partition, a table and two balls: each mode at a glance"),
];

/// Their names and descriptions.
pub fn listed() -> impl Iterator<Item = (&'static str, &'static str)> {
    ALL.iter().map(|files| (files.name, files.description))
}

/// Their names.
pub fn names() -> impl Iterator<Item = &'static str> {
    ALL.iter().map(|files| files.name)
}

/// The files of the scene of that name.
pub fn find(name: &str) -> Option<&'static Files> {
    ALL.iter().find(|files| files.name == name)
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
