//! Patches cut by spots reflect what they receive as emitted as lamps do: receivers sample it there.
//!
//! ```text
//! S(x) = sum over strata s of  A_s mean over points y of s of  alpha rho(y) D(y) cos cos T(x, y) / (pi |x - y|²)
//! ```
//!
//! A ray from x seldom meets the spot that most of it comes from; a point drawn in each stratum lies there. What rays
//! and paths find on such patches leaves it out, so the sum of both has no bias, wherever the strata are.
//!
//! Not handled: receivers so near to a patch with spots that the distance varies much over a stratum, which is noise;
//! the bounces of a picture taken apart, among which S counts as the one before.

use glam::{DVec3, Vec2};

use crate::direct::received::{Choice, LightSum};
use crate::direct::{Lights, Scratch};
use crate::form_factors::lambert::point_kernel;
use crate::patches::spots::Stratum;
use crate::rays::sobol::Stream;
use crate::surfaces::SurfacePoint;

impl Lights {
    /// Calls `each` with the emitters' parts of a sample of S at a receiver, irradiance over pi, W/(m² sr); never where
    /// no spots are known.
    pub(crate) fn sample_strata(
        &self,
        receiver: &SurfacePoint,
        random: &mut Stream,
        scratch: &mut Scratch,
        mut each: impl FnMut(usize, DVec3),
    ) {
        for (i, strata) in self.patches.all_strata() {
            for stratum in strata {
                self.sample_stratum(receiver, (i, stratum), random, scratch, &mut each);
            }
        }
    }

    /// Adds S at a receiver, weighted per channel, with as many samples as [`add`](Lights::add) has rays.
    pub(crate) fn add_strata(
        &self,
        sum: &mut LightSum,
        (receiver, weight): (&SurfacePoint, DVec3),
        rays: u32,
        point: impl Fn(Choice) -> Vec2,
        scratch: &mut Scratch,
    ) {
        if self.patches.spots().is_empty() {
            return;
        }
        let tree = self.trees.len() as u32;
        for k in 0..rays {
            let Vec2 { x, y } = point(Choice { tree, k, of: rays });
            let random = &mut Stream::new(x.to_bits() ^ y.to_bits().rotate_left(16));
            let share = weight / f64::from(rays);
            self.sample_strata(receiver, random, scratch, |emitter, light| sum.add(emitter, share * light));
        }
    }

    fn sample_stratum(
        &self,
        receiver: &SurfacePoint,
        (i, stratum): (usize, &Stratum),
        random: &mut Stream,
        scratch: &mut Scratch,
        mut each: impl FnMut(usize, DVec3),
    ) {
        let y = self.patches.stratum_point(i, stratum, random.uniform(), random.uniform());
        let scene = &self.geometry.scene;
        let alpha = self.transports[scene.faces[y.face as usize].material as usize].alpha;
        let reflect = f64::from(alpha) * scene.rho_at(y.face, y.position).as_dvec3();
        let [at, from] = [receiver, &y].map(|own| (own.position.as_dvec3(), own.normal.as_dvec3()));
        let kernel = stratum.share * self.patches.areas()[i] * point_kernel(at.0, at.1, from.0, from.1);
        if kernel <= 0.0 || reflect == DVec3::ZERO {
            return;
        }
        let weight = kernel * self.transmittance(receiver, y.end(), scratch) * reflect;
        if weight != DVec3::ZERO {
            self.sample_at((&y, i as u32), random, scratch, |emitter, light| each(emitter, weight * light));
        }
    }
}
