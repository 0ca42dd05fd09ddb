//! What a person sees: text, and progress bars where stderr is a terminal.

use std::io::IsTerminal;
use std::sync::Mutex;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::options::Common;
use crate::study::Watch;

/// Where text for people goes: stdout, stderr beside a JSON report, or nowhere.
pub struct Console {
    json: bool,
    quiet: bool,
    bar: Mutex<ProgressBar>,
}

impl Console {
    /// As the arguments ask.
    pub fn new(common: &Common) -> Console {
        Console {
            json: common.json,
            quiet: common.quiet,
            bar: Mutex::new(ProgressBar::hidden()),
        }
    }

    /// A line for people.
    pub fn say(&self, line: impl AsRef<str>) {
        if self.quiet {
            return;
        }
        self.clear();
        if self.json {
            eprintln!("{}", line.as_ref());
        } else {
            println!("{}", line.as_ref());
        }
    }

    /// A warning, on stderr.
    pub fn warn(&self, line: impl AsRef<str>) {
        if !self.quiet {
            self.clear();
            eprintln!("warning: {}", line.as_ref());
        }
    }

    /// The JSON report, if one was asked for.
    pub fn report(&self, report: &impl serde::Serialize) {
        self.clear();
        if self.json {
            let text = serde_json::to_string_pretty(report).expect("reports have string keys");
            println!("{text}");
        }
    }

    fn clear(&self) {
        if let Ok(bar) = self.bar.lock() {
            bar.finish_and_clear();
        }
    }
}

impl Watch for Console {
    fn begin(&self, step: &str, length: u64) {
        if self.quiet || !std::io::stderr().is_terminal() {
            return;
        }
        let style = ProgressStyle::with_template("{msg:18} {bar:40} {pos}/{len} {eta}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr())
            .with_style(style)
            .with_message(step.to_string());
        if let Ok(mut current) = self.bar.lock() {
            current.finish_and_clear();
            *current = bar;
        }
    }

    fn tick(&self, done: u64) {
        if let Ok(bar) = self.bar.lock() {
            bar.inc(done);
        }
    }
}
