//! The error of any picture of a scene: a path tracer's, a denoiser's, an older one of ours. No reference is rendered.
//!
//! A picture D is judged by independent estimates B of its pixels that have no bias: `E[(D - B_i)(D - B_j)]` is the
//! squared error of D, whatever D is (`crossed`). The estimates are paths from the camera with the core's direct light,
//! which read no patch (`paths`), as many in each pixel as the noise around it asks for (`estimates`). What is told is
//! the error with its standard error, whether the picture is brighter or darker, where (`blocks`), and what would
//! explain it (`causes`).
//!
//! ```
//! use halflight::render::Silent;
//! use halflight::{Mode, Scene, Solver};
//! use halflight_audit::{AuditGoal, audit};
//!
//! let scene = Scene::open("cornell-box")?;
//! let picture = Solver::new(&scene).render(Mode::Global, (24, 24)).tolerance(0.05)?.picture;
//! let brighter = picture.scaled(1.2);
//! let goal = AuditGoal { seconds: Some(5.0), ..AuditGoal::default() };
//! let told = audit(&scene, Mode::Global.transport(), &brighter, &goal, &Silent)?;
//! assert!((told.error.relative().value - 0.2).abs() < 0.05 && (told.mean.total.value - 0.2).abs() < 0.02);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Theory and measurements: docs/audit.md. Not handled: pixels that see emission; light that no path has found.

#![forbid(unsafe_code)]

mod audit;
mod blocks;
mod causes;
mod crossed;
mod estimates;
mod paths;

pub use audit::{Audit, AuditError, AuditGoal, MeanError, Part, SURE, Verdict, audit, verdict};
pub use causes::Cause;
pub use crossed::{Estimated, PairMean, SquaredError, Variances};
