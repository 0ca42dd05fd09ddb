//! What a glTF file holds that the scene does not, named in one warning.
//!
//! Not handled: mistakes; those are errors.

use crate::scene::lines::list;

/// Kinds of things that are not modelled, each with the names of what has them.
#[derive(Default)]
pub(super) struct Ignored {
    kinds: Vec<(&'static str, Vec<String>)>,
}

impl Ignored {
    /// Counts one thing of a kind.
    pub fn add(&mut self, kind: &'static str, name: &str) {
        let known = self.kinds.iter().position(|(known, _)| *known == kind);
        let at = known.unwrap_or_else(|| {
            self.kinds.push((kind, Vec::new()));
            self.kinds.len() - 1
        });
        let names = &mut self.kinds[at].1;
        if names.last().is_none_or(|last| last != name) {
            names.push(name.to_owned());
        }
    }

    /// `FILE: KIND (NAME, NAME), KIND (NAME): not modelled and ignored`; nothing where nothing was counted.
    pub fn report(&self, file: &str, warnings: &mut Vec<String>) {
        if self.kinds.is_empty() {
            return;
        }
        let kind = |(kind, names): &(&str, Vec<String>)| format!("{kind} ({})", list(names.iter().map(String::as_str)));
        let kinds: Vec<String> = self.kinds.iter().map(kind).collect();
        warnings.push(format!("{file}: not modelled and ignored: {}", kinds.join("; ")));
    }
}
