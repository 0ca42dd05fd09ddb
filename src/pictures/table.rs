//! Tables of numbers as comma-separated values (RFC 4180).
//!
//! Fields are quoted where they hold a comma, a quote or a line break; numbers have their shortest decimal form. Only
//! place for `csv`.

use std::fmt::Display;
use std::path::Path;

use crate::pictures::atomic::{WriteError, write_whole};

/// A table that grows row by row.
pub struct Table(csv::Writer<Vec<u8>>);

impl Table {
    /// A table of these columns, named with commas between them, and no row yet.
    pub fn new(columns: &str) -> Table {
        Table::with_columns(&columns.split(',').collect::<Vec<_>>())
    }

    /// A table of columns whose names may hold commas, and no row yet.
    pub fn with_columns(names: &[impl Display]) -> Table {
        let mut table = Table(csv::Writer::from_writer(Vec::new()));
        table.row(&names.iter().map(|name| name as &dyn Display).collect::<Vec<_>>());
        table
    }

    /// Adds a row with one cell for each column; a row of another length is a fault of the program.
    pub fn row(&mut self, cells: &[&dyn Display]) {
        let written = self.0.write_record(cells.iter().map(|cell| cell.to_string()));
        written.expect("every row has a cell for each column");
    }

    /// The table as text, its columns' names first.
    pub fn text(self) -> String {
        let bytes = self.0.into_inner().expect("memory takes what is written");
        String::from_utf8(bytes).expect("cells are text")
    }

    /// Writes the table to a file, whole or not at all.
    ///
    /// # Errors
    /// A destination that cannot be written.
    pub fn write(self, path: impl AsRef<Path>) -> Result<(), WriteError> {
        write_whole(path, self.text().as_bytes())
    }
}

/// A row of a table that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its first line, counted from 1.
    pub line: usize,
    /// Its fields, without spaces around them.
    pub fields: Vec<String>,
}

/// The rows of a table as text; empty lines and those that begin with `#` are left out.
///
/// # Errors
/// The line, and what is wrong there.
pub fn rows(bytes: &[u8]) -> Result<Vec<Row>, (usize, String)> {
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

/// The cell of a number that may not be known: empty where it is not.
pub fn known(value: Option<impl Display>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_quoted_where_they_must_be() {
        let mut table = Table::new("name,value");
        table.row(&[&"wall, \"left\"", &0.1]);
        table.row(&[&known(None::<f64>), &1e-7]);
        let text = table.text();
        assert_eq!(text, "name,value\n\"wall, \"\"left\"\"\",0.1\n,0.0000001\n");
        let read = rows(format!("# made\n\n{text}").as_bytes()).expect("a table");
        let fields: Vec<_> = read.iter().map(|row| row.fields.join("|")).collect();
        assert_eq!(
            (fields, read[0].line),
            (vec!["name|value".into(), "wall, \"left\"|0.1".into(), "|0.0000001".into()], 3)
        );
    }
}
