//! Light of one luminaire at receivers: closed form where its visible part is known, else points sampled on it.
//!
//! The mean over receiver points x, with points y drawn on a luminaire of area A, is the ratio estimator
//!
//! ```text
//! mean_x F(x) * [ sum A k(x,y) T(x,y) ] / [ sum A k(x,y) ],     k = cos cos / (pi r²), T = product of tau between
//! ```
//!
//! With F(x) Lambert's closed form it is exact where nothing or everything occludes, so rays only decide the shadow's
//! edge; its bias falls as 1/rays (E. Heitz, S. Hill, M. McGuire, *Combining analytic direct illumination and
//! stochastic shadows*, 2018): good for many rays of one receiver, wrong for one ray of each of many.
//!
//! One sample at one point has no bias: some points `y` are drawn, one of them is chosen in proportion to the kernel k,
//! and one visibility ray goes there (resampled importance sampling, J. F. Talbot et al. 2005). With c any number,
//!
//! ```text
//! F_V = T(y) m + c (F - m),      m = mean of A k over the points drawn,      E[m] = F
//! ```
//!
//! so that a guess c of the visible share is a control variate.
//!
//! Of a luminaire with a texture `A k` is times `E(y)` over the mean E, channel by channel, and F is the closed form of
//! its texture; one sample does without that where a part is hidden, as it costs more than a ray. A few points may all
//! be black in a channel that the luminaire emits, so the ratio has in every channel one more point that emits the mean
//! and has the mean visibility.
//!
//! Not handled: nodes that a light cut samples ([`crate::direct::drawn_light`]).

use glam::{DVec3, Vec2, Vec3};

use crate::direct::emitters::luminaire::{EmittingPoint, Luminaire};
use crate::direct::emitters::luminaire_texture::SeenPart;
use crate::direct::emitters::occlusion::Occlusion;
use crate::direct::emitters::shafts::Between;
use crate::direct::lights::Lights;
use crate::form_factors::point_kernel;
use crate::rays::sobol::{Stream, fraction, hash};
use crate::rays::{End, Hit};
use crate::surfaces::SurfacePoint;

/// Share of a textured luminaire's form factor that counts as all of it, up to rounding.
const WHOLE: f64 = 1.0 - 1e-9;

/// Sums of one luminaire's light over receiver points, weighted per channel (by rho, say).
#[derive(Clone, Copy, Debug, Default)]
pub struct DirectSum {
    exact: DVec3,
    unoccluded: DVec3,
    drawn: DVec3,
    arrived: DVec3,
    /// Points drawn on luminaires with textures, as if they emitted the mean: `A k`, what arrives of it, their number.
    even: Even,
}

/// Sums over points drawn.
#[derive(Clone, Copy, Debug, Default)]
struct Even {
    drawn: DVec3,
    arrived: DVec3,
    count: f64,
}

/// A sample by one point drawn on a luminaire.
struct Sent {
    /// `A k`.
    kernel: f64,
    /// Its emission over the luminaire's mean.
    share: DVec3,
    transmittance: f64,
}

impl DirectSum {
    /// Adds a point drawn on the luminaire for a receiver.
    fn add_sent(&mut self, weight: DVec3, sent: &Sent) {
        let kernel = sent.kernel * sent.share;
        self.drawn += weight * kernel;
        self.arrived += weight * (kernel * sent.transmittance);
    }

    /// Adds a point drawn on a luminaire with a texture, for the channels in which points emit little.
    fn add_even(&mut self, weight: DVec3, sent: &Sent) {
        self.even.drawn += weight * sent.kernel;
        self.even.arrived += weight * (sent.kernel * sent.transmittance);
        self.even.count += 1.0;
    }

    /// Weighted sum of the form factors with occlusion.
    pub fn estimate(&self) -> DVec3 {
        let one = self.even.count.max(1.0).recip();
        let (drawn, arrived) = (self.drawn + one * self.even.drawn, self.arrived + one * self.even.arrived);
        let share = |c: usize| if drawn[c] > 0.0 { arrived[c] / drawn[c] } else { 0.0 };
        self.exact + self.unoccluded * DVec3::new(share(0), share(1), share(2))
    }

    /// Adds the sums of other receivers.
    pub(crate) fn join(&mut self, other: &DirectSum) {
        self.exact += other.exact;
        self.unoccluded += other.unoccluded;
        self.drawn += other.drawn;
        self.arrived += other.arrived;
        self.even.drawn += other.even.drawn;
        self.even.arrived += other.even.arrived;
        self.even.count += other.even.count;
    }

    /// Whether some of the points drawn arrived, and some did not.
    pub(crate) fn is_partly_hidden(&self) -> bool {
        let [drawn, arrived] = [self.drawn + self.even.drawn, self.arrived + self.even.arrived];
        arrived != DVec3::ZERO && arrived != drawn
    }

    /// Whether no point drawn so far faced a receiver.
    fn is_unfaced(&self) -> bool {
        self.drawn + self.even.drawn == DVec3::ZERO
    }
}

