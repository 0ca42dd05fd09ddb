//! What denoisers of others take beside a picture: albedo, normals, depth; direct and indirect light; two halves.
//!
//! ```text
//! albedo    mean of rho over the pixel, of the first surface                        R, G, B
//! normal    mean over the pixel of the unit normal of the side seen, file's axes    X, Y, Z
//! depth     distance along the view's axis in the middle of the pixel, file's units Z        1e10 where nothing is
//! direct    KE: light that was reflected once                                       R, G, B
//! indirect  K²E + K³E + ...: light that was reflected more often                    R, G, B
//! half A, half B   the picture by each half of all its rays; their mean is the picture
//! ```
//!
//! Albedo and normal are those of Open Image Denoise, depth that of Blender. Halves share the light on patches, so
//! that they agree in what that is off by.
//!
//! Not handled: guides seen in mirrors or through glass, which there are none of; motion.

use glam::{DVec3, Vec2};
use rayon::prelude::*;

use halflight::light::Rgb;
use halflight::pictures::{NamedPicture, Picture, Shows, Size};
use halflight::rays::sobol::{Sobol, hash};
use halflight::rays::{Ray, Rays, Side};
use halflight::render::{Layer, LayerKind};
use halflight::scene::{Scene, Sides};

/// Camera rays of a pixel: shares of surfaces within it are known to about a hundredth.
const RAYS: u32 = 32;
/// The depth of what is not there, as Blender writes it.
const NOWHERE: f32 = 1e10;

/// What is seen through pixels.
#[derive(Clone, Debug)]
pub struct Guides {
    /// Reflectance.
    pub albedo: Picture,
    /// Directions, each of length 1 at most.
    pub normal: Picture,
    /// Distances, all channels alike.
    pub depth: Picture,
}

/// What one ray sees.
struct Seen {
    albedo: Rgb,
    normal: DVec3,
    depth: f32,
}

impl Guides {
    /// Of a picture of a scene by its camera.
    pub fn new(scene: &Scene, rays: &Rays, size: Size) -> Guides {
        let sobol = Sobol::new(RAYS as usize, 2);
        let see = |k: usize, at: Vec2| see(scene, rays, ray(scene, size, k, at));
        let pixel = |k: usize| {
            let points = (0..RAYS).map(|i| Vec2::from([0, 1].map(|d| sobol.point(i, d, hash(k as u32, 0)))));
            let share = 1.0 / RAYS as f32;
            let add = |(albedo, normal): (Rgb, Rgb), seen: Seen| {
                (albedo + share * seen.albedo, normal + share * seen.normal.as_vec3())
            };
            let (albedo, normal) = points.filter_map(|at| see(k, at)).fold((Rgb::ZERO, Rgb::ZERO), add);
            let depth = see(k, Vec2::splat(0.5)).map_or(NOWHERE, |seen| seen.depth);
            [albedo, normal, Rgb::splat(depth)]
        };
        let all: Vec<[Rgb; 3]> = (0..size.width * size.height).into_par_iter().map(pixel).collect();
        let picture = |c: usize| Picture {
            width: size.width,
            height: size.height,
            pixels: all.iter().map(|own| own[c]).collect(),
        };
        Guides { albedo: picture(0), normal: picture(1), depth: picture(2) }
    }
}

/// The ray through a point of pixel k, in the unit square from its upper left corner.
fn ray(scene: &Scene, Size { width, height }: Size, k: usize, at: Vec2) -> Ray {
    let (x, y) = ((k % width) as f32 + at.x, (k / width) as f32 + at.y);
    let (origin, direction) = scene.camera.ray(x / width as f32, y / height as f32, width as f32 / height as f32);
    Ray { origin, direction, source: None }
}

