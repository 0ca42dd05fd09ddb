//! Where walks of light start: sides of faces that emit, the sky, and punctual lights, each by its power.
//!
//! A start is a point of an emitting side, drawn evenly, and a cosine-distributed direction; a point of the sphere
//! around the scene, where light of the sky enters it; or a punctual light. One of radiant intensity I has the power
//! `integral of I dω`; where it attenuates otherwise than by the square of the distance, the power of a walk depends on
//! its length: `I d² / (a0 + a1 d + a2 d²)` to the solid angle. Parallel light starts from a disc that shades the whole
//! scene. Source: J. Arvo, D. Kirk, *Particle transport and image synthesis*, 1990.
//!
//! Not handled: where of an emitting face with a texture its light comes from; all of its points are drawn alike, and
//! carry what they emit.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use crate::light::shares::Shares;
use crate::rays::sobol::Stream;
use crate::rays::warp::{cosine_direction, hemisphere_direction, triangle_point};
use crate::rays::{Ray, Side};
use crate::scene::{Beam, Emitters, PunctualForm, PunctualLight, PunctualPlace, Scene, Sides};

/// All sources that walks start from.
pub(crate) struct WalkSources<'a> {
    scene: &'a Scene,
    list: Vec<Source<'a>>,
    /// By emitted power.
    shares: Shares,
    /// Radius of the ball about the middle of the unit frame that holds the scene, unit coordinates.
    radius: f64,
    /// The emitted power of all, channels added, W.
    total: f64,
}

struct Source<'a> {
    origin: Origin<'a>,
    emitter: usize,
    /// Emitted, channels added, W.
    power: f64,
    /// What a walk from here carries.
    weight: DVec3,
}

#[derive(Clone, Copy)]
enum Origin<'a> {
    /// A side of a face.
    Side(u32, Side),
    /// A punctual light.
    Light(&'a PunctualLight),
}

/// The first ray of a walk.
pub(crate) struct FirstRay<'a> {
    pub ray: Ray,
    /// The power it stands for, W; that of unit distance where it depends on that.
    pub weight: DVec3,
    /// Where it comes from a point.
    place: Option<(&'a PunctualPlace, f64)>,
    /// What sends it.
    pub emitter: usize,
    /// The face it comes from, of a sky's those that stand for it; none where it comes from a punctual light.
    pub face: Option<u32>,
}

impl FirstRay<'_> {
    /// The power that arrives so far away, W, nothing between.
    pub(crate) fn power(&self, distance: f64) -> DVec3 {
        match self.place {
            Some((place, scale)) => self.weight * spread(place, scale, distance),
            None => self.weight,
        }
    }
}

/// `d² / (a0 + a1 d + a2 d²)`, d² in the file's units: 1 for physical attenuation.
fn spread(place: &PunctualPlace, scale: f64, distance: f64) -> f64 {
    (scale * distance).powi(2) / place.weakening(distance)
}

