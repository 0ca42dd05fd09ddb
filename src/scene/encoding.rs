//! Encoding of OBJ and MTL files: UTF-8, and Latin-1 line by line where a line is not UTF-8.
//!
//! Programs of one country's users write names and comments in its code page. A line that is not UTF-8 is taken for
//! Latin-1 (ISO 8859-1), which reads every byte and keeps equal names equal. One warning counts such lines of all files
//! of a scene; lines where only the comment is concerned are not counted.
//!
//! Not handled: other code pages, whose letters come out as other ones, and UTF-16: text with a zero byte that is not
//! UTF-8 is refused.

use std::borrow::Cow;

use crate::scene::error::SceneError;
use crate::scene::lines;
use crate::scene::warnings::Tally;

/// The lines of a scene's OBJ and MTL files that were read as Latin-1 and are more than comments.
#[derive(Debug, Default)]
pub(crate) struct Latin {
    /// The file of the first of them.
    file: String,
    lines: Tally,
}

impl Latin {
    /// The text of a file without byte order mark.
    ///
    /// # Errors
    /// [`SceneError::NotUtf8`] for bytes that are not UTF-8 and hold a zero byte, as binary files do.
    pub fn decode<'a>(&mut self, file: &str, bytes: &'a [u8]) -> Result<Cow<'a, str>, SceneError> {
        match lines::decode(file, bytes) {
            Ok(text) => Ok(Cow::Borrowed(text)),
            Err(error) if bytes.contains(&0) => Err(error),
            Err(_) => Ok(Cow::Owned(self.read_lines(file, bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)))),
        }
    }

    fn read_lines(&mut self, file: &str, bytes: &[u8]) -> String {
        let mut text = String::with_capacity(bytes.len() + bytes.len() / 8);
        for (index, line) in lines::split_lines(bytes).enumerate() {
            if let Ok(line) = std::str::from_utf8(line) {
                text.push_str(line);
                continue;
            }
            text.extend(line.iter().map(|&byte| char::from(byte)));
            if !before_comment(line).is_ascii() {
                self.add(file, index + 1);
            }
        }
        text
    }

    fn add(&mut self, file: &str, line: usize) {
        if self.lines.count == 0 {
            file.clone_into(&mut self.file);
        }
        self.lines.add(line);
    }

    /// One warning, where a line was counted.
    pub fn report(&self, warnings: &mut Vec<String>) {
        self.lines.report(&self.file, "line", "line", "not UTF-8 text, read as Latin-1", warnings);
    }
}

/// The bytes of a line up to a `#` that begins a word.
fn before_comment(line: &[u8]) -> &[u8] {
    let begins = |at: &usize| line[*at] == b'#' && (*at == 0 || line[at - 1].is_ascii_whitespace());
    &line[..(0..line.len()).find(begins).unwrap_or(line.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> (String, Vec<String>) {
        let (mut latin, mut warnings) = (Latin::default(), Vec::new());
        let text = latin.decode("a.obj", bytes).unwrap().into_owned();
        latin.report(&mut warnings);
        (text, warnings)
    }

    #[test]
    fn each_line_has_its_own_encoding() {
        let (text, warnings) = read(b"\xef\xbb\xbfo caf\xc3\xa9\no caf\xe9\r\n\xe9\n");
        assert_eq!(text, "o café\no café\r\né\n");
        assert_eq!(warnings, ["2 lines (first: a.obj, line 2): not UTF-8 text, read as Latin-1"]);
    }

    #[test]
    fn comments_are_not_warned_of() {
        let (text, warnings) = read(b"# \xe9\nv 0 0 0 # \xe9\n");
        assert_eq!(text, "# é\nv 0 0 0 # é\n");
        assert!(warnings.is_empty());
    }

    #[test]
    fn binary_files_are_refused() {
        let error = Latin::default().decode("a.obj", b"v 0\n\0\xff").unwrap_err();
        assert_eq!(error.to_string(), "a.obj, line 2: byte 0xff is not UTF-8 text");
    }
}
