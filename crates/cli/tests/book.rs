//! The pages of docs/book: their commands are run as they stand, in the order of the page, and print what it shows.
//!
//! A page is run in an empty directory with the room of tests/data/welcome. Blocks called `console` are commands, `$ `
//! before them, and their output, of which `…` leaves out lines; numbers are not compared, words are. A command that
//! must fail has `|| echo "exit code $?"` behind it. A block whose first line is `# NAME.toml`, `# NAME.csv` or
//! `# NAME.py` is written as that file. `$ python` is run where there is a Python that has NumPy and SciPy
//! (`HALFLIGHT_PYTHON`).
//!
//! Not handled: quotes and pipes in commands, which no page has.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

use crate::run;

/// Behind a command that is to fail.
const FAILS: &str = " || echo \"exit code $?\"";

/// A fenced block of a page.
struct Block {
    kind: String,
    lines: Vec<String>,
}

fn book() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book")
}

fn blocks(page: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let mut open: Option<Block> = None;
    for line in page.lines() {
        match (line.strip_prefix("```"), open.take()) {
            (Some(_), Some(block)) => found.push(block),
            (Some(kind), None) => open = Some(Block { kind: kind.into(), lines: Vec::new() }),
            (None, Some(mut block)) => {
                block.lines.push(line.into());
                open = Some(block);
            }
            (None, None) => (),
        }
    }
    assert!(open.is_none(), "a block does not end");
    found
}

/// Commands of a block of them, each with the lines that the page shows of its output.
fn commands(block: &Block) -> Vec<(&str, Vec<&str>)> {
    let mut found: Vec<(&str, Vec<&str>)> = Vec::new();
    if block.kind != "console" {
        return found;
    }
    for line in &block.lines {
        match (line.strip_prefix("$ "), found.last_mut()) {
            (Some(command), _) => found.push((command, Vec::new())),
            (None, Some((_, shown))) => shown.push(line),
            (None, None) => panic!("output before a command: {line}"),
        }
    }
    found
}

/// A line without its numbers and the spaces that line them up.
fn words(line: &str) -> String {
    let words: Vec<String> = line.split_whitespace().map(without_numbers).collect();
    words.join(" ")
}

/// A word with a mark in place of each number, its sign and its exponent.
fn without_numbers(word: &str) -> String {
    let mut text = String::new();
    let mut rest = word;
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
        let (before, number) = rest.split_at(at);
        text += before.trim_end_matches(['-', '+', '.']);
        text.push('#');
        rest = number.trim_start_matches(|c: char| c.is_ascii_digit() || ".e-".contains(c));
    }
    text + rest
}

/// The first line of a block names the file that the block is.
fn file(block: &Block) -> Option<&str> {
    let name = block.lines.first()?.strip_prefix("# ")?;
    [".toml", ".csv", ".py"].iter().any(|ending| name.ends_with(ending)).then_some(name)
}

fn python() -> Option<PathBuf> {
    let python = PathBuf::from(std::env::var_os("HALFLIGHT_PYTHON")?);
    let tries = Command::new(&python).args(["-c", "import numpy, scipy"]).output();
    tries.is_ok_and(|tried| tried.status.success()).then_some(python)
}

/// What became of a command; nothing where this machine cannot run it.
fn ran(command: &str, place: &TempDir) -> Option<Output> {
    let mut arguments = command.split_whitespace();
    let program = match arguments.next() {
        Some("halflight") => run::program(),
        Some("python") => python()?,
        other => panic!("pages run halflight and python, not {other:?}"),
    };
    Some(Command::new(program).args(arguments).current_dir(place.path()).output().unwrap())
}

/// Runs one page.
#[track_caller]
fn page(name: &str) {
    let text = fs::read_to_string(book().join(name)).unwrap();
    let place = run::place(&[]);
    let room = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/welcome");
    for file in ["room.obj", "room.mtl"] {
        fs::copy(room.join(file), place.path().join(file)).unwrap();
    }
    let mut count = 0;
    for block in blocks(&text) {
        if let Some(name) = file(&block) {
            fs::write(place.path().join(name), block.lines.join("\n") + "\n").unwrap();
        }
        for (command, shown) in commands(&block) {
            check(command, &shown, &place);
            count += 1;
        }
    }
    assert!(count > 0, "{name} has no command");
}

/// Runs a command, which must end as the page says and print what it shows.
#[track_caller]
fn check(command: &str, shown: &[&str], place: &TempDir) {
    let plain = command.strip_suffix(FAILS).unwrap_or(command);
    let Some(output) = ran(plain, place) else {
        return eprintln!("skipped, as HALFLIGHT_PYTHON names no Python with NumPy and SciPy: {command}");
    };
    let mut said = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    if plain == command {
        assert!(output.status.success(), "{command}: {said}");
    } else {
        said += &format!("\nexit code {}", output.status.code().unwrap());
        assert_eq!(shown.last().copied(), said.lines().last(), "{command}");
    }
    let said: Vec<String> = said.lines().map(words).collect();
    for line in shown.iter().filter(|line| **line != "…") {
        assert!(said.contains(&words(line)), "{command} does not print\n{line}\nbut\n{}", said.join("\n"));
    }
}

#[test]
fn a_first_picture() {
    page("picture.md");
}

#[test]
fn the_bounce_series() {
    page("bounces.md");
}

#[test]
fn where_it_diverges() {
    page("divergence.md");
}

#[test]
fn lamp_by_lamp() {
    page("lamps.md");
}

#[test]
fn many_columns() {
    page("columns.md");
}

#[test]
fn your_own_solver() {
    page("solver.md");
}

#[test]
fn a_stated_error() {
    page("error.md");
}

#[test]
fn the_index_has_every_page() {
    let index = fs::read_to_string(book().join("README.md")).unwrap();
    let own = include_str!("book.rs");
    for entry in fs::read_dir(book()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if name != "README.md" {
            assert!(index.contains(&format!("({name})")), "the index lacks {name}");
            assert!(own.contains(&format!("page(\"{name}\")")), "no test runs {name}");
        }
    }
}

#[test]
fn numbers_are_not_compared_and_words_are() {
    assert_eq!(words("  KE   3.38e-5  in 2.10 s"), words("KE 1.0e5 in 12 s"));
    assert_ne!(words("converges in 3 s"), words("diverges in 3 s"));
    assert_eq!(words("mean difference -1.2e-4"), words("mean difference 3"));
}
