//! Material libraries: `Kd` (the reflectance rho), `Ke` (emitted radiance), `d` and `Tr` (opacity), textures with their
//! options, and where highlights are requested `Ks` and `Ns` (Phong's specular term).
//!
//! Statements are checked line by line as they stream to `tobj`, whose materials hold the numbers; it would panic on
//! `Ke 10`, and accepts NaN. Only place for `tobj`. The table of all statements is in docs/commands.md.
//!
//! Not handled: `spectral` and `xyz` colours (an error), `-mm` and `-t` of textures, and what else would change a
//! picture of diffuse light (warnings).
//!
//! Source: Wavefront, *MTL Material Format*, Advanced Visualizer manual; `Tr` is of its readers and writers.

use std::collections::HashMap;
use std::fmt::Write;

use glam::{DVec2, DVec3};

use crate::light::{Gloss, Rgb};
use crate::scene::error::{About, Effect, Place, SceneError, Tally, Warning, list};
use crate::scene::model::{DEFAULT_RHO, Material};
use crate::scene::obj::lines::{Statement, refuse_one_line, statements};
use crate::scene::soup::{check_emission, check_gloss, check_rho};
use crate::scene::textures::{Channel, Wrap};

/// How far `d` and 1 - `Tr` may lie apart to be the same, written with few digits.
const SAME: f64 = 5e-3;

/// The `Ks` that Blender writes for every material, all channels.
const BLENDERS_KS: f64 = 0.5;

/// What happens to a library all of whose materials have `Tr 1` alone.
const INVERTED: &str = "every material says it and none `d`, so it is read as opaque, as some programs mean it; `d 0` \
                        leaves faces out";

/// A material of a library.
#[derive(Debug)]
pub(super) struct Entry {
    pub name: String,
    line: usize,
    /// Its numbers.
    read: tobj::Material,
    /// What it reflects without `Kd`.
    grey: f32,
    d: Option<f64>,
    tr: Option<f64>,
    /// The last line of `d` or `Tr`.
    opacity_line: usize,
    /// The share of the surface that is there, 0..=1.
    pub opacity: f32,
    /// The line of an index of refraction that is not 1.
    refracts: Option<usize>,
    /// Textures of the reflectance, of the emission and of the mask.
    pub map_kd: Option<MapLine>,
    pub map_ke: Option<MapLine>,
    pub map_d: Option<MapLine>,
}

/// A texture statement.
#[derive(Clone, Debug)]
pub(super) struct MapLine {
    /// The library and its line.
    pub file: String,
    pub line: usize,
    /// The image's file, as written.
    pub name: String,
    pub scale: DVec2,
    pub offset: DVec2,
    pub wrap: Wrap,
    /// Which number of a texel counts, where the statement gives one.
    pub channel: Option<Channel>,
}

/// The materials of all libraries of an OBJ, in order.
#[derive(Debug, Default)]
pub(super) struct Libraries {
    pub entries: Vec<Entry>,
    index: HashMap<String, usize>,
    /// Whether `Ks` and `Ns` are read.
    highlights: bool,
    /// Whether vertices have colours.
    coloured: bool,
    /// Warnings of every library read so far.
    pub warnings: Vec<Warning>,
}

/// One library while it is read.
#[derive(Default)]
struct Reading<'a> {
    file: &'a str,
    highlights: bool,
    entries: Vec<Entry>,
    /// The checked statements, for `tobj`.
    checked: String,
    tallies: Tallies,
}

/// Occurrences of what is read otherwise than it is written, or not at all.
#[derive(Default)]
struct Tallies {
    textures: Unread,
    statements: Unread,
    halo: Tally,
    outside: Tally,
    inverted: Tally,
    apart: Tally,
    specular: Tally,
    no_kd: Tally,
    twice: Tally,
}

/// Statements that are not modelled: where they are, and which.
#[derive(Default)]
struct Unread {
    lines: Tally,
    keywords: Vec<String>,
}

