//! The bytes of a glTF file: its buffers, and what its URIs stand for.
//!
//! The binary chunk of a GLB, `data:` URIs and files next to it are read, and a file that several buffers name is kept
//! once, so memory is bounded by the sizes of the files. A buffer that cannot be read, or is shorter than it says, is
//! an error once something in it is needed.
//!
//! Not handled: buffers on the network.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io;
use std::rc::Rc;

use data_url::DataUrl;

use crate::scene::error::{SceneError, shorten};
use crate::scene::gltf::fault::{Fault, item};
use crate::scene::gltf::schema::{Index, Root};
use crate::scene::soup::Reader;

/// The bytes of a buffer.
type Bytes<'a> = Rc<Cow<'a, [u8]>>;

/// The document with its buffers.
pub(super) struct Data<'a, 'r> {
    pub file: &'a str,
    pub root: &'a Root,
    pub reader: Reader<'r>,
    /// The binary chunk of a GLB.
    binary: Option<&'a [u8]>,
    /// None where a buffer cannot be read.
    buffers: Vec<Option<Bytes<'a>>>,
}

impl<'a, 'r> Data<'a, 'r> {
    /// Reads all buffers that can be read.
    pub(super) fn new(file: &'a str, root: &'a Root, binary: Option<&'a [u8]>, reader: Reader<'r>) -> Data<'a, 'r> {
        let mut data = Data { file, root, reader, binary, buffers: Vec::new() };
        let mut known: HashMap<&str, Option<Bytes<'a>>> = HashMap::new();
        for (number, buffer) in root.buffers.iter().enumerate() {
            let read = || data.buffer(number).ok().map(Rc::new);
            let bytes = match &buffer.uri {
                Some(uri) => known.entry(uri).or_insert_with(read).clone(),
                None => read(),
            };
            data.buffers.push(bytes);
        }
        data
    }

    /// How many bytes all buffers have.
    pub(super) fn size(&self) -> usize {
        self.buffers.iter().flatten().map(|bytes| bytes.len()).sum()
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: Index) -> Result<&[u8], Fault> {
        let view = item(&self.root.buffer_views, index, "buffer view")?;
        let Index(number) = view.buffer;
        let place = || format!("buffer view {}", index.0);
        let buffer = item(&self.root.buffers, view.buffer, "buffer").map_err(|fault| fault.within(&place()))?;
        let Some(bytes) = &self.buffers[number] else {
            // What was wrong is found once more: it is not kept, as it seldom matters.
            return Err(self.buffer(number).err().unwrap_or_else(|| format!("buffer {number} cannot be read").into()));
        };
        let (needed, found) = (buffer.byte_length.0, bytes.len());
        if usize::try_from(needed).map_or(true, |needed| needed > found) {
            return Err(format!("buffer {number} has {found} bytes, not the {needed} of its byteLength").into());
        }
        let beyond = || format!("{} goes beyond buffer {number}", place()).into();
        slice(bytes, view.byte_offset.0, view.byte_length.0).ok_or_else(beyond)
    }

    /// The bytes of a buffer as the file says where they are.
    fn buffer(&self, number: usize) -> Result<Cow<'a, [u8]>, Fault> {
        let Some(uri) = &self.root.buffers[number].uri else {
            let own = self.binary.filter(|_| number == 0).map(Cow::Borrowed);
            let missing = || format!("buffer {number} has no `uri`, and no binary chunk is there for it");
            return Ok(own.ok_or_else(missing)?);
        };
        let found = self.fetch(uri).ok_or_else(|| format!("the data URI of buffer {number} cannot be decoded"))?;
        let missing = |source| {
            let (file, name) = (self.file.to_owned(), shorten(uri));
            SceneError::MissingBuffer { file, number, name, source }
        };
        Ok(Cow::Owned(found.map_err(missing)?))
    }

    /// What a URI stands for: its own data, or a file relative to the glTF's folder; none where its data cannot be
    /// decoded.
    pub(super) fn fetch(&self, uri: &str) -> Option<io::Result<Vec<u8>>> {
        if uri.starts_with("data:") {
            return decode(uri).map(Ok);
        }
        let plain = decode(&format!("data:,{uri}")).and_then(|bytes| String::from_utf8(bytes).ok());
        let written = || (self.reader)(uri);
        let found = plain.map_or_else(written, |plain| (self.reader)(&plain).or_else(|_| written()));
        Some(found.map(Cow::into_owned))
    }
}

/// The bytes from `start` on, if there are so many.
pub(super) fn slice(bytes: &[u8], start: u64, length: u64) -> Option<&[u8]> {
    let (start, length) = (usize::try_from(start).ok()?, usize::try_from(length).ok()?);
    bytes.get(start..start.checked_add(length)?)
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
}
