//! NumPy's `.npy`, version 1.0: one array, its type and shape in a line of text, then its numbers row by row.
//!
//! ```text
//! \x93NUMPY 1 0 length {'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), } \n numbers, little-endian
//! ```
//!
//! What is read must have the bytes that would be written: arrays of other programs may differ in spaces. A crate would
//! be one line of text dearer: npyz brings a parser generator and a C compiler for it.
//!
//! Source: NumPy's `numpy.lib.format`. Not handled: other types, Fortran order, version 2 and 3 (headers beyond 65,535
//! bytes).

use std::borrow::Cow;
use std::io::{self, Write};

/// An array of numbers or texts, its last index running fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Array<'a> {
    /// Lengths along each axis; none for a single number.
    pub shape: Vec<usize>,
    /// Its entries, as many as the product of the lengths.
    pub values: Values<'a>,
}

/// The entries of an array.
#[derive(Clone, Debug, PartialEq)]
pub enum Values<'a> {
    /// `float32`.
    F32(Cow<'a, [f32]>),
    /// `float64`.
    F64(Cow<'a, [f64]>),
    /// Numbers below 2^31 as `int32`, the indices that SciPy computes with.
    I32(Cow<'a, [u32]>),
    /// Numbers below 2^63 as `int64`.
    I64(Cow<'a, [usize]>),
    /// Single bytes, together one `bytes` entry.
    Bytes(Cow<'a, [u8]>),
    /// Texts, as `str` of the longest one's length.
    Text(Cow<'a, [String]>),
}

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
/// What the length of a header is a multiple of.
const ALIGNED: usize = 64;
/// Numbers turned into bytes at once.
const RUN: usize = 1 << 14;

impl<'a> Array<'a> {
    /// A vector.
    pub fn vector(values: Values<'a>) -> Array<'a> {
        let count = values.count();
        Array { shape: vec![count], values }
    }

    /// A single entry.
    pub fn single(values: Values<'a>) -> Array<'a> {
        Array { shape: Vec::new(), values }
    }

    /// Writes the array.
    ///
    /// # Errors
    /// Those of the writer; a shape of another number of entries.
    pub fn write_to(&self, out: &mut dyn Write) -> io::Result<()> {
        if self.shape.iter().product::<usize>() != self.values.count() {
            return Err(io::Error::other("an array's shape is not that of its entries"));
        }
        out.write_all(&header(&self.values.descr(), &self.shape))?;
        self.values.write_to(out)
    }

    /// Reads an array that [`Array::write_to`] wrote; texts are not read.
    ///
    /// # Errors
    /// What is wrong with the bytes.
    pub fn read(bytes: &[u8]) -> Result<Array<'static>, String> {
        let length = bytes.get(8..10).map(|l| usize::from(u16::from_le_bytes([l[0], l[1]])));
        let head = length.and_then(|l| bytes.get(..10 + l)).ok_or("is too short for the header of a .npy array")?;
        let text = std::str::from_utf8(&head[10..]).map_err(|_| "has a header that is no text")?;
        let descr = between(text, "'descr': '", "'").ok_or("has a header without a type")?;
        let shape = between(text, "'shape': (", ")").and_then(shape).ok_or("has a header without a shape")?;
        if header(descr, &shape) != head {
            return Err("has another header than halflight writes".into());
        }
        let count = shape.iter().try_fold(1usize, |n, &length| n.checked_mul(length)).ok_or("is larger than memory")?;
        let values = Values::read(descr, count, &bytes[head.len()..])?;
        Ok(Array { shape, values })
    }
}

/// The part of a text between two others.
fn between<'t>(text: &'t str, before: &str, after: &str) -> Option<&'t str> {
    text.split_once(before)?.1.split_once(after).map(|(own, _)| own)
}

/// Lengths with commas between them.
fn shape(text: &str) -> Option<Vec<usize>> {
    let lengths = text.split(',').map(str::trim).filter(|length| !length.is_empty());
    lengths.map(|length| length.parse().ok()).collect()
}

/// Everything before the entries.
fn header(descr: &str, shape: &[usize]) -> Vec<u8> {
    let lengths: Vec<String> = shape.iter().map(usize::to_string).collect();
    let comma = if shape.len() == 1 { "," } else { "" };
    let text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({}{comma}), }}", lengths.join(", "));
    let all = (MAGIC.len() + 2 + text.len() + 1).next_multiple_of(ALIGNED);
    let padded = all - MAGIC.len() - 2;
    let mut bytes = MAGIC.to_vec();
    bytes.extend((padded as u16).to_le_bytes());
    bytes.extend(format!("{text:<0$}\n", padded - 1).bytes());
    bytes
}

impl Values<'_> {
    /// Number of entries.
    pub fn count(&self) -> usize {
        match self {
            Values::F32(values) => values.len(),
            Values::F64(values) => values.len(),
            Values::I32(values) => values.len(),
            Values::I64(values) => values.len(),
            Values::Bytes(_) => 1,
            Values::Text(values) => values.len(),
        }
    }

    /// NumPy's name of the type.
    fn descr(&self) -> String {
        match self {
            Values::F32(_) => "<f4".into(),
            Values::F64(_) => "<f8".into(),
            Values::I32(_) => "<i4".into(),
            Values::I64(_) => "<i8".into(),
            Values::Bytes(bytes) => format!("|S{}", bytes.len().max(1)),
            Values::Text(texts) => format!("<U{}", longest(texts)),
        }
    }

    fn write_to(&self, out: &mut dyn Write) -> io::Result<()> {
        match self {
            Values::F32(values) => write_numbers(out, values, |value| value.to_le_bytes()),
            Values::F64(values) => write_numbers(out, values, |value| value.to_le_bytes()),
            Values::I32(values) => write_numbers(out, values, |value| value.to_le_bytes()),
            Values::I64(values) => write_numbers(out, values, |value| (value as u64).to_le_bytes()),
            Values::Bytes(bytes) => out.write_all(if bytes.is_empty() { b"\0" } else { bytes }),
            Values::Text(texts) => texts.iter().try_for_each(|text| {
                let codes = text.chars().map(u32::from).chain(std::iter::repeat(0)).take(longest(texts));
                write_numbers(out, &codes.collect::<Vec<_>>(), |code| code.to_le_bytes())
            }),
        }
    }

    fn read(descr: &str, count: usize, bytes: &[u8]) -> Result<Values<'static>, String> {
        Ok(match descr {
            "<f4" => Values::F32(numbers(count, bytes, f32::from_le_bytes)?.into()),
            "<f8" => Values::F64(numbers(count, bytes, f64::from_le_bytes)?.into()),
            "<i4" => Values::I32(numbers(count, bytes, u32::from_le_bytes)?.into()),
            "<i8" => Values::I64(numbers(count, bytes, |own| u64::from_le_bytes(own) as usize)?.into()),
            _ if descr.starts_with("|S") && count == 1 => Values::Bytes(bytes.to_vec().into()),
            _ => return Err(format!("holds entries of type {descr}, which are not read")),
        })
    }
}