/// What a statement that is not modelled does to a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unmodelled {
    /// Nothing, with these numbers.
    Needless,
    /// It puts an image onto something.
    Image,
    /// It would change something else.
    Missed,
}

impl Entry {
    fn new(name: &str, line: usize, grey: f32) -> Entry {
        Entry {
            name: name.to_owned(),
            line,
            read: tobj::Material::default(),
            grey,
            d: None,
            tr: None,
            opacity_line: 0,
            opacity: 1.0,
            refracts: None,
            map_kd: None,
            map_ke: None,
            map_d: None,
        }
    }

    /// Whether it has a `Kd`.
    pub(super) fn has_kd(&self) -> bool {
        self.read.diffuse.is_some()
    }

    /// Whether it has a `Ke`.
    pub(super) fn has_ke(&self) -> bool {
        self.read.emissive.is_some()
    }

    /// The material without its textures and its opacity.
    pub(super) fn material(&self) -> Material {
        let rgb = |value: [f64; 3]| DVec3::from_array(value).as_vec3();
        let specular = self.read.specular.map(rgb).filter(|specular| *specular != Rgb::ZERO);
        let exponent = self.read.shininess.unwrap_or(0.0) as f32;
        let rho = self.read.diffuse.map_or(Rgb::splat(self.grey), rgb);
        let gloss = specular.map(|specular| Gloss { specular, exponent });
        Material { gloss, ..Material::new(&self.name, rho, self.read.emissive.map_or(Rgb::ZERO, rgb)) }
    }
}

impl Libraries {
    /// No materials yet; `Ks` and `Ns` are read where `highlights` are requested; `coloured` says whether vertices have
    /// colours.
    pub(super) fn new(highlights: bool, coloured: bool) -> Libraries {
        Libraries { highlights, coloured, ..Libraries::default() }
    }

    /// Reads one library.
    pub(super) fn read(&mut self, file: &str, text: &str) -> Result<(), SceneError> {
        refuse_one_line(file, text, &["newmtl", "Kd", "Ke", "map_Kd"])?;
        let mut reading = Reading { file, highlights: self.highlights, ..Reading::default() };
        for statement in statements(text) {
            reading.take(&statement)?;
        }
        reading.read_inverted();
        let Reading { entries, checked, mut tallies, .. } = reading;
        let fault = |error: tobj::LoadError| SceneError::Reader { file: file.to_owned(), message: error.to_string() };
        let (read, _) = tobj::load_mtl_buf(&mut checked.as_bytes()).map_err(fault)?;
        for (entry, read) in entries.into_iter().zip(read) {
            self.push(Entry { read, ..entry }, &mut tallies);
        }
        tallies.report(file, self.coloured, &mut self.warnings);
        Ok(())
    }

    /// The index of the material of that name.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.index.get(name).copied()
    }

    /// Adds a grey that emits nothing, for a name that no library defines; its index.
    pub(super) fn add_grey(&mut self, name: &str, rho: f32) -> usize {
        self.index.insert(name.to_owned(), self.entries.len());
        self.entries.push(Entry::new(name, 0, rho));
        self.entries.len() - 1
    }

    fn push(&mut self, mut entry: Entry, tallies: &mut Tallies) {
        if self.index.contains_key(&entry.name) {
            return tallies.twice.add_named(entry.line, &entry.name);
        }
        if !entry.has_kd() && entry.map_kd.is_none() {
            tallies.no_kd.add_named(entry.line, &entry.name);
        }
        let (d, rest) = (entry.d, entry.tr.map(|tr| 1.0 - tr));
        if d.zip(rest).is_some_and(|(d, rest)| (d - rest).abs() > SAME) {
            tallies.apart.add_named(entry.opacity_line, &entry.name);
        }
        entry.opacity = d.or(rest).unwrap_or(1.0) as f32;
        if let Some(line) = entry.refracts.filter(|_| entry.opacity < 1.0 || entry.map_d.is_some()) {
            tallies.statements.add(line, &entry.name, "Ni".to_owned());
        }
        self.index.insert(entry.name.clone(), self.entries.len());
        self.entries.push(entry);
    }
}

