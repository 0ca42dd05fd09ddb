//! halflight solves the light transport equation `L = E + K L` for diffuse scenes with vector-valued light.
//!
//! Light is a pair: an invisible half that travels through the scene, and a visible half that only the camera
//! collects. Surfaces reflect it by the 2×2 matrix `rho [[alpha, 0], [1, 0]]` and pass it on by tau. The two numbers
//! turn one algorithm into global illumination, shadowless, one-bounce or OpenGL-style local shading.
//!
//! A [`Scene`], a [`Solver`] for it, and a picture of a stated error:
//!
//! ```
//! use halflight::{Mode, Scene, Solver};
//!
//! let scene = Scene::open("cornell-box")?;
//! let mut solver = Solver::new(&scene).seed(7); // rays and surfaces, once
//! let picture = solver.render(Mode::Global, (32, 32)).tolerance(0.1)?;
//!
//! let error = picture.error; // relative RMS error: noise of F, patch size, truncation, gather pass
//! println!("{:.1} % in {:.2} s", 100.0 * error.total, picture.seconds.total);
//! # let folder = tempfile::tempdir()?;
//! # let file = folder.path().join("cornell.exr");
//! # let same = solver.render(Mode::Global, (32, 32)).tolerance(0.1)?;
//! # assert!(error.total <= 0.1 && same.picture == picture.picture);
//! # let path = |_: &str| file.clone();
//! picture.save(path("cornell.exr"))?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The transport operator K itself, and the bounces of its Neumann series, with a proved bound on what is left out:
//!
//! ```
//! use halflight::{Fineness, Mode, Scene, Settings, Solver, neumann};
//!
//! let scene = Scene::open("cornell-box")?;
//! let k = Solver::new(&scene).operator(Mode::Global, Fineness { patches: 300, rays: 64 })?;
//! let solution = neumann(&k, &Settings::default())?;
//! for bounce in &solution.bounces {
//!     let [red, green, blue] = bounce.power;
//!     println!("{}: {red:.0} {green:.0} {blue:.0} W", bounce.n);
//! }
//! assert!(solution.bounces[3].power[0] < solution.bounces[2].power[0]);
//! assert!(solution.rest() <= 1e-4 * solution.reflected);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A series may diverge. Summing it is refused with a proof; looking at its terms is not:
//!
//! ```
//! use halflight::{Fineness, Mode, Scene, Settings, Solver, explore, neumann};
//!
//! let mut solver = Solver::new(&Scene::open("furnished-room")?);
//! let coarse = Fineness { patches: 300, rays: 64 };
//! let k = solver.operator(Mode::Shadowless, coarse)?;
//! let refused = neumann(&k, &Settings::default()).unwrap_err();
//! assert!(refused.radius.lower > 1.0);
//! let terms = explore(&k, 8).bounces;
//! assert!(terms[8].norm > terms[7].norm);
//!
//! // Local shading ends: KE is seen and does not travel, so K²E = 0 exactly.
//! let local = explore(&solver.operator(Mode::Local, coarse)?, 8).bounces;
//! assert_eq!(local[1].power_invisible, [0.0; 3]);
//! assert_eq!(local[2].norm, 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Solvers ask of K no more than [`LinearOperator`] has: `examples/own_solver.rs` adds one, and whoever multiplies with
//! an F of their own has every solver and bound of [`solve`].
//!
//! The modules stand in the order in which light flows through the code; each uses only those above it. Two features,
//! both on by default, may be left out: `plot` draws charts and sheets, `cli` is the program and needs `plot`.

#![cfg_attr(not(feature = "opengl"), forbid(unsafe_code))]

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

pub mod reading;

pub mod error;

pub mod gather;

pub mod render;

pub mod reference;

#[cfg(feature = "plot")]
pub mod plot;

pub mod study;

#[cfg(feature = "cli")]
pub mod cli;

pub use light::{Light, Mode, Transport};
pub use operator::{LinearOperator, Operator};
pub use render::{Fineness, Rendered, Solver};
pub use scene::{LoadOptions, Scene};
pub use solve::{Settings, Solution, explore, neumann};

/// The README's code is tested with the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
