//! The structure of the source, held by reading it: light flows one way through the rooms of the core, the witness
//! shares nothing of the solver, no files import each other in a circle, files open with their purpose and stay short,
//! and one file alone is unsafe. Which crate may use which is in the manifests.
//!
//! Reads text, not syntax: comments and string literals are taken out first. Not handled: names made by macros, and
//! the module path of a `super` inside a nested inline module, which is taken as that of its file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::source::imports::{Imports, circle, imports};
use crate::source::{Source, code, is_word, sources, words};

/// The outer crates that belong to one room of the core, by the name they have in code.
const HOMES: [(&str, &str); 7] = [
    ("tobj", "scene"),
    ("data_url", "scene"),
    ("toml", "scene"),
    ("earcut", "scene"),
    ("image", "pictures"),
    ("csv", "pictures"),
    ("obvhs", "rays"),
];

/// The rooms of the core that the witness to the solver may use: anything else would be a mistake to share.
const WITNESS: [&str; 4] = ["light", "pictures", "scene", "rays"];

/// The one file with unsafe code, which the feature `opengl` brings: calls into a library that is loaded at run time.
const UNSAFE: &str = "opengl/calls.rs";

/// Lines a file may have.
const LONGEST: usize = 600;
/// Files of a room, and floors of files that import one another.
const FILES: usize = 18;
const FLOORS: usize = 6;
/// Columns that a comment may have; rustfmt keeps code within them, and leaves comments as they are.
const WIDEST: usize = 120;

/// The folders of source of all crates but Python's side; the core's is the first.
fn crates() -> Vec<(String, Vec<Source>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut names: Vec<String> = fs::read_dir(root.join("crates"))
        .unwrap()
        .map(|entry| format!("crates/{}/src", entry.unwrap().file_name().to_str().unwrap()))
        .collect();
    names.sort();
    names.insert(0, "src".into());
    names.into_iter().map(|name| (name.clone(), sources(&root.join(name)))).collect()
}

/// The rooms of the core in their order.
fn rooms_of_core() -> Vec<String> {
    let order = order(&fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).unwrap());
    assert!(order.len() >= 10 && order[0] == "light" && order.last().unwrap() == "render");
    order
}

