//! Light as emitted: what every patch receives from the luminaires, closed form times visibility.
//!
//! For receiver points x and points y drawn on a luminaire of area A,
//!
//! ```text
//! mean_x F(x) * [ sum A k(x,y) T(x,y) ] / [ sum A k(x,y) ],     k = cos cos / (pi r²), T = product of tau between
//! ```
//!
//! with F(x) Lambert's closed form. The ratio makes the estimate exact where nothing or everything occludes, so rays
//! only decide the shadow's edge; its bias falls as 1/rays. Where no face can occlude, no ray is cast.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::luminaire::{Luminaire, Luminaires};
use super::polygon::point_kernel;
use super::{Progress, Sampling};
use crate::light::{Rgb, Transport};
use crate::patches::Patches;
use crate::rays::sequence::{Sobol, hash};
use crate::rays::{Hit, Rays};

/// What lies between two points, as far as the scene needs it modelled.
#[derive(Clone, Debug, PartialEq)]
pub enum Occlusion {
    /// Nothing can occlude: tau is 1 everywhere, or every face lies on the scene's convex hull.
    Nothing,
    /// tau is 0 everywhere: the first face ends a ray.
    Opaque,
    /// tau of each material; every crossing counts.
    Partial(Vec<f32>),
}

impl Occlusion {
    /// The least that models these materials in this scene.
    pub fn new(rays: &Rays, transports: &[Transport]) -> Occlusion {
        if transports.iter().all(|t| t.tau == 1.0) || !rays.anything_occludes() {
            Occlusion::Nothing
        } else if transports.iter().all(|t| t.tau == 0.0) {
            Occlusion::Opaque
        } else {
            Occlusion::Partial(transports.iter().map(|t| t.tau).collect())
        }
    }

    /// Product of tau between two points, each with the face it lies on.
    #[inline]
    pub fn transmittance(
        &self,
        rays: &Rays,
        from: (Vec3, Option<u32>),
        to: (Vec3, Option<u32>),
        scratch: &mut Vec<Hit>,
    ) -> f32 {
        match self {
            Occlusion::Nothing => 1.0,
            Occlusion::Opaque => f32::from(rays.visible(from, to)),
            Occlusion::Partial(tau) => rays.transmittance(from, to, tau, scratch),
        }
    }
}

/// Sums of one luminaire's light over receiver points, weighted per channel (by rho, say).
#[derive(Clone, Copy, Debug, Default)]
pub struct DirectSum {
    unoccluded: DVec3,
    drawn: DVec3,
    arrived: DVec3,
}

impl DirectSum {
    /// Adds a receiver point that sees the luminaire under form factor `closed` when nothing is between.
    pub fn add_point(&mut self, weight: DVec3, closed: f64) {
        self.unoccluded += weight * closed;
    }

    /// Adds a point drawn on the luminaire: `kernel` is `A k(x, y)`.
    pub fn add_ray(&mut self, weight: DVec3, kernel: f64, transmittance: f32) {
        self.drawn += weight * kernel;
        self.arrived += weight * (kernel * transmittance as f64);
    }

    /// Weighted sum of the form factors with occlusion.
    pub fn estimate(&self) -> DVec3 {
        let share = |arrived: f64, drawn: f64| if drawn > 0.0 { arrived / drawn } else { 0.0 };
        DVec3::new(
            self.unoccluded.x * share(self.arrived.x, self.drawn.x),
            self.unoccluded.y * share(self.arrived.y, self.drawn.y),
            self.unoccluded.z * share(self.arrived.z, self.drawn.z),
        )
    }

    /// Weighted sum of the form factors when nothing occludes.
    pub fn without_occlusion(&self) -> DVec3 {
        self.unoccluded
    }
}

/// A receiving point: position, unit normal, and the face it lies on.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Unit coordinates.
    pub position: Vec3,
    /// Unit normal of the receiving side.
    pub normal: Vec3,
    /// The face it lies on.
    pub face: u32,
}

