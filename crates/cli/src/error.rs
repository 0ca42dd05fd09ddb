//! Everything that can end a command early, the exit code of each, and how a person reads it on stderr: its code, what
//! was found, and what to do; coloured and wrapped on a terminal.
//!
//! Not handled: wide characters, whose lines may be broken late; wrong arguments, which clap refuses before a command
//! begins, and faults of the program (exit code 101).

use std::io::{Write as _, stderr};

use console::{Term, style};
use miette::Diagnostic;

use halflight::Rendered;
use halflight::pictures::{ImageError, MetricError, WriteError};
use halflight::render::{PictureUnfit, RenderError, Stored, Unfit};
use halflight::scene::SceneError;
use halflight::solve::{Diverges, Verdict};
use halflight_audit::{AuditError, Estimated};
use halflight_bake::BakeError;
use halflight_daylight::DaylightError;
use halflight_explore::PageError;
use halflight_export::kept::KeptError;
use halflight_lighting::{LampError, SensorError};
use halflight_plot::ChartError;
use halflight_plot::font::broken;
use halflight_reference::Overflow;
use halflight_study::compare::StudyError;

/// What follows from a traced picture that overflows.
const OVERFLOW: &str =
    "--max-bounces N with a smaller N shows the first bounces; `halflight bounces` shows how they grow";

/// Who chooses the number of patches whose rows of F do not fit.
#[derive(Clone, Copy, Debug)]
pub enum Patches {
    /// It was requested.
    Requested,
    /// The verdicts of `compare` rest on them, and the time chooses.
    Verdicts,
    /// The ladders of `chart`.
    Ladders,
}

/// Everything that can end a command early.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum CliError {
    /// The scene is wrong: exit code 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Scene(#[from] SceneError),
    /// No picture: exit code 4, or 6 where neither convergence nor divergence is proved.
    #[error(transparent)]
    #[diagnostic(code(halflight::diverges))]
    Diverges(#[from] Diverges),
    /// K does not fit in memory: exit code 5.
    #[error("{0}")]
    #[diagnostic(code(halflight::memory))]
    Memory(Unfit, Patches),
    /// Pictures do not fit in memory: exit code 5.
    #[error(transparent)]
    #[diagnostic(code(halflight::memory::pictures))]
    Pictures(#[from] PictureUnfit),
    /// A traced picture overflows: exit code 4.
    #[error(transparent)]
    #[diagnostic(code(halflight::trace::overflow))]
    Overflow(#[from] Overflow),
    /// A picture could not be written: exit code 1; its format is unknown: 2; it could not be read: 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Image(#[from] ImageError),
    /// A table of sensors is wrong, or there is nothing to lay them over: exit code 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Sensor(#[from] SensorError),
    /// A file could not be written: exit code 1.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
    /// A kept folder cannot be used: exit code 3, or written: 1.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Kept(#[from] KeptError),
    /// A chart could not be drawn: exit code 1.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Chart(#[from] ChartError),
    /// Two pictures cannot be compared: exit code 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Metric(#[from] MetricError),
    /// A file holds no light of lamps: exit code 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Lamps(#[from] LampError),
    /// Charts of a scene cannot be baked, or its glTF file not written back: exit code 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Bake(BakeError),
    /// A picture cannot be audited: exit code 3, or 4 where the series diverges.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Audit(#[from] AuditError),
    /// An audited picture is certainly further off than was asked: exit code 7.
    #[error(
        "the picture is {:.2} % ± {:.2} % off, certainly more than {:.2} %",
        100.0 * error.value,
        100.0 * error.standard_error,
        100.0 * most
    )]
    #[diagnostic(code(halflight::audit::above), help("the maps show where; a larger --at-most lets it pass"))]
    Above {
        /// Its error.
        error: Estimated,
        /// The error asked about.
        most: f64,
    },
    /// A weather file or a matrix of skies is wrong: exit code 3.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Daylight(DaylightError),
    /// A table of emissivities is wrong: exit code 3.
    #[error("{message}")]
    #[diagnostic(
        code(halflight::exchange),
        help("a row is an object of the scene and its emissivity, above 0 and up to 1, with a comma between them")
    )]
    Exchange {
        /// Where, and what is wrong.
        message: String,
    },
    /// What an earlier run kept is not what is needed: exit code 3.
    #[error("{message}")]
    #[diagnostic(code(halflight::relight))]
    Relight {
        /// What is wrong.
        message: String,
        /// What to do.
        #[help]
        help: String,
    },
    /// The arguments contradict each other or the machine: exit code 2.
    #[error("{message}")]
    #[diagnostic(code(halflight::usage))]
    Usage {
        /// What is wrong.
        message: String,
        /// What to do.
        #[help]
        help: String,
    },
}

