//! Tables of points: positions, normals and names, from the columns that a head names or from the first seven.
//!
//! | the file has | taken for |
//! |---|---|
//! | a first row that is half words, or names x, y and z | the head: columns go by their [names](crate::heads) |
//! | a note `# x y z nx ny nz` in front of rows without a head | the head, if it names all of these |
//! | neither | x, y, z, nx, ny, nz and, if there is a seventh, a name |
//! | columns without a name, or with another | read over; behind a head without names, one text more is a name |
//! | empty rows, other notes | read over |
//! | a head without x or a normal, or two of one; a row that is longer or shorter | refused |
//! | a first row of 0, 1, 2, ..., the numbers of columns | refused |
//!
//! Not handled: normals that a table leaves out; a first column that has no place in the head.

use glam::DVec3;
use halflight::render::Sensor;

use crate::decimals::Decimals;
use crate::heads::{Head, head, names_position};
use crate::rows::{Row, Rows, leading_notes, rows};

/// Why a table has no sensors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum TableError {
    /// The line of a head, its words, and why it cannot be understood.
    Head(usize, String, String),
    /// A line, and what is wrong in it.
    Row(usize, String),
}

/// How the rows of a table are read.
struct Layout {
    head: Head,
    /// Names of the columns; none without a head.
    names: Option<Vec<String>>,
    decimals: Decimals,
}

/// The columns of a table without a head.
const PLAIN: Head = Head { position: [0, 1, 2], normal: [3, 4, 5], name: Some(6) };

/// The sensors of a table, and their names.
///
/// # Errors
/// The first thing that is wrong.
pub(crate) fn sensors(bytes: &[u8]) -> Result<(Vec<Option<String>>, Vec<Sensor>), TableError> {
    let wrong = |(line, message): (usize, String)| TableError::Row(line, format!("the line {message}"));
    let Rows { separator, rows } = rows(bytes, is_understood).map_err(wrong)?;
    let Some(first) = rows.first() else { return Err(TableError::Row(1, "there is no sensor in the file".to_owned())) };
    let (head, names, rows) = if is_head(&first.fields) {
        let refused = |why| TableError::Head(first.line, first.fields.join(", "), why);
        (head(&first.fields).map_err(refused)?, Some(first.fields.clone()), &rows[1..])
    } else if let Some((head, names)) = noted_head(bytes, first.fields.len()) {
        (head, Some(names), &rows[..])
    } else if counts(&first.fields) {
        let why = "it counts the columns and does not name them".to_owned();
        return Err(TableError::Head(first.line, first.fields.join(", "), why));
    } else {
        (PLAIN, None, &rows[..])
    };
    let columns = || head.position.into_iter().chain(head.normal);
    let numbers = rows.iter().flat_map(|row| columns().filter_map(|k| row.fields.get(k).map(String::as_str)));
    let layout = Layout { head, names, decimals: Decimals::of(separator, numbers) };
    let found = rows.iter().map(|row| layout.sensor(&row.fields).map_err(|why| TableError::Row(row.line, why)));
    let found: (Vec<_>, Vec<_>) = found.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
    if found.1.is_empty() { Err(TableError::Row(1, "there is no sensor in the file".to_owned())) } else { Ok(found) }
}

/// Whether a first row is a head that names all there has to be, or begins with six numbers.
fn is_understood(fields: &[String]) -> bool {
    (fields.len() >= 6 && fields[..6].iter().all(|field| is_number(field))) || (is_head(fields) && head(fields).is_ok())
}

/// Whether a row is a head: it names x, y and z, or no more than half of what it says are numbers.
fn is_head(fields: &[String]) -> bool {
    let all = fields.iter().filter(|field| !field.is_empty());
    let numbers = all.clone().filter(|field| is_number(field)).count();
    2 * numbers <= all.count() || names_position(fields)
}

