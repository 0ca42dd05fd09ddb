//! What a person sees: text, and how far the work is where stderr is a terminal.

use std::io;
use std::io::{IsTerminal, Write as _, stderr, stdout};
use std::sync::Mutex;

use halflight_team as team;

use crate::console::progress::{Aim, Progress};
use crate::error::{CliError, columns, warning};
use halflight::pictures::WriteError;
use halflight::render::{Nearness, Watch};

/// Where text for people goes: stdout, stderr next to a JSON report, or nowhere.
pub struct Console {
    json: bool,
    quiet: bool,
    /// Things of a loop that are done when this process has done one of its own.
    together: u64,
    /// Where stderr is a terminal that a person looks at.
    progress: Option<Mutex<Progress>>,
    /// Why a line did not reach stdout.
    failure: Mutex<Option<io::Error>>,
}

impl Console {
    /// Whether there will be a JSON report on stdout, and whether nothing but errors is said. Of several processes one
    /// says it.
    pub fn new(json: bool, quiet: bool) -> Console {
        let is_seen = !quiet && team::speaks() && stderr().is_terminal();
        let progress = is_seen.then(Mutex::default);
        Console { json, quiet, together: team::size() as u64, progress, failure: Mutex::new(None) }
    }

    /// A line for people.
    pub fn say(&self, line: impl AsRef<str>) {
        if self.quiet || !team::speaks() {
            return;
        }
        self.aside(|| {
            if self.json {
                let _ = writeln!(stderr(), "{}", line.as_ref());
            } else {
                self.print(line.as_ref());
            }
        });
    }

    /// Whether warnings are said: what only they need is not computed otherwise. All of several processes compute it.
    pub fn warns(&self) -> bool {
        !self.quiet
    }

    /// A warning, on stderr.
    pub fn warn(&self, line: impl AsRef<str>) {
        if self.warns() && team::speaks() {
            self.aside(|| {
                let _ = writeln!(stderr(), "{}", warning(line.as_ref(), columns()));
            });
        }
    }

    /// The last word of a command: the JSON report, if one is requested.
    ///
    /// # Errors
    /// Where stdout did not take this or an earlier line. A reader who has had enough (`| head`) is no error.
    pub fn report(&self, report: &impl serde::Serialize) -> Result<(), CliError> {
        self.with(Progress::end);
        if self.json && team::speaks() {
            let text = serde_json::to_string_pretty(report).expect("reports have string keys");
            self.print(&text);
        }
        self.end()
    }

    /// What became of all that was printed.
    ///
    /// # Errors
    /// As [`Console::report`].
    pub fn end(&self) -> Result<(), CliError> {
        let failure = self.failure.lock().ok().and_then(|mut f| f.take());
        match failure {
            Some(source) if source.kind() != io::ErrorKind::BrokenPipe => {
                Err(WriteError { path: "standard output".into(), source }.into())
            }
            _ => Ok(()),
        }
    }

    /// Writes a line to stdout, or remembers why it could not.
    pub fn print(&self, line: &str) {
        let mut out = stdout();
        let written = writeln!(out, "{line}").and_then(|()| out.flush());
        if let (Err(error), Ok(mut failure)) = (written, self.failure.lock()) {
            failure.get_or_insert(error);
        }
    }

    /// Work to a tolerance begins, one of several modes.
    pub fn aim(&self, aim: Aim) {
        self.with(|progress| progress.aim(aim));
    }

    /// Prints a line that stays.
    fn aside(&self, print: impl FnOnce()) {
        match self.progress.as_ref().map(Mutex::lock) {
            Some(Ok(mut progress)) => progress.aside(print),
            _ => print(),
        }
    }

    /// Changes what is shown of how far the work is.
    fn with(&self, change: impl FnOnce(&mut Progress)) {
        if let Some(Ok(mut progress)) = self.progress.as_ref().map(Mutex::lock) {
            change(&mut progress);
        }
    }
}

impl Watch for Console {
    fn begin(&self, step: &str, length: u64) {
        self.with(|progress| progress.begin(step, length));
    }

    fn tick(&self, done: u64) {
        self.with(|progress| progress.tick(self.together * done));
    }

    fn near(&self, nearness: Nearness) {
        self.with(|progress| progress.near(nearness));
    }
}
