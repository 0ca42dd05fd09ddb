//! Charts, contact sheets and pictures of differences: numbers and pictures drawn as SVG and PNG.
//!
//! Only place for `zeno` and `ttf_parser`. Not handled: what is drawn; that is a question of `study`.

pub(crate) mod axis;
pub(crate) mod bars;
pub(crate) mod chart;
pub(crate) mod difference;
pub(crate) mod drawing;
pub(crate) mod figure;
pub(crate) mod font;
pub(crate) mod labels;
pub(crate) mod lines;
pub(crate) mod page;
pub(crate) mod shapes;
pub(crate) mod sheet;

pub use axis::Scale;
pub use bars::{Bar, Bars};
pub use chart::{Axis, Chart, Look, Series};
pub use difference::{Titled, difference_scale, difference_tiles};
pub use drawing::{ChartError, Corner, DrawError, Drawing};
pub use page::{Cell, Heading, Page, PageRow, Shown};
pub use shapes::Marker;
pub use sheet::{Sheet, Tile};
