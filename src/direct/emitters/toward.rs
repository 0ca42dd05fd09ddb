//! Points of a luminaire for one receiver, drawn by what they send there.
//!
//! A point y on a luminaire of area A with the density p gives the estimate `A k(x, y) / (A p)` of the form factor
//! F(x), `k = cos cos / (pi r²)`. By area (`p = 1/A`) that varies as k does: little from far, without bound from near,
//! where most draws send next to nothing and few send all. From near, points are therefore drawn by directions:
//!
//! ```text
//! piece i of the part above the horizon      with the chance  f_i / sum of f
//! direction w within it                      with the density q(w) = b(w) / Omega_i
//! estimate of F                              (cos / pi) / q(w)  *  (sum of f) / f_i
//! ```
//!
//! with `f_i` its solid angle times the mean cosine of its corners, w uniform in a spherical triangle but for a warp b,
//! the bilinear interpolation of those cosines: the estimate varies as the cosine does around that, whatever the
//! distance.
//!
//! Of a luminaire of many triangles one is drawn first by about what it sends, and of one with a texture a part of the
//! tree of its emission ([`crate::direct::emitters::emission_tree`]): black texels send nothing and are not drawn.
//!
//! Sources: J. Arvo, *Stratified sampling of spherical triangles*, SIGGRAPH 1995; the warp, D. Hart et al., *Practical
//! product sampling by fitting and composing warps*, Computer Graphics Forum 39, 2020.
//!
//! Worth: docs/validation.md, Points on luminaires.
//!
//! Not handled: the texture within a leaf of that tree, which the point's share tells.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec2, Vec3};
use smallvec::SmallVec;

use crate::direct::emitters::emission_tree::EmittingPart;
use crate::direct::emitters::luminaire::{EmittingPoint, EmittingTriangle, Luminaire};
use crate::form_factors::lambert::clip_to_horizon;
use crate::form_factors::plane::sees_front;
use crate::form_factors::point_kernel;
use crate::light::shares::{Shares, draw};
use crate::rays::warp::triangle_point;

/// A luminaire is near where its radius exceeds this share of the distance of its middle: by area its points then send
/// what differs by more than what a shadow's edge makes of it. By direction they cost some 0.3 µs more.
const NEAR: f32 = 1.0;

/// The same for luminaires that are not flat, whose near side is nearer than their middle.
const NEAR_BODY: f32 = 0.4;
/// Triangles of which each is clipped; of more one is drawn.
const LOOKED_AT: usize = 16;

/// Solid angles below this have no digits left; what is so small sends nothing beside the rest.
const LEAST: f64 = 1e-13;

/// A point drawn on a luminaire for a receiver.
pub(crate) struct Toward {
    pub point: EmittingPoint,
    /// The estimate of the form factor; 0 where they do not face each other.
    pub form: f64,
}

/// A triangle of directions, part of a triangle of a luminaire above the horizon.
struct Piece<'a> {
    of: &'a EmittingTriangle,
    corners: [DVec3; 3],
    solid_angle: f64,
    /// About the cosines at its corners.
    cosines: [f64; 3],
    /// About three times the integral of the cosine.
    about: f64,
    /// Those up to its own and including it.
    until: f64,
}

type Pieces<'a> = SmallVec<[Piece<'a>; LOOKED_AT]>;

impl Luminaire {
    /// A point drawn on it for a receiver at x with normal n, by a point of the unit square.
    pub(crate) fn toward(&self, x: Vec3, n: Vec3, at: Vec2) -> Toward {
        let (from, normal) = (x.as_dvec3(), n.as_dvec3());
        if let Some(own) = &self.uneven {
            let drawn = own.draw(from, normal, f64::from(at.x));
            let toward = drawn.map(|(k, part)| self.on_part(k, &part, (from, normal), f64::from(at.y)));
            return toward.unwrap_or_else(|| self.nothing(at));
        }
        if self.is_near(x, if self.is_flat() { NEAR } else { NEAR_BODY }) {
            return self.drawn_near((from, normal), at);
        }
        let point = self.point(at.x, at.y);
        let kernel = point_kernel(from, normal, point.position.as_dvec3(), point.normal);
        Toward { point, form: self.area * kernel }
    }

