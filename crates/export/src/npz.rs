//! NumPy's `.npz`: a zip archive of one `.npy` for each name, stored as it is; and F in it as SciPy's CSR.
//!
//! ```text
//! data     float32  the entries of F, row by row        format   'csr'
//! indices  int32    the column of each                  shape    (patches, patches)
//! indptr   int64    where each row starts
//! ```
//!
//! Row i receives: `(F @ x)[i]` is what patch i gets of what all patches send. `scipy.sparse.load_npz` leaves other
//! names alone, so an archive may hold more. Nothing is compressed: noise of rays does not shrink.
//!
//! Only place for `zip`. Not handled: archives of other programs whose arrays are compressed.

use std::collections::BTreeMap;
use std::io::{self, BufWriter, Cursor, Read, Seek, Write};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use crate::arrays::{Array, Values};
use halflight::form_factors::Rows;
use halflight::pictures::{WriteError, write_whole_by};

/// Writes named arrays, whole or not at all.
///
/// # Errors
/// A destination that cannot be written; a name that occurs twice.
pub fn write_npz(path: impl AsRef<Path>, arrays: &[(&str, Array)]) -> Result<(), WriteError> {
    write_whole_by(path, |file| archive(BufWriter::new(file), arrays)?.flush())
}

/// The bytes of such an archive.
///
/// # Panics
/// If a name occurs twice.
pub fn npz_bytes(arrays: &[(&str, Array)]) -> Vec<u8> {
    archive(Cursor::new(Vec::new()), arrays).expect("memory takes what is written").into_inner()
}

fn archive<W: Write + Seek>(out: W, arrays: &[(&str, Array)]) -> io::Result<W> {
    let mut archive = ZipWriter::new(out);
    for (name, array) in arrays {
        // Sizes beyond 4 GiB have to be announced.
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored).large_file(true);
        archive.start_file(format!("{name}.npy"), options)?;
        array.write_to(&mut archive)?;
    }
    Ok(archive.finish()?)
}

/// The arrays of an archive that [`write_npz`] wrote, by their names.
///
/// # Errors
/// What is wrong with the bytes.
pub fn read_npz(bytes: &[u8]) -> Result<BTreeMap<String, Array<'static>>, String> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| format!("is no zip archive: {error}"))?;
    let mut arrays = BTreeMap::new();
    for number in 0..archive.len() {
        let mut file = archive.by_index(number).map_err(|error| format!("has a broken part: {error}"))?;
        let name = file.name().map_err(|error| format!("has a broken name: {error}"))?.into_owned();
        let name = name.strip_suffix(".npy").ok_or("holds something else than arrays")?.to_owned();
        if file.compression() != CompressionMethod::Stored || file.size() > bytes.len() as u64 {
            return Err(format!("holds {name} compressed"));
        }
        let mut own = Vec::with_capacity(file.size() as usize);
        file.read_to_end(&mut own).map_err(|error| format!("has a broken {name}: {error}"))?;
        let array = Array::read(&own).map_err(|what| format!("holds {name}, which {what}"))?;
        arrays.insert(name, array);
    }
    Ok(arrays)
}

/// The arrays of a matrix in CSR, by SciPy's names.
pub fn csr(rows: &Rows) -> Vec<(&'static str, Array<'_>)> {
    let (starts, columns, values) = rows.parts();
    vec![
        ("indices", Array::vector(Values::I32(columns.into()))),
        ("indptr", Array::vector(Values::I64(starts.into()))),
        ("format", Array::single(Values::Bytes(b"csr"[..].into()))),
        ("shape", Array::vector(Values::I64(vec![rows.len(); 2].into()))),
        ("data", Array::vector(Values::F32(values.into()))),
    ]
}

/// The matrix of an archive's CSR, which is taken out of it.
///
/// # Errors
/// What is missing or wrong.
pub fn rows_of_csr(arrays: &mut BTreeMap<String, Array<'static>>) -> Result<Rows, String> {
    let mut take = |name: &str| arrays.remove(name).map(|array| array.values);
    let (Some(Values::I32(columns)), Some(Values::I64(starts)), Some(Values::F32(values))) =
        (take("indices"), take("indptr"), take("data"))
    else {
        return Err("does not hold data, indices and indptr of a sparse matrix".into());
    };
    let is_csr = take("format") == Some(Values::Bytes(b"csr"[..].into()));
    let count = starts.len().saturating_sub(1);
    if !is_csr || take("shape") != Some(Values::I64(vec![count; 2].into())) {
        return Err("is not a square matrix in the format csr".into());
    }
    let rows = Rows::from_parts(starts.into_owned(), columns.into_owned(), values.into_owned());
    rows.ok_or_else(|| "holds rows that are not those of form factors".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Rows {
        Rows::from_rows(vec![(vec![0, 2], vec![0.25, 0.5]), (vec![], vec![]), (vec![1], vec![1.0])])
    }

    fn written(rows: &Rows) -> Vec<u8> {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("F.npz");
        write_npz(&path, &csr(rows)).expect("it is written");
        std::fs::read(path).expect("it is there")
    }

    #[test]
    fn a_matrix_comes_back() {
        for rows in [sample(), Rows::empty(0), Rows::empty(4)] {
            let mut arrays = read_npz(&written(&rows)).expect("an archive");
            assert_eq!(rows_of_csr(&mut arrays), Ok(rows));
            assert!(arrays.is_empty());
        }
    }

    /// Whatever is broken, there is no panic, and no matrix of another size.
    #[test]
    fn broken_archives_are_no_other_matrices() {
        let bytes = written(&sample());
        let read = |bytes: &[u8]| read_npz(bytes).and_then(|mut arrays| rows_of_csr(&mut arrays));
        for length in 0..bytes.len() {
            assert!(read(&bytes[..length]).is_err(), "{length}");
        }
        for at in 0..bytes.len() {
            let mut broken = bytes.clone();
            broken[at] ^= 0x21;
            assert!(read(&broken).map_or(true, |rows| rows == sample()), "{at}");
        }
    }
}
