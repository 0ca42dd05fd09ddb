//! Names that no two have: of layers, emitters, and rows of a table.
//!
//! Not handled: names that differ in case alone.

/// The names in order, each that was there before with a number from 2 on, as `numbered` writes it.
pub fn unlike(names: impl IntoIterator<Item = String>, numbered: impl Fn(&str, usize) -> String) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for name in names {
        let others = (2..).map(|k| numbered(&name, k));
        let free = std::iter::once(name.clone()).chain(others).find(|own| !all.contains(own));
        all.extend(free);
    }
    all
}

/// A number after a space.
pub fn spaced(name: &str, k: usize) -> String {
    format!("{name} {k}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_unlike() {
        assert_eq!(unlike(["a", "a", "a 2"].map(String::from), spaced), ["a", "a 2", "a 2 2"]);
        let names = ["a", "b", "a", "a (2)", "a"].map(String::from);
        let numbered = |name: &str, k: usize| format!("{name} ({k})");
        assert_eq!(unlike(names, numbered), ["a", "b", "a (2)", "a (2) (2)", "a (3)"]);
    }
}
