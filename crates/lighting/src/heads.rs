//! What the names in a table's head mean: which columns are a position, a normal and a name.
//!
//! A name is read as words. One of x, y and z has to be among them (0, 1 or 2 after a plural, as ParaView writes
//! `Normals:0`), and the others say of what: `X`, `pos_x`, `Points:0` and `X (m)` are positions, `Nx`, `Normal X`,
//! `n.x` and `normal_x` normals, `dir x` and `vx` directions, which stand for normals where there are none. All else is
//! read over: an index, what was measured, colours.
//!
//! Not handled: units, which are those of the scene's file whatever stands in brackets; words of other languages.

/// Columns of a table of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Head {
    /// Of x, y, z.
    pub position: [usize; 3],
    /// Of nx, ny, nz.
    pub normal: [usize; 3],
    /// Of what points are called by.
    pub name: Option<usize>,
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Meaning {
    /// A coordinate of the position: 0, 1, 2 for x, y, z.
    Position(usize),
    /// A coordinate of the normal.
    Normal(usize),
    /// A coordinate of a direction, which stands for the normal where there is none.
    Direction(usize),
    /// What a point is called by; the least of several counts.
    Name(usize),
    /// Something else.
    Other,
}

/// What a word says that a coordinate is of.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Nothing,
    Position,
    Direction,
    Normal,
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// The columns that a head names.
///
/// # Errors
/// What it has none or two of.
pub(crate) fn head(fields: &[String]) -> Result<Head, String> {
    let meanings: Vec<Meaning> = fields.iter().map(|field| meaning(field)).collect();
    let position = three(fields, &meanings, Meaning::Position, AXES)?;
    let has = |kind: fn(usize) -> Meaning| (0..3).any(|axis| meanings.contains(&kind(axis)));
    let kind = if !has(Meaning::Normal) && has(Meaning::Direction) { Meaning::Direction } else { Meaning::Normal };
    let normal = three(fields, &meanings, kind, ["nx", "ny", "nz"])?;
    let rank = |meaning: &Meaning| if let Meaning::Name(rank) = meaning { Some(*rank) } else { None };
    let names = meanings.iter().enumerate().filter_map(|(k, meaning)| Some((rank(meaning)?, k)));
    Ok(Head { position, normal, name: names.min().map(|(_, k)| k) })
}

/// Whether a row has names for all of x, y and z.
pub(crate) fn names_position(fields: &[String]) -> bool {
    let has = |axis: usize| fields.iter().any(|field| meaning(field) == Meaning::Position(axis));
    (0..3).all(has)
}

/// The columns of three coordinates.
fn three(
    fields: &[String],
    meanings: &[Meaning],
    kind: fn(usize) -> Meaning,
    names: [&str; 3],
) -> Result<[usize; 3], String> {
    let mut found = [0; 3];
    for axis in 0..3 {
        let own: Vec<usize> = (0..fields.len()).filter(|&k| meanings[k] == kind(axis)).collect();
        found[axis] = match own[..] {
            [one] => one,
            [] => return Err(format!("no column is {}", names[axis])),
            [a, b, ..] => return Err(format!("`{}` and `{}` both are {}", fields[a], fields[b], names[axis])),
        };
    }
    Ok(found)
}

/// What a column of a name holds.
pub(crate) fn meaning(field: &str) -> Meaning {
    let words = words(field);
    if let Some(rank) = rank(&words) {
        return Meaning::Name(rank);
    }
    let (mut axis, mut kind) = (None, Kind::Nothing);
    for word in &words {
        let Some((of, own)) = coordinate(word).or_else(|| digit(word, &words)) else { return Meaning::Other };
        if own.is_some() && axis.is_some() {
            return Meaning::Other;
        }
        (axis, kind) = (axis.or(own), kind.max(of));
    }
    match (axis, kind) {
        (None, _) | (_, Kind::Nothing) => Meaning::Other,
        (Some(axis), Kind::Position) => Meaning::Position(axis),
        (Some(axis), Kind::Direction) => Meaning::Direction(axis),
        (Some(axis), Kind::Normal) => Meaning::Normal(axis),
    }
}

