//! A sky: light that comes from everywhere outside the scene, one radiance from above and one from below.
//!
//! A ray that leaves the scene meets the sky, as it would meet a black sphere around everything that emits inwards. Two
//! faces at the end of the scene's list stand for the sphere's halves, each with a material of its own, so that what
//! follows light through faces and patches needs no case for it. They lie nowhere: rays meet one of them by direction
//! alone, once they have met everything else. They emit from the area of half the smallest sphere about the origin of
//! unit coordinates that holds all vertices, so the power they emit is what enters that sphere.
//!
//! Not handled: a sun, and radiance that varies within a half; closed forms: nothing may take the corners of these
//! faces for a place.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::light::Rgb;
use crate::scene::model::{Face, Material, Scene, Sky};

/// The name of the object and of the materials of both faces.
const NAME: &str = "sky";

/// Where the corners of the faces are kept: further than any vertex of unit coordinates, and next to nothing in size.
const PLACE: (f32, f32) = (3.0, 1e-3);

/// Radiance of a sky, W/(m² sr).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyLight {
    /// From directions with a positive component along up.
    pub upper: Rgb,
    /// From all others.
    pub lower: Rgb,
}

impl Scene {
    /// Puts a sky around the scene, or another one in its place. `up` is not zero.
    pub fn set_sky(&mut self, light: SkyLight, up: DVec3) {
        self.remove_sky();
        let up = up.normalize().as_vec3();
        let reach = self.vertices.iter().map(|v| v.as_dvec3().length()).fold(0.0, f64::max);
        let sky = Sky { up, first: self.faces.len() as u32, radius: reach };
        let object = self.objects.len() as u32;
        self.objects.push(NAME.to_owned());
        for (half, radiance) in [(up, light.upper), (-up, light.lower)] {
            let corners = stand_in(half);
            let vertices = [0, 1, 2].map(|k| (self.vertices.len() + k) as u32);
            self.faces.push(Face { vertices, material: self.materials.len() as u32, object });
            self.vertices.extend(corners);
            if self.exact.len() + 1 == self.faces.len() {
                self.exact.push(corners.map(|corner| corner.as_dvec3()));
            }
            // It lets nothing through and reflects nothing.
            let black = Material::new(NAME, Rgb::ZERO, radiance);
            self.materials.push(Material { alpha: Some(0.0), tau: Some(0.0), ..black });
        }
        self.sky = Some(sky);
    }

    fn remove_sky(&mut self) {
        let Some(sky) = self.sky.take() else { return };
        self.faces.truncate(sky.first as usize);
        self.exact.truncate(sky.first as usize);
        self.vertices.truncate(self.vertices.len() - 6);
        self.materials.truncate(self.materials.len() - 2);
        self.objects.pop();
    }

    /// Number of faces that have a place; those that stand for a sky follow them.
    pub fn solid_faces(&self) -> u32 {
        self.sky.map_or(self.faces.len() as u32, |sky| sky.first)
    }

    /// Number of objects that have a place; that of a sky follows them.
    pub fn solid_objects(&self) -> usize {
        self.objects.len() - usize::from(self.sky.is_some())
    }

    /// Whether a face stands for a half of the sky.
    #[inline]
    pub fn is_sky(&self, face: u32) -> bool {
        self.sky.is_some_and(|sky| sky.holds(face))
    }

    /// Whether a material is that of a half of the sky.
    pub fn is_sky_material(&self, material: usize) -> bool {
        self.sky.is_some() && material + 2 >= self.materials.len()
    }

    /// The area that a face emits from, unit coordinates squared: its own, or that of half the sphere around the scene
    /// where it stands for a half of the sky.
    pub fn emitting_area(&self, face: u32) -> f64 {
        match self.sky {
            Some(sky) if sky.holds(face) => 2.0 * PI * sky.radius * sky.radius,
            _ => self.area(face),
        }
    }
}

/// Three corners far out along `half`, counter-clockwise seen from the origin.
fn stand_in(half: Vec3) -> [Vec3; 3] {
    let (far, side) = PLACE;
    let (u, v) = half.any_orthonormal_pair();
    let (u, v) = if u.cross(v).dot(half) < 0.0 { (u, v) } else { (v, u) };
    let corner = far * half;
    [corner, corner + side * u, corner + side * v]
}
