//! Reflection along rays: what a ray meets, what leaves the surface there, and rays that go on before they read the
//! light of patches, where that is too near or too coarse.
//!
//! Not handled: bounces of fields that are not the picture's taken apart.

use glam::{DVec3, Vec3};
use smallvec::SmallVec;

use crate::direct::Scratch;
use crate::light::Rgb;
use crate::patches::Patches;
use crate::rays::sobol::Stream;
use crate::rays::warp::cosine_direction;
use crate::rays::{Fan, Hit, Ray, Side};
use crate::reading::patch_light::Fields;
use crate::reading::view::View;

/// Width at distance 1 of the cone over which a ray that reads light of a patch sees its texture: one of a few hundred
/// over the hemisphere.
const READ: f64 = 0.125;

/// A point of a reflecting side that a ray met.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceHit {
    pub face: u32,
    /// The patch that it lies on, among those of the view that the ray was followed in.
    pub patch: u32,
    pub side: Side,
    pub position: Vec3,
    /// The product of tau before it.
    pub through: f32,
    /// Length of the ray that met it.
    pub distance: f32,
    /// Reflectance within the ray's cone; none where the patch's mean is taken.
    pub read: Option<Rgb>,
}

impl SurfaceHit {
    /// Light as the ray reads it here over that of the patch: near surfaces show texels, far ones their mean.
    #[inline]
    pub(crate) fn over_patch(&self, patches: &Patches, patch: u32) -> Rgb {
        self.read.map_or(Rgb::ONE, |rho| patches.over_mean(patch as usize, rho))
    }
}

/// The points that a ray meets; one, unless something is transparent.
pub(crate) type Met = SmallVec<[SurfaceHit; 1]>;

/// A sample of what leaves a point of a surface.
#[derive(Clone, Debug)]
pub(crate) struct Reflection {
    /// Reflected direct light of luminaires, `alpha rho D`.
    pub direct: DVec3,
    /// Emission of a surface that is no luminaire.
    pub glow: DVec3,
    /// `rho` within the ray's cone.
    pub rho: DVec3,
    /// `alpha rho`.
    pub reflect: DVec3,
    /// What the next rays meet.
    pub next: Met,
}

impl Reflection {
    /// What leaves the point when `incident` arrives along the next rays in addition to direct light.
    pub(crate) fn light(&self, incident: DVec3) -> DVec3 {
        self.glow + self.direct + self.reflect * incident
    }
}

/// Memory that one thread uses again from ray to ray.
#[derive(Default)]
pub(crate) struct Memory {
    pub hits: Vec<Hit>,
    pub met: Vec<SurfaceHit>,
    /// What a ray read, field by field.
    pub read: Vec<DVec3>,
    /// Also counts the rays cast.
    pub scratch: Scratch,
}

/// Follows light through a scene.
#[derive(Clone)]
pub(crate) struct Walker<'a> {
    pub view: &'a View<'a>,
    /// Width at distance 1 of the cone over which a ray sees the mean of a texture.
    cone: f64,
    /// Some surface has a texture.
    textured: bool,
}

