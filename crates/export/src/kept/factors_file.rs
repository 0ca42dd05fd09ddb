//! F as a file: SciPy's CSR, and the sum of each row.
//!
//! The sums over its parts that a zip archive has show damage. Not handled: which F it is.

use std::fs;
use std::path::Path;

use crate::arrays::{Array, Values};
use crate::kept::error::KeptError;
use crate::npz::{csr, read_npz, rows_of_csr, write_npz};
use halflight::form_factors::FormFactors;
use halflight::pictures::WriteError;

/// Writes F with the sums of its rows; NaN where no ray was cast.
///
/// # Errors
/// A file that cannot be written.
pub fn write_factors(path: &Path, factors: &FormFactors) -> Result<(), WriteError> {
    let sums: Vec<f32> = factors.row_sums.iter().map(|sum| sum.unwrap_or(f32::NAN)).collect();
    let mut arrays = csr(&factors.rows);
    arrays.push(("row_sums", Array::vector(Values::F32(sums.into()))));
    write_npz(path, &arrays)
}

/// F of so many patches.
///
/// # Errors
/// A file that is missing, damaged, or holds something else.
pub fn read_factors(path: &Path, patches: usize) -> Result<FormFactors, KeptError> {
    let broken = |what: String| KeptError::Broken { path: path.into(), what };
    let bytes = fs::read(path).map_err(|source| KeptError::Read { path: path.into(), source })?;
    let mut arrays = read_npz(&bytes).map_err(broken)?;
    let rows = rows_of_csr(&mut arrays).map_err(broken)?;
    match arrays.remove("row_sums").map(|array| array.values) {
        Some(Values::F32(sums)) if sums.len() == patches && rows.len() == patches => {
            let row_sums = sums.iter().map(|&sum| (!sum.is_nan()).then_some(sum)).collect();
            Ok(FormFactors { rows, row_sums })
        }
        _ => Err(broken(format!("does not hold a row for each of {patches} patches"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::form_factors::Rows;

    /// A file that is cut short or changed is refused, or gives the F that was written.
    #[test]
    fn factors_come_back_whole_or_not_at_all() {
        let own = vec![(vec![0, 1], vec![0.25, 0.5]), (vec![], vec![])];
        let factors = FormFactors { rows: Rows::from_rows(own), row_sums: vec![Some(0.75), None] };
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("F.npz");
        write_factors(&path, &factors).expect("it is written");
        let written = fs::read(&path).expect("it is there");
        let read = |bytes: &[u8]| {
            fs::write(&path, bytes).expect("it is written");
            read_factors(&path, 2).map(|found| (found.rows, found.row_sums))
        };
        let whole = (factors.rows, factors.row_sums);
        assert_eq!(read(&written).expect("F"), whole);
        assert!(read_factors(&path, 3).is_err());
        for at in 0..written.len() {
            assert!(read(&written[..at]).is_err(), "length {at}");
            let mut broken = written.clone();
            broken[at] ^= 4;
            assert!(read(&broken).map_or(true, |found| found == whole), "byte {at}");
        }
    }
}
