//! Tables that people give, row by row: fields between commas, semicolons, tabs or spaces, quoted where they hold one
//! (RFC 4180).
//!
//! The separator is the first by which the first row is understood by whoever asks for the table. Read over: empty
//! rows, lines that begin with `#`, a byte order mark. A line `sep=;` as spreadsheets write it says the separator.
//! Not handled: text that is not UTF-8, and separators that change within a table.

use std::borrow::Cow;

/// A row of a table that was read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    /// Its first line, counted from 1.
    pub line: usize,
    /// Its fields, without spaces around them.
    pub fields: Vec<String>,
}

/// The rows of a table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rows {
    /// What stands between fields, a byte; a space for any number of spaces and tabs.
    pub separator: u8,
    /// In the file's order.
    pub rows: Vec<Row>,
}

/// What is tried as a separator, the first that fits is taken.
const SEPARATORS: [u8; 4] = [b',', b';', b'\t', b' '];

/// The rows of a table as text, by the first separator whose first row is understood, or else by the one that finds
/// most fields in it.
///
/// # Errors
/// The line, and what is wrong there.
pub(crate) fn rows(bytes: &[u8], is_understood: impl Fn(&[String]) -> bool) -> Result<Rows, (usize, String)> {
    let (bytes, said) = said_separator(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    let said = said.map(|own| [own]);
    let mut best = (0, said.map_or(SEPARATORS[0], |own| own[0]));
    for &separator in said.as_ref().map_or(&SEPARATORS[..], |own| &own[..]) {
        let Some(first) = read(&bytes, separator, 1)?.pop() else { continue };
        if is_understood(&first.fields) {
            best = (usize::MAX, separator);
            break;
        }
        if first.fields.len() > best.0 {
            best = (first.fields.len(), separator);
        }
    }
    let separator = best.1;
    Ok(Rows { separator, rows: read(&bytes, separator, usize::MAX)? })
}

/// The lines that begin with `#` before the first row, without it, and their numbers.
pub(crate) fn leading_notes(bytes: &[u8]) -> Vec<(usize, &[u8])> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let lines = bytes.split(|&byte| byte == b'\n').enumerate().map(|(k, line)| (k + 1, line.trim_ascii()));
    let before = lines.take_while(|(_, line)| line.is_empty() || line.starts_with(b"#"));
    let marks = |line: &[u8]| line.iter().take_while(|&&byte| byte == b'#').count();
    before.map(|(number, line)| (number, &line[marks(line)..])).filter(|(_, line)| !line.is_empty()).collect()
}

/// The text with a first line `sep=;` made a note, and the separator that it says.
fn said_separator(bytes: &[u8]) -> (Cow<'_, [u8]>, Option<u8>) {
    let line = bytes.split(|&byte| byte == b'\n' || byte == b'\r').next().unwrap_or_default();
    let plain = line.trim_ascii_end().to_ascii_lowercase();
    let plain = plain.strip_prefix(b"\"").map_or(&plain[..], |rest| rest.strip_suffix(b"\"").unwrap_or(rest));
    // A tab at the end of the line is the separator and no space to be trimmed.
    match (plain.strip_prefix(b"sep="), line.last()) {
        (Some([]), Some(b'\t')) => (note(bytes), Some(b'\t')),
        (Some([separator]), _) if separator.is_ascii() => (note(bytes), Some(*separator)),
        _ => (Cow::Borrowed(bytes), None),
    }
}

fn note(bytes: &[u8]) -> Cow<'_, [u8]> {
    let mut bytes = bytes.to_vec();
    bytes[0] = b'#';
    Cow::Owned(bytes)
}

/// So many rows at most; rows without any text are left out.
fn read(bytes: &[u8], separator: u8, most: usize) -> Result<Vec<Row>, (usize, String)> {
    let (bytes, delimiter) = match separator {
        b' ' => (Cow::Owned(by_tabs(bytes)), b'\t'),
        other => (Cow::Borrowed(bytes), other),
    };
    let mut reader = csv::ReaderBuilder::new();
    let reader = reader.has_headers(false).flexible(true).comment(Some(b'#')).trim(csv::Trim::All);
    let mut reader = reader.delimiter(delimiter).from_reader(&bytes[..]);
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(1, csv::Position::line);
            let what =
                if matches!(error.kind(), csv::ErrorKind::Utf8 { .. }) { "is not UTF-8 text" } else { "is no row" };
            (line as usize, what.to_owned())
        })?;
        if record.iter().all(str::is_empty) {
            continue;
        }
        let line = record.position().map_or(1, |at| first_line(&bytes, at));
        rows.push(Row { line, fields: record.iter().map(str::to_owned).collect() });
        if rows.len() == most {
            break;
        }
    }
    Ok(rows)
}

