//! Skies as luminances of patches: of a weather file, by CIE, or of a file.
//!
//! ```text
//! CIE overcast   L = Lz (1 + 2 sin alt) / 3                        horizontal illuminance 7/9 pi Lz
//! CIE clear      L ~ (1 - exp(-0.32 / sin alt)) (0.91 + 10 exp(-3 g) + 0.45 cos² g)      g from the sun, radians
//! ground         rho / pi (diffuse + direct sin alt)               rho 0.2 unless another is given
//! ```
//!
//! The luminance of a patch is that at its middle, and all are scaled to a horizontal illuminance. The sun is apart:
//! where a matrix takes it as a part of the sky, it is spread over the four patches nearest to it, as `gendaymtx` does.
//!
//! Sources: ISO 15469:2004 (CIE S 011), types 1 and 12 in the form of CIE 110-1994; weather by [`crate::perez()`]. Not
//! handled: coloured skies.

use std::fmt;
use std::path::Path;

use glam::DVec3;
use halflight::scene::RadianceMatrix;

use crate::division::{Division, OPEN};
use crate::error::DaylightError;
use crate::matrix_file::read_matrix;
use crate::perez::{Measured, perez};
use crate::sun::SunPlace;
use crate::weather::Weather;

/// Lumens a watt by which Radiance makes radiance of luminance.
pub const RADIANCE_EFFICACY: f64 = 179.0;
/// Patches that a sun is spread over.
const NEAREST: usize = 4;
/// Horizontal illuminance of a sky that says none, lx.
pub const STANDARD: f64 = 10_000.0;

/// When a sky is.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SkyTime {
    /// 1 to 12.
    pub month: usize,
    /// 1 to 31.
    pub day: usize,
    /// Standard time.
    pub hour: f64,
}

impl fmt::Display for SkyTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let minutes = (60.0 * self.hour).round() as usize;
        write!(f, "{:02}-{:02} {:02}:{:02}", self.month, self.day, minutes / 60, minutes % 60)
    }
}

/// The sun of a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// East, north and up of the direction to its middle.
    pub towards: DVec3,
    /// Illuminance of a plane that faces it, lx.
    pub illuminance: f64,
}

/// The sky of one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    /// When; none of a sky without a time.
    pub time: Option<SkyTime>,
    /// Luminance of each column without the sun, cd/m², the ground's first.
    pub luminance: Vec<f64>,
    /// Where it is above the horizon and shines.
    pub sun: Option<Sun>,
}

/// Skies of one division.
#[derive(Clone, Debug)]
pub struct Skies {
    /// Whose columns they have.
    pub division: Division,
    /// One after the other.
    pub skies: Vec<Sky>,
    /// Hours that each stands for.
    pub hours: f64,
    /// What they are, in words.
    pub name: String,
}

/// A sky without weather.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Standard {
    /// The same from everywhere.
    Uniform,
    /// CIE's overcast one.
    Overcast,
    /// CIE's clear one, with the sun there; the sun itself sends nothing.
    Clear(SunPlace),
}

impl Skies {
    /// The skies of a weather file's times, above a ground of some reflectance.
    pub fn of_weather(weather: &Weather, division: Division, ground: f64) -> Skies {
        let sky = |time: &crate::weather::WeatherTime| {
            let place = weather.sun(time);
            let when = SkyTime { month: time.month, day: time.day, hour: time.hour };
            let (Measured::Irradiance { direct, diffuse } | Measured::Illuminance { direct, diffuse }) = time.measured;
            if direct + diffuse <= 1e-4 {
                return Sky { time: Some(when), luminance: vec![0.0; division.columns()], sun: None };
            }
            let found = perez(division, place, time.day_of_year, time.measured, time.dew_point);
            let mut luminance = found.luminance;
            let direct = found.direct;
            luminance[0] = ground / OPEN * (found.diffuse + direct * place.altitude.sin().max(0.0));
            let sun = (direct > 1e-4).then(|| Sun { towards: place.direction(), illuminance: direct });
            Sky { time: Some(when), luminance, sun }
        };
        let skies = weather.times.iter().map(sky).collect();
        Skies { division, skies, hours: weather.hours, name: weather.name.clone() }
    }

    /// A sky without weather of a horizontal illuminance, lx, above a ground of some reflectance.
    pub fn standard(kind: Standard, division: Division, illuminance: f64, ground: f64) -> Skies {
        let patches = division.patches();
        let relative = patches.iter().map(|patch| kind.relative(patch.direction()));
        let mut luminance: Vec<f64> = relative.collect();
        let cosines = patches.iter().map(|patch| patch.altitude.sin() * patch.solid_angle);
        let sum: f64 = luminance.iter().zip(cosines).skip(1).map(|(own, cosine)| own * cosine).sum();
        luminance.iter_mut().for_each(|own| *own *= illuminance / sum);
        luminance[0] = ground / OPEN * illuminance;
        let skies = vec![Sky { time: None, luminance, sun: None }];
        Skies { division, skies, hours: 1.0, name: kind.name().to_owned() }
    }

