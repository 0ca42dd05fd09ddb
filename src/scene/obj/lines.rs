//! Text of OBJ and MTL files as statements: encoding, line ends, continuations, comments, numbers.
//!
//! Lines end with a line feed, a carriage return, or both, and are numbered as an editor shows them; a statement
//! continued with `\` has the number of its first line. A line that is not UTF-8 is taken for Latin-1 (ISO 8859-1),
//! which reads every byte and keeps equal names equal: programs write names and comments in the code page of their
//! country.
//!
//! Not handled: other separators, such as Unicode's; a file whose statements stand in one line is refused. Other code
//! pages, whose letters come out as other ones, and UTF-16: text with a zero byte that is not UTF-8 is refused.
//!
//! Source: Wavefront, *Object Files* and *MTL Material Format*, Advanced Visualizer manual, appendix B1.

use std::borrow::Cow;

use crate::scene::NO_MATERIAL;
use crate::scene::error::{About, Effect, Place, SceneError, Tally, Warning, shorten};

/// One statement: a keyword and what follows it.
pub(super) struct Statement<'a> {
    /// The number of its first line, from 1.
    pub line: usize,
    text: Cow<'a, str>,
}

impl Statement<'_> {
    /// The first word.
    pub(super) fn keyword(&self) -> &str {
        self.text.split_whitespace().next().unwrap_or("")
    }

    /// What follows the keyword, spaces inside kept: names may hold spaces and `#`.
    pub(super) fn rest(&self) -> &str {
        self.text.trim()[self.keyword().len()..].trim()
    }

    /// The words after the keyword, up to a trailing comment.
    pub(super) fn words(&self) -> impl Iterator<Item = &str> {
        let words = self.text.split_whitespace().skip(1);
        words.take_while(|word| !word.starts_with('#'))
    }

    /// The name of a material: the rest, or [`NO_MATERIAL`] where there is none, as some exporters write it.
    pub(super) fn material(&self) -> &str {
        if self.rest().is_empty() { NO_MATERIAL } else { self.rest() }
    }

    /// The statement's name, such as after `mtllib`; an error where there is none.
    pub(super) fn name(&self, file: &str) -> Result<&str, SceneError> {
        match self.rest() {
            "" => Err(self.malformed(file, "a name", "none")),
            name => Ok(name),
        }
    }

    /// An error about the number or kind of this statement's values.
    pub(super) fn malformed(&self, file: &str, needed: &'static str, found: &str) -> SceneError {
        let (place, statement) = (Place::line(file, self.line), self.keyword().to_owned());
        SceneError::Malformed { place, statement, needed, found: found.to_owned() }
    }

    /// An error about a word that is no number.
    pub(super) fn not_a_number(&self, file: &str, word: &str) -> SceneError {
        let (place, statement) = (Place::line(file, self.line), self.keyword().to_owned());
        SceneError::NotANumber { place, statement, word: shorten(word) }
    }

    /// A finite number.
    pub(super) fn number(&self, file: &str, word: &str) -> Result<f64, SceneError> {
        let value: f64 = word.parse().map_err(|_| self.not_a_number(file, word))?;
        let (place, statement) = (|| Place::line(file, self.line), || self.keyword().to_owned());
        let infinite = || SceneError::NotFinite { place: place(), statement: statement(), word: shorten(word) };
        value.is_finite().then_some(value).ok_or_else(infinite)
    }
}

/// The lines of a scene's OBJ and MTL files that were read as Latin-1 and are more than comments.
#[derive(Debug, Default)]
pub(super) struct Latin {
    /// The file of the first of them.
    file: String,
    lines: Tally,
}

impl Latin {
    /// The text of a file without byte order mark.
    ///
    /// # Errors
    /// [`SceneError::NotUtf8`] for bytes that are not UTF-8 and hold a zero byte, as binary files do.
    pub(super) fn decode<'a>(&mut self, file: &str, bytes: &'a [u8]) -> Result<Cow<'a, str>, SceneError> {
        match decode(file, bytes) {
            Ok(text) => Ok(Cow::Borrowed(text)),
            Err(error) if bytes.contains(&0) => Err(error),
            Err(_) => Ok(Cow::Owned(self.read_lines(file, bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)))),
        }
    }

    fn read_lines(&mut self, file: &str, bytes: &[u8]) -> String {
        let mut text = String::with_capacity(bytes.len() + bytes.len() / 8);
        for (index, line) in split_lines(bytes).enumerate() {
            if let Ok(line) = std::str::from_utf8(line) {
                text.push_str(line);
                continue;
            }
            text.extend(line.iter().map(|&byte| char::from(byte)));
            if !before_comment(line).is_ascii() {
                if self.lines.count == 0 {
                    file.clone_into(&mut self.file);
                }
                self.lines.add(index + 1);
            }
        }
        text
    }

    /// One warning, where a line was counted.
    pub(super) fn report(&self, warnings: &mut Vec<Warning>) {
        let consequence = "not UTF-8 text, read as Latin-1";
        self.lines.report(About::Shape(Effect::Guessed), (&self.file, "line"), "line", consequence, warnings);
    }
}

/// The bytes of a line up to a `#` that begins a word.
fn before_comment(line: &[u8]) -> &[u8] {
    let begins = |at: &usize| line[*at] == b'#' && (*at == 0 || line[at - 1].is_ascii_whitespace());
    &line[..(0..line.len()).find(begins).unwrap_or(line.len())]
}

