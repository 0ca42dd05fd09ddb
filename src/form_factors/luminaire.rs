//! Luminaires: emitting surfaces small enough that light as emitted is worth a closed form.
//!
//! All emitting faces of one object and material form one candidate. It becomes a luminaire when its area is below a
//! tenth of the scene's: hemisphere rays would then miss it nine times in ten, while its own sum over faces is cheap.
//! Larger emitters (a glowing wall, a furnace) are found by hemisphere rays well enough, and n emitters by n patches
//! of closed forms would be n² work.
//!
//! Not handled: clustering of many luminaires; each costs its own closed form at every receiver.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::outline::Outline;
use super::polygon::point_to_polygon;
use crate::light::Rgb;
use crate::rays::Side;
use crate::rays::cosine::triangle_point;
use crate::scene::{Scene, Sides};

/// Share of the scene's area above which hemisphere rays find an emitter well enough.
const LARGE: f64 = 0.1;

/// One emitting surface of uniform radiance.
#[derive(Clone, Debug)]
pub struct Luminaire {
    /// Emitted radiance, W/(m² sr).
    pub radiance: Rgb,
    /// Total area, unit coordinates squared.
    pub area: f64,
    triangles: Vec<EmittingTriangle>,
    /// None where it has too many faces; points drawn on it stand in for the closed form then.
    outline: Option<Outline>,
}

#[derive(Clone, Debug)]
struct EmittingTriangle {
    corners: [Vec3; 3],
    exact: [DVec3; 3],
    normal: DVec3,
    face: u32,
    /// Area of the triangles up to and including this one over the luminaire's.
    share: f32,
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
}

/// The luminaires of a scene, and which materials' emission they carry.
#[derive(Clone, Debug)]
pub struct Luminaires {
    /// Evaluated by closed form.
    pub list: Vec<Luminaire>,
    /// Per face: its emission is a luminaire's, so hemisphere rays must not count it again.
    pub is_luminaire: Vec<bool>,
}

impl Luminaires {
    /// Chooses the emitters of a scene that are worth a closed form.
    pub fn new(scene: &Scene) -> Luminaires {
        let mut order: HashMap<(u32, u32), usize> = HashMap::new();
        let mut candidates: Vec<Vec<u32>> = Vec::new();
        let mut total = 0.0;
        for (f, face) in scene.faces.iter().enumerate() {
            total += scene.area(f as u32);
            if scene.material(f as u32).emits() {
                let k = *order
                    .entry((face.object, face.material))
                    .or_insert_with(|| {
                        candidates.push(Vec::new());
                        candidates.len() - 1
                    });
                candidates[k].push(f as u32);
            }
        }
        let mut luminaires = Luminaires {
            list: Vec::new(),
            is_luminaire: vec![false; scene.faces.len()],
        };
        for faces in candidates {
            luminaires.consider(scene, &faces, total);
        }
        luminaires
    }

    fn consider(&mut self, scene: &Scene, faces: &[u32], total: f64) {
        let own: f64 = faces.iter().map(|&f| scene.area(f)).sum();
        if own >= LARGE * total {
            return;
        }
        for &f in faces {
            self.is_luminaire[f as usize] = true;
        }
        self.list.push(Luminaire::new(scene, faces, Side::Front));
        if scene.material(faces[0]).sides == Sides::Two {
            self.list.push(Luminaire::new(scene, faces, Side::Back));
        }
    }
}

impl Luminaire {
    fn new(scene: &Scene, faces: &[u32], side: Side) -> Luminaire {
        let mut triangles: Vec<EmittingTriangle> = Vec::with_capacity(faces.len());
        let mut sum = 0.0;
        for &face in faces {
            let mut corners = scene.corners(face);
            if side == Side::Back {
                corners.swap(1, 2);
            }
            sum += scene.area(face);
            let exact = corners.map(|p| p.as_dvec3());
            let normal = (exact[1] - exact[0]).cross(exact[2] - exact[0]).normalize();
            triangles.push(EmittingTriangle {
                corners,
                exact,
                normal,
                face,
                share: sum as f32,
            });
        }
        for t in &mut triangles {
            t.share = (t.share as f64 / sum) as f32;
        }
        Luminaire {
            radiance: scene.material(faces[0]).emission,
            area: sum,
            outline: Outline::new(triangles.iter().map(|t| t.exact)),
            triangles,
        }
    }

    /// Form factor from a point with unit normal to all of the luminaire, nothing between; `None` where its faces are
    /// too many for the closed form to be worth its price.
    pub fn closed_form(&self, x: Vec3, n: Vec3) -> Option<f64> {
        let outline = self.outline.as_ref()?;
        Some(outline.form(x.as_dvec3(), n.as_dvec3()))
    }

    /// The same whatever the number of faces.
    pub fn exact_form(&self, x: Vec3, n: Vec3) -> f64 {
        self.closed_form(x, n).unwrap_or_else(|| {
            let (x, n) = (x.as_dvec3(), n.as_dvec3());
            let form = |t: &EmittingTriangle| point_to_polygon(n, &t.exact.map(|p| p - x));
            self.triangles.iter().map(form).sum()
        })
    }

    /// The point at (u, v) in the unit square, uniform in area.
    pub fn point(&self, u: f32, v: f32) -> EmittingPoint {
        let k = self.triangles.partition_point(|t| t.share <= u);
        let k = k.min(self.triangles.len() - 1);
        let t = &self.triangles[k];
        let before = if k == 0 {
            0.0
        } else {
            self.triangles[k - 1].share
        };
        let u = ((u - before) / (t.share - before)).clamp(0.0, 0.999_999_94);
        EmittingPoint {
            position: triangle_point(t.corners, u, v),
            normal: t.normal,
            face: t.face,
        }
    }
}
