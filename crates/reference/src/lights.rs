//! Light found on purpose at a vertex of a path: points drawn on emitters, and punctual lights.
//!
//! A face is drawn by its power, then a uniform point of it:
//!
//! ```text
//! density of a point of face f, per area:   p_f = P_f / A_f,   P_f = A_f |E_f| / sum of the same
//! with |E| the sum of channels
//! ```
//!
//! A face that sends from both sides is one face here: a point is lit by the side it sees. Distance and orientation
//! are made up for by the weights against rays that meet emitters by chance; only those meet the sky.
//!
//! Of points, spots and parallel light one is drawn in proportion to what it brings, so its light is divided by its
//! share of the sum. Rays never meet these by chance: they are drawn at every vertex, with or without next events.
//!
//! Not handled: what lies between; the path casts a ray.

use std::f32::consts::PI;

use glam::Vec3;

use crate::random::Random;
use crate::surfaces::{SurfacePoint, Surfaces};
use halflight::light::Rgb;
use halflight::scene::{Beam, PunctualForm, PunctualLight};

/// All faces that emit.
pub(crate) struct Emitters {
    faces: Vec<u32>,
    /// Sum of P up to and including each of `faces`.
    cumulative: Vec<f64>,
    /// p_f of every face of the scene, 0 where it does not emit and for the sky.
    densities: Vec<f32>,
}

/// A point on an emitter.
pub(crate) struct Drawn {
    pub position: Vec3,
    pub face: u32,
    /// Weights of the face's second and third corner.
    pub weights: [f32; 2],
    /// Per area in unit coordinates.
    pub density: f32,
}

impl Emitters {
    /// The faces of a scene that emit.
    pub(crate) fn new(surfaces: &Surfaces) -> Emitters {
        let strength = |face: u32| strength(surfaces, face);
        let faces: Vec<u32> = (0..surfaces.count()).filter(|&face| surfaces.matter(face).emits()).collect();
        let mut densities = vec![0.0; surfaces.faces()];
        let mut sum = 0.0;
        let powers = faces.iter().map(|&face| {
            sum += strength(face) * surfaces.facet(face).area();
            sum
        });
        let mut cumulative: Vec<f64> = powers.collect();
        for &face in &faces {
            densities[face as usize] = (strength(face) / sum) as f32;
        }
        for share in &mut cumulative {
            *share /= sum;
        }
        Emitters { faces, cumulative, densities }
    }

    /// A point; none where nothing emits.
    pub(crate) fn draw(&self, surfaces: &Surfaces, random: &mut Random) -> Option<Drawn> {
        let last = self.faces.len().checked_sub(1)?;
        let share = random.fine();
        let face = self.faces[self.cumulative.partition_point(|&c| c <= share).min(last)];
        let [u, v] = random.triangle();
        Some(Drawn { position: surfaces.facet(face).at(u, v), face, weights: [u, v], density: self.density(face) })
    }

    /// The density at which points of a face are drawn, per area; 0 for the sky.
    #[inline]
    pub(crate) fn density(&self, face: u32) -> f32 {
        self.densities[face as usize]
    }
}

/// |E| of a face: where it has a texture, the mean over some points of it, and at least as much as if one of them were
/// white, for all light may lie between them.
fn strength(surfaces: &Surfaces, face: u32) -> f64 {
    const SIDE: u32 = 16;
    let of = |at: [f32; 2]| {
        let matter = surfaces.matter_at(face, at);
        f64::from(matter.there * matter.emitted.invisible.element_sum())
    };
    if !surfaces.is_textured() {
        return of([0.0; 2]);
    }
    let number = |k: u32| (k as f32 + 0.5) / SIDE as f32;
    let points = (0..SIDE * SIDE).map(|k| (number(k % SIDE), number(k / SIDE)));
    let folded = points.map(|(u, v)| if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] });
    let white = f64::from(surfaces.matter(face).emitted.invisible.element_sum());
    folded.map(of).sum::<f64>().max(white) / f64::from(SIDE * SIDE)
}

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
pub(crate) fn draw_light(lights: &[PunctualLight], point: &SurfacePoint, random: &mut Random) -> Option<Sent> {
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
    let (place, beam) = match &light.form {
        PunctualForm::Directional { direction } => {
            let way = -direction.as_vec3();
            let cosine = point.normal.dot(way);
            let light = light.intensity * (cosine / PI);
            return (cosine > 0.0).then(|| Sent { light, end: point.position + OUTSIDE * way });
        }
        PunctualForm::Point { place, beam } => (place, beam),
    };
    let ray = place.position - point.position.as_dvec3();
    let d2 = ray.length_squared();
    let [a0, a1, a2] = place.attenuation;
    let mut strength = point.normal.as_dvec3().dot(ray) / d2.sqrt() / (a0 + a1 * d2.sqrt() + a2 * d2);
    strength *= match beam {
        Beam::Even => 1.0,
        Beam::Spot { direction, exponent, cutoff } => {
            let off_axis = direction.dot(-ray) / d2.sqrt();
            if off_axis <= 0.0 || off_axis < *cutoff {
                return None;
            }
            off_axis.powf(*exponent)
        }
        Beam::Measured(photometry) => photometry.intensity(-ray / d2.sqrt()),
    };
    let end = place.position.as_vec3();
    let short = SHORT * (point.position - end).normalize_or_zero();
    let light = light.intensity * (strength as f32 / PI);
    (light.max_element() > 0.0).then_some(Sent { light, end: end + short })
}
