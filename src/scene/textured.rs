//! What a point of a scene's surface reflects and emits.
//!
//! Materials without textures and colours of vertices give their own numbers, without looking at the place. The sky's
//! faces have no place.
//!
//! Not handled: which image lies where ([`crate::scene::textures`]), means over pieces of faces
//! ([`crate::scene::surface_means`]).

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3, Vec4, Vec4Swizzles};

use crate::light::{Light, Rgb};
use crate::scene::model::{Material, Scene};
use crate::scene::textures::mean::weighted;
use crate::scene::textures::{Maps, Texture};

impl Scene {
    /// Whether a material has textures, a mask or colours of vertices.
    pub fn is_textured(&self) -> bool {
        self.materials.iter().any(|material| material.maps.is_some())
    }

    /// What of a face's material differs from point to point.
    #[inline]
    pub fn maps(&self, face: u32) -> Option<&Maps> {
        self.material(face).maps.as_deref()
    }

    /// Whether a face is there only in part, as its material's mask says.
    pub(crate) fn is_masked(&self, face: u32) -> bool {
        self.material(face).is_masked()
    }

    /// Texture coordinates of a point of a face.
    pub fn coordinates_at(&self, face: u32, position: Vec3) -> DVec2 {
        let Some(corners) = self.coordinates.get(face as usize) else { return DVec2::ZERO };
        let weights = self.weights_at(face, position.as_dvec3());
        // Of a face that rounding left without an area every point is its first corner.
        let weights = if weights.is_finite() { weights.clamp(-DVec2::ONE, 2.0 * DVec2::ONE) } else { DVec2::ZERO };
        weighted(corners.map(|at| at.as_dvec2()), weights)
    }

    /// Texture coordinates that a point of a face's plane would have if the face went on to there; no number where the
    /// face has no area.
    pub(crate) fn coordinates_beyond(&self, face: u32, position: DVec3) -> DVec2 {
        let corners = self.coordinates.get(face as usize).copied().unwrap_or_default();
        weighted(corners.map(|at| at.as_dvec2()), self.weights_at(face, position))
    }

    /// Colour and alpha of the vertices at a point of a face: white where its material does not go by them.
    pub(crate) fn colour_at(&self, face: u32, position: Vec3) -> Vec4 {
        let goes = self.maps(face).is_some_and(|maps| maps.vertex_colours);
        let Some([a, b, c]) = self.colours.get(face as usize).filter(|_| goes) else { return Vec4::ONE };
        let weights = self.weights_at(face, position.as_dvec3());
        let [v, w] = if weights.is_finite() { weights.as_vec2().to_array() } else { [0.0; 2] };
        (a + v * (b - a) + w * (c - a)).clamp(Vec4::ZERO, Vec4::ONE)
    }

    /// Barycentric weights of a face's second and third corner at a point of its plane.
    fn weights_at(&self, face: u32, position: DVec3) -> DVec2 {
        let [a, b, c] = self.corners(face).map(|corner| corner.as_dvec3());
        let (u, v, p) = (b - a, c - a, position - a);
        let (uu, uv, vv) = (u.length_squared(), u.dot(v), v.length_squared());
        let (pu, pv) = (p.dot(u), p.dot(v));
        DVec2::new(vv * pu - uv * pv, uu * pv - uv * pu) / (uu * vv - uv * uv)
    }

    /// rho of a point of a face.
    #[inline]
    pub fn rho_at(&self, face: u32, position: Vec3) -> Rgb {
        let material = self.material(face);
        let Some(maps) = &material.maps else { return material.rho };
        let texture = maps.reflectance.as_ref();
        let texel = texture.map_or(Rgb::ONE, |texture| texture.colour(self.coordinates_at(face, position)));
        let colour = if maps.vertex_colours { self.colour_at(face, position).xyz() } else { Rgb::ONE };
        material.rho * texel * colour
    }

    /// The texture that a face's reflectance goes by, where that is all it goes by and nothing is cut out of it: means
    /// over its texels are then means over the surface.
    pub(crate) fn whole_texture(&self, face: u32) -> Option<&Texture> {
        let Maps { reflectance, mask: None, vertex_colours: false, .. } = self.maps(face)? else { return None };
        reflectance.as_ref()
    }

    /// The mean of rho over what lies within about `width` of a point of a face: over the largest square of texels
    /// around it that is known and no wider; rho of the point where there is none.
    pub(crate) fn rho_about(&self, face: u32, position: Vec3, width: f64) -> Rgb {
        match self.whole_texture(face).filter(|_| width > 0.0) {
            None => self.rho_at(face, position),
            Some(texture) => self.material(face).rho * self.colour_about(face, texture, position, width),
        }
    }

