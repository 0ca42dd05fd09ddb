//! The luminaires of a scene: which emitters get a closed form, and the pieces that they are divided into.
//!
//! An emitting material is carried by luminaires, one for each object, where hemisphere rays would miss it too often.
//! The choice is the material's, because a patch has one material but may span objects. Of N hemisphere rays a share F
//! meets the emitter, so light from it has the relative variance `(1 - F) / (F N)`. A luminaire of n faces takes its
//! closed form and one visibility ray, as long as `1 + PRICE n` hemisphere rays, and leaves the variance `(1 - V) / V`
//! where the share V of it is visible, 1 if that is a half. So luminaires are chosen where
//!
//! ```text
//! (1 - F) / F  >  1 + PRICE n          F < 1 / (2 + PRICE n)
//! ```
//!
//! F is the mean of the closed form over points of the reflecting surfaces that have the emitter above their horizon. A
//! wide window far away is small by that measure; a sky around everything, or a furnace, is large.
//!
//! Luminaires are divided into connected components, which share a corner, as exporters often write all luminaires as
//! one object, and those that are not convex halved until few faces remain. A face of a convex luminaire cannot hide
//! another from where that one's front is visible, so that a ball of a thousand faces does not count as a thousand
//! occluders of itself.
//!
//! Not handled: occlusion, so that a sky behind a window counts as large. Luminaires of too many faces to test
//! convexity cast shadows on themselves, which costs time and no accuracy.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::iter::{IntoParallelRefMutIterator, ParallelIterator};

use crate::direct::Luminaire;
use crate::direct::emitters::halving::{Placed, halve};
use crate::direct::emitters::luminaire_texture::{EmissionTexture, UnevenEmission, is_textured};
use crate::form_factors::lambert::Outline;
use crate::form_factors::point_to_polygon;
use crate::light::Rgb;
use crate::light::shares::Shares;
use crate::rays::Side;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::warp::triangle_point;
use crate::scene::{Emitters, PunctualLight, Scene, Sides};
use crate::surfaces::coplanar::connected;

/// Cost of one triangle of a closed form over that of a ray, about (on one core 20 ns, and 300 ns in a small room). A
/// luminaire of two faces is carried up to F = 0.47, one of a hundred to 0.12.
const PRICE: f64 = 1.0 / 16.0;
/// Faces that a receiver evaluates at most: light cuts spare it most of more ([`crate::direct::many::light_cut`]).
const MOST_FACES: usize = 128;
/// Points of the reflecting surfaces.
const POINTS: usize = 256;
/// Closed forms of triangles for all points together; of more faces only every so many are taken.
const MOST_FORMS: usize = 1 << 19;

/// A side of a face, its corners counter-clockwise seen from there.
type Turned = [DVec3; 3];

/// Per material: whether it emits, has no mask, and is small enough, as seen from the surfaces that reflect,
/// for luminaires to carry it.
pub(crate) fn carried(scene: &Scene) -> Vec<bool> {
    let points = receivers(scene);
    let carried = |m: usize| {
        let material = &scene.materials[m];
        let whole = material.maps.as_ref().is_none_or(|maps| maps.mask.is_none());
        material.emits() && whole && !scene.is_sky_material(m) && {
            let faces = sides(scene, |face| face == m as u32);
            let evaluated = faces.len().min(MOST_FACES) as f64;
            mean_form(&points, &faces) < 1.0 / (2.0 + PRICE * evaluated)
        }
    };
    (0..scene.materials.len()).map(carried).collect()
}

/// The sides that reflect and emit of the faces whose material is `wanted`.
fn sides(scene: &Scene, wanted: impl Fn(u32) -> bool) -> Vec<Turned> {
    let mut list = Vec::new();
    for (f, face) in scene.faces.iter().enumerate() {
        if wanted(face.material) {
            let [a, b, c] = scene.exact_corners(f as u32);
            list.push([a, b, c]);
            if scene.material(f as u32).sides == Sides::Two {
                list.push([a, c, b]);
            }
        }
    }
    list
}

/// Points of the reflecting surfaces, spread evenly over their area, with their normals.
fn receivers(scene: &Scene) -> Vec<(DVec3, DVec3)> {
    let reflects = |m: u32| scene.materials[m as usize].rho != Rgb::ZERO;
    let faces = sides(scene, reflects);
    let shares = Shares::of(faces.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length()));
    let sobol = Sobol::new(POINTS, 2);
    let point = |k: usize| {
        let face = faces[shares.draw((k as f64 + 0.5) / POINTS as f64).index];
        let [a, b, c] = face;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let (u, v) = (sobol.point(k as u32, 0, 0), sobol.point(k as u32, 1, 0));
        let place = triangle_point(face.map(|p| p.as_vec3()), u, v);
        (place.as_dvec3(), normal)
    };
    let count = if faces.is_empty() { 0 } else { POINTS };
    (0..count).map(point).collect()
}

