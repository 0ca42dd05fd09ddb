//! Light as emitted that one point receives, asked with a few random numbers and free of bias.
//!
//! Where the closed form is known it is taken. Elsewhere some points `y` are drawn on a luminaire of area A, one of them is chosen in
//! proportion to the kernel `k(x, y) = cos cos / (pi r²)`, and one visibility ray goes there (resampled importance sampling, J. F.
//! Talbot et al. 2005). With F the closed form, T the transmittance and c any number,
//!
//! ```text
//! F_V = T(y) m + c (F - m),      m = mean of A k over the points drawn,      E[m] = F
//! ```
//!
//! so that a guess c of the visible share lessens the noise of m and changes no mean.
//!
//! [`gather_luminaire`](crate::direct::receive::gather_luminaire) divides by m instead, whose bias falls as 1/rays: better for many rays of one
//! receiver, wrong for one ray of each of many.

use glam::DVec3;

use crate::direct::luminaire::{EmittingPoint, Luminaire, Luminaires};
use crate::direct::receive::{Receiver, Scratch};
use crate::direct::shaft_culling::Between;
use crate::direct::visibility::{Occlusion, Sight};
use crate::form_factors::point_kernel;
use crate::rays::Rays;
use crate::rays::sobol::Stream;

/// Points drawn on a luminaire, of which one is asked.
const CANDIDATES: usize = 4;
/// The guess of the visible share.
const GUESS: f64 = 0.5;

/// What lights a scene, and what lies between.
#[derive(Clone, Copy)]
pub struct Lighting<'a> {
    /// The scene's rays.
    pub rays: &'a Rays,
    /// Emitters by closed form.
    pub luminaires: &'a Luminaires,
    /// What lies between patches and luminaires.
    pub sight: &'a Sight,
}

impl Lighting<'_> {
    /// `sum over luminaires of F_l E_l` at a receiver on a patch, W/(m² sr), without bias; adds the rays cast to `cast`.
    pub fn ask(
        &self,
        receiver: &Receiver,
        patch: u32,
        random: &mut Stream,
        scratch: &mut Scratch,
        cast: &mut u64,
    ) -> DVec3 {
        let sight = self.sight;
        if let Some(links) = &sight.links {
            let points: Vec<(f32, f32)> =
                (0..links.draws(patch)).map(|_| (random.uniform(), random.uniform())).collect();
            let place = (receiver, patch);
            let path = (self.rays, sight);
            let (light, rays) = links.gather(place, self.luminaires, path, points.into_iter(), scratch);
            *cast += rays;
            return light;
        }
        let mut sum = DVec3::ZERO;
        for (l, luminaire) in self.luminaires.list.iter().enumerate() {
            let between = sight.shafts.between(patch, l);
            let form = match self.exact(receiver, luminaire, between, scratch) {
                Some(form) => form,
                None => self.draw(receiver, luminaire, random, scratch, cast),
            };
            sum += form * luminaire.radiance.as_dvec3();
        }
        sum
    }

    /// The form factor to what is seen of a luminaire, where it is known without a ray.
    fn exact(
        &self,
        receiver: &Receiver,
        luminaire: &Luminaire,
        between: Between,
        scratch: &mut Scratch,
    ) -> Option<f64> {
        let (x, n) = (receiver.position, receiver.normal);
        if self.sight.occlusion == Occlusion::Nothing {
            return Some(luminaire.exact_form(x, n));
        }
        match between {
            Between::Nothing => luminaire.closed_form(x, n),
            Between::Faces(faces) => {
                let casters = self.sight.shafts.casters(faces);
                luminaire.visible_form((x, n), casters, scratch.pieces())
            }
            Between::Unknown => None,
        }
    }

    /// The same by points drawn on the luminaire, one of which is asked.
    fn draw(
        &self,
        receiver: &Receiver,
        luminaire: &Luminaire,
        random: &mut Stream,
        scratch: &mut Scratch,
        cast: &mut u64,
    ) -> f64 {
        let closed = luminaire.closed_form(receiver.position, receiver.normal);
        if closed == Some(0.0) {
            return 0.0;
        }
        let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        let mut sum = 0.0;
        let mut chosen: Option<EmittingPoint> = None;
        for _ in 0..CANDIDATES {
            let y = luminaire.point(random.uniform(), random.uniform());
            let kernel = luminaire.area * point_kernel(x, n, y.position.as_dvec3(), y.normal);
            sum += kernel;
            // Each candidate ends up chosen in proportion to its kernel.
            if kernel > 0.0 && f64::from(random.uniform()) * sum <= kernel {
                chosen = Some(y);
            }
        }
        let mean = sum / CANDIDATES as f64;
        let arrived = chosen.map_or(0.0, |y| {
            *cast += 1;
            let from = (receiver.position, Some(receiver.face));
            let to = (y.position, Some(y.face));
            let occlusion = &self.sight.occlusion;
            f64::from(occlusion.transmittance(self.rays, from, to, scratch.hits()))
        });
        arrived * mean + closed.map_or(0.0, |form| GUESS * (form - mean))
    }
}