    /// A point of a part of triangle k with a texture.
    fn on_part(&self, k: usize, part: &EmittingPart, (x, n): (DVec3, DVec3), v: f64) -> Toward {
        let (of, corners, at) = (&self.triangles[k], part.corners, DVec2::new(part.rest, v));
        let middle = corners.iter().sum::<DVec3>() / 3.0;
        let radius = corners.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
        let mut toward = if radius > f64::from(NEAR) * middle.length() {
            let mut pieces = Pieces::new();
            add_pieces(n, of, corners, &mut pieces);
            self.by_direction(&pieces, (x, n), at)
        } else {
            let at = at.as_vec2();
            let position = triangle_point(corners.map(|p| (x + p).as_vec3()), at.x, at.y);
            let area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
            let form = area * point_kernel(x, n, position.as_dvec3(), of.normal);
            Toward { point: self.emitting(of, position), form }
        };
        toward.form /= part.chance;
        toward
    }

    /// A point drawn by directions from near, of many triangles within one that is drawn by about what it sends.
    fn drawn_near(&self, (x, n): (DVec3, DVec3), at: Vec2) -> Toward {
        let relative = |of: &EmittingTriangle| of.exact.map(|p| p - x);
        let mut pieces = Pieces::new();
        if self.triangles.len() <= LOOKED_AT {
            self.triangles.iter().for_each(|of| add_pieces(n, of, relative(of), &mut pieces));
            return self.by_direction(&pieces, (x, n), at.as_dvec2());
        }
        let sent = Shares::of(self.triangles.iter().map(|of| sent_by(&relative(of), of.normal, n)));
        if sent.total() <= 0.0 {
            return self.nothing(at);
        }
        let drawn = sent.draw(f64::from(at.x));
        let of = &self.triangles[drawn.index];
        add_pieces(n, of, relative(of), &mut pieces);
        let mut toward = self.by_direction(&pieces, (x, n), DVec2::new(drawn.rest, f64::from(at.y)));
        toward.form *= sent.total() / drawn.weight;
        toward
    }

    /// Some point, where none sends anything to the receiver.
    fn nothing(&self, at: Vec2) -> Toward {
        Toward { point: self.point(at.x, at.y), form: 0.0 }
    }

    /// A point drawn by directions.
    fn by_direction(&self, pieces: &Pieces, (x, n): (DVec3, DVec3), at: DVec2) -> Toward {
        let Some(sum) = pieces.last().map(|piece| piece.until) else { return self.nothing(at.as_vec2()) };
        let drawn = draw(pieces, |piece| piece.until, at.x * sum);
        let piece = &pieces[drawn.index];
        let (direction, density) = piece.direction(drawn.rest.clamp(0.0, 1.0), at.y);
        let (height, along) = ((piece.of.exact[0] - x).dot(piece.of.normal), direction.dot(piece.of.normal));
        let position = (x + direction * (height / along)).as_vec3();
        let form = direction.dot(n).max(0.0) / (PI * density) * (sum / piece.about);
        let is_point = form.is_finite() && position.is_finite();
        Toward { point: self.emitting(piece.of, position), form: if is_point { form } else { 0.0 } }
    }

    fn emitting(&self, of: &EmittingTriangle, position: Vec3) -> EmittingPoint {
        let share = self.uneven.as_ref().map_or(DVec3::ONE, |own| own.share(of.face, position));
        EmittingPoint { position, normal: of.normal, face: of.face, share }
    }
}

/// About what a triangle sends to a receiver with unit normal n, `corners` relative to it: its area times the cosines
/// and the inverse squared distance that are most in its favour within a sphere around it.
fn sent_by(corners: &[DVec3; 3], normal: DVec3, n: DVec3) -> f64 {
    let [a, b, c] = *corners;
    let middle = (a + b + c) / 3.0;
    let radius = corners.iter().map(|p| p.distance_squared(middle)).fold(0.0, f64::max).sqrt();
    let squared = middle.length_squared() + radius * radius;
    let highest = |along: f64| (along + radius).max(0.0);
    let cross = (b - a).cross(c - a).length();
    cross * highest(middle.dot(n)) * highest(-middle.dot(normal)) / (squared * squared)
}

