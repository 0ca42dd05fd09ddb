//! Figures for print: the four modes on one scene, successive approximation, what lies between the modes, and the
//! local mode beside OpenGL.
//!
//! Each is a [`Page`](crate::plot::Page) with a list of what its panels show. Not handled: how exact the pictures are;
//! the caller says.

pub(crate) mod between;
pub(crate) mod four_modes;
pub(crate) mod local_light;
pub(crate) mod local_page;
pub(crate) mod local_sweep;
pub(crate) mod panel;
pub(crate) mod square;
pub(crate) mod successive;
pub(crate) mod two_spheres;

pub use between::{Point, SquareEffort, solve_points};
pub use four_modes::{SolvedMode, four_modes};
pub use local_light::{Apart, LocalEffort, LocalLight, PointLights, local_light};
pub use local_page::local_page;
pub use local_sweep::{Swept, local_sweep, sweep_chart};
pub use panel::{Figure, PageSettings, Panel, exposure_for};
pub use square::{between_grid, between_strip, square_points};
pub use successive::{Successive, successive};
pub use two_spheres::{FiveLights, Lit, TRIANGLES, TwoSpheres};
