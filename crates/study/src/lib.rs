//! The questions: how the bounce series runs in each mode, where it converges, how the methods compare in speed and
//! accuracy, and what light objects exchange. Answers are numbers and charts.
//!
//! Not handled: figures for print and studies at the frontier, which are examples of this crate.

pub(crate) mod bounces;
pub mod compare;
pub(crate) mod exchange;
pub(crate) mod factor_matrix;
pub(crate) mod factors;
pub mod map;
pub(crate) mod series;
pub(crate) mod statistics;

pub use bounces::{bounce_fields, bounce_fields_and_rest, bounce_pictures, partial_sums};
pub use exchange::{Exchange, ExchangeError, emissivities};
pub use factor_matrix::{FactorMatrix, PatchFactors, patch_factors};
pub use factors::{Factor, FactorSettings, FactorTable, How, Reciprocity, Row as FactorRow, factors};
pub use series::{bounce_sheet, bounces_chart, brightened, brightening};
pub use statistics::log_slope;
