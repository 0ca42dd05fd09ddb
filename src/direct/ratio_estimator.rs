//! Light of one luminaire at receivers: closed form where it is known what lies between, else closed form times
//! visibility.
//!
//! For receiver points x and points y drawn on a luminaire of area A, the ratio estimator
//!
//! ```text
//! mean_x F(x) * [ sum A k(x,y) T(x,y) ] / [ sum A k(x,y) ],     k = cos cos / (pi r²), T = product of tau between
//! ```
//!
//! with F(x) Lambert's closed form, is exact where nothing or everything occludes, so rays only decide the shadow's
//! edge; its bias falls as 1/rays (E. Heitz, S. Hill, M. McGuire, *Combining analytic direct illumination and
//! stochastic shadows*, 2018).
//!
//! Not handled: luminaires that a light cut leaves to be drawn ([`crate::direct::cut_light`]).

use glam::{DVec3, Vec2};

use crate::direct::luminaire::Luminaire;
use crate::direct::occlusion::Occlusion;
use crate::direct::shaft_culling::Between;
use crate::direct::visibility::Lighting;
use crate::form_factors::geometry::shadow::Pieces;
use crate::form_factors::point_kernel;
use crate::rays::Hit;
use crate::surfaces::SurfacePoint;

/// Sums of one luminaire's light over receiver points, weighted per channel (by rho, say).
#[derive(Clone, Copy, Debug, Default)]
pub struct DirectSum {
    exact: DVec3,
    unoccluded: DVec3,
    drawn: DVec3,
    arrived: DVec3,
}

impl DirectSum {
    /// Adds a receiver point whose form factor is known.
    pub fn add_exact(&mut self, weight: DVec3, form: f64) {
        self.exact += weight * form;
    }

    /// Adds a receiver point that sees the luminaire under form factor `closed` when nothing is between.
    pub fn add_point(&mut self, weight: DVec3, closed: f64) {
        self.unoccluded += weight * closed;
    }

    /// Adds a point drawn on the luminaire: `kernel` is `A k(x, y)`.
    pub fn add_ray(&mut self, weight: DVec3, kernel: f64, transmittance: f32) {
        self.add_drawn(weight, kernel, DVec3::splat(f64::from(transmittance)));
    }

    /// Adds a point drawn on the luminaire whose light arrives times a factor for each channel.
    fn add_drawn(&mut self, weight: DVec3, kernel: f64, arrived: DVec3) {
        self.drawn += weight * kernel;
        self.arrived += weight * (kernel * arrived);
    }

    /// Weighted sum of the form factors with occlusion.
    pub fn estimate(&self) -> DVec3 {
        let share = |c: usize| if self.drawn[c] > 0.0 { self.arrived[c] / self.drawn[c] } else { 0.0 };
        self.exact + self.unoccluded * DVec3::new(share(0), share(1), share(2))
    }

    /// Whether no point drawn so far faced a receiver.
    fn is_blind(&self) -> bool {
        self.drawn == DVec3::ZERO
    }
}

/// A luminaire as a patch asks it.
#[derive(Clone, Copy)]
pub struct Lamp<'a> {
    /// The luminaire.
    pub luminaire: &'a Luminaire,
    /// What may lie between it and the patch.
    pub between: Between<'a>,
}

/// Memory to use again from receiver to receiver.
#[derive(Default)]
pub struct Scratch {
    hits: Vec<Hit>,
    pieces: Pieces,
}

impl Scratch {
    pub(crate) fn hits(&mut self) -> &mut Vec<Hit> {
        &mut self.hits
    }
}

impl<'a> Lighting<'a> {
    /// Luminaire l, as a patch asks it.
    pub fn lamp(&self, l: usize, patch: u32) -> Lamp<'a> {
        Lamp { luminaire: &self.luminaires.list[l], between: self.sight.shafts.between(patch, l) }
    }

    /// The form factor from a receiver to what it sees of a luminaire, where that is known without a ray.
    pub(crate) fn exact_form(&self, lamp: Lamp, receiver: &SurfacePoint, scratch: &mut Scratch) -> Option<f64> {
        let (x, n) = (receiver.position, receiver.normal);
        if lamp.luminaire.is_textured() {
            return None;
        }
        if self.sight.occlusion == Occlusion::Nothing {
            return Some(lamp.luminaire.exact_form(x, n));
        }
        match lamp.between {
            Between::Nothing => lamp.luminaire.closed_form(x, n),
            Between::Faces(faces) => {
                let casters = self.sight.shafts.casters(faces);
                lamp.luminaire.visible_form(x, n, casters, &mut scratch.pieces)
            }
            Between::Unknown => None,
        }
    }

    /// Adds what one receiver gets from a luminaire to `sum`: its closed form where it is known what lies between, else
    /// with one visibility ray for each point of the unit square given; returns the rays cast.
    pub fn gather_luminaire(
        &self,
        lamp: Lamp,
        receiver: &SurfacePoint,
        weight: DVec3,
        points: impl ExactSizeIterator<Item = Vec2>,
        scratch: &mut Scratch,
        sum: &mut DirectSum,
    ) -> u64 {
        if let Some(form) = self.exact_form(lamp, receiver, scratch) {
            sum.add_exact(weight, form);
            return 0;
        }
        let closed = lamp.luminaire.closed_form(receiver.position, receiver.normal);
        match closed {
            // Nothing of it faces the receiver.
            Some(0.0) => return 0,
            Some(form) => sum.add_point(weight, form),
            None => {}
        }
        let count = points.len() as f64;
        let mut cast = 0;
        for point in points {
            // A luminaire half below the horizon hides most points drawn; until one is found, others are tried.
            for (a, b) in [(0.0, 0.0), (0.5, 0.5), (0.5, 0.0), (0.0, 0.5)] {
                let at = Vec2::new((point.x + a).fract(), (point.y + b).fract());
                if let Some((kernel, arrived)) = self.look(lamp.luminaire, receiver, at, scratch) {
                    cast += 1;
                    sum.add_drawn(weight, kernel / count, arrived);
                    if closed.is_none() {
                        sum.add_point(weight, kernel / count);
                    }
                }
                if closed.is_none() || !sum.is_blind() {
                    break;
                }
            }
        }
        cast
    }

    /// `A k` of the point that belongs to a place of the unit square on a luminaire, and T times its share of the mean
    /// radiance, asked by one visibility ray; `None` where the two points do not face each other.
    fn look(
        &self,
        luminaire: &Luminaire,
        receiver: &SurfacePoint,
        at: Vec2,
        scratch: &mut Scratch,
    ) -> Option<(f64, DVec3)> {
        let y = luminaire.point(at.x, at.y);
        let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        let kernel = luminaire.area * point_kernel(x, n, y.position.as_dvec3(), y.normal);
        let hits = scratch.hits();
        let mut arrived = || self.sight.occlusion.transmittance(self.rays, receiver.end(), y.end(), hits);
        (kernel > 0.0).then(|| (kernel, f64::from(arrived()) * y.share))
    }
}
