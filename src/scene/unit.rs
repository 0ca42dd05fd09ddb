//! Units of length: what one of a file's numbers stands for.
//!
//! Radiance from surfaces does not depend on it; power and the `1/d²` of punctual lights do, in metres.
//!
//! Not handled: units by their factor alone.

use std::str::FromStr;

/// A unit of length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
pub enum LengthUnit {
    /// Metres, which numbers without a unit stand for.
    #[default]
    #[serde(rename = "m")]
    Metre,
    /// Centimetres.
    #[serde(rename = "cm")]
    Centimetre,
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetre,
    /// Inches of 25.4 mm.
    #[serde(rename = "in")]
    Inch,
    /// Feet of 304.8 mm.
    #[serde(rename = "ft")]
    Foot,
}

impl LengthUnit {
    /// All units with their symbols.
    pub const ALL: [(&'static str, LengthUnit); 5] = [
        ("m", LengthUnit::Metre),
        ("cm", LengthUnit::Centimetre),
        ("mm", LengthUnit::Millimetre),
        ("in", LengthUnit::Inch),
        ("ft", LengthUnit::Foot),
    ];

    /// How many metres one is.
    pub fn metres(self) -> f64 {
        match self {
            LengthUnit::Metre => 1.0,
            LengthUnit::Centimetre => 1e-2,
            LengthUnit::Millimetre => 1e-3,
            LengthUnit::Inch => 0.0254,
            LengthUnit::Foot => 0.3048,
        }
    }
}

impl FromStr for LengthUnit {
    type Err = String;

    fn from_str(symbol: &str) -> Result<LengthUnit, String> {
        let found = LengthUnit::ALL.iter().find(|(known, _)| *known == symbol);
        found.map(|(_, unit)| *unit).ok_or_else(|| format!("`{symbol}` is none of the units m, cm, mm, in and ft"))
    }
}
