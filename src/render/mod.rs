//! The way from a scene to a picture with its error, and to the terms of the bounce series.
//!
//! [`Solver`] is the door: whatever is asked of a scene is asked of it.
//!
//! Not handled: which picture is asked for; that is a scene's camera and a [`Transport`](crate::light::Transport).

pub(crate) mod assembly;
mod bounces;
mod by_deadline;
mod division;
mod fineness;
mod levels;
pub(crate) mod memory;
pub(crate) mod prepared;
mod reading_cost;
mod rendered;
mod residual_check;
mod search;
mod solved;
mod solver;
mod unfit;
mod wanted;

pub use assembly::{Assembled, Seconds, Silent, Watch};
pub use bounces::{BounceSeries, End, TermError};
pub use fineness::Fineness;
pub use memory::{Estimate, usable_memory};
pub use prepared::*;
pub use rendered::{Ended, ErrorParts, Rendered};
pub use solver::{BouncesRequest, Equations, PictureRequest, RenderError, Solver};
pub use unfit::{PictureUnfit, Stored, Unfit, check_pictures};
