//! Form factors between whole objects: [`exact`] by contours and quadrature, [`sampled`] by rays.

pub(crate) mod between;
pub(crate) mod contour;
pub(crate) mod cubature;
pub mod exact;
pub(crate) mod facet;
pub(crate) mod kinks;
pub(crate) mod refine;
pub mod sampled;
pub(crate) mod visible;
