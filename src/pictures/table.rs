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
    }
}