/// Mean form factor to the faces from those of the points that they are above the horizon of; 0 where there are none.
fn mean_form(points: &[(DVec3, DVec3)], faces: &[Turned]) -> f64 {
    let stride = (faces.len() * points.len()).div_ceil(MOST_FORMS).max(1);
    let from = |(k, &(x, n)): (usize, &(DVec3, DVec3))| -> f64 {
        let first = hash(k as u32, 0x1a6e) as usize % stride;
        let taken = faces.iter().skip(first).step_by(stride);
        let forms = taken.map(|t| point_to_polygon(n, &t.map(|p| p - x)));
        stride as f64 * forms.sum::<f64>()
    };
    let forms: Vec<f64> = points.iter().enumerate().map(from).collect();
    let count = forms.iter().filter(|&&f| f > 0.0).count();
    forms.iter().sum::<f64>() / count.max(1) as f64
}

/// Faces of a piece at most.
const PIECE: usize = 16;

/// The luminaires that connected faces make up: convex ones whole, others in pieces of few faces.
fn divided(scene: &Scene, parts: Vec<ConnectedFaces>) -> Vec<Vec<u32>> {
    let mut pieces = Vec::new();
    for ConnectedFaces { faces, is_convex } in parts {
        if is_convex && faces.len() <= Outline::MOST_FACES {
            pieces.push(faces);
            continue;
        }
        let place = |face: u32| {
            let [a, b, c] = scene.corners(face).map(|p| p.as_dvec3());
            let direction = (b - a).cross(c - a).normalize_or_zero();
            Placed { place: (a + b + c) / 3.0, direction, number: face }
        };
        divide(&mut faces.into_iter().map(place).collect::<Vec<_>>(), &mut pieces);
    }
    pieces
}

/// Halves faces down to pieces of few.
fn divide(faces: &mut [Placed], pieces: &mut Vec<Vec<u32>>) {
    if faces.len() <= PIECE {
        let mut piece: Vec<u32> = faces.iter().map(|f| f.number).collect();
        piece.sort_unstable();
        return pieces.push(piece);
    }
    let (left, right) = halve(faces);
    divide(left, pieces);
    divide(right, pieces);
}

/// Faces times corners of one luminaire at most: a fifth of a second.
const MOST_TESTS: usize = 200_000_000;
/// Heights below this lie in the plane: a few roundings of unit coordinates.
const FLAT: f64 = 1e-6;

/// Emitting faces that share corners.
struct ConnectedFaces {
    faces: Vec<u32>,
    /// They hide no part of each other.
    is_convex: bool,
}

impl ConnectedFaces {
    /// Those that groups of faces are made of.
    fn of_groups(scene: &Scene, groups: &[Vec<u32>]) -> Vec<ConnectedFaces> {
        let parts = groups.iter().flat_map(|group| connected(scene, group, |_| ()));
        parts.map(|faces| ConnectedFaces { is_convex: is_convex(scene, &faces), faces }).collect()
    }
}

/// For each face of the scene the number of the convex luminaire it belongs to, if to one; empty without such.
fn convex_luminaires(scene: &Scene, parts: &[ConnectedFaces]) -> Vec<Option<u32>> {
    // Faces in one plane do not hide each other anyway.
    let convex = parts.iter().filter(|part| part.is_convex && part.faces.len() > 2);
    let mut numbers = Vec::new();
    for (number, part) in (0..).zip(convex) {
        numbers.resize(scene.faces.len(), None);
        part.faces.iter().for_each(|&face| numbers[face as usize] = Some(number));
    }
    numbers
}

/// Whether no corner rises above the plane of any face.
fn is_convex(scene: &Scene, faces: &[u32]) -> bool {
    let vertices = |&f: &u32| scene.faces[f as usize].vertices;
    let mut corners: Vec<u32> = faces.iter().flat_map(vertices).collect();
    corners.sort_unstable();
    corners.dedup();
    let place = |&v: &u32| scene.vertices[v as usize].as_dvec3();
    let corners: Vec<DVec3> = corners.iter().map(place).collect();
    let below = |&face: &u32| {
        let [a, b, c] = scene.corners(face).map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        corners.iter().all(|p| normal.dot(*p - a) <= FLAT)
    };
    faces.len() * corners.len() <= MOST_TESTS && faces.iter().all(below)
}