#[test]
fn the_source_keeps_to_its_order() {
    let order = rooms_of_core();
    let all = crates();
    assert!(all.len() > 5 && all[0].1.len() > 100);
    let mut found = Vec::new();
    for (k, (folder, sources)) in all.iter().enumerate() {
        let own = if k == 0 { &order[..] } else { &[] };
        found.extend(sources.iter().flat_map(|s| violations(s, own)).map(|what| format!("{folder}/{what}")));
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn the_witness_shares_nothing_of_the_solver() {
    let rooms = rooms_of_core();
    let (_, sources) = crates().into_iter().find(|(folder, _)| folder == "crates/reference/src").unwrap();
    assert!(sources.len() > 5);
    let found: Vec<String> = sources.iter().flat_map(|s| shared(s, &rooms)).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn comments_outside_src_keep_to_their_width() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for folder in ["tests", "benches", "examples", "crates"] {
        let sources = sources(&root.join(folder));
        assert!(!sources.is_empty());
        let found: Vec<_> = sources.iter().filter_map(|s| Some(format!("{}: {}", s.path, wide_comment(s)?))).collect();
        assert!(found.is_empty(), "{folder}:\n{}", found.join("\n"));
    }
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    for (folder, sources) in crates() {
        assert_eq!(circle(&imports(&sources)), None, "{folder}");
    }
}

/// A room is a folder, and a folder inside counts as one of its own: so many files, and so many floors of files that
/// import one another.
#[test]
fn rooms_are_small() {
    let mut found = Vec::new();
    for (folder, sources) in crates() {
        let graph = imports(&sources);
        let mut rooms: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for source in &sources {
            let room = source.path.rsplit_once('/').map_or("", |(room, _)| room);
            rooms.entry(room).or_default().push(&source.path);
        }
        for (room, files) in &rooms {
            if files.len() > FILES {
                found.push(format!("{folder}/{room} has {} files, more than {FILES}", files.len()));
            }
            let floors = floors(&graph, room);
            if folder == "src" && !room.is_empty() && floors.len() > FLOORS {
                let chain = floors.join(" > ");
                found.push(format!("{folder}/{room} has {} floors, more than {FLOORS}: {chain}", floors.len()));
            }
        }
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// The longest chain of imports within a room, whose folders count as one file each.
fn floors(graph: &Imports, room: &str) -> Vec<String> {
    let own = |path: &str| {
        let inside = path.strip_prefix(room)?.strip_prefix('/')?;
        Some(inside.split('/').next()?.to_string()).filter(|name| name != "mod.rs" && name != "tests")
    };
    let mut edges: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (path, used) in graph {
        let Some(from) = own(path) else { continue };
        let used = used.iter().filter_map(|path| own(path)).filter(|to| *to != from);
        edges.entry(from.clone()).or_default().extend(used.collect::<Vec<_>>());
    }
    let mut known: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for name in edges.keys() {
        chain(name, &edges, &mut known);
    }
    known.into_values().max_by_key(Vec::len).unwrap_or_default()
}

/// The longest chain from a name on.
fn chain(
    name: &str,
    edges: &BTreeMap<String, BTreeSet<String>>,
    known: &mut BTreeMap<String, Vec<String>>,
) -> Vec<String> {
    if let Some(found) = known.get(name) {
        return found.clone();
    }
    // Folders may import each other's files in a circle that no files make.
    known.insert(name.into(), vec![name.into()]);
    let below = edges.get(name).into_iter().flatten().map(|next| chain(next, edges, known));
    let longest = below.max_by_key(Vec::len).unwrap_or_default();
    let found: Vec<String> = [name.to_string()].into_iter().chain(longest).collect();
    known.insert(name.into(), found.clone());
    found
}

/// A file under tests/ that no program names would compile nowhere, and its tests would never run.
#[test]
fn every_file_of_tests_is_run() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let programs = ["main", "memory_measured", "readers"];
    let main = fs::read_to_string(root.join("tests/main.rs")).unwrap();
    for entry in fs::read_dir(root.join("tests")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let holds_tests = path.extension().is_some_and(|e| e == "rs") || path.is_dir() && name != "data";
        if holds_tests && !programs.contains(&name.as_str()) {
            assert!(main.lines().any(|line| line == format!("mod {name};")), "tests/main.rs does not name {name}");
        }
    }
}

/// The first comment of a file that rustfmt leaves wider than code.
fn wide_comment(source: &Source) -> Option<String> {
    let is_wide = |line: &str| line.trim_start().starts_with("//") && line.chars().count() > WIDEST;
    let at = source.text.lines().position(is_wide)?;
    Some(format!("has a comment wider than {WIDEST} columns in line {}", at + 1))
}

/// The modules that lib.rs declares, in its order.
fn order(lib: &str) -> Vec<String> {
    let declared = lib.lines().filter_map(|l| l.strip_prefix("pub mod "));
    declared.filter_map(|l| Some(l.strip_suffix(';')?.to_string())).collect()
}

/// What one file does that it must not.
fn violations(source: &Source, order: &[String]) -> Vec<String> {
    let mut found = Vec::new();
    if !source.text.starts_with("//!") {
        found.push("does not open with //!".to_string());
    }
    let lines = source.text.lines().count();
    if lines > LONGEST {
        found.push(format!("has {lines} lines, more than {LONGEST}"));
    }
    found.extend(wide_comment(source));
    let code = code(&source.text);
    let is_unsafe = words(&code).any(|(_, word)| word == "unsafe" || word == "unsafe_code");
    if is_unsafe && ![UNSAFE, "lib.rs"].contains(&source.path.as_str()) {
        found.push("is unsafe".into());
    }
    let modules = source.modules();
    // lib.rs, which lists the modules, is not in the order, and neither are the guests.
    if let Some(own) = order.iter().position(|m| m == modules[0]) {
        found.extend(upward(&code, &modules, own, order));
        found.extend(strangers(&code, modules[0]));
    }
    let name = |what: String| format!("{}: {what}", source.path);
    found.into_iter().map(name).collect()
}

/// Uses, in the reference, of what it is there to check.
fn shared(source: &Source, rooms: &[String]) -> Vec<String> {
    let code = code(&source.text);
    let paths = words(&code).filter(|(_, word)| *word == "halflight");
    let used = paths.flat_map(|(at, word)| first_names(&code[at + word.len()..]));
    let strange = used.filter(|used| rooms.iter().any(|room| room == used) && !WITNESS.contains(used));
    let name = |used| format!("{}: shares {used} with the solver", source.path);
    strange.map(name).chain(roots(&code).map(|used| format!("{}: shares {used}", source.path))).collect()
}

/// What is used of the core's root, where names do not tell their room, but for those of light and scenes.
fn roots(code: &str) -> impl Iterator<Item = &str> {
    let paths = words(code).filter(|(_, word)| *word == "halflight");
    let used = paths.flat_map(|(at, word)| first_names(&code[at + word.len()..]));
    used.filter(|used| used.starts_with(char::is_uppercase) && !["Light", "Mode", "Transport", "Scene"].contains(used))
}

/// Uses of modules that come later.
fn upward(code: &str, modules: &[&str], own: usize, order: &[String]) -> Vec<String> {
    let mut found = Vec::new();
    for (at, word) in words(code) {
        let rest = match word {
            "crate" => &code[at + word.len()..],
            // A chain of `super` is looked at from its first.
            "super" if !code[..at].ends_with("super::") => match escape(&code[at..], modules) {
                Some(rest) => rest,
                None => continue,
            },
            _ => continue,
        };
        for used in first_names(rest) {
            match order.iter().position(|m| *m == used) {
                Some(other) if other > own => found.push(format!("uses {used}, which comes later")),
                // `super::*` is what inline modules say to the file they stand in.
                None if used == "*" && word == "crate" => found.push("imports everything there is".into()),
                _ => (),
            }
        }
    }
    found
}

/// What follows a chain of `super::` that leaves the file's top module for the crate's root.
fn escape<'a>(chain: &'a str, modules: &[&str]) -> Option<&'a str> {
    let mut rest = chain;
    let mut steps = 0;
    while let Some(after) = rest.strip_prefix("super") {
        steps += 1;
        match after.strip_prefix("::") {
            Some(next) if next.starts_with("super") => rest = next,
            _ => {
                rest = after;
                break;
            }
        }
    }
    (steps >= modules.len()).then_some(rest)
}

/// The first name of every path that starts with these `::`: one, or one for each item of a group in braces.
fn first_names(rest: &str) -> Vec<&str> {
    let Some(rest) = rest.strip_prefix("::") else {
        return Vec::new();
    };
    let Some(group) = rest.strip_prefix('{') else {
        return vec![first_name(rest)];
    };
    let mut depth = 0usize;
    let mut names = vec![first_name(group)];
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => names.push(first_name(&group[at + 1..])),
            _ => (),
        }
    }
    names.retain(|name| !name.is_empty());
    names
}

