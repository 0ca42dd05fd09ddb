//! The document of a glTF file: its JSON and binary chunk, found and read.
//!
//! The JSON is of version 2 and requires no extension that the picture needs and that is not read. A byte order mark
//! before it, and zeros behind it, are read over; bytes that are not UTF-8 become the sign for such. Every length of a
//! GLB is checked against the bytes there are.
//!
//! Not handled: UTF-16, which is refused as such.

use std::borrow::Cow;

use serde::Deserialize;

use crate::scene::error::{SceneError, list, shorten};
use crate::scene::gltf::extensions::is_needed;
use crate::scene::gltf::schema::Root;
use crate::scene::other_kinds::{OtherKind, other_kind};

/// Bytes of a GLB's header: magic, version and length.
const HEADER: usize = 12;

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

#[derive(Deserialize)]
struct Versioned {
    asset: Asset,
}

#[derive(Deserialize)]
struct Asset {
    /// A text; files of glTF 1 have numbers too.
    version: serde_json::Value,
}

/// Reads the JSON, and checks what the file is.
pub(super) fn parse(file: &str, json: &[u8]) -> Result<Root, SceneError> {
    let wrong = |message: String| SceneError::Gltf { file: file.to_owned(), message };
    let text = text(json).map_err(wrong)?;
    let read: Result<Root, _> = serde_json::from_str(&text);
    check_version(&text).map_err(wrong)?;
    let root = read.map_err(|error| wrong(json_error(&error)))?;
    let required = root.extensions_required.iter().map(String::as_str);
    let unread: Vec<&str> = required.filter(|name| is_needed(name)).collect();
    if !unread.is_empty() {
        return Err(SceneError::GltfExtensions { file: file.to_owned(), names: list(unread.into_iter()) });
    }
    Ok(root)
}

/// The text of the JSON, without what may stand around it.
fn text(json: &[u8]) -> Result<Cow<'_, str>, String> {
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let end = json.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
    let json = &json[..end];
    match other_kind(json) {
        Some(OtherKind { is, advice }) => Err(format!("it is {is}: {advice}")),
        None if json.trim_ascii().is_empty() => Err("it is empty".to_owned()),
        None => Ok(String::from_utf8_lossy(json)),
    }
}

/// Refuses other versions than 2, and what does not say its version.
fn check_version(text: &str) -> Result<(), String> {
    let Versioned { asset } = serde_json::from_str(text).map_err(|error| json_error(&error))?;
    let version = asset.version.as_str().map_or_else(|| asset.version.to_string(), str::to_owned);
    let is_two = version == "2" || version.starts_with("2.");
    is_two.then_some(()).ok_or_else(|| format!("it is glTF {}; only glTF 2.0 can be read", shorten(&version)))
}

/// A message of at most 300 characters: serde quotes words of any length.
fn json_error(error: &serde_json::Error) -> String {
    let message: String = error.to_string().chars().filter(|c| !c.is_control()).take(300).collect();
    format!("its JSON is not that of glTF 2.0: {message}")
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

    #[test]
    fn what_stands_around_the_json_is_read_over() {
        for json in ["\u{feff}{}", "{}\0\0", " {} ", "\u{feff}\r\n{}\n\0"] {
            assert_eq!(text(json.as_bytes()).unwrap().trim_matches(['\r', '\n', ' ']), "{}", "{json:?}");
        }
        assert_eq!(text(b"{\"name\": \"caf\xe9\"}").unwrap(), "{\"name\": \"caf\u{fffd}\"}");
        for (other, part) in [
            (b"version https://git-lfs.github.com/spec/v1".as_slice(), "git lfs pull"),
            (b"\n<!DOCTYPE html>", "HTML"),
            (b"PK\x03\x04", "ZIP"),
            (b"\xff\xfe{\0", "UTF-16"),
            (b"\0\0", "empty"),
        ] {
            assert!(text(other).is_err_and(|what| what.contains(part)), "{part}");
        }
    }
}