/// Adds what one receiver gets from a luminaire to `sum`, with one visibility ray for each (u, v) given.
pub fn gather_luminaire(
    sum: &mut DirectSum,
    weight: DVec3,
    receiver: &Receiver,
    luminaire: &Luminaire,
    (rays, occlusion): (&Rays, &Occlusion),
    points: impl ExactSizeIterator<Item = (f32, f32)>,
    scratch: &mut Vec<Hit>,
) {
    let (x, n) = (receiver.position, receiver.normal);
    if *occlusion == Occlusion::Nothing {
        sum.add_point(weight, luminaire.exact_form(x, n));
        return;
    }
    let closed = luminaire.closed_form(x, n);
    match closed {
        Some(0.0) => return,
        Some(form) => sum.add_point(weight, form),
        None => {}
    }
    let count = points.len() as f64;
    let (x, n) = (x.as_dvec3(), n.as_dvec3());
    for (u, v) in points {
        let y = luminaire.point(u, v);
        let kernel = luminaire.area * point_kernel(x, n, y.position.as_dvec3(), y.normal) / count;
        if kernel > 0.0 {
            let from = (receiver.position, Some(receiver.face));
            let to = (y.position, Some(y.face));
            let arrived = occlusion.transmittance(rays, from, to, scratch);
            sum.add_ray(weight, kernel, arrived);
            if closed.is_none() {
                sum.add_point(weight, kernel);
            }
        }
    }
}

impl Occlusion {
    /// The estimate of a sum gathered under this occlusion by closed form or by drawn points.
    pub fn estimate(&self, sum: &DirectSum) -> DVec3 {
        match self {
            Occlusion::Nothing => sum.without_occlusion(),
            _ => sum.estimate(),
        }
    }
}

/// `sum over luminaires of F_il E_l` for every patch that `receives`, W/(m² sr); and how many rays were cast.
pub fn receive_emitted(
    (rays, patches): (&Rays, &Patches),
    luminaires: &Luminaires,
    occlusion: &Occlusion,
    receives: &[bool],
    sampling: &Sampling,
    tick: Progress,
) -> (Vec<Rgb>, u64) {
    let points = match occlusion {
        // The closed form varies smoothly over a patch: a few points are within 0.03 %.
        Occlusion::Nothing => sampling.emitter_rays.min(16),
        _ => sampling.emitter_rays,
    }
    .max(1);
    let sobol = Sobol::new(points as usize, 4);
    let receive = |scratch: &mut Vec<Hit>, i: usize| {
        let mut received = DVec3::ZERO;
        for (l, luminaire) in luminaires.list.iter().enumerate() {
            if !receives[i] {
                break;
            }
            let seed = hash(
                (i * luminaires.list.len() + l) as u32,
                sampling.seed ^ 0x5eed_1a3b,
            );
            let mut sum = DirectSum::default();
            for k in 0..points {
                let at = |d: usize| sobol.point(k, d, seed);
                let p = patches.point(i, at(0), at(1));
                let receiver = Receiver {
                    position: p.position,
                    normal: p.normal,
                    face: p.face,
                };
                let draw = std::iter::once((at(2), at(3)));
                let path = (rays, occlusion);
                gather_luminaire(
                    &mut sum,
                    DVec3::ONE,
                    &receiver,
                    luminaire,
                    path,
                    draw,
                    scratch,
                );
            }
            let form = occlusion.estimate(&sum).x / points as f64;
            received += form * luminaire.radiance.as_dvec3();
        }
        tick(1);
        received.as_vec3()
    };
    let received = (0..patches.len())
        .into_par_iter()
        .map_init(Vec::new, receive)
        .collect();
    let cast = match occlusion {
        Occlusion::Nothing => 0,
        _ => receives.iter().filter(|&&r| r).count() * luminaires.list.len() * points as usize,
    };
    (received, cast as u64)
}
