//! The processes that share one solve, on one machine or on many.
//!
//! All of them run the same program on the same scene, and go through the same loops in the same order. A loop over
//! rays is shared out (`share`): each process works on its part of it with its threads, and either keeps what it found
//! (`keep`) or gathers that of all (`Share::map`), in the order of the loop. What follows is done by every process
//! alike, so what each thing of a loop finds must not depend on the others, and the bytes of a result do not depend on
//! the number of processes. Alone, which is what a process is without [`connect`], nothing is copied.
//!
//! Not handled: a process that is lost, which ends all; loops within loops.

pub use crate::light::team::members::{Connection, abort_others, connect, is_alone, rank, size, speaks, strangers};
pub use crate::light::team::members::{agree, all, hand_out, sum};
pub use crate::light::team::owners::Owners;
pub use crate::light::team::share::{keep, keep_in_stripes, kept_share, share};

mod exchange;
mod members;
mod owners;
#[cfg(feature = "mpi")]
mod processes;
mod share;
