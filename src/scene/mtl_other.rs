//! MTL's statements that are not modelled: which of them change a picture of diffuse light, and so are warned of.
//!
//! The table of all statements is in docs/commands.md. A statement whose number leaves everything as it is (`Tf 1`, `Pm
//! 0`, `illum 2`) is passed over, and so are those that say something of ambient light (`Ka`), which no scene has, and
//! of how highlights are drawn.
//!
//! Not handled: what is modelled ([`crate::scene::mtl`]).

use crate::scene::lines::{Statement, list};
use crate::scene::warnings::Tally;

/// What is not modelled of one library's materials.
#[derive(Debug, Default)]
pub(crate) struct Other {
    textures: Unread,
    statements: Unread,
}

/// Statements of one kind: where they are, and which.
#[derive(Debug, Default)]
struct Unread {
    lines: Tally,
    keywords: Vec<String>,
}

/// What a statement does to a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Effect {
    /// Nothing, with these numbers.
    None,
    /// It lays an image onto something.
    Texture,
    /// It would change something else.
    Unmodelled,
}

impl Other {
    /// Counts a statement of a material if it would change the picture.
    pub fn take(&mut self, statement: &Statement, material: &str) {
        let kind = match effect(statement) {
            Effect::None => return,
            Effect::Texture => &mut self.textures,
            Effect::Unmodelled => &mut self.statements,
        };
        let number = statement.words().next().filter(|_| statement.keyword() == "illum");
        let keyword = number.map_or_else(|| statement.keyword().to_owned(), |number| format!("illum {number}"));
        kind.add(statement.line, material, keyword);
    }

    /// Counts the index of refraction of a material that light goes through.
    pub fn add_refraction(&mut self, line: usize, material: &str) {
        self.statements.add(line, material, "Ni".to_owned());
    }

    /// Appends the warnings of a library.
    pub fn report(&self, file: &str, warnings: &mut Vec<String>) {
        let textures = "of textures map_Kd, map_Ke and map_d alone are modelled";
        self.textures.report(file, "texture", textures, warnings);
        self.statements.report(file, "statement", "not modelled, and left out", warnings);
    }
}

impl Unread {
    fn add(&mut self, line: usize, material: &str, keyword: String) {
        self.lines.add_named(line, material);
        if self.keywords.len() < 100 && !self.keywords.contains(&keyword) {
            self.keywords.push(keyword);
        }
    }

    fn report(&self, file: &str, noun: &str, consequence: &str, warnings: &mut Vec<String>) {
        let keywords = list(self.keywords.iter().map(String::as_str));
        self.lines.report(file, "line", noun, &format!("{keywords}: {consequence}"), warnings);
    }
}

/// What a statement that is not modelled does.
fn effect(statement: &Statement) -> Effect {
    let numbers = || statement.words().map(|word| word.parse::<f64>().unwrap_or(f64::NAN));
    let unless = |is_neutral: bool| if is_neutral { Effect::None } else { Effect::Unmodelled };
    match statement.keyword() {
        // Ambient light; how sharp mirrors are; how highlights and clear coats fall off; names of shaders.
        "Ka" | "map_Ka" | "Ns" | "Ks" | "Ni" | "sharpness" | "map_aat" | "Pcr" | "anisor" => Effect::None,
        "Tf" => unless(numbers().all(|number| number == 1.0)),
        "Pr" => unless(numbers().all(|number| number >= 1.0)),
        "Pm" | "Ps" | "Pc" | "aniso" => unless(numbers().all(|number| number == 0.0)),
        "illum" => unless(numbers().all(|number| number == 1.0 || number == 2.0)),
        key if key.starts_with("map_") || matches!(key, "bump" | "disp" | "decal" | "refl" | "norm") => Effect::Texture,
        _ => Effect::Unmodelled,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::lines::statements;

    #[test]
    fn numbers_that_change_nothing_are_passed_over() {
        let found = |text: &str| effect(&statements(text).next().unwrap());
        for text in ["Ka 1 1 1", "Tf 1 1 1", "Tf 1.0", "Pm 0", "Pr 1", "illum 2", "illum 1", "Ni 1.5", "map_Ka a.png"] {
            assert_eq!(found(text), Effect::None, "{text}");
        }
        for text in ["Tf .9 1 1", "Tf xyz 1", "Pm 1", "Pr .3", "Ps 0.1", "illum 0", "illum 7", "illum x", "Kt 1"] {
            assert_eq!(found(text), Effect::Unmodelled, "{text}");
        }
        for text in ["map_Pm a.png", "norm a.png", "map_bump a.png", "refl -type sphere a.png", "map_emissive a.png"] {
            assert_eq!(found(text), Effect::Texture, "{text}");
        }
    }
}
