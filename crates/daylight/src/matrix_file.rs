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
//! and `rmtxop` read what is written; what `gendaymtx` writes is read, as `ascii`, `float` or `double`. Source: the
//! manual pages of `dctimestep`, `gendaymtx` and `rmtxop`. Not handled: `rgbe` and `xyze`, and rows of other numbers of
//! components.

use std::fs;
use std::io::{BufWriter, Write};
use std::path::Path;

use halflight::pictures::{WriteError, write_whole_by};

use crate::error::DaylightError;

/// Numbers of a matrix, row by row, three components each.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
    /// Row by row.
    pub values: Vec<[f32; 3]>,
}

impl Matrix {
    /// Writes it as `float`, whole or not at all.
    ///
    /// A destination that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_whole_by(path, |file| {
            let mut file = BufWriter::new(file);
            let (rows, columns) = (self.rows, self.columns);
            write!(file, "#?RADIANCE\nSOFTWARE=halflight {}\n", env!("CARGO_PKG_VERSION"))?;
            write!(file, "NROWS={rows}\nNCOLS={columns}\nNCOMP=3\nBigEndian=0\nFORMAT=float\n\n")?;
            self.values.iter().flatten().try_for_each(|number| file.write_all(&number.to_le_bytes()))?;
            file.flush()
        })
    }

    /// Reads one.
    ///
    /// A file that cannot be read, or is no such matrix.
    pub fn read(path: &Path) -> Result<Matrix, DaylightError> {
        let file = path.display().to_string();
        let bytes = fs::read(path).map_err(|source| DaylightError::Read { file: file.clone(), source })?;
        parse(&bytes).map_err(|message| DaylightError::Matrix { file, message })
    }
}

fn parse(bytes: &[u8]) -> Result<Matrix, String> {
    if !bytes.starts_with(b"#?") {
        return Err("does not begin with #?RADIANCE".into());
    }
    let end = bytes.windows(2).position(|pair| pair == b"\n\n").ok_or("has a header without an end")?;
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let value = |key: &str| {
        let mut own = head.lines().filter_map(|line| line.split_once('=')).filter(|(name, _)| name.trim() == key);
        own.next_back().map(|(_, value)| value.trim().to_owned())
    };
    let number = |key: &str| {
        let text = value(key).ok_or_else(|| format!("has no {key} in its header"))?;
        text.parse::<usize>().map_err(|_| format!("has {key}={text}, which is no number"))
    };
    let (rows, columns, components) = (number("NROWS")?, number("NCOLS")?, number("NCOMP").unwrap_or(3));
    if components != 3 {
        return Err(format!("has {components} components; three are needed"));
    }
    let is_big = value("BigEndian").is_some_and(|own| own == "1");
    let format = value("FORMAT").unwrap_or_else(|| "ascii".into());
    let body = &bytes[end + 2..];
    let numbers: Vec<f32> = match format.as_str() {
        "float" => body
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| if is_big { f32::from_be_bytes(*b) } else { f32::from_le_bytes(*b) })
            .collect(),
        "double" => {
            let of = |b: &[u8; 8]| if is_big { f64::from_be_bytes(*b) } else { f64::from_le_bytes(*b) };
            body.as_chunks::<8>().0.iter().map(|b| of(b) as f32).collect()
        }
        "ascii" => {
            let word = |text: &str| text.parse().map_err(|_| format!("has `{text}` in place of a number"));
            String::from_utf8_lossy(body).split_ascii_whitespace().map(word).collect::<Result<_, _>>()?
        }
        other => return Err(format!("has FORMAT={other}; ascii, float and double are read")),
    };
    let values = numbers.as_chunks::<3>().0.to_vec();
    let wanted = rows.checked_mul(columns).ok_or("has too many entries")?;
    if values.len() != wanted || numbers.len() != 3 * wanted {
        return Err(format!("has {} numbers; {rows} x {columns} x 3 are {}", numbers.len(), 3 * wanted));
    }
    if let Some(k) = numbers.iter().position(|own| !own.is_finite()) {
        return Err(format!("has {} as its number {}", numbers[k], k + 1));
    }
    Ok(Matrix { rows, columns, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again_and_other_formats_too() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("d.mtx");
        let values = (0..6).map(|k| [k as f32, 0.5 * k as f32, -1.0]).collect();
        let matrix = Matrix { rows: 2, columns: 3, values };
        matrix.write(&path).expect("a file");
        assert_eq!(Matrix::read(&path).expect("a matrix"), matrix);
        let text = b"#?RADIANCE\ngendaymtx\nNROWS=1\nNCOLS=2\nNCOMP=3\nFORMAT=ascii\n\n1 2 3\n4 5 6e-1\n";
        assert_eq!(parse(text).expect("a matrix").values, [[1.0, 2.0, 3.0], [4.0, 5.0, 0.6]]);
        for (text, what) in [
            ("P6\n\n", "does not begin"),
            ("#?RADIANCE\nNROWS=1\nFORMAT=ascii\n\n1 2 3", "no NCOLS"),
            ("#?RADIANCE\nNROWS=1\nNCOLS=1\nFORMAT=ascii\n\n1 2", "2 numbers"),
            ("#?RADIANCE\nNROWS=1\nNCOLS=1\nFORMAT=ascii\n\n1 2 x", "`x`"),
            ("#?RADIANCE\nNROWS=1\nNCOLS=1\nFORMAT=ascii\n\n1 2 inf", "inf"),
            ("#?RADIANCE\nNROWS=1\nNCOLS=1\nFORMAT=32-bit_rle_rgbe\n\n", "rgbe"),
            ("#?RADIANCE\nNROWS=99999999999999\nNCOLS=99999999999999\nFORMAT=float\n\n", "too many"),
        ] {
            let error = parse(text.as_bytes()).expect_err("no matrix");
            assert!(error.contains(what), "{error}");
        }
    }
}
