//! The questions: how the bounce series runs in each mode, drawn as charts and contact sheets.
//!
//! Charts are drawn once for a backend and come out as SVG and PNG alike ([`Chart`]); contact sheets lay pictures
//! side by side at one exposure ([`Sheet`]). All text uses a font inside the binary, so files do not depend on the
//! machine.

mod axis;
mod bars;
mod bounces;
mod canvas;
mod chart;
mod check;
pub mod compare;
mod difference;
mod divided;
mod factors;
mod font;
pub mod frontier;
mod levels;
mod look;
pub mod map;
mod memory;
mod notes;
mod pipeline;
mod plot;
mod refine;
mod series;
mod shares;
mod sheet;
mod shoot;
mod solved;
mod surface;
mod tolerance;
pub mod tradeoff;
mod unfit;
mod within;

pub use axis::Scale;
pub use bars::Bars;
pub use bounces::{bounce_pictures, bounce_sheet, bounces_chart, partial_sums, term_name};
pub use canvas::Marker;
pub use chart::{Axis, Chart, ChartError, Look, Series};
pub use difference::{difference_scale, difference_tiles};
pub use factors::{Factor, FactorSettings, FactorTable, How, Reciprocity, Row as FactorRow, factors};
pub use look::{picture, render, without_luminaires};
pub use memory::{Estimate, check_memory, estimate_memory, usable_memory};
pub use pipeline::{Assembled, Fineness, Prepared, Seconds, Silent, Watch, assemble, prepare};
pub use series::{BounceSeries, End, TermError, WantedTerms, explore_within};
pub use sheet::{Sheet, Tile};
pub use shoot::{assembled_shooter, ray_shooter};
pub use surface::DrawError;
pub use tolerance::{Wanted, render_within};
pub use unfit::{PictureUnfit, Stored, Unfit, check_pictures};
pub use within::{ErrorParts, Within};
