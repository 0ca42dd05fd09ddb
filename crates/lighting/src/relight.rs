//! Lamps of other strengths, from light that was kept apart lamp by lamp, without a ray.
//!
//! ```text
//! L(f) = sum over lamps e of f_e L_e
//! ```
//!
//! Light is linear in E: the light of every lamp times its factor adds up to that of the dimmed scene, whether it is a
//! power, a picture or the irradiance at a point.
//!
//! The picture's error is that of the parts times their factors ([`LayerError::of_sum`]), as if they were independent.
//!
//! Not handled: errors of powers and of light at points; lamps that turn or move.

use std::collections::BTreeMap;

use glam::DVec3;
use halflight::pictures::{NamedPicture, Picture, Shows, Table};
use halflight::render::{EmitterPower, LayerError, LayerKind};
use serde::{Deserialize, Serialize};

use crate::dimming::dimmed;
use crate::quantity::lux;
use crate::uniformity::Uniformity;

/// The factor of each lamp, channel by channel.
pub type Factors = BTreeMap<String, [f64; 3]>;

/// The light of each lamp of a scene, as it was solved.
#[derive(Default)]
pub struct LampLight {
    powers: Vec<EmitterPower>,
    points: Vec<SolvedPoint>,
    layers: Vec<NamedPicture<Picture>>,
    /// Of the layers, where they are known.
    errors: BTreeMap<String, LayerError>,
}

/// Irradiance at a point by the light of each lamp.
#[derive(Debug, Deserialize)]
pub struct SolvedPoint {
    /// What it is called by.
    pub name: Option<String>,
    /// Where, in the file's units.
    pub position: [f64; 3],
    /// Whether it lies inside of a solid, where nobody measures.
    #[serde(default)]
    pub is_inside: bool,
    /// W/m².
    #[serde(default)]
    pub luminaires: BTreeMap<String, [f64; 3]>,
}

/// What factors on lamps make of their light.
#[derive(Debug, Serialize)]
pub struct Relit {
    /// Of every lamp.
    pub factors: Factors,
    /// Powers with these factors.
    pub luminaires: Vec<EmitterPower>,
    /// Light at points with these factors.
    pub points: Vec<RelitPoint>,
    /// Estimated error of the picture, relative to it; none where those of its layers are not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Root mean square and largest difference to the illuminance wanted, lux.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_over: Option<[f64; 2]>,
}

/// A point with these factors.
#[derive(Debug, Serialize)]
pub struct RelitPoint {
    /// What it is called by.
    pub name: Option<String>,
    /// Where, in the file's units.
    pub position: [f64; 3],
    /// W/m².
    pub irradiance: [f64; 3],
    /// Lux.
    pub illuminance: f64,
    /// Whether it lies inside of a solid, where nobody measures.
    pub is_inside: bool,
    /// Lux.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wanted: Option<f64>,
}

impl LampLight {
    /// Powers, points, and those layers of a picture that are of lamps.
    pub fn new(
        powers: Vec<EmitterPower>,
        points: Vec<SolvedPoint>,
        mut layers: Vec<NamedPicture<Picture>>,
    ) -> LampLight {
        layers.retain(|layer| layer.shows == Shows::Light && LayerKind::emitter(&layer.name).is_some());
        LampLight { powers, points, layers, errors: BTreeMap::new() }
    }