impl CliError {
    /// The exit code of the process, as listed in [`crate`].
    pub fn exit_code(&self) -> u8 {
        match self {
            CliError::Image(ImageError::Extension { .. }) | CliError::Usage { .. } => 2,
            CliError::Image(ImageError::Read { .. } | ImageError::Decode { .. }) => 3,
            CliError::Image(_) | CliError::Write(_) | CliError::Chart(_) => 1,
            CliError::Kept(KeptError::Write(_) | KeptError::Occupied { .. }) => 1,
            CliError::Kept(_)
            | CliError::Lamps(_)
            | CliError::Relight { .. }
            | CliError::Bake(_)
            | CliError::Daylight(_)
            | CliError::Exchange { .. } => 3,
            CliError::Scene(_) | CliError::Metric(_) | CliError::Sensor(_) => 3,
            CliError::Diverges(e) if e.verdict == Verdict::Undecided => 6,
            CliError::Audit(AuditError::Endless) => 4,
            CliError::Audit(_) => 3,
            CliError::Above { .. } => 7,
            CliError::Diverges(_) | CliError::Overflow(_) => 4,
            CliError::Memory(..) | CliError::Pictures(_) => 5,
        }
    }

    /// What to do about it.
    fn advice(&self) -> Option<String> {
        match self {
            CliError::Diverges(diverges) => Some(divergence_advice(diverges)),
            CliError::Memory(unfit, patches) => Some(unfit_advice(unfit, *patches)),
            CliError::Pictures(unfit) => Some(pictures_advice(unfit)),
            CliError::Overflow(_) => Some(OVERFLOW.to_owned()),
            _ => self.help().map(|help| help.to_string()),
        }
    }
}

impl From<Unfit> for CliError {
    fn from(unfit: Unfit) -> CliError {
        CliError::Memory(unfit, Patches::Requested)
    }
}

/// A picture, or why its mode has none; what else went wrong ends the command.
pub fn picture_or_divergence(found: Result<Rendered, RenderError>) -> Result<Result<Rendered, Diverges>, CliError> {
    match found {
        Ok(rendered) => Ok(Ok(rendered)),
        Err(RenderError::Diverges(e)) => Ok(Err(e)),
        Err(RenderError::Memory(unfit)) => Err(unfit.into()),
    }
}

impl From<BakeError> for CliError {
    fn from(error: BakeError) -> CliError {
        match error {
            BakeError::Render(RenderError::Diverges(e)) => e.into(),
            BakeError::Render(RenderError::Memory(e)) => e.into(),
            BakeError::Image(e) => e.into(),
            BakeError::Write(e) => e.into(),
            own => CliError::Bake(own),
        }
    }
}

impl From<DaylightError> for CliError {
    fn from(error: DaylightError) -> CliError {
        match error {
            DaylightError::Diverges(e) => e.into(),
            DaylightError::Memory(e) => e.into(),
            DaylightError::Write(e) => e.into(),
            own => CliError::Daylight(own),
        }
    }
}

impl From<PageError> for CliError {
    fn from(error: PageError) -> CliError {
        match error {
            PageError::Memory(e) => e.into(),
            PageError::Image(e) => e.into(),
        }
    }
}

impl From<StudyError> for CliError {
    fn from(error: StudyError) -> CliError {
        match error {
            StudyError::Diverges(e) => e.into(),
            StudyError::Memory(unfit) => CliError::Memory(unfit, Patches::Verdicts),
            StudyError::Image(e) => e.into(),
            StudyError::Metric(e) => e.into(),
        }
    }
}

/// Why a problem takes as much memory, and what to try.
fn unfit_advice(unfit: &Unfit, patches: Patches) -> String {
    // A requested count is met within about a third.
    let fewer = (unfit.fitting * 2 / 3).max(1);
    let asked = format!("pass --patches {fewer} (a count asked for is met within about a third)");
    let (why, remedy) = match unfit.stored {
        Stored::Rows(entries) => {
            let remedy = match patches {
                Patches::Requested => format!("{asked}, fewer --rays, one --mode at a time"),
                Patches::Verdicts => {
                    "pass a --time below 2, whose verdicts rest on a quarter of the patches".to_owned()
                }
                Patches::Ladders => "pass one --mode at a time, a scene of fewer faces".to_owned(),
            };
            let why = format!(
                "K stores one row of F for each patch, here of {entries:.0} entries for each choice of tau, so memory grows \
                 with the patches times the patches that each of them sees"
            );
            (why, remedy)
        }
        Stored::Crossings(each) => {
            let why = format!(
                "F^tau for every tau comes from one cast of rays, all of whose crossings are kept, here {each:.0} for \
                 each patch, so memory grows with the patches times the rays of each times the surfaces one behind another"
            );
            (why, format!("{asked}, fewer --rays"))
        }
    };
    let fitting = unfit.fitting;
    format!("{why}. About {fitting} patches would fit: {remedy}, or --memory GIB if there is more memory than it seems")
}

