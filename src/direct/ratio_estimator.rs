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
//! Of a luminaire with a texture `A k` is times `E(y)` over the mean E in both sums, channel by channel, and F(x) is
//! the closed form of its texture. A few points may all be black in a channel that the luminaire emits, so the
//! visibility of the points counts in every channel as if one point more had been drawn that emits the mean.
//!
//! Not handled: luminaires that a light cut leaves to be drawn ([`crate::direct::cut_light`]).

use glam::{DVec3, Vec2};

use crate::direct::emission_parts::Polygons;
use crate::direct::luminaire::Luminaire;
use crate::direct::occlusion::Occlusion;
use crate::direct::shaft_culling::Between;
use crate::direct::visibility::Lighting;
use crate::form_factors::point_kernel;
use crate::form_factors::shadow::Pieces;
use crate::rays::Hit;
use crate::surfaces::SurfacePoint;

/// Share of a textured luminaire's form factor from which on all of it is seen; what is missing is rounding.
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

/// What one point drawn on a luminaire sends.
struct Sent {
    /// `A k`.
    kernel: f64,
    /// What it emits over the luminaire's mean.
    share: DVec3,
    transmittance: f64,
}

impl DirectSum {
    /// Adds a receiver point whose form factor is known.
    pub fn add_exact(&mut self, weight: DVec3, form: DVec3) {
        self.exact += weight * form;
    }

    /// Adds a receiver point that sees the luminaire under form factor `closed` when nothing is between.
    pub fn add_point(&mut self, weight: DVec3, closed: DVec3) {
        self.unoccluded += weight * closed;
    }

    /// Adds a point drawn on the luminaire: `kernel` is `A k(x, y)`.
    pub fn add_ray(&mut self, weight: DVec3, kernel: f64, transmittance: f32) {
        self.add_sent(weight, &Sent { kernel, share: DVec3::ONE, transmittance: f64::from(transmittance) });
    }

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

