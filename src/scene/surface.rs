//! What surfaces reflect and emit: at points, and in the mean over pieces of faces.
//!
//! Materials without textures and colours of vertices give their own numbers, without looking at the place.
//!
//! The mean over a texture is exact ([`crate::scene::textures::Texture::mean`]), and so is that over colours of
//! vertices, which are linear: the mean of the corners. Where both meet, each of 64 parts of a piece has the exact mean
//! of the texture times the colour of its middle. The mean share of a mask without a cutoff is exact in the same way;
//! where the mask has one, or reflectance or emission vary along with it, means are those of a grid of points.
//!
//! Not handled: which image lies where ([`crate::scene::textures`]); the sky's faces, which have no place.

use glam::{DVec2, DVec3, DVec4, Vec3, Vec4, Vec4Swizzles};

use crate::light::{Light, Rgb};
use crate::scene::model::{Material, Scene};
use crate::scene::textures::mean::{subdivided, weighted};
use crate::scene::textures::{Maps, Mask, Texture};

/// Points to a side of a triangle that the means of masked surfaces are taken over.
const POINTS: u32 = 24;
/// Parts to a side of a triangle over each of which the colour of vertices counts as that of the middle.
const PARTS: u32 = 8;

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

    /// Whether a face is there only in part, as its material's mask gives.
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
        self.material(face)
            .mask()
            .map_or(1.0, |mask| mask.at(self.coordinates_at(face, position), self.colour_at(face, position).w))
    }
}

/// Means over a piece of a face, each point counting as much as there is a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Means {
    /// Mean share a of a surface, 0..=1.
    pub coverage: f64,
    /// Mean of `a rho(x)`.
    pub rho: DVec3,
    /// Mean of `a E(x)`, W/(m² sr).
    pub emission: DVec3,
}

/// What the corners of a piece of a face have.
struct Piece {
    coordinates: [DVec2; 3],
    /// Where the material goes by them.
    colours: Option<[DVec4; 3]>,
}

impl Scene {
    /// Means over a triangle that is a part of a face.
    pub fn means(&self, face: u32, triangle: [Vec3; 3]) -> Means {
        self.material(face).means(|coloured| Piece {
            coordinates: triangle.map(|corner| self.coordinates_at(face, corner)),
            colours: coloured.then(|| triangle.map(|corner| self.colour_at(face, corner).as_dvec4())),
        })
    }

    /// Means over a whole face, from what its corners have in the file.
    pub fn means_of_face(&self, face: u32) -> Means {
        let coordinates = self.coordinates.get(face as usize).copied().unwrap_or_default();
        let colours = || self.colours.get(face as usize).map(|corners| corners.map(|colour| colour.as_dvec4()));
        self.material(face).means(|coloured| Piece {
            coordinates: coordinates.map(|at| at.as_dvec2()),
            colours: if coloured { colours() } else { None },
        })
    }
}

impl Material {
    /// Means over a piece, which is made where something differs from point to point; its argument is whether by
    /// colours of vertices.
    fn means(&self, piece: impl Fn(bool) -> Piece) -> Means {
        let (rho, emission) = (self.rho.as_dvec3(), self.emission.as_dvec3());
        let Some(maps) = &self.maps else { return Means { coverage: 1.0, rho, emission } };
        let piece = piece(maps.vertex_colours);
        let share = |mask: &Mask| f64::from(mask.at(DVec2::ZERO, 1.0));
        let even = match &maps.mask {
            None => Some(1.0),
            Some(mask) if piece.is_even(mask) => Some(share(mask)),
            Some(mask) => piece.mean_share(maps, mask),
        };
        if let Some(coverage) = even {
            let emission = emission * piece.mean(maps.emission.as_ref());
            let rho = rho * piece.mean_coloured(maps.reflectance.as_ref());
            return Means { coverage, rho: coverage * rho, emission: coverage * emission };
        }
        let mut sum = Means::default();
        for at in subdivided(POINTS) {
            let (place, colour) = (weighted(piece.coordinates, at), piece.colour(at));
            let there = maps.mask.as_ref().map_or(1.0, |mask| mask.at(place, colour.w as f32));
            let [rho_of, emission_of] = [&maps.reflectance, &maps.emission]
                .map(|texture| texture.as_ref().map_or(DVec3::ONE, |texture| texture.colour(place).as_dvec3()));
            let own = Means { coverage: 1.0, rho: rho * rho_of * colour.xyz(), emission: emission * emission_of };
            sum.add(f64::from(there) / f64::from(POINTS * POINTS), &own);
        }
        sum
    }
}

