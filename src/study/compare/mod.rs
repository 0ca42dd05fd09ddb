//! Measured pictures: ladders of methods and settings, held against references of another method.
//!
//! [`compare`] finds whether five ways to one picture agree; [`trade_off`] what each setting costs. Both climb
//! [ladders](Ladder) of pictures ever finer, within one [plan](StudyPlan), and take errors against [references](Truth)
//! whose own noise is subtracted.
//!
//! Not handled: series that diverge.

pub(crate) mod answer;
pub(crate) mod arithmetic;
#[cfg(feature = "plot")]
pub(crate) mod charts;
pub(crate) mod comparison;
pub(crate) mod ladder;
pub(crate) mod patch_answers;
pub(crate) mod patch_pictures;
pub(crate) mod references;
#[cfg(feature = "plot")]
pub(crate) mod sheet;
pub(crate) mod store;
pub(crate) mod traced_pictures;
pub(crate) mod tradeoff;
pub(crate) mod truth;
pub(crate) mod verdict;

pub use answer::{Answer, Mean};
#[cfg(feature = "plot")]
pub use charts::{
    asked_chart, charted_chart, charted_table, compared_chart, compared_table, pairs_table, seconds_bars,
};
pub use comparison::{Comparison, Reach, compare};
pub use ladder::{Ladder, LadderPoint, LadderStep, Method, ORDERS, Study, StudyError, StudyPlan, slope};
pub use references::Source;
#[cfg(feature = "plot")]
pub use sheet::{markdown, write_sheet};
pub use tradeoff::{Tradeoff, trade_off};
pub use truth::{Made, Reached, Truth, reached};
pub use verdict::{Difference, OrderDifference, Pair, judge};
