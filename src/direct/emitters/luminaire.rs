//! One luminaire: an emitting surface whose light has a closed form; its triangles, points drawn on them, and the
//! convex polygons that they make up.
//!
//! Not handled: which emitters are luminaires ([`crate::direct::emitters::luminaires`]); polygons of more than two
//! triangles.

use glam::{DVec3, Vec3};

use crate::direct::emitters::emission_tree::EmissionMoments;
use crate::direct::emitters::luminaire_texture::UnevenEmission;
use crate::form_factors::lambert::Outline;
use crate::form_factors::plane::sees_front;
use crate::form_factors::point_to_polygon;
use crate::form_factors::shadow::{Caster, Pieces, visible_form};
use crate::light::Rgb;
use crate::light::shares::draw;
use crate::rays::warp::triangle_point;
use crate::rays::{End, Side};
use crate::scene::{Bounds, Scene};

/// One emitting surface of uniform radiance, or with a texture.
#[derive(Clone, Debug)]
pub struct Luminaire {
    /// Emitted radiance, W/(m² sr); the mean over its material's faces where it has a texture.
    pub radiance: Rgb,
    /// Total area, unit coordinates squared.
    pub area: f64,
    /// The emitter that it is a part of.
    pub emitter: usize,
    /// The convex luminaire it belongs to, if to one.
    pub(crate) convex_luminaire: Option<u32>,
    /// Where it has a texture.
    pub(crate) uneven: Option<UnevenEmission>,
    pub(crate) triangles: Vec<EmittingTriangle>,
    /// Area of the triangles up to and including each over the luminaire's.
    pub(crate) shares: Vec<f32>,
    /// Convex polygons that cover it, as few as are easily found.
    pub(crate) polygons: Vec<Vec<DVec3>>,
    /// None where it has too many faces; then points are drawn on it.
    pub(crate) outline: Option<Outline>,
    pub(crate) around: Around,
}

/// A sphere around a luminaire, and the normal that all of its faces have.
#[derive(Clone, Debug)]
pub(crate) struct Around {
    middle: Vec3,
    radius: f32,
    normal: Option<Vec3>,
}

impl Around {
    fn new(triangles: &[EmittingTriangle]) -> Around {
        let Bounds { low, high } = Bounds::of(triangles.iter().flat_map(|t| t.exact));
        let middle = 0.5 * (low.as_vec3() + high.as_vec3());
        let first = triangles.first().map_or(DVec3::Z, |t| t.normal);
        let is_flat = triangles.iter().all(|t| t.normal.dot(first) > FLAT);
        let radius = triangles.iter().flat_map(|t| t.corners).map(|p| p.distance(middle)).fold(0.0, f32::max);
        Around { middle, radius, normal: is_flat.then_some(first.as_vec3()) }
    }
}

/// Share of a textured luminaire's form factor that counts as all of it, up to rounding.
const WHOLE: f64 = 1.0 - 1e-9;
/// Cosine to which the normals of a flat luminaire agree.
const FLAT: f64 = 1.0 - 1e-6;

impl Luminaire {
    pub(crate) fn new(scene: &Scene, radiance: Rgb, faces: &[u32], side: Side) -> Luminaire {
        let mut triangles: Vec<EmittingTriangle> = Vec::with_capacity(faces.len());
        let (mut sum, mut until) = (0.0, Vec::with_capacity(faces.len()));
        for &face in faces {
            let mut corners = scene.corners(face);
            if side == Side::Back {
                corners.swap(1, 2);
            }
            sum += scene.area(face);
            until.push(sum);
            let exact = corners.map(|p| p.as_dvec3());
            let normal = (exact[1] - exact[0]).cross(exact[2] - exact[0]).normalize();
            triangles.push(EmittingTriangle { corners, exact, normal, face });
        }
        Luminaire {
            radiance,
            area: sum,
            emitter: 0,
            convex_luminaire: None,
            uneven: None,
            outline: Outline::new(triangles.iter().map(|t| t.exact)),
            around: Around::new(&triangles),
            polygons: polygons(&triangles),
            shares: until.iter().map(|until| (until / sum) as f32).collect(),
            triangles,
        }
    }

    /// Form factor from a point with unit normal to all of the luminaire without occlusion; `None` where it has too
    /// many faces for the closed form to pay.
    pub fn closed_form(&self, x: Vec3, n: Vec3) -> Option<f64> {
        let outline = self.outline.as_ref()?;
        Some(outline.form(x.as_dvec3(), n.as_dvec3()))
    }

    /// About the light that it sends to a point with unit normal, channels added, without occlusion; 0 only where it
    /// sends none, as its distance and cosines are those most in its favour within a sphere around it.
    pub(crate) fn roughly(&self, x: Vec3, n: Vec3) -> f32 {
        let to = self.around.middle - x;
        let radius = self.around.radius;
        let squared = to.length_squared() + radius * radius;
        let cosine = |along: f32| ((along + radius) / squared.sqrt()).clamp(0.0, 1.0);
        let leaving = self.around.normal.map_or(1.0, |normal| cosine(-to.dot(normal)));
        self.area as f32 * self.radiance.element_sum() * cosine(to.dot(n)) * leaving / squared
    }

