//! The JSON and the buffers of a glTF file: chunks of a GLB, `data:` URIs and files beside it.
//!
//! Every length is checked against the bytes there are, and a file that several buffers name is kept once, so memory
//! is bounded by the sizes of the files. Not handled: buffers on the network.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io;
use std::rc::Rc;

use data_url::DataUrl;
use gltf_json::Root;
use gltf_json::buffer::Buffer;

use crate::scene::error::SceneError;
use crate::scene::lines::shorten;
use crate::scene::obj::Reader;

/// What a file is made of.
pub(super) struct Container<'a> {
    /// The text of the JSON.
    pub json: &'a [u8],
    /// The binary chunk of a GLB.
    pub binary: Option<&'a [u8]>,
}

/// The bytes of a buffer.
pub(super) type Bytes<'a> = Rc<Cow<'a, [u8]>>;

/// Bytes of a GLB's header: magic, version and length.
const HEADER: usize = 12;

/// The chunks of a GLB, or all of it as JSON where it does not begin as a GLB does.
pub(super) fn split(bytes: &[u8]) -> Result<Container<'_>, String> {
    if !bytes.starts_with(b"glTF") {
        return Ok(Container { json: bytes, binary: None });
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
    Ok(Container { json, binary })
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

/// The bytes of every buffer, at least as many as it says it has.
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
        assert_eq!(split(&glb(24, 4)).unwrap().json, b"{}  ");
        for (length, chunk) in [(0, 4), (11, 4), (25, 4), (u32::MAX, 4), (24, 5), (24, u32::MAX), (12, 4), (14, 4)] {
            assert!(split(&glb(length, chunk)).is_err(), "{length} {chunk}");
        }
        assert!(split(b"glTF").is_err());
    }
}
