//! What a path needs to know of the faces it meets: place, normal, which sides send, reflectance, tau, emission.
//!
//! A one-sided face neither reflects nor emits behind; tau acts from either side. Textures and colours of vertices are
//! the tracer's own reading, by the weights of the hit. Not handled: smooth normals; sRGB and files, which are the
//! scene's.

use std::sync::Arc;

use glam::{DVec2, Vec2, Vec3, Vec4, Vec4Swizzles};

use halflight::light::{Gloss, Light, Rgb, Transport};
use halflight::rays::{Hit, Side};
use halflight::scene::textures::{Filter, Maps, Mask, Texture, Wrap};
use halflight::scene::{Scene, Sides};

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

/// All faces of a scene.
pub(crate) struct Surfaces {
    facets: Vec<Facet>,
    matter: Vec<Matter>,
    /// Textures of every material.
    maps: Vec<Option<Arc<Maps>>>,
    coordinates: Vec<[Vec2; 3]>,
    /// Colour and alpha of the corners; empty where no material goes by them.
    colours: Vec<[Vec4; 3]>,
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
            maps: scene.materials.iter().map(|material| material.maps.clone()).collect(),
            coordinates: scene.coordinates.clone(),
            colours: scene.colours.clone(),
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
        self.maps.iter().any(Option::is_some)
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
        if let Some(texel) = self.texel(self.facet(face).material, face, at) {
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

/// Factors on what a material reflects and emits, and the share of it that is there.
pub(crate) struct Texel {
    pub rho: Rgb,
    pub emission: Rgb,
    pub there: f32,
}

impl Surfaces {
    /// The textures of a material and colours of vertices at the point of a face with these weights of the second and
    /// third corner; none where the material has none.
    fn texel(&self, material: u32, face: u32, [u, v]: [f32; 2]) -> Option<Texel> {
        let maps = self.maps[material as usize].as_ref()?;
        let [a, b, c] = self.coordinates.get(face as usize).copied().unwrap_or_default().map(|at| at.as_dvec2());
        let at = (1.0 - f64::from(u) - f64::from(v)) * a + f64::from(u) * b + f64::from(v) * c;
        let colour = |texture: &Option<Texture>| {
            texture.as_ref().map_or(Rgb::ONE, |t| around(t, at).map(|(x, y, w)| w * t.image.colour(x, y)).sum())
        };
        let vertex = match self.colours.get(face as usize) {
            Some([a, b, c]) if maps.vertex_colours => (1.0 - u - v) * *a + u * *b + v * *c,
            _ => Vec4::ONE,
        };
        let there = maps.mask.as_ref().map_or(1.0, |mask| {
            let open: f32 = mask.over.iter().map(|other| 1.0 - share(other, at, 1.0)).product();
            open * share(mask, at, vertex.w)
        });
        let rho = colour(&maps.reflectance) * vertex.xyz();
        Some(Texel { rho, emission: colour(&maps.emission), there })
    }
}

/// The share of a surface that a mask alone leaves.
fn share(mask: &Mask, at: DVec2, alpha: f32) -> f32 {
    let texel = |t: &Texture| around(t, at).map(|(x, y, w)| w * t.image.colour(x, y).x).sum::<f32>();
    let share = mask.factor * alpha * mask.texture.as_ref().map_or(1.0, texel);
    mask.cutoff.map_or(share.clamp(0.0, 1.0), |cutoff| f32::from(u8::from(share >= cutoff)))
}

/// The texels that make a texture's value at some coordinates, with their weights.
fn around(texture: &Texture, at: DVec2) -> impl Iterator<Item = (usize, usize, f32)> {
    let (width, height) = (texture.image.width(), texture.image.height());
    let place = texture.placement.transform_point2(at);
    let (x, y) = (place.x * width as f64, place.y * height as f64);
    let nearest = texture.filter == Filter::Nearest;
    let pair = |t: f64| {
        if nearest {
            return [(t.floor(), 1.0), (t.floor(), 0.0)];
        }
        let left = (t - 0.5).floor();
        let beyond = t - 0.5 - left;
        [(left, 1.0 - beyond), (left + 1.0, beyond)]
    };
    let wraps = texture.wrap;
    let (columns, rows) = (pair(x), pair(y));
    (0..4).map(move |k| {
        let ((i, wx), (j, wy)) = (columns[k % 2], rows[k / 2]);
        (wrapped(wraps[0], i, width), wrapped(wraps[1], j, height), (wx * wy) as f32)
    })
}

/// The texel at a whole number, beyond the image too.
fn wrapped(wrap: Wrap, i: f64, n: usize) -> usize {
    let size = n as f64;
    let turn = |period: f64| i - period * (i / period).floor();
    let found = match wrap {
        Wrap::Repeat => turn(size),
        Wrap::Mirror if turn(2.0 * size) >= size => 2.0 * size - 1.0 - turn(2.0 * size),
        Wrap::Mirror => turn(2.0 * size),
        Wrap::Clamp => i,
    };
    found.clamp(0.0, size - 1.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::pictures::Texels;
    use halflight::scene::textures::Image;

    #[test]
    fn both_readings_of_a_texture_agree() {
        let codes = (0..5 * 3 * 4).map(|k| (k * k * 7 + k * 13) as u8).collect();
        let image = Arc::new(Image::new(Texels { width: 5, height: 3, channels: 4, codes }));
        let placement = Texture::upright(DVec2::new(1.5, -0.7), DVec2::new(0.2, 0.1));
        for filter in [Filter::Linear, Filter::Nearest] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                let texture = Texture { image: image.clone(), placement, wrap: [wrap; 2], filter };
                for k in 0..1000 {
                    let at = 3.0 * DVec2::new(f64::from(k) * 0.618, f64::from(k) * 0.414).fract() - 1.0;
                    let own: Rgb = around(&texture, at).map(|(x, y, w)| w * image.colour(x, y)).sum();
                    assert!((own - texture.colour(at)).abs().max_element() < 1e-5, "{filter:?} {wrap:?} {at}");
                }
            }
        }
    }
}
