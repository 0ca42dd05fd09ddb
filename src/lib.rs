//! halflight solves the light transport equation `L = E + K L` for diffuse scenes with vector-valued light.
//!
//! The modules stand in the order in which light flows through the code; each uses only those above it.

pub mod light;
pub mod rays;
pub mod scene;

pub mod image;
pub mod study;
