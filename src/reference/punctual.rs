//! Light that points, spots and parallel light send to a vertex of a path, nothing between.
//!
//! One light is drawn in proportion to what it brings, so its answer is divided by its share of the sum. Rays never
//! meet these lights by chance: they are asked for at every vertex, whether or not next events are.
//!
//! Not handled: what lies between; the path asks.

use std::f32::consts::PI;

use glam::Vec3;

use crate::light::Rgb;
use crate::reference::random::Random;
use crate::reference::surfaces::SurfacePoint;
use crate::scene::{PunctualForm, PunctualLight};

/// Further away than any two points of unit coordinates are from each other.
const OUTSIDE: f32 = 4.0;
/// A light that lies in a surface is not hidden by it: rays end so far before it.
const SHORT: f32 = 1e-5;

/// What a light sends to a vertex.
pub(crate) struct Sent {
    /// Irradiance over pi.
    pub light: Rgb,
    /// Where a visibility ray to the light ends.
    pub end: Vec3,
}

/// One light drawn at a vertex; none where nothing falls on it.
pub(crate) fn drawn(lights: &[PunctualLight], point: &SurfacePoint, random: &mut Random) -> Option<Sent> {
    let mut sum = 0.0;
    let mut chosen = None;
    for found in lights.iter().filter_map(|light| sent(light, point)) {
        let own = found.light.max_element();
        sum += own;
        if own == sum || random.uniform() * sum < own {
            chosen = Some((found, own));
        }
    }
    let (found, own) = chosen?;
    Some(Sent { light: found.light * (sum / own), ..found })
}

/// What one light sends; none where the vertex faces away or lies outside its cone.
pub(super) fn sent(light: &PunctualLight, point: &SurfacePoint) -> Option<Sent> {
    let spot = match light.form {
        PunctualForm::Directional { direction } => {
            let way = -direction.as_vec3();
            let cosine = point.normal.dot(way);
            let light = light.intensity * (cosine / PI);
            return (cosine > 0.0).then(|| Sent { light, end: point.position + OUTSIDE * way });
        }
        PunctualForm::Point(place) => (place, None),
        PunctualForm::Spot { place, direction, exponent, cutoff } => (place, Some((direction, exponent, cutoff))),
    };
    let (place, cone) = spot;
    let ray = place.position - point.position.as_dvec3();
    let d2 = ray.length_squared();
    let [a0, a1, a2] = place.attenuation;
    let mut strength = point.normal.as_dvec3().dot(ray) / d2.sqrt() / (a0 + a1 * d2.sqrt() + a2 * d2);
    if let Some((axis, exponent, cutoff)) = cone {
        let off_axis = axis.dot(-ray) / d2.sqrt();
        if off_axis <= 0.0 || off_axis < cutoff {
            return None;
        }
        strength *= off_axis.powf(exponent);
    }
    let end = place.position.as_vec3();
    let short = SHORT * (point.position - end).normalize_or_zero();
    let light = light.intensity * (strength as f32 / PI);
    (light.max_element() > 0.0).then_some(Sent { light, end: end + short })
}
