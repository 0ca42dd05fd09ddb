//! What a scene is: triangles, materials, a camera, and the frame of unit coordinates, in which the longest side of the
//! scene's box is 2.
//!
//! Not handled: how a scene is read and checked; that is [`crate::scene::load`] and [`crate::scene::build`].

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::light::{Gloss, Light, Rgb, Transport, TransportError, Visibility};
use crate::scene::bounds::Bounds;
use crate::scene::error::Warning;
use crate::scene::punctual::PunctualLight;
use crate::scene::sky_cells::Sky;
use crate::scene::textures::{Maps, Mask};
use crate::scene::unit::LengthUnit;

/// The material of faces for which the file has none: reflects [`LoadOptions::reflectance`].
pub const NO_MATERIAL: &str = "(none)";

/// The reflectance of a material that has no `Kd`: the customary default of MTL readers and writers.
pub const DEFAULT_RHO: f32 = 0.8;

/// The reflectance of faces without a material, where no option gives another.
pub const DEFAULT_GREY: f32 = 0.5;

/// Vertical field of view of a camera whose file gives none, degrees: the Cornell box's.
pub const DEFAULT_FOV: f64 = 39.307_648_116_106_62;

/// A checked scene in unit coordinates.
///
/// Invariants: at least one face; every vertex finite, no two the same; no face thinner than
/// [`crate::scene::THINNEST`]; every index in range; rho in 0..=1; emission finite and not negative.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Scene {
    /// The built-in scene's name or the file's stem.
    pub name: String,
    /// Corner points, unit coordinates.
    pub vertices: Vec<Vec3>,
    /// Triangles, counter-clockwise seen from the front.
    pub faces: Vec<Face>,
    /// Corners of the faces before they were rounded to single precision, unit coordinates; see
    /// [`Scene::exact_corners`].
    pub exact: Vec<[DVec3; 3]>,
    /// Texture coordinates of the corners of the faces; empty where no material has a texture.
    pub coordinates: Vec<[Vec2; 3]>,
    /// Linear RGB and alpha of the corners of the faces, each in 0..=1: factors on rho and on the mask. Empty where no
    /// material goes by them ([`Maps::vertex_colours`]).
    pub colours: Vec<[Vec4; 3]>,
    /// What the faces are made of.
    pub materials: Vec<Material>,
    /// Names of the file's objects and groups.
    pub objects: Vec<String>,
    /// Punctual lights.
    pub lights: Vec<PunctualLight>,
    /// The faces that stand for the sky, where there is one; see [`Scene::set_sky`].
    pub sky: Option<Sky>,
    /// Where the picture is taken from, unit coordinates.
    pub camera: Camera,
    /// The cameras that the file brings, unit coordinates; see [`Scene::look_through`].
    pub cameras: Vec<NamedCamera>,
    /// From unit coordinates back to the file's.
    pub frame: UnitFrame,
    /// (alpha, tau) of every material that has none of its own, where the scene file gives one.
    pub transport: Option<Transport>,
    /// What a person should know about the file.
    pub warnings: Vec<Warning>,
}

/// `file = center + scale * unit`, in the file's units, of which one is `metres` long.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct UnitFrame {
    /// The middle of the scene's bounding box.
    pub center: DVec3,
    /// Half its largest extent.
    pub scale: f64,
    /// Metres of the file's unit.
    pub metres: f64,
}

impl UnitFrame {
    /// The frame of some points in a unit of so many metres; none if there are none or all coincide.
    pub fn of(points: impl Iterator<Item = DVec3>, metres: f64) -> Option<UnitFrame> {
        let Bounds { low, high } = Bounds::of(points);
        // Halves first: the sum of two large numbers overflows.
        let scale = (0.5 * high - 0.5 * low).max_element();
        let center = 0.5 * low + 0.5 * high;
        (scale > 0.0 && scale.is_finite()).then_some(UnitFrame { center, scale, metres })
    }

    /// Metres of one unit coordinate: what `1/d²` and areas that power leaves from are measured by.
    pub fn in_metres(&self) -> f64 {
        self.metres * self.scale
    }

    /// From the file's units to unit coordinates.
    pub fn to_unit(&self, point: DVec3) -> DVec3 {
        (point - self.center) / self.scale
    }

    /// From unit coordinates to the file's units.
    pub fn to_file(&self, point: DVec3) -> DVec3 {
        self.center + self.scale * point
    }
}

