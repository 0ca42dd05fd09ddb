//! Files that are not what their names say, known by their first bytes, so that an error says what they are.
//!
//! Not handled: whether a file that is none of these is what its name says.

use crate::scene::error::SceneError;

/// What a file is in place of what its name says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct OtherKind {
    /// With its article.
    pub is: &'static str,
    /// What to do.
    pub advice: &'static str,
}

const CONVERT: &str = "convert it to OBJ or glTF, with Blender or MeshLab, and load that";
const EXPORT: &str = "export glTF or OBJ from the program that wrote it, and load that";
const UTF_8: &str = "save it as UTF-8";
const UNPACK: &str = "unpack it, and load what is in it";

/// Beginnings of text, in lower case, and of bytes.
const BEGINNINGS: [(&[u8], OtherKind); 18] = [
    (
        b"version https://git-lfs",
        OtherKind { is: "a pointer of Git LFS", advice: "fetch the file that it stands for: git lfs pull" },
    ),
    (
        b"<!doctype html",
        OtherKind {
            is: "a page of HTML",
            advice: "download the file itself; this is a page that a server sent in its place",
        },
    ),
    (
        b"<html",
        OtherKind {
            is: "a page of HTML",
            advice: "download the file itself; this is a page that a server sent in its place",
        },
    ),
    (b"<?xml", OtherKind { is: "an XML text, as COLLADA is", advice: CONVERT }),
    (b"ply\n", OtherKind { is: "a PLY", advice: CONVERT }),
    (b"ply\r", OtherKind { is: "a PLY", advice: CONVERT }),
    (b"off\n", OtherKind { is: "an OFF", advice: CONVERT }),
    (b"#vrml", OtherKind { is: "a VRML", advice: CONVERT }),
    (b"#usda", OtherKind { is: "a USD", advice: CONVERT }),
    (b"pxr-usdc", OtherKind { is: "a USD", advice: CONVERT }),
    (b"kaydara fbx", OtherKind { is: "an FBX", advice: CONVERT }),
    (b"; fbx", OtherKind { is: "an FBX", advice: CONVERT }),
    (b"iso-10303-21", OtherKind { is: "a STEP", advice: CONVERT }),
    (b"\xff\xfe", OtherKind { is: "text in UTF-16", advice: UTF_8 }),
    (b"\xfe\xff", OtherKind { is: "text in UTF-16", advice: UTF_8 }),
    (b"blender", OtherKind { is: "a file of Blender's own", advice: EXPORT }),
    (b"pk\x03\x04", OtherKind { is: "a ZIP archive", advice: UNPACK }),
    (b"\x1f\x8b", OtherKind { is: "a gzip archive", advice: UNPACK }),
];

const STL: OtherKind = OtherKind { is: "an STL", advice: CONVERT };

/// Bytes that a text is known by.
const HEAD: usize = 1024;

/// What the bytes are, where they are of another kind than those that are read.
pub(crate) fn other_kind(bytes: &[u8]) -> Option<OtherKind> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let head = text[..text.len().min(HEAD)].to_ascii_lowercase();
    let known = BEGINNINGS.iter().find(|(beginning, _)| head.starts_with(beginning));
    let is_stl = || is_text_stl(&head) || is_binary_stl(bytes);
    known.map(|(_, kind)| *kind).or_else(|| is_stl().then_some(STL))
}

/// Refuses a glTF where text is expected.
pub(crate) fn refuse_gltf(file: &str, bytes: &[u8]) -> Result<(), SceneError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let (is, advice) = match (bytes.starts_with(b"glTF"), text.starts_with(b"{")) {
        (true, _) => ("a glTF of the binary kind", "name it *.glb"),
        (_, true) => ("a text of JSON, as glTF is", "name it *.gltf"),
        _ => return Ok(()),
    };
    Err(SceneError::OtherKind { file: file.to_owned(), is, advice })
}

/// Refuses bytes of another kind.
pub(crate) fn refuse_other_kind(file: &str, bytes: &[u8]) -> Result<(), SceneError> {
    let refused = |OtherKind { is, advice }| SceneError::OtherKind { file: file.to_owned(), is, advice };
    other_kind(bytes).map_or(Ok(()), |kind| Err(refused(kind)))
}

fn is_text_stl(head: &[u8]) -> bool {
    head.starts_with(b"solid") && head.windows(5).any(|word| word == b"facet")
}

/// A header of 80 bytes, a count, and 50 bytes a triangle.
fn is_binary_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(80..84).and_then(|four| four.first_chunk::<4>()).map(|four| u32::from_le_bytes(*four));
    count.is_some_and(|count| bytes.len() as u64 == 84 + 50 * u64::from(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_known_by_their_first_bytes() {
        let mut stl = vec![b' '; 80];
        stl.extend(2_u32.to_le_bytes());
        stl.extend([0; 100]);
        for (bytes, is) in [
            (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\n".as_slice(), "a pointer of Git LFS"),
            (b"\xef\xbb\xbf\n <!DOCTYPE html><html>", "a page of HTML"),
            (b"<HTML lang=en>", "a page of HTML"),
            (b"ply\nformat ascii 1.0\n", "a PLY"),
            (b"ply\r\nformat binary_little_endian 1.0\r\n", "a PLY"),
            (b"solid cube\n facet normal 0 0 1\n", "an STL"),
            (&stl, "an STL"),
            (b"Kaydara FBX Binary  \0", "an FBX"),
            (b"BLENDER-v300", "a file of Blender's own"),
            (b"PK\x03\x04", "a ZIP archive"),
            (b"ISO-10303-21;", "a STEP"),
            (b"\xff\xfev\0", "text in UTF-16"),
        ] {
            assert_eq!(other_kind(bytes).map(|kind| kind.is), Some(is));
        }
        for bytes in
            [b"# solid\nv 0 0 0\n".as_slice(), b"o solid facet", b"{\"asset\":{}}", b"glTF\x02", b"", b"v 1 2 3"]
        {
            assert_eq!(other_kind(bytes), None);
        }
    }
}