/// The words of a name in lower case, without what stands in brackets: they end at what is no letter and no digit, and
/// where a capital follows a small letter.
fn words(field: &str) -> Vec<String> {
    let (mut words, mut depth, mut before) = (vec![String::new()], 0, ' ');
    for c in field.chars() {
        depth += i32::from(matches!(c, '(' | '[' | '{'));
        let begins = c.is_uppercase() && before.is_lowercase();
        if !c.is_alphanumeric() || begins || depth > 0 {
            words.push(String::new());
        }
        if c.is_alphanumeric() && depth == 0 {
            words.last_mut().expect("one").extend(c.to_lowercase());
        }
        depth -= i32::from(matches!(c, ')' | ']' | '}'));
        before = c;
    }
    words.retain(|word| !word.is_empty());
    // A unit after the coordinate: `x_m`.
    if words.len() > 1 && matches!(words[words.len() - 1].as_str(), "m" | "mm" | "cm" | "ft" | "in") {
        words.pop();
    }
    words
}

/// How well a column of these words names its row, from 0 on; none where it is no name.
fn rank(words: &[String]) -> Option<usize> {
    let all: Vec<&str> = words.iter().map(String::as_str).collect();
    let last = match all[..] {
        [one] => one,
        ["point" | "points" | "sensor" | "sensors" | "test" | "grid" | "measurement" | "meas", one] => one,
        _ => return None,
    };
    const NAMES: [&[&str]; 4] = [
        &["name", "names", "pointname", "sensorname"],
        &["label", "labels", "title", "tag"],
        &["id", "ids", "ident", "identifier", "pointid", "sensorid"],
        &["point", "sensor"],
    ];
    NAMES.iter().position(|names| names.contains(&last))
}

/// What a word says: of what a coordinate is, and which; none where it says something else.
fn coordinate(word: &str) -> Option<(Kind, Option<usize>)> {
    let axis = |text: &str| AXES.iter().position(|axis| *axis == text);
    if let Some(own) = axis(word) {
        return Some((Kind::Position, Some(own)));
    }
    if let Some(kind) = kind(word) {
        return Some((kind, None));
    }
    // In one word: `nx`, `posx`, `xdir`.
    let (first, last) = (word.get(..1)?, word.get(word.len() - 1..)?);
    let ends = axis(last).and_then(|own| Some((kind(&word[..word.len() - 1])?, Some(own))));
    ends.or_else(|| axis(first).and_then(|own| Some((kind(&word[1..])?, Some(own)))))
}

/// The coordinate that a digit after a plural is.
fn digit(word: &str, words: &[String]) -> Option<(Kind, Option<usize>)> {
    let own = ["0", "1", "2"].iter().position(|digit| *digit == word)?;
    let is_plural = words[0].ends_with('s') && kind(&words[0]).is_some();
    is_plural.then_some((Kind::Nothing, Some(own)))
}

