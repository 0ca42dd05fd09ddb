//! Rows of F kept while they are cast, so that a run that was interrupted goes on.
//!
//! Beside the folder DIR that is being made lies `DIR.casting`, with one file for each [`PIECE`] rays: the rows of some
//! patches for one choice of tau. A file's name has the sum over all that its rows depend on, and its last bytes are
//! the sum over the others: a piece of something else is not asked for, and one that is damaged is cast again. The
//! folder goes away once DIR is in its place.
//!
//! Not handled: two runs that make one folder at once; they write the same bytes.

use std::fs;
use std::path::{Path, PathBuf};

use halflight_team as team;

use crate::arrays::{Array, Values};
use crate::kept::sums::{Sum, sum_of};
use crate::npz::{npz_bytes, read_npz};
use halflight::form_factors::{FormFactors, Rows, Variant, cast_counts};
use halflight::operator::Wanted;
use halflight::pictures::{WriteError, make_directory, write_whole};

/// Rays of a piece, about: some seconds.
const PIECE: usize = 1 << 22;
/// Digits of a sum at the end of a file.
const DIGITS: usize = 32;

/// Rows of one choice of tau: columns, values and the sum of each.
type Own = Vec<(Vec<u32>, Vec<f32>, Option<f32>)>;

/// The folder of pieces beside a folder.
pub struct Pieces(PathBuf);

impl Pieces {
    /// Beside a folder that is being made.
    pub fn beside(folder: &Path) -> Pieces {
        let mut name = folder.as_os_str().to_owned();
        name.push(".casting");
        Pieces(name.into())
    }

    /// Casts the rows of all variants, but for those that lie there already; also returns how many rays were cast, and
    /// the first error of a file that could not be written. `identity` is the sum over all that rows depend on but for
    /// tau and the rays.
    pub fn cast(&self, wanted: &Wanted, identity: &str) -> (Vec<FormFactors>, u64, Option<WriteError>) {
        let counts = wanted.patches.ray_counts(wanted.sampling.rays);
        let names: Vec<String> = wanted.variants.iter().map(|v| name(wanted, v, identity)).collect();
        let mut all: Vec<Own> = vec![Own::new(); names.len()];
        let (mut first, mut cast, mut failed, n) = (0, 0, None, counts.len());
        while first < n {
            let rays = counts[first..].iter().scan(0, |sum, &count| {
                *sum += count as usize;
                Some(*sum)
            });
            let end = first + 1 + rays.take_while(|&sum| sum <= PIECE).count().saturating_sub(1);
            let path = |name: &String| self.0.join(format!("{name}-{first}-{end}.rows"));
            let read = || names.iter().map(|name| read(&path(name), end - first)).collect();
            // One of several processes may see files that the others do not yet.
            let known: Vec<Option<Own>> = team::agree(read);
            if known.iter().all(Option::is_some) {
                all.iter_mut().zip(known).for_each(|(all, own)| all.extend(own.unwrap_or_default()));
            } else {
                let (rows, rays) = cast_some(wanted, &counts, first..end);
                cast += rays;
                for ((own, all), name) in rows.into_iter().zip(&mut all).zip(&names) {
                    // A single piece is not worth a file.
                    if end - first < n && failed.is_none() {
                        failed = self.keep(path(name), &own).err();
                    }
                    all.extend(own);
                }
            }
            (wanted.tick)((end - first) as u64);
            first = end;
        }
        (all.into_iter().map(joined).collect(), cast, failed)
    }

    fn keep(&self, path: PathBuf, own: &Own) -> Result<(), WriteError> {
        make_directory(&self.0)?;
        write_whole(path, &bytes(own))
    }

    /// Removes all pieces; whatever else lies there stays.
    pub fn remove(&self) {
        for entry in fs::read_dir(&self.0).into_iter().flatten().flatten() {
            if entry.path().extension().is_some_and(|extension| extension == "rows") {
                let _ = fs::remove_file(entry.path());
            }
        }
        let _ = fs::remove_dir(&self.0);
    }
}

/// A name by all that rows of a variant depend on.
fn name(wanted: &Wanted, variant: &Variant, identity: &str) -> String {
    let mut sum = Sum::new();
    sum.bytes(identity.as_bytes());
    variant.tau.iter().for_each(|tau| sum.number(tau.to_bits().into()));
    variant.rows.iter().chain(&variant.columns).for_each(|&is| sum.number(is.into()));
    sum.number(wanted.sampling.rays.into());
    sum.number(wanted.sampling.seed.into());
    sum.digits()
}

