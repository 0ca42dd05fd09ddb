//! Charts, contact sheets and pictures of differences: numbers and pictures drawn as SVG and PNG.
//!
//! Only place for `plotters`. Not handled: what is drawn; that is a question of `study`.

pub(crate) mod axis;
pub(crate) mod bars;
pub(crate) mod canvas;
pub(crate) mod chart;
pub(crate) mod difference;
pub(crate) mod drawing;
pub(crate) mod font;
pub(crate) mod labels;
pub(crate) mod lines;
pub(crate) mod sheet;

pub use axis::Scale;
pub use bars::Bars;
pub use canvas::Marker;
pub use chart::{Axis, Chart, ChartError, Look, Series};
pub use difference::{difference_scale, difference_tiles};
pub use drawing::DrawError;
pub use sheet::{Sheet, Tile};
