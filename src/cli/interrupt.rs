//! Ctrl-C: the program ends at once, finished files stay whole, and nothing unfinished is left.
//!
//! The handler runs in a thread of its own, so a loop over all cores need not look for it. Being told to end (SIGTERM)
//! or to hang up (SIGHUP) counts the same. Where one of the three is already ignored or handled, as under `nohup`, all
//! three stay as they are. Only place for `ctrlc`.

use std::io::{Write as _, stderr};

use crate::pictures::abandon_files;

/// The shells' 128 + 2 for a program ended by SIGINT.
pub const INTERRUPTED: u8 = 130;

/// From here on an interrupt ends the program cleanly.
pub fn end_cleanly() {
    // Where it cannot be set the system's own way of ending stays, which is what there was before.
    let _ = ctrlc::try_set_handler(|| {
        // Never let go: what is not finished stays unwritten until the process is gone.
        let _held = abandon_files();
        let _ = writeln!(stderr(), "interrupted: finished files are whole, the others were not written");
        std::process::exit(INTERRUPTED.into());
    });
}
