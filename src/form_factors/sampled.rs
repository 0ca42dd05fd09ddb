//! Form factors from a whole object by rays, until their standard errors are small enough.
//!
//! Rays start uniformly on the object's faces, directions distributed by the cosine: Owen-scrambled Sobol points in
//! five dimensions (face, position, direction). Several scramblings run side by side; the spread of their means is the
//! standard error. Crossings are weighted as in [`cast`](crate::form_factors::cast()).
//!
//! Rays start a little off their face and its edges ([`crate::rays`]). What that changes, as next to edges that touch
//! and in narrow gaps, is measured by moving some of them as far again; the mean is corrected by it, and the error
//! holds all of it.
//!
//! Not handled: gaps between faces that rays take for one plane (2e-6 of half the scene's extent).

use glam::Vec3;
use halflight_team::Loop;

use crate::form_factors::adaptive_integration::{Estimate, Tolerance};
use crate::light::nothing_passes;
use crate::light::shares::draw;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::warp::{cosine_direction, triangle_point};
use crate::rays::{Hit, Ray, Rays, Side};
use crate::scene::{Scene, Sides};

/// Scramblings: enough that the error of the standard error is a sixth.
const REPLICATES: u32 = 16;

/// Points of each scrambling in the first round; every later round doubles them.
const FIRST: u32 = 1 << 8;

/// One in so many points is cast again from twice as far: a sixteenth more rays, which show by how much moving the
/// starts of all of them is off.
const MOVED: u32 = 16;

/// What casts and meets the rays.
pub struct Sampler<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its rays.
    pub rays: &'a Rays,
    /// tau of each material.
    pub tau: &'a [f32],
    /// Rays from an object at most.
    pub most: u32,
    /// Chooses the scramblings.
    pub seed: u32,
}

/// A face as it sends: with the corners turned where its back does.
struct Sender {
    face: u32,
    corners: [Vec3; 3],
    normal: Vec3,
    /// Area up to and including this one.
    until: f64,
}

impl Sampler<'_> {
    /// Form factors from `object` to every object; rays are cast until those `requested` meet the tolerance with one
    /// standard error, or there would be too many.
    pub fn row(&self, object: u32, requested: &[bool], tolerance: &Tolerance) -> Vec<Estimate> {
        let senders = self.senders(object);
        let n = self.scene.objects.len();
        if senders.is_empty() {
            return vec![Estimate::default(); n];
        }
        let mut sums = vec![Sums { met: vec![0.0; n], moved: vec![0.0; n] }; REPLICATES as usize];
        let (mut done, mut until) = (0, FIRST);
        loop {
            let cast = |(): &mut (), r: usize, sum: &mut Sums| {
                self.cast(&senders, hash(object, self.seed ^ hash(r as u32, 77)), done..until, sum);
            };
            Loop::each(sums.len()).change(&mut sums, || (), cast);
            done = until;
            let row: Vec<Estimate> = (0..n).map(|j| estimate(&sums, j, done)).collect();
            let enough = |e: &Estimate| e.error <= tolerance.of(e.value);
            let met = row.iter().zip(requested).all(|(e, w)| !w || enough(e));
            if met || 2 * until > self.most / REPLICATES {
                return row.into_iter().enumerate().map(|(j, e)| corrected(e, &sums, j, done)).collect();
            }
            until *= 2;
        }
    }

    fn senders(&self, object: u32) -> Vec<Sender> {
        let mut list = Vec::new();
        let mut until = 0.0;
        for (k, face) in self.scene.faces.iter().enumerate() {
            if face.object != object {
                continue;
            }
            let [a, b, c] = self.scene.corners(k as u32);
            let sides: &[[Vec3; 3]] = match self.scene.material(k as u32).sides {
                Sides::One => &[[a, b, c]],
                Sides::Two => &[[a, b, c], [a, c, b]],
            };
            for &corners in sides {
                until += self.scene.area(k as u32);
                let [a, b, c] = corners.map(|p| p.as_dvec3());
                list.push(Sender {
                    face: k as u32,
                    corners,
                    normal: (b - a).cross(c - a).normalize().as_vec3(),
                    until,
                });
            }
        }
        list
    }

    /// Adds what the points of one scrambling find.
    fn cast(&self, senders: &[Sender], seed: u32, points: std::ops::Range<u32>, sums: &mut Sums) {
        let sobol = Sobol::new(0, 5);
        let area = senders[senders.len() - 1].until;
        let mut hits: Vec<Hit> = Vec::new();
        for k in points {
            let at = |d: usize| sobol.point(k, d, seed);
            let share = f64::from(at(4)) * area;
            let sender = &senders[draw(senders, |s| s.until, share).index];
            let ray = Ray {
                origin: triangle_point(sender.corners, at(0), at(1)),
                direction: cosine_direction(sender.normal, at(2), at(3)),
                source: Some(sender.face),
            };
            let again = k % MOVED == 0;
            self.meet(&ray, &mut hits, |object, through| {
                sums.met[object] += through;
                sums.moved[object] -= if again { through } else { 0.0 };
            });
            if again {
                let moved = self.rays.moved_twice(&ray);
                self.meet(&moved, &mut hits, |object, through| sums.moved[object] += through);
            }
        }
    }

    /// Calls `met` with the objects whose fronts a ray meets, and how much of it arrives there.
    fn meet(&self, ray: &Ray, hits: &mut Vec<Hit>, mut met: impl FnMut(usize, f64)) {
        let opaque = nothing_passes(self.tau.iter().copied());
        self.rays.light_crossings(ray, opaque, hits);
        self.rays.transmit(
            hits,
            |m| f64::from(self.tau[m]),
            |hit, through| {
                let face = &self.scene.faces[hit.face as usize];
                if hit.side == Side::Front || self.scene.materials[face.material as usize].sides == Sides::Two {
                    met(face.object as usize, through);
                }
            },
        );
    }
}