/// One triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Face {
    /// Indices into [`Scene::vertices`], counter-clockwise seen from the front.
    pub vertices: [u32; 3],
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// Index into [`Scene::objects`].
    pub object: u32,
}

/// A diffuse material.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Material {
    /// The MTL's name.
    pub name: String,
    /// Diffuse reflectance per channel, 0..=1 (MTL `Kd`): that of every point, or the factor on its texture.
    pub rho: Rgb,
    /// Emitted radiance in W/(m² sr) (MTL `Ke`): that of every point, or the factor on its texture.
    pub emission: Rgb,
    /// Whether the camera sees the emission.
    pub visibility: Visibility,
    /// Its own alpha, where the scene file gives one.
    pub alpha: Option<f32>,
    /// Its own tau, where the scene file gives one.
    pub tau: Option<f32>,
    /// Which sides of its faces reflect and emit.
    pub sides: Sides,
    /// Highlights of direct light, where it has any (MTL `Ks` and `Ns`, under [`LoadOptions::highlights`]).
    pub gloss: Option<Gloss>,
    /// What differs from point to point, if anything does.
    pub maps: Option<Arc<Maps>>,
}

/// Which sides of a face reflect and emit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Sides {
    /// The front only, as in the paper: the back is black and still occludes by its tau.
    #[default]
    One,
    /// Both: the face carries a patch on either side.
    Two,
}

/// A pinhole camera in unit coordinates.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Camera {
    /// The eye.
    pub position: Vec3,
    /// Unit vector, the way it looks.
    pub forward: Vec3,
    /// Unit vector to the right of the picture: cross(forward, up) normalised.
    pub right: Vec3,
    /// Unit vector up in the picture.
    pub up: Vec3,
    /// Full vertical field of view, degrees, in (0, 180).
    pub vertical_fov: f32,
}

/// A camera of a scene's file.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NamedCamera {
    /// The name that the file has for it.
    pub name: String,
    /// Where it is and how it looks.
    pub camera: Camera,
}

/// What may be requested for every scene, whatever its files give.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// The sides of materials for which no scene file gives `two_sided`.
    pub two_sided: Sides,
    /// rho, 0..=1, of faces for which the files have no material; without it [`DEFAULT_GREY`], and in glTF, whose
    /// default material is white, [`DEFAULT_RHO`].
    pub reflectance: Option<f32>,
    /// Light that the files do not have.
    pub light: Option<AddedLight>,
    /// Whether materials show highlights by their `Ks` and `Ns`.
    pub highlights: bool,
    /// The unit of positions, in place of what the files say.
    pub unit: Option<LengthUnit>,
    /// What becomes of rooms whose faces look outward.
    pub winding: Winding,
}

/// What becomes of a closed shell that the camera is in and whose faces look outward, so that it shows black backs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Winding {
    /// It is turned, which a warning says.
    #[default]
    Turned,
    /// It stays as its file has it.
    AsModelled,
}

/// Light added to a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AddedLight {
    /// A rectangle of half the scene's width and depth that faces down, below the ceiling or above an open scene.
    /// It gives the floor of the bounding box a mean irradiance of about pi W/m².
    Ceiling,
    /// A sky of radiance 1 W/(m² sr) all around, where the files have none.
    Sky,
}

impl LoadOptions {
    /// Gives all materials the sides requested, but those whose sides a file gives.
    pub(crate) fn apply(self, materials: &mut [Material], is_given: impl Fn(&str) -> bool) {
        for material in materials.iter_mut().filter(|material| !is_given(&material.name)) {
            if self.two_sided == Sides::Two {
                material.sides = Sides::Two;
            }
        }
    }
}

impl Material {
    /// The mask that gives where its surface is, if it has one.
    #[inline]
    pub fn mask(&self) -> Option<&Mask> {
        self.maps.as_ref()?.mask.as_ref()
    }

    /// Whether a mask gives where its surface is.
    pub fn is_masked(&self) -> bool {
        self.mask().is_some()
    }

    /// Whether it goes by images, so that points have texture coordinates.
    pub(crate) fn has_images(&self) -> bool {
        self.maps.as_ref().is_some_and(|maps| maps.has_images())
    }

