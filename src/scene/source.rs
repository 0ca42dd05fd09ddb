//! A scene file's text, and the lines that values stand in.
//!
//! Not handled: what the values mean.

use glam::DVec3;
use toml::Spanned;

use crate::scene::error::{Place, SceneError};

/// A scene file's text, to find lines in.
pub(crate) struct Source<'a> {
    pub file: &'a str,
    pub text: &'a str,
}

impl Source<'_> {
    /// The line that holds the byte at `offset`.
    pub fn place(&self, offset: usize) -> Place {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        Place::line(self.file, 1 + before.iter().filter(|&&b| b == b'\n').count())
    }

    /// The line where a value begins.
    pub fn of<T>(&self, value: &Spanned<T>) -> Place {
        self.place(value.span().start)
    }

    /// Three numbers of a camera or a light, which must be finite.
    pub fn vector(&self, name: &str, value: &Spanned<[f64; 3]>) -> Result<DVec3, SceneError> {
        let numbers = *value.get_ref();
        match numbers.iter().find(|x| !x.is_finite()) {
            None => Ok(DVec3::from_array(numbers)),
            Some(wrong) => {
                Err(SceneError::NotFinite { place: self.of(value), statement: name.into(), word: wrong.to_string() })
            }
        }
    }
}
