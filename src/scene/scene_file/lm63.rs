//! The reader of LM-63 files (IES, type C): luminaires as they were measured.
//!
//! ```text
//! I(gamma, phi) = candela(gamma, phi) * multiplier * ballast factor * tilt factor / 683 lm/W       W/sr
//! ```
//!
//! Files with rated lumens and absolute ones (-1 lumens) alike give candela as they are.
//!
//! | in the file | here |
//! |---|---|
//! | type C of any symmetry; multiplier, ballast factor | read |
//! | the edition: 1986 (no header), 1991, 1995, 2002, 2019 | read, from a [header](edition) in any spelling |
//! | the number after the ballast factor | a factor up to 1991; a reserved number or a code since |
//! | TILT=NONE, TILT=INCLUDE | read: the factor of the angle between the axis and straight down |
//! | line ends LF, CR LF and CR; ^Z and what follows; NUL; a byte order mark; no UTF-8 | read |
//! | keywords, labels, comments, blank lines | silent |
//! | lumens, watts, lamps, the height of the opening | silent |
//! | width and length of the opening | said: the luminaire counts as a point |
//! | TILT= with a file; types A and B; numbers that are none, out of order or missing | refused |
//!
//! Not handled: types A and B; the size of the luminous opening, which the reader names.
//!
//! Source: Illuminating Engineering Society, ANSI/IES LM-63-19 and its editions from 1986 on.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::scene::error::{Place, SceneError, shorten};
use crate::scene::other_kinds::refuse_other_kind;
use crate::scene::punctual::photometry::{EFFICACY, Photometry, between};

/// Angles of a file at most, in either direction: a hundred times as many as goniometers measure.
const MOST_ANGLES: usize = 36_000;

/// How a luminaire hangs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mounting {
    /// Unit vector of the axis: where gamma is 0.
    pub axis: DVec3,
    /// Where phi is 0, any vector that is not along the axis.
    pub along: Option<DVec3>,
    /// Unit vector upwards: a luminaire whose axis is its opposite hangs straight down.
    pub up: DVec3,
}

impl Mounting {
    fn frame(&self) -> [DVec3; 3] {
        // Of the coordinate axes x counts first, unless the luminaire points along it.
        let fallback = if self.axis.x.abs() < 0.9 { DVec3::X } else { DVec3::Z };
        let square = |way: DVec3| (way - way.dot(self.axis) * self.axis).try_normalize();
        let along = self.along.and_then(square).or_else(|| square(fallback)).unwrap_or(DVec3::Z);
        [along, self.axis.cross(along), self.axis]
    }

    /// The angle between the axis and straight down, degrees.
    fn tilt(&self) -> f64 {
        (-self.axis.dot(self.up)).clamp(-1.0, 1.0).acos().to_degrees()
    }
}

/// The numbers of an LM-63 file after its keywords, one after the other, each with its line.
struct Numbers<'a> {
    file: &'a str,
    words: std::iter::Peekable<std::vec::IntoIter<(usize, &'a str)>>,
    line: usize,
}

impl<'a> Numbers<'a> {
    fn new(file: &'a str, lines: &[(usize, &'a str)]) -> Numbers<'a> {
        let words = |&(line, text): &(usize, &'a str)| {
            let separators = |c: char| c.is_whitespace() || c == ',' || c == '\0';
            text.split(separators).filter(|word| !word.is_empty()).map(move |word| (line, word))
        };
        let words: Vec<(usize, &str)> = lines.iter().flat_map(words).collect();
        let line = lines.last().map_or(1, |l| l.0);
        Numbers { file, words: words.into_iter().peekable(), line }
    }

    fn error(&self, line: usize, message: String) -> SceneError {
        SceneError::Photometry { place: Place::line(self.file, line), message }
    }

    fn next(&mut self, what: &str) -> Result<f64, SceneError> {
        let Some((line, word)) = self.words.next() else {
            return Err(self.error(self.line, format!("the file ends where {what} should be")));
        };
        self.line = line;
        let number = word.parse::<f64>().ok().filter(|x| x.is_finite());
        number.ok_or_else(|| self.error(line, format!("`{}` is no number, where {what} should be", shorten(word))))
    }

    /// A number that `fits`.
    fn checked(&mut self, what: &str, needed: &str, fits: impl Fn(f64) -> bool) -> Result<f64, SceneError> {
        let number = self.next(what)?;
        let wrong = || self.error(self.line, format!("{what} is {number}: it has to be {needed}"));
        fits(number).then_some(number).ok_or_else(wrong)
    }

    fn count(&mut self, what: &str, most: usize) -> Result<usize, SceneError> {
        let fits = |x: f64| x.fract() == 0.0 && x >= 1.0 && x <= most as f64;
        Ok(self.checked(what, &format!("a whole number from 1 to {most}"), fits)? as usize)
    }

    /// So many angles in degrees, increasing.
    fn angles(&mut self, what: &str, count: usize, most: f64) -> Result<Vec<f64>, SceneError> {
        let mut angles: Vec<f64> = Vec::new();
        for _ in 0..count {
            let least = angles.last().copied();
            let fits = |x: f64| (0.0..=most).contains(&x) && least.is_none_or(|last| x > last);
            angles.push(self.checked(what, &format!("from 0 to {most}, and above the one before it"), fits)?);
        }
        Ok(angles)
    }

    fn factor(&mut self, what: &str) -> Result<f64, SceneError> {
        self.checked(what, "0 or more", |x| x >= 0.0)
    }
}