    /// A one-sided material whose emission is seen, without an alpha or tau of its own. Checked when a scene is made.
    pub fn new(name: &str, rho: Rgb, emission: Rgb) -> Self {
        Material {
            name: name.to_owned(),
            rho,
            emission,
            visibility: Visibility::Seen,
            alpha: None,
            tau: None,
            sides: Sides::One,
            gloss: None,
            maps: None,
        }
    }

    /// Checks that its own alpha and tau, where it has any, lie in 0..=1.
    pub fn check_transport(&self) -> Result<(), TransportError> {
        let own = self.transport(Transport { alpha: 0.0, tau: 0.0 });
        Transport::new(own.alpha, own.tau).map(|_| ())
    }

    /// `E` of a point of this material: `(E_invisible, E_visible)`; the factor on it where it has a texture.
    pub fn emitted(&self) -> Light {
        Light::emitted(self.emission, self.visibility)
    }

    /// Gives it textures. What is the same at every texel becomes the material's own number, so that what emits
    /// evenly is a luminaire without a texture and whole surfaces have no mask.
    pub fn set_maps(&mut self, mut maps: Maps) {
        for (texture, factor) in [(&mut maps.reflectance, &mut self.rho), (&mut maps.emission, &mut self.emission)] {
            if let Some(even) = texture.take_if(|t| t.image.is_even() || *factor == Rgb::ZERO) {
                *factor *= even.image.mean();
            }
        }
        let varied = maps.vertex_colours;
        maps.mask.iter_mut().for_each(Mask::simplify);
        maps.mask.take_if(|mask| !varied && mask.is_whole());
        let any = varied || maps.reflectance.is_some() || maps.emission.is_some() || maps.mask.is_some();
        self.maps = any.then(|| Arc::new(maps));
    }

    /// Whether any channel emits.
    pub fn emits(&self) -> bool {
        self.emission.max_element() > 0.0
    }

    /// Its own numbers where it has any, the default's elsewhere.
    pub fn transport(&self, default: Transport) -> Transport {
        Transport { alpha: self.alpha.unwrap_or(default.alpha), tau: self.tau.unwrap_or(default.tau) }
    }
}

impl Scene {
    /// The three corners of a face.
    pub fn corners(&self, face: u32) -> [Vec3; 3] {
        self.faces[face as usize].vertices.map(|v| self.vertices[v as usize])
    }

    /// The three corners of a face in double precision: as the file gives them, where the scene has kept them, so that
    /// gaps below the rounding of [`Scene::vertices`] stay open.
    pub fn exact_corners(&self, face: u32) -> [DVec3; 3] {
        let kept = self.exact.get(face as usize).copied();
        kept.unwrap_or_else(|| self.corners(face).map(|p| p.as_dvec3()))
    }

    /// The area of a face, unit coordinates squared, in double precision.
    pub fn area(&self, face: u32) -> f64 {
        let [a, b, c] = self.corners(face).map(|p| p.as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    }

    /// The material of a face.
    pub fn material(&self, face: u32) -> &Material {
        &self.materials[self.faces[face as usize].material as usize]
    }

    /// (alpha, tau) of every material when those without their own take `default`.
    pub fn transports(&self, default: Transport) -> Vec<Transport> {
        self.materials.iter().map(|m| m.transport(default)).collect()
    }
}

impl Camera {
    /// At the middle of the scene, looking along -z: a camera before there is one.
    pub(super) const NOWHERE: Camera =
        Camera { position: Vec3::ZERO, forward: Vec3::NEG_Z, right: Vec3::X, up: Vec3::Y, vertical_fov: 45.0 };

    /// The ray through the point (x, y) of the picture, x to the right and y down, both in 0..1; unit direction.
    pub fn ray(&self, x: f32, y: f32, aspect: f32) -> (Vec3, Vec3) {
        let half = (0.5 * self.vertical_fov.to_radians()).tan();
        let across = (2.0 * x - 1.0) * half * aspect;
        let above = (1.0 - 2.0 * y) * half;
        let direction = self.forward + across * self.right + above * self.up;
        (self.position, direction.normalize())
    }

    /// Width of a pixel of a picture of so many rows, at unit distance in the middle of the view.
    pub fn pixel(&self, rows: usize) -> f64 {
        let half = (0.5 * f64::from(self.vertical_fov).to_radians()).tan();
        2.0 * half / rows.max(1) as f64
    }
}