    /// Form factor from a point with unit normal to all of the luminaire without occlusion, face by face where it has
    /// too many for one closed form.
    pub fn exact_form(&self, x: Vec3, n: Vec3) -> f64 {
        self.closed_form(x, n).unwrap_or_else(|| {
            let (x, n) = (x.as_dvec3(), n.as_dvec3());
            let relative = self.triangles.iter().map(|t| t.exact.map(|p| p - x));
            relative.filter(|corners| sees_front(corners)).map(|corners| point_to_polygon(n, &corners)).sum()
        })
    }

    /// The light of all of it over its radiance, channel by channel, at a point with unit normal to which its form
    /// factor is `form`, without occlusion: that itself, unless it has a texture, of which a node may have the relative
    /// error `exactness`.
    pub fn light(&self, x: Vec3, n: Vec3, form: f64, exactness: f64) -> DVec3 {
        match &self.uneven {
            Some(own) if form > 0.0 => own.light(x.as_dvec3(), n.as_dvec3(), form, exactness),
            _ => DVec3::splat(form),
        }
    }

    /// The light that a point with unit normal gets from the part of it visible behind `casters` over its radiance,
    /// channel by channel; `None` where that part is too ragged, or a part of a texture.
    pub(crate) fn visible_light(
        &self,
        x: Vec3,
        n: Vec3,
        casters: impl ExactSizeIterator<Item = Caster>,
        exactness: f64,
        memory: &mut Pieces,
    ) -> Option<DVec3> {
        let whole = self.exact_form(x, n);
        if casters.len() == 0 || whole == 0.0 {
            return Some(self.light(x, n, whole, exactness));
        }
        let form = self.visible_form(x, n, casters, memory)?;
        // The mean emission of a part of a texture differs from that of the whole.
        let is_part = self.is_textured() && form > 0.0 && form < WHOLE * whole;
        (!is_part).then(|| self.light(x, n, form, exactness))
    }

    /// Whether all of it faces one way.
    pub(crate) fn is_flat(&self) -> bool {
        self.around.normal.is_some()
    }

    /// Whether its radius exceeds a share of the distance of its middle from a point.
    pub(crate) fn is_near(&self, x: Vec3, share: f32) -> bool {
        self.around.radius > share * self.around.middle.distance(x)
    }

    /// Whether its emission is not uniform.
    pub fn is_textured(&self) -> bool {
        self.uneven.is_some()
    }

    /// Moments of the emission of triangle k over the luminaire's radiance, in shares of its edges; none where it is
    /// uniform.
    pub(crate) fn emitted_moments(&self, k: usize) -> Option<EmissionMoments> {
        self.uneven.as_ref().map(|own| own.moments(k))
    }

    /// Its triangles, counter-clockwise seen from the emitting side.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.triangles.iter().map(|t| t.exact)
    }

    /// Corners of its triangles, three by three, counter-clockwise seen from the emitting side.
    pub(crate) fn corners(&self) -> impl Iterator<Item = DVec3> {
        self.triangles.iter().flat_map(|t| t.exact)
    }

    /// Form factor from a point to the part of the luminaire visible behind `casters`; `None` where that is too ragged,
    /// or the faces are too many.
    pub(crate) fn visible_form(
        &self,
        x: Vec3,
        n: Vec3,
        casters: impl Iterator<Item = Caster>,
        memory: &mut Pieces,
    ) -> Option<f64> {
        self.outline.as_ref()?;
        let polygons = self.polygons.iter().map(|p| &p[..]);
        visible_form(x.as_dvec3(), n.as_dvec3(), polygons, casters, memory)
    }

    /// The point at (u, v) in the unit square, uniform in area.
    pub fn point(&self, u: f32, v: f32) -> EmittingPoint {
        let drawn = draw(&self.shares, |&share| share, u);
        let t = &self.triangles[drawn.index];
        let position = triangle_point(t.corners, drawn.again(), v);
        let share = self.uneven.as_ref().map_or(DVec3::ONE, |own| own.share(t.face, position));
        EmittingPoint { position, normal: t.normal, face: t.face, share }
    }
}

/// One triangle of a luminaire, counter-clockwise seen from the emitting side.
#[derive(Clone, Debug)]
pub(crate) struct EmittingTriangle {
    pub corners: [Vec3; 3],
    pub exact: [DVec3; 3],
    pub normal: DVec3,
    pub face: u32,
}

/// Triangles, those that follow one another and make up a convex quadrangle of one plane taken together.
fn polygons(triangles: &[EmittingTriangle]) -> Vec<Vec<DVec3>> {
    let mut polygons: Vec<Vec<DVec3>> = Vec::new();
    let mut rest = triangles;
    while let [first, others @ ..] = rest {
        let joined = others.first().and_then(|second| quadrangle(first, second));
        rest = &others[usize::from(joined.is_some())..];
        polygons.push(joined.map_or_else(|| first.exact.to_vec(), |q| q.to_vec()));
    }
    polygons
}

