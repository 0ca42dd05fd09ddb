//! Figures for print: the four modes on one scene, successive approximation, and what lies between the modes.
//!
//! Each is a [`Page`](crate::plot::Page) with a list of what its panels show. Not handled: how exact the pictures are;
//! the caller says.

pub(crate) mod between;
pub(crate) mod four_modes;
pub(crate) mod panel;
pub(crate) mod square;
pub(crate) mod successive;

pub use between::{Point, SquareEffort, solve_points};
pub use four_modes::{SolvedMode, four_modes};
pub use panel::{Figure, Panel, exposure_for};
pub use square::{between_grid, between_strip, square_points};
pub use successive::{Successive, successive};
