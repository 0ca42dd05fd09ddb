//! The two numbers (alpha, tau) of a surface, and the four corners of their square that have names.

use std::fmt;

use serde::ser::{Serialize, SerializeStruct as _, Serializer};

/// How much a surface passes on: `alpha` of what it reflects travels further, `tau` of what reaches it goes through.
///
/// Both lie in 0..=1. Every point of the square is legal; [`Mode`] names its corners.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(from = "Reported")]
pub struct Transport {
    /// Interreflection: the share of reflected light that travels on (invisible half).
    pub alpha: f32,
    /// Transmission: the share of light that passes through the surface, direction unchanged.
    pub tau: f32,
}

/// alpha or tau outside 0..=1.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{name} = {value} is outside 0..1")]
pub struct TransportError {
    /// `alpha` or `tau`.
    pub name: &'static str,
    /// The value given.
    pub value: f32,
}

impl Transport {
    /// Checks that both numbers lie in 0..=1 (NaN does not).
    pub fn new(alpha: f32, tau: f32) -> Result<Self, TransportError> {
        for (name, value) in [("alpha", alpha), ("tau", tau)] {
            if !(0.0..=1.0).contains(&value) {
                return Err(TransportError { name, value });
            }
        }
        Ok(Transport { alpha, tau })
    }

    /// The corner of the (alpha, tau) square this is, if it is one.
    pub fn mode(self) -> Option<Mode> {
        Mode::ALL.into_iter().find(|mode| mode.transport() == self)
    }

    /// The label as a part of a file's name: without spaces.
    pub fn file_name(self) -> String {
        self.label().replace(' ', "-")
    }

    /// The mode's name at a corner, `alpha A tau T` elsewhere.
    pub fn label(self) -> String {
        match self.mode() {
            Some(mode) => mode.to_string(),
            None => format!("alpha {} tau {}", self.alpha, self.tau),
        }
    }
}

/// Whether surfaces of these tau let no light through: every ray ends at the first.
pub fn nothing_passes(tau: impl IntoIterator<Item = f32>) -> bool {
    tau.into_iter().all(|tau| tau == 0.0)
}

/// In reports: `mode`, null away from the corners, `alpha` and `tau`, as a person writes them (0.1, not 0.10000000149).
impl Serialize for Transport {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let decimal = |x: f32| x.to_string().parse().unwrap_or(f64::from(x));
        let mut fields = to.serialize_struct("Transport", 3)?;
        fields.serialize_field("mode", &self.mode().map(Mode::name))?;
        fields.serialize_field("alpha", &decimal(self.alpha))?;
        fields.serialize_field("tau", &decimal(self.tau))?;
        fields.end()
    }
}

/// What a report has of it.
#[derive(serde::Deserialize)]
struct Reported {
    #[serde(rename = "mode")]
    _mode: Option<String>,
    alpha: f64,
    tau: f64,
}

impl From<Reported> for Transport {
    fn from(Reported { alpha, tau, .. }: Reported) -> Transport {
        Transport { alpha: alpha as f32, tau: tau as f32 }
    }
}

impl From<Mode> for Transport {
    fn from(mode: Mode) -> Transport {
        mode.transport()
    }
}

impl Default for Transport {
    fn default() -> Self {
        Mode::Global.transport()
    }
}

/// The four illumination models at the corners of the (alpha, tau) square.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// alpha 1, tau 0: shadows and interreflection.
    Global,
    /// alpha 1, tau 1: interreflection, nothing casts a shadow. May diverge.
    Shadowless,
    /// alpha 0, tau 0: shadows, no interreflection. `K²E = 0`.
    OneBounce,
    /// alpha 0, tau 1: OpenGL-style local shading. `K²E = 0`.
    Local,
}

impl Mode {
    /// All four, in the order in which pictures and tables show them.
    pub const ALL: [Mode; 4] = [Mode::Global, Mode::Shadowless, Mode::OneBounce, Mode::Local];

    /// The corner's (alpha, tau).
    pub fn transport(self) -> Transport {
        let (alpha, tau) = match self {
            Mode::Global => (1.0, 0.0),
            Mode::Shadowless => (1.0, 1.0),
            Mode::OneBounce => (0.0, 0.0),
            Mode::Local => (0.0, 1.0),
        };
        Transport { alpha, tau }
    }

    /// The mode of that name: `global`, `shadowless`, `one-bounce` or `local`.
    pub fn from_name(name: &str) -> Option<Mode> {
        Mode::ALL.into_iter().find(|mode| mode.name() == name)
    }

    /// The name used on the command line, in scene files and in file names.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Global => "global",
            Mode::Shadowless => "shadowless",
            Mode::OneBounce => "one-bounce",
            Mode::Local => "local",
        }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_round_trip_through_names_and_numbers() {
        for mode in Mode::ALL {
            assert_eq!(Mode::from_name(mode.name()), Some(mode));
            assert_eq!(mode.transport().mode(), Some(mode));
        }
        assert_eq!(Transport::new(0.5, 0.5).unwrap().mode(), None);
    }

    #[test]
    fn numbers_outside_the_square_are_refused() {
        assert!(Transport::new(1.1, 0.0).is_err());
        assert!(Transport::new(0.0, -0.1).is_err());
        assert!(Transport::new(f32::NAN, 0.0).is_err());
    }
}
