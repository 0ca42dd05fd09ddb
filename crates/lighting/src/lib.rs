//! Lighting practice on light that was solved: where it is measured, how bright and even it is there, and what lamps of
//! other strengths make of it.
//!
//! Not handled: glare, and what a standard asks of a room.

mod aims;
mod decimals;
mod dimming;
mod fluence;
mod heads;
mod kept_lamps;
mod measured;
mod plan;
mod quantity;
mod relight;
mod rows;
mod sensor_table;
mod sensors;
mod uniformity;

pub use aims::aims;
pub use dimming::dimmed;
pub use fluence::{Fluence, all_around, of_point};
pub use kept_lamps::LampError;
pub use measured::{Columns, Measured, table};
pub use plan::{Words, plan, plan_of};
pub use quantity::{Quantity, digits, lux};
pub use relight::{Factors, LampLight, Relit, RelitPoint, SolvedPoint};
pub use sensors::{Grid, SensorError, SensorLayout};
pub use uniformity::Uniformity;
