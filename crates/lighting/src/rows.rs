//! Tables of comma-separated values (RFC 4180) that people give, row by row.
//!
//! Not handled: other separators, and text that is not UTF-8.

/// A row of a table that was read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    /// Its first line, counted from 1.
    pub line: usize,
    /// Its fields, without spaces around them.
    pub fields: Vec<String>,
}

/// The rows of a table as text; empty lines and those that begin with `#` are left out.
///
/// # Errors
/// The line, and what is wrong there.
pub(crate) fn rows(bytes: &[u8]) -> Result<Vec<Row>, (usize, String)> {
    let mut reader = csv::ReaderBuilder::new();
    let mut reader =
        reader.has_headers(false).flexible(true).comment(Some(b'#')).trim(csv::Trim::All).from_reader(bytes);
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(1, csv::Position::line);
            let what =
                if matches!(error.kind(), csv::ErrorKind::Utf8 { .. }) { "is not UTF-8 text" } else { "is no row" };
            (line as usize, what.to_owned())
        })?;
        let line = record.position().map_or(1, |at| first_line(bytes, at));
        rows.push(Row { line, fields: record.iter().map(str::to_owned).collect() });
    }
    Ok(rows)
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

    #[test]
    fn rows_know_their_lines_and_quotes_come_off() {
        let text = "# made\n\nname,value\n\"wall, \"\"left\"\"\",0.1\n,0.0000001\n";
        let read = rows(text.as_bytes()).expect("a table");
        let fields: Vec<_> = read.iter().map(|row| row.fields.join("|")).collect();
        assert_eq!(
            (fields, read[0].line),
            (vec!["name|value".into(), "wall, \"left\"|0.1".into(), "|0.0000001".into()], 3)
        );
    }
}
