//! What objects exchange by radiation: Gebhart's factors and conductances, and the matrix of the net-radiation method.
//!
//! ```text
//! B_ij = F_ij eps_j + sum over k of F_ik (1 - eps_k) B_kj       share of what i emits that j absorbs, any way
//! G_ij = A_i eps_i B_ij                                          conductance, the file's units squared
//! Q_i  = sum over j of M_ij sigma T_j⁴,   M = diag(A eps) (I - B)   net power that leaves i
//! ```
//!
//! The sky is a black column, from which nothing comes back: its share of Q is `-G_i,sky sigma T_sky⁴`. In a closed
//! scene rows of B add up to 1, and G is symmetric where F is reciprocal; F is taken as it was found, and what is
//! missing of both is told. Objects are grey, diffuse, and of one temperature and one radiosity each: divide what is
//! not.
//!
//! Sources: B. Gebhart, *A new method for calculating radiant exchanges*, ASHRAE Trans. 65, 1959; M. F. Modest,
//! *Radiative heat transfer*, 3rd ed. 2013, chapter 5. Not handled: gases, spectra, directions.

use nalgebra::DMatrix;

use crate::factor_matrix::FactorMatrix;

/// What objects exchange.
#[derive(Clone, Debug)]
pub struct Exchange {
    /// Names of the n objects.
    pub rows: Vec<String>,
    /// Names of what absorbs: the objects and, where there is one, the sky.
    pub columns: Vec<String>,
    /// Emissivities of the objects.
    pub emissivities: Vec<f64>,
    /// B, row by row, the columns as named.
    pub gebhart: Vec<f64>,
    /// G, likewise, the file's units squared.
    pub conductances: Vec<f64>,
    /// M, likewise, the file's units squared.
    pub net: Vec<f64>,
    /// Sums of the rows of B: 1 in a closed scene.
    pub row_sums: Vec<f64>,
    /// Of each object the largest `|G_ij - G_ji|` over the larger of the two.
    pub reciprocity: Vec<f64>,
}

/// Why there is no exchange.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExchangeError {
    /// The table of emissivities is wrong there.
    #[error("line {line}: {what}")]
    Line {
        /// The line.
        line: u64,
        /// What is wrong.
        what: String,
    },
    /// An object has no emissivity.
    #[error("`{0}` has no emissivity")]
    Missing(String),
    /// White surfaces that nothing leaves have no balance.
    #[error("what is reflected inside of the scene never leaves: the equations have no single solution")]
    Singular,
}

/// The emissivities of objects by name from a table of two columns, an object and its emissivity above 0 and up to 1; a
/// first row without a number is a head.
///
/// [`ExchangeError`] with the line, or the object that has none.
pub fn emissivities(table: &[u8], names: &[String]) -> Result<Vec<f64>, ExchangeError> {
    let mut reader = csv::ReaderBuilder::new();
    let mut reader =
        reader.has_headers(false).flexible(true).comment(Some(b'#')).trim(csv::Trim::All).from_reader(table);
    let mut found = vec![None; names.len()];
    for (row, record) in reader.records().enumerate() {
        let wrong = |line: u64, what: String| ExchangeError::Line { line, what };
        let record = record
            .map_err(|error| wrong(error.position().map_or(1, csv::Position::line), "is no row of text".into()))?;
        let line = record.position().map_or(1, csv::Position::line);
        let (name, text) = (record.get(0).unwrap_or_default(), record.get(1).unwrap_or_default());
        let Ok(value) = text.parse::<f64>() else {
            if row == 0 && record.len() == 2 {
                continue;
            }
            return Err(wrong(line, format!("`{text}` is no emissivity; a row is an object and its emissivity")));
        };
        if !(value > 0.0 && value <= 1.0) {
            return Err(wrong(line, format!("the emissivity {value} of `{name}` is not above 0 and up to 1")));
        }
        let Some(k) = names.iter().position(|own| own == name) else {
            return Err(wrong(line, format!("there is no object `{name}`; there are {}", names.join(", "))));
        };
        if found[k].replace(value).is_some() {
            return Err(wrong(line, format!("`{name}` has an emissivity already")));
        }
    }
    let missing = |(k, own): (usize, Option<f64>)| own.ok_or_else(|| ExchangeError::Missing(names[k].clone()));
    found.into_iter().enumerate().map(missing).collect()
}