/// What a ray sees; none beyond all surfaces, and on the sky.
fn see(scene: &Scene, rays: &Rays, ray: Ray) -> Option<Seen> {
    let hit = rays.closest(&ray).filter(|hit| !rays.is_sky(hit.face))?;
    let position = ray.at(hit.t);
    let [a, b, c] = scene.exact_corners(hit.face);
    let front = (b - a).cross(c - a).normalize_or_zero();
    let is_black = hit.side == Side::Back && scene.material(hit.face).sides == Sides::One;
    let to_file = |p: glam::Vec3| scene.frame.to_file(p.as_dvec3());
    let along = to_file(position) - to_file(ray.origin);
    Some(Seen {
        albedo: if is_black { Rgb::ZERO } else { scene.rho_at(hit.face, position) },
        normal: if hit.side == Side::Front { front } else { -front },
        depth: along.dot(scene.camera.forward.as_dvec3()) as f32,
    })
}

/// Light taken apart as denoisers take it.
#[derive(Clone, Debug)]
pub struct LightParts {
    /// Reflected once.
    pub direct: Picture,
    /// Reflected more often.
    pub indirect: Picture,
    /// By the first half of all rays.
    pub half_a: Picture,
    /// By the second.
    pub half_b: Picture,
}

impl LightParts {
    /// From the bounces of a picture; none where it was not taken apart into them.
    pub fn new(layers: &[Layer]) -> Option<LightParts> {
        let black = layers.first()?.light.picture.scaled(0.0);
        let is_bounce = |layer: &&Layer| matches!(layer.kind, LayerKind::Bounce(_) | LayerKind::BouncesFrom(_));
        let bounces: Vec<&Layer> = layers.iter().filter(is_bounce).collect();
        let sum = |of: &[&Layer], half: f32| {
            let add = |sum: Picture, own: &&Layer| {
                let with_half = own.light.picture.plus(&own.light.half.scaled(half));
                with_half.and_then(|own| sum.plus(&own)).unwrap_or(sum)
            };
            of.iter().fold(black.clone(), add)
        };
        (!bounces.is_empty()).then(|| LightParts {
            direct: sum(&bounces[1.min(bounces.len())..2.min(bounces.len())], 0.0),
            indirect: sum(&bounces[2.min(bounces.len())..], 0.0),
            half_a: sum(&bounces, 1.0),
            half_b: sum(&bounces, -1.0),
        })
    }

    /// Them by their names in files.
    pub fn named(&self) -> [NamedPicture<&Picture>; 4] {
        let layer = |name: &str, picture| NamedPicture { name: name.into(), shows: Shows::Light, picture };
        [
            layer("direct", &self.direct),
            layer("indirect", &self.indirect),
            layer("half A", &self.half_a),
            layer("half B", &self.half_b),
        ]
    }
}

impl Guides {
    /// Them by their names in files.
    pub fn named(&self) -> [NamedPicture<&Picture>; 3] {
        let layer = |name: &str, shows, picture| NamedPicture { name: name.into(), shows, picture };
        [
            layer("albedo", Shows::Reflectance, &self.albedo),
            layer("normal", Shows::Direction, &self.normal),
            layer("depth", Shows::Distance, &self.depth),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The back wall of the Cornell box is grey, faces the camera and stands 1359.2 in front of it; this pixel sees it
    /// above both blocks.
    #[test]
    fn a_wall_that_faces_the_camera_is_known_exactly() {
        let scene = Scene::open("cornell-box").expect("a built-in scene");
        let guides = Guides::new(&scene, &Rays::new(&scene), Size { width: 9, height: 9 });
        let pixel = 2 * 9 + 4;
        let wall = guides.albedo.pixels[pixel];
        assert!(scene.materials.iter().any(|m| (m.rho - wall).abs().max_element() < 1e-6), "{wall}");
        assert!((guides.normal.pixels[pixel] - Rgb::NEG_Z).abs().max_element() < 1e-6);
        assert!((guides.depth.pixels[pixel].x - 1359.2).abs() < 0.1, "{}", guides.depth.pixels[pixel]);
    }
}
