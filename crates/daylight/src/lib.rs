//! Daylight: how much of each patch of the sky reaches points in a scene, and what skies of weather files make of it.
//!
//! Daylight practice computes D, points by sky patches, once, and multiplies it by the sky of every hour. Here each
//! coefficient has a standard error.
//!
//! | module | has |
//! |---|---|
//! | `division` | the patches of Tregenza and Reinhart, in Radiance's order |
//! | `sun`, `weather`, `perez`, `sky` | the place of the sun; EPW and `.wea` files; luminance of the sky |
//! | `barriers`, `sight` | what is seen of the sky between things, by closed form or by rays |
//! | `annual` | illuminance under skies, autonomy, sunlit hours, UDI |
//! | `scene_sky` | the sky and the sun of a time for a scene file |
//! | `matrix_file`, `files` | Radiance's matrices; all that is written |
//! | `gather`, `light_on_patches`, `residual`, `coefficients` | D with its errors |
//!
//! Not handled: glass by angle, blinds as BSDF, coloured skies.

#![forbid(unsafe_code)]

mod annual;
mod barriers;
mod coefficients;
mod division;
mod error;
mod files;
mod gather;
mod light_on_patches;
mod matrix_file;
mod perez;
mod residual;
mod scene_sky;
mod sight;
mod sky;
mod sun;
mod weather;

pub use annual::{Illuminance, Metrics, Occupied, PointMetrics};
pub use coefficients::{Coefficients, DaylightGoal, Way, coefficients};
pub use division::{Compass, Division, OPEN, SkyPatch, direction};
pub use error::DaylightError;
pub use files::{DaylightFiles, DaylightReport, write_daylight};
pub use matrix_file::{read_matrix, write_matrix};
pub use perez::{Daylight, Measured, perez};
pub use scene_sky::{SceneSkyReport, SkyChoice, write_scene_sky};
pub use sky::{RADIANCE_EFFICACY, STANDARD, Skies, Sky, SkyTime, Standard, Sun};
pub use sun::{DIAMETER, Location, SunPlace, day_of_year, sun_at};
pub use weather::{Weather, WeatherTime};