impl Reading<'_> {
    /// Checks a statement, and passes its numbers on.
    fn take(&mut self, statement: &Statement) -> Result<(), SceneError> {
        let (file, keyword) = (self.file, statement.keyword());
        if keyword == "newmtl" {
            let _ = writeln!(self.checked, "newmtl {}", self.entries.len());
            self.entries.push(Entry::new(statement.material(), statement.line, DEFAULT_RHO));
            return Ok(());
        }
        let Some(entry) = self.entries.last_mut() else {
            let needs_material = matches!(keyword, "Kd" | "Ke" | "Ks");
            let missing = || statement.malformed(file, "a newmtl line before it", "none");
            return if needs_material { Err(missing()) } else { Ok(()) };
        };
        let (name, place) = (entry.name.as_str(), || Place::line(file, statement.line));
        match keyword {
            "Kd" | "Ke" | "Ks" if keyword != "Ks" || self.highlights => {
                let numbers = colour(file, statement)?;
                match keyword {
                    "Kd" => check_rho(numbers, name, place),
                    "Ke" => check_emission(numbers, name, place),
                    _ => check_gloss(&numbers, name, place),
                }?;
                write_numbers(&mut self.checked, keyword, &numbers);
            }
            "Ns" if self.highlights => {
                let ns = [one_number(file, statement, &statement.words().collect::<Vec<_>>())?];
                check_gloss(&ns, name, place)?;
                write_numbers(&mut self.checked, keyword, &ns);
            }
            // Ks is not used: what cannot be read as numbers is not zero either.
            "Ks" => {
                let all_are = |value: f64| statement.words().all(|word| word.parse() == Ok(value));
                if !all_are(0.0) && !all_are(BLENDERS_KS) {
                    self.tallies.specular.add_named(statement.line, name);
                }
            }
            "d" | "Tr" | "tr" => return self.opacity(statement),
            "Ni" => {
                let is_one = |word: &str| word.parse() == Ok(1.0);
                entry.refracts = (!statement.words().all(is_one)).then_some(statement.line);
            }
            _ => match keyword.to_ascii_lowercase().as_str() {
                "map_kd" => entry.map_kd = Some(MapLine::read(file, statement)?),
                "map_ke" => entry.map_ke = Some(MapLine::read(file, statement)?),
                "map_d" => entry.map_d = Some(MapLine::read(file, statement)?),
                _ => self.tallies.count_unread(statement, name),
            },
        }
        Ok(())
    }

    fn opacity(&mut self, statement: &Statement) -> Result<(), SceneError> {
        let Some(entry) = self.entries.last_mut() else { return Ok(()) };
        let mut words: Vec<&str> = statement.words().collect();
        if let ["-halo", word] = words[..] {
            self.tallies.halo.add_named(statement.line, &entry.name);
            words = vec![word];
        }
        let number = one_number(self.file, statement, &words)?;
        if !(0.0..=1.0).contains(&number) {
            self.tallies.outside.add_named(statement.line, &entry.name);
        }
        let slot = if statement.keyword() == "d" { &mut entry.d } else { &mut entry.tr };
        *slot = Some(number.clamp(0.0, 1.0));
        entry.opacity_line = statement.line;
        Ok(())
    }

    /// Takes the opacities for those of a program that writes 1 for opaque, if nothing would be there of any material.
    fn read_inverted(&mut self) {
        if self.entries.iter().all(|entry| entry.d.is_none() && entry.tr == Some(1.0)) {
            for entry in &mut self.entries {
                self.tallies.inverted.add_named(entry.opacity_line, &entry.name);
                entry.tr = None;
            }
        }
    }
}

