//! Opacity of MTL's materials: `d`, the share of a surface that is there, and `Tr`, what is left of it, 1 - d.
//!
//! Where both stand, `d` counts, and a warning says so where they disagree. Numbers outside 0..1 are clamped, and the
//! factor of `d -halo` is taken for all directions, each with a warning. A library all of whose materials say `Tr 1`,
//! and none `d`, would leave nothing: it is by a program that writes 1 for opaque (MeshLab), and is read so, with a
//! warning.
//!
//! Not handled: what opacity does; it is the factor of a [`crate::scene::textures::Mask`].
//!
//! Source: Wavefront, *MTL Material Format*, for `d`; `Tr` is of its readers and writers.

use crate::scene::error::SceneError;
use crate::scene::lines::Statement;
use crate::scene::warnings::Tally;

/// How far `d` and 1 - `Tr` may lie apart to be the same, written with few digits.
const SAME: f64 = 5e-3;

/// What a library is told all of whose materials say `Tr 1` alone.
const INVERTED: &str = "every material says it and none `d`, so it is read as opaque, as some programs mean it; `d 0` \
                        leaves faces out";

/// What one material says.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OpacityLines {
    d: Option<f64>,
    tr: Option<f64>,
    /// The last line of either.
    line: usize,
}

/// What is read otherwise than it is written.
#[derive(Debug, Default)]
pub(crate) struct OpacityFlaws {
    halo: Tally,
    outside: Tally,
    apart: Tally,
    inverted: Tally,
}

impl OpacityLines {
    /// Whether it says `Tr 1` and no more.
    fn is_nothing(&self) -> bool {
        self.d.is_none() && self.tr == Some(1.0)
    }

    /// Takes a statement if it is one of these; whether it is.
    ///
    /// # Errors
    /// No number, or more than one.
    pub fn take(
        &mut self,
        file: &str,
        statement: &Statement,
        material: &str,
        flaws: &mut OpacityFlaws,
    ) -> Result<bool, SceneError> {
        let slot = match statement.keyword() {
            "d" => &mut self.d,
            "Tr" | "tr" => &mut self.tr,
            _ => return Ok(false),
        };
        let words: Vec<&str> = statement.words().collect();
        let word = match words[..] {
            [word] => word,
            ["-halo", word] => {
                flaws.halo.add_named(statement.line, material);
                word
            }
            _ => return Err(statement.malformed(file, "one number", &words.len().to_string())),
        };
        let number = statement.number(file, word)?;
        if !(0.0..=1.0).contains(&number) {
            flaws.outside.add_named(statement.line, material);
        }
        *slot = Some(number.clamp(0.0, 1.0));
        self.line = statement.line;
        Ok(true)
    }

    /// The share of the surface that is there; counts a `Tr` that says another than `d`.
    pub fn opacity(&self, material: &str, flaws: &mut OpacityFlaws) -> f32 {
        let (d, rest) = (self.d, self.tr.map(|tr| 1.0 - tr));
        if let (Some(d), Some(rest)) = (d, rest)
            && (d - rest).abs() > SAME
        {
            flaws.apart.add_named(self.line, material);
        }
        d.or(rest).unwrap_or(1.0) as f32
    }
}

/// Takes the opacities of a library, with the names of its materials, for those of a program that writes 1 for opaque,
/// if all of them say that nothing is there.
pub(crate) fn without_inverted<'a>(
    library: impl Iterator<Item = (&'a str, &'a mut OpacityLines)>,
    flaws: &mut OpacityFlaws,
) {
    let all: Vec<_> = library.collect();
    if !all.iter().all(|(_, lines)| lines.is_nothing()) {
        return;
    }
    for (name, lines) in all {
        flaws.inverted.add_named(lines.line, name);
        *lines = OpacityLines::default();
    }
}

impl OpacityFlaws {
    /// Appends the warnings of a library.
    pub fn report(&self, file: &str, warnings: &mut Vec<String>) {
        for (tally, noun, consequence) in [
            (&self.halo, "d -halo statement", "its factor is taken for all directions"),
            (&self.outside, "opacity value", "outside 0..1, and clamped"),
            (&self.inverted, "Tr 1 statement", INVERTED),
            (&self.apart, "contradictory Tr statement", "it is not 1 - d; d counts"),
        ] {
            tally.report(file, "line", noun, consequence, warnings);
        }
    }
}