    /// Whether no point drawn so far faced a receiver.
    fn is_blind(&self) -> bool {
        self.drawn + self.even.drawn == DVec3::ZERO
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

/// A form factor to what is seen of a luminaire.
enum Known {
    /// Of all of it, or of one whose parts emit alike.
    Whole(f64),
    /// Of a part of a texture.
    Part(f64),
}

/// Memory to use again from receiver to receiver.
#[derive(Default)]
pub struct Scratch {
    hits: Vec<Hit>,
    pieces: Pieces,
    polygons: Polygons,
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

    /// The light that a receiver gets from a luminaire over its radiance, where that is known without a ray: the form
    /// factor to what it sees, in each channel if all of it emits alike.
    pub(crate) fn exact_form(&self, lamp: Lamp, receiver: &SurfacePoint, scratch: &mut Scratch) -> Option<DVec3> {
        let (x, n, luminaire) = (receiver.position, receiver.normal, lamp.luminaire);
        let known = self.known(lamp, receiver, scratch)?;
        Some(match known {
            Known::Whole(form) => luminaire.light(x, n, form),
            Known::Part(form) => luminaire.light_of(x, n, &scratch.pieces, form, &mut scratch.polygons),
        })
    }

    /// The same where it costs no more than a few rays: not of a texture of which a part is hidden.
    pub(crate) fn cheap_form(&self, lamp: Lamp, receiver: &SurfacePoint, scratch: &mut Scratch) -> Option<DVec3> {
        let (x, n, luminaire) = (receiver.position, receiver.normal, lamp.luminaire);
        match self.known(lamp, receiver, scratch)? {
            Known::Whole(form) => Some(luminaire.light(x, n, form)),
            Known::Part(_) => None,
        }
    }

    /// The form factor from a receiver to what it sees of a luminaire, where that is known without a ray; the pieces
    /// are in `scratch` if a part is hidden.
    fn known(&self, lamp: Lamp, receiver: &SurfacePoint, scratch: &mut Scratch) -> Option<Known> {
        let (x, n, luminaire) = (receiver.position, receiver.normal, lamp.luminaire);
        if self.sight.occlusion == Occlusion::Nothing {
            return Some(Known::Whole(luminaire.exact_form(x, n)));
        }
        match lamp.between {
            Between::Nothing => luminaire.closed_form(x, n).map(Known::Whole),
            Between::Faces(faces) => {
                let casters = self.sight.shafts.casters(faces);
                let form = luminaire.visible_form(x, n, casters, &mut scratch.pieces)?;
                // A part of a texture emits otherwise than the whole.
                let is_part = luminaire.is_textured() && form > 0.0 && form < WHOLE * luminaire.exact_form(x, n);
                Some(if is_part { Known::Part(form) } else { Known::Whole(form) })
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
        let luminaire = lamp.luminaire;
        let (x, n) = (receiver.position, receiver.normal);
        let closed = luminaire.closed_form(x, n);
        match closed {
            // Nothing of it faces the receiver.
            Some(0.0) => return 0,
            Some(form) => sum.add_point(weight, luminaire.light(x, n, form)),
            None => {}
        }
        let count = points.len() as f64;
        let mut cast = 0;
        for point in points {
            // A luminaire half below the horizon hides most points drawn; until one is found, others are tried.
            for (a, b) in [(0.0, 0.0), (0.5, 0.5), (0.5, 0.0), (0.0, 0.5)] {
                let at = Vec2::new((point.x + a).fract(), (point.y + b).fract());
                if let Some(mut sent) = self.look(luminaire, receiver, at, scratch) {
                    cast += 1;
                    sent.kernel /= count;
                    sum.add_sent(weight, &sent);
                    match closed {
                        None => sum.add_point(weight, sent.kernel * sent.share),
                        Some(_) if luminaire.is_textured() => sum.add_even(weight, &sent),
                        Some(_) => {}
                    }
                }
                if closed.is_none() || !sum.is_blind() {
                    break;
                }
            }
        }
        cast
    }

    /// What the point sends that belongs to a place of the unit square on a luminaire, asked by one visibility ray;
    /// `None` where the two points do not face each other.
    fn look(&self, luminaire: &Luminaire, receiver: &SurfacePoint, at: Vec2, scratch: &mut Scratch) -> Option<Sent> {
        let y = luminaire.point(at.x, at.y);
        let (x, n) = (receiver.position.as_dvec3(), receiver.normal.as_dvec3());
        let kernel = luminaire.area * point_kernel(x, n, y.position.as_dvec3(), y.normal);
        let hits = scratch.hits();
        let mut arrived = || self.sight.occlusion.transmittance(self.rays, receiver.end(), y.end(), hits);
        (kernel > 0.0).then(|| Sent { kernel, share: y.share, transmittance: f64::from(arrived()) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIGHT: DVec3 = DVec3::new(1.0, 0.5, 0.25);

    /// Light of a screen whose left half is red and whose right half is white, from points of which `seen` tells which
    /// arrive.
    fn estimate(points: usize, seen: impl Fn(bool) -> bool) -> DVec3 {
        let mut sum = DirectSum::default();
        sum.add_point(DVec3::ONE, LIGHT);
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
    fn a_point_that_is_black_in_a_channel_takes_nothing_from_it() {
        assert_eq!(estimate(1, |_| true), LIGHT);
        assert_eq!(estimate(1, |_| false), DVec3::ZERO);
    }

    #[test]
    fn many_points_tell_which_colours_are_hidden() {
        // Of the red light three quarters come from the red half, of the rest nothing; one point in 1001 is even.
        let expected = LIGHT * DVec3::new(0.75, 0.0, 0.0);
        let off = (estimate(1000, |is_red| is_red) - expected).abs();
        assert!(off.max_element() < 1e-3, "{off}");
    }
}
