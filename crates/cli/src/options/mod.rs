//! Options that several commands share, and what stands behind them: the scene and its modes, folders that are kept,
//! light taken apart, and light at points.

pub(crate) mod arguments;
pub(crate) mod keep;
pub(crate) mod layers;
pub(crate) mod points;
