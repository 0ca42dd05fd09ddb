//! What a path needs to know of the faces it meets: place, normal, which sides send, reflectance, tau, emission.
//!
//! A one-sided face neither reflects nor emits behind; tau acts from either side. Not handled: smooth normals.

use glam::Vec3;

use crate::light::{Gloss, Light, Rgb, Transport};
use crate::rays::{Hit, Side};
use crate::reference::textures::FaceTextures;
use crate::scene::{Scene, Sides};

/// A face's place.
#[derive(Clone, Copy)]
pub(crate) struct Facet {
    corners: [Vec3; 3],
    /// Unit normal of the front.
    pub normal: Vec3,
    material: u32,
}

/// A material's numbers under one (alpha, tau); of a point, or the factors on its textures.
#[derive(Clone, Copy)]
pub(crate) struct Matter {
    /// Diffuse reflectance: what reaches the visible half.
    pub rho: Rgb,
    /// `alpha rho`: what reaches the invisible half.
    pub passed_on: Rgb,
    /// Emitted light.
    pub emitted: Light,
    /// Share of light that goes through.
    pub tau: f32,
    /// Highlights of direct light.
    pub gloss: Option<Gloss>,
    /// The share of it that is there.
    pub there: f32,
    sides: Sides,
}

impl Matter {
    /// Whether light is reflected and emitted there.
    #[inline]
    pub(crate) fn sends(&self, side: Side) -> bool {
        side == Side::Front || self.sides == Sides::Two
    }

    /// Whether anything is emitted.
    pub(crate) fn emits(&self) -> bool {
        self.emitted.invisible.max_element() > 0.0
    }
}

/// A point of a surface and the side looked at.
#[derive(Clone, Copy)]
pub(crate) struct SurfacePoint {
    pub position: Vec3,
    /// Unit normal of the side looked at.
    pub normal: Vec3,
    pub face: u32,
}

/// A point, and who looks at it.
pub(crate) struct Seen<'a> {
    pub point: &'a SurfacePoint,
    /// Unit vector.
    pub to_viewer: Vec3,
    pub gloss: Gloss,
}

impl Seen<'_> {
    /// Phong's lobe, for light from a direction.
    pub fn lobe(&self, way: Vec3) -> f32 {
        let [n, l, v] = [self.point.normal, way, self.to_viewer].map(|v| v.as_dvec3());
        self.gloss.lobe(n, l, v) as f32
    }

    /// Density per solid angle at which a direction is drawn from the lobe.
    pub fn density(&self, way: Vec3) -> f32 {
        let [n, l, v] = [self.point.normal, way, self.to_viewer].map(|v| v.as_dvec3());
        self.gloss.density(n, l, v) as f32
    }
}

/// All faces of a scene.
pub(crate) struct Surfaces {
    facets: Vec<Facet>,
    matter: Vec<Matter>,
    textures: Option<FaceTextures>,
    /// tau of every material.
    pub taus: Vec<f32>,
    /// Nothing goes through anything.
    pub opaque: bool,
    /// Number of faces that have a place.
    solid: u32,
}

impl Surfaces {
    /// The faces of a scene whose materials have the given (alpha, tau).
    pub(crate) fn new(scene: &Scene, transports: &[Transport]) -> Surfaces {
        let facets = (0..scene.faces.len() as u32).map(|face| Facet {
            corners: scene.corners(face),
            normal: area_vector(scene.corners(face)).normalize_or(glam::DVec3::Z).as_vec3(),
            material: scene.faces[face as usize].material,
        });
        let matter = scene.materials.iter().zip(transports).map(|(m, t)| Matter {
            rho: m.rho,
            passed_on: t.alpha * m.rho,
            emitted: m.emitted(),
            tau: t.tau,
            gloss: m.gloss,
            there: 1.0,
            sides: m.sides,
        });
        let taus: Vec<f32> = transports.iter().map(|t| t.tau).collect();
        Surfaces {
            facets: facets.collect(),
            matter: matter.collect(),
            textures: FaceTextures::new(scene),
            opaque: taus.iter().all(|&tau| tau == 0.0),
            taus,
            solid: scene.solid_faces(),
        }
    }

    /// Number of faces that have a place; what stands for the sky follows them.
    pub(crate) fn count(&self) -> u32 {
        self.solid
    }

    /// Whether some materials differ from point to point.
    pub(crate) fn is_textured(&self) -> bool {
        self.textures.is_some()
    }

    /// Number of all faces.
    pub(crate) fn faces(&self) -> usize {
        self.facets.len()
    }

    #[inline]
    pub(crate) fn facet(&self, face: u32) -> &Facet {
        &self.facets[face as usize]
    }

    #[inline]
    pub(crate) fn matter(&self, face: u32) -> &Matter {
        &self.matter[self.facet(face).material as usize]
    }

    /// A face's material at the point with these weights of the second and third corner.
    #[inline]
    pub(crate) fn matter_at(&self, face: u32, at: [f32; 2]) -> Matter {
        let mut own = *self.matter(face);
        let textures = self.textures.as_ref();
        if let Some(texel) = textures.and_then(|textures| textures.at(self.facet(face).material, face, at)) {
            own.rho *= texel.rho;
            own.passed_on *= texel.rho;
            own.emitted.invisible *= texel.emission;
            own.emitted.visible *= texel.emission;
            own.there = texel.there;
        }
        own
    }

    /// The point met, exact to the rounding of the corners.
    #[inline]
    pub(crate) fn point(&self, hit: &Hit) -> SurfacePoint {
        let facet = self.facet(hit.face);
        let normal = match hit.side {
            Side::Front => facet.normal,
            Side::Back => -facet.normal,
        };
        SurfacePoint { position: facet.at(hit.u, hit.v), normal, face: hit.face }
    }
}

impl Facet {
    /// The point of these barycentric weights of the second and third corner.
    #[inline]
    pub(crate) fn at(&self, u: f32, v: f32) -> Vec3 {
        let [a, b, c] = self.corners;
        a + u * (b - a) + v * (c - a)
    }

    /// Area in unit coordinates.
    pub(crate) fn area(&self) -> f64 {
        area_vector(self.corners).length()
    }
}

fn area_vector(corners: [Vec3; 3]) -> glam::DVec3 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    0.5 * (b - a).cross(c - a)
}