    /// The same with the errors of layers by name, of which those of lamps count.
    pub fn with_errors<'a>(mut self, layers: impl Iterator<Item = (&'a str, LayerError)>) -> LampLight {
        let of_lamp = |(name, error)| LayerKind::emitter(name).map(|lamp| (lamp.to_owned(), error));
        self.errors = layers.filter_map(of_lamp).collect();
        self
    }

    /// The lamps of all that there is.
    pub fn names(&self) -> Vec<String> {
        let of_points = self.points.iter().take(1).flat_map(|point| point.luminaires.keys().cloned());
        let of_layers = self.layers.iter().filter_map(|layer| LayerKind::emitter(&layer.name).map(str::to_owned));
        let mut names: Vec<String> = Vec::new();
        for name in self.powers.iter().map(|own| own.name.clone()).chain(of_points).chain(of_layers) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// The points.
    pub fn points(&self) -> &[SolvedPoint] {
        &self.points
    }

    /// The factors given, and those of all other lamps, from 0 to 1, that light points as nearly as may be with the
    /// illuminance wanted at each, lux.
    pub fn aimed(&self, wanted: &[Option<f64>], given: &Factors) -> Factors {
        let names = self.names();
        let free: Vec<&String> = names.iter().filter(|name| !given.contains_key(*name)).collect();
        let (mut lit, mut goal) = (Vec::new(), Vec::new());
        for (point, wanted) in self.points.iter().zip(wanted).filter_map(|(point, wanted)| Some((point, (*wanted)?))) {
            let of = |name: &String| point.luminaires.get(name).copied().unwrap_or_default();
            let fixed = given.iter().map(|(name, factor)| lux(&times(of(name), *factor))).sum::<f64>();
            lit.push(free.iter().map(|name| lux(&of(name))).collect::<Vec<f64>>());
            goal.push(wanted - fixed);
        }
        let found = dimmed(&lit, &goal).unwrap_or_default();
        let found = free.into_iter().zip(found).map(|(name, factor)| (name.clone(), [factor; 3]));
        given.clone().into_iter().chain(found).collect()
    }

    /// Powers and points with some factors; lamps without one stay as they are.
    pub fn relit(&self, given: &Factors, wanted: Option<&[Option<f64>]>) -> Relit {
        let factor = |name: &str| given.get(name).copied().unwrap_or([1.0; 3]);
        let power = |own: &EmitterPower| EmitterPower {
            name: own.name.clone(),
            emitted: times(own.emitted, factor(&own.name)),
            reflected: times(own.reflected, factor(&own.name)),
        };
        let point = |(k, point): (usize, &SolvedPoint)| {
            let each = point.luminaires.iter().map(|(name, light)| times(*light, factor(name)));
            let irradiance = each.fold([0.0; 3], |sum, light| [0, 1, 2].map(|c| sum[c] + light[c]));
            RelitPoint {
                name: point.name.clone(),
                position: point.position,
                is_inside: point.is_inside,
                irradiance,
                illuminance: lux(&irradiance),
                wanted: wanted.and_then(|wanted| wanted[k]),
            }
        };
        let points: Vec<RelitPoint> = self.points.iter().enumerate().map(point).collect();
        let factors = self.names().into_iter().map(|name| (name.clone(), factor(&name))).collect();
        let luminaires = self.powers.iter().map(power).collect();
        let error = self.error(given);
        Relit { factors, luminaires, left_over: left_over(&points), points, error }
    }

    /// The estimated error of the picture with some factors, each the root mean square of its channels, relative to it;
    /// none where those of its layers are not known.
    pub fn error(&self, given: &Factors) -> Option<f64> {
        let lamps = self.layers.iter().filter_map(|layer| LayerKind::emitter(&layer.name));
        let known: Vec<_> = lamps.map(|lamp| Some((lamp, *self.errors.get(lamp)?))).collect::<Option<_>>()?;
        let factor = |lamp: &str| given.get(lamp).map_or(1.0, |f| (f.iter().map(|c| c * c).sum::<f64>() / 3.0).sqrt());
        (!known.is_empty()).then(|| LayerError::of_sum(known.into_iter().map(|(lamp, error)| (error, factor(lamp)))))
    }

    /// The picture with some factors; none where there are no layers to make it from.
    pub fn picture(&self, given: &Factors) -> Option<Picture> {
        let first = &self.layers.first()?.picture;
        let mut sum = Picture::new(first.width, first.height);
        for NamedPicture { name, picture, .. } in &self.layers {
            let factor = LayerKind::emitter(name).and_then(|lamp| given.get(lamp)).copied().unwrap_or([1.0; 3]);
            let factor = DVec3::from(factor).as_vec3();
            sum.pixels.iter_mut().zip(&picture.pixels).for_each(|(sum, p)| *sum += factor * *p);
        }
        Some(sum)
    }
}

impl Relit {
    /// How evenly illuminance is spread over the points.
    pub fn uniformity(&self) -> Uniformity {
        Uniformity::of(self.points.iter().map(|point| (!point.is_inside).then_some(point.illuminance)))
    }

    /// The table of the points: a row each.
    pub fn table(&self) -> Table {
        let mut table = Table::new("name,x,y,z,irradiance_r,irradiance_g,irradiance_b,illuminance");
        for point in &self.points {
            let name = point.name.clone().unwrap_or_default();
            let ([x, y, z], [r, g, b]) = (point.position, point.irradiance);
            table.row(&[&name, &x, &y, &z, &r, &g, &b, &point.illuminance]);
        }
        table
    }
}

/// Root mean square and largest difference to what is wanted, lux; none where nothing is.
fn left_over(points: &[RelitPoint]) -> Option<[f64; 2]> {
    let apart: Vec<f64> = points.iter().filter_map(|p| Some((p.illuminance - p.wanted?).abs())).collect();
    let rms = (apart.iter().map(|d| d * d).sum::<f64>() / apart.len().max(1) as f64).sqrt();
    (!apart.is_empty()).then(|| [rms, apart.iter().fold(0.0, |most: f64, d| most.max(*d))])
}

fn times(light: [f64; 3], factor: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| light[c] * factor[c])
}