/// How large pictures may be.
fn pictures_advice(PictureUnfit { each, fitting, .. }: &PictureUnfit) -> String {
    format!(
        "this command keeps about {each:.0} bytes for each pixel: sums, their errors and what is seen there. About \
         {fitting} pixels would fit: pass a smaller --size, or --memory GIB if there is more memory than it seems"
    )
}

/// What a series that is not proved to converge means, and where it converges.
fn divergence_advice(diverges: &Diverges) -> String {
    let meaning = if diverges.verdict == Verdict::Undecided {
        "the bounds enclose 1, so it is not proved that E + KE + K²E + ... has a finite value; more --patches and \
         --rays bring them closer, but not where surfaces reflect all light (Kd 1)"
    } else {
        "each bounce carries at least as much light as the one before, so the sum has no finite value"
    };
    let of = if diverges.uniform { "" } else { " of the present alphas" };
    format!(
        "{meaning}. It converges for alpha below {:.4}{of}: pass a smaller --alpha, a smaller --tau, or lower the \
         reflectances",
        diverges.alpha_limit
    )
}

/// Writes the error to stderr. Lines are wrapped on a terminal only, so that a path stays in one piece elsewhere.
pub fn show(error: &CliError) {
    let _ = writeln!(stderr(), "{}", text(error, columns()));
}

/// The error in lines of at most `columns`, where there is a limit; ends with a line break.
fn text(error: &CliError, columns: Option<usize>) -> String {
    let code = error.code().map(|code| format!("{}\n\n", style(code).red().for_stderr()));
    let mut text = code.unwrap_or_default();
    text += &block(&style("  × ").red().for_stderr().to_string(), "  │ ", &error.to_string(), columns);
    if let Some(advice) = error.advice() {
        text += &block(&style("  help: ").cyan().for_stderr().to_string(), "        ", &advice, columns);
    }
    text
}

/// A warning in lines of at most `columns`, where there is a limit, without a line break at its end.
pub fn warning(text: &str, columns: Option<usize>) -> String {
    let (first, rest) = (style("warning: ").yellow().for_stderr().to_string(), " ".repeat("warning: ".len()));
    let Some(columns) = columns else { return format!("{first}{text}") };
    let mut lines = text.lines();
    let mut wrapped = block(&first, &rest, lines.next().unwrap_or_default(), Some(columns));
    // What stands in lines of its own is to be copied.
    lines.for_each(|line| wrapped += &format!("{line}\n"));
    wrapped.truncate(wrapped.trim_end().len());
    wrapped
}

/// The columns of the terminal that stderr is; none where it is none.
pub fn columns() -> Option<usize> {
    let terminal = Term::stderr();
    terminal.is_term().then(|| usize::from(terminal.size().1))
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
    use halflight::operator::Bounds;

    #[test]
    fn warnings_are_broken_between_words_and_what_is_to_be_copied_is_not() {
        let text = "walls are seen from behind: give them two sides by\n  [materials.Walls]\n  two_sided = true";
        let wrapped = warning(text, Some(40));
        assert!(wrapped.lines().all(|line| line.chars().count() <= 40), "{wrapped}");
        assert!(wrapped.ends_with("sides by\n  [materials.Walls]\n  two_sided = true"), "{wrapped}");
        assert_eq!(warning(text, None), format!("warning: {text}"));
    }

    #[test]
    fn what_is_not_proved_has_its_own_code_and_words() {
        let error = |verdict, lower| Diverges {
            verdict,
            radius: Bounds { lower, upper: 1.2 },
            alpha_limit: 0.8,
            uniform: true,
        };
        let (open, shut) = (error(Verdict::Undecided, 0.9), error(Verdict::Diverges, 1.1));
        assert!(open.to_string().contains("is undecided") && shut.to_string().contains("diverges"));
        let [open, shut] = [open, shut].map(CliError::from);
        let advice = |e: &CliError| e.advice().unwrap();
        assert!(advice(&open).contains("enclose 1") && advice(&shut).contains("no finite value"));
        assert_eq!([open.exit_code(), shut.exit_code()], [6, 4]);
    }

    #[test]
    fn paths_stay_in_one_piece_off_the_terminal() {
        let usage = CliError::Usage { message: "/a/long path".into(), help: "shorten the path".into() };
        assert!(text(&usage, None).ends_with("/a/long path\n  help: shorten the path\n"));
        let narrow = text(&usage, Some(18));
        assert!(narrow.contains("/a/long path\n") && narrow.ends_with("shorten\n        the path\n"), "{narrow}");
        assert!(narrow.starts_with("halflight::usage\n\n  × "));
    }
}