impl<'a> WalkSources<'a> {
    /// The emitting sides of a scene and its punctual lights, with the chance of each in proportion to its power,
    /// channels added.
    pub(crate) fn new(scene: &'a Scene, emitters: &Emitters) -> WalkSources<'a> {
        let far = |radius: f64, v: &Vec3| radius.max(v.as_dvec3().length());
        // The faces that stand for a sky lie beyond the scene.
        let radius = scene.sky.as_ref().map_or_else(|| scene.vertices.iter().fold(0.0, far), |sky| sky.radius);
        let mut sources = WalkSources { scene, list: Vec::new(), shares: Shares::default(), radius, total: 0.0 };
        for face in 0..scene.faces.len() as u32 {
            let material = scene.material(face);
            let emission = match &material.maps {
                None => material.emitted().invisible.as_dvec3(),
                Some(_) => scene.means(face, scene.corners(face)).emission,
            };
            let sides: &[Side] = if material.sides == Sides::Two { &[Side::Front, Side::Back] } else { &[Side::Front] };
            let unit = scene.frame.in_metres().powi(2);
            let power = PI * unit * scene.emitting_area(face) * emission.element_sum();
            for &side in sides.iter().filter(|_| power > 0.0) {
                let weight = emission / emission.element_sum();
                let (origin, emitter) = (Origin::Side(face, side), emitters.of_face(scene, face));
                sources.list.push(Source { origin, emitter, power, weight });
            }
        }
        for (k, light) in scene.lights.iter().enumerate().filter(|(_, light)| light.shines()) {
            let intensity = light.intensity.as_dvec3();
            let (size, at_unit) = sources.sizes(light);
            let power = size * at_unit * intensity.element_sum();
            let weight = intensity / (intensity.element_sum() * at_unit);
            let (origin, emitter) = (Origin::Light(light), emitters.of_light(k));
            sources.list.push(Source { origin, emitter, power, weight });
        }
        let shares = Shares::of(sources.list.iter().map(|source| source.power));
        sources.total = shares.total();
        sources.shares = shares.normalised();
        sources.list.iter_mut().for_each(|source| source.weight *= sources.total);
        sources
    }

    /// Solid angle that a light shines into, weighted by its cosine to the exponent, and its spread at unit distance;
    /// for parallel light the area of the disc and 1.
    fn sizes(&self, light: &PunctualLight) -> (f64, f64) {
        let scale = self.scene.frame.in_metres();
        let PunctualForm::Point { place, beam } = &light.form else {
            return (PI * (scale * self.radius).powi(2), 1.0);
        };
        let angle = match beam {
            Beam::Even => 2.0 * TAU,
            Beam::Spot { exponent, cutoff, .. } => TAU * (1.0 - cutoff.powf(exponent + 1.0)) / (exponent + 1.0),
            Beam::Measured(photometry) => photometry.power(),
        };
        (angle, spread(place, scale, 1.0))
    }

    /// A ray that leaves a source, and the power it stands for; none where nothing emits.
    pub(crate) fn start(&self, random: &mut Stream) -> Option<FirstRay<'a>> {
        if self.list.is_empty() {
            return None;
        }
        let source = &self.list[self.shares.draw(f64::from(random.uniform())).index];
        let (weight, emitter) = (source.weight, source.emitter);
        let light = match source.origin {
            Origin::Light(light) => light,
            Origin::Side(face, _) if self.scene.is_sky(face) => {
                let ray = self.enter(face, random)?;
                return Some(FirstRay { ray, weight, place: None, emitter, face: Some(face) });
            }
            Origin::Side(face, side) => {
                let position = triangle_point(self.scene.corners(face), random.uniform(), random.uniform());
                let weight = self.textured(face, position).unwrap_or(source.weight);
                return Some(FirstRay {
                    ray: leave(self.scene, position, face, side, random),
                    weight,
                    place: None,
                    emitter,
                    face: Some(face),
                });
            }
        };
        let (u, v) = (f64::from(random.uniform()), f64::from(random.uniform()));
        let ray = |origin: DVec3, direction: DVec3| Ray {
            origin: origin.as_vec3(),
            direction: direction.as_vec3(),
            source: None,
        };
        let scale = self.scene.frame.in_metres();
        let (place, beam) = match &light.form {
            PunctualForm::Point { place, beam } => (place, beam),
            PunctualForm::Directional { direction } => {
                let aside = self.radius * u.sqrt() * around(*direction, 0.0, v);
                let ray = ray(aside - 2.0 * self.radius * *direction, *direction);
                return Some(FirstRay { ray, weight, place: None, emitter, face: None });
            }
        };
        let (direction, share) = match beam {
            Beam::Even => (around(DVec3::Z, 1.0 - 2.0 * u, v), 1.0),
            Beam::Spot { direction, exponent, cutoff } => {
                let power = exponent + 1.0;
                let cosine = (1.0 - u * (1.0 - cutoff.powf(power))).powf(1.0 / power);
                (around(*direction, cosine, v), 1.0)
            }
            Beam::Measured(photometry) => {
                let drawn = photometry.draw(u, v);
                (drawn.direction, drawn.weight)
            }
        };
        let ray = ray(place.position, direction);
        Some(FirstRay { ray, weight: weight * share, place: Some((place, scale)), emitter, face: None })
    }

    /// What a walk carries from a point of a face with textures, whose points are drawn alike.
    fn textured(&self, face: u32, position: Vec3) -> Option<DVec3> {
        self.scene.maps(face)?;
        let there = f64::from(self.scene.coverage_at(face, position));
        let own = there * self.scene.emitted_at(face, position).invisible.as_dvec3();
        Some(self.total / self.scene.means(face, self.scene.corners(face)).emission.element_sum() * own)
    }

    /// A ray that enters the sphere around the scene from a cell of the sky: of uniform direction, through a uniform
    /// point of the sphere's cross-section.
    fn enter(&self, face: u32, random: &mut Stream) -> Option<Ray> {
        let sky = self.scene.sky.as_ref()?;
        let (u, v) = (random.uniform(), random.uniform());
        let outward = match sky.cap(face) {
            Some((pole, least)) => hemisphere_direction(pole, u, least + (1.0 - least) * v),
            None => sky.within(face, u, v),
        };
        let aside = cosine_direction(outward, random.uniform(), random.uniform());
        let origin = sky.radius as f32 * (outward + aside - aside.dot(outward) * outward);
        Some(Ray { origin, direction: -outward, source: None })
    }
}

/// The unit vector of this cosine to an axis, turned about it by the share `turn` of a full turn.
fn around(axis: DVec3, cosine: f64, turn: f64) -> DVec3 {
    let (a, b) = axis.any_orthonormal_pair();
    let (sin, cos) = (TAU * turn).sin_cos();
    axis * cosine + (a * cos + b * sin) * (1.0 - cosine * cosine).max(0.0).sqrt()
}

/// A cosine-distributed ray from a point of a side.
pub(crate) fn leave(scene: &Scene, origin: Vec3, face: u32, side: Side, random: &mut Stream) -> Ray {
    let [a, b, c] = scene.exact_corners(face);
    let front = (b - a).cross(c - a).normalize().as_vec3();
    let normal = if side == Side::Front { front } else { -front };
    Ray { origin, direction: cosine_direction(normal, random.uniform(), random.uniform()), source: Some(face) }
}
