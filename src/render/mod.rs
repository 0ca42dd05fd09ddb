//! The way from a scene to a picture with its error, and to the terms of the bounce series.
//!
//! [`Solver`] does all of it for one scene. Its steps are there as functions too: [`prepare`] cuts patches,
//! [`assemble`] puts K together, [`render`] makes the picture of given effort, and [`render_within`] spends effort
//! until the picture's estimated error is within a tolerance; [`explore_within`] does so for the powers of the terms
//! `KⁿE`.
//!
//! Not handled: which picture is asked for; that is a scene's camera and a [`Transport`](crate::light::Transport).

pub(crate) mod assembly;
pub(crate) mod deadline;
pub(crate) mod divided_patches;
mod fineness;
pub(crate) mod levels;
pub(crate) mod light_walks;
pub(crate) mod look;
pub(crate) mod memory;
pub(crate) mod reading_cost;
pub(crate) mod refinement;
pub(crate) mod rendered;
pub(crate) mod residual_check;
pub(crate) mod series;
pub(crate) mod shooters;
pub(crate) mod solved;
pub(crate) mod solver;
pub(crate) mod term_errors;
pub(crate) mod term_rounds;
pub(crate) mod tolerance;
pub(crate) mod unfit;
pub(crate) mod walk_sources;
pub(crate) mod wanted;

pub use assembly::{Assembled, Geometry, Prepared, Seconds, Silent, Watch, assemble, prepare};
pub use deadline::render_within;
pub use fineness::Fineness;
pub use look::{picture, render, without_luminaires};
pub use memory::{Estimate, check_memory, estimate_memory, usable_memory};
pub use rendered::{Ended, ErrorParts, Rendered};
pub use series::{BounceSeries, WantedTerms};
pub use shooters::{assembled_shooter, ray_shooter};
pub use solver::{RenderError, Request, Solver};
pub use term_errors::{End, TermError};
pub use term_rounds::explore_within;
pub use unfit::{PictureUnfit, Stored, Unfit, check_pictures};
pub use wanted::Wanted;