/// A luminaire as a patch sees it.
#[derive(Clone, Copy)]
pub struct SeenLuminaire<'a> {
    /// The luminaire.
    pub luminaire: &'a Luminaire,
    /// The occluders between it and the patch.
    pub between: Between<'a>,
}

/// The form factor to the visible part of a luminaire.
enum VisibleForm {
    /// Of all of it, or of one of uniform emission.
    Whole(f64),
    /// Of a part of a texture.
    Part(f64),
}

/// Memory to use again from receiver to receiver, and the count of the rays cast.
#[derive(Default)]
pub struct Scratch {
    /// Rays cast so far.
    pub cast: u64,
    pub(crate) hits: Vec<Hit>,
    /// Probabilities of the nodes of a light cut, added up.
    pub(crate) until: Vec<f64>,
    seen: SeenPart,
}

impl Lights {
    /// Luminaire l as a patch sees it.
    pub fn seen_luminaire(&self, l: usize, patch: u32) -> SeenLuminaire<'_> {
        SeenLuminaire { luminaire: &self.luminaires.list[l], between: self.shafts.between(patch, l) }
    }

    /// Product of tau between a receiver and a point drawn on a luminaire, by one visibility ray.
    pub(crate) fn transmittance(&self, receiver: &SurfacePoint, end: End, scratch: &mut Scratch) -> f64 {
        scratch.cast += 1;
        let rays = &self.geometry.rays;
        f64::from(self.occlusion.transmittance(rays, receiver.end(), end, &mut scratch.hits))
    }

    /// The light that a receiver gets from a luminaire over its radiance, channel by channel, where that is known
    /// without a ray: the form factor to its visible part, if its emission is uniform.
    pub(crate) fn exact_form(
        &self,
        seen: SeenLuminaire,
        receiver: &SurfacePoint,
        scratch: &mut Scratch,
    ) -> Option<DVec3> {
        let (x, n, luminaire) = (receiver.position, receiver.normal, seen.luminaire);
        Some(match self.visible_form(seen, receiver, scratch)? {
            VisibleForm::Whole(form) => luminaire.light(x, n, form, self.exactness),
            VisibleForm::Part(form) => luminaire.light_of(x, n, &mut scratch.seen, form, self.exactness),
        })
    }

    /// The light that a receiver gets from a luminaire over its radiance, where that costs no more than a few rays: not
    /// of a texture of which a part is hidden.
    pub(crate) fn cheap_form(
        &self,
        seen: SeenLuminaire,
        receiver: &SurfacePoint,
        scratch: &mut Scratch,
    ) -> Option<DVec3> {
        let (x, n, luminaire) = (receiver.position, receiver.normal, seen.luminaire);
        match self.visible_form(seen, receiver, scratch)? {
            VisibleForm::Whole(form) => Some(luminaire.light(x, n, form, self.exactness)),
            VisibleForm::Part(_) => None,
        }
    }

    /// The form factor from a receiver to the visible part of a luminaire, where that is known without a ray; the
    /// pieces are in `scratch` if a part is hidden.
    fn visible_form(&self, seen: SeenLuminaire, receiver: &SurfacePoint, scratch: &mut Scratch) -> Option<VisibleForm> {
        let (x, n, luminaire) = (receiver.position, receiver.normal, seen.luminaire);
        if self.occlusion == Occlusion::Nothing {
            return Some(VisibleForm::Whole(luminaire.exact_form(x, n)));
        }
        match seen.between {
            Between::Nothing => luminaire.closed_form(x, n).map(VisibleForm::Whole),
            Between::Faces(faces) => {
                let casters = self.shafts.casters(faces);
                let form = luminaire.visible_form(x, n, casters, &mut scratch.seen.pieces)?;
                // The mean emission of a part of a texture differs from that of the whole.
                let is_part = luminaire.is_textured() && form > 0.0 && form < WHOLE * luminaire.exact_form(x, n);
                Some(if is_part { VisibleForm::Part(form) } else { VisibleForm::Whole(form) })
            }
            Between::Unknown => None,
        }
    }

    /// Adds what one receiver gets from a luminaire to `sum`: its closed form where its visible part is known, else
    /// with one visibility ray for each point of the unit square given.
    pub fn gather_luminaire(
        &self,
        seen: SeenLuminaire,
        receiver: &SurfacePoint,
        weight: DVec3,
        points: impl ExactSizeIterator<Item = Vec2>,
        scratch: &mut Scratch,
        sum: &mut DirectSum,
    ) {
        if let Some(form) = self.exact_form(seen, receiver, scratch) {
            sum.exact += weight * form;
            return;
        }
        let luminaire = seen.luminaire;
        let (x, n) = (receiver.position, receiver.normal);
        let closed = luminaire.closed_form(x, n);
        match closed {
            // Nothing of it faces the receiver.
            Some(0.0) => return,
            Some(form) => sum.unoccluded += weight * luminaire.light(x, n, form, self.exactness),
            None => {}
        }
        let count = points.len() as f64;
        for point in points {
            // Most points of a luminaire half below the horizon are hidden; others are tried until one faces it.
            for (a, b) in [(0.0, 0.0), (0.5, 0.5), (0.5, 0.0), (0.0, 0.5)] {
                let at = Vec2::new((point.x + a).fract(), (point.y + b).fract());
                if let Some(mut sent) = self.sent_from(luminaire, receiver, at, scratch) {
                    sent.kernel /= count;
                    sum.add_sent(weight, &sent);
                    match closed {
                        None => sum.unoccluded += weight * (sent.kernel * sent.share),
                        Some(_) if luminaire.is_textured() => sum.add_even(weight, &sent),
                        Some(_) => {}
                    }
                }
                if closed.is_none() || !sum.is_unfaced() {
                    break;
                }
            }
        }
    }

    /// The sample by the point of a luminaire that belongs to a point of the unit square, with one visibility ray;
    /// `None` where the two points do not face each other.
    fn sent_from(
        &self,
        luminaire: &Luminaire,
        receiver: &SurfacePoint,
        at: Vec2,
        scratch: &mut Scratch,
    ) -> Option<Sent> {
        let y = luminaire.point(at.x, at.y);
        let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        let kernel = luminaire.area * point_kernel(x, n, y.position.as_dvec3(), y.normal);
        let sent = |transmittance| Sent { kernel, share: y.share, transmittance };
        (kernel > 0.0).then(|| sent(self.transmittance(receiver, y.end(), scratch)))
    }
}

