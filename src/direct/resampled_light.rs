//! Light as emitted that one point receives, asked with a few random numbers and free of bias.
//!
//! Where the closed form is known it is taken, but for textures of which a part is hidden, where it costs more than a
//! ray is worth. Elsewhere some points `y` are drawn on a luminaire of area A, one of them is chosen in proportion to
//! the kernel `k(x, y) = cos cos / (pi r²)`, and one visibility ray goes there (resampled importance sampling, J. F.
//! Talbot et al. 2005). With F the closed form, T the transmittance and c any number,
//!
//! ```text
//! F_V = T(y) m + c (F - m),      m = mean of A k over the points drawn,      E[m] = F
//! ```
//!
//! so that a guess c of the visible share lessens the noise of m and changes no mean. Points of a luminaire with a
//! texture are chosen by what they emit as well, and F is the closed form of the texture, channel by channel.
//!
//! [`Lighting::gather_luminaire`] divides by m instead, whose bias falls as 1/rays: better for many rays of one
//! receiver, wrong for one ray of each of many.

use glam::DVec3;

use crate::direct::emitting_triangle::EmittingPoint;
use crate::direct::luminaire::Luminaire;
use crate::direct::ratio_estimator::{Lamp, Scratch};
use crate::direct::visibility::Lighting;
use crate::form_factors::point_kernel;
use crate::rays::sobol::Stream;
use crate::surfaces::SurfacePoint;

/// Points drawn on a luminaire, of which one is asked.
const CANDIDATES: usize = 4;
/// The guess of the visible share.
const GUESS: f64 = 0.5;

/// The mean of the channels; exactly 1 where all are.
fn mean_of(share: DVec3) -> f64 {
    share.element_sum() / 3.0
}

/// What asking takes: random numbers, memory to use again, and the count of the rays cast.
pub struct Asking<'a> {
    /// Chooses what is drawn.
    pub random: &'a mut Stream,
    /// Memory.
    pub scratch: &'a mut Scratch,
    /// Rays cast so far.
    pub cast: &'a mut u64,
}

impl Lighting<'_> {
    /// `sum over luminaires of F_l E_l` at a receiver on a patch, and irradiance over pi from lights without area,
    /// W/(m² sr), without bias.
    pub fn ask(&self, receiver: &SurfacePoint, patch: u32, mut asking: Asking) -> DVec3 {
        let mut sum = DVec3::ZERO;
        if !self.luminaires.punctual.is_empty() {
            let (light, rays) = self.gather_punctual(receiver, asking.scratch);
            sum += light;
            *asking.cast += rays;
        }
        if let Some(cuts) = &self.sight.cuts {
            return sum + cuts.ask(self, receiver, patch, asking);
        }
        for l in 0..self.luminaires.list.len() {
            sum += self.ask_luminaire(self.lamp(l, patch), receiver, &mut asking);
        }
        sum
    }

    /// `F E` of one luminaire at a receiver, without bias.
    pub(crate) fn ask_luminaire(&self, lamp: Lamp, receiver: &SurfacePoint, asking: &mut Asking) -> DVec3 {
        let form = match self.cheap_form(lamp, receiver, asking.scratch) {
            Some(form) => form,
            None => self.draw(receiver, lamp.luminaire, asking),
        };
        form * lamp.luminaire.radiance.as_dvec3()
    }

    /// An estimate without bias of the form factor to what is seen of a luminaire, by points drawn on it, one of which
    /// is asked.
    fn draw(&self, receiver: &SurfacePoint, luminaire: &Luminaire, asking: &mut Asking) -> DVec3 {
        let Asking { random, scratch, cast } = asking;
        let closed = luminaire.closed_form(receiver.position, receiver.normal);
        if closed == Some(0.0) {
            return DVec3::ZERO;
        }
        let closed = closed.map(|form| luminaire.light(receiver.position, receiver.normal, form));
        let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        let mut sum = 0.0;
        let mut chosen: Option<EmittingPoint> = None;
        for _ in 0..CANDIDATES {
            let y = luminaire.point(random.uniform(), random.uniform());
            let kernel = mean_of(y.share) * luminaire.area * point_kernel(x, n, y.position.as_dvec3(), y.normal);
            sum += kernel;
            // Each candidate ends up chosen in proportion to its kernel.
            if kernel > 0.0 && f64::from(random.uniform()) * sum <= kernel {
                chosen = Some(y);
            }
        }
        // What arrives where nothing lies between.
        let mean = chosen.map_or(DVec3::ZERO, |y| sum / CANDIDATES as f64 * y.share / mean_of(y.share));
        let arrived = chosen.map_or(0.0, |y| {
            **cast += 1;
            f64::from(self.sight.occlusion.transmittance(self.rays, receiver.end(), y.end(), scratch.hits()))
        });
        arrived * mean + closed.map_or(DVec3::ZERO, |form| GUESS * (form - mean))
    }
}