impl Exchange {
    /// That of form factors, and an emissivity for each object.
    ///
    /// [`ExchangeError::Singular`].
    ///
    /// If there is not one emissivity an object.
    pub fn of(matrix: &FactorMatrix, emissivities: &[f64]) -> Result<Exchange, ExchangeError> {
        let (n, m) = (matrix.rows.len(), matrix.columns.len());
        assert_eq!(emissivities.len(), n);
        let f = DMatrix::from_row_slice(n, m, &matrix.values);
        let absorbed = |j: usize| emissivities.get(j).copied().unwrap_or(1.0);
        let system = DMatrix::from_fn(n, n, |i, k| f64::from(u8::from(i == k)) - f[(i, k)] * (1.0 - emissivities[k]));
        let right = DMatrix::from_fn(n, m, |i, j| f[(i, j)] * absorbed(j));
        let b =
            system.lu().solve(&right).filter(|b| b.iter().all(|own| own.is_finite())).ok_or(ExchangeError::Singular)?;
        let sent = |i: usize| matrix.areas[i] * emissivities[i];
        let all = || (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
        let g = |i: usize, j: usize| sent(i) * b[(i, j)];
        let net = |i: usize, j: usize| if i == j { sent(i) - g(i, j) } else { -g(i, j) };
        let apart = |i: usize, j: usize| {
            let most = g(i, j).max(g(j, i));
            if most > 0.0 { (g(i, j) - g(j, i)).abs() / most } else { 0.0 }
        };
        Ok(Exchange {
            rows: matrix.rows.clone(),
            columns: matrix.columns.clone(),
            emissivities: emissivities.to_vec(),
            gebhart: all().map(|(i, j)| b[(i, j)]).collect(),
            conductances: all().map(|(i, j)| g(i, j)).collect(),
            net: all().map(|(i, j)| net(i, j)).collect(),
            row_sums: (0..n).map(|i| b.row(i).sum()).collect(),
            reciprocity: (0..n).map(|i| (0..n).map(|j| apart(i, j)).fold(0.0, f64::max)).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(areas: &[f64], columns: &[&str], values: &[f64]) -> FactorMatrix {
        let columns: Vec<String> = columns.iter().map(|&name| name.to_owned()).collect();
        let n = areas.len();
        FactorMatrix {
            rows: columns[..n].to_vec(),
            columns,
            values: values.to_vec(),
            errors: vec![0.0; values.len()],
            areas: areas.to_vec(),
            closure: vec![0.0; n],
            reciprocity: vec![0.0; n * n],
        }
    }

    /// A body within another: `Q = sigma (T1⁴ - T2⁴) / (1/(A1 e1) + (1 - e2) / (A2 e2))` (Modest, example 5.3).
    #[test]
    fn two_surfaces_exchange_what_the_textbook_has() {
        let (areas, [e1, e2]) = ([1.0, 3.0], [0.3, 0.8]);
        let f = matrix(&areas, &["body", "shell"], &[0.0, 1.0, 1.0 / 3.0, 2.0 / 3.0]);
        let found = Exchange::of(&f, &[e1, e2]).expect("exchange");
        let exact = 1.0 / (1.0 / (areas[0] * e1) + (1.0 - e2) / (areas[1] * e2));
        assert!((found.conductances[1] - exact).abs() < 1e-12 && (found.net[1] + exact).abs() < 1e-12);
        assert!(found.row_sums.iter().all(|sum| (sum - 1.0).abs() < 1e-12));
        assert!(found.reciprocity.iter().all(|own| *own < 1e-12));
    }

    /// A plate of emissivity e towards the sky alone loses A e.
    #[test]
    fn the_sky_is_black() {
        let found = Exchange::of(&matrix(&[2.0], &["plate", "sky"], &[0.0, 1.0]), &[0.4]).expect("exchange");
        assert!((found.conductances[1] - 0.8).abs() < 1e-12 && (found.net[1] + 0.8).abs() < 1e-12);
        assert!((found.net[0] - 0.8).abs() < 1e-12);
    }

    #[test]
    fn tables_are_read_and_what_is_wrong_is_named() {
        let names = ["a".to_owned(), "b".to_owned()];
        assert_eq!(emissivities(b"object,emissivity\nb,0.5\n# note\na, 1\n", &names), Ok(vec![1.0, 0.5]));
        for (table, what) in [
            ("a,0.5\n", "`b` has no"),
            ("a,0.5\nb,x\n", "line 2"),
            ("a,0.5\nb,0\n", "line 2: the emissivity 0"),
            ("a,0.5\nb,NaN\n", "line 2: the emissivity NaN"),
            ("a,0.5\nc,0.5\n", "no object `c`"),
            ("a,0.5\na,0.5\n", "already"),
        ] {
            let error = emissivities(table.as_bytes(), &names).expect_err("a broken table").to_string();
            assert!(error.contains(what), "{error}");
        }
    }
}