/// A file that was read, and what it leaves out of the picture.
pub(crate) struct ReadPhotometry {
    pub photometry: Photometry,
    /// Diameter or diagonal of the luminous opening, m; 0 for a point.
    pub opening: f64,
}

/// Reads an LM-63 file.
///
/// # Errors
/// [`SceneError::Photometry`] with the line of the first thing that is not as the standard has it.
pub(crate) fn read(file: &str, bytes: &[u8], mounting: &Mounting) -> Result<ReadPhotometry, SceneError> {
    refuse_other_kind(file, bytes)?;
    // Keywords are often of another encoding than the numbers.
    let text = String::from_utf8_lossy(bytes);
    let lines = lines(&text);
    let error = |line: usize, message: String| SceneError::Photometry { place: Place::line(file, line), message };
    let Some((tilt, how)) = find_tilt(&lines) else {
        return Err(error(lines.len().max(1), "there is no line TILT=, which every LM-63 file has".to_owned()));
    };
    let edition = lines[..tilt].iter().find_map(|(_, line)| edition(line)).unwrap_or(FIRST_EDITION);
    let (line, statement) = lines[tilt];
    let mut numbers = Numbers::new(file, &lines[tilt + 1..]);
    let tilted = match how.as_str() {
        "NONE" => 1.0,
        "INCLUDE" => tilt_factor(&mut numbers, mounting.tilt())?,
        _ => return Err(error(line, format!("`{}`: only TILT=NONE and TILT=INCLUDE are read", shorten(statement)))),
    };
    numbers.count("the number of lamps", 100_000)?;
    numbers.checked("the lumens of a lamp", "-1 or more", |x| x >= 0.0 || x == -1.0)?;
    let multiplier = numbers.factor("the multiplier")?;
    let vertical = numbers.count("the number of vertical angles", MOST_ANGLES)?;
    let horizontal = numbers.count("the number of horizontal angles", MOST_ANGLES)?;
    numbers.checked("the photometric type", "1 (type C; types A and B are not read)", |x| x == 1.0)?;
    let unit = numbers.checked("the unit of lengths", "1 (feet) or 2 (metres)", |x| x == 1.0 || x == 2.0)?;
    let mut sizes = [0.0; 3];
    for size in &mut sizes {
        *size = numbers.next("a size of the luminous opening")?;
    }
    let ballast = numbers.factor("the ballast factor")?;
    let what = "the number after the ballast factor";
    let second = if edition <= LAST_WITH_FACTOR { numbers.factor(what)? } else { numbers.next(what).map(|_| 1.0)? };
    numbers.next("the input watts")?;
    let gammas = numbers.angles("a vertical angle", vertical, 180.0)?;
    let phis = numbers.angles("a horizontal angle", horizontal, 360.0)?;
    let end = numbers.line;
    check_angles(&gammas, &phis).map_err(|message| numbers.error(end, message))?;
    let factor = multiplier * ballast * second * tilted / EFFICACY;
    let mut planes = vec![vec![0.0; gammas.len()]; phis.len()];
    for value in planes.iter_mut().flatten() {
        let candela = numbers.factor("a value in candela")?;
        *value = factor * candela;
        if *value > f64::from(f32::MAX) {
            return Err(numbers.error(numbers.line, format!("{candela} candela with all factors is beyond 3e38 W/sr")));
        }
    }
    if let Some((line, word)) = numbers.words.next() {
        return Err(numbers.error(line, format!("`{}` follows the last value in candela", shorten(word))));
    }
    let (phis, planes) = around(phis, planes);
    let radians = |angles: Vec<f64>| angles.into_iter().map(f64::to_radians).collect::<Vec<_>>();
    let mut turn = radians(phis);
    if let Some(last) = turn.last_mut() {
        *last = TAU;
    }
    let intensity = planes.into_iter().flatten().collect();
    let photometry = Photometry::new(mounting.frame(), radians(gammas), turn, intensity);
    let metres = if unit == 1.0 { 0.3048 } else { 1.0 };
    let opening = metres * sizes[0].abs().hypot(sizes[1].abs());
    Ok(ReadPhotometry { photometry, opening })
}