impl Tallies {
    /// Counts a statement of a material that is not modelled, if it would change the picture.
    fn count_unread(&mut self, statement: &Statement, material: &str) {
        let unread = match unmodelled(statement) {
            Unmodelled::Needless => return,
            Unmodelled::Image => &mut self.textures,
            Unmodelled::Missed => &mut self.statements,
        };
        let number = statement.words().next().filter(|_| statement.keyword() == "illum");
        let keyword = number.map_or_else(|| statement.keyword().to_owned(), |number| format!("illum {number}"));
        unread.add(statement.line, material, keyword);
    }

    /// Appends the warnings of a library.
    fn report(&self, file: &str, coloured: bool, warnings: &mut Vec<Warning>) {
        let unread = |unread: &Unread, why| format!("{}: {why}", list(unread.keywords.iter().map(String::as_str)));
        let textures = unread(&self.textures, "of textures map_Kd, map_Ke and map_d alone are modelled");
        let statements = unread(&self.statements, "not modelled, and left out");
        let no_kd = format!("it reflects {DEFAULT_RHO}{}", where_uncoloured(coloured));
        for (about, tally, noun, consequence) in [
            (About::Light(Effect::LeftOut), &self.textures.lines, "texture", textures.as_str()),
            (About::Light(Effect::LeftOut), &self.statements.lines, "statement", statements.as_str()),
            (
                About::Shape(Effect::Simplified),
                &self.halo,
                "d -halo statement",
                "its factor is taken for all directions",
            ),
            (About::Shape(Effect::Simplified), &self.outside, "opacity value", "outside 0..1, and clamped"),
            (About::Shape(Effect::Guessed), &self.inverted, "Tr 1 statement", INVERTED),
            (About::Shape(Effect::Guessed), &self.apart, "contradictory Tr statement", "it is not 1 - d; d counts"),
            (
                About::Light(Effect::LeftOut),
                &self.specular,
                "specular colour",
                "Ks is left out; --highlights shows highlights of direct light",
            ),
            (About::Light(Effect::Guessed), &self.no_kd, "missing Kd", no_kd.as_str()),
            (About::Light(Effect::Simplified), &self.twice, "repeated definition", "the first one counts"),
        ] {
            tally.report(about, (file, "line"), noun, consequence, warnings);
        }
    }
}

impl Unread {
    fn add(&mut self, line: usize, material: &str, keyword: String) {
        self.lines.add_named(line, material);
        if self.keywords.len() < 100 && !self.keywords.contains(&keyword) {
            self.keywords.push(keyword);
        }
    }
}

/// What a warning adds to the grey of a material, where vertices may have colours.
pub(super) fn where_uncoloured(coloured: bool) -> &'static str {
    if coloured { " where vertices have no colour" } else { "" }
}

fn write_numbers(text: &mut String, keyword: &str, numbers: &[f64]) {
    text.push_str(keyword);
    numbers.iter().for_each(|number| text.push_str(&format!(" {number}")));
    text.push('\n');
}

fn colour(file: &str, statement: &Statement) -> Result<[f64; 3], SceneError> {
    let words: Vec<&str> = statement.words().collect();
    let number = |word| statement.number(file, word);
    match words[..] {
        ["spectral" | "xyz", ..] => Err(statement.malformed(file, "RGB numbers", words[0])),
        [grey] => Ok([number(grey)?; 3]),
        [r, g, b] => Ok([number(r)?, number(g)?, number(b)?]),
        _ => Err(statement.malformed(file, "one number or three", &words.len().to_string())),
    }
}

fn one_number(file: &str, statement: &Statement, words: &[&str]) -> Result<f64, SceneError> {
    match words {
        [word] => statement.number(file, word),
        _ => Err(statement.malformed(file, "one number", &words.len().to_string())),
    }
}