/// The luminaires of a scene, punctual lights, and which materials' emission they carry.
#[derive(Clone, Debug)]
pub struct Luminaires {
    /// Evaluated by closed form.
    pub list: Vec<Luminaire>,
    /// Per material: its emission is the luminaires', so hemisphere rays must not count it again.
    pub carries: Vec<bool>,
    /// Per material: the radiance of its luminaires.
    pub(crate) radiances: Vec<Rgb>,
    /// Punctual lights that shine.
    pub punctual: Vec<PunctualLight>,
    /// The emitters that are kept apart.
    pub emitters: Arc<Emitters>,
    /// The emitter that each punctual light is.
    punctual_emitters: Vec<usize>,
    /// For each face the convex luminaire it belongs to, if to one; empty without such.
    convex_luminaires: Vec<Option<u32>>,
}

impl Luminaires {
    /// Chooses the emitters of a scene that get a closed form; all light is kept together.
    pub fn new(scene: &Scene) -> Luminaires {
        Luminaires::apart(scene, Emitters::together())
    }

    /// Chooses the emitters of a scene that get a closed form; the light of each of the `emitters` is kept apart.
    pub fn apart(scene: &Scene, emitters: Arc<Emitters>) -> Luminaires {
        let shining = scene.lights.iter().enumerate().filter(|(_, light)| light.shines());
        let (punctual, punctual_emitters) = shining.map(|(k, light)| (light.clone(), emitters.of_light(k))).unzip();
        let radiances = scene.materials.iter().map(|material| material.emission).collect();
        let (carries, list, convex_luminaires) = (carried(scene), Vec::new(), Vec::new());
        let mut luminaires =
            Luminaires { list, carries, radiances, punctual, emitters, punctual_emitters, convex_luminaires };
        let textures = luminaires.textures(scene);
        textures.iter().for_each(|(&m, texture)| luminaires.radiances[m as usize] *= texture.mean());
        let mut all = luminaires.with_even(scene);
        let count = all.list.len();
        all.list.par_iter_mut().for_each(|luminaire| {
            let texture = textures.get(&scene.faces[luminaire.triangles[0].face as usize].material);
            let faces = || luminaire.triangles.iter().map(|t| (t.face, t.exact)).collect::<Vec<_>>();
            luminaire.uneven = texture.map(|texture| UnevenEmission::new(texture.clone(), &faces(), count));
        });
        // Pieces where the texture is black.
        all.list.retain(|luminaire| luminaire.uneven.as_ref().is_none_or(UnevenEmission::shines));
        all
    }

    /// The textures of the carried materials that have one.
    fn textures(&self, scene: &Scene) -> HashMap<u32, Arc<EmissionTexture>> {
        let carried = (0..scene.materials.len()).filter(|&m| self.carries[m] && is_textured(scene, m));
        carried.filter_map(|m| Some((m as u32, Arc::new(EmissionTexture::new(scene, m)?)))).collect()
    }

    /// Adds the luminaires of the carried materials, even ones.
    fn with_even(mut self, scene: &Scene) -> Luminaires {
        let parts = ConnectedFaces::of_groups(scene, &self.groups(scene));
        self.convex_luminaires = convex_luminaires(scene, &parts);
        for faces in divided(scene, parts) {
            let convex = self.convex_luminaire(faces[0]);
            let whole = faces.iter().all(|&f| self.convex_luminaire(f) == convex);
            let radiance = self.radiances[scene.faces[faces[0] as usize].material as usize];
            let emitter = self.emitters.of_face(scene, faces[0]);
            let front = Luminaire::new(scene, radiance, &faces, Side::Front);
            self.list.push(Luminaire { convex_luminaire: convex.filter(|_| whole), emitter, ..front });
            if scene.material(faces[0]).sides == Sides::Two {
                self.list.push(Luminaire { emitter, ..Luminaire::new(scene, radiance, &faces, Side::Back) });
            }
        }
        self
    }

    /// The emitter that light number k of [`Luminaires::punctual`] is.
    pub(crate) fn punctual_emitter(&self, k: usize) -> usize {
        self.punctual_emitters[k]
    }

    /// The convex luminaire that a face belongs to, if to one.
    pub(crate) fn convex_luminaire(&self, face: u32) -> Option<u32> {
        self.convex_luminaires.get(face as usize).copied().flatten()
    }