fn first_name(text: &str) -> &str {
    let text = text.trim_start();
    let end = text.find(|c: char| !is_word(c)).unwrap_or(text.len());
    if text.starts_with('*') { "*" } else { &text[..end] }
}

/// Outer crates used where they do not belong.
fn strangers(code: &str, top: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, word) in words(code) {
        let Some((name, home)) = HOMES.iter().find(|(name, _)| *name == word) else {
            continue;
        };
        // A path starts here if nothing comes before it but a leading `::`.
        let before = code[..at].strip_suffix("::");
        let starts = before.is_none_or(|b| !b.ends_with(|c: char| is_word(c) || c == '>'));
        let path = code[at + word.len()..].starts_with("::");
        if starts && path && *home != top {
            found.push(format!("uses the crate {name}, which belongs to {home}"));
        }
    }
    found
}

/// What the checker says of a made-up file in a crate of modules a, b, c.
fn said(path: &str, text: &str) -> Vec<String> {
    let source = Source { path: path.into(), text: text.into() };
    let order = ["light", "scene", "solve", "cli"];
    violations(&source, &order.map(String::from))
}

#[test]
fn the_checker_finds_what_it_looks_for() {
    let breaks = |path: &str, line: &str, part: &str| {
        let found = said(path, &format!("//! A file.\n{line}\n"));
        assert!(found.len() == 1 && found[0].contains(part), "{line}: {found:?}");
    };
    breaks("light/mod.rs", "use crate::scene::Scene;", "scene");
    breaks("light/a.rs", "use crate::{\n  light::Rgb,\n  cli::{a, b}};", "cli");
    breaks("light/a.rs", "fn f() { let x = crate::cli::run(); }", "cli");
    breaks("light/mod.rs", "use super::cli;", "cli");
    breaks("light/a.rs", "use super::super::{scene};", "scene");
    breaks("light/a/b.rs", "use super::super::super::cli::x;", "cli");
    breaks("light/a.rs", "use crate::*;", "everything");
    breaks("light/a.rs", "use tobj::Model;", "tobj");
    breaks("cli/a.rs", "let x = ::image::open(p);", "image");
    breaks("light/a.rs", "let x = <earcut::Earcut as T>::x();", "earcut");
    breaks("scene/a.rs", "unsafe { f() }", "unsafe");
    breaks("scene/a.rs", &"\n".repeat(LONGEST), "lines");
    breaks("scene/a.rs", &format!("    // {}", "²".repeat(WIDEST - 6)), "columns in line 2");
    assert!(said("cli/a.rs", "use crate::light;\n")[0].contains("//!"));
}

