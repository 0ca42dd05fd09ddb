//! Light as emitted: what every patch receives from the luminaires.
//!
//! Where nothing lies between, Lambert's closed form; where few faces do, the closed form of what they leave visible;
//! elsewhere closed form times visibility. For receiver points x and points y drawn on a luminaire of area A,
//!
//! ```text
//! mean_x F(x) * [ sum A k(x,y) T(x,y) ] / [ sum A k(x,y) ],     k = cos cos / (pi r²), T = product of tau between
//! ```
//!
//! with F(x) Lambert's closed form. The ratio makes the estimate exact where nothing or everything occludes, so rays
//! only decide the shadow's edge; its bias falls as 1/rays.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::direct::light_cut::Links;
use crate::direct::luminaire::{Luminaire, Luminaires};
use crate::direct::shaft_culling::Between;
use crate::direct::visibility::{Occlusion, Sight};
use crate::form_factors::geometry::shadow::Pieces;
use crate::form_factors::{Progress, Sampling, point_kernel};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::{Hit, Rays};

/// Receiver points that are enough where each is exact: the form factor varies smoothly over a patch.
const SMOOTH: u32 = 32;

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
        self.drawn += weight * kernel;
        self.arrived += weight * (kernel * transmittance as f64);
    }

    /// Weighted sum of the form factors with occlusion.
    pub fn estimate(&self) -> DVec3 {
        let share = |c: usize| match self.drawn[c] > 0.0 {
            true => self.arrived[c] / self.drawn[c],
            false => 0.0,
        };
        self.exact + self.unoccluded * DVec3::new(share(0), share(1), share(2))
    }

    /// Whether no point drawn so far faced a receiver.
    fn is_blind(&self) -> bool {
        self.drawn == DVec3::ZERO
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

    pub(crate) fn pieces(&mut self) -> &mut Pieces {
        &mut self.pieces
    }
}

/// Adds what one receiver gets from a luminaire to `sum`, by closed form where what lies `between` is known, else with one
/// visibility ray for each (u, v) given; returns the rays cast.
pub fn gather_luminaire(
    sum: &mut DirectSum,
    weight: DVec3,
    receiver: &Receiver,
    (luminaire, between): (&Luminaire, Between),
    (rays, sight): (&Rays, &Sight),
    points: impl ExactSizeIterator<Item = (f32, f32)>,
    scratch: &mut Scratch,
) -> u64 {
    let (x, n) = (receiver.position, receiver.normal);
    if sight.occlusion == Occlusion::Nothing {
        sum.add_exact(weight, luminaire.exact_form(x, n));
        return 0;
    }
    if let Between::Faces(faces) = between {
        let casters = sight.shafts.casters(faces);
        if let Some(form) = luminaire.visible_form((x, n), casters, &mut scratch.pieces) {
            sum.add_exact(weight, form);
            return 0;
        }
    }
    let closed = luminaire.closed_form(x, n);
    match (closed, between) {
        (Some(form), Between::Nothing) => {
            sum.add_exact(weight, form);
            return 0;
        }
        // Nothing of it faces the receiver.
        (Some(0.0), _) => return 0,
        (Some(form), _) => sum.add_point(weight, form),
        (None, _) => {}
    }
    draw(sum, weight, receiver, luminaire, closed.is_none(), (rays, sight), points, scratch)
}

/// Casts visibility rays to points drawn on a luminaire.
#[allow(clippy::too_many_arguments)]
fn draw(
    sum: &mut DirectSum,
    weight: DVec3,
    receiver: &Receiver,
    luminaire: &Luminaire,
    unknown: bool,
    (rays, sight): (&Rays, &Sight),
    points: impl ExactSizeIterator<Item = (f32, f32)>,
    scratch: &mut Scratch,
) -> u64 {
    let count = points.len() as f64;
    let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
    let mut cast = 0;
    for (u, v) in points {
        // A luminaire half below the horizon hides most points drawn; until one is found, others are tried.
        for (a, b) in [(0.0, 0.0), (0.5, 0.5), (0.5, 0.0), (0.0, 0.5)] {
            let y = luminaire.point((u + a).fract(), (v + b).fract());
            let kernel = luminaire.area * point_kernel(x, n, y.position.as_dvec3(), y.normal) / count;
            if kernel > 0.0 {
                let from = (receiver.position, Some(receiver.face));
                let to = (y.position, Some(y.face));
                let hits = &mut scratch.hits;
                let arrived = sight.occlusion.transmittance(rays, from, to, hits);
                cast += 1;
                sum.add_ray(weight, kernel, arrived);
                if unknown {
                    sum.add_point(weight, kernel);
                }
            }
            if unknown || !sum.is_blind() {
                break;
            }
        }
    }
    cast
}

