//! Figures for print: the four modes on one scene, successive approximation, what lies between the modes, and the
//! local mode next to OpenGL.
//!
//! Each is a [`Page`](halflight_plot::Page) with a list of what its panels show. Not handled: how exact the pictures are;
//! the caller says.

pub(crate) mod between;
pub(crate) mod local;
pub(crate) mod panel;
pub(crate) mod series;
pub(crate) mod two_spheres;

pub use between::{Point, SquareEffort, between_grid, between_strip, solve_points, square_points};
pub use local::{
    LocalEffort, LocalLight, PictureDifference, PointLights, QuadratureDifference, Swept, TracedLight, local_light,
    local_page, local_sweep, sweep_chart,
};
pub use panel::{Figure, PageSettings, Panel, SolvedMode, exposure_for, four_modes};
pub use series::{Successive, bounce_sheet, bounces_chart, successive};
pub use two_spheres::{FiveLights, Lit, TRIANGLES, TwoSpheres};