/// Characters of the longest text, at least one.
fn longest(texts: &[String]) -> usize {
    texts.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1)
}

/// Writes numbers of N bytes each.
fn write_numbers<T: Copy, const N: usize>(
    out: &mut dyn Write,
    values: &[T],
    bytes: impl Fn(T) -> [u8; N],
) -> io::Result<()> {
    values
        .chunks(RUN)
        .try_for_each(|run| out.write_all(run.iter().flat_map(|&v| bytes(v)).collect::<Vec<_>>().as_slice()))
}

/// Exactly `count` numbers of N bytes each.
fn numbers<T, const N: usize>(count: usize, bytes: &[u8], number: impl Fn([u8; N]) -> T) -> Result<Vec<T>, String> {
    let (own, rest) = bytes.as_chunks::<N>();
    if own.len() != count || !rest.is_empty() {
        return Err(format!("holds {} bytes where {count} entries of {N} are announced", bytes.len()));
    }
    Ok(own.iter().map(|own| number(*own)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(array: &Array) -> Vec<u8> {
        let mut bytes = Vec::new();
        array.write_to(&mut bytes).expect("memory takes it");
        bytes
    }

    #[test]
    fn arrays_come_back() {
        for array in [
            Array { shape: vec![2, 3], values: Values::F32(vec![0.0, 1.5, -2.0, f32::MAX, 1e-40, 3.0].into()) },
            Array::vector(Values::F64(vec![0.1, 1e300].into())),
            Array::vector(Values::I32(vec![7, 2_147_483_647].into())),
            Array { shape: vec![0, 4], values: Values::I64(vec![].into()) },
            Array::single(Values::Bytes(b"csr"[..].into())),
        ] {
            let bytes = written(&array);
            assert_eq!(bytes.len() % 64, bytes.len() - bytes.len() / 64 * 64);
            assert_eq!(Array::read(&bytes).as_ref(), Ok(&array));
        }
        assert!(Array { shape: vec![3], values: Values::F64(vec![1.0].into()) }.write_to(&mut Vec::new()).is_err());
    }

    /// What `numpy.save` writes.
    #[test]
    fn the_header_is_numpys() {
        let bytes = written(&Array { shape: vec![1], values: Values::F32(vec![1.0].into()) });
        let text = b"\x93NUMPY\x01\x00v\x00{'descr': '<f4', 'fortran_order': False, 'shape': (1,), }";
        assert!(bytes.starts_with(text) && bytes[127] == b'\n' && bytes.len() == 132);
        let texts = Values::Text(vec!["a".to_string(), "Å…".into()].into());
        assert_eq!(&written(&Array::vector(texts))[128..], b"a\0\0\0\0\0\0\0\xc5\0\0\0\x26\x20\0\0");
    }

    #[test]
    fn broken_arrays_are_refused() {
        let bytes = written(&Array { shape: vec![2, 3], values: Values::F32(vec![1.0; 6].into()) });
        for length in 0..bytes.len() {
            assert!(Array::read(&bytes[..length]).is_err(), "{length}");
        }
        for at in 0..128 {
            let mut broken = bytes.clone();
            broken[at] ^= 0x11;
            assert!(Array::read(&broken).is_err(), "{at}");
        }
        let huge = header("<f4", &[usize::MAX, 2]);
        assert!(Array::read(&huge).is_err());
    }
}
