//! `halflight report`: what to attach to a report of a fault: version, features, machine, and the command in question.
//!
//! Nothing private is in it: of the command stay the names of commands, options, built-in scenes and choices, and
//! numbers; what else stands there, paths and names of materials, becomes `FILE.obj` or `NAME`. Nothing is run,
//! written or sent. Not handled: the processor's name where there is no `/proc/cpuinfo` that has it.

use std::collections::BTreeSet;
use std::path::Path;
use std::thread::available_parallelism;

use clap::{Args, Command};
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use halflight::render::usable_memory;
use halflight::scene::builtin;

/// `halflight report`
#[derive(Args, Debug)]
pub struct ReportArguments {
    /// The command that failed, as it was typed; private words are left out of it
    #[arg(value_name = "COMMAND", trailing_var_arg = true, allow_hyphen_values = true)]
    pub command: Vec<String>,
}

/// Bytes.
const GIB: f64 = (1u64 << 30) as f64;

/// Files whose endings may be said.
const ENDINGS: [&str; 14] =
    ["obj", "mtl", "glb", "gltf", "toml", "exr", "hdr", "png", "csv", "pts", "npz", "json", "html", "svg"];

#[derive(Serialize)]
struct Report {
    version: &'static str,
    /// `release`, or `debug` with its assertions.
    profile: &'static str,
    /// Cargo's features of the program.
    features: Vec<&'static str>,
    system: &'static str,
    architecture: &'static str,
    processor: Option<String>,
    threads: usize,
    /// Vector instructions that change which code runs.
    instructions: Vec<&'static str>,
    /// Memory that K and the pictures may take, GiB, where the system says it.
    memory: Option<f64>,
    /// Without what is private.
    command: Option<String>,
}

/// Says it, for people or as JSON.
pub fn run(own: &ReportArguments, program: &Command, console: &Console) -> Result<(), CliError> {
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        profile: if cfg!(debug_assertions) { "debug" } else { "release" },
        features: if cfg!(feature = "mpi") { vec!["mpi"] } else { Vec::new() },
        system: std::env::consts::OS,
        architecture: std::env::consts::ARCH,
        processor: std::fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| processor(&text)),
        threads: available_parallelism().map_or(1, usize::from),
        instructions: instructions(),
        memory: Some(usable_memory() / GIB).filter(|memory| memory.is_finite()),
        command: (!own.command.is_empty()).then(|| told(program, &own.command)),
    };
    say(console, &report);
    console.report(&report)
}

fn say(console: &Console, r: &Report) {
    let list = |words: &[&str]| if words.is_empty() { "none".into() } else { words.join(" ") };
    console.say(format!("version        {} ({}), features: {}", r.version, r.profile, list(&r.features)));
    console.say(format!("system         {} {}", r.system, r.architecture));
    let name = r.processor.as_deref().unwrap_or("unknown");
    console.say(format!("processor      {name}, {} threads, instructions: {}", r.threads, list(&r.instructions)));
    let memory = r.memory.map_or("unknown".into(), |memory| format!("{memory:.1} GiB for K and pictures"));
    console.say(format!("memory         {memory}"));
    match &r.command {
        Some(command) => console.say(format!("command        {command}")),
        None => console.say("command        none given: halflight report COMMAND ... adds it, without names of yours"),
    }
}

/// `model name` of Linux's list of processors.
fn processor(list: &str) -> Option<String> {
    let line = list.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_string())
}

#[cfg(target_arch = "x86_64")]
fn instructions() -> Vec<&'static str> {
    let there = [
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
    ];
    there.into_iter().filter_map(|(name, has)| has.then_some(name)).collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn instructions() -> Vec<&'static str> {
    Vec::new()
}

/// Words that the program itself knows.
struct Known<'a> {
    program: &'a Command,
    /// Values that options choose among.
    choices: BTreeSet<String>,
}

/// The command as it may be told.
fn told(program: &Command, words: &[String]) -> String {
    let arguments = all(program).flat_map(Command::get_arguments);
    let choices = arguments.flat_map(clap::Arg::get_possible_values).map(|value| value.get_name().to_string());
    let known = Known { program, choices: choices.collect() };
    let own = Path::new(&words[0]).file_stem().is_some_and(|name| name == "halflight");
    let shown = words[usize::from(own)..].iter().map(|word| known.word(word));
    std::iter::once("halflight".to_string()).chain(shown).collect::<Vec<_>>().join(" ")
}

/// The program and its commands.
fn all(program: &Command) -> impl Iterator<Item = &Command> {
    std::iter::once(program).chain(program.get_subcommands())
}

impl Known<'_> {
    fn word(&self, word: &str) -> String {
        if is_number(word) || self.program.find_subcommand(word).is_some() {
            return word.into();
        }
        if let Some(option) = word.strip_prefix("--") {
            return self.long(option);
        }
        match word.strip_prefix('-').and_then(|rest| rest.chars().next()) {
            Some(short) => self.short(short, &word[1 + short.len_utf8()..]),
            None => self.value(word),
        }
    }

    fn long(&self, option: &str) -> String {
        let (name, value) = option.split_once('=').map_or((option, None), |(name, value)| (name, Some(value)));
        let is_known = all(self.program).flat_map(Command::get_arguments).any(|a| a.get_long() == Some(name));
        let name = if is_known || ["help", "version"].contains(&name) { name } else { "OPTION" };
        value.map_or(format!("--{name}"), |value| format!("--{name}={}", self.value(value)))
    }

    fn short(&self, short: char, value: &str) -> String {
        let is_known = all(self.program).flat_map(Command::get_arguments).any(|a| a.get_short() == Some(short));
        let name = if is_known || "hV".contains(short) { short.to_string() } else { "OPTION".into() };
        let value = if value.is_empty() { String::new() } else { self.value(value) };
        format!("-{name}{value}")
    }

    /// A value, or several with commas between.
    fn value(&self, text: &str) -> String {
        let is_said = |part: &str| is_number(part) || self.choices.contains(part) || builtin::find(part).is_some();
        if text.split(',').all(is_said) {
            return text.into();
        }
        let ending = Path::new(text).extension().and_then(|e| e.to_str()).map(str::to_lowercase);
        match ending.filter(|ending| ENDINGS.contains(&&ending[..])) {
            Some(ending) => format!("FILE.{ending}"),
            None => "NAME".into(),
        }
    }
}

/// `0.02`, `2%`, `-1e3`, `64x64`.
fn is_number(word: &str) -> bool {
    let digits = word.trim_start_matches(['-', '+', '.']);
    digits.starts_with(|c: char| c.is_ascii_digit()) && word.chars().all(|c| "0123456789.+-%xe".contains(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_from_names() {
        let all_are = |words: &str, is: bool| words.split(' ').all(|word| is_number(word) == is);
        assert!(all_are("2 0.02 .5 2% -1e-3 64x64 8x6x8 +1.4", true));
        assert!(all_are("x xe ee -e 2nd 12a house7 2/3", false));
    }

    #[test]
    fn processors_are_named_by_linux() {
        let list = "processor\t: 0\nmodel name\t: Some CPU @ 2 GHz\nmodel name\t: another\n";
        assert_eq!(processor(list).as_deref(), Some("Some CPU @ 2 GHz"));
        assert_eq!(processor("processor : 0\n"), None);
    }
}