/// The lines of a text with their numbers, without spaces around them, up to the end that ^Z marks.
fn lines(text: &str) -> Vec<(usize, &str)> {
    let text = text.split('\u{1a}').next().unwrap_or("").trim_start_matches('\u{feff}');
    let is_blank = |c: char| c.is_whitespace() || c == '\0';
    let mut all = Vec::new();
    for line in text.split('\n') {
        // A carriage return ends a line by itself, unless a line feed follows.
        let line = line.strip_suffix('\r').unwrap_or(line);
        all.extend(line.split('\r').map(|line| line.trim_matches(is_blank)));
    }
    // What follows the last end of a line is no line.
    all.pop_if(|last| last.is_empty());
    (1..).zip(all).collect()
}

/// The line of TILT= and what it says, in capitals: the first one that says NONE or INCLUDE, since labels may begin
/// with the word; else the first of all.
fn find_tilt(lines: &[(usize, &str)]) -> Option<(usize, String)> {
    let says = |line: &str| {
        let line = line.to_ascii_uppercase();
        let (word, how) = line.split_once('=')?;
        (word.trim() == "TILT").then(|| how.trim().to_owned())
    };
    let all = || lines.iter().enumerate().filter_map(|(k, (_, line))| Some((k, says(line)?)));
    all().find(|(_, how)| how == "NONE" || how == "INCLUDE").or_else(|| all().next())
}

/// The edition of files without a header.
const FIRST_EDITION: u32 = 1986;
/// The last edition that has a factor after the ballast factor.
const LAST_WITH_FACTOR: u32 = 1991;

/// The year of the edition that a header names, like `IESNA:LM-63-2002`, `IESNA91` or `IES LM-63-19`; none of other
/// lines.
fn edition(line: &str) -> Option<u32> {
    let line: String = line.to_ascii_uppercase().chars().filter(|c| c.is_ascii_alphanumeric()).collect();
    let of_society = line.strip_prefix("IESNA").or_else(|| line.strip_prefix("IES"));
    let year = match of_society.unwrap_or(&line).strip_prefix("LM63") {
        Some(year) => year,
        None => of_society.filter(|year| year.len() == 2 || year.len() == 4)?,
    };
    let number = |digits: usize| year.get(..digits)?.parse::<u32>().ok();
    let short = || number(2).map(|year| if year < 80 { 2000 + year } else { 1900 + year });
    number(4).filter(|year| (1980..2100).contains(year)).or_else(short)
}

/// The factor of TILT=INCLUDE for a luminaire whose axis is so many degrees off straight down.
fn tilt_factor(numbers: &mut Numbers, tilt: f64) -> Result<f64, SceneError> {
    numbers.next("the lamp's place in the luminaire")?;
    let count = numbers.count("the number of tilt angles", MOST_ANGLES)?;
    let angles = numbers.angles("a tilt angle", count, 180.0)?;
    let mut factors = Vec::new();
    for _ in 0..count {
        factors.push(numbers.factor("a tilt factor")?);
    }
    if count == 1 {
        return Ok(factors[0]);
    }
    let (i, u) = between(&angles, tilt.clamp(angles[0], angles[count - 1])).unwrap_or((0, 0.0));
    Ok(factors[i] + u * (factors[i + 1] - factors[i]))
}

