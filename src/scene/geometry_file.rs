//! A file of geometry by its extension: OBJ or glTF.
//!
//! Not handled: scene files, which name such a file; [`crate::scene::file`] reads them.

use crate::scene::build::Soup;
use crate::scene::error::SceneError;
use crate::scene::model::LoadOptions;
use crate::scene::obj::Reader;
use crate::scene::{gltf, obj};

/// Reads the file: `name` for the scene, `file` for messages and the extension, `reader` for files in its folder.
pub(crate) fn read(
    name: &str,
    file: &str,
    bytes: &[u8],
    reader: Reader,
    options: LoadOptions,
) -> Result<Soup, SceneError> {
    if is_gltf(file) {
        gltf::read(name, file, bytes, reader, options)
    } else {
        obj::read(name, file, bytes, reader, options)
    }
}

/// Reads the file that a scene file names, `reader` being for the scene file's folder. Buffers of a glTF are beside
/// it, libraries of an OBJ beside the scene file.
pub(crate) fn read_beside(
    name: &str,
    file: &str,
    bytes: &[u8],
    reader: Reader,
    options: LoadOptions,
) -> Result<Soup, SceneError> {
    let folder = file.rfind(['/', '\\']).map_or("", |end| &file[..=end]);
    let beside = |name: &str| reader(&format!("{folder}{name}"));
    if is_gltf(file) { read(name, file, bytes, &beside, options) } else { read(name, file, bytes, reader, options) }
}

fn is_gltf(file: &str) -> bool {
    let extension = file.rsplit('.').next().unwrap_or("");
    ["glb", "gltf"].iter().any(|known| extension.eq_ignore_ascii_case(known))
}