fn is_number(field: &str) -> bool {
    field.replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// Whether fields are the numbers of their columns from 0 on, the first of which may be that of an index.
fn counts(fields: &[String]) -> bool {
    let fields = fields.strip_prefix(&[String::new()]).unwrap_or(fields);
    fields.len() >= 6 && fields.iter().enumerate().all(|(k, field)| field.parse() == Ok(k))
}

/// The last note in front of the rows that is a head of rows of so many fields, and its names.
fn noted_head(bytes: &[u8], fields: usize) -> Option<(Head, Vec<String>)> {
    let read = |(_, note): &(usize, &[u8])| {
        let row: Option<Row> = rows(note, |own| head(own).is_ok()).ok()?.rows.into_iter().next();
        let mut names = row?.fields;
        // Words before the first name: `# columns: x y z`.
        let before = names.len().saturating_sub(fields).min(first_name(&names)?);
        names.drain(..before);
        let found = head(&names).ok()?;
        let last = found.position.into_iter().chain(found.normal).max();
        last.filter(|last| *last < fields).map(|_| (found, names))
    };
    leading_notes(bytes).iter().rev().find_map(read)
}

/// The first column of a position or normal.
fn first_name(names: &[String]) -> Option<usize> {
    let found = head(names).ok()?;
    found.position.into_iter().chain(found.normal).min()
}

impl Layout {
    /// The sensor of a row, and its name.
    fn sensor(&self, fields: &[String]) -> Result<(Option<String>, Sensor), String> {
        let name = self.name(fields)?;
        let vector = |[x, y, z]: [usize; 3]| -> Result<DVec3, String> {
            let number = |k: usize| self.decimals.number(&fields[k]);
            Ok(DVec3::new(number(x)?, number(y)?, number(z)?))
        };
        let (position, normal) = (vector(self.head.position)?, vector(self.head.normal)?);
        if !(position.as_vec3().is_finite() && normal.as_vec3().is_finite()) {
            return Err("a coordinate is beyond 3e38".to_owned());
        }
        if normal.normalize_or_zero() == DVec3::ZERO {
            return Err("the normal is zero".to_owned());
        }
        Ok((name.filter(|name| !name.is_empty()).cloned(), Sensor { position, normal }))
    }

    /// The name that a row has, whose fields are as many as there have to be.
    fn name<'a>(&self, fields: &'a [String]) -> Result<Option<&'a String>, String> {
        let Some(names) = &self.names else {
            let fits = (6..=7).contains(&fields.len());
            let count = || format!("{} fields, where six or seven are needed", fields.len());
            return if fits { Ok(fields.get(6)) } else { Err(count()) };
        };
        let last = self.head.position.into_iter().chain(self.head.normal).max().unwrap_or(0);
        let more = fields.get(names.len()..).unwrap_or_default();
        let is_text = |field: &String| !field.is_empty() && field.parse::<f64>().is_err();
        match (self.head.name, more) {
            _ if last >= fields.len() => Err(format!("{} fields, where the head has {}", fields.len(), names.len())),
            (None, [name]) if is_text(name) => Ok(Some(name)),
            (_, more) if more.iter().any(|field| !field.is_empty()) => {
                Err(format!("{} fields under a head of {}: name every column", fields.len(), names.len()))
            }
            (None, _) => Ok(fields.get(last + 1).filter(|name| {
                let is_last = last + 2 == names.len() && names[last + 1].is_empty();
                is_last && is_text(name)
            })),
            (Some(k), _) => Ok(fields.get(k)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Name, position and normal.
    type Point = (String, [f64; 3], [f64; 3]);

    fn read(text: &str) -> Result<Vec<Point>, TableError> {
        let (names, sensors) = sensors(text.as_bytes())?;
        let all = names.into_iter().zip(sensors);
        let row = |(name, own): (Option<String>, Sensor)| {
            (name.unwrap_or_default(), own.position.to_array(), own.normal.to_array())
        };
        Ok(all.map(row).collect())
    }

    /// Two points as every table below has them.
    fn two(names: [&str; 2]) -> Vec<Point> {
        let [a, b] = names.map(str::to_owned);
        vec![(a, [2.0, 0.75, 1.0], [0.0, 1.0, 0.0]), (b, [0.5, 1.5, -2.5], [1.0, 0.0, -0.5])]
    }

    #[test]
    fn columns_are_found_by_their_names() {
        for text in [
            "2,.75,1,0,1,0\n.5,1.5,-2.5,1,0,-.5\n",
            "x,y,z,nx,ny,nz\n2,.75,1,0,1,0\n.5,1.5,-2.5,1,0,-.5\n",
            "nx,ny,nz,x,y,z\n0,1,0,2,.75,1\n1,0,-.5,.5,1.5,-2.5\n",
            ",x,y,z,nx,ny,nz\n0,2,.75,1,0,1,0\n1,.5,1.5,-2.5,1,0,-.5\n",
            "Unnamed: 0,x,y,z,nx,ny,nz\n0,2,.75,1,0,1,0\n1,.5,1.5,-2.5,1,0,-.5\n",
            "\u{feff}\"index\",\"X (m)\",\"Y (m)\",\"Z (m)\",\"Normal X\",\"Normal Y\",\"Normal Z\"\r\n\
             0,2,.75,1,0,1,0\r\n1,.5,1.5,-2.5,1,0,-.5\r\n",
            "Z;Y;X;n.z;n.y;n.x;lux\n1;0,75;2;0;1;0;500,5\n-2,5;1,5;0,5;-0,5;0;1;\n",
            "x y z dir_x dir_y dir_z\n 2 .75 1  0 1 0\n.5 1.5 -2.5\t1 0 -.5\n",
            "2 0,75 1 0 1 0\n0,5 1,5 -2,5 1 0 -0,5\n",
            "2\t.75\t1\t0\t1\t0\n.5\t1.5\t-2.5\t1\t0\t-.5\n",
            "Normals:0,Normals:1,Normals:2,Points:0,Points:1,Points:2\n0,1,0,2,.75,1\n1,0,-.5,.5,1.5,-2.5\n",
            "# nx, ny, nz, x, y, z\n# by hand\n0 1 0 2 .75 1\n1 0 -.5 .5 1.5 -2.5\n",
            "#,x,y,z,nx,ny,nz\n0,2,.75,1,0,1,0\n1,.5,1.5,-2.5,1,0,-.5\n",
            "# columns: x y z nx ny nz\n2 .75 1 0 1 0\n.5 1.5 -2.5 1 0 -.5\n",
            "# x and y, z are metres\n2 .75 1 0 1 0\n.5 1.5 -2.5 1 0 -.5\n",
            "x,y,z,nx,ny,nz,2024\n2,.75,1,0,1,0,7\n.5,1.5,-2.5,1,0,-.5,7\n,,,,,,\n",
        ] {
            assert_eq!(read(text), Ok(two(["", ""])), "{text}");
        }
    }

    #[test]
    fn names_are_kept() {
        for text in [
            "2,.75,1,0,1,0,desk\n.5,1.5,-2.5,1,0,-.5,\"wall, left\"\n",
            "name,x,y,z,nx,ny,nz,irradiance_r,inside\ndesk,2,.75,1,0,1,0,7,0\n\"wall, left\",.5,1.5,-2.5,1,0,-.5,7,1\n",
            "x,y,Label,z,nx,ny,nz,id\n2,.75,desk,1,0,1,0,17\n.5,1.5,\"wall, left\",-2.5,1,0,-.5,18\n",
            "x y z nx ny nz ID\n2 .75 1 0 1 0 desk\n.5 1.5 -2.5 1 0 -.5 \"wall, left\"\n",
            "x;y;z;nx;ny;nz\n2;.75;1;0;1;0;desk\n.5;1.5;-2.5;1;0;-.5;wall, left\n",
            "x;y;z;nx;ny;nz;\n2;.75;1;0;1;0;desk\n.5;1.5;-2.5;1;0;-.5;wall, left\n",
        ] {
            assert_eq!(read(text), Ok(two(["desk", "wall, left"])), "{text}");
        }
    }

    #[test]
    fn what_cannot_be_understood_is_refused_with_its_words() {
        for (text, line, what) in [
            ("x,y,z\n1,2,3\n", 1, "no column is nx"),
            ("# a\nroom 5\nx,y,z,nx,ny,nz\n1,2,3,0,1,0\n", 2, "no column is x"),
            ("east;north;height;nx;ny;nz\n1;2;3;0;1;0\n", 1, "no column is x"),
            ("x,y,z,nx,ny,nz,X\n1,2,3,0,1,0,1\n", 1, "`x` and `X` both are x"),
            ("0,1,2,3,4,5\n1,2,3,0,1,0\n", 1, "counts the columns"),
            (",0,1,2,3,4,5\n0,1,2,3,0,1,0\n", 1, "counts the columns"),
            ("x y z Normal X Normal Y Normal Z\n1 2 3 0 1 0\n", 1, "both are x"),
        ] {
            let found = read(text).expect_err("a head");
            assert!(matches!(&found, TableError::Head(at, _, why) if *at == line && why.contains(what)), "{found:?}");
        }
        for (text, line, what) in [
            ("x,y,z,nx,ny,nz\n", 1, "no sensor"),
            ("x,y,z,nx,ny,nz\n1,2,3,0,1\n", 2, "5 fields, where the head has 6"),
            ("x y z nx ny nz\n1 2 3 0 1 0 7\n", 2, "7 fields under a head of 6"),
            ("x,y,z,nx,ny,nz,name\n1,2,3,0,1,0,a,b\n", 2, "8 fields under a head of 7"),
            ("x;y;z;nx;ny;nz\n1,5;2;3;0;1;0\n1.5;2;3;0;1;0\n", 3, "`1.5` has a point"),
            ("x,y,z,nx,ny,nz\nm,m,m,,,\n", 2, "`m` is not a finite number"),
            ("1,5,2,0,0,8,0,1,0\n", 1, "9 fields"),
            ("3\n1 2 3 0 1 0\n", 1, "1 fields"),
        ] {
            let found = read(text).expect_err("a row");
            assert!(matches!(&found, TableError::Row(at, why) if *at == line && why.contains(what)), "{found:?}");
        }
    }
}