/// The lines with one tab for all spaces and tabs in a row that are not within quotes, and none at either end.
fn by_tabs(bytes: &[u8]) -> Vec<u8> {
    let mut all = Vec::with_capacity(bytes.len());
    for line in bytes.split_inclusive(|&byte| byte == b'\n' || byte == b'\r') {
        let (mut is_quoted, mut gap) = (false, false);
        let start = all.len();
        for &byte in line {
            is_quoted ^= byte == b'"';
            gap |= matches!(byte, b' ' | b'\t') && !is_quoted;
            if matches!(byte, b' ' | b'\t') && !is_quoted {
                continue;
            }
            if gap && all.len() > start && !matches!(byte, b'\n' | b'\r') {
                all.push(b'\t');
            }
            gap = false;
            all.push(byte);
        }
    }
    all
}

/// The first line of a row that was read from a place on: empty lines and comments before it are part of the place.
fn first_line(bytes: &[u8], at: &csv::Position) -> usize {
    let rest = bytes.get(at.byte() as usize..).unwrap_or_default();
    let left_out = |line: &&[u8]| line.starts_with(b"#") || line.is_empty() || *line == b"\r";
    at.line() as usize + rest.split(|&byte| byte == b'\n').take_while(left_out).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined(text: &str, fields: usize) -> (u8, Vec<String>) {
        let read = rows(text.as_bytes(), |row| row.len() == fields).expect("a table");
        (read.separator, read.rows.iter().map(|row| row.fields.join("|")).collect())
    }

    #[test]
    fn rows_know_their_lines_and_quotes_come_off() {
        let text = "# made\n\nname,value\n\"wall, \"\"left\"\"\",0.1\n,,\n,0.0000001\n";
        let read = rows(text.as_bytes(), |_| true).expect("a table").rows;
        let fields: Vec<_> = read.iter().map(|row| row.fields.join("|")).collect();
        assert_eq!(fields, ["name|value", "wall, \"left\"|0.1", "|0.0000001"]);
        assert_eq!(read.iter().map(|row| row.line).collect::<Vec<_>>(), [3, 4, 6]);
    }

    #[test]
    fn the_separator_is_the_one_by_which_the_first_row_is_understood() {
        let rows = |row: &str| vec![row.to_owned(), "1|2|3".to_owned()];
        assert_eq!(joined("a,b,c\n1, 2,3", 3), (b',', rows("a|b|c")));
        assert_eq!(joined("a;b;c\r\n1;2;3\r\n", 3), (b';', rows("a|b|c")));
        assert_eq!(joined("a\tb\tc\n1\t2\t3\n", 3), (b'\t', rows("a|b|c")));
        assert_eq!(joined("  a b   c \n\n 1 \t2  3\n", 3), (b' ', rows("a|b|c")));
        assert_eq!(joined("1,5;2;3\n1;2;3", 3), (b';', rows("1,5|2|3")));
        assert_eq!(joined("\"a  a\" b \"c\"\n1 2 3", 3), (b' ', rows("a  a|b|c")));
        assert_eq!(joined("\u{feff}sep=;\r\na;b,b;c\n1;2;3", 3), (b';', rows("a|b,b|c")));
        assert_eq!(joined("sep=|\na|b|c\n1|2|3", 3), (b'|', rows("a|b|c")));
        assert_eq!(joined("sep=\t\na\tb\tc\n1\t2\t3", 3), (b'\t', rows("a|b|c")));
        // Where none is understood, the one of most fields.
        assert_eq!(joined("a;b;c;d\n1;2;3", 3).0, b';');
    }

    #[test]
    fn notes_before_the_first_row_are_found() {
        let text = "# one\n\n#two\r\n1,2\n# three\n";
        assert_eq!(leading_notes(text.as_bytes()), [(1, &b" one"[..]), (3, &b"two"[..])]);
    }
}
