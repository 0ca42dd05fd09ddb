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
//! A sky has a row a patch and a column a time; what `gendaymtx` writes is read, as `ascii`, `float` or `double`.
//! Source: the manual pages of `dctimestep`, `gendaymtx` and `rmtxop`. Not handled: `rgbe` and `xyze`, and rows of
//! other numbers of components.

/// Numbers of a matrix, row by row, three components each.
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceMatrix {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
    /// Row by row.
    pub values: Vec<[f32; 3]>,
}

impl RadianceMatrix {
    /// Whether bytes begin as those of such a matrix do.
    pub fn is_one(bytes: &[u8]) -> bool {
        bytes.starts_with(b"#?")
    }

    /// The matrix that bytes of a file are.
    ///
    /// # Errors
    /// What is wrong with them, after the name of the file.
    pub fn parse(bytes: &[u8]) -> Result<RadianceMatrix, String> {
        if !RadianceMatrix::is_one(bytes) {
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
        Ok(RadianceMatrix { rows, columns, values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_read_and_others_refused() {
        let text = b"#?RADIANCE\ngendaymtx\nNROWS=1\nNCOLS=2\nNCOMP=3\nFORMAT=ascii\n\n1 2 3\n4 5 6e-1\n";
        assert_eq!(RadianceMatrix::parse(text).expect("a matrix").values, [[1.0, 2.0, 3.0], [4.0, 5.0, 0.6]]);
        for (text, what) in [
            ("P6\n\n", "does not begin"),
            ("#?RADIANCE\nNROWS=1\nFORMAT=ascii\n\n1 2 3", "no NCOLS"),
            ("#?RADIANCE\nNROWS=1\nNCOLS=1\nFORMAT=ascii\n\n1 2", "2 numbers"),
            ("#?RADIANCE\nNROWS=1\nNCOLS=1\nFORMAT=ascii\n\n1 2 x", "`x`"),
            ("#?RADIANCE\nNROWS=1\nNCOLS=1\nFORMAT=ascii\n\n1 2 inf", "inf"),
            ("#?RADIANCE\nNROWS=1\nNCOLS=1\nFORMAT=32-bit_rle_rgbe\n\n", "rgbe"),
            ("#?RADIANCE\nNROWS=99999999999999\nNCOLS=99999999999999\nFORMAT=float\n\n", "too many"),
        ] {
            let error = RadianceMatrix::parse(text.as_bytes()).expect_err("no matrix");
            assert!(error.contains(what), "{error}");
        }
    }
}
