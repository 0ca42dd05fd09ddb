//! Material libraries: `newmtl`, `Kd` (the reflectance rho), `Ke` (emitted radiance), and where highlights are asked
//! for `Ks` and `Ns` (Phong's specular term), checked line by line.
//!
//! The text is decoded already. One number after `Kd` or `Ke` is a grey. A material without `Kd` reflects
//! [`DEFAULT_RHO`], with a warning; without `Ns` the exponent is 0, as OpenGL has it. Of two materials of one name the
//! first counts. `map_Kd`, `map_Ke` and `map_d` are kept for [`crate::scene::mtl_textures`], `d` and `Tr` are read by
//! [`crate::scene::mtl_opacity`].
//!
//! Not handled: what [`crate::scene::mtl_other`] warns of, nonzero `Ks` where no highlights are asked for (a warning),
//! `spectral` and `xyz` colours (an error).
//!
//! Source: Wavefront, *MTL Material Format*, Advanced Visualizer manual.

use std::collections::HashMap;
use std::fmt::Write;

use glam::DVec3;

use crate::light::{Gloss, Rgb};
use crate::scene::error::{Place, SceneError};
use crate::scene::lines;
use crate::scene::lines::Statement;
use crate::scene::material_checks::{check_emission, check_gloss, check_rho};
use crate::scene::mtl_maps::MapLines;
use crate::scene::mtl_opacity::{OpacityFlaws, OpacityLines, without_inverted};
use crate::scene::mtl_other::Other;
use crate::scene::warnings::Tally;

/// The reflectance of a material that has no `Kd`: the customary default of MTL readers and writers.
pub const DEFAULT_RHO: f32 = 0.8;

/// What one material of a library says.
#[derive(Clone, Debug)]
struct Entry {
    name: String,
    line: usize,
    /// What it reflects without `kd`.
    grey: f32,
    kd: Option<[f64; 3]>,
    ke: Option<[f64; 3]>,
    ks: Option<[f64; 3]>,
    ns: f64,
    opacity: OpacityLines,
    /// The share of the surface that is there.
    there: f32,
    /// The line of an index of refraction that is not 1.
    refracts: Option<usize>,
    maps: MapLines,
}

/// The materials of all libraries of an OBJ, in order.
#[derive(Debug, Default)]
pub(crate) struct Libraries {
    entries: Vec<Entry>,
    index: HashMap<String, usize>,
    /// Whether `Ks` and `Ns` are read.
    highlights: bool,
    /// Whether vertices have colours.
    coloured: bool,
    /// Warnings of every library read so far.
    pub warnings: Vec<String>,
}

impl Entry {
    /// A material that says nothing.
    fn new(name: &str, line: usize) -> Entry {
        let (opacity, maps) = (OpacityLines::default(), MapLines::default());
        let name = name.to_owned();
        let grey = DEFAULT_RHO;
        Entry { name, line, grey, kd: None, ke: None, ks: None, ns: 0.0, opacity, there: 1.0, refracts: None, maps }
    }
}

#[derive(Default)]
struct Tallies {
    other: Other,
    opacity: OpacityFlaws,
    specular: Tally,
    no_kd: Tally,
    twice: Tally,
}

impl Libraries {
    /// No materials yet; `Ks` and `Ns` are read where `highlights` are asked for; `coloured` tells whether vertices
    /// have colours.
    pub fn new(highlights: bool, coloured: bool) -> Libraries {
        Libraries { highlights, coloured, ..Libraries::default() }
    }

    /// Reads one library.
    pub fn read(&mut self, file: &str, text: &str) -> Result<(), SceneError> {
        lines::refuse_one_line(file, text, &["newmtl", "Kd", "Ke", "map_Kd"])?;
        let mut tallies = Tallies::default();
        let mut entries: Vec<Entry> = Vec::new();
        for statement in lines::statements(text) {
            read_statement(file, &statement, self.highlights, &mut entries, &mut tallies)?;
        }
        let opacities = entries.iter_mut().map(|entry| (entry.name.as_str(), &mut entry.opacity));
        without_inverted(opacities, &mut tallies.opacity);
        for entry in entries {
            self.push(entry, &mut tallies);
        }
        self.warn(file, &tallies);
        Ok(())
    }

