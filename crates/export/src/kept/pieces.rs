//! Rows of F kept while they are cast, so that a run that was interrupted goes on.
//!
//! Beside the folder DIR that is being made lies `DIR.casting`, with one file for each [`PIECE`] rays: the rows of some
//! patches for one choice of tau, and no entry in the others. A file's name has a sum over all that its rows depend on:
//! a piece of something else is not asked for, and one that is damaged is cast again. The folder goes away once DIR is
//! in its place.
//!
//! Not handled: two runs that make one folder at once, which write the same bytes; pieces that cannot be written, whose
//! rows the next run casts again.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::kept::factors_file::{read_factors, write_factors};
use crate::kept::identity::sum_of;
use halflight::form_factors::{FormFactors, Rows, Variant, cast_counts};
use halflight::light::team;
use halflight::operator::Wanted;
use halflight::pictures::make_directory;

/// Rays of a piece, about: some seconds.
const PIECE: usize = 1 << 22;

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

    /// Casts the rows of all variants, but for those that lie there already; also returns how many rays were cast.
    /// `sum` is that over the scene and its patches.
    pub fn cast(&self, wanted: &Wanted, sum: &str) -> (Vec<FormFactors>, u64) {
        let counts = wanted.patches.ray_counts(wanted.sampling.rays);
        let named = |v: &Variant| sum_of(&(sum, wanted.sampling.rays, wanted.sampling.seed, &v.tau));
        let names: Vec<String> = wanted.variants.iter().map(named).collect();
        let mut all: Vec<Own> = vec![Own::new(); names.len()];
        let (mut first, mut cast) = (0, 0);
        while first < counts.len() {
            let range = first..end_of_piece(&counts, first);
            let paths: Vec<PathBuf> =
                names.iter().map(|name| self.0.join(format!("{name}-{}-{}.npz", range.start, range.end))).collect();
            let read = || paths.iter().map(|path| read_piece(path, counts.len(), &range)).collect();
            // One of several processes may see files that the others do not yet.
            let known: Option<Vec<Own>> = team::agree(read);
            let own = known.unwrap_or_else(|| {
                let (found, rays) = cast_some(wanted, &counts, &range);
                cast += rays;
                // A single piece is not worth a file.
                if range.len() < counts.len() && make_directory(&self.0).is_ok() {
                    found.iter().zip(&paths).for_each(|(factors, path)| drop(write_factors(path, factors)));
                }
                found.iter().map(|factors| rows(factors, &range)).collect()
            });
            all.iter_mut().zip(own).for_each(|(all, own)| all.extend(own));
            (wanted.tick)(range.len() as u64);
            first = range.end;
        }
        (all.into_iter().map(joined).collect(), cast)
    }

    /// Removes all pieces; whatever else lies there stays.
    pub fn remove(&self) {
        for entry in fs::read_dir(&self.0).into_iter().flatten().flatten() {
            if entry.path().extension().is_some_and(|extension| extension == "npz") {
                let _ = fs::remove_file(entry.path());
            }
        }
        let _ = fs::remove_dir(&self.0);
    }
}

/// The end of the piece that begins with a patch: one patch at least.
fn end_of_piece(counts: &[u32], first: usize) -> usize {
    let rays = counts[first..].iter().scan(0, |sum, &count| {
        *sum += count as usize;
        Some(*sum)
    });
    first + rays.take_while(|&sum| sum <= PIECE).count().max(1)
}

/// The rows of some patches.
fn cast_some(wanted: &Wanted, counts: &[u32], range: &Range<usize>) -> (Vec<FormFactors>, u64) {
    let rows = |v: &Variant| (0..v.rows.len()).map(|i| range.contains(&i) && v.rows[i]).collect();
    let some: Vec<Variant> = wanted.variants.iter().map(|v| Variant { rows: rows(v), ..v.clone() }).collect();
    let Wanted { geometry, patches, sampling, .. } = *wanted;
    let (found, rays) = cast_counts(&geometry.rays, patches, &some, sampling, counts, &|_| ());
    (found.into_iter().map(FormFactors::whole).collect(), rays)
}

fn rows(factors: &FormFactors, range: &Range<usize>) -> Own {
    let row = |i: usize| {
        let (columns, values) = factors.rows.row(i);
        (columns.to_vec(), values.to_vec(), factors.row_sums[i])
    };
    range.clone().map(row).collect()
}

/// The rows of a file, where it is there and whole.
fn read_piece(path: &Path, patches: usize, range: &Range<usize>) -> Option<Own> {
    Some(rows(&read_factors(path, patches).ok()?, range))
}

fn joined(own: Own) -> FormFactors {
    let row_sums = own.iter().map(|row| row.2).collect();
    FormFactors { rows: Rows::from_rows(own.into_iter().map(|row| (row.0, row.1)).collect()), row_sums }
}
