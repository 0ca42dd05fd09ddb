//! Light as emitted: what every patch receives from the luminaires, and from lights without area.
//!
//! A patch's light is the mean over receiver points of it. Few luminaires are asked one by one, by closed form or with
//! a ratio estimator ([`Lighting::gather_luminaire`]); many through the patch's light cut.
//!
//! Not handled: emitters that are no luminaires; hemisphere rays find those.

use glam::{DVec3, Vec2};
use rayon::prelude::*;

use crate::direct::light_cut::LightCuts;
use crate::direct::occlusion::Occlusion;
use crate::direct::ratio_estimator::{DirectSum, Scratch};
use crate::direct::shaft_culling::Between;
use crate::direct::visibility::Lighting;
use crate::form_factors::{Progress, Sampling};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Sobol, hash};

/// Receiver points that are enough where each is exact: the form factor varies smoothly over a patch.
const SMOOTH: u32 = 32;

/// What patches are asked with, and where.
struct Asking<'a> {
    lighting: &'a Lighting<'a>,
    patches: &'a Patches,
    sobol: Sobol,
    /// Receiver points a patch and luminaire at most, each with one ray.
    rays: u32,
    seed: u32,
}

/// `sum over luminaires of F_il E_l` for every patch that `receives`, W/(m² sr); and how many rays were cast.
pub fn receive_emitted(
    lighting: &Lighting,
    patches: &Patches,
    receives: &[bool],
    sampling: &Sampling,
    tick: Progress,
) -> (Vec<Rgb>, u64) {
    let rays = sampling.emitter_rays;
    let most = match lighting.sight.cuts {
        Some(_) => rays.clamp(1, SMOOTH) * rays.div_ceil(SMOOTH).next_power_of_two() * LightCuts::MOST_DRAWN,
        None => rays.max(1),
    };
    let asking = Asking {
        lighting,
        patches,
        sobol: Sobol::new(most as usize, 4),
        rays,
        seed: Purpose::Received.seed(sampling.seed),
    };
    let receive = |scratch: &mut Scratch, i: usize| {
        tick(1);
        match &lighting.sight.cuts {
            _ if !receives[i] => (DVec3::ZERO, 0),
            Some(cuts) => asking.by_cut(cuts, i, scratch),
            None => asking.one_by_one(i, scratch),
        }
    };
    for_all(patches, receive)
}

/// Irradiance over pi from lights without area for every patch that `receives`, W/(m² sr), nothing at all where there
/// are no such lights; and how many rays were cast.
pub fn receive_punctual(
    lighting: &Lighting,
    patches: &Patches,
    receives: &[bool],
    sampling: &Sampling,
) -> (Vec<Rgb>, u64) {
    if lighting.luminaires.punctual.is_empty() {
        return (Vec::new(), 0);
    }
    let most = if lighting.sight.punctual == Occlusion::Nothing { SMOOTH } else { u32::MAX };
    let rays = sampling.emitter_rays.clamp(1, most);
    let asking = Asking {
        lighting,
        patches,
        sobol: Sobol::new(rays as usize, 2),
        rays,
        seed: Purpose::ReceivedFromPoints.seed(sampling.seed),
    };
    let receive = |scratch: &mut Scratch, i: usize| {
        if receives[i] { asking.by_punctual(i, scratch) } else { (DVec3::ZERO, 0) }
    };
    for_all(patches, receive)
}

/// What every patch receives, and the sum of the rays.
fn for_all(patches: &Patches, receive: impl Fn(&mut Scratch, usize) -> (DVec3, u64) + Sync + Send) -> (Vec<Rgb>, u64) {
    let received: Vec<(DVec3, u64)> = (0..patches.len()).into_par_iter().map_init(Scratch::default, receive).collect();
    (received.iter().map(|r| r.0.as_vec3()).collect(), received.iter().map(|r| r.1).sum())
}

impl Asking<'_> {
    /// What patch i receives from lights without area, and the rays cast.
    fn by_punctual(&self, i: usize, scratch: &mut Scratch) -> (DVec3, u64) {
        let seed = hash(i as u32, self.seed);
        let (mut received, mut cast) = (DVec3::ZERO, 0);
        for k in 0..self.rays {
            let receiver = self.patches.point(i, self.sobol.point(k, 0, seed), self.sobol.point(k, 1, seed));
            let (light, rays) = self.lighting.gather_punctual(&receiver, scratch);
            received += light / f64::from(self.rays);
            cast += rays;
        }
        (received, cast)
    }

    /// What patch i receives from luminaires asked one by one, and the rays cast.
    fn one_by_one(&self, i: usize, scratch: &mut Scratch) -> (DVec3, u64) {
        let count = self.lighting.luminaires.list.len();
        let (mut received, mut cast) = (DVec3::ZERO, 0);
        for l in 0..count {
            let lamp = self.lighting.lamp(l, i as u32);
            let is_known = !matches!(lamp.between, Between::Unknown);
            let exact = is_known || self.lighting.sight.occlusion == Occlusion::Nothing;
            let most = if exact { SMOOTH } else { u32::MAX };
            let receivers = self.rays.min(most).max(1);
            let seed = hash((i * count + l) as u32, self.seed);
            let mut sum = DirectSum::default();
            for k in 0..receivers {
                let at = |d: usize| self.sobol.point(k, d, seed);
                let receiver = self.patches.point(i, at(0), at(1));
                let draw = std::iter::once(Vec2::new(at(2), at(3)));
                cast += self.lighting.gather_luminaire(lamp, &receiver, DVec3::ONE, draw, scratch, &mut sum);
            }
            received += sum.estimate() / f64::from(receivers) * lamp.luminaire.radiance.as_dvec3();
        }
        (received, cast)
    }

    /// What patch i receives through its light cut, and the rays cast: points are drawn on luminaires in proportion to
    /// the rays of a patch, however many luminaires there are.
    fn by_cut(&self, cuts: &LightCuts, i: usize, scratch: &mut Scratch) -> (DVec3, u64) {
        let sobol = &self.sobol;
        let receivers = self.rays.clamp(1, SMOOTH);
        let draws = self.rays.div_ceil(SMOOTH).next_power_of_two() * cuts.draws(i as u32);
        let seed = hash(i as u32, self.seed);
        let (mut received, mut cast) = (DVec3::ZERO, 0);
        for k in 0..receivers {
            let receiver = self.patches.point(i, sobol.point(k, 0, seed), sobol.point(k, 1, seed));
            let draw = |j: usize| {
                let at = |d: usize| sobol.point(k * draws + j as u32, d, seed);
                Vec2::new(at(2), at(3))
            };
            let drawn = (0..draws as usize).map(draw);
            let (light, rays) = cuts.gather(self.lighting, &receiver, i as u32, drawn, scratch);
            received += light / f64::from(receivers);
            cast += rays;
        }
        (received, cast)
    }
}
