//! The way from a scene to a picture with its error, and to the terms of the bounce series.
//!
//! [`Solver`] is the entry: pictures, series and operators of a scene are requested from it.
//!
//! Not handled: which picture is requested; that is a scene's camera and a [`Transport`](crate::light::Transport).

mod assembly;
mod bounces;
mod by_deadline;
mod fineness;
mod goal;
mod layers;
mod memory;
mod narrow_light;
mod pilot;
mod points;
mod rendered;
mod search;
mod solver;
mod square;

pub use crate::gather::Nearness;
pub use crate::operator::{Cast, RowSource, Wanted};
pub use assembly::{Assembled, Discretization, PatchLight, Seconds, Silent, Watch, pictures, without_luminaires};
pub use bounces::{BounceSeries, EmitterTerms, End};
pub use fineness::Fineness;
pub use layers::{Apart, EmitterPower, Layer, LayerError, LayerKind};
pub use memory::{PictureUnfit, Pilot, Stored, Unfit, check_fit, check_pictures, pixel, usable_memory};
pub use pilot::pilots;
pub use points::{Sensor, SensorLight, SensorLights};
pub use rendered::{Ended, ErrorParts, Errors, LightOnPatches, Rendered, Shortfall, Unmet};
pub use solver::{BouncesRequest, Equations, PictureRequest, PointsRequest, RenderError, Solver};
pub use square::{Square, SquareColumn};
