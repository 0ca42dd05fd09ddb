//! Warnings: what a file holds that the scene does not, one sentence a kind with a count and the first place.
//!
//! Not handled: mistakes that make a scene unusable; those are errors.

use crate::scene::lines::{list, shorten};

/// Occurrences of one kind: how many, where first, and which names.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    pub count: usize,
    first: usize,
    names: Vec<String>,
}

impl Tally {
    /// Counts one occurrence at a line.
    pub fn add(&mut self, line: usize) {
        if self.count == 0 {
            self.first = line;
        }
        self.count += 1;
    }

    /// Counts one occurrence and keeps the name it belongs to, once.
    pub fn add_named(&mut self, line: usize, name: &str) {
        self.add(line);
        if !self.names.iter().rev().any(|known| known == name) && self.names.len() < 100 {
            self.names.push(name.to_owned());
        }
    }

    /// `2 statements a, b (first: FILE, line 7): CONSEQUENCE`, where the names are keywords.
    pub fn report_keywords(&self, file: &str, consequence: &str, warnings: &mut Vec<String>) {
        if self.count > 0 {
            let names = list(self.names.iter().map(String::as_str));
            let (count, first, plural) = (self.count, self.first, plural(self.count));
            warnings.push(format!("{count} statement{plural} {names} (first: {file}, line {first}): {consequence}"));
        }
    }

    /// `2 NOUN (first: FILE, ITEM 7): CONSEQUENCE`, naming the names; nothing where nothing was counted.
    pub fn report(&self, file: &str, item: &str, noun: &str, consequence: &str, warnings: &mut Vec<String>) {
        if self.count == 0 {
            return;
        }
        let of = match self.names.len() {
            0 => String::new(),
            1 => format!(" of material `{}`", shorten(&self.names[0])),
            _ => format!(" of materials {}", list(self.names.iter().map(String::as_str))),
        };
        let (count, first, plural) = (self.count, self.first, plural(self.count));
        warnings.push(format!("{count} {noun}{plural}{of} (first: {file}, {item} {first}): {consequence}"));
    }
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}
