//! What to do about what the library answers, in the names of the program's options.
//!
//! Not handled: wrong files, whose errors say what to do themselves.

use halflight::render::{PictureUnfit, Shortfall, Stored, Unfit, Unmet};
use halflight::solve::{Diverges, Verdict};

/// What follows from a traced picture that overflows.
pub const OVERFLOW: &str =
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

/// Why a problem takes as much memory, and what to try.
pub fn memory(unfit: &Unfit, patches: Patches) -> String {
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
pub fn pictures(PictureUnfit { each, fitting, .. }: &PictureUnfit) -> String {
    format!(
        "this command keeps about {each:.0} bytes for each pixel: sums, their errors and what is seen there. About \
         {fitting} pixels would fit: pass a smaller --size, or --memory GIB if there is more memory than it seems"
    )
}

/// What a series that is not proved to converge means, and where it converges.
pub fn divergence(diverges: &Diverges) -> String {
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

/// Why an error is above its tolerance, and what helps.
pub fn unmet(unmet: &Unmet) -> String {
    let helps = match unmet.why {
        Shortfall::Unseen | Shortfall::Unknown => "",
        Shortfall::Time => "; a longer --time helps",
        Shortfall::Effort => "; a larger --size leaves less to bend within a pixel",
    };
    format!("{unmet}{helps}")
}
