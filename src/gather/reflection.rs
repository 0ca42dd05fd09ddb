//! One reflection after the other: what a ray meets, and what leaves the surface there.
//!
//! Not handled: choosing where to go on where a ray meets several surfaces; callers do.

use glam::{DVec3, Vec3};

use smallvec::SmallVec;

use crate::direct::Scratch;
use crate::gather::view::View;
use crate::light::Rgb;
use crate::patches::Patches;
use crate::rays::sobol::Stream;
use crate::rays::warp::cosine_direction;
use crate::rays::{Fan, Hit, Ray, Side};

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
    /// Reflectance within the ray's cone, where it tells how the light here differs from the patch's.
    pub read: Option<Rgb>,
}

impl SurfaceHit {
    /// Light as the ray reads it here over that of the patch: what is far shows its mean, what is near its texels.
    #[inline]
    pub fn over_patch(&self, patches: &Patches, patch: u32) -> Rgb {
        self.read.map_or(Rgb::ONE, |rho| patches.over_mean(patch as usize, rho))
    }
}

/// The points that a ray meets; one, unless something is transparent.
pub(crate) type Met = SmallVec<[SurfaceHit; 1]>;

/// What leaves a point of a surface, as far as one ray tells.
#[derive(Clone, Debug)]
pub(crate) struct Reflection {
    /// Light that leaves for what luminaires send there: `alpha rho D`.
    pub direct: DVec3,
    /// Light that the surface emits without being a luminaire.
    pub glow: DVec3,
    /// `rho` within the ray's cone.
    pub rho: DVec3,
    /// `alpha rho`.
    pub reflect: DVec3,
    /// What the next rays meet.
    pub next: Met,
}

impl Reflection {
    /// What leaves the point when `incident` arrives along the next rays, beside the light asked for.
    pub fn light(&self, incident: DVec3) -> DVec3 {
        self.glow + self.direct + self.reflect * incident
    }
}

/// Memory that one thread uses again from ray to ray.
#[derive(Default)]
pub(crate) struct Memory {
    pub hits: Vec<Hit>,
    pub met: Vec<SurfaceHit>,
    /// Also counts the rays cast.
    pub scratch: Scratch,
}

/// Follows light through a scene.
#[derive(Clone)]
pub(crate) struct Walker<'a> {
    pub view: &'a View<'a>,
    /// Every ray ends at its first crossing.
    opaque: bool,
    /// Width at distance 1 of the cone that a ray stands for: of a texture it sees the mean over what lies within,
    /// about.
    cone: f64,
    /// Some surface has a texture.
    textured: bool,
}

impl<'a> Walker<'a> {
    pub fn new(view: &'a View<'a>) -> Walker<'a> {
        Walker {
            view,
            opaque: view.lights.transports.iter().all(|t| t.tau == 0.0),
            cone: 0.0,
            textured: view.scene.is_textured(),
        }
    }

    /// The same walker, to whose rays a texture is its mean over a cone that is so wide at distance 1.
    pub fn with_cone(self, cone: f64) -> Walker<'a> {
        Walker { cone, ..self }
    }

    /// `rho` of the point met.
    pub fn rho(&self, at: &SurfaceHit) -> DVec3 {
        self.rho_within(at, self.cone)
    }

    /// Reflectance within the cone of a ray that reads light where it ends, at a distance; none where there is no
    /// texture or a mask, or the surface glows, so that its light does not go as its reflectance.
    #[inline]
    pub fn read_reflectance(&self, face: u32, position: Vec3, distance: f32) -> Option<Rgb> {
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
    pub fn rho_within(&self, at: &SurfaceHit, cone: f64) -> DVec3 {
        self.view.scene.rho_about(at.face, at.position, cone * f64::from(at.distance)).as_dvec3()
    }

    /// `alpha rho D` and the light emitted at a point; `alpha rho`.
    pub fn direct(&self, at: &SurfaceHit, random: &mut Stream, memory: &mut Memory) -> Reflection {
        let view = self.view;
        let index = view.scene.faces[at.face as usize].material as usize;
        let luminaire = view.lights.luminaires.carries[index];
        let width = self.cone * f64::from(at.distance);
        let emitted = || view.scene.emitted_about(at.face, at.position, width).invisible.as_dvec3();
        let glow = if luminaire { DVec3::ZERO } else { emitted() };
        let rho = self.rho(at);
        let reflect = f64::from(view.lights.transports[index].alpha) * rho;
        let mut direct = DVec3::ZERO;
        if reflect != DVec3::ZERO {
            let receiver = view.surface_point(at.face, at.side, at.position);
            direct = reflect * view.lights.sample(&receiver, at.patch, random, &mut memory.scratch);
        }
        Reflection { direct, glow, rho, reflect, next: Met::new() }
    }

    /// All that one cosine-distributed ray meets and sees light from.
    pub fn bounce(&self, at: &SurfaceHit, random: &mut Stream, memory: &mut Memory) -> Met {
        self.bounce_towards(at, random.uniform(), random.uniform(), memory)
    }

    /// All that one ray meets and sees light from, its direction made of a point of the unit square.
    pub fn bounce_towards(&self, at: &SurfaceHit, u: f32, v: f32, memory: &mut Memory) -> Met {
        let normal = self.view.patches.normal(at.face, at.side);
        let ray = Ray { origin: at.position, direction: cosine_direction(normal, u, v), source: Some(at.face) };
        let mut met = Met::new();
        self.follow(&ray, memory, |m| met.push(m));
        met
    }

    /// All that the first `count` rays of a fan meet and see light from, each ray for its part of the whole.
    pub fn bounce_all(&self, at: &SurfaceHit, fan: &Fan, count: usize, memory: &mut Memory) -> Met {
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
    pub fn follow(&self, ray: &Ray, memory: &mut Memory, mut meet: impl FnMut(SurfaceHit)) -> f64 {
        memory.scratch.cast += 1;
        self.each(ray, &mut memory.hits, |hit, through| {
            if let Some(found) = self.met(ray, hit, through) {
                meet(found);
            }
        })
    }

    /// Calls `meet(hit, through)` for every face that light comes through from along a ray, `through` being the product
    /// of tau before it; returns the inverse distance to the first, 0 where there is none.
    #[inline(always)]
    pub fn each(&self, ray: &Ray, hits: &mut Vec<Hit>, meet: impl FnMut(&Hit, f32)) -> f64 {
        let view = self.view;
        view.rays.light_crossings(ray, self.opaque, hits);
        view.rays.transmit(hits, |m| view.lights.transports[m].tau, meet);
        hits.first().map_or(0.0, |hit| 1.0 / f64::from(hit.t))
    }

    /// The point where a ray meets a face; none on a black back, which has no patch.
    pub fn met(&self, ray: &Ray, hit: &Hit, through: f32) -> Option<SurfaceHit> {
        let position = self.view.met_at(ray, hit);
        let patch = self.view.patches.at(hit.face, hit.side, position)?;
        let read = self.read_reflectance(hit.face, position, hit.t);
        Some(SurfaceHit { face: hit.face, patch, side: hit.side, position, through, distance: hit.t, read })
    }
}