/// Whether angles are among those that type C has.
fn check_angles(gammas: &[f64], phis: &[f64]) -> Result<(), String> {
    let range = |angles: &[f64]| (angles[0], angles[angles.len() - 1]);
    let (low, high) = range(gammas);
    if !((low == 0.0 || low == 90.0) && (high == 90.0 || high == 180.0) && low < high) {
        return Err(format!("vertical angles go from {low} to {high}: type C has 0 or 90 to 90 or 180"));
    }
    let known = [(0.0, 0.0), (0.0, 90.0), (0.0, 180.0), (90.0, 270.0), (0.0, 360.0)];
    if known.contains(&range(phis)) {
        return Ok(());
    }
    let (low, high) = range(phis);
    Err(format!("horizontal angles go from {low} to {high}: type C has 0 alone, 0 to 90, 180 or 360, and 90 to 270"))
}

/// A full turn of planes from those of a symmetric luminaire.
fn around(phis: Vec<f64>, planes: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let mut turn: Vec<(f64, Vec<f64>)> = phis.into_iter().zip(planes).collect();
    let first = turn[0].0;
    let last = turn[turn.len() - 1].0;
    if last == 0.0 {
        turn.push((360.0, turn[0].1.clone()));
        return turn.into_iter().unzip();
    }
    if first == 90.0 {
        // Alike on both sides of the plane through 90 and 270 degrees.
        let reflected = |(phi, plane): &(f64, Vec<f64>)| ((540.0 - phi).rem_euclid(360.0), plane.clone());
        let other: Vec<_> = turn.iter().filter(|(phi, _)| (90.0..270.0).contains(phi) && *phi > 90.0).collect();
        let mut all: Vec<(f64, Vec<f64>)> = other.into_iter().map(reflected).collect();
        all.extend(turn);
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        if all[0].0 != 0.0 {
            // No plane is measured where the turn begins: it lies between its neighbours.
            let (low, high) = (&all[all.len() - 1], &all[0]);
            let u = (360.0 - low.0) / (360.0 - low.0 + high.0);
            let plane = low.1.iter().zip(&high.1).map(|(a, b)| a + u * (b - a)).collect();
            all.insert(0, (0.0, plane));
        }
        all.push((360.0, all[0].1.clone()));
        return all.into_iter().unzip();
    }
    for end in [90.0, 180.0] {
        let now = turn[turn.len() - 1].0;
        if now == end {
            let mirrored: Vec<_> =
                turn.iter().rev().skip(1).map(|(phi, plane)| (2.0 * end - phi, plane.clone())).collect();
            turn.extend(mirrored);
        }
    }
    turn.into_iter().unzip()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const DOWN: Mounting = Mounting { axis: DVec3::NEG_Y, along: None, up: DVec3::Y };

    fn file(tilt: &str, head: &str, angles: &str, values: &str) -> String {
        format!("IESNA:LM-63-2002\n[TEST] made\nTILT={tilt}\n{head}\n1 1 0\n{angles}\n{values}\n")
    }

    fn read_text(text: &str, mounting: &Mounting) -> Result<ReadPhotometry, SceneError> {
        read("x.ies", text.as_bytes(), mounting)
    }

    /// A light of cosine: candela 683 cos(gamma), so 1 W/sr down and pi W in all.
    fn cosine(phis: &str, planes: usize) -> String {
        let gammas: Vec<f64> = (0..=90).map(f64::from).collect();
        let plane: String = gammas.iter().map(|g| format!("{} ", EFFICACY * g.to_radians().cos())).collect();
        let head = format!("1 -1 1 91 {planes} 1 2 0 0 0");
        let angles = gammas.iter().map(|g| format!("{g} ")).collect::<String>();
        file("NONE", &head, &format!("{angles}\n{phis}"), &format!("{plane}\n").repeat(planes))
    }

    #[test]
    fn every_symmetry_is_the_same_light() {
        for (phis, planes) in
            [("0", 1), ("0 90", 2), ("0 45 90", 3), ("0 90 180", 3), ("90 180 270", 3), ("0 180 360", 3)]
        {
            let found = read_text(&cosine(phis, planes), &DOWN).expect("a correct file").photometry;
            // Chords of the cosine over a degree.
            assert!((found.power() / PI - 1.0).abs() < 2e-4, "{phis}: {}", found.power());
            for way in [DVec3::NEG_Y, DVec3::new(0.6, -0.8, 0.0), DVec3::new(0.0, -0.8, -0.6)] {
                assert!((found.intensity(way) + way.y).abs() < 1e-4, "{phis} {way}");
            }
            assert_eq!(found.intensity(DVec3::Y), 0.0);
            // The horizon itself is the last angle.
            assert!(found.intensity(DVec3::X) < 1e-12);
        }
    }

    /// One quarter brighter than the others, whose place the mounting decides.
    #[test]
    fn the_frame_is_that_of_the_mounting() {
        let text = file("NONE", "1 -1 1 2 4 1 2 0 0 0", "0 90\n0 90 180 360", "683 683\n683 1366\n683 683\n683 683");
        let mounting = Mounting { along: Some(DVec3::new(1.0, -5.0, 0.0)), ..DOWN };
        let found = read_text(&text, &mounting).expect("a correct file").photometry;
        // phi grows from `along` to axis x along.
        let ninety = DVec3::NEG_Y.cross(DVec3::X);
        assert!((found.intensity(ninety) - 2.0).abs() < 1e-12);
        assert!((found.intensity(-ninety) - 1.0).abs() < 1e-12);
        assert!((found.intensity(DVec3::X) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn draws_are_free_of_bias() {
        let values = "683 341.5 0\n1366 100 0\n0 0 0\n10 683 0";
        let text = file("NONE", "1 -1 1 3 4 1 2 0 0 0", "0 60 180\n0 70 200 360", values);
        let found = read_text(&text, &DOWN).expect("a correct file").photometry;
        let count = 512;
        let (mut drawn, mut flux) = (0.0, 0.0);
        for i in 0..count {
            for j in 0..count {
                let [u, v] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(count));
                let one = found.draw(u, v);
                assert!((one.direction.length() - 1.0).abs() < 1e-9);
                let weighted = one.weight * (1.0 + one.direction.x);
                drawn += found.power() * weighted / f64::from(count * count);
                // The flux by uniform directions in place of drawn ones.
                let (cosine, phi) = (1.0 - 2.0 * u, TAU * v);
                let sine = (1.0 - cosine * cosine).sqrt();
                let way = DVec3::new(sine * phi.cos(), cosine, sine * phi.sin());
                flux += 2.0 * TAU * found.intensity(way) * (1.0 + way.x) / f64::from(count * count);
            }
        }
        assert!((drawn / flux - 1.0).abs() < 2e-3, "{drawn} {flux}");
    }

    #[test]
    fn a_tilt_table_counts_by_how_the_luminaire_hangs() {
        let text = file("INCLUDE\n1\n3\n0 45 90\n1 0.9 0.5", "1 1000 2 2 1 1 1 -1 0 0", "0 90\n0", "683 683");
        let of = |axis: DVec3| {
            let found = read_text(&text, &Mounting { axis, ..DOWN }).expect("a correct file");
            (found.photometry.intensity(axis), found.opening)
        };
        assert_eq!(of(DVec3::NEG_Y), (2.0, 0.3048));
        assert!((of(DVec3::X).0 - 1.0).abs() < 1e-12);
        assert!((of(DVec3::new(1.0, -1.0, 0.0).normalize()).0 - 1.8).abs() < 1e-12);
    }

    #[test]
    fn the_edition_is_known_by_any_spelling_of_the_header() {
        for (line, year) in [
            ("IESNA:LM-63-2002", Some(2002)),
            ("IES:LM-63-2019", Some(2019)),
            ("IESNA: LM-63-1995", Some(1995)),
            ("IESNA LM 63 - 2002 (type C)", Some(2002)),
            ("iesna:lm-63-1991", Some(1991)),
            ("LM-63-95", Some(1995)),
            ("LM-63-02", Some(2002)),
            ("IESNA91", Some(1991)),
            ("IESNA86", Some(1986)),
            ("IES 1000 cd", None),
            ("[TEST] by LM-63-2002", None),
            ("a lamp", None),
            ("", None),
        ] {
            assert_eq!(edition(line), year, "{line}");
        }
    }

    /// A lamp of 1 W/sr with 2 after its ballast factor.
    fn with_header(header: &str, end: &str) -> Result<f64, SceneError> {
        let angles = "0 90\n0\n683 683";
        let text = format!("{header}\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 2 0\n{angles}\n").replace('\n', end);
        read_text(&text, &DOWN).map(|read| read.photometry.intensity(DVec3::NEG_Y))
    }

    #[test]
    fn the_second_factor_counts_where_the_edition_has_one() {
        for (header, counts) in [
            ("IESNA:LM-63-2002", false),
            ("\n\nIES:LM-63-2019\n[TEST] a", false),
            ("# by hand\n\n IESNA : LM-63-1995", false),
            ("[TEST] a\nIESNA:LM-63-2002", false),
            ("IESNA91\n[TEST] a", true),
            ("IESNA:LM-63-1991", true),
            ("a lamp of 1986\nanother line", true),
            ("Tilt head, 5 degrees\nTilt = by hand", true),
        ] {
            for end in ["\n", "\r\n", "\r"] {
                let found = with_header(header, end).expect(header);
                assert!((found - if counts { 2.0 } else { 1.0 }).abs() < 1e-12, "{header:?} {end:?}: {found}");
            }
        }
    }

    #[test]
    fn marks_of_the_end_are_no_numbers() {
        let good = file("NONE", "1 -1 1 2 1 1 2 0 0 0", "0 90\n0", "683 683");
        for end in ["\u{1a}", "\u{1a}\u{1a}\0\0", "\0\0\0", "\r\n\u{1a}\r\nwhat follows", " \u{1a}"] {
            assert!(read_text(&format!("{good}{end}"), &DOWN).is_ok(), "{end:?}");
            assert!(read_text(&format!("\u{feff}{}{end}", good.trim_end()), &DOWN).is_ok(), "{end:?}");
        }
    }

    #[test]
    fn a_tilt_is_measured_from_the_scene_s_own_down() {
        let text = file("INCLUDE\n1\n3\n0 45 90\n1 0.9 0.5", "1 1000 1 2 1 1 1 -1 0 0", "0 90\n0", "683 683");
        let of = |axis: DVec3, up: DVec3| {
            let mounting = Mounting { axis, along: None, up };
            read_text(&text, &mounting).expect("a correct file").photometry.intensity(axis)
        };
        for (axis, up, factor) in [
            (DVec3::NEG_Z, DVec3::Z, 1.0),
            (DVec3::NEG_Y, DVec3::Z, 0.5),
            (DVec3::NEG_Y, DVec3::Y, 1.0),
            (DVec3::NEG_Z, DVec3::Y, 0.5),
        ] {
            assert!((of(axis, up) - factor).abs() < 1e-12, "{axis} {up}");
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let good = file("NONE", "1 -1 1 2 1 1 2 0 0 0", "0 90\n0", "1 1");
        assert!(read_text(&good, &DOWN).is_ok());
        let wrong = |from: &str, to: &str| {
            let error = read_text(&good.replace(from, to), &DOWN).map(|_| ()).expect_err("a broken file");
            error.to_string()
        };
        for (from, to, line, message) in [
            ("TILT=NONE\n", "", 7, "no line TILT="),
            ("TILT=NONE", "TILT=lamp.tlt", 3, "only TILT=NONE"),
            ("1 -1 1 2", "1 -1 x 2", 4, "`x` is no number"),
            ("1 -1 1 2 1 1 2", "1 -1 1 2 1 2 2", 4, "photometric type is 2"),
            ("0 90\n0", "90 0\n0", 6, "above the one before"),
            ("0 90\n0", "0 80\n0", 7, "vertical angles go from 0 to 80"),
            ("0 90\n0", "0 90\n30", 7, "horizontal angles go from 30 to 30"),
            ("1 1\n", "1\n", 8, "the file ends"),
            ("1 1\n", "1 1 1\n", 8, "follows the last value"),
            ("1 1\n", "1 -1\n", 8, "has to be 0 or more"),
        ] {
            let found = wrong(from, to);
            assert!(found.contains(&format!("line {line}")) && found.contains(message), "{found}");
        }
    }

    /// Every prefix and every byte changed: errors or lights, no panic and no numbers that are none.
    #[test]
    fn no_damage_does_more_than_an_error() {
        let good = cosine("0 90", 2);
        for end in 0..good.len().min(600) {
            let _ = read_text(&good[..end], &DOWN);
        }
        for at in 0..300 {
            for byte in [b'0', b'9', b'-', b'.', b'e', b' ', b'\n'] {
                let mut bytes = good.clone().into_bytes();
                bytes[at] = byte;
                if let Ok(read) = read("x.ies", &bytes, &DOWN) {
                    let found = read.photometry;
                    assert!(found.power().is_finite() && found.intensity(DVec3::NEG_Y).is_finite());
                }
            }
        }
    }
}
