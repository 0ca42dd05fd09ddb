//! Radiance's matrices: a header that ends with an empty line, then numbers row by row.
//!
//! ```text
//! #?RADIANCE
//! NROWS=100
//! NCOLS=146
//! NCOMP=3
//! BigEndian=0
//! FORMAT=float
//!
//! numbers, little-endian, row by row, the components of an entry side by side
//! ```
//!
//! D has a row a point and a column a patch of the sky; a sky has a row a patch and a column a time. `dctimestep D SKY`
//! and `rmtxop` read what is written. Source: the manual pages of `dctimestep` and `rmtxop`. Not handled: what is read
//! ([`RadianceMatrix::parse`]).

use std::fs;
use std::io::{BufWriter, Write};
use std::path::Path;

use halflight::pictures::{WriteError, write_whole_by};
use halflight::scene::RadianceMatrix;

use crate::error::DaylightError;

/// Writes a matrix as `float`, whole or not at all.
///
/// A destination that cannot be written.
pub fn write_matrix(matrix: &RadianceMatrix, path: &Path) -> Result<(), WriteError> {
    write_whole_by(path, |file| {
        let mut file = BufWriter::new(file);
        let (rows, columns) = (matrix.rows, matrix.columns);
        write!(file, "#?RADIANCE\nSOFTWARE=halflight {}\n", env!("CARGO_PKG_VERSION"))?;
        write!(file, "NROWS={rows}\nNCOLS={columns}\nNCOMP=3\nBigEndian=0\nFORMAT=float\n\n")?;
        matrix.values.iter().flatten().try_for_each(|number| file.write_all(&number.to_le_bytes()))?;
        file.flush()
    })
}

/// Reads a matrix.
///
/// A file that cannot be read, or is no such matrix.
pub fn read_matrix(path: &Path) -> Result<RadianceMatrix, DaylightError> {
    let file = path.display().to_string();
    let bytes = fs::read(path).map_err(|source| DaylightError::Read { file: file.clone(), source })?;
    RadianceMatrix::parse(&bytes).map_err(|message| DaylightError::Matrix { file, message })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("d.mtx");
        let values = (0..6).map(|k| [k as f32, 0.5 * k as f32, -1.0]).collect();
        let matrix = RadianceMatrix { rows: 2, columns: 3, values };
        write_matrix(&matrix, &path).expect("a file");
        assert_eq!(read_matrix(&path).expect("a matrix"), matrix);
    }
}
