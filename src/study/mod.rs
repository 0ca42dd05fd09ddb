//! The questions: how the bounce series runs in each mode, where it converges, how the methods compare in speed and
//! accuracy, and what light objects exchange. Answers are numbers, and figures drawn by `plot`.

pub(crate) mod bounces;
pub mod compare;
pub(crate) mod factors;
pub mod frontier;
pub mod map;
pub(crate) mod statistics;
pub mod tradeoff;

pub use bounces::{bounce_pictures, bounce_sheet, bounces_chart, partial_sums, term_name};
pub use factors::{Factor, FactorSettings, FactorTable, How, Reciprocity, Row as FactorRow, factors};
