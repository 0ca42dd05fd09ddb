//! Texture statements of MTL: `map_Kd`, `map_Ke` and `map_d` with their options and the name of a file.
//!
//! `-s u v w` scales and `-o u v w` moves coordinates, in this order; `-clamp on` ends the image at its edge;
//! `-imfchan` chooses what of a texel `map_d` reads. Names may hold spaces. Options that change nothing that is
//! modelled are passed over. Not handled: `-mm`, `-t`, textures of other statements.
//!
//! Source: Wavefront, *MTL Material Format*, Advanced Visualizer manual.

use glam::DVec2;

use crate::scene::error::SceneError;
use crate::scene::lines::Statement;
use crate::scene::textures::{Channel, Wrap};

/// The textures that one material of a library names.
#[derive(Clone, Debug, Default)]
pub(crate) struct MapLines {
    /// Of the reflectance.
    pub kd: Option<MapLine>,
    /// Of the emission.
    pub ke: Option<MapLine>,
    /// Of the mask.
    pub d: Option<MapLine>,
}

/// One statement.
#[derive(Clone, Debug)]
pub(crate) struct MapLine {
    /// The library and its line.
    pub file: String,
    pub line: usize,
    /// The image's file, as written.
    pub name: String,
    pub scale: DVec2,
    pub offset: DVec2,
    pub wrap: Wrap,
    /// Which number of a texel counts, where the statement says so.
    pub channel: Option<Channel>,
}

impl MapLines {
    /// Takes a statement if it is one of these; whether it is.
    ///
    /// # Errors
    /// A number that is none, or no name.
    pub fn take(&mut self, file: &str, statement: &Statement) -> Result<bool, SceneError> {
        let slot = match statement.keyword().to_ascii_lowercase().as_str() {
            "map_kd" => &mut self.kd,
            "map_ke" => &mut self.ke,
            "map_d" => &mut self.d,
            _ => return Ok(false),
        };
        *slot = Some(MapLine::read(file, statement)?);
        Ok(true)
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
        let words = match option {
            "-s" | "-o" | "-t" => return self.vector(file, statement, option, rest).map(Some),
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-imfchan" | "-bm" | "-boost" | "-texres" | "-type" => 1,
            "-mm" => 2,
            _ => return Ok(None),
        };
        let (value, mut rest) = split(rest);
        match (option, value) {
            ("-clamp", "on") => self.wrap = Wrap::Clamp,
            ("-imfchan", "r") => self.channel = Some(Channel::Colour(0)),
            ("-imfchan", "g") => self.channel = Some(Channel::Colour(1)),
            ("-imfchan", "b") => self.channel = Some(Channel::Colour(2)),
            ("-imfchan", "m") => self.channel = Some(Channel::Alpha),
            ("-imfchan", "l") => self.channel = Some(Channel::Luminance),
            _ => {}
        }
        for _ in 1..words {
            rest = split(rest).1;
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
    use crate::scene::lines::statements;

    fn read(text: &str) -> Result<MapLine, SceneError> {
        let statement = statements(text).next().unwrap();
        let mut found = MapLines::default();
        assert!(found.take("m.mtl", &statement)?);
        Ok(found.kd.unwrap())
    }

    #[test]
    fn options_are_told_from_names() {
        let found = read("map_Kd -blendu on -s 2 3 1 -o .5 -clamp on -mm 0 1 my wall 2.png").unwrap();
        assert_eq!((found.scale, found.offset), (DVec2::new(2.0, 3.0), DVec2::new(0.5, 0.0)));
        assert_eq!((found.wrap, found.name.as_str()), (Wrap::Clamp, "my wall 2.png"));
        let plain = read("map_kd -clamp off textures\\wall.png").unwrap();
        assert_eq!((plain.wrap, plain.name.as_str(), plain.channel), (Wrap::Repeat, "textures\\wall.png", None));
        assert_eq!(read("map_Kd -imfchan m a.png").unwrap().channel, Some(Channel::Alpha));
    }

    #[test]
    fn what_is_cut_off_is_an_error_with_its_line() {
        for text in ["map_Kd", "map_Kd -s 1 1 1", "map_Kd -o x a.png", "map_Kd -s", "map_Kd -clamp on"] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.starts_with("m.mtl, line 1: "), "{text}: {error}");
        }
    }
}