/// What the rays of one scrambling found, object by object.
#[derive(Clone)]
pub(crate) struct Sums {
    /// What arrived.
    pub met: Vec<f64>,
    /// What more arrived where rays were moved twice as far from their faces: of one in [`MOVED`].
    pub moved: Vec<f64>,
}

/// An estimate without what moving the starts of rays off their faces adds, and with that in its error. For small moves
/// that is linear in them, so it is what moving the starts as far again adds.
fn corrected(found: Estimate, sums: &[Sums], j: usize, points: u32) -> Estimate {
    let cast = sums.len() as f64 * f64::from(points.div_ceil(MOVED));
    let moved = sums.iter().map(|sum| sum.moved[j]).sum::<f64>() / cast;
    Estimate { value: (found.value - moved).max(0.0), error: found.error.hypot(moved) }
}

/// Mean over the scramblings and its standard error, of sums over `points` each.
fn estimate(sums: &[Sums], j: usize, points: u32) -> Estimate {
    let found = Estimate::of_mean(sums.iter().map(|s| s.met[j] / f64::from(points)));
    // Where no ray differs, three rays might have been missed at 95 %: one standard error is a third of a count of 3.
    let unseen = 1.0 / (sums.len() as f64 * f64::from(points));
    Estimate { error: found.error.max(unseen), ..found }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Between opposite squares of side 1 at a distance of 0.5 and of 0.499 (J. R. Howell's catalogue, C-11).
    const FACING: [f64; 2] = [0.415_253_283_577, 0.415_922_891_242];

    /// Squares of 1 at a distance of 1/2 face each other, in a scene of 4,000: rays start 1e-3 nearer.
    #[test]
    fn what_moving_the_starts_of_rays_adds_is_taken_off_and_stated() {
        let square = |name: &str, z: f64, order: &str| {
            let corners = format!("v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\n");
            format!("{corners}o {name}\nusemtl grey\nf {order}\n")
        };
        let far = |x: f64| format!("v {x} 0 0\nv {x} 1 0\nv {x} 0 1\no far\nusemtl grey\nf -3 -2 -1\n");
        let squares = square("one", 0.0, "-4 -3 -2 -1") + &square("other", 0.5, "-1 -2 -3 -4");
        let text = format!("{squares}{}{}", far(-2000.0), far(2000.0));
        let scene = Scene::from_obj_text("squares", &text, "newmtl grey\nKd .5 .5 .5\n").expect("a correct scene");
        let sampler = Sampler { scene: &scene, rays: &Rays::new(&scene), tau: &[0.0], most: 1 << 20, seed: 0 };
        let found = sampler.row(0, &[false, true], &Tolerance { relative: 0.0, absolute: 0.0 })[1];
        let ([right, moved], off) = (FACING, (found.value - FACING[0]).abs());
        assert!(off <= 0.5 * (moved - right), "{} +- {}, off by {off}", found.value, found.error);
        assert!(found.error >= 0.5 * (moved - right) && found.error <= 2.0 * (moved - right), "{}", found.error);
    }
}
