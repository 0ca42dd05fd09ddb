//! What is said where memory would not do: what needs it, how much there is, and what would fit.

use crate::pictures::Size;

/// What memory is needed for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stored {
    /// Rows of F, of so many entries for each choice of tau; the number of patches was asked for.
    Rows(f64),
    /// The same for the patches that verdicts rest on, whose number the time chooses.
    Verdicts(f64),
    /// The same for patches that the command chooses for its ladders.
    Ladders(f64),
    /// Every crossing of every ray, so many for each patch.
    Crossings(f64),
    /// I - K as a dense matrix.
    Dense,
}

/// A problem would not fit in memory.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
#[error(
    "{} of {patches} patches {} about {} of memory, and {} can be used",
    .stored.name(), .stored.need(), amount(*.bytes), amount(*.limit)
)]
#[diagnostic(
    code(halflight::memory),
    help("{}. About {fitting} patches would fit: {}", .stored.why(), self.remedy())
)]
pub struct Unfit {
    /// Patches asked for, or that the scene needs at least.
    pub patches: usize,
    /// What takes the memory.
    pub stored: Stored,
    /// Bytes needed, about.
    pub bytes: f64,
    /// Bytes that can be used.
    pub limit: f64,
    /// Patches that would fit; at least 1.
    pub fitting: usize,
}

/// Pictures would not fit in memory.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
#[error(
    "pictures of {}x{} pixels need about {} of memory, and {} can be used",
    .size.width, .size.height, amount(*.bytes), amount(*.limit)
)]
#[diagnostic(
    code(halflight::memory::pictures),
    help(
        "this command keeps about {each:.0} bytes for each pixel: sums, their errors and what is seen there. About \
         {fitting} pixels would fit: pass a smaller --size, or --memory GIB if there is more memory than it seems"
    )
)]
pub struct PictureUnfit {
    /// Width and height asked for.
    pub size: Size,
    /// Bytes a pixel.
    pub each: f64,
    /// Bytes needed, about.
    pub bytes: f64,
    /// Bytes that can be used.
    pub limit: f64,
    /// Pixels that would fit.
    pub fitting: u64,
}

/// Checks that pictures of a size fit in `limit` bytes where a command keeps `each` bytes a pixel.
///
/// # Errors
/// [`PictureUnfit`], with the number of pixels that would.
pub fn check_pictures(size: Size, each: f64, limit: f64) -> Result<(), PictureUnfit> {
    let bytes = size.width as f64 * size.height as f64 * each;
    if bytes <= limit { Ok(()) } else { Err(PictureUnfit { size, each, bytes, limit, fitting: (limit / each) as u64 }) }
}

impl Unfit {
    /// The same where rows of so many entries are those of something else than patches asked for.
    pub(crate) fn of(self, stored: fn(f64) -> Stored) -> Unfit {
        match self.stored {
            Stored::Rows(entries) => Unfit { stored: stored(entries), ..self },
            _ => self,
        }
    }
}

impl Stored {
    fn name(self) -> &'static str {
        match self {
            Stored::Rows(_) | Stored::Verdicts(_) | Stored::Ladders(_) => "K",
            Stored::Crossings(_) => "the crossings of the rays",
            Stored::Dense => "the dense matrix I - K",
        }
    }

    fn need(self) -> &'static str {
        match self {
            Stored::Crossings(_) => "need",
            _ => "needs",
        }
    }

    /// Why it takes as much.
    fn why(self) -> String {
        let rows = |entries: f64| {
            format!(
                "K stores one row of F for each patch, here of {entries:.0} entries for each choice of tau, so memory grows \
                 with the patches times the patches that each of them sees"
            )
        };
        match self {
            Stored::Rows(entries) | Stored::Verdicts(entries) | Stored::Ladders(entries) => rows(entries),
            Stored::Crossings(each) => format!(
                "F^tau for every tau comes from one cast of rays, all of whose crossings are kept, here {each:.0} for \
                 each patch, so memory grows with the patches times the rays of each times the surfaces one behind another"
            ),
            Stored::Dense => {
                "True tails come from (I - K) L = E solved by LU, and memory grows with the patches squared".into()
            }
        }
    }
}

impl Unfit {
    /// What to try.
    fn remedy(&self) -> String {
        // A count asked for is met within about a third.
        let fewer = (self.fitting * 2 / 3).max(1);
        let asked = format!("pass --patches {fewer} (a count asked for is met within about a third)");
        let more = "--memory GIB if there is more memory than it seems";
        match self.stored {
            Stored::Rows(_) => format!("{asked}, fewer --rays, one --mode at a time, or {more}"),
            Stored::Verdicts(_) => {
                format!("pass a --time below 2, whose verdicts rest on a quarter of the patches, or {more}")
            }
            Stored::Ladders(_) => {
                format!("pass one --mode at a time, a scene of fewer faces, or {more}")
            }
            Stored::Crossings(_) => format!("{asked}, fewer --rays, or {more}"),
            Stored::Dense => format!("{asked}, or {more}"),
        }
    }
}

fn amount(bytes: f64) -> String {
    let mib = bytes / f64::from(1 << 20);
    if mib < 1000.0 { format!("{mib:.1} MiB") } else { format!("{:.1} GiB", mib / 1024.0) }
}