    /// The index of the material of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.index.get(name).copied()
    }

    /// Adds a grey that emits nothing, for a name that no library defines; its index.
    pub fn add_grey(&mut self, name: &str, rho: f32) -> usize {
        let entry = Entry { grey: rho, ..Entry::new(name, 0) };
        self.index.insert(name.to_owned(), self.entries.len());
        self.entries.push(entry);
        self.entries.len() - 1
    }

    /// All names, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|entry| entry.name.as_str())
    }

    /// The highlights of every material, in order.
    pub fn gloss(&self) -> impl Iterator<Item = Option<Gloss>> {
        self.entries.iter().map(|entry| {
            let specular = entry.ks.map(|ks| DVec3::from_array(ks).as_vec3()).filter(|ks| *ks != Rgb::ZERO)?;
            Some(Gloss { specular, exponent: entry.ns as f32 })
        })
    }

    /// The textures of a material.
    pub fn maps(&self, index: usize) -> &MapLines {
        &self.entries[index].maps
    }

    /// The share of a material's surface that is there.
    pub fn opacity(&self, index: usize) -> f32 {
        self.entries[index].there
    }

    /// Whether a material says `Kd`, and `Ke`.
    pub fn factors(&self, index: usize) -> [bool; 2] {
        [self.entries[index].kd.is_some(), self.entries[index].ke.is_some()]
    }

    /// An MTL text of nothing but checked `newmtl`, `Kd` and `Ke`; material i is named by `rename(i)`.
    pub fn clean_text(&self, rename: impl Fn(usize) -> String) -> String {
        let mut text = String::new();
        for (i, entry) in self.entries.iter().enumerate() {
            let _ = writeln!(text, "newmtl {}", rename(i));
            let kd = entry.kd.unwrap_or([f64::from(entry.grey); 3]);
            for (key, [r, g, b]) in [("Kd", kd), ("Ke", entry.ke.unwrap_or_default())] {
                let _ = writeln!(text, "{key} {r} {g} {b}");
            }
        }
        text
    }

    fn push(&mut self, mut entry: Entry, tallies: &mut Tallies) {
        if self.index.contains_key(&entry.name) {
            return tallies.twice.add_named(entry.line, &entry.name);
        }
        if entry.kd.is_none() && entry.maps.kd.is_none() {
            tallies.no_kd.add_named(entry.line, &entry.name);
        }
        entry.there = entry.opacity.opacity(&entry.name, &mut tallies.opacity);
        if let Some(line) = entry.refracts.filter(|_| entry.there < 1.0 || entry.maps.d.is_some()) {
            tallies.other.add_refraction(line, &entry.name);
        }
        self.index.insert(entry.name.clone(), self.entries.len());
        self.entries.push(entry);
    }

    fn warn(&mut self, file: &str, tallies: &Tallies) {
        tallies.other.report(file, &mut self.warnings);
        tallies.opacity.report(file, &mut self.warnings);
        let no_kd = format!("it reflects {DEFAULT_RHO}{}", where_uncoloured(self.coloured));
        for (tally, noun, consequence) in [
            (&tallies.specular, "specular colour", "Ks is left out; --highlights shows highlights of direct light"),
            (&tallies.no_kd, "missing Kd", no_kd.as_str()),
            (&tallies.twice, "repeated definition", "the first one counts"),
        ] {
            tally.report(file, "line", noun, consequence, &mut self.warnings);
        }
    }
}

fn read_statement(
    file: &str,
    statement: &Statement,
    highlights: bool,
    entries: &mut Vec<Entry>,
    tallies: &mut Tallies,
) -> Result<(), SceneError> {
    if statement.keyword() == "newmtl" {
        entries.push(Entry::new(statement.material(), statement.line));
        return Ok(());
    }
    if let Some(entry) = entries.last_mut()
        && (entry.maps.take(file, statement)?
            || entry.opacity.take(file, statement, &entry.name, &mut tallies.opacity)?)
    {
        return Ok(());
    }
    match (statement.keyword(), entries.last_mut()) {
        ("Kd" | "Ke" | "Ks", None) => {
            return Err(statement.malformed(file, "a newmtl line before it", "none"));
        }
        ("Kd", Some(entry)) => entry.kd = Some(rho(file, statement, &entry.name)?),
        ("Ke", Some(entry)) => entry.ke = Some(emission(file, statement, &entry.name)?),
        ("Ks", Some(entry)) if highlights => entry.ks = Some(specular(file, statement, &entry.name)?),
        ("Ns", Some(entry)) if highlights => entry.ns = exponent(file, statement, &entry.name)?,
        ("Ks", Some(entry)) if is_nonzero(statement) => {
            tallies.specular.add_named(statement.line, &entry.name);
        }
        ("Ni", Some(entry)) => entry.refracts = (!statement.words().all(is_one)).then_some(statement.line),
        (_, Some(entry)) => tallies.other.take(statement, &entry.name),
        (_, None) => {}
    }
    Ok(())
}

