//! Loops over threads and processes, on one machine or on many, whose results depend on the number of neither; and work
//! that can be ended.
//!
//! All processes run the same program on the same input, and go through the same loops in the same order. A [`Loop`] is
//! shared out: each process works on its part with its threads, and either hands what it found to all
//! ([`Loop::map`], [`Loop::change`]) or keeps it ([`Loop::keep`]). What follows is done by every process alike, so what
//! each thing of a loop finds must not depend on the others, and the bytes of a result do not depend on the number of
//! processes. Alone, which is what a process is without [`connect`], a loop is one of rayon's, and nothing is copied.
//!
//! What processes find differently, such as clocks, files and memory, they [`agree`] on.
//!
//! Not handled: a process that is lost, which ends all; loops within loops.

pub use deadline::{deadline_after, is_over, would_be_over};
pub use interrupt::{Interrupt, heed_interrupt};
pub use loops::Loop;
pub use members::{
    Connection, abort_others, agree, all, connect, is_alone, part_of_machine, rank, size, speaks, strangers,
};
pub use travel::Travels;

mod deadline;
mod exchange;
mod interrupt;
mod loops;
mod members;
#[cfg(feature = "mpi")]
mod processes;
mod speeds;
mod travel;
