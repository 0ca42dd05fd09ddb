//! The checked JSON of a glTF file: version 2, no index out of range, no extension that the geometry needs and that
//! is not read.
//!
//! Not handled: what the buffers hold.

use gltf_json::validation::{Error, Validate};
use gltf_json::{Path, Root};
use serde::Deserialize;

use crate::scene::error::SceneError;
use crate::scene::lines::{list, shorten};

/// Extensions that are read.
pub(super) const READ: [&str; 4] =
    ["KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_mesh_quantization", "KHR_texture_transform"];

/// Extensions that only say where texels come from: nothing is lost beyond their textures.
const OF_TEXTURES: [&str; 4] = ["KHR_texture_basisu", "EXT_texture_webp", "EXT_texture_avif", "MSFT_texture_dds"];

#[derive(Deserialize)]
struct Versioned {
    asset: Asset,
}

#[derive(Deserialize)]
struct Asset {
    /// A text; files of glTF 1 have numbers too.
    version: serde_json::Value,
}

/// Reads and checks the JSON.
pub(super) fn parse(file: &str, json: &[u8]) -> Result<Root, SceneError> {
    let wrong = |message: String| SceneError::Gltf { file: file.to_owned(), message };
    let Versioned { asset } = serde_json::from_slice(json).map_err(|error| wrong(json_error(&error)))?;
    let version = asset.version.as_str().map_or_else(|| asset.version.to_string(), str::to_owned);
    if !version.starts_with("2.") {
        let version = shorten(&version);
        return Err(wrong(format!("it is glTF {version}; only glTF 2.0 can be read")));
    }
    let root: Root = serde_json::from_slice(json).map_err(|error| wrong(json_error(&error)))?;
    let required = root.extensions_required.iter().map(String::as_str);
    let unread: Vec<&str> = required.filter(|name| !READ.contains(name) && !OF_TEXTURES.contains(name)).collect();
    if !unread.is_empty() {
        return Err(SceneError::GltfExtensions { file: file.to_owned(), names: list(unread.into_iter()) });
    }
    check(&root).map_err(wrong)?;
    Ok(root)
}

/// A message of at most 300 characters: serde quotes words of any length.
fn json_error(error: &serde_json::Error) -> String {
    let message: String = error.to_string().chars().filter(|c| !c.is_control()).take(300).collect();
    format!("its JSON is not that of glTF 2.0: {message}")
}

/// The crate's own check, but for what is not needed here: bounds of positions.
fn check(root: &Root) -> Result<(), String> {
    check_positions(root)?;
    let mut found: Option<(String, Error)> = None;
    let mut more = 0;
    root.validate(root, Path::new, &mut |path, error| {
        let path = path().to_string();
        let needless = path.ends_with(".min") || path.ends_with(".max");
        if error == Error::Unsupported || needless {
            return;
        }
        more += usize::from(found.is_some());
        found.get_or_insert((path, error));
    });
    let Some((path, error)) = found else {
        return Ok(());
    };
    let path: String = path.chars().filter(|c| !c.is_control()).take(200).collect();
    let others = if more > 0 { format!(", and {more} more faults") } else { String::new() };
    Err(format!("{path}: {}{others}", error.to_string().to_lowercase()))
}

/// The crate's check indexes accessors by those of POSITION before it has looked at them.
fn check_positions(root: &Root) -> Result<(), String> {
    let primitives = root.meshes.iter().enumerate().flat_map(|(m, mesh)| mesh.primitives.iter().map(move |p| (m, p)));
    for (number, primitive) in primitives {
        if primitive.attributes.values().any(|index| index.value() >= root.accessors.len()) {
            return Err(format!("meshes[{number}]: a primitive names an accessor that does not exist"));
        }
    }
    Ok(())
}