/// The rows of some patches.
fn cast_some(wanted: &Wanted, counts: &[u32], range: std::ops::Range<usize>) -> (Vec<Own>, u64) {
    let rows = |v: &Variant| (0..v.rows.len()).map(|i| range.contains(&i) && v.rows[i]).collect();
    let some: Vec<Variant> = wanted.variants.iter().map(|v| Variant { rows: rows(v), ..v.clone() }).collect();
    let Wanted { geometry, patches, sampling, .. } = *wanted;
    let (found, rays) = cast_counts(&geometry.rays, patches, &some, sampling, counts, &|_| ());
    let found: Vec<FormFactors> = found.into_iter().map(FormFactors::whole).collect();
    let row = |f: &FormFactors, i: usize| {
        let (columns, values) = f.rows.row(i);
        (columns.to_vec(), values.to_vec(), f.row_sums[i])
    };
    let own = |f: &FormFactors| range.clone().map(|i| row(f, i)).collect();
    (found.iter().map(own).collect(), rays)
}

fn joined(own: Own) -> FormFactors {
    let row_sums = own.iter().map(|row| row.2).collect();
    FormFactors { rows: Rows::from_rows(own.into_iter().map(|row| (row.0, row.1)).collect()), row_sums }
}

/// A piece as a file: an archive of arrays, and the sum over it.
fn bytes(own: &Own) -> Vec<u8> {
    let lengths: Vec<usize> = own.iter().map(|row| row.0.len()).collect();
    let columns: Vec<u32> = own.iter().flat_map(|row| row.0.iter().copied()).collect();
    let values: Vec<f32> = own.iter().flat_map(|row| row.1.iter().copied()).collect();
    let sums: Vec<f32> = own.iter().map(|row| row.2.unwrap_or(f32::NAN)).collect();
    let mut bytes = npz_bytes(&[
        ("lengths", Array::vector(Values::I64(lengths.into()))),
        ("columns", Array::vector(Values::I32(columns.into()))),
        ("values", Array::vector(Values::F32(values.into()))),
        ("sums", Array::vector(Values::F32(sums.into()))),
    ]);
    bytes.extend(sum_of(&bytes).into_bytes());
    bytes
}

/// The rows of a file, where it is there and whole.
fn read(path: &Path, count: usize) -> Option<Own> {
    let bytes = fs::read(path).ok()?;
    let (own, sum) = bytes.split_at_checked(bytes.len().checked_sub(DIGITS)?)?;
    if sum_of(own).as_bytes() != sum {
        return None;
    }
    let mut arrays = read_npz(own).ok()?;
    let mut take = |name: &str| arrays.remove(name).map(|array| array.values);
    let (Values::I64(lengths), Values::I32(columns), Values::F32(values), Values::F32(sums)) =
        (take("lengths")?, take("columns")?, take("values")?, take("sums")?)
    else {
        return None;
    };
    let (mut columns, mut values) = (&columns[..], &values[..]);
    let row = |(&length, &sum): (&usize, &f32)| {
        let (own, rest) = columns.split_at_checked(length)?;
        let (own_values, rest_values) = values.split_at_checked(length)?;
        (columns, values) = (rest, rest_values);
        Some((own.to_vec(), own_values.to_vec(), (!sum.is_nan()).then_some(sum)))
    };
    (lengths.len() == count && sums.len() == count).then_some(())?;
    lengths.iter().zip(sums.iter()).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_come_back_whole_or_not_at_all() {
        let own: Own = vec![(vec![1, 5], vec![0.25, 0.5], Some(0.75)), (vec![], vec![], None)];
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("a.rows");
        let written = bytes(&own);
        fs::write(&path, &written).expect("it is written");
        assert_eq!(read(&path, 2), Some(own));
        assert_eq!(read(&path, 3), None);
        for length in 0..written.len() {
            fs::write(&path, &written[..length]).expect("it is written");
            assert_eq!(read(&path, 2), None, "{length}");
        }
        for at in 0..written.len() {
            let mut broken = written.clone();
            broken[at] ^= 4;
            fs::write(&path, &broken).expect("it is written");
            assert_eq!(read(&path, 2), None, "{at}");
        }
    }
}
