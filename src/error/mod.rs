//! How far light and pictures may be off.

pub(crate) mod light_walks;
pub(crate) mod walk_sources;
