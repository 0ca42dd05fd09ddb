//! The files that the `mtllib` lines of an OBJ name, found and read.
//!
//! File names may hold spaces, and spaces part file names: the longest run of words that is a file is taken first. `\`
//! counts as `/` where no file has it in its name, and a path that leads nowhere is looked for by its last part beside
//! the OBJ, since exporters write the paths of their own machine. What is not found is warned of.
//!
//! Not handled: names that differ from the file's in upper and lower case.

use std::borrow::Cow;
use std::collections::HashSet;
use std::io;

use crate::scene::encoding::Latin;
use crate::scene::error::SceneError;
use crate::scene::lines::list;
use crate::scene::mtl::Libraries;
use crate::scene::warnings::Tally;

/// Reads a file named relative to the OBJ or scene file.
pub(crate) type Reader<'a> = &'a dyn Fn(&str) -> io::Result<Cow<'a, [u8]>>;

/// The most words of an `mtllib` line that are tried as file names.
const MOST_WORDS: usize = 32;

/// What one `mtllib` line stands for.
struct Found<'a> {
    /// Names and bytes of the files that are there.
    files: Vec<(String, Cow<'a, [u8]>)>,
    /// Names of those that are not.
    missing: Vec<String>,
    /// Why not.
    failure: Option<io::Error>,
}

/// Names of files that could not be read, and why the first of them could not.
#[derive(Default)]
struct Missing {
    lines: Tally,
    names: Vec<String>,
    failure: Option<io::Error>,
}

/// Reads every library of `lines`, which hold a line number and what follows `mtllib`; `file` names the OBJ.
///
/// They are added to `libraries`. Warnings of the libraries, and one on files that cannot be read, are left in
/// [`Libraries::warnings`].
///
/// # Errors
/// The first mistake in a library that is there.
pub(crate) fn read(
    file: &str,
    lines: &[(usize, String)],
    reader: Reader,
    latin: &mut Latin,
    mut libraries: Libraries,
) -> Result<Libraries, SceneError> {
    let mut missing = Missing::default();
    // A line said again says nothing new; reading its files for each of many lines would take forever.
    let (mut known, mut read) = (HashSet::new(), HashSet::new());
    for (line, names) in lines.iter().filter(|(_, names)| known.insert(names)) {
        let found = find(names, reader);
        for (name, bytes) in found.files {
            if read.insert(name.clone()) {
                libraries.read(&name, &latin.decode(&name, &bytes)?)?;
            }
        }
        missing.take(*line, found.missing, found.failure);
    }
    missing.report(file, &mut libraries.warnings);
    Ok(libraries)
}

impl Missing {
    fn take(&mut self, line: usize, names: Vec<String>, failure: Option<io::Error>) {
        names.iter().for_each(|_| self.lines.add(line));
        self.names.extend(names);
        self.failure = self.failure.take().or(failure);
    }

    fn report(&self, file: &str, warnings: &mut Vec<String>) {
        let names = list(self.names.iter().map(String::as_str));
        let why = self.failure.as_ref().map_or(String::new(), |failure| format!(" ({failure})"));
        self.lines.report(file, "line", "missing MTL file", &format!("{names}{why}"), warnings);
    }
}

fn find<'a>(names: &str, reader: Reader<'a>) -> Found<'a> {
    let failure = match read_either_way(names, reader) {
        Ok(bytes) => return Found { files: vec![(names.to_owned(), bytes)], missing: Vec::new(), failure: None },
        Err(failure) => failure,
    };
    let words: Vec<&str> = names.split_whitespace().take(MOST_WORDS + 1).collect();
    let mut found = Found { files: Vec::new(), missing: Vec::new(), failure: Some(failure) };
    if words.len() <= MOST_WORDS {
        found.take_words(&words, reader);
    }
    if found.files.is_empty() {
        found.missing = vec![names.to_owned()];
    }
    found
}

impl<'a> Found<'a> {
    fn take_words(&mut self, words: &[&str], reader: Reader<'a>) {
        let (mut start, mut lost) = (0, Vec::new());
        while start < words.len() {
            let runs = (start + 1..=words.len()).rev().map(|end| (end, words[start..end].join(" ")));
            let mut files = runs.filter_map(|(end, run)| Some((end, read_either_way(&run, reader).ok()?, run)));
            let Some((end, bytes, run)) = files.next() else {
                lost.push(words[start]);
                start += 1;
                continue;
            };
            self.lose(&mut lost);
            self.files.push((run, bytes));
            start = end;
        }
        self.lose(&mut lost);
    }

    /// Words that follow each other and are no file are one name.
    fn lose(&mut self, words: &mut Vec<&str>) {
        if !words.is_empty() {
            self.missing.push(words.join(" "));
            words.clear();
        }
    }
}

/// The file of that name; else with `/` for `\`; else of its last part.
pub(crate) fn read_either_way<'a>(name: &str, reader: Reader<'a>) -> io::Result<Cow<'a, [u8]>> {
    let slashes = name.replace('\\', "/");
    let last = slashes.rsplit('/').next().unwrap_or("");
    reader(name).or_else(|failure| {
        let others = [slashes.as_str(), last].into_iter().filter(|other| !other.is_empty() && *other != name);
        others.map(reader).find_map(Result::ok).ok_or(failure)
    })
}
