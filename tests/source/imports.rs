//! Which file imports which: the graph of files, and circles in it.
//!
//! A path leads to the file that defines its item: re-exports are followed, and a module by itself leads to its own
//! file. What a file re-exports it imports. Inline unit tests are left out, as they look into the file they stand in.
//!
//! Not handled: items reached by methods alone, as an `impl` of one file's type in another file; re-exports under other
//! names; names made by macros.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::{Source, is_word, words};

/// The files that each file imports from, by path.
pub type Imports = BTreeMap<String, BTreeSet<String>>;

/// A path of modules and items from the crate's root.
type ItemPath = Vec<String>;

/// The files by module path, and what each re-exports by name.
struct Crate<'a> {
    files: HashMap<ItemPath, &'a str>,
    shared: HashMap<&'a str, HashMap<String, ItemPath>>,
}

/// The graph of imports of some files.
pub fn imports(sources: &[Source]) -> Imports {
    let path = |s: &Source| s.modules().into_iter().map(String::from).collect::<ItemPath>();
    let inner: Vec<&Source> = sources.iter().filter(|s| s.path != "lib.rs" && s.path != "main.rs").collect();
    let files = inner.iter().map(|s| (path(s), s.path.as_str())).collect();
    let mut whole = Crate { files, shared: HashMap::new() };
    let used: Vec<Vec<Used>> = inner.iter().map(|s| whole.used(&s.tested_code(), &path(s))).collect();
    for (source, used) in inner.iter().zip(&used) {
        let shared = used.iter().filter(|u| u.shared).filter_map(|u| Some((u.path.last()?.clone(), u.path.clone())));
        whole.shared.insert(&source.path, shared.collect());
    }
    let mut graph = Imports::new();
    for (source, used) in inner.iter().zip(&used) {
        let files = used.iter().filter_map(|u| whole.file(&u.path, 0)).filter(|file| *file != source.path);
        graph.insert(source.path.clone(), files.map(String::from).collect());
    }
    graph
}

/// A path that a file uses, and whether it re-exports it.
struct Used {
    path: ItemPath,
    shared: bool,
}

impl Crate<'_> {
    /// All paths into the crate that the code of a module uses.
    fn used(&self, code: &str, module: &ItemPath) -> Vec<Used> {
        let mut used = Vec::new();
        let mut end = 0;
        for (at, word) in words(code).filter(|(at, _)| !code[..*at].ends_with("::")) {
            let shared = word == "use" && is_shared(&code[..at]);
            if at < end {
                continue;
            }
            let paths = if word == "use" {
                end = at + code[at..].find(';').unwrap_or(0);
                branches(&code[at + word.len()..end.max(at + word.len())], &[])
            } else {
                let length = code[at..].find(|c: char| !is_word(c) && c != ':').unwrap_or(code.len() - at);
                branches(&code[at..at + length], &[]).into_iter().filter(|p| p.len() > 1).collect()
            };
            let inside = paths.into_iter().filter_map(|path| self.absolute(path, module));
            used.extend(inside.map(|path| Used { path, shared }));
        }
        used
    }

    /// A path from the crate's root; none where it leads out of the crate.
    fn absolute(&self, path: ItemPath, module: &ItemPath) -> Option<ItemPath> {
        let ups = path.iter().take_while(|part| *part == "super").count();
        let base = match path.first()?.as_str() {
            "crate" => Vec::new(),
            "super" => module[..module.len().checked_sub(ups)?].to_vec(),
            "self" => module.clone(),
            child => {
                let base = [module.clone(), vec![child.to_string()]].concat();
                return self.files.contains_key(&base).then(|| [module.clone(), path].concat());
            }
        };
        let rest = path.into_iter().skip(ups.max(1));
        Some(base.into_iter().chain(rest).filter(|part| part != "self").collect())
    }

    /// The file that defines what a path leads to.
    fn file(&self, path: &[String], depth: u32) -> Option<&str> {
        let (known, file) = (0..=path.len()).rev().find_map(|n| Some((n, *self.files.get(&path[..n])?)))?;
        let elsewhere = path.get(known).and_then(|name| self.shared.get(file)?.get(name));
        match elsewhere {
            Some(other) if depth < 8 => self.file(&[other, &path[known + 1..]].concat(), depth + 1),
            _ => Some(file),
        }
    }
}

/// Whether the code before a `use` makes it a re-export.
fn is_shared(before: &str) -> bool {
    let before = before.trim_end();
    let bare = before.rfind("pub(").filter(|_| before.ends_with(')'));
    before.ends_with("pub") || bare.is_some_and(|at| !before[at..before.len() - 1].contains(')'))
}

/// The paths of a tree of imports as `a::{b, c::{d, e as f}}`.
fn branches(tree: &str, prefix: &[String]) -> Vec<ItemPath> {
    let tree = tree.trim();
    let Some((stem, group)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or("");
        let parts = path.split("::").map(|part| part.trim().to_string()).filter(|part| !part.is_empty());
        let path: ItemPath = prefix.iter().cloned().chain(parts.filter(|part| part != "*")).collect();
        return if tree.is_empty() { Vec::new() } else { vec![path] };
    };
    let stem = stem.split("::").map(|part| part.trim().to_string()).filter(|part| !part.is_empty());
    let prefix: Vec<String> = prefix.iter().cloned().chain(stem).collect();
    let group = group.strip_suffix('}').unwrap_or(group);
    let (mut depth, mut start, mut found) = (0, 0, Vec::new());
    for (at, c) in group.char_indices().chain([(group.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                found.extend(branches(&group[start..at], &prefix));
                start = at + 1;
            }
            _ => (),
        }
    }
    found
}

/// Files that import each other in a circle, if there are any.
pub fn circle(graph: &Imports) -> Option<Vec<&str>> {
    let mut done = HashSet::new();
    graph.keys().find_map(|file| circle_from(file, graph, &mut Vec::new(), &mut done))
}

/// The first circle that is met from a file on; `way` are the files that lead there, `done` those looked at.
fn circle_from<'a>(
    file: &'a str,
    graph: &'a Imports,
    way: &mut Vec<&'a str>,
    done: &mut HashSet<&'a str>,
) -> Option<Vec<&'a str>> {
    if let Some(start) = way.iter().position(|f| *f == file) {
        return Some(way[start..].to_vec());
    }
    if !done.insert(file) {
        return None;
    }
    way.push(file);
    let mut next = graph.get(file).into_iter().flatten();
    let found = next.find_map(|next| circle_from(next, graph, way, done));
    way.pop();
    found
}
