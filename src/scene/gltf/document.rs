//! The document of a glTF file: its JSON, checked, its buffers, and what of it is ignored.
//!
//! Chunks of a GLB, `data:` URIs and files next to it are read. Every length is checked against the bytes there are,
//! and a file that several buffers name is kept once, so memory is bounded by the sizes of the files. The JSON is of
//! version 2, has no index out of range, and requires no extension that geometry needs and that is not read.
//!
//! Not handled: buffers on the network.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io;
use std::rc::Rc;

use data_url::DataUrl;
use gltf_json::buffer::Buffer;
use gltf_json::validation::{Error, Validate};
use gltf_json::{Path, Root};
use serde::Deserialize;

use crate::scene::error::{SceneError, list, shorten};
use crate::scene::soup::Reader;

/// Extensions that are read.
pub(super) const READ: [&str; 4] =
    ["KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_mesh_quantization", "KHR_texture_transform"];

/// Extensions that only give where texels come from: nothing is lost beyond their textures.
const OF_TEXTURES: [&str; 4] = ["KHR_texture_basisu", "EXT_texture_webp", "EXT_texture_avif", "MSFT_texture_dds"];

/// Bytes of a GLB's header: magic, version and length.
const HEADER: usize = 12;

/// The bytes of a buffer.
pub(super) type Bytes<'a> = Rc<Cow<'a, [u8]>>;

/// The JSON and the binary chunk of a GLB, or all as JSON where it does not begin as a GLB does.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let version = word(bytes, 4).ok_or("the GLB header is cut off")?;
    if version != 2 {
        return Err(format!("the GLB has version {version}; only version 2 can be read"));
    }
    let length = word(bytes, 8).ok_or("the GLB header is cut off")? as usize;
    let short = || format!("the GLB header says {length} bytes, the file has {}", bytes.len());
    let mut rest = bytes.get(HEADER..length).ok_or_else(short)?;
    let json = chunk(&mut rest)?.filter(|chunk| chunk.0 == b"JSON").ok_or("the first chunk of the GLB is not JSON")?.1;
    let binary = chunk(&mut rest)?.filter(|chunk| chunk.0 == b"BIN\0").map(|chunk| chunk.1);
    Ok((json, binary))
}

type Chunk<'a> = (&'a [u8], &'a [u8]);

/// Kind and bytes of the chunk at the front, which is taken off; none at the end.
fn chunk<'a>(rest: &mut &'a [u8]) -> Result<Option<Chunk<'a>>, String> {
    let Some(length) = word(rest, 0) else {
        return Ok(None);
    };
    let all: &'a [u8] = rest;
    let end = 8 + length as usize;
    let cut = || format!("a chunk of the GLB says {length} bytes, but {} follow", all.len().saturating_sub(8));
    let found = all.get(8..end).ok_or_else(cut)?;
    *rest = &all[end..];
    Ok(Some((&all[4..8], found)))
}

/// The little-endian number at an offset, if it is there.
fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*four))
}

/// The bytes of every buffer, at least as many as its `byteLength`.
pub(super) fn buffers<'a>(
    file: &str,
    root: &Root,
    binary: Option<&'a [u8]>,
    reader: Reader,
) -> Result<Vec<Bytes<'a>>, SceneError> {
    let wrong = |message: String| SceneError::Gltf { file: file.to_owned(), message };
    let mut known: HashMap<&str, Bytes<'a>> = HashMap::new();
    let mut all = Vec::new();
    for (number, buffer) in root.buffers.iter().enumerate() {
        let bytes = match (&buffer.uri, binary) {
            (None, Some(binary)) if number == 0 => Rc::new(Cow::Borrowed(binary)),
            (None, _) => {
                return Err(wrong(format!("buffer {number} has no `uri`, and no binary chunk is there for it")));
            }
            (Some(uri), _) if known.contains_key(uri.as_str()) => known[uri.as_str()].clone(),
            (Some(uri), _) => {
                let bytes: Bytes = Rc::new(Cow::Owned(buffer_bytes(file, number, uri, reader)?));
                known.insert(uri, bytes.clone());
                bytes
            }
        };
        check_length(number, buffer, &bytes).map_err(wrong)?;
        all.push(bytes);
    }
    Ok(all)
}