fn is_one(word: &str) -> bool {
    word.parse() == Ok(1.0)
}

/// What a warning adds to the grey of a material, where vertices may have colours.
pub(crate) fn where_uncoloured(coloured: bool) -> &'static str {
    if coloured { " where vertices have no colour" } else { "" }
}

/// `Ks` is not used: what cannot be read as numbers is not zero either.
fn is_nonzero(statement: &Statement) -> bool {
    statement.words().any(|word| word.parse::<f64>() != Ok(0.0))
}

fn colour(file: &str, statement: &Statement) -> Result<[f64; 3], SceneError> {
    let words: Vec<&str> = statement.words().collect();
    match words[..] {
        ["spectral" | "xyz", ..] => Err(statement.malformed(file, "RGB numbers", words[0])),
        [grey] => Ok([statement.number(file, grey)?; 3]),
        [r, g, b] => {
            let number = |word| statement.number(file, word);
            Ok([number(r)?, number(g)?, number(b)?])
        }
        _ => Err(statement.malformed(file, "one number or three", &words.len().to_string())),
    }
}

fn rho(file: &str, statement: &Statement, material: &str) -> Result<[f64; 3], SceneError> {
    let kd = colour(file, statement)?;
    check_rho(kd, material, || Place::line(file, statement.line))?;
    Ok(kd)
}

fn emission(file: &str, statement: &Statement, material: &str) -> Result<[f64; 3], SceneError> {
    let ke = colour(file, statement)?;
    check_emission(ke, material, || Place::line(file, statement.line))?;
    Ok(ke)
}

fn specular(file: &str, statement: &Statement, material: &str) -> Result<[f64; 3], SceneError> {
    let ks = colour(file, statement)?;
    check_gloss(&ks, material, || Place::line(file, statement.line))?;
    Ok(ks)
}

fn exponent(file: &str, statement: &Statement, material: &str) -> Result<f64, SceneError> {
    let words: Vec<&str> = statement.words().collect();
    let [word] = words[..] else {
        return Err(statement.malformed(file, "one number", &words.len().to_string()));
    };
    let ns = statement.number(file, word)?;
    check_gloss(&[ns], material, || Place::line(file, statement.line))?;
    Ok(ns)
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
        let clean = libraries.clean_text(|i| i.to_string());
        assert_eq!(clean, "newmtl 0\nKd 0.5 0.5 0.5\nKe 10 10 10\n");
        assert_eq!(libraries.find("a b"), Some(0));
        assert!(libraries.warnings.is_empty());
    }

    #[test]
    fn the_first_of_two_definitions_counts() {
        let libraries = read("newmtl a\nKd .5\nnewmtl a\nKd .6").unwrap();
        assert_eq!(libraries.names().count(), 1);
        assert!(libraries.clean_text(|i| i.to_string()).contains("Kd 0.5"));
        assert!(libraries.warnings[0].contains("m.mtl, line 3"));
    }

    #[test]
    fn what_is_not_modelled_is_named() {
        let libraries = read("newmtl a\nmap_Bump x.png\nKs 0 0 .1\nnewmtl b\nKs 0\nbump y\n").unwrap();
        let all = libraries.warnings.join("\n");
        assert!(all.contains("2 textures of materials a, b (first: m.mtl, line 2)"), "{all}");
        assert!(all.contains("1 specular colour of material `a` (first: m.mtl, line 3)"), "{all}");
        assert!(all.contains("2 missing Kds of materials a, b"), "{all}");
    }
}
