//! One sample of a pixel without bias: a path from the camera that reads no patch.
//!
//! ```text
//! sample  =  E_visible + H + rho I(x0)                            at the first surface x0, whatever its tau
//! I(x)    =  D(x) + sum over crossings c of one cosine ray of  T_c (G_c + alpha_c rho_c I(c))
//! ```
//!
//! D is the core's direct light of luminaires and punctual lights, one sample without bias ([`Lights::sample`]): what
//! is known in closed form is subtracted where points are drawn, so that it is a control variate and no reading. H is
//! the highlights of direct light, G what emitters that are no luminaires send, T the product of tau before. The sum is
//! taken over all crossings of a ray for G; a path goes on at one of them, drawn by the largest channel of
//! `T alpha rho` times what the path carries, and plays Russian roulette with that over what it carried at first.
//!
//! The mean over paths is the pixel's mean over its box to rounding, but for textures of luminaires, whose light
//! is known to [`TOLERABLE`](halflight::direct::TOLERABLE), and for paths that [`LONGEST`] ends, which are counted.
//!
//! Sources: docs/theory.md, Direct light; J. Arvo, D. Kirk, *Particle transport and image synthesis*, 1990 (roulette).
//!
//! Not handled: filters other than the box.

use glam::{DVec2, DVec3, Vec2};

use halflight::direct::{Highlights, Lights, Scratch};
use halflight::light::Rgb;
use halflight::pictures::Size;
use halflight::rays::sobol::Stream;
use halflight::rays::warp::cosine_direction;
use halflight::rays::{Hit, Ray};
use halflight::surfaces::SurfacePoint;

/// Reflections of a path at most: with a spectral radius of 0.99 a path in a million is longer than half of it.
pub(crate) const LONGEST: u32 = 4096;

/// What paths run through.
pub(crate) struct Paths<'a> {
    lights: &'a Lights,
    highlights: Option<Highlights<'a>>,
    size: Size,
}

/// The well spread numbers of a path, each in [0, 1): its point in the pixel and its first direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    pub point: Vec2,
    pub direction: Vec2,
}

/// Memory that a thread uses again, and the counts of what it did.
#[derive(Default)]
pub(crate) struct Memory {
    hits: Vec<Hit>,
    /// Crossings that a path may go on at.
    onward: Vec<(Vertex, DVec3)>,
    scratch: Scratch,
    /// Camera rays and rays from surface to surface.
    followed: u64,
    /// Paths that [`LONGEST`] ended.
    pub cut: u64,
}

impl Memory {
    /// Rays cast, to luminaires as well.
    pub(crate) fn rays(&self) -> u64 {
        self.followed + self.scratch.cast
    }
}

/// A point of a reflecting side.
#[derive(Clone, Copy)]
struct Vertex {
    receiver: SurfacePoint,
    patch: u32,
}