/// Points drawn on a luminaire for one visibility ray.
const CANDIDATES: usize = 4;
/// The guess of the visible share.
const GUESS: f64 = 0.5;

/// The mean of the channels; exactly 1 where all are.
fn mean_of(share: DVec3) -> f64 {
    share.element_sum() / 3.0
}

impl Lights {
    /// `F E` of one luminaire at a receiver, without bias.
    pub(crate) fn sample_luminaire(
        &self,
        seen: SeenLuminaire,
        receiver: &SurfacePoint,
        random: &mut Stream,
        scratch: &mut Scratch,
    ) -> DVec3 {
        let form = match self.cheap_form(seen, receiver, scratch) {
            Some(form) => form,
            None => self.draw(receiver, seen.luminaire, random, scratch),
        };
        form * seen.luminaire.radiance.as_dvec3()
    }

    /// An estimate without bias of the form factor to the visible part of a luminaire, by points drawn on it and a
    /// visibility ray to one of them.
    fn draw(
        &self,
        receiver: &SurfacePoint,
        luminaire: &Luminaire,
        random: &mut Stream,
        scratch: &mut Scratch,
    ) -> DVec3 {
        let closed = luminaire.closed_form(receiver.position, receiver.normal);
        if closed == Some(0.0) {
            return DVec3::ZERO;
        }
        let closed = closed.map(|form| luminaire.light(receiver.position, receiver.normal, form, self.exactness));
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
        // The estimate without occlusion.
        let mean = chosen.map_or(DVec3::ZERO, |y| sum / CANDIDATES as f64 * y.share / mean_of(y.share));
        let arrived = chosen.map_or(0.0, |y| self.transmittance(receiver, y.end(), scratch));
        arrived * mean + closed.map_or(DVec3::ZERO, |form| GUESS * (form - mean))
    }
}

/// A point of the unit square that differs from receiver to receiver and from luminaire to luminaire.
pub(crate) fn point_for(x: Vec3, luminaire: u32) -> Vec2 {
    let place = x.to_array().map(f32::to_bits);
    let seed = place.into_iter().fold(luminaire, |seed, bits| hash(bits, seed));
    Vec2::new(fraction(seed), fraction(hash(1, seed)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIGHT: DVec3 = DVec3::new(1.0, 0.5, 0.25);

    /// Light of a screen whose left half is red and whose right half is white, from points visible by `seen`.
    fn estimate(points: usize, seen: impl Fn(bool) -> bool) -> DVec3 {
        let mut sum = DirectSum { unoccluded: LIGHT, ..DirectSum::default() };
        for k in 0..points {
            let is_red = k % 2 == 0;
            let share = if is_red { DVec3::new(1.5, 0.0, 0.0) } else { DVec3::new(0.5, 2.0, 2.0) };
            let sent = Sent { kernel: 0.3, share, transmittance: f64::from(u8::from(seen(is_red))) };
            sum.add_sent(DVec3::ONE, &sent);
            sum.add_even(DVec3::ONE, &sent);
        }
        sum.estimate()
    }

    #[test]
    fn a_point_that_is_black_in_a_channel_does_not_darken_it() {
        assert_eq!(estimate(1, |_| true), LIGHT);
        assert_eq!(estimate(1, |_| false), DVec3::ZERO);
    }

    #[test]
    fn many_points_show_which_colours_are_hidden() {
        // Of the red light three quarters come from the red half, of the rest nothing; one point in 1001 is even.
        let expected = LIGHT * DVec3::new(0.75, 0.0, 0.0);
        let off = (estimate(1000, |is_red| is_red) - expected).abs();
        assert!(off.max_element() < 1e-3, "{off}");
    }
}
