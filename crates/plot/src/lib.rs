//! Charts, contact sheets, plans and pictures of differences: numbers and pictures drawn as SVG and PNG.
//!
//! Only place for `zeno` and `ttf_parser`. Not handled: what is drawn; that is a question of `study`.

pub mod axes;
pub mod bars;
pub mod chart;
pub mod difference;
pub mod drawing;
pub mod font;
pub mod isolines;
pub mod page;
pub mod plan;
pub mod viridis;

pub use axes::Scale;
pub use bars::{Bar, Bars};
pub use chart::{Axis, Chart, Look, Series, term_name};
pub use difference::{difference_cells, difference_scale};
pub use drawing::{ChartError, DrawError, Drawing, Marker};
pub use page::{Cell, Heading, Page, PageRow, Shown, Style};
pub use plan::{Plan, PlanAxis};
