//! How far a run is, in one line where stderr is a terminal: the steps of work of a fixed size; of work to a tolerance
//! the error that there is and the one that is requested, over all of its modes, and about how long it still takes.
//!
//! Not handled: work that finds only late how much there is to do, as where light comes by few ways; the time is said
//! again then, and the bar stays where it is.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use halflight::render::Nearness;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

/// Positions of the bar of work to a tolerance.
const LENGTH: u64 = 1000;
/// How often what does not tick is drawn.
const REDRAWN: Duration = Duration::from_millis(250);

/// One of several modes that are worked at to a tolerance.
pub struct Aim {
    /// Its name.
    pub label: String,
    /// The requested error.
    pub tolerance: f64,
    /// Which of how many.
    pub number: usize,
    pub of: usize,
}

/// The line of a run.
pub struct Progress {
    bar: ProgressBar,
    /// Where the work is one to a tolerance.
    aim: Option<Aim>,
    began: Instant,
    /// Share of all that is done, of modes before among it.
    done: f64,
    /// The error as last told.
    error: Option<f64>,
    /// When all is predicted to end.
    end: Arc<Mutex<Option<Instant>>>,
    /// Its present step.
    step: String,
    length: u64,
    ticks: u64,
}

impl Default for Progress {
    fn default() -> Progress {
        Progress {
            bar: ProgressBar::hidden(),
            aim: None,
            began: Instant::now(),
            done: 0.0,
            error: None,
            end: Arc::default(),
            step: String::new(),
            length: 0,
            ticks: 0,
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

impl Progress {
    /// Work to a tolerance begins.
    pub fn aim(&mut self, aim: Aim) {
        if self.aim.is_none() {
            self.began = Instant::now();
            let end = Arc::clone(&self.end);
            let left = move |_: &ProgressState, out: &mut dyn std::fmt::Write| {
                let end = end.lock().ok().and_then(|end| *end);
                let left = end.map(|end| end.saturating_duration_since(Instant::now()));
                let _ = out.write_str(&left.map_or_else(String::new, about));
            };
            self.show(LENGTH, "{msg}{left}  {bar:30}  {prefix}", |style| style.with_key("left", left));
            self.bar.enable_steady_tick(REDRAWN);
        }
        self.done = self.done.max(aim.number as f64 / aim.of as f64);
        self.error = None;
        self.aim = Some(aim);
        self.say();
    }

    /// A step of `length` ticks begins.
    pub fn begin(&mut self, step: &str, length: u64) {
        (self.step, self.length, self.ticks) = (step.to_owned(), length, 0);
        if self.aim.is_none() {
            self.show(length, "{msg:18} {bar:40} {pos}/{len} {eta}", |style| style);
            self.bar.set_message(step.to_owned());
        }
        self.say();
    }

    /// So many ticks were done.
    pub fn tick(&mut self, done: u64) {
        if self.aim.is_none() {
            self.bar.inc(done);
        }
        self.ticks += done;
        self.say();
    }

    /// Work to a tolerance is so near to it.
    pub fn near(&mut self, Nearness { error, done }: Nearness) {
        let Some(aim) = &self.aim else { return };
        if error.is_finite() {
            self.error = Some(error);
        }
        self.done = self.done.max((aim.number as f64 + done) / aim.of as f64);
        if self.done > 0.0 {
            let left = self.began.elapsed().as_secs_f64() * (1.0 - self.done) / self.done;
            if let Ok(mut end) = self.end.lock() {
                // More than a clock can tell is not said.
                let left = Duration::try_from_secs_f64(left).ok();
                *end = left.and_then(|left| Instant::now().checked_add(left));
            }
        }
        self.say();
    }

    /// Takes the line away while another is printed, which stays.
    pub fn aside(&mut self, print: impl FnOnce()) {
        if self.aim.is_some() {
            self.bar.suspend(print);
        } else {
            self.bar.finish_and_clear();
            print();
        }
    }

    /// Takes the line away for good.
    pub fn end(&mut self) {
        *self = Progress::default();
    }

    fn show(&mut self, length: u64, template: &str, with: impl FnOnce(ProgressStyle) -> ProgressStyle) {
        self.bar.finish_and_clear();
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        self.bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr()).with_style(with(style));
    }

    /// What there is to say of work to a tolerance.
    fn say(&self) {
        let Some(aim) = &self.aim else { return };
        self.bar.set_position((self.done * LENGTH as f64) as u64);
        self.bar.set_message(aim.words(self.error));
        let share = (100 * self.ticks).checked_div(self.length).filter(|percent| *percent < 100 && self.length > 1);
        let share = share.map_or_else(String::new, |percent| format!(" {percent} %"));
        self.bar.set_prefix(format!("{}{share}", self.step));
    }
}

impl Aim {
    /// `global: 2.1 % → 1 %`.
    fn words(&self, error: Option<f64>) -> String {
        let requested = percent(self.tolerance);
        match error {
            Some(error) => format!("{}: {} → {requested}", self.label, percent(error.max(self.tolerance))),
            None => format!("{}: → {requested}", self.label),
        }
    }
}

/// A share in percent, by two digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    let places = (1.0 - percent.abs().max(1e-3).log10().floor()).clamp(0.0, 4.0) as usize;
    let digits = format!("{percent:.places$}");
    let digits = if digits.contains('.') { digits.trim_end_matches('0').trim_end_matches('.') } else { &digits };
    format!("{digits} %")
}

/// `, about 9 s`, coarser the longer.
fn about(left: Duration) -> String {
    let seconds = left.as_secs_f64();
    match seconds {
        s if s < 10.0 => format!(", about {:.0} s", s.max(1.0)),
        s if s < 90.0 => format!(", about {:.0} s", 5.0 * (s / 5.0).round()),
        s if s < 5400.0 => format!(", about {:.0} min", s / 60.0),
        s => format!(", about {:.0} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aim(number: usize) -> Aim {
        Aim { label: "global".into(), tolerance: 0.01, number, of: 2 }
    }

    #[test]
    fn the_error_there_is_goes_to_the_one_requested() {
        assert_eq!(aim(0).words(None), "global: → 1 %");
        assert_eq!(aim(0).words(Some(0.0213)), "global: 2.1 % → 1 %");
        assert_eq!(aim(0).words(Some(0.0098)), "global: 1 % → 1 %");
        assert_eq!([0.25, 0.0005, 0.10, 1.5].map(percent), ["25 %", "0.05 %", "10 %", "150 %"]);
    }

    #[test]
    fn times_are_as_coarse_as_they_are_known() {
        let seconds = [0.2, 8.7, 43.0, 200.0, 9000.0];
        let said = ["1 s", "9 s", "45 s", "3 min", "2 h"].map(|time| format!(", about {time}"));
        assert_eq!(seconds.map(|s| about(Duration::from_secs_f64(s))), said);
    }

    #[test]
    fn what_is_done_counts_over_all_modes_and_never_less() {
        let mut progress = Progress::default();
        let near = |error: f64, done: f64| Nearness { error, done };
        progress.aim(aim(0));
        for nearness in [near(0.04, 0.4), near(f64::NAN, 0.2)] {
            progress.near(nearness);
        }
        assert_eq!((progress.done, progress.error), (0.2, Some(0.04)));
        progress.aim(aim(1));
        assert_eq!((progress.done, progress.error), (0.5, None));
        progress.near(near(0.01, 1.0));
        assert_eq!((progress.done, progress.bar.position()), (1.0, LENGTH));
        progress.end();
        assert!(progress.aim.is_none());
        // A first error beyond all bounds.
        progress.aim(aim(0));
        progress.near(near(1e30, 1e-40));
        assert!(progress.end.lock().unwrap().is_none());
    }
}
