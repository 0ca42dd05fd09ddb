//! Radiances of a sky's patches, as Radiance's programs order them, from rows of text or a column of a matrix.
//!
//! The first is the ground, all below the horizon; then rows of Reinhart's MF:n from the horizon up, each from north
//! clockwise seen from above; the cap about the zenith comes last: 2 + 144 n² in all, 146 (Tregenza), 578, 1298, 2306.
//! A file has a row `R G B` each, W/(m² sr); blank lines and what follows `#` do not count. One that begins with `#?`
//! is a matrix of Radiance's, a column a time ([`RadianceMatrix`]).
//!
//! Not handled: other divisions of the sky, divisions of the ground.

use crate::light::Rgb;
use crate::scene::emission::radiance_matrix::RadianceMatrix;
use crate::scene::error::{Place, SceneError, shorten};
use crate::scene::sky_cells::Sky;

/// Radiance of each patch of a sky, W/(m² sr).
#[derive(Clone, Debug, PartialEq)]
pub struct SkyPatches {
    n: u32,
    /// In Radiance's order.
    radiances: Vec<Rgb>,
}

impl SkyPatches {
    /// Patches in Radiance's order; none unless there are 2 + 144 n², n from 1 to [`Sky::FINEST`], and all radiances
    /// are finite and not negative.
    pub fn new(radiances: Vec<Rgb>) -> Option<SkyPatches> {
        let n = (1..=Sky::FINEST).find(|n| radiances.len() as u32 == 2 + 144 * n * n)?;
        let is_light = |own: &Rgb| own.is_finite() && own.min_element() >= 0.0;
        radiances.iter().all(is_light).then_some(SkyPatches { n, radiances })
    }

    /// The n of MF:n.
    pub fn fineness(&self) -> u32 {
        self.n
    }

    /// The cap, then rows from the zenith down, the ground last.
    pub(super) fn zenith_first(&self) -> impl Iterator<Item = Rgb> {
        let rows = Sky::reinhart(self.n).into_iter().map(|row| row.cells as usize);
        let mut end = self.radiances.len();
        rows.flat_map(move |cells| {
            end -= cells;
            self.radiances[end..end + cells].to_vec()
        })
    }

    /// Patches of a file's bytes; of a matrix those of a column, from 1, which one of several columns needs.
    ///
    /// # Errors
    /// The first mistake, with its line, or its row in a matrix.
    pub fn parse(file: &str, bytes: &[u8], column: Option<usize>) -> Result<SkyPatches, SceneError> {
        let (item, rows) = if RadianceMatrix::is_one(bytes) {
            ("row", of_matrix(bytes, column).map_err(|message| wrong(Place::line(file, 1), message))?)
        } else if column.is_some() {
            return Err(wrong(Place::line(file, 1), "is no matrix of Radiance's, so that it has no `column`".into()));
        } else {
            ("line", of_text(file, &String::from_utf8_lossy(bytes))?)
        };
        for (number, row) in &rows {
            if let Some(value) = row.iter().find(|x| !(0.0..=f64::from(f32::MAX)).contains(*x)) {
                let message = format!("the radiance {value} of a patch must be finite and not negative");
                return Err(wrong(Place::item(file, item, *number), message));
            }
        }
        let last = rows.last().map_or(1, |(number, _)| *number);
        let radiances: Vec<Rgb> = rows.into_iter().map(|(_, row)| row.map(|x| x as f32).into()).collect();
        let count = radiances.len();
        SkyPatches::new(radiances).ok_or_else(|| {
            let message =
                format!("ends after {count} patches; a sky has 146, 578, 1298, 2306 or 2 + 144 n², n up to 8");
            wrong(Place::item(file, item, last), message)
        })
    }
}

fn wrong(place: Place, message: String) -> SceneError {
    SceneError::SkyPatches { place, message }
}

/// Numbers of one patch, after the number of their line or row.
type Row = (usize, [f64; 3]);

/// The rows of a text.
fn of_text(file: &str, text: &str) -> Result<Vec<Row>, SceneError> {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or("")).zip(1..);
    let row = |(line, number): (&str, usize)| {
        let here = |message| wrong(Place::line(file, number), message);
        let word = |word: &str| word.parse().map_err(|_| here(format!("`{}` is no number", shorten(word))));
        let numbers = line.split_whitespace().map(word).collect::<Result<Vec<f64>, _>>()?;
        let row = <[f64; 3]>::try_from(numbers);
        row.map(|row| (number, row)).map_err(|own| here(format!("has {} numbers; a patch has three, R G B", own.len())))
    };
    lines.filter(|(line, _)| !line.trim().is_empty()).map(row).collect()
}

/// The rows of a column of a matrix.
fn of_matrix(bytes: &[u8], column: Option<usize>) -> Result<Vec<Row>, String> {
    let RadianceMatrix { columns, values, .. } = RadianceMatrix::parse(bytes)?;
    let column = match column {
        Some(own) if (1..=columns).contains(&own) => own,
        Some(own) => return Err(format!("has {columns} columns, and no column {own}: they count from 1")),
        None if columns == 1 => 1,
        None => {
            return Err(format!("has {columns} columns, each the sky of a time: give `column`, from 1 to {columns}"));
        }
    };
    let own = values.iter().skip(column - 1).step_by(columns);
    Ok((1..).zip(own.map(|row| row.map(f64::from))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ground comes last and the cap first; the first of a row stays the first.
    #[test]
    fn rows_are_turned_and_cells_are_not() {
        let text: String = (0..146).map(|k| format!("{k} 0 1e-3 # of a patch\n\n")).collect();
        let patches = SkyPatches::parse("sky.txt", text.as_bytes(), None).expect("patches");
        let order: Vec<f32> = patches.zenith_first().map(|own| own.x).collect();
        assert_eq!((order.len(), patches.fineness()), (146, 1));
        assert_eq!([order[0], order[1], order[6], order[7], order[115], order[145]], [145., 139., 144., 127., 1., 0.]);
    }

    #[test]
    fn a_matrix_has_a_column() {
        let head = "#?RADIANCE\nNROWS=146\nNCOLS=2\nNCOMP=3\nFORMAT=ascii\n\n";
        let text: String = (0..292).map(|k| format!("{k} {k} {k}\n")).collect();
        let read = |column| SkyPatches::parse("sky.mtx", format!("{head}{text}").as_bytes(), column);
        assert_eq!(read(Some(2)).expect("patches").radiances[1], Rgb::splat(3.0));
        for (column, what) in [(None, "from 1 to 2"), (Some(3), "no column 3"), (Some(0), "no column 0")] {
            let error = read(column).expect_err("no column").to_string();
            assert!(error.starts_with("sky.mtx, line 1: ") && error.contains(what), "{error}");
        }
    }
}