    /// The skies of a matrix of Radiance's, a row a column of the division and a column a time: luminance is 179 lm/W
    /// times 0.265 R + 0.670 G + 0.065 B, suns are a part of them, and they have no times.
    ///
    /// A file that cannot be read, or has other rows.
    pub fn read_matrix(path: &Path, division: Division) -> Result<Skies, DaylightError> {
        let RadianceMatrix { rows, columns, values } = read_matrix(path)?;
        if rows != division.columns() {
            let message = format!("has {rows} rows; MF:{} has {} columns", division.fineness(), division.columns());
            return Err(DaylightError::Matrix { file: path.display().to_string(), message });
        }
        let luminance = |k: usize| values.iter().skip(k).step_by(columns).map(|own| radiance_luminance(*own)).collect();
        let skies = (0..columns).map(|k| Sky { time: None, luminance: luminance(k), sun: None }).collect();
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(Skies { division, skies, hours: 1.0, name })
    }

    /// All columns, row by row as Radiance's matrices of skies have them, a sky a column: radiance over all channels
    /// alike, luminance over 179 lm/W, with the sun spread over the nearest patches.
    pub fn radiances(&self) -> Vec<Vec<f64>> {
        let all: Vec<Vec<f64>> = self.skies.iter().map(|sky| sky.with_sun(self.division)).collect();
        let of = |column: usize| all.iter().map(|sky| sky[column] / RADIANCE_EFFICACY).collect();
        (0..self.division.columns()).map(of).collect()
    }
}

/// Luminance of Radiance's RGB radiance, cd/m².
fn radiance_luminance(channels: [f32; 3]) -> f64 {
    let [r, g, b] = channels.map(f64::from);
    RADIANCE_EFFICACY * (0.265 * r + 0.670 * g + 0.065 * b)
}

impl Standard {
    fn name(self) -> &'static str {
        match self {
            Standard::Uniform => "uniform sky",
            Standard::Overcast => "CIE overcast sky",
            Standard::Clear(_) => "CIE clear sky",
        }
    }

    /// Luminance in a direction, to a scale of its own.
    pub fn relative(self, towards: DVec3) -> f64 {
        match self {
            _ if towards.z <= 0.0 => 0.0,
            Standard::Uniform => 1.0,
            Standard::Overcast => (1.0 + 2.0 * towards.z) / 3.0,
            Standard::Clear(sun) => {
                let angle = towards.dot(sun.direction()).clamp(-1.0, 1.0).acos();
                (1.0 - (-0.32 / towards.z).exp()) * (0.91 + 10.0 * (-3.0 * angle).exp() + 0.45 * angle.cos().powi(2))
            }
        }
    }
}

impl Sky {
    /// Luminance of each column that the sun alone would give, spread over the nearest patches, cd/m².
    pub fn spread_sun(&self, division: Division) -> Vec<f64> {
        let mut spread = vec![0.0; division.columns()];
        let Some(sun) = self.sun else { return spread };
        let patches = division.patches();
        let mut near: Vec<(f64, usize)> =
            patches.iter().enumerate().skip(1).map(|(k, patch)| (patch.direction().dot(sun.towards), k)).collect();
        near.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let weights = near.iter().take(NEAREST).map(|(cosine, k)| (1.0 / (1.002 - cosine), *k));
        let total: f64 = weights.clone().map(|(weight, _)| weight).sum();
        weights.for_each(|(weight, k)| spread[k] = weight / total * sun.illuminance / patches[k].solid_angle);
        spread
    }

    /// Luminance of each column with the sun spread over the nearest patches, cd/m².
    pub fn with_sun(&self, division: Division) -> Vec<f64> {
        let mut all = self.spread_sun(division);
        all.iter_mut().zip(&self.luminance).for_each(|(sum, own)| *sum += own);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_skies_have_their_illuminance_and_an_overcast_one_is_three_times_as_bright_above() {
        let division = Division::new(4).expect("a division");
        let sun = SunPlace { altitude: 0.8, azimuth: 1.0 };
        for kind in [Standard::Uniform, Standard::Overcast, Standard::Clear(sun)] {
            let skies = Skies::standard(kind, division, 10_000.0, 0.2);
            let luminance = &skies.skies[0].luminance;
            let of = |(l, p): (&f64, &crate::division::SkyPatch)| l * p.altitude.sin() * p.solid_angle;
            let all: f64 = luminance.iter().zip(&division.patches()).skip(1).map(of).sum();
            assert!((all - 10_000.0).abs() < 1e-6 && (luminance[0] - 2000.0 / OPEN).abs() < 1e-9);
        }
        let overcast = Skies::standard(Standard::Overcast, division, 1.0, 0.2).skies.remove(0).luminance;
        let zenith = overcast[overcast.len() - 1];
        assert!((zenith * 7.0 / 9.0 * OPEN - 1.0).abs() < 1e-3);
        let low = 1.0 + 2.0 * division.patches()[1].altitude.sin();
        assert!((zenith / overcast[1] - 3.0 / low).abs() < 1e-9);
    }

    #[test]
    fn a_sun_that_is_spread_keeps_its_illuminance() {
        let division = Division::new(1).expect("a division");
        let sun = Sun { towards: DVec3::new(0.3, -0.5, 0.6).normalize(), illuminance: 5000.0 };
        let sky = Sky { time: None, luminance: vec![0.0; division.columns()], sun: Some(sun) };
        let all: f64 = sky.spread_sun(division).iter().zip(&division.patches()).map(|(l, p)| l * p.solid_angle).sum();
        assert!((all - 5000.0).abs() < 1e-9);
    }
}