    /// The mean of E over what lies within about `width` of a point of a face, as [`Scene::rho_about`] has that of rho:
    /// `(E_invisible, E_visible)`, W/(m² sr).
    pub(crate) fn emitted_about(&self, face: u32, position: Vec3, width: f64) -> Light {
        let whole = self.maps(face).filter(|maps| maps.mask.is_none() && width > 0.0);
        let Some(texture) = whole.and_then(|maps| maps.emission.as_ref()) else {
            return self.emitted_at(face, position);
        };
        let material = self.material(face);
        let share = self.colour_about(face, texture, position, width);
        Light::emitted(share * material.emission, material.visibility)
    }

    /// The mean of a texture within about `width` of a point of a face.
    fn colour_about(&self, face: u32, texture: &Texture, position: Vec3, width: f64) -> Rgb {
        let at = self.coordinates_at(face, position);
        let own = |extent: DVec2| texture.colour_about(at, width / (std::f64::consts::SQRT_2 * extent));
        self.extent_of(face, texture).map_or_else(|| texture.colour(at), own)
    }

    /// How long the sides of a texture's image are where it lies on a face; none where it has no area there.
    fn extent_of(&self, face: u32, texture: &Texture) -> Option<DVec2> {
        let [a, b, c] = self.corners(face).map(|corner| corner.as_dvec3());
        let coordinates = self.coordinates.get(face as usize)?;
        let [p, q, r] = coordinates.map(|at| texture.placement.transform_point2(at.as_dvec2()));
        let (u, v) = (q - p, r - p);
        let along = |x: f64, y: f64| ((b - a) * x + (c - a) * y).length() / u.perp_dot(v).abs();
        let extent = DVec2::new(along(v.y, -u.y), along(-v.x, u.x));
        (extent.is_finite() && extent.cmpgt(DVec2::ZERO).all()).then_some(extent)
    }

    /// E of a point of a face: `(E_invisible, E_visible)`, W/(m² sr).
    #[inline]
    pub fn emitted_at(&self, face: u32, position: Vec3) -> Light {
        let material = self.material(face);
        match material.maps.as_ref().and_then(|maps| maps.emission.as_ref()) {
            None => material.emitted(),
            Some(texture) => {
                let share = texture.colour(self.coordinates_at(face, position));
                Light::emitted(share * material.emission, material.visibility)
            }
        }
    }

    /// The share of a surface that is there at a point of a face, 0..=1.
    #[inline]
    pub fn coverage_at(&self, face: u32, position: Vec3) -> f32 {
        let mask = self.maps(face).and_then(|maps| maps.mask.as_ref());
        mask.map_or(1.0, |mask| mask.at(self.coordinates_at(face, position), self.colour_at(face, position).w))
    }
}

impl Maps {
    /// Puts the textures onto a material. What is the same at every texel becomes the material's own number, so that
    /// lamps stay luminaires and whole surfaces have no mask.
    pub(crate) fn put_on(mut self, material: &mut Material) {
        for (texture, factor) in
            [(&mut self.reflectance, &mut material.rho), (&mut self.emission, &mut material.emission)]
        {
            if let Some(even) = texture.take_if(|t| t.image.is_even() || *factor == Rgb::ZERO) {
                *factor *= even.image.mean();
            }
        }
        let varied = self.vertex_colours;
        self.mask.take_if(|mask| !varied && mask.is_whole());
        let any = varied || self.reflectance.is_some() || self.emission.is_some() || self.mask.is_some();
        material.maps = any.then(|| Arc::new(self));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rho_about_a_point_is_a_mean_no_wider_than_asked() {
        let room = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/room.toml");
        let scene = Scene::open(room).expect("a scene");
        // The first face is half of the floor, 4 by 4 with the image 3 by 2.5 times on it.
        let (face, size) = (0, scene.frame.to_unit(DVec3::X).distance(scene.frame.to_unit(DVec3::ZERO)));
        let texture = scene.maps(face).and_then(|maps| maps.reflectance.as_ref()).expect("a texture");
        let extent = scene.extent_of(face, texture).expect("an area") / size;
        assert!((extent - DVec2::new(4.0 / 3.0, 4.0 / 2.5)).abs().max_element() < 1e-5, "{extent}");
        let [a, b, c] = scene.corners(face);
        let at = 0.4 * a + 0.25 * b + 0.35 * c;
        let about = |width: f64| scene.rho_about(face, at, width * size);
        assert_eq!([0.0, 0.1].map(about), [scene.rho_at(face, at); 2]);
        let whole = scene.material(face).rho * texture.image.mean();
        assert!(about(0.4) != whole && about(0.4) != scene.rho_at(face, at));
        // Texels that a mask cuts out are no part of a surface's mean.
        let is_masked = |&f: &u32| scene.maps(f).is_some_and(|maps| maps.mask.is_some() && maps.reflectance.is_some());
        let leaf = (0..scene.faces.len() as u32).find(is_masked).expect("a leaf");
        let middle = scene.corners(leaf).into_iter().sum::<Vec3>() / 3.0;
        assert_eq!(scene.rho_about(leaf, middle, 10.0), scene.rho_at(leaf, middle));
        // The diagonal of the image is longer than either side.
        assert!(about(1.7) != whole);
        assert_eq!(about(2.3), whole);
    }
}
