//! What is shown of the light at a point.
//!
//! ```text
//! E_v = 683 lm/W (0.2126 R + 0.7152 G + 0.0722 B)      illuminance, lx: CIE Y of linear sRGB (IEC 61966-2-1)
//! ```
//!
//! Not handled: spectra, and what eyes do in the dark.

use halflight::pictures::LUMINANCE;
use halflight::render::{SensorLight, SensorLights};
use halflight::scene::EFFICACY;

use crate::uniformity::Uniformity;

/// A number for the light at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Irradiance, the mean of the channels, W/m².
    Irradiance,
    /// Illuminance, lx.
    Illuminance,
}

impl Quantity {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Irradiance => "irradiance",
            Quantity::Illuminance => "illuminance",
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Irradiance => "W/m²",
            Quantity::Illuminance => "lx",
        }
    }

    /// Its value at a point; none inside of a solid, where nobody measures.
    pub fn at(self, light: &SensorLight) -> Option<f64> {
        let value = match self {
            Quantity::Irradiance => light.irradiance.iter().sum::<f64>() / 3.0,
            Quantity::Illuminance => lux(&light.irradiance),
        };
        (!light.is_inside).then_some(value)
    }

    /// How evenly it is spread over points.
    pub fn uniformity(self, found: &SensorLights) -> Uniformity {
        Uniformity::of(found.points.iter().map(|light| self.at(light)))
    }
}

/// Illuminance of an irradiance, lm/m².
pub fn lux(irradiance: &[f64; 3]) -> f64 {
    EFFICACY * irradiance.iter().zip(LUMINANCE).map(|(e, y)| e * y).sum::<f64>()
}

/// A value with four digits that count.
pub fn digits(value: f64) -> String {
    let after = (3.0 - value.abs().max(f64::MIN_POSITIVE).log10().floor()).clamp(0.0, 9.0) as usize;
    if value == 0.0 { "0".to_owned() } else { format!("{value:.after$}") }
}