impl<'a> Walker<'a> {
    pub(crate) fn new(view: &'a View<'a>) -> Walker<'a> {
        Walker { view, cone: 0.0, textured: view.scene.is_textured() }
    }

    /// This walker, its rays seeing means of textures over a cone so wide at distance 1.
    pub(crate) fn with_cone(self, cone: f64) -> Walker<'a> {
        Walker { cone, ..self }
    }

    /// Reflectance within the cone of a ray that reads light at a distance; none without texture, with a mask, and on a
    /// surface that glows, whose light is not proportional to its reflectance.
    #[inline]
    pub(crate) fn read_reflectance(&self, face: u32, position: Vec3, distance: f32) -> Option<Rgb> {
        if !self.textured || self.glows(face) {
            return None;
        }
        self.view.scene.whole_texture(face)?;
        Some(self.view.scene.rho_about(face, position, READ * f64::from(distance)))
    }

    /// Whether a face emits without being a luminaire.
    fn glows(&self, face: u32) -> bool {
        let material = self.view.scene.faces[face as usize].material as usize;
        self.view.scene.materials[material].emits() && !self.view.lights.luminaires.carries[material]
    }

    /// `rho` of the point met, a mean over a cone that is so wide at distance 1.
    pub(crate) fn rho_within(&self, at: &SurfaceHit, cone: f64) -> DVec3 {
        self.view.scene.rho_about(at.face, at.position, cone * f64::from(at.distance)).as_dvec3()
    }

    /// `alpha rho D` and the light emitted at a point; `alpha rho`.
    pub(crate) fn direct(&self, at: &SurfaceHit, random: &mut Stream, memory: &mut Memory) -> Reflection {
        self.direct_each(at, random, memory, |_, _| ())
    }

    /// `alpha rho D` and the light emitted at a point; `alpha rho`. Calls `each` with the emitters' parts of the first.
    pub(crate) fn direct_each(
        &self,
        at: &SurfaceHit,
        random: &mut Stream,
        memory: &mut Memory,
        mut each: impl FnMut(usize, DVec3),
    ) -> Reflection {
        let view = self.view;
        let index = view.scene.faces[at.face as usize].material as usize;
        let luminaire = view.lights.luminaires.carries[index];
        let width = self.cone * f64::from(at.distance);
        let emitted = || view.scene.emitted_about(at.face, at.position, width).invisible.as_dvec3();
        let glow = if luminaire { DVec3::ZERO } else { emitted() };
        let rho = self.rho_within(at, self.cone);
        let reflect = f64::from(view.lights.transports[index].alpha) * rho;
        let mut direct = DVec3::ZERO;
        if reflect != DVec3::ZERO {
            let receiver = view.surface_point(at.face, at.side, at.position);
            view.lights.sample_each((&receiver, at.patch), random, &mut memory.scratch, |emitter, light| {
                direct += reflect * light;
                each(emitter, reflect * light);
            });
        }
        Reflection { direct, glow, rho, reflect, next: Met::new() }
    }

    /// All that one cosine-distributed ray meets and sees light from.
    pub(crate) fn bounce(&self, at: &SurfaceHit, random: &mut Stream, memory: &mut Memory) -> Met {
        let normal = self.view.patches.normal(at.face, at.side);
        let direction = cosine_direction(normal, random.uniform(), random.uniform());
        let ray = Ray { origin: at.position, direction, source: Some(at.face) };
        let mut met = Met::new();
        self.follow(&ray, memory, |m| met.push(m));
        met
    }

    /// All that the first `count` rays of a fan meet and see light from, each weighted by `1 / count`.
    pub(crate) fn bounce_all(&self, at: &SurfaceHit, fan: &Fan, count: usize, memory: &mut Memory) -> Met {
        let normal = self.view.patches.normal(at.face, at.side);
        let part = 1.0 / count as f32;
        let mut met = Met::with_capacity(count);
        for k in 0..count {
            let ray = Ray { origin: at.position, direction: fan.direction(k, normal), source: Some(at.face) };
            self.follow(&ray, memory, |m| met.push(SurfaceHit { through: part * m.through, ..m }));
        }
        met
    }

    /// Calls `meet` for all points of reflecting sides that a ray sees light from; returns the inverse distance to the
    /// first face.
    pub(crate) fn follow(&self, ray: &Ray, memory: &mut Memory, mut meet: impl FnMut(SurfaceHit)) -> f64 {
        memory.scratch.cast += 1;
        self.each(ray, &mut memory.hits, |hit, through| {
            if let Some(at) = self.met(ray, hit, through) {
                meet(at);
            }
        })
    }

    /// Calls `meet(hit, through)` for every face that light comes through from along a ray, `through` being the product
    /// of tau before it; returns the inverse distance to the first, 0 where there is none.
    #[inline(always)]
    pub(crate) fn each(&self, ray: &Ray, hits: &mut Vec<Hit>, meet: impl FnMut(&Hit, f32)) -> f64 {
        let view = self.view;
        view.rays.light_crossings(ray, view.lights.opaque, hits);
        view.rays.transmit(hits, |m| view.lights.transports[m].tau, meet);
        hits.first().map_or(0.0, |hit| 1.0 / f64::from(hit.t))
    }

    /// The point where a ray meets a face; none on a black back, which has no patch.
    pub(crate) fn met(&self, ray: &Ray, hit: &Hit, through: f32) -> Option<SurfaceHit> {
        let position = self.view.met_at(ray, hit);
        let patch = self.view.patches.at(hit.face, hit.side, position)?;
        let read = self.read_reflectance(hit.face, position, hit.t);
        Some(SurfaceHit { face: hit.face, patch, side: hit.side, position, through, distance: hit.t, read })
    }
}

