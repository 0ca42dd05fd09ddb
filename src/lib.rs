//! halflight solves the light transport equation `L = E + K L` for diffuse scenes with vector-valued light.
//!
//! Light is a pair: an invisible half that travels through the scene, and a visible half that only the camera
//! collects. Surfaces reflect it by the 2×2 matrix `rho [[alpha, 0], [1, 0]]` and pass it on by tau. The two numbers
//! turn one algorithm into global illumination, shadowless, one-bounce or OpenGL-style local shading.
//!
//! The modules stand in the order in which light flows through the code; each uses only those above it.

// Blank lines keep the order: rustfmt sorts declarations that touch.

pub mod light;

pub mod scene;

pub mod rays;

pub mod patches;

pub mod form_factors;

pub mod operator;

pub mod solve;

pub mod image;

pub mod study;

pub mod cli;

/// The README's code is tested with the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