/// Adds the part above the horizon of a part of a triangle, `corners` relative to the receiver with unit normal n.
fn add_pieces<'a>(n: DVec3, of: &'a EmittingTriangle, corners: [DVec3; 3], pieces: &mut Pieces<'a>) {
    if !sees_front(&corners) {
        return;
    }
    let (polygon, count) = clip_to_horizon(n, &corners);
    for k in 2..count {
        let corners = [polygon[0], polygon[k - 1], polygon[k]];
        let corners = corners.map(DVec3::normalize);
        let (solid_angle, cosines) = (solid_angle(corners), corners.map(|p| p.dot(n).max(0.0)));
        if solid_angle > LEAST {
            // Between the corners of a wide triangle cosines exceed what is between those of its corners.
            let least = FLOOR * (1.0 + cosines.iter().sum::<f64>());
            let cosines = cosines.map(|cosine| cosine + least);
            let about = solid_angle * cosines.iter().sum::<f64>();
            let until = pieces.last().map_or(0.0, |piece| piece.until) + about;
            pieces.push(Piece { of, corners, cosines, solid_angle, about, until });
        }
    }
}

impl Piece<'_> {
    /// A direction within it by a point of the unit square, and its density over solid angles.
    fn direction(&self, u: f64, v: f64) -> (DVec3, f64) {
        let [a, b, c] = self.cosines;
        let (s, t, density) = bilinear([b, b, a, c], u, v);
        (within_triangle(self.corners, s, t), density / self.solid_angle)
    }
}

/// What the density has at least in a corner, as a share of all cosines.
const FLOOR: f64 = 0.05;

/// Solid angle of a triangle of unit vectors (A. van Oosterom and J. Strackee 1983).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// A point drawn in proportion to the bilinear function with the values w at (0, 0), (1, 0), (0, 1) and (1, 1), and its
/// density.
fn bilinear(w: [f64; 4], u: f64, v: f64) -> (f64, f64, f64) {
    let y = linear(w[0] + w[1], w[2] + w[3], v);
    let (left, right) = (w[0] + (w[2] - w[0]) * y, w[1] + (w[3] - w[1]) * y);
    let x = linear(left, right, u);
    (x, y, (left + (right - left) * x) / (0.25 * w.iter().sum::<f64>()))
}

/// A number of the unit interval drawn in proportion to the linear function from a to b.
fn linear(a: f64, b: f64, u: f64) -> f64 {
    if (b - a).abs() <= 1e-9 * (a + b) {
        return u;
    }
    let root = ((1.0 - u) * a * a + u * b * b).sqrt();
    ((root - a) / (b - a)).clamp(0.0, 1.0)
}