fn check_length(number: usize, buffer: &Buffer, bytes: &[u8]) -> Result<(), String> {
    let (needed, found) = (buffer.byte_length.0, bytes.len());
    let enough = usize::try_from(needed).is_ok_and(|needed| needed <= found);
    enough.then_some(()).ok_or_else(|| format!("buffer {number} has {found} bytes, not the {needed} of its byteLength"))
}

/// The bytes of a buffer of its own.
fn buffer_bytes(file: &str, number: usize, uri: &str, reader: Reader) -> Result<Vec<u8>, SceneError> {
    let file = || file.to_owned();
    let message = || format!("the data URI of buffer {number} cannot be decoded");
    let found = fetch(uri, reader).ok_or_else(|| SceneError::Gltf { file: file(), message: message() })?;
    found.map_err(|source| SceneError::MissingBuffer { file: file(), number, name: shorten(uri), source })
}

/// What a URI stands for: its own data, or a file relative to the glTF's folder; none where its data cannot be decoded.
pub(super) fn fetch(uri: &str, reader: Reader) -> Option<io::Result<Vec<u8>>> {
    if uri.starts_with("data:") {
        return decode(uri).map(Ok);
    }
    let plain = decode(&format!("data:,{uri}")).and_then(|bytes| String::from_utf8(bytes).ok());
    let written = || reader(uri);
    let found = plain.map_or_else(written, |plain| reader(&plain).or_else(|_| written()));
    Some(found.map(Cow::into_owned))
}

/// The bytes of a `data:` URI. A path behind `data:,` is only freed of its percent signs.
fn decode(uri: &str) -> Option<Vec<u8>> {
    let (bytes, _) = DataUrl::process(uri).ok()?.decode_to_vec().ok()?;
    Some(bytes)
}

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

/// Kinds of things that are not modelled, each with the names of what has them.
#[derive(Default)]
pub(super) struct Ignored {
    kinds: Vec<(&'static str, Vec<String>)>,
}

impl Ignored {
    /// Counts one thing of a kind.
    pub(super) fn add(&mut self, kind: &'static str, name: &str) {
        let known = self.kinds.iter().position(|(known, _)| *known == kind);
        let at = known.unwrap_or_else(|| {
            self.kinds.push((kind, Vec::new()));
            self.kinds.len() - 1
        });
        let names = &mut self.kinds[at].1;
        if names.last().is_none_or(|last| last != name) {
            names.push(name.to_owned());
        }
    }

    /// `FILE: KIND (NAME, NAME), KIND (NAME): not modelled and ignored`; nothing where nothing was counted.
    pub(super) fn report(&self, file: &str, warnings: &mut Vec<String>) {
        if self.kinds.is_empty() {
            return;
        }
        let kind = |(kind, names): &(&str, Vec<String>)| format!("{kind} ({})", list(names.iter().map(String::as_str)));
        let kinds: Vec<String> = self.kinds.iter().map(kind).collect();
        warnings.push(format!("{file}: not modelled and ignored: {}", kinds.join("; ")));
    }
}

/// A name without control characters, or the number where there is none.
pub(super) fn name(given: &Option<String>, what: &str, number: usize) -> String {
    match given.as_deref().map(str::trim) {
        None | Some("") => format!("{what} {number}"),
        Some(name) => name.replace(char::is_control, " "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_decoded() {
        assert_eq!(decode("data:application/octet-stream;base64,AAEC").unwrap(), [0, 1, 2]);
        assert_eq!(decode("data:,a%20b/c.bin").unwrap(), b"a b/c.bin");
        assert_eq!(decode("data:;base64,AA=A"), None);
        assert_eq!(decode("data:"), None);
    }

    #[test]
    fn chunks_that_lie_are_refused() {
        let glb = |length: u32, chunk: u32| {
            let words = [2, length, chunk].map(u32::to_le_bytes);
            [b"glTF".as_slice(), words.as_flattened(), b"JSON{}  "].concat()
        };
        assert_eq!(split(&glb(24, 4)).unwrap().0, b"{}  ");
        for (length, chunk) in [(0, 4), (11, 4), (25, 4), (u32::MAX, 4), (24, 5), (24, u32::MAX), (12, 4), (14, 4)] {
            assert!(split(&glb(length, chunk)).is_err(), "{length} {chunk}");
        }
        assert!(split(b"glTF").is_err());
    }
}