#[test]
fn the_checker_sees_what_the_witness_shares() {
    let rooms = ["light", "scene", "solve"].map(String::from);
    let said = |text: &str| shared(&Source { path: "a.rs".into(), text: text.into() }, &rooms);
    assert_eq!(said("use halflight::solve::neumann;"), ["a.rs: shares solve with the solver"]);
    assert_eq!(said("use halflight::{light::Rgb, solve::neumann, Solver};").len(), 2);
    assert!(said("use halflight::scene::Scene; use halflight::{Light, light::Rgb}; // halflight::solve").is_empty());
}

#[test]
fn the_checker_lets_through_what_is_right() {
    let widest = format!("    // {}", "²".repeat(WIDEST - 7));
    for (path, line) in [
        ("scene/a.rs", "use crate::light::{Rgb, cli};"),
        ("scene/a.rs", "use super::cli;"),
        ("scene/a/b.rs", "use super::super::cli;"),
        ("scene/mod.rs", "mod tests { use super::*; }"),
        ("scene/a.rs", "use tobj::Model;"),
        ("scene/a.rs", "// use crate::cli, unsafe"),
        ("scene/a.rs", widest.as_str()),
        ("scene/a.rs", "let x = \"\\\" crate::cli::run unsafe\";"),
        ("scene/a.rs", "let x = ('\"', r#\"unsafe \" \"#);"),
        ("scene/a.rs", "use self::image::Picture; let unsafely = 1;"),
        ("cli/a.rs", "use crate::light::image::Picture;"),
    ] {
        let found = said(path, &format!("//! A file.\n{line}\n"));
        assert!(found.is_empty(), "{line}: {found:?}");
    }
}

#[test]
fn modules_are_read_in_the_order_they_are_declared() {
    let lib = "//! pub mod no;\npub mod b;\n\npub mod a;\nmod hidden;\n";
    assert_eq!(order(lib), ["b", "a"]);
}

/// The files of a made-up crate that import each other in a circle.
fn circle_of(files: &[(&str, &str)]) -> Option<Vec<String>> {
    let source = |(path, text): &(&str, &str)| Source { path: path.to_string(), text: text.to_string() };
    let graph = imports(&files.iter().map(source).collect::<Vec<_>>());
    circle(&graph).map(|files| files.into_iter().map(String::from).collect())
}

#[test]
fn circles_are_found_through_re_exports_and_paths() {
    let room = ("room/mod.rs", "pub mod a;\npub mod b;\npub use a::{A, f};\npub(crate) use b::B as C;\n");
    let b = ("room/b.rs", "use crate::room::a::{self, A};\npub struct B(A);");
    assert_eq!(circle_of(&[room, ("room/a.rs", "use std::fs;\npub struct A;"), b]), None);
    let both = Some(vec!["room/a.rs".to_string(), "room/b.rs".to_string()]);
    for text in [
        "use crate::room::{b::B};",
        "use super::b::*;",
        "fn f() { crate::room::b::B::new() }",
        "fn f() { super::super::room::b::B }",
        "use crate::room::b;",
    ] {
        assert_eq!(circle_of(&[room, ("room/a.rs", text), b]), both, "{text}");
    }
    for text in ["// use crate::room::b::B;", "#[cfg(test)]\nmod tests { use crate::room::b::B; }", "use other::b::B;"]
    {
        assert_eq!(circle_of(&[room, ("room/a.rs", text), b]), None, "{text}");
    }
}

#[test]
fn what_a_mod_file_defines_is_below_what_it_re_exports() {
    let parts = [("room/mod.rs", "pub use a::A;\npub struct Room(A);"), ("room/a.rs", "use crate::room::Room;")];
    assert_eq!(circle_of(&parts).map(|c| c.len()), Some(2));
}
