//! Charts, contact sheets, plans and pictures of differences: numbers and pictures drawn as SVG and PNG.
//!
//! Only place for `zeno` and `ttf_parser`. Not handled: what is drawn; that is a question of `study`.

pub(crate) mod axes;
pub(crate) mod bars;
pub(crate) mod chart;
pub(crate) mod difference;
pub(crate) mod drawing;
pub(crate) mod font;
pub(crate) mod isolines;
pub(crate) mod page;
pub(crate) mod plan;
pub(crate) mod viridis;

pub use axes::Scale;
pub use bars::{Bar, Bars};
pub use chart::{Axis, Chart, Look, Series, term_name};
pub use difference::{difference_cells, difference_scale};
pub use drawing::{ChartError, Corner, DrawError, Drawing, Marker};
pub use page::{Cell, Heading, Page, PageRow, Shown, Style};
pub use plan::{Plan, PlanAxis};