impl Piece {
    /// Whether as much of the surface is there everywhere.
    fn is_even(&self, mask: &Mask) -> bool {
        !mask.has_images() && self.colours.is_none_or(|colours| colours.iter().all(|colour| colour.w == 1.0))
    }

    /// The mean share of a mask; none where it has a cutoff or others over it, or where more than the mask varies.
    fn mean_share(&self, maps: &Maps, mask: &Mask) -> Option<f64> {
        let is_alone = mask.cutoff.is_none() && mask.over.is_empty();
        let [a, b, c] = self.colours.unwrap_or([DVec4::ONE; 3]);
        let is_plain =
            maps.reflectance.is_none() && maps.emission.is_none() && a.xyz() == b.xyz() && a.xyz() == c.xyz();
        (is_alone && is_plain).then(|| f64::from(mask.factor) * self.mean_coloured_by(mask.texture.as_ref()).w)
    }

    /// Colour and alpha at the point with these weights of the second and third corner.
    fn colour(&self, at: DVec2) -> DVec4 {
        self.colours.map_or(DVec4::ONE, |[a, b, c]| a + at.x * (b - a) + at.y * (c - a))
    }

    fn mean(&self, texture: Option<&Texture>) -> DVec3 {
        texture.map_or(DVec3::ONE, |texture| texture.mean(self.coordinates))
    }

    /// The mean of a texture times the colour of the vertices.
    fn mean_coloured(&self, texture: Option<&Texture>) -> DVec3 {
        self.mean_coloured_by(texture).xyz()
    }

    /// The mean of a texture times the colour of the vertices, and that of its first channel times their alpha.
    fn mean_coloured_by(&self, texture: Option<&Texture>) -> DVec4 {
        let of = |texel: DVec3| texel.extend(texel.x);
        let Some([a, b, c]) = self.colours else { return of(self.mean(texture)) };
        let Some(texture) = texture.filter(|_| a != b || a != c) else {
            return of(self.mean(texture)) * ((a + b + c) / 3.0);
        };
        let part = |corners: [DVec2; 3]| {
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            of(texture.mean(corners.map(|at| weighted(self.coordinates, at)))) * self.colour(middle)
        };
        parts().map(part).sum::<DVec4>() / f64::from(PARTS * PARTS)
    }
}

/// Weights of the corners of the equal triangles that a triangle is made of.
fn parts() -> impl Iterator<Item = [DVec2; 3]> {
    let side = 1.0 / f64::from(PARTS);
    subdivided(PARTS).map(move |middle| {
        // Of every other triangle in a row two corners lie above.
        let upright = (middle.x / side).fract() < 0.5;
        let [right, up] = [DVec2::X, DVec2::Y].map(|axis| if upright { side * axis } else { -side * axis });
        let first = middle - (right + up) / 3.0;
        [first, first + right, first + up]
    })
}

impl Means {
    /// Adds the means of another piece, times its weight.
    pub fn add(&mut self, weight: f64, other: &Means) {
        self.coverage += weight * other.coverage;
        self.rho += weight * other.rho;
        self.emission += weight * other.emission;
    }

    /// rho and E of what there is of a surface: means over the points where it is; nothing where it is nowhere.
    pub fn of_surface(&self) -> (Rgb, Rgb) {
        let over = if self.coverage > 0.0 { 1.0 / self.coverage } else { 0.0 };
        ((over * self.rho).as_vec3(), (over * self.emission).as_vec3())
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
