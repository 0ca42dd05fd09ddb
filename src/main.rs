//! The `halflight` program.
fn main() {}
