//! A file of geometry by its extension: OBJ or glTF.
//!
//! Not handled: scene files, which name such a file; [`crate::scene::file`] reads them.

use crate::scene::build::Soup;
use crate::scene::error::SceneError;
use crate::scene::input::SceneInput;
use crate::scene::{gltf, obj, opacity};

/// Reads the file. Faces of which nothing is there are left out.
pub(crate) fn read(input: &SceneInput) -> Result<Soup, SceneError> {
    let mut soup = if is_gltf(input.file) { gltf::read(input) } else { obj::read(input) }?;
    opacity::leave_out(&mut soup);
    Ok(soup)
}

/// Reads the file that a scene file names, the reader being for the scene file's folder. Buffers of a glTF are beside
/// it, libraries of an OBJ beside the scene file.
pub(crate) fn read_beside(input: &SceneInput) -> Result<Soup, SceneError> {
    let SceneInput { name, file, bytes, reader, options } = *input;
    let folder = file.rfind(['/', '\\']).map_or("", |end| &file[..=end]);
    let beside = |name: &str| reader(&format!("{folder}{name}"));
    if is_gltf(file) { read(&SceneInput { name, file, bytes, reader: &beside, options }) } else { read(input) }
}

fn is_gltf(file: &str) -> bool {
    let extension = file.rsplit('.').next().unwrap_or("");
    ["glb", "gltf"].iter().any(|known| extension.eq_ignore_ascii_case(known))
}
