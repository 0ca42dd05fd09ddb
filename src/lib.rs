//! halflight solves the light transport equation `L = E + K L` for diffuse scenes with vector-valued light.
//!
//! Light is a pair: an invisible half that travels through the scene, and a visible half that only the camera
//! collects. Surfaces reflect it by the 2×2 matrix `rho [[alpha, 0], [1, 0]]` and let the share tau of it through. The
//! two numbers turn one algorithm into global illumination, shadowless, one-bounce or OpenGL-style local shading
//! ([`Mode`]).
//!
//! # A picture
//!
//! A [`Scene`], a [`Solver`] for it, and a picture of a stated error:
//!
//! ```
//! use halflight::{Mode, Scene, Solver};
//!
//! let scene = Scene::open("cornell-box")?; // or a .toml, .obj, .glb or .gltf file
//! let solver = Solver::new(&scene).seed(7); // rays and surfaces, once
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
//! # The series of each mode
//!
//! The terms `KⁿE` of each mode, with a verdict that is proved, not observed, and a proved bound on all later terms:
//!
//! ```
//! use halflight::solve::Verdict;
//! use halflight::{Fineness, Mode, Scene, Settings, Solver, explore, neumann};
//!
//! let solver = Solver::new(&Scene::open("furnished-room")?);
//! let coarse = Fineness { patches: 300, rays: 64 };
//! let series = |mode| Ok::<_, halflight::render::Unfit>(explore(&solver.operator(mode, coarse)?, 8));
//! for mode in Mode::ALL {
//!     let series = series(mode)?;
//!     println!("{mode}: {}, radius {:.3} to {:.3}", series.verdict.name(), series.radius.lower, series.radius.upper);
//!     for bounce in &series.bounces {
//!         println!("  {}: {:?} W, all later terms at most {:?}", bounce.n, bounce.power, bounce.tail_bound);
//!     }
//! }
//! assert_eq!(series(Mode::Global)?.verdict, Verdict::Converges);
//!
//! // Local shading ends: KE is seen and does not travel, so K²E = 0 exactly.
//! assert_eq!(series(Mode::Local)?.bounces[2].norm, 0.0);
//!
//! // Shadowless light diverges in this room. Its terms may be looked at; summing them is refused with a proof.
//! let terms = series(Mode::Shadowless)?.bounces;
//! assert!(terms[8].norm > terms[7].norm);
//! let refused = neumann(&solver.operator(Mode::Shadowless, coarse)?, &Settings::default()).unwrap_err();
//! assert!(refused.radius.lower > 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Solver::bounces`] gives terms whose powers have a tolerance, by walks of light that know no patches.
//!
//! # K as a matrix
//!
//! [`Operator`] stores F once, and alpha and rho of each patch; K can be written out, sparse with its 2×2 blocks or
//! dense, for one channel:
//!
//! ```
//! use halflight::solve::direct;
//! use halflight::{Fineness, Mode, Scene, Settings, Solver, neumann};
//!
//! // A closed cube that emits 0.25 and reflects 0.5 everywhere.
//! let solver = Solver::new(&Scene::open("furnace")?);
//! let k = solver.operator(Mode::Global, Fineness { patches: 24, rays: 64 })?;
//! let (_, row) = k.form_factors().row(0);
//! assert!((row.iter().sum::<f32>() - 1.0).abs() < 1e-5); // closed: every ray ends on a patch
//! assert_eq!(k.blocks(0).rows(), k.len()); // F_ij rho_i [[alpha_i, 0], [1, 0]], red
//! assert_eq!(k.dense(0).nrows(), 2 * k.len()); // invisible, visible; invisible, visible; ...
//!
//! // L = E / (1 - rho), by LU of I - K and by the Neumann series.
//! let solved = direct(&k).ok_or("I - K is singular")?;
//! let summed = neumann(&k, &Settings::default())?.light;
//! assert!((solved[0].visible.x - 0.5).abs() < 1e-4 && (summed[0].visible.x - 0.5).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # A solver of your own
//!
//! Solvers ask of K no more than [`LinearOperator`] has: products with K and its transpose, areas, and `KE`. Whoever
//! multiplies with an F of their own has every solver and bound of [`solve`]; `examples/own_solver.rs` is GMRES.
//!
//! ```
//! use halflight::{Fineness, Light, LinearOperator, Mode, Scene, Settings, Solver, neumann};
//!
//! /// `x <- KE + K x`, so many times; then L = E + x.
//! fn fixed_point(k: &dyn LinearOperator, steps: usize) -> Vec<Light> {
//!     let plus = |a: &[Light], b: &[Light]| -> Vec<Light> {
//!         let sum = |(a, b): (&Light, &Light)| Light {
//!             invisible: a.invisible + b.invisible,
//!             visible: a.visible + b.visible,
//!         };
//!         a.iter().zip(b).map(sum).collect()
//!     };
//!     let first = k.first_bounce();
//!     let reflected = (0..steps).fold(first.clone(), |x, _| plus(&first, &k.apply(&x)));
//!     plus(k.emission(), &reflected)
//! }
//!
//! let solver = Solver::new(&Scene::open("cornell-box")?);
//! let k = solver.operator(Mode::Global, Fineness { patches: 300, rays: 64 })?;
//! let (own, summed) = (fixed_point(&k, 40), neumann(&k, &Settings::default())?.light);
//! let apart = own.iter().zip(&summed).map(|(a, b)| (a.visible - b.visible).abs().max_element());
//! assert!(apart.fold(0.0, f32::max) < 1e-2); // the luminaire's is 17
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The modules
//!
//! They stand in the order in which light flows through the code; each uses only those above it. [`light`] to
//! [`surfaces`] say what there is, [`patches`] to [`solve`] put `L = E + K L` together and solve it, [`reading`] to
//! [`gather`] look at the solution and estimate its error, and [`render`] has all of it as [`Solver`]. What is made of
//! a solution (files, charts, pages, comparisons with a path tracer, the program) are crates of their own, which use
//! what is public here.

#![forbid(unsafe_code)]
#![deny(unreachable_pub)]

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

#[cfg(feature = "mpi")]
mod travelling;

pub use halflight_team::Interrupt;
pub use light::{Light, Mode, Transport};
pub use operator::{LinearOperator, Operator};
pub use render::{Fineness, Rendered, Solver};
pub use scene::{LoadOptions, Scene};
pub use solve::{Settings, Solution, explore, neumann};

/// The README's code is tested with the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