/// The bytes as text without a byte order mark, or the line that is not UTF-8.
pub(crate) fn decode<'a>(file: &str, bytes: &'a [u8]) -> Result<&'a str, SceneError> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let at = error.valid_up_to();
        let line = split_lines(&bytes[..at]).count().max(1);
        SceneError::NotUtf8 { place: Place::line(file, line), byte: bytes[at] }
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// Lines with their ends, `\n`, `\r\n` or `\r`; what follows the last end is a line too, if only an empty one.
fn split_lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = Some(bytes);
    std::iter::from_fn(move || {
        let all = rest?;
        let Some(end) = all.iter().position(|byte| matches!(byte, b'\n' | b'\r')) else { return rest.take() };
        let after = end + if all[end..].starts_with(b"\r\n") { 2 } else { 1 };
        rest = Some(&all[after..]);
        Some(&all[..after])
    })
}

/// The lines of a text, without their ends.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text;
    split_lines(text.as_bytes()).map(move |line| {
        let (own, after) = rest.split_at(line.len());
        rest = after;
        own.trim_end_matches(['\n', '\r'])
    })
}

/// Refuses a text of one line that holds `keywords` beyond its first word: its statements would be read as one, or not
/// at all.
pub(super) fn refuse_one_line(file: &str, text: &str, keywords: &[&str]) -> Result<(), SceneError> {
    let text = text.trim();
    let is_one = !text.contains(['\n', '\r']) && text.split_whitespace().skip(1).any(|word| keywords.contains(&word));
    if is_one { Err(SceneError::OneLine { file: file.to_owned() }) } else { Ok(()) }
}

/// The statements of a text: no empty lines, no comment lines, continued lines joined.
pub(super) fn statements(text: &str) -> impl Iterator<Item = Statement<'_>> {
    let mut lines = lines(text).enumerate();
    std::iter::from_fn(move || {
        let (index, first) = lines.find(|(_, line)| !is_blank(line))?;
        let mut text = Cow::Borrowed(first);
        while let Some(open) = text.trim_end().strip_suffix('\\') {
            // Truncate and append in place: a long chain costs its length once.
            let kept = open.len();
            let joined = text.to_mut();
            joined.truncate(kept);
            joined.push(' ');
            joined.push_str(lines.next().map_or("", |(_, line)| line));
        }
        Some(Statement { line: index + 1, text })
    })
    .filter(|statement| !is_blank(&statement.text))
}

fn is_blank(line: &str) -> bool {
    let line = line.trim_start();
    line.is_empty() || line.starts_with('#')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_numbered_as_an_editor_shows_them() {
        let text = "# c\r\n\r\nv 1 \\\r\n 2 3 # end\r\n\tf\t1 2\nusemtl a #2 \n\\\n";
        let found: Vec<(usize, String, Vec<String>)> =
            statements(text).map(|s| (s.line, s.rest().to_owned(), s.words().map(str::to_owned).collect())).collect();
        assert_eq!(found.len(), 3);
        assert_eq!((found[0].0, found[1].0, found[2].0), (3, 5, 6));
        assert_eq!(found[0].2, ["1", "2", "3"]);
        assert_eq!(found[1].2, ["1", "2"]);
        assert_eq!(found[2].1, "a #2");
    }

    #[test]
    fn every_end_of_a_line_is_one() {
        let plain = "# c\n\nv 1 \\\n2 3\nf 1\n\nusemtl a\n";
        let all = |text: &str| -> Vec<(usize, String)> {
            statements(text).map(|s| (s.line, s.words().collect::<Vec<_>>().join(" "))).collect()
        };
        for end in ["\r", "\r\n"] {
            let text = plain.replace('\n', end);
            assert_eq!(all(&text), all(plain));
            assert_eq!(split_lines(text.as_bytes()).count(), lines(&text).count());
        }
        // In one file too, and where the last line has no end.
        assert_eq!(all("v 1\rv 2\r\nv 3\nv 4\r\rv 5").iter().map(|s| s.0).collect::<Vec<_>>(), [1, 2, 3, 4, 6]);
    }

    #[test]
    fn statements_in_one_line_are_refused() {
        let is_refused = |text: &str| refuse_one_line("a.obj", text, &["v", "f"]).is_err();
        assert!(is_refused("# old v 0 0 0 v 1 0 0 f 1 2 3") && is_refused("v 0 0 0\u{2028}v 1 0 0\u{2028}f 1 2 3\n"));
        assert!(
            !is_refused("v 0 0 0\rf 1 2 3") && !is_refused("# a comment") && !is_refused("v 0 0 0") && !is_refused("")
        );
    }

    #[test]
    fn a_long_chain_of_continuations_ends_with_the_text() {
        let text = "f 1\\\n".repeat(3);
        let all: Vec<_> = statements(&text).collect();
        assert_eq!(all.len(), 1);
        assert_eq!(all[0].line, 1);
    }

    #[test]
    fn the_line_that_is_not_text_is_named() {
        for bytes in [b"v 0 0 0\n\n# caf\xe9\n", b"v 0 0 0\r\r# caf\xe9\r"] {
            let error = decode("a.obj", bytes).unwrap_err();
            assert_eq!(error.to_string(), "a.obj, line 3: byte 0xe9 is not UTF-8 text");
        }
        assert_eq!(decode("a", "\u{feff}v".as_bytes()).unwrap(), "v");
    }

    fn read(bytes: &[u8]) -> (String, Vec<Warning>) {
        let (mut latin, mut warnings) = (Latin::default(), Vec::new());
        let text = latin.decode("a.obj", bytes).unwrap().into_owned();
        latin.report(&mut warnings);
        (text, warnings)
    }

    #[test]
    fn each_line_has_its_own_encoding() {
        let (text, warnings) = read(b"\xef\xbb\xbfo caf\xc3\xa9\no caf\xe9\r\n\xe9\n");
        assert_eq!(text, "o café\no café\r\né\n");
        assert_eq!(warnings.join("|"), "2 lines (first: a.obj, line 2): not UTF-8 text, read as Latin-1");
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
