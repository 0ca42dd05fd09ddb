//! Form factors between whole objects: [`exact`] by contours and quadrature, [`sampled`] by rays.

pub(crate) mod adaptive_integration;
pub(crate) mod contour_integral;
pub(crate) mod cubature;
pub(crate) mod discontinuity_lines;
pub mod exact;
pub(crate) mod facet;
pub(crate) mod occluders;
pub mod sampled;
pub(crate) mod visible_form;