/// Rays in sequence at most before one reads, however near what they meet is.
pub(crate) const MOST_BOUNCES: u32 = 16;

/// A sample by one ray.
pub(crate) struct RaySample {
    /// Inverse distance to the first face that it met.
    pub nearness: f64,
    /// Light of the first field.
    pub light: DVec3,
}

/// A walk from where a ray began to a point that it met.
#[derive(Clone, Copy)]
struct Walk {
    /// What light at the point counts: transmittance times all reflectances before.
    weight: DVec3,
    /// Reflections before.
    reflections: usize,
    /// Rays that may follow before light is read however near what is met.
    most: u32,
}

impl Walk {
    fn through(self, at: f32) -> Walk {
        Walk { weight: f64::from(at) * self.weight, ..self }
    }

    /// The walk after one more reflection.
    fn reflected(self, reflect: DVec3) -> Walk {
        Walk { weight: self.weight * reflect, reflections: self.reflections + 1, most: self.most - 1 }
    }
}

/// Follows rays until they read the fields.
pub(crate) struct Continuation<'a> {
    pub walker: Walker<'a>,
    pub fields: &'a Fields,
}

impl Continuation<'_> {
    /// The sample of a ray that may go on before it reads; `seed` is that of its random numbers. Most rays read what
    /// they meet at once. What it read of every field is in the memory.
    pub(crate) fn read(&self, ray: &Ray, seed: u32, memory: &mut Memory) -> RaySample {
        let mut met = std::mem::take(&mut memory.met);
        let mut read = std::mem::take(&mut memory.read);
        met.clear();
        read.clear();
        read.resize(self.fields.count(), DVec3::ZERO);
        let walk = Walk { weight: DVec3::ONE, reflections: 0, most: MOST_BOUNCES };
        let nearness = self.walker.follow(ray, memory, |m| {
            if self.ends(&m, walk.most) {
                self.read_patch(&m, walk.through(m.through), &mut read);
            } else {
                met.push(m);
            }
        });
        if !met.is_empty() {
            self.incident(&met, walk, &mut Stream::new(seed), memory, &mut read);
        }
        let light = read[0];
        (memory.met, memory.read) = (met, read);
        RaySample { nearness, light }
    }

    /// Adds what arrives along one ray from all that it met.
    ///
    /// Light is read at every point that ends the ray. Of the points that the ray goes on from one is drawn by
    /// transmittance: with tau > 0 a ray meets many, and continuing from each would double the rays with every bounce.
    fn incident(&self, met: &[SurfaceHit], walk: Walk, random: &mut Stream, memory: &mut Memory, read: &mut [DVec3]) {
        if let [one] = met {
            return self.light(one, walk.through(one.through), random, memory, read);
        }
        let mut onward: Option<&SurfaceHit> = None;
        let mut through = 0.0;
        for m in met {
            if self.ends(m, walk.most) {
                self.read_patch(m, walk.through(m.through), read);
                continue;
            }
            through += m.through;
            if onward.is_none() || random.uniform() * through < m.through {
                onward = Some(m);
            }
        }
        if let Some(m) = onward {
            self.light(m, walk.through(through), random, memory, read);
        }
    }

    /// Whether light is read at a point.
    fn ends(&self, at: &SurfaceHit, most: u32) -> bool {
        most == 0 || !self.fields.is_near(at.patch, at.distance)
    }

    /// Adds a sample of the fields at a point, read there or after more rays.
    fn light(&self, at: &SurfaceHit, walk: Walk, random: &mut Stream, memory: &mut Memory, read: &mut [DVec3]) {
        if self.ends(at, walk.most) {
            return self.read_patch(at, walk, read);
        }
        let emitted = walk.reflections;
        let reflection = self.walker.direct_each(at, random, memory, |emitter, light| {
            self.add(emitter, emitted + 1, walk.weight * light, read);
        });
        if reflection.glow != DVec3::ZERO {
            let view = self.walker.view;
            let emitter = view.lights.emitters().of_face(view.scene, at.face);
            self.add(emitter, emitted, walk.weight * reflection.glow, read);
        }
        if reflection.reflect != DVec3::ZERO {
            let next = self.walker.bounce(at, random, memory);
            self.incident(&next, walk.reflected(reflection.reflect), random, memory, read);
        }
    }

    /// Adds light of an emitter that was reflected so often to the picture and to its layers.
    fn add(&self, emitter: usize, bounce: usize, light: DVec3, read: &mut [DVec3]) {
        read[0] += light;
        let (layers, first) = (self.fields.layers(), self.fields.first_layer());
        if layers.emitters > 0 {
            read[first + emitter] += light;
        }
        if layers.bounces > 0 {
            read[first + layers.emitters + bounce.min(layers.bounces - 1)] += light;
        }
    }

    /// Adds the fields where a ray meets a patch.
    #[inline]
    fn read_patch(&self, at: &SurfaceHit, walk: Walk, read: &mut [DVec3]) {
        let over_patch = at.over_patch(self.walker.view.patches, at.patch);
        let layers = self.fields.layers();
        let bounces = self.fields.count() - layers.bounces;
        for (f, field) in self.fields.of_patch(at.patch).iter().enumerate() {
            // Each reflection before makes it one of a later bounce.
            let own = if f < bounces { f } else { (f + walk.reflections).min(bounces + layers.bounces - 1) };
            read[own] += walk.weight * (field.at(at.position) * over_patch).as_dvec3();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Transport;
    use crate::reading::view::lights_of;

    /// With tau > 0 rays that continued from every crossing would double in number with every bounce.
    #[test]
    fn a_ray_that_crosses_many_surfaces_goes_on_from_one() {
        let lights = lights_of("furnished-room", Transport { alpha: 0.5, tau: 0.9 }, 300);
        let view = View::new(&lights, (1, 1).into());
        let patches = view.patches;
        let fields = Fields::new(&[vec![Rgb::ONE; patches.len()]]);
        let fields = fields.not_read_nearer(vec![f32::INFINITY; patches.len()]);
        let continuation = Continuation { walker: Walker::new(&view), fields: &fields };
        let mut memory = Memory::default();
        let mut random = Stream::new(1);
        for i in 0..patches.len() {
            let from = patches.point(i, 0.5, 0.5);
            let direction = cosine_direction(from.normal, random.uniform(), random.uniform());
            let before = memory.scratch.cast;
            let ray = Ray { origin: from.position, direction, source: Some(from.face) };
            continuation.read(&ray, i as u32, &mut memory);
            // Each bounce is one ray and those to luminaires, one for each of at most a handful.
            let luminaires = view.lights.luminaires.list.len() as u64;
            let most = u64::from(MOST_BOUNCES + 1) * (1 + luminaires);
            assert!(memory.scratch.cast - before <= most, "{i}: {} rays", memory.scratch.cast - before);
        }
    }
}