    /// Faces of the carried materials, an object and material together, in the order of their first faces.
    fn groups(&self, scene: &Scene) -> Vec<Vec<u32>> {
        let mut order: HashMap<(u32, u32), usize> = HashMap::new();
        let mut groups: Vec<Vec<u32>> = Vec::new();
        for (f, face) in scene.faces.iter().enumerate() {
            if self.carries[face.material as usize] {
                let k = *order.entry((face.object, face.material)).or_insert_with(|| {
                    groups.push(Vec::new());
                    groups.len() - 1
                });
                groups[k].push(f as u32);
            }
        }
        groups
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;

    /// A floor of side 2 and a panel above it that faces down, of the given side and height.
    fn under(side: f64, height: f64) -> Scene {
        let floor = Material::new("floor", Rgb::splat(0.5), Rgb::ZERO);
        let glow = Material::new("glow", Rgb::ZERO, Rgb::ONE);
        let square = |a: f64, z: f64, turn: f64| {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            corners.map(|(x, y)| DVec3::new(0.5 * a * x, 0.5 * a * turn * y, z))
        };
        let corners = [square(2.0, 0.0, 1.0), square(side, height, -1.0)].concat();
        let faces = [(vec![0, 1, 2, 3], 0), (vec![4, 5, 6, 7], 1)];
        Scene::from_faces("panel", &corners, &faces, vec![floor, glow]).expect("a correct scene")
    }

    #[test]
    fn emitters_are_chosen_by_solid_angle_and_not_by_area() {
        // Form factors from the floor's middle: 4/(20² pi), 0.24 and 0.99.
        assert_eq!(carried(&under(4.0, 20.0)), [false, true]);
        assert_eq!(carried(&under(2.0, 2.0)), [false, true]);
        assert_eq!(carried(&under(20.0, 1.0)), [false, false]);
    }

    #[test]
    fn the_mean_form_factor_is_that_of_the_catalogue() {
        // Two parallel unit squares one apart, twice as large: Howell's catalogue, C-11.
        let scene = under(2.0, 2.0);
        let form = mean_form(&receivers(&scene), &sides(&scene, |m| m == 1));
        // 256 stratified points: their error is far below the integrand's range of 0.1 over sqrt(256).
        assert!((form - 0.199_825).abs() < 0.1 / 16.0, "{form}");
    }

    #[test]
    fn small_emitters_are_luminaires_and_a_furnace_is_not() {
        for (name, luminaires) in [
            ("cornell-box", true),
            ("furnace", false),
            ("concentric-spheres", true),
            ("furnished-room", true),
            ("two-rooms", true),
        ] {
            let scene = Scene::open(name).expect("built in");
            assert_eq!(carried(&scene).contains(&true), luminaires, "{name}");
        }
    }

    /// Panels of side 0.01 as one object, one every `pitch`; 300 have more faces than one closed form takes.
    fn panels(count: u32, pitch: f64) -> Scene {
        let square = |k: u32| {
            let x = f64::from(k) * pitch;
            [(0.0, 0.0), (0.01, 0.0), (0.01, 0.01), (0.0, 0.01)].map(|(u, v)| DVec3::new(x + u, v, 0.0))
        };
        let corners: Vec<DVec3> = (0..count).flat_map(square).collect();
        let faces: Vec<(Vec<u32>, u32)> = (0..count).map(|k| ((4 * k..4 * k + 4).collect(), 0)).collect();
        let glow = Material::new("glow", Rgb::ZERO, Rgb::ONE);
        Scene::from_faces("panels", &corners, &faces, vec![glow]).expect("a correct scene")
    }

    #[test]
    fn luminaires_that_lie_apart_are_no_pieces_of_one() {
        let pieces = |count: u32, pitch: f64| {
            let scene = panels(count, pitch);
            let parts = ConnectedFaces::of_groups(&scene, &[(0..2 * count).collect()]);
            divided(&scene, parts)
        };
        assert_eq!((pieces(3, 0.02).len(), pieces(300, 0.02).len()), (3, 300));
        // In one plane, too many for one closed form.
        let touching = pieces(300, 0.01);
        assert!(touching.len() < 100 && touching.iter().all(|p| p.len() <= PIECE));
        assert_eq!(touching.iter().map(Vec::len).sum::<usize>(), 600);
    }

    #[test]
    fn a_ball_is_convex_and_a_hollow_is_not() {
        let scene = Scene::open("concentric-spheres").expect("built in");
        // The ball's faces look out of it, the sphere's into it.
        let groups: Vec<Vec<u32>> = (0..scene.objects.len() as u32)
            .map(|o| {
                let own = |f: &u32| scene.faces[*f as usize].object == o;
                (0..scene.faces.len() as u32).filter(own).collect()
            })
            .collect();
        let parts = convex_luminaires(&scene, &ConnectedFaces::of_groups(&scene, &groups));
        for (faces, name) in groups.iter().zip(&scene.objects) {
            let convex = faces.iter().filter(|&&f| parts[f as usize].is_some()).count();
            let radius = |&f: &u32| scene.corners(f)[0].length();
            let ball = faces.iter().all(|f| radius(f) < 0.75);
            assert_eq!(convex, if ball { faces.len() } else { 0 }, "{name}");
        }
        assert!(parts.iter().any(|&p| p.is_some()));
    }
}
