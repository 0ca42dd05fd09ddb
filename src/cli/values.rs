//! Values of arguments: their types, and how their text is read and checked.

use clap::ValueEnum;
use clap::builder::PossibleValue;

use crate::pictures::Size;
use crate::scene::AddedLight;
use crate::study::compare::{Ladder, Method};

/// Whether light is looked for on purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum NextEventChoice {
    /// Every vertex draws a point on an emitter
    On,
    /// Emitters are found by chance only
    Off,
}

/// The four modes, or all of them.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ModeChoice {
    /// Shadows and interreflection
    Global,
    /// Interreflection, no shadows; may diverge
    Shadowless,
    /// Shadows, no interreflection
    OneBounce,
    /// Neither: OpenGL-style local shading
    Local,
    /// All four
    All,
}

impl ValueEnum for Ladder {
    fn value_variants<'a>() -> &'a [Ladder] {
        &Ladder::CHARTED
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = match self.method {
            Method::Tolerance => ("tolerance", "The error asked for"),
            Method::Patches => ("patches", "The number of patches, the rest fine"),
            Method::Rays => ("rays", "Rays a patch, the rest fine"),
            Method::Samples => ("samples", "Rays a pixel, the rest fine"),
            Method::ShootingRays => ("shooting", "Progressive shooting, all finer together"),
            Method::NextEvent => ("paths", "Samples of the path tracer"),
            Method::Neumann | Method::ShootingAssembled | Method::Paths => return None,
        };
        Some(PossibleValue::new(name).help(help))
    }
}

impl ValueEnum for AddedLight {
    fn value_variants<'a>() -> &'a [AddedLight] {
        &[AddedLight::Ceiling, AddedLight::Sky]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = match self {
            AddedLight::Ceiling => ("ceiling", "A rectangle below the ceiling, or above an open scene"),
            AddedLight::Sky => ("sky", "A sky of radiance 1 all around, for scenes that are open"),
        };
        Some(PossibleValue::new(name).help(help))
    }
}

/// A number from 0 to 1.
pub fn unit_interval(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err("must be a number from 0 to 1".into()),
    }
}

/// A number from 0 to below 1.
pub fn reflectance(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if (0.0..1.0).contains(&value) => Ok(value),
        _ => Err("must be a number from 0 to below 1".into()),
    }
}

/// Factors of two that a picture is brightened by.
pub fn stops(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if (-100.0..=100.0).contains(&value) => Ok(value),
        _ => Err("must be a number from -100 to 100".into()),
    }
}

/// A relative error of a picture.
pub fn picture_error(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (1e-4..=0.5).contains(&value) => Ok(value),
        _ => Err("must be a number from 0.0001 to 0.5; 0.01 is 1 %".into()),
    }
}

/// A time limit.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a number of seconds above 0".into()),
    }
}

/// A relative error.
pub fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (1e-9..=1.0).contains(&value) => Ok(value),
        _ => Err("must be a number from 1e-9 to 1".into()),
    }
}

/// WIDTHxHEIGHT in pixels.
pub fn size(text: &str) -> Result<Size, String> {
    const LARGEST: usize = 16_384;
    let wrong = || format!("must be WIDTHxHEIGHT, each from 1 to {LARGEST}, as in 640x480");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let number = |t: &str| t.parse().ok().filter(|n| (1..=LARGEST).contains(n));
    match (number(width), number(height)) {
        (Some(width), Some(height)) => Ok(Size { width, height }),
        _ => Err(wrong()),
    }
}

/// More than nothing, GiB.
pub fn gibibytes(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("write a number of GiB above 0, such as 4 or 0.5".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_stays_within_floats() {
        assert_eq!(stops("-1.5"), Ok(-1.5));
        for wrong in ["nan", "inf", "1e9", "bright"] {
            assert!(stops(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn sizes_are_checked() {
        assert_eq!(size("640x480").map(|s| (s.width, s.height)), Ok((640, 480)));
        for wrong in ["640", "0x4", "axb", "640x", "99999x1", "-1x4"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
