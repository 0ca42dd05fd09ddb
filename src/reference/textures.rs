//! What textures and colours of vertices are at a hit: the tracer's own reading, by the weights of the hit itself.
//!
//! Not handled: sRGB and files, which are the scene's.

use std::sync::Arc;

use glam::{DVec2, Vec2, Vec4, Vec4Swizzles};

use crate::light::Rgb;
use crate::scene::Scene;
use crate::scene::textures::{Filter, Maps, Mask, Texture, Wrap};

/// The textures of a scene's faces.
pub(crate) struct FaceTextures {
    /// By material.
    maps: Vec<Option<Arc<Maps>>>,
    coordinates: Vec<[Vec2; 3]>,
    /// Colour and alpha of the corners; empty where no material goes by them.
    colours: Vec<[Vec4; 3]>,
}

/// Factors on what a material reflects and emits, and the share of it that is there.
pub(crate) struct Texel {
    pub rho: Rgb,
    pub emission: Rgb,
    pub there: f32,
}

impl FaceTextures {
    /// Those of a scene; none where no material has any.
    pub(crate) fn new(scene: &Scene) -> Option<FaceTextures> {
        let maps = scene.materials.iter().map(|material| material.maps.clone()).collect();
        let (coordinates, colours) = (scene.coordinates.clone(), scene.colours.clone());
        scene.is_textured().then_some(FaceTextures { maps, coordinates, colours })
    }

    /// Colour and alpha of the vertices.
    fn vertex_colour(&self, maps: &Maps, face: u32, [u, v]: [f32; 2]) -> Vec4 {
        match self.colours.get(face as usize) {
            Some([a, b, c]) if maps.vertex_colours => (1.0 - u - v) * *a + u * *b + v * *c,
            _ => Vec4::ONE,
        }
    }

    /// At the point of a face with these weights of the second and third corner; none where its material has no
    /// textures.
    pub(crate) fn at(&self, material: u32, face: u32, [u, v]: [f32; 2]) -> Option<Texel> {
        let maps = self.maps[material as usize].as_ref()?;
        let [a, b, c] = self.coordinates.get(face as usize).copied().unwrap_or_default().map(|at| at.as_dvec2());
        let at = (1.0 - f64::from(u) - f64::from(v)) * a + f64::from(u) * b + f64::from(v) * c;
        let colour = |texture: &Option<Texture>| {
            texture.as_ref().map_or(Rgb::ONE, |t| around(t, at).map(|(x, y, w)| w * t.image.colour(x, y)).sum())
        };
        let vertex = self.vertex_colour(maps, face, [u, v]);
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
    let texel = |t: &Texture| around(t, at).map(|(x, y, w)| w * t.image.share(x, y, mask.channel)).sum::<f32>();
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
    use crate::pictures::Texels;
    use crate::scene::textures::Image;

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