/// What a statement that is not modelled does. Ambient light (`Ka`) is in no scene; `Tf 1`, `Pm 0`, `illum 2` and the
/// like leave everything as it is.
fn unmodelled(statement: &Statement) -> Unmodelled {
    let numbers = || statement.words().map(|word| word.parse::<f64>().unwrap_or(f64::NAN));
    let unless = |is_neutral: bool| if is_neutral { Unmodelled::Needless } else { Unmodelled::Missed };
    match statement.keyword() {
        // Ambient light; how sharp mirrors are; how highlights and clear coats fall off; names of shaders.
        "Ka" | "map_Ka" | "Ns" | "sharpness" | "map_aat" | "Pcr" | "anisor" => Unmodelled::Needless,
        "Tf" => unless(numbers().all(|number| number == 1.0)),
        "Pr" => unless(numbers().all(|number| number >= 1.0)),
        "Pm" | "Ps" | "Pc" | "aniso" => unless(numbers().all(|number| number == 0.0)),
        "illum" => unless(numbers().all(|number| number == 1.0 || number == 2.0)),
        key if key.starts_with("map_") || matches!(key, "bump" | "disp" | "decal" | "refl" | "norm") => {
            Unmodelled::Image
        }
        _ => Unmodelled::Missed,
    }
}

impl MapLine {
    fn read(file: &str, statement: &Statement) -> Result<MapLine, SceneError> {
        let mut found = MapLine {
            file: file.to_owned(),
            line: statement.line,
            name: String::new(),
            scale: DVec2::ONE,
            offset: DVec2::ZERO,
            wrap: Wrap::Repeat,
            channel: None,
        };
        let mut rest = statement.name(file)?;
        while let Some(after) = found.option(file, statement, rest)? {
            rest = after;
        }
        found.name = rest.to_owned();
        let missing = || statement.malformed(file, "the name of an image", "none");
        (!rest.is_empty()).then_some(found).ok_or_else(missing)
    }

    /// Reads the option that the text begins with; what follows it, or none where it begins with the name.
    fn option<'a>(&mut self, file: &str, statement: &Statement, text: &'a str) -> Result<Option<&'a str>, SceneError> {
        let (option, rest) = split(text);
        if matches!(option, "-s" | "-o" | "-t") {
            return self.vector(file, statement, option, rest).map(Some);
        }
        let (value, rest) = split(rest);
        match (option, value) {
            ("-mm", _) => return Ok(Some(split(rest).1)),
            ("-clamp", "on") => self.wrap = Wrap::Clamp,
            ("-imfchan", "r") => self.channel = Some(Channel::Colour(0)),
            ("-imfchan", "g") => self.channel = Some(Channel::Colour(1)),
            ("-imfchan", "b") => self.channel = Some(Channel::Colour(2)),
            ("-imfchan", "m") => self.channel = Some(Channel::Alpha),
            ("-imfchan", "l") => self.channel = Some(Channel::Luminance),
            ("-blendu" | "-blendv" | "-cc" | "-clamp" | "-imfchan" | "-bm" | "-boost" | "-texres" | "-type", _) => {}
            _ => return Ok(None),
        }
        Ok(Some(rest))
    }

    /// One to three numbers; the first two count.
    fn vector<'a>(
        &mut self,
        file: &str,
        statement: &Statement,
        option: &str,
        mut rest: &'a str,
    ) -> Result<&'a str, SceneError> {
        let mut numbers = Vec::new();
        while numbers.len() < 3 && (numbers.is_empty() || split(rest).0.parse::<f64>().is_ok()) {
            let (word, after) = split(rest);
            numbers.push(statement.number(file, word)?);
            rest = after;
        }
        match option {
            "-s" => self.scale = DVec2::new(numbers[0], *numbers.get(1).unwrap_or(&1.0)),
            "-o" => self.offset = DVec2::new(numbers[0], *numbers.get(1).unwrap_or(&0.0)),
            _ => {}
        }
        Ok(rest)
    }
}

