//! A sky: light that comes from everywhere outside the scene, of one radiance in each of its cells.
//!
//! A ray that leaves the scene meets the sky, as it would meet a black sphere around everything that emits inwards. The
//! last faces of the scene's list stand for the sphere's cells ([`Sky`]), each with a material of its own, so that what
//! follows light through faces and patches needs no case for it. They lie nowhere: rays meet one of them by direction
//! alone, once they have met everything else. They emit from their share of the smallest sphere about the origin of
//! unit coordinates that holds all vertices, `R²` times the solid angle of the cell, so the power they emit is what
//! enters that sphere.
//!
//! Not handled: a sun, which is parallel light; radiance that varies within a cell; closed forms: nothing may take the
//! corners of these faces for a place.

use glam::{DVec3, Vec3};

use crate::light::Rgb;
use crate::scene::emission::sky_patches::SkyPatches;
use crate::scene::model::{Face, Material, Scene};
use crate::scene::sky_cells::{Sky, SkyRow};

/// The name of the object and of the materials of all cells.
const NAME: &str = "sky";

/// Where the corners of the faces are kept: further than any vertex of unit coordinates, and next to nothing in size.
const PLACE: (f32, f32) = (3.0, 1e-3);

/// Radiance of a sky of two halves, W/(m² sr).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyLight {
    /// From directions with a positive component along up.
    pub upper: Rgb,
    /// From all others.
    pub lower: Rgb,
}

impl Scene {
    /// Puts a sky of two halves around the scene, or in the place of another one. `up` is not zero.
    pub fn set_sky(&mut self, light: SkyLight, up: DVec3) {
        self.put_sky(Sky::halves(), [up, Sky::usual_north(up)], [light.upper, light.lower]);
    }

    /// Puts a sky of patches around the scene, or in the place of another one. `up` is not zero; `north` is level
    /// ([`Sky::level`]).
    pub fn set_patched_sky(&mut self, light: &SkyPatches, up: DVec3, north: DVec3) {
        self.put_sky(Sky::reinhart(light.fineness()), [up, north], light.zenith_first());
    }

    fn put_sky(&mut self, rows: Vec<SkyRow>, [up, north]: [DVec3; 2], light: impl IntoIterator<Item = Rgb>) {
        self.remove_sky();
        let radius = self.vertices.iter().map(|v| v.as_dvec3().length()).fold(0.0, f64::max);
        let (up, first) = (up.normalize().as_vec3(), self.faces.len() as u32);
        let sky = Sky { up, north: north.as_vec3(), rows, first, radius };
        let object = self.objects.len() as u32;
        self.objects.push(NAME.to_owned());
        for (face, radiance) in (first..).zip(light) {
            let corners = stand_in(sky.cap(face).map_or_else(|| sky.within(face, 0.5, 0.5), |(pole, _)| pole));
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
        let cells = sky.cells() as usize;
        self.faces.truncate(sky.first as usize);
        self.exact.truncate(sky.first as usize);
        self.vertices.truncate(self.vertices.len() - 3 * cells);
        self.materials.truncate(self.materials.len() - cells);
        self.objects.pop();
    }

    /// Number of faces that have a place; those that stand for a sky follow them.
    pub fn solid_faces(&self) -> u32 {
        self.sky.as_ref().map_or(self.faces.len() as u32, |sky| sky.first)
    }

    /// Number of objects that have a place; that of a sky follows them.
    pub fn solid_objects(&self) -> usize {
        self.objects.len() - usize::from(self.sky.is_some())
    }

    /// Whether a face stands for a cell of the sky.
    #[inline]
    pub fn is_sky(&self, face: u32) -> bool {
        self.sky.as_ref().is_some_and(|sky| sky.holds(face))
    }

    /// Whether a material is that of a cell of the sky.
    pub fn is_sky_material(&self, material: usize) -> bool {
        self.sky.as_ref().is_some_and(|sky| material + sky.cells() as usize >= self.materials.len())
    }

    /// The area that a face emits from, unit coordinates squared: its own, or that of its share of the sphere around
    /// the scene where it stands for a cell of the sky.
    pub fn emitting_area(&self, face: u32) -> f64 {
        match &self.sky {
            Some(sky) if sky.holds(face) => sky.solid_angle(face) * sky.radius * sky.radius,
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
