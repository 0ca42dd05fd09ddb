//! halflight solves the light transport equation `L = E + K L` for diffuse scenes with vector-valued light.
//!
//! Light is a pair: an invisible half that travels through the scene, and a visible half that only the camera
//! collects. Surfaces reflect it by the 2×2 matrix `rho [[alpha, 0], [1, 0]]` and pass it on by tau. The two numbers
//! turn one algorithm into global illumination, shadowless, one-bounce or OpenGL-style local shading.
//!
//! Solve a scene from its parts and read off the bounces:
//!
//! ```
//! use halflight::form_factors::Sampling;
//! use halflight::light::Mode;
//! use halflight::scene::{LoadOptions, Scene};
//! use halflight::solve::{Settings, Verdict, neumann, norm};
//! use halflight::study::{Silent, assemble, prepare};
//!
//! let scene = Scene::open("cornell-box", LoadOptions::default())?;
//! let prepared = prepare(scene, 300);
//! let sampling = Sampling { rays: 64, ..Sampling::default() };
//! let (modes, _) = assemble(&prepared, &[Mode::Global.transport()], &sampling, &Silent);
//! let solution = neumann(&modes[0].operator, &Settings::default())?;
//!
//! assert_eq!(solution.verdict, Verdict::Converges);
//! for bounce in &solution.bounces {
//!     let [red, green, blue] = bounce.power;
//!     println!("{}: {red:.0} {green:.0} {blue:.0} W", bounce.n);
//! }
//! // Each bounce carries less, and what is left out is bounded.
//! assert!(solution.bounces[3].power[0] < solution.bounces[2].power[0]);
//! let whole = norm(modes[0].operator.areas(), &solution.light);
//! assert!(solution.rest() <= 1e-4 * whole);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A series may diverge. Summing it is refused with a proof; looking at its terms is not:
//!
//! ```
//! use halflight::form_factors::Sampling;
//! use halflight::light::Mode;
//! use halflight::scene::{LoadOptions, Scene};
//! use halflight::solve::{Settings, explore, neumann};
//! use halflight::study::{Silent, assemble, prepare};
//!
//! let scene = Scene::open("furnished-room", LoadOptions::default())?;
//! let prepared = prepare(scene, 300);
//! let sampling = Sampling { rays: 64, ..Sampling::default() };
//! let transports = [Mode::Shadowless.transport(), Mode::Local.transport()];
//! let (modes, _) = assemble(&prepared, &transports, &sampling, &Silent);
//!
//! let refused = neumann(&modes[0].operator, &Settings::default()).unwrap_err();
//! assert!(refused.radius.lower > 1.0);
//! let terms = explore(&modes[0].operator, 8).bounces;
//! assert!(terms[8].norm > terms[7].norm);
//!
//! // Local shading ends: KE is seen and does not travel, so K²E = 0 exactly.
//! let local = explore(&modes[1].operator, 8).bounces;
//! assert_eq!(local[1].power_invisible, [0.0; 3]);
//! assert_eq!(local[2].norm, 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The modules stand in the order in which light flows through the code; each uses only those above it.

// Blank lines keep the order: rustfmt sorts declarations that touch.

pub mod light;

pub mod pictures;

pub mod scene;

pub mod rays;

pub mod surfaces;

pub mod patches;

pub mod form_factors;

pub mod direct;

pub mod operator;

pub mod solve;

pub mod gather;

pub mod render;

pub mod reference;

pub mod plot;

pub mod study;

pub mod cli;

/// The README's code is tested with the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
