//! The illuminance that is wanted at points, as a table tells it.
//!
//! Not handled: illuminance wanted on the mean of an area.

use crate::decimals::Decimals;
use crate::heads::{Meaning, meaning};
use crate::relight::SolvedPoint;
use crate::rows::{Row, Rows, rows};

/// The illuminance wanted at each point that a table names, lux; at least at one. Its first row names the columns: lux
/// and name, or lux, x, y and z.
///
/// # Errors
/// The line, and what is wrong there.
pub fn aims(table: &[u8], points: &[SolvedPoint]) -> Result<Vec<Option<f64>>, (usize, String)> {
    let is_lux = |head: &String| head.eq_ignore_ascii_case("lux");
    let Rows { separator, rows } = rows(table, |heads| heads.iter().any(is_lux) && heads.len() > 1)?;
    let wrong = |row: &Row, what: &str| (row.line, what.to_owned());
    let (heads, rows) = rows.split_first().ok_or((1, "no table".to_owned()))?;
    let column = |name: &str| heads.fields.iter().position(|head| head.eq_ignore_ascii_case(name));
    let lux = column("lux").ok_or_else(|| wrong(heads, "no column `lux`"))?;
    let place = |axis: usize| heads.fields.iter().position(|head| meaning(head) == Meaning::Position(axis));
    let (name, places) = (column("name"), [0, 1, 2].map(place));
    let columns = || places.into_iter().flatten().chain([lux]);
    let numbers = rows.iter().flat_map(|row| columns().filter_map(|k| row.fields.get(k).map(String::as_str)));
    let decimals = Decimals::of(separator, numbers);
    let mut wanted = vec![None; points.len()];
    for row in rows {
        let field = |k: usize| row.fields.get(k).map(String::as_str).unwrap_or_default();
        let number = |k: usize| decimals.number(field(k)).ok();
        let is_there = |point: &SolvedPoint| match name {
            Some(name) => point.name.as_deref() == Some(field(name)),
            None => (0..3).all(|d| places[d].and_then(number).is_some_and(|x| is_near(x, point.position[d]))),
        };
        let point = points.iter().position(is_there).ok_or_else(|| wrong(row, "no point is this one"))?;
        let value = number(lux).filter(|x| *x >= 0.0);
        let refuse = || wrong(row, &format!("`{}` is not a number of 0 or more", field(lux)));
        wanted[point] = Some(value.ok_or_else(refuse)?);
    }
    if wanted.iter().all(Option::is_none) {
        return Err(wrong(heads, "no point in it"));
    }
    Ok(wanted)
}

/// Whether two coordinates are one, as far as tables write them.
fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * a.abs().max(b.abs()).max(1.0)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn points_are_found_by_name_or_place_and_what_is_wrong_has_its_line() {
        let point = |name: &str, x: f64| SolvedPoint {
            name: Some(name.to_owned()),
            position: [x, 0.5, -1.0],
            is_inside: false,
            luminaires: BTreeMap::new(),
        };
        let points = [point("desk", 1.0), point("door", 2.0)];
        let aims = |text: &str| aims(text.as_bytes(), &points);
        assert_eq!(aims("name,lux\ndoor,500\n"), Ok(vec![None, Some(500.0)]));
        assert_eq!(aims("x,y,z,LUX\n1.0000001,0.5,-1,0\n"), Ok(vec![Some(0.0), None]));
        assert_eq!(aims("X (m);Y (m);Z (m);lux\n2,0;0,5;-1,0;500,5\n"), Ok(vec![None, Some(500.5)]));
        for (text, line, what) in [
            ("", 1, "no table"),
            ("# lux\nname,x\n", 2, "no column `lux`"),
            ("name,lux\n", 1, "no point in it"),
            ("name,lux\ndoor,1\nwall,1\n", 3, "no point is this one"),
            ("x,y,z,lux\n1,0.5,,7\n", 2, "no point is this one"),
            ("name,lux\ndoor,-1\n", 2, "`-1` is not"),
        ] {
            let (at, said) = aims(text).expect_err("a broken table");
            assert!(at == line && said.contains(what), "{at}: {said}");
        }
    }
}
