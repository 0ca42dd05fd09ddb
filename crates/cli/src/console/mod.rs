//! What a person sees: text and the progress of work ([`terminal`], [`progress`]), and what they are warned of
//! ([`warnings`]).

pub(crate) mod progress;
pub(crate) mod terminal;
pub(crate) mod warnings;

pub(crate) use terminal::Console;