/// `sum over luminaires of F_il E_l` for every patch that `receives`, W/(m² sr); and how many rays were cast.
pub fn receive_emitted(
    (rays, patches): (&Rays, &Patches),
    luminaires: &Luminaires,
    sight: &Sight,
    receives: &[bool],
    sampling: &Sampling,
    tick: Progress,
) -> (Vec<Rgb>, u64) {
    if let Some(links) = &sight.links {
        return receive_linked((rays, patches), luminaires, (sight, links), receives, sampling, tick);
    }
    let sobol = Sobol::new(sampling.emitter_rays.max(1) as usize, 4);
    let receive = |scratch: &mut Scratch, i: usize| {
        let (mut received, mut cast) = (DVec3::ZERO, 0);
        for (l, luminaire) in luminaires.list.iter().enumerate() {
            if !receives[i] {
                break;
            }
            let between = sight.shafts.between(i as u32, l);
            let exact = sight.occlusion == Occlusion::Nothing || between != Between::Unknown;
            let most = if exact { SMOOTH } else { u32::MAX };
            let points = sampling.emitter_rays.min(most).max(1);
            let seed = hash((i * luminaires.list.len() + l) as u32, sampling.seed ^ 0x5eed_1a3b);
            let mut sum = DirectSum::default();
            for k in 0..points {
                let at = |d: usize| sobol.point(k, d, seed);
                let p = patches.point(i, at(0), at(1));
                let receiver = Receiver { position: p.position, normal: p.normal, face: p.face };
                let draw = std::iter::once((at(2), at(3)));
                let path = (rays, sight);
                let lamp = (luminaire, between);
                cast += gather_luminaire(&mut sum, DVec3::ONE, &receiver, lamp, path, draw, scratch);
            }
            received += sum.estimate().x / f64::from(points) * luminaire.radiance.as_dvec3();
        }
        tick(1);
        (received.as_vec3(), cast)
    };
    let received: Vec<(Rgb, u64)> = (0..patches.len()).into_par_iter().map_init(Scratch::default, receive).collect();
    let cast = received.iter().map(|r| r.1).sum();
    (received.into_iter().map(|r| r.0).collect(), cast)
}

/// The same where luminaires are many: points drawn on them in proportion to the rays of a patch, however many they are.
fn receive_linked(
    (rays, patches): (&Rays, &Patches),
    luminaires: &Luminaires,
    (sight, links): (&Sight, &Links),
    receives: &[bool],
    sampling: &Sampling,
    tick: Progress,
) -> (Vec<Rgb>, u64) {
    let points = sampling.emitter_rays.clamp(1, SMOOTH);
    let draws = sampling.emitter_rays.div_ceil(SMOOTH).next_power_of_two();
    let sobol = Sobol::new((points * draws * Links::MOST_DRAWN) as usize, 4);
    let receive = |scratch: &mut Scratch, i: usize| {
        tick(1);
        let (mut received, mut cast) = (DVec3::ZERO, 0);
        if !receives[i] {
            return (Rgb::ZERO, 0);
        }
        let seed = hash(i as u32, sampling.seed ^ 0x5eed_1a3b);
        let draws = draws * links.draws(i as u32);
        for k in 0..points {
            let p = patches.point(i, sobol.point(k, 0, seed), sobol.point(k, 1, seed));
            let receiver = Receiver { position: p.position, normal: p.normal, face: p.face };
            let draw = |j: usize| {
                let at = |d: usize| sobol.point(k * draws + j as u32, d, seed);
                (at(2), at(3))
            };
            let place = (&receiver, i as u32);
            let drawn = (0..draws as usize).map(draw);
            let (light, rays) = links.gather(place, luminaires, (rays, sight), drawn, scratch);
            received += light / f64::from(points);
            cast += rays;
        }
        (received.as_vec3(), cast)
    };
    let received: Vec<(Rgb, u64)> = (0..patches.len()).into_par_iter().map_init(Scratch::default, receive).collect();
    let cast = received.iter().map(|r| r.1).sum();
    (received.into_iter().map(|r| r.0).collect(), cast)
}
