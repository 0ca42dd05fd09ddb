//! Numbers of tables, with the decimal commas that spreadsheets of many countries write.
//!
//! A comma is a decimal one where it does not separate fields. `1,500` is 1.5 in a table of semicolons, which are there
//! because commas are taken; between tabs or spaces it may be 1500 as well, and is 1.5 only if another number of the
//! table can be nothing else. Between commas, quoted, it is refused.
//!
//! Not handled: separators of thousands.

/// How the numbers of a table are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Decimals {
    /// With points.
    Points,
    /// With commas.
    Commas,
    /// With commas that may stand for decimals or thousands.
    Unclear,
}

impl Decimals {
    /// Of the numbers of a table whose fields are separated by a byte.
    pub(crate) fn of<'a>(separator: u8, numbers: impl Iterator<Item = &'a str>) -> Decimals {
        let with_commas: Vec<&str> = numbers.filter(|text| text.contains(',')).collect();
        let is_sure = || separator == b';' || with_commas.iter().any(|text| is_decimal(text));
        match with_commas.len() {
            0 => Decimals::Points,
            _ if separator == b',' || !is_sure() => Decimals::Unclear,
            _ => Decimals::Commas,
        }
    }

    /// The finite number that a field holds.
    ///
    /// # Errors
    /// Why it holds none.
    pub(crate) fn number(self, field: &str) -> Result<f64, String> {
        let point = match (self, field.contains(','), field.contains('.')) {
            (Decimals::Unclear, true, _) => {
                return Err(format!("`{field}` may have a decimal comma or thousands: write it with a decimal point"));
            }
            (Decimals::Commas, _, true) => {
                return Err(format!(
                    "`{field}` has a point where the table has decimal commas: write all numbers with decimal points"
                ));
            }
            (Decimals::Commas, true, _) => field.replacen(',', ".", 1),
            _ => field.to_owned(),
        };
        let number = point.parse::<f64>().ok().filter(|x| x.is_finite());
        number.ok_or_else(|| format!("`{field}` is not a finite number"))
    }
}

/// Whether the comma of a number can be nothing but a decimal one: no three digits after it, or no digit but 0 before.
fn is_decimal(text: &str) -> bool {
    let Some((whole, rest)) = text.split_once(',') else { return false };
    let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
    let whole = whole.trim_start_matches(['-', '+']);
    !rest.contains(',') && (digits != 3 || whole.is_empty() || whole.starts_with('0') || whole.len() > 3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(separator: u8, fields: &[&str]) -> Result<Vec<f64>, String> {
        let decimals = Decimals::of(separator, fields.iter().copied());
        fields.iter().map(|field| decimals.number(field)).collect()
    }

    #[test]
    fn decimal_commas_are_read_where_they_can_be_nothing_else() {
        assert_eq!(numbers(b',', &["1.5", "-2e-3", "+7"]), Ok(vec![1.5, -0.002, 7.0]));
        assert_eq!(numbers(b';', &["1,5", "-0,25", "3", "1,5e-3"]), Ok(vec![1.5, -0.25, 3.0, 0.0015]));
        assert_eq!(numbers(b';', &["1,500", "2,000"]), Ok(vec![1.5, 2.0]));
        assert_eq!(numbers(b'\t', &["1,500", "2,00"]), Ok(vec![1.5, 2.0]));
        assert_eq!(numbers(b' ', &["1,500", "0,800"]), Ok(vec![1.5, 0.8]));
        for (separator, fields, what) in [
            (b'\t', &["1,500", "2,000"][..], "`1,500` may have"),
            (b',', &["1,5"], "`1,5` may have"),
            (b';', &["1,5", "2.5"], "`2.5` has a point"),
            (b';', &["1.234,5"], "`1.234,5` has a point"),
            (b';', &["1,234,567"], "`1,234,567` is not"),
            (b';', &["1,2", ""], "`` is not"),
            (b';', &["inf"], "`inf` is not"),
        ] {
            assert!(numbers(separator, fields).is_err_and(|error| error.contains(what)), "{fields:?}");
        }
    }
}
