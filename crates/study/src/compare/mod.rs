//! Measured pictures: ladders of methods and settings, held against references of another method.
//!
//! [`measure`] climbs [ladders](Ladder) of pictures ever finer, within one [plan](StudyPlan), and takes errors against
//! [references](Truth) whose own noise is subtracted: to chart what each setting costs, or to find whether five ways to
//! one picture agree.
//!
//! Not handled: series that diverge.

pub(crate) mod arithmetic;
pub(crate) mod engine;
pub(crate) mod figures;
pub(crate) mod ladder;
pub(crate) mod patch_methods;
pub(crate) mod references;
pub(crate) mod tracers;
pub(crate) mod truth;
pub(crate) mod verdict;

pub use engine::{Climb, Measurements, measure};
pub use figures::{
    charted_chart, charted_table, compared_chart, compared_sheet, compared_table, markdown, pairs_table,
    requested_chart, seconds_bars,
};
pub use ladder::{Ladder, LadderPoint, LadderStep, Method, ORDERS, Study, StudyError, StudyPlan, slope};
pub use references::Source;
pub use truth::{Made, Reached, Truth, reached};
pub use verdict::{Answer, Difference, Mean, OrderDifference, Pair, judge};
