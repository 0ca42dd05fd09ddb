//! Means of what is reflected and emitted over pieces of faces.
//!
//! The mean over a texture is exact ([`crate::scene::textures::Texture::mean`]), and so is that over colours of
//! vertices, which are linear: the mean of the corners. Where both meet, each of 64 parts of a piece has the exact mean
//! of the texture times the colour of its middle. Over a mask with an image or with alpha of vertices the mean is that
//! of a grid of points.
//!
//! Not handled: single points ([`crate::scene::textured`]).

use glam::{DVec2, DVec3, DVec4, Vec3, Vec4Swizzles};

use crate::light::Rgb;
use crate::scene::model::{Material, Scene};
use crate::scene::textures::mean::{subdivided, weighted};
use crate::scene::textures::{Mask, Texture};

/// Points to a side of a triangle that the means of masked surfaces are taken over.
const POINTS: u32 = 24;
/// Parts to a side of a triangle over each of which the colour of vertices counts as that of the middle.
const PARTS: u32 = 8;

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
    /// Means over a piece, which is asked for where something differs from point to point, and told whether by colours
    /// of vertices.
    fn means(&self, piece: impl Fn(bool) -> Piece) -> Means {
        let (rho, emission) = (self.rho.as_dvec3(), self.emission.as_dvec3());
        let Some(maps) = &self.maps else { return Means { coverage: 1.0, rho, emission } };
        let piece = piece(maps.vertex_colours);
        let share = |mask: &Mask| f64::from(mask.at(DVec2::ZERO, 1.0));
        let even = match &maps.mask {
            None => Some(1.0),
            Some(mask) => piece.is_even(mask).then(|| share(mask)),
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

    /// Colour and alpha at the point with these weights of the second and third corner.
    fn colour(&self, at: DVec2) -> DVec4 {
        self.colours.map_or(DVec4::ONE, |[a, b, c]| a + at.x * (b - a) + at.y * (c - a))
    }

    fn mean(&self, texture: Option<&Texture>) -> DVec3 {
        texture.map_or(DVec3::ONE, |texture| texture.mean(self.coordinates))
    }

    /// The mean of a texture times the colour of the vertices.
    fn mean_coloured(&self, texture: Option<&Texture>) -> DVec3 {
        let Some([a, b, c]) = self.colours else { return self.mean(texture) };
        let Some(texture) = texture.filter(|_| a != b || a != c) else {
            return self.mean(texture) * ((a + b + c) / 3.0).xyz();
        };
        let part = |corners: [DVec2; 3]| {
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            texture.mean(corners.map(|at| weighted(self.coordinates, at))) * self.colour(middle).xyz()
        };
        parts().map(part).sum::<DVec3>() / f64::from(PARTS * PARTS)
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
