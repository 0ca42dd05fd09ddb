//! Highlights: Phong's specular term of direct light, at the points that camera rays see.
//!
//! ```text
//! H(x) = Ks/pi integral of  L(l) T(x, l) (n·h)^Ns  over directions l with n·l > 0,     h between l and the viewer
//! ```
//!
//! L is light as emitted, by luminaires, other emitters and the sky; T the product of tau of what is crossed before.
//! Punctual lights enter by closed form times visibility. All other light is sampled by two techniques: a point on
//! a luminaire, chosen by power and uniform in area, and a direction drawn from the lobe, which also meets emitters
//! that are no luminaires. Both are weighted by the power heuristic (E. Veach, *Robust Monte Carlo methods for light
//! transport simulation*, 1997), for small luminaires and narrow lobes alike.
//!
//! Not handled: highlights of light that was reflected before; drawing among many luminaires by their distance.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::direct::drawn_light::Scratch;
use crate::direct::emitters::luminaire::Luminaire;
use crate::direct::lights::Lights;
use crate::light::Gloss;
use crate::light::shares::Shares;
use crate::rays::{Ray, Side};
use crate::scene::Sides;
use crate::surfaces::{Geometry, SurfacePoint};

/// Samples highlights.
pub struct Highlights<'a> {
    lights: &'a Lights,
    /// Shares of the luminaires in all power: area times radiance, channels added.
    shares: Shares,
    /// All of that power.
    power: f64,
    /// Some face emits.
    emits: bool,
}

/// A point that shows highlights.
struct Shown<'a> {
    receiver: &'a SurfacePoint,
    position: DVec3,
    normal: DVec3,
    /// Unit vector to the viewer.
    to_viewer: DVec3,
    gloss: Gloss,
}

impl Shown<'_> {
    fn lobe(&self, to_light: DVec3) -> f64 {
        self.gloss.lobe(self.normal, to_light, self.to_viewer)
    }

    fn density(&self, to_light: DVec3) -> f64 {
        self.gloss.density(self.normal, to_light, self.to_viewer)
    }
}

impl<'a> Highlights<'a> {
    /// For the materials of a scene; none where none is glossy.
    pub fn new(lights: &'a Lights) -> Option<Highlights<'a>> {
        let materials = &lights.geometry.scene.materials;
        materials.iter().find(|m| m.gloss.is_some())?;
        let power = |l: &Luminaire| l.area * f64::from(l.radiance.element_sum());
        let powers = Shares::of(lights.luminaires.list.iter().map(power));
        Some(Highlights {
            lights,
            power: powers.total(),
            shares: powers.normalised(),
            emits: materials.iter().any(|m| m.emits()),
        })
    }

    /// Calls `each` with the emitters' parts of H at a point, W/(m² sr), from one draw of each kind, points of the unit
    /// square.
    pub fn gather(
        &self,
        receiver: &SurfacePoint,
        gloss: Gloss,
        draws: [DVec2; 2],
        memory: &mut Scratch,
        mut each: impl FnMut(usize, DVec3),
    ) {
        let position = receiver.position.as_dvec3();
        let to_viewer = (self.lights.geometry.scene.camera.position.as_dvec3() - position).normalize_or_zero();
        let shown = Shown { receiver, position, normal: receiver.normal.as_dvec3(), to_viewer, gloss };
        let specular = gloss.specular.as_dvec3();
        let lobe = |to_light| shown.lobe(to_light);
        self.lights.gather_weighted(receiver, lobe, memory, |emitter, light| each(emitter, specular * light));
        if self.emits {
            let (emitter, light) = self.drawn(&shown, draws[0], memory);
            each(emitter, specular * light / PI);
            self.met(&shown, draws[1], memory, |emitter, light| each(emitter, specular * light / PI));
            memory.cast += 1;
        }
    }

    /// Density per area at which points of a luminaire of that radiance are drawn.
    fn density(&self, radiance: DVec3) -> f64 {
        radiance.element_sum() / self.power
    }

    /// Light over Ks/pi of a point drawn on a luminaire, over its density, and the emitter.
    fn drawn(&self, shown: &Shown, at: DVec2, memory: &mut Scratch) -> (usize, DVec3) {
        if self.lights.luminaires.list.is_empty() {
            return (0, DVec3::ZERO);
        }
        let drawn = self.shares.draw(at.x);
        let luminaire = &self.lights.luminaires.list[drawn.index];
        let y = luminaire.point(drawn.again(), at.y as f32);
        let across = y.position.as_dvec3() - shown.position;
        let (d2, way) = (across.length_squared(), across.normalize_or_zero());
        let per_area = -y.normal.dot(way) / d2;
        let lobe = shown.lobe(way);
        // NaN where the two points are one.
        if !(per_area > 0.0 && lobe > 0.0) {
            return (luminaire.emitter, DVec3::ZERO);
        }
        let arrived = self.lights.transmittance(shown.receiver, y.end(), memory);
        let radiance = luminaire.radiance.as_dvec3();
        let own = self.density(radiance);
        let weight = power_heuristic(own, shown.density(way) * per_area);
        (luminaire.emitter, radiance * y.share * (lobe * per_area / own * weight * arrived))
    }

    /// Calls `each` with light over Ks/pi along a ray drawn from the lobe, over its density.
    fn met(&self, shown: &Shown, at: DVec2, memory: &mut Scratch, mut each: impl FnMut(usize, DVec3)) {
        let Some(way) = shown.gloss.direction(shown.normal, shown.to_viewer, at) else { return };
        let Lights { luminaires, transports, .. } = self.lights;
        let Geometry { scene, rays, .. } = &*self.lights.geometry;
        let direction = way.as_vec3();
        let ray = Ray { origin: shown.receiver.position, direction, source: Some(shown.receiver.face) };
        let density = shown.density(way);
        // NaN where the density of the lobe underflows.
        if density.is_nan() || density <= 0.0 {
            return;
        }
        let share = shown.lobe(way) / density;
        rays.light_crossings(&ray, self.lights.opaque, &mut memory.hits);
        rays.transmit(
            &memory.hits,
            |m| f64::from(transports[m].tau),
            |hit, through| {
                let index = rays.material(hit.face);
                let material = &scene.materials[index];
                if !material.emits() || hit.side == Side::Back && material.sides == Sides::One {
                    return;
                }
                let radiance = scene.emitted_at(hit.face, ray.at(hit.t)).invisible.as_dvec3();
                let other = if luminaires.carries[index] {
                    let [a, b, c] = scene.corners(hit.face).map(|p| p.as_dvec3());
                    let facing = (b - a).cross(c - a).normalize().dot(way).abs();
                    let mean = luminaires.radiances[index].as_dvec3();
                    self.density(mean) * f64::from(hit.t).powi(2) / facing
                } else {
                    0.0
                };
                let emitter = luminaires.emitters.of_face(scene, hit.face);
                each(emitter, radiance * (share * through * power_heuristic(density, other)));
            },
        );
    }
}

/// Weight of a sample of density `own` that another technique has with density `other`.
fn power_heuristic(own: f64, other: f64) -> f64 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}
