//! An error as a person reads it on stderr: its code, what was found, and what to do; coloured and wrapped on a
//! terminal.
//!
//! Not handled: text that is wider than its characters are many; lines of it may be broken late.

use std::io::{Write as _, stderr};

use console::{Term, style};
use miette::Diagnostic;

use crate::cli::error::CliError;
use crate::plot::font::broken;

/// Writes the error to stderr. Lines are wrapped on a terminal only, so that a path stays in one piece elsewhere.
pub fn show(error: &CliError) {
    let terminal = Term::stderr();
    let columns = terminal.is_term().then(|| usize::from(terminal.size().1));
    let _ = writeln!(stderr(), "{}", text(error, columns));
}

/// The error in lines of at most `columns`, where there is a limit; ends with a line break.
fn text(error: &CliError, columns: Option<usize>) -> String {
    let code = error.code().map(|code| format!("{}\n\n", style(code).red().for_stderr()));
    let mut text = code.unwrap_or_default();
    text += &block(&style("  × ").red().for_stderr().to_string(), "  │ ", &error.to_string(), columns);
    if let Some(help) = error.help() {
        text += &block(&style("  help: ").cyan().for_stderr().to_string(), "        ", &help.to_string(), columns);
    }
    text
}

/// A paragraph: its first line after `first`, the others after `rest`.
fn block(first: &str, rest: &str, paragraph: &str, columns: Option<usize>) -> String {
    let lines = match columns {
        Some(columns) => broken(paragraph, |line| rest.chars().count() + line.chars().count() <= columns),
        None => vec![paragraph.to_owned()],
    };
    format!("{first}{}\n", lines.join(&format!("\n{rest}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_in_one_piece_off_the_terminal() {
        let usage = CliError::Usage { message: "/a/long path".into(), help: "shorten the path".into() };
        assert!(text(&usage, None).ends_with("/a/long path\n  help: shorten the path\n"));
        let narrow = text(&usage, Some(18));
        assert!(narrow.contains("/a/long path\n") && narrow.ends_with("shorten\n        the path\n"), "{narrow}");
        assert!(narrow.starts_with("halflight::usage\n\n  × "));
    }
}
