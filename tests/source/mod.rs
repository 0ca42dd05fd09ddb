//! The text of the source, read without a parser: files, words, what stands outside of comments and strings.
//!
//! Not handled: names made by macros.

pub mod imports;

use std::fs;
use std::path::Path;

/// One source file: its path below `src`, and its text.
pub struct Source {
    pub path: String,
    pub text: String,
}

impl Source {
    /// The module path: `["scene", "obj"]` for `scene/obj.rs`, `["scene"]` for `scene/mod.rs`, none for `lib.rs`.
    pub fn modules(&self) -> Vec<&str> {
        let stem = self.path.trim_end_matches(".rs");
        stem.split('/').filter(|part| *part != "mod").collect()
    }

    /// The code without comments, string literals and inline unit tests, which stand at the end of a file.
    pub fn tested_code(&self) -> String {
        let tests = self.text.find("#[cfg(test)]\nmod tests {");
        code(&self.text[..tests.unwrap_or(self.text.len())])
    }
}

/// Every `.rs` file below a directory, by path.
pub fn sources(root: &Path) -> Vec<Source> {
    let mut folders = vec![root.to_path_buf()];
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                sources.push(read(root, &path));
            }
        }
    }
    sources.sort_by(|a, b| a.path.cmp(&b.path));
    sources
}

fn read(root: &Path, path: &Path) -> Source {
    let below = path.strip_prefix(root).unwrap().components();
    let parts: Vec<_> = below.map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
    Source { path: parts.join("/"), text: fs::read_to_string(path).unwrap() }
}

/// Whether a character may stand in a name.
pub fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// All words of a text with the places where they start.
pub fn words(code: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + code[at..].find(is_word)?;
        let end = code[start..].find(|c| !is_word(c)).map_or(code.len(), |n| start + n);
        at = end;
        Some((start, &code[start..end]))
    })
}

/// The text without comments and without what stands in string literals.
pub fn code(text: &str) -> String {
    let mut code = String::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let skipped = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |n| n + 2)
        } else if let Some(raw) = rest.strip_prefix("r#\"") {
            raw.find("\"#").map_or(rest.len(), |n| n + 5)
        } else if c == '"' {
            string_end(rest)
        } else if rest.starts_with("'\"'") {
            3
        } else {
            code.push(c);
            rest = &rest[c.len_utf8()..];
            continue;
        };
        rest = &rest[skipped..];
    }
    code
}

/// The length of the string literal a text starts with.
fn string_end(text: &str) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            '"' if !escaped => return at + 1,
            '\\' => escaped = !escaped,
            _ => escaped = false,
        }
    }
    text.len()
}