/// What a word says that coordinates are of.
fn kind(word: &str) -> Option<Kind> {
    Some(match word {
        "n" | "normal" | "normals" | "norm" | "norms" | "nrm" | "nml" | "facenormal" | "vn" => Kind::Normal,
        "d" | "v" | "dir" | "dirs" | "direction" | "directions" | "vec" | "vecs" | "vector" | "vectors" | "orient"
        | "orientation" | "facing" | "aim" => Kind::Direction,
        "p" | "pos" | "position" | "positions" | "pt" | "point" | "points" | "coord" | "coords" | "coordinate"
        | "coordinates" | "loc" | "location" | "locations" | "org" | "orig" | "origin" | "place" | "sensor"
        | "world" | "surface" | "vertex" | "test" | "axis" => Kind::Position,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(text: &str) -> Vec<String> {
        text.split(',').map(str::to_owned).collect()
    }

    #[test]
    fn names_mean_what_people_mean_by_them() {
        for text in [
            "x",
            "X",
            "X (m)",
            "x [mm]",
            "pos_x",
            "PosX",
            "position.x",
            "Position X",
            "px",
            "p.x",
            "xorg",
            "point x",
            "Points:0",
            "Points_0",
            "x_m",
            "x-coordinate",
            "Sensor Position X",
            "xpos",
            " x ",
        ] {
            assert_eq!(meaning(text), Meaning::Position(0), "{text}");
        }
        for text in [
            "ny",
            "Ny",
            "NY",
            "N_Y",
            "n.y",
            "Normal Y",
            "normal_y",
            "normaly",
            "NormalY",
            "norm y",
            "Normals:1",
            "y normal",
            "yn",
            "Normal vector y",
            "ny (-)",
            "Surface normal Y",
            "normal[y]".replace(['[', ']'], " ").as_str(),
        ] {
            assert_eq!(meaning(text), Meaning::Normal(1), "{text}");
        }
        for text in ["dir z", "DirZ", "vz", "Vz", "v_z", "direction.z", "zdir", "dz", "vec_z", "VectorZ"] {
            assert_eq!(meaning(text), Meaning::Direction(2), "{text}");
        }
        for text in [
            "",
            "index",
            "Unnamed: 0",
            "#",
            "lux",
            "E_x_y",
            "room",
            "bounce_0_r",
            "irradiance_r",
            "n",
            "normal",
            "x1",
            "uv_x",
            "max x",
            "height",
            "xyz",
            "nxy",
            "0",
            "2",
            "é",
            "illuminance (lx)",
            "x error",
            "zone",
            "level_0",
            "sensor 1",
            "Points_Magnitude",
        ] {
            assert_eq!(meaning(text), Meaning::Other, "{text}");
        }
        assert_eq!(["Name", "label", "Point ID", "sensor"].map(meaning), [0, 1, 2, 3].map(Meaning::Name));
    }

    #[test]
    fn columns_stand_in_any_order_and_others_are_read_over() {
        let found = |text: &str| head(&fields(text)).expect("a head");
        let plain = Head { position: [0, 1, 2], normal: [3, 4, 5], name: None };
        assert_eq!(found("x,y,z,nx,ny,nz"), plain);
        assert_eq!(found("nx,ny,nz,x,y,z"), Head { position: [3, 4, 5], normal: [0, 1, 2], name: None });
        assert_eq!(found(",x,y,z,nx,ny,nz"), Head { position: [1, 2, 3], normal: [4, 5, 6], name: None });
        assert_eq!(found("x,y,z,dir x,dir y,dir z,id"), Head { name: Some(6), ..plain });
        assert_eq!(found("X,Y,Z,NX,NY,NZ,id,lux,Name"), Head { name: Some(8), ..plain });
        // What is called a normal is one, whatever else points somewhere.
        assert_eq!(found("x,y,z,nx,ny,nz,vx,vy,vz,dx"), plain);
    }

    #[test]
    fn heads_that_say_too_little_or_too_much_are_refused() {
        for (text, what) in [
            ("nx,ny,nz", "no column is x"),
            ("x,y,nx,ny,nz", "no column is z"),
            ("x,y,z", "no column is nx"),
            ("x,y,z,nx,ny", "no column is nz"),
            ("x,y,z,nx,ny,dz", "no column is nz"),
            ("x,pos_x,y,z,nx,ny,nz", "`x` and `pos_x` both are x"),
            ("x,y,z,nx,ny,nz,Normal Z", "`nz` and `Normal Z` both are nz"),
            ("a,b,c,d,e,f", "no column is x"),
        ] {
            assert_eq!(head(&fields(text)), Err(what.to_owned()), "{text}");
        }
    }
}
