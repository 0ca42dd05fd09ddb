//! F as Matrix Market: coordinates from 1 and values as text, an entry a line.
//!
//! Row i receives. Read by `scipy.io.mmread`, MATLAB, Julia and most libraries of sparse matrices. Values have their
//! shortest decimal form, which reads back to the same bits.
//!
//! Source: R. F. Boisvert, R. Pozo, K. A. Remington, *The Matrix Market exchange formats*, NISTIR 5935, 1996.
//! Not handled: reading it.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use sprs::CsMatViewI;
use sprs::io::write_matrix_market_to_bufwrite;

use halflight::form_factors::Rows;
use halflight::pictures::{WriteError, write_whole_by};

/// Writes F, whole or not at all.
///
/// # Errors
/// A destination that cannot be written.
pub fn write_matrix_market(path: impl AsRef<Path>, rows: &Rows) -> Result<(), WriteError> {
    let (starts, columns, values) = rows.parts();
    let columns: Vec<usize> = columns.iter().map(|&j| j as usize).collect();
    let shape = (rows.len(), rows.len());
    write_whole_by(path, |file| {
        let matrix = CsMatViewI::try_new(shape, starts, &columns, values).map_err(|e| io::Error::other(e.3))?;
        let mut out = BufWriter::new(file);
        write_matrix_market_to_bufwrite(&mut out, matrix)?;
        out.flush()
    })
}