/// The first word and what follows it.
fn split(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Libraries, SceneError> {
        let mut libraries = Libraries::default();
        libraries.read("m.mtl", text).map(|()| libraries)
    }

    #[test]
    fn one_number_is_a_grey() {
        let libraries = read("newmtl a b\nKd .5\nKe 10 # lamp\n").unwrap();
        let material = libraries.entries[libraries.find("a b").unwrap()].material();
        assert_eq!((material.rho, material.emission), (Rgb::splat(0.5), Rgb::splat(10.0)));
        assert!(libraries.warnings.is_empty());
    }

    #[test]
    fn the_first_of_two_definitions_counts() {
        let libraries = read("newmtl a\nKd .5\nnewmtl a\nKd .6").unwrap();
        assert_eq!(libraries.entries.len(), 1);
        assert_eq!(libraries.entries[0].material().rho, Rgb::splat(0.5));
        assert!(libraries.warnings[0].contains("m.mtl, line 3"));
    }

    /// It says nothing of a surface that nobody made glossy.
    #[test]
    fn the_specular_colour_that_blender_always_writes_is_passed_over() {
        let libraries = read("newmtl a\nKd .5\nKs 0.500000 0.500000 0.500000\n").unwrap();
        assert!(libraries.warnings.is_empty(), "{:?}", libraries.warnings);
    }

    #[test]
    fn what_is_not_modelled_is_named() {
        let libraries = read("newmtl a\nmap_Bump x.png\nKs 0 0 .1\nnewmtl b\nKs 0\nbump y\n").unwrap();
        let all = libraries.warnings.join("\n");
        assert!(all.contains("2 textures of materials a, b (first: m.mtl, line 2)"), "{all}");
        assert!(all.contains("1 specular colour of material `a` (first: m.mtl, line 3)"), "{all}");
        assert!(all.contains("2 missing Kds of materials a, b"), "{all}");
    }

    #[test]
    fn numbers_that_change_nothing_are_passed_over() {
        let found = |text: &str| unmodelled(&statements(text).next().unwrap());
        for text in ["Ka 1 1 1", "Tf 1 1 1", "Tf 1.0", "Pm 0", "Pr 1", "illum 2", "illum 1", "map_Ka a.png"] {
            assert_eq!(found(text), Unmodelled::Needless, "{text}");
        }
        for text in ["Tf .9 1 1", "Tf xyz 1", "Pm 1", "Pr .3", "Ps 0.1", "illum 0", "illum 7", "illum x", "Kt 1"] {
            assert_eq!(found(text), Unmodelled::Missed, "{text}");
        }
        for text in ["map_Pm a.png", "norm a.png", "map_bump a.png", "refl -type sphere a.png", "map_emissive a.png"] {
            assert_eq!(found(text), Unmodelled::Image, "{text}");
        }
    }

    fn map(text: &str) -> Result<MapLine, SceneError> {
        MapLine::read("m.mtl", &statements(text).next().unwrap())
    }

    #[test]
    fn options_are_distinguished_from_names() {
        let found = map("map_Kd -blendu on -s 2 3 1 -o .5 -clamp on -mm 0 1 my wall 2.png").unwrap();
        assert_eq!((found.scale, found.offset), (DVec2::new(2.0, 3.0), DVec2::new(0.5, 0.0)));
        assert_eq!((found.wrap, found.name.as_str()), (Wrap::Clamp, "my wall 2.png"));
        let plain = map("map_kd -clamp off textures\\wall.png").unwrap();
        assert_eq!((plain.wrap, plain.name.as_str(), plain.channel), (Wrap::Repeat, "textures\\wall.png", None));
        assert_eq!(map("map_Kd -imfchan m a.png").unwrap().channel, Some(Channel::Alpha));
    }

    #[test]
    fn what_is_cut_off_is_an_error_with_its_line() {
        for text in ["map_Kd", "map_Kd -s 1 1 1", "map_Kd -o x a.png", "map_Kd -s", "map_Kd -clamp on"] {
            let error = map(text).unwrap_err().to_string();
            assert!(error.starts_with("m.mtl, line 1: "), "{text}: {error}");
        }
    }
}