/// The direction of a spherical triangle that belongs to a point of the unit square, uniform (Arvo 1995): u is the
/// share of the area cut off by an arc through b, v the place along that arc, from b on.
fn within_triangle([a, b, c]: [DVec3; 3], u: f64, v: f64) -> DVec3 {
    let (ab, bc, ca) = (a.dot(b), b.dot(c), c.dot(a));
    let triple = a.dot(b.cross(c)).abs();
    let alpha = triple.atan2(bc - ab * ca);
    let area = 2.0 * triple.atan2(1.0 + ab + bc + ca);
    let (sin_alpha, cos_alpha) = alpha.sin_cos();
    let (s, t) = (u * area - alpha).sin_cos();
    let (p, q) = (t - cos_alpha, s + sin_alpha * ab);
    let bottom = (q * s + p * t) * sin_alpha;
    let cosine = ((q * t - p * s) * cos_alpha - q) / bottom;
    let cosine = if cosine.is_finite() { cosine.clamp(-1.0, 1.0) } else { 1.0 };
    let onward = (c - ca * a).normalize_or_zero();
    let end = cosine * a + (1.0 - cosine * cosine).max(0.0).sqrt() * onward;
    let z = 1.0 - v * (1.0 - end.dot(b));
    let toward = (end - end.dot(b) * b).normalize_or_zero();
    z * b + (1.0 - z * z).max(0.0).sqrt() * toward
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Rgb;
    use crate::rays::Side;
    use crate::scene::{Material, Scene};

    /// A luminaire of these polygons.
    fn luminaire(polygons: &[Vec<DVec3>]) -> (Luminaire, Scene) {
        let corners: Vec<DVec3> = polygons.concat();
        let mut first = 0;
        let mut faces = Vec::new();
        for polygon in polygons {
            faces.push(((first..first + polygon.len() as u32).collect::<Vec<u32>>(), 0));
            first += polygon.len() as u32;
        }
        let glow = Material::new("glow", Rgb::ZERO, Rgb::ONE);
        let scene = Scene::from_faces("lamp", &corners, &faces, vec![glow]).expect("a scene");
        let all: Vec<u32> = (0..scene.faces.len() as u32).collect();
        (Luminaire::new(&scene, Rgb::ONE, &all, Side::Front), scene)
    }

    /// Mean and standard error over strata of the unit square.
    fn mean(lamp: &Luminaire, x: Vec3, n: Vec3) -> (f64, f64) {
        const N: u32 = 128;
        let mut random = crate::rays::sobol::Stream::new(x.x.to_bits() ^ n.y.to_bits());
        let (mut sum, mut squares) = (0.0, 0.0);
        for k in 0..N * N {
            let at = Vec2::new(
                ((k % N) as f32 + random.uniform()) / N as f32,
                ((k / N) as f32 + random.uniform()) / N as f32,
            );
            let form = lamp.toward(x, n, at.min(Vec2::splat(0.999_999_94))).form;
            sum += form;
            squares += form * form;
        }
        let count = f64::from(N * N);
        let mean = sum / count;
        (mean, ((squares / count - mean * mean).max(0.0) / count).sqrt())
    }

    fn square(y: f64) -> Vec<DVec3> {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| DVec3::new(x, y, z)).to_vec()
    }

    /// A sphere of n by 2n quadrangles.
    fn sphere(n: usize) -> Vec<Vec<DVec3>> {
        let at = |i: usize, j: usize| {
            let (theta, phi) = (PI * i as f64 / n as f64, PI * j as f64 / n as f64);
            DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
        };
        let mut all = Vec::new();
        for (i, j) in (0..n).flat_map(|i| (0..2 * n).map(move |j| (i, j))) {
            let ring = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            let mut corners: Vec<DVec3> = Vec::new();
            ring.into_iter().for_each(|p| {
                if corners.iter().all(|q| q.distance(p) > 1e-9) {
                    corners.push(p);
                }
            });
            all.push(corners);
        }
        all
    }

    /// Near and far, above, beside and partly below the horizon: the mean is Lambert's form, within four standard
    /// errors.
    #[test]
    fn the_mean_of_draws_is_the_form_factor() {
        for (polygons, name) in [(vec![square(0.0)], "square"), (sphere(2), "octahedron"), (sphere(12), "sphere")] {
            let (lamp, scene) = luminaire(&polygons);
            let away = Vec3::new(0.3, if name == "square" { -1.0 } else { 1.0 }, 0.2);
            let up = if name == "square" { Vec3::Y } else { Vec3::NEG_Y };
            let unit = |p: DVec3| scene.frame.to_unit(p).as_vec3();
            for distance in [0.003, 0.05, 0.3, 1.0, 3.0, 20.0] {
                let off = if name == "square" { 0.0 } else { 1.0 };
                let place = away.as_dvec3().normalize() * (off + distance);
                for n in [up, Vec3::new(0.9, 0.1 * up.y, -0.3).normalize(), -away.normalize()] {
                    let expected = lamp.exact_form(unit(place), n);
                    let (found, error) = mean(&lamp, unit(place), n);
                    assert!(
                        (found - expected).abs() <= 4.0 * error + 1e-6,
                        "{name}, {distance}, {n}: {found} {error} {expected}"
                    );
                }
            }
        }
    }

    /// From near every draw estimates about the same, however near: it varies no more than the cosine over a hemisphere
    /// does, by 1/sqrt(3) of its mean. By area next to no draw finds what is sent.
    #[test]
    fn draws_from_near_differ_little() {
        let (lamp, scene) = luminaire(&[square(0.0)]);
        for height in [0.5, 0.1, 1e-2, 1e-3] {
            let x = scene.frame.to_unit(DVec3::new(0.37, -height, 0.21)).as_vec3();
            let (found, error) = mean(&lamp, x, Vec3::Y);
            assert!(error * 128.0 < 0.6 * found, "{height}: {error} {found}");
        }
    }
}
