//! What every reader of scenes gets.
//!
//! Not handled: what the bytes mean; the reader of each format knows.

use crate::scene::libraries::Reader;
use crate::scene::model::LoadOptions;

/// A file to read a scene from, and what is beside it; texts that are read live as long as their reader.
#[derive(Clone, Copy)]
pub(crate) struct SceneInput<'a, 'r> {
    /// The scene's name.
    pub name: &'a str,
    /// The file's name, for messages and for its extension.
    pub file: &'a str,
    /// All of the file.
    pub bytes: &'a [u8],
    /// Reads files that the file names.
    pub reader: Reader<'r>,
    pub options: LoadOptions,
}