/// The quadrangle that two triangles make up, if they share an edge and a plane and it is convex.
fn quadrangle(first: &EmittingTriangle, second: &EmittingTriangle) -> Option<[DVec3; 4]> {
    let n = first.normal;
    let turned = |t: &[DVec3; 3], k: usize| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
    let turns = (0..9).map(|k| (turned(&first.exact, k / 3), turned(&second.exact, k % 3)));
    // c-a of the first, a-c of the second.
    let shared = turns.into_iter().find(|([a, _, c], [p, q, _])| (a, c) == (p, q));
    let ([a, b, c], [_, _, d]) = shared?;
    let corners = [a, b, c, d];
    let size = (c - a).length();
    let flat = n.dot(d - a).abs() <= 1e-12 * size;
    let bends = |k: usize| {
        let [p, q, r] = [0, 1, 2].map(|i| corners[(k + i) % 4]);
        n.dot((q - p).cross(r - q)) > 0.0
    };
    (flat && (0..4).all(bends)).then_some(corners)
}

/// A point drawn on a luminaire.
#[derive(Clone, Copy, Debug)]
pub struct EmittingPoint {
    /// Unit coordinates.
    pub position: Vec3,
    /// Unit normal of the emitting side.
    pub normal: DVec3,
    /// The face it lies on.
    pub face: u32,
    /// Its emission over the luminaire's radiance, channel by channel.
    pub share: DVec3,
}

impl EmittingPoint {
    /// The point as an end of a visibility ray.
    pub fn end(&self) -> End {
        (self.position, Some(self.face))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::Luminaires;
    use crate::rays::sobol::hash;
    use crate::scene::Sides;

    /// A dark floor and panels of one emitting material, as many as `objects`, each its own object.
    fn panels(objects: u32, size: f64) -> Scene {
        let floor = crate::scene::Material::new("floor", Rgb::splat(0.5), Rgb::ZERO);
        let glow = crate::scene::Material::new("glow", Rgb::splat(0.5), Rgb::ONE);
        let mut corners = Vec::new();
        let mut faces = Vec::new();
        let mut square = |x: f64, z: f64, a: f64, material: u32| {
            let first = corners.len() as u32;
            for (u, v) in [(0.0, 0.0), (a, 0.0), (a, a), (0.0, a)] {
                corners.push(DVec3::new(x + u, v, z));
            }
            faces.push(((first..first + 4).collect::<Vec<u32>>(), material));
        };
        square(0.0, 0.0, 10.0, 0);
        for k in 0..objects {
            square(f64::from(k) * size, 1.0, size, 1);
        }
        let mut scene = Scene::from_faces("panels", &corners, &faces, vec![floor, glow]).unwrap();
        for (f, face) in scene.faces.iter_mut().enumerate() {
            face.object = f as u32 / 2;
        }
        scene
    }

    #[test]
    fn a_material_is_carried_whole_or_not_at_all() {
        // Each panel is a luminaire of its own, whatever their area.
        let few = Luminaires::new(&panels(2, 1.0));
        assert_eq!((few.list.len(), few.carries), (2, vec![false, true]));
        let many = Luminaires::new(&panels(9, 2.0));
        assert_eq!((many.list.len(), many.carries), (9, vec![false, true]));
    }

    /// Points of a sheet are in single precision, so half of them lie before its other side by their rounding.
    #[test]
    fn a_sheet_that_glows_on_both_sides_does_not_light_itself() {
        let glow = crate::scene::Material { sides: Sides::Two, ..panels(1, 1.0).materials[1].clone() };
        let corners = [(0.1, 0.2, -0.3), (0.9, 0.4, -0.1), (0.8, 0.7, 0.6), (0.0, 0.5, 0.4)];
        let corners = corners.map(|(x, y, z)| DVec3::new(x, y, z));
        let faces = [(vec![0, 1, 2, 3], 0)];
        let scene = Scene::from_faces("sheet", &corners, &faces, vec![glow]).expect("a correct scene");
        let sides = [Side::Front, Side::Back].map(|side| Luminaire::new(&scene, Rgb::ONE, &[0, 1], side));
        for k in 0..1000 {
            let at = |dimension: u32| (hash(k, dimension) >> 8) as f32 / (1 << 24) as f32;
            let point = sides[0].point(at(0), at(1));
            for normal in [point.normal, -point.normal].map(|n| n.as_vec3()) {
                for side in &sides {
                    let pieces = &mut Pieces::default();
                    let visible = side.visible_form(point.position, normal, std::iter::empty(), pieces);
                    assert_eq!((side.exact_form(point.position, normal), visible), (0.0, Some(0.0)));
                }
            }
        }
    }
}