impl<'a> Paths<'a> {
    /// Paths for a picture of some size.
    pub(crate) fn new(lights: &'a Lights, size: Size) -> Paths<'a> {
        Paths { lights, highlights: Highlights::new(lights), size }
    }

    /// The ray from the camera through a point of pixel k, in the unit square from its upper left corner.
    fn camera_ray(&self, k: usize, point: Vec2) -> Ray {
        let Size { width, height } = self.size;
        let x = ((k % width) as f32 + point.x) / width as f32;
        let y = ((k / width) as f32 + point.y) / height as f32;
        let (origin, direction) = self.lights.geometry.scene.camera.ray(x, y, width as f32 / height as f32);
        Ray { origin, direction, source: None }
    }

    /// Whether the camera sees a luminaire or another emitter through a point of pixel k.
    pub(crate) fn sees_emission(&self, k: usize, point: Vec2) -> bool {
        let (ray, geometry) = (self.camera_ray(k, point), &self.lights.geometry);
        let hit = geometry.rays.closest(&ray);
        let met = hit.and_then(|hit| Some((hit, self.vertex(&ray, &hit)?)));
        met.is_some_and(|(hit, _)| geometry.scene.material(hit.face).emits())
    }

    /// A sample of pixel k, W/(m² sr).
    pub(crate) fn sample(&self, k: usize, start: Start, random: &mut Stream, memory: &mut Memory) -> DVec3 {
        let ray = self.camera_ray(k, start.point);
        let scene = &self.lights.geometry.scene;
        memory.followed += 1;
        let hit = self.lights.geometry.rays.closest(&ray);
        let Some((face, seen)) = hit.and_then(|hit| Some((hit.face, self.vertex(&ray, &hit)?))) else {
            return DVec3::ZERO;
        };
        let position = seen.receiver.position;
        let shown = scene.emitted_at(face, position).visible.as_dvec3() + self.highlight(&seen, random, memory);
        let rho = scene.rho_at(face, position);
        if rho == Rgb::ZERO { shown } else { shown + self.reflected(seen, rho.as_dvec3(), start, random, memory) }
    }

    /// Highlights of direct light at the point that the camera sees.
    fn highlight(&self, seen: &Vertex, random: &mut Stream, memory: &mut Memory) -> DVec3 {
        let material = self.lights.geometry.scene.material(seen.receiver.face);
        let (Some(highlights), Some(gloss)) = (&self.highlights, material.gloss) else { return DVec3::ZERO };
        let mut sum = DVec3::ZERO;
        let mut at = || DVec2::new(random.uniform().into(), random.uniform().into());
        let draws = [at(), at()];
        highlights.gather(&seen.receiver, gloss, draws, &mut memory.scratch, |_, light| sum += light);
        sum
    }

    /// What a surface reflects by `weight`: direct light, and a path.
    fn reflected(
        &self,
        mut at: Vertex,
        mut weight: DVec3,
        start: Start,
        random: &mut Stream,
        memory: &mut Memory,
    ) -> DVec3 {
        let (mut sum, most) = (DVec3::ZERO, weight.max_element());
        let mut toward = start.direction;
        for _ in 0..LONGEST {
            sum += weight * self.lights.sample(&at.receiver, at.patch, random, &mut memory.scratch);
            sum += weight * self.cast(&at, weight, toward, memory);
            let Some((next, onward)) = drawn(&memory.onward, random.uniform()) else { return sum };
            let chance = (onward.max_element() / most).min(1.0);
            if f64::from(random.uniform()) >= chance {
                return sum;
            }
            (at, weight) = (next, onward / chance);
            toward = Vec2::new(random.uniform(), random.uniform());
        }
        memory.cut += 1;
        sum
    }

    /// Light along one cosine-distributed ray of emitters that are no luminaires; what the path may go on at, with what
    /// it then carries, is left in the memory.
    fn cast(&self, at: &Vertex, weight: DVec3, toward: Vec2, memory: &mut Memory) -> DVec3 {
        let Lights { geometry, luminaires, transports, opaque, .. } = self.lights;
        let SurfacePoint { position, normal, face } = at.receiver;
        let ray = Ray { origin: position, direction: cosine_direction(normal, toward.x, toward.y), source: Some(face) };
        memory.followed += 1;
        memory.onward.clear();
        geometry.rays.light_crossings(&ray, *opaque, &mut memory.hits);
        let (mut sum, onward) = (DVec3::ZERO, &mut memory.onward);
        geometry.rays.transmit(
            &memory.hits,
            |m| transports[m].tau,
            |hit, through| {
                let Some(vertex) = self.vertex(&ray, hit) else { return };
                let (m, through) = (geometry.rays.material(hit.face), f64::from(through));
                if geometry.scene.materials[m].emits() && !luminaires.carries[m] {
                    sum += through * geometry.scene.emitted_at(hit.face, vertex.receiver.position).invisible.as_dvec3();
                }
                let rho = geometry.scene.rho_at(hit.face, vertex.receiver.position).as_dvec3();
                let carried = weight * rho * (through * f64::from(transports[m].alpha));
                if carried.max_element() > 0.0 {
                    onward.push((vertex, carried));
                }
            },
        );
        sum
    }

    /// The point where a ray meets a side that reflects; none on a black back.
    #[inline]
    fn vertex(&self, ray: &Ray, hit: &Hit) -> Option<Vertex> {
        let Lights { geometry, patches, .. } = self.lights;
        let normal = patches.normal(hit.face, hit.side);
        let position = ray.at(hit.t);
        // Put exactly into the face's plane.
        let position = position - (position - geometry.scene.corners(hit.face)[0]).dot(normal) * normal;
        let patch = patches.at(hit.face, hit.side, position)?;
        Some(Vertex { receiver: SurfacePoint { position, normal, face: hit.face }, patch })
    }
}

/// One of several vertices, drawn by the largest channel of what the path carries there, with that over its
/// probability.
fn drawn(onward: &[(Vertex, DVec3)], u: f32) -> Option<(Vertex, DVec3)> {
    let total: f64 = onward.iter().map(|(_, carried)| carried.max_element()).sum();
    let mut rest = f64::from(u) * total;
    let chosen = onward.iter().find(|(_, carried)| {
        rest -= carried.max_element();
        rest < 0.0
    });
    let (vertex, carried) = chosen.or(onward.last())?;
    Some((*vertex, *carried * (total / carried.max_element())))
}
