//! Proven bounds on everything after a term of the series.
//!
//! Let `y > 0` where `alpha rho > 0`, and `B y <= lambda y` with lambda < 1, B = alpha rho F. If
//! `|term_invisible| <= c y`, the invisible halves of all later terms sum to at most `c lambda/(1-lambda) y`, and the
//! visible ones, each `rho F` of the invisible term before, to at most `c/(1-lambda) rho F y`, patch by patch and
//! channel by channel, since F >= 0.
//!
//! The vector x that proves the bound on the spectral radius is such a y, but it is next to nothing on patches that see
//! almost nothing of what reflects: `term/x` may be anything there. So x is lifted by a multiple of
//!
//! ```text
//! s = 1 + (B/mu) 1 + ... + (B/mu)^m 1      B s = mu (s - 1 + t),   t = (B/mu)^(m+1) 1,   radius < mu < 1
//! ```
//!
//! s is at least 1 on every patch that passes light on, so `term/(x + e s) <= max term / e`. It is a proof wherever
//! `t <= 1`, and x + e s is one wherever `e mu (t - 1) <= (mu - lambda) x`: after enough bounces t shrinks towards a
//! small multiple of x, so that some e does. None of this is taken on trust: lambda of every y is the largest
//! `(B y)_i / y_i` found, widened by the rounding of the products. Of all y that are tried the least bound is taken;
//! each is proved, so that is.
//!
//! The bound by the resolvent applied to ones, z = (I - B)^-1 1, is taken where it is less: `term <= max term 1`.
//!
//! Not handled: radii that are not proved to be below 1.

use glam::{DVec3, Vec4};

use crate::light::{Light, Rgb};
use crate::operator::spectrum::positive;
use crate::operator::{LinearOperator, Spectrum};

/// Products with B that s may take.
const LIFT_PRODUCTS: usize = 16;
/// Multiples of s that are added to x, as shares of their largest components; and s alone.
const LIFTS: [f64; 8] = [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0];

/// Bounds the tail of the series from one term.
pub struct TailBound {
    /// Of each channel.
    channels: [Vec<Proof>; 3],
    x: Vec<Vec4>,
    s: Vec<Vec4>,
    /// `rho F x` and `rho F s`.
    seen: [Vec<Vec4>; 2],
    ones: Resolvent,
}

/// A vector `y = u x + v s` with `B y <= lambda y`.
#[derive(Clone, Copy)]
struct Proof {
    u: f64,
    v: f64,
    lambda: f64,
    /// Norms of y and of `rho F y` in this channel, as in [`norm`](crate::solve::norm).
    norms: [f64; 2],
}

impl Proof {
    fn of(&self, x: f32, s: f32) -> f64 {
        self.u * f64::from(x) + self.v * f64::from(s)
    }
}

impl TailBound {
    /// `None` where the upper bound on the radius is not below 1.
    pub fn new(k: &dyn LinearOperator, spectrum: &Spectrum) -> Option<TailBound> {
        if spectrum.worst().upper >= 1.0 {
            return None;
        }
        let b: Vec<Vec4> = (0..k.areas().len()).map(|i| k.passed_on(i).extend(0.0)).collect();
        let (s, fs) = lift(k, &b, spectrum.channels.map(|c| c.upper));
        let seen = [&spectrum.fx, &fs].map(|f| {
            let rows = f.iter().zip(k.reflectances());
            rows.map(|(f, rho)| *f * rho.extend(0.0)).collect()
        });
        let mut bound =
            TailBound { channels: Default::default(), x: spectrum.x.clone(), s, seen, ones: Resolvent::default() };
        let passed = [&spectrum.fx, &fs].map(|f| scaled(f, &b));
        for (c, bounds) in spectrum.channels.iter().enumerate() {
            let mut tried: Vec<Proof> = bound.lifted(c).collect();
            tried.retain_mut(|proof| {
                // x alone is proved already.
                proof.lambda = match proof.v {
                    0.0 => bounds.upper,
                    _ => bound.growth(proof, &passed, c),
                };
                proof.norms = bound.norms(proof, k.areas(), c);
                proof.lambda < 1.0
            });
            bound.channels[c] = tried;
        }
        let after = |last: &[Light]| bound.field_of(last, |_, _| [f64::INFINITY; 2]);
        bound.ones = Resolvent::new(k, &b, after);
        Some(bound)
    }

    /// x and its lifts in one channel, of which nothing is proved yet.
    fn lifted(&self, c: usize) -> impl Iterator<Item = Proof> {
        let largest = |v: &[Vec4]| v.iter().map(|v| v[c]).fold(0.0f32, f32::max);
        let scale = |v: &[Vec4]| 1.0 / f64::from(largest(v)).max(f64::MIN_POSITIVE);
        let (u, v) = (scale(&self.x), scale(&self.s));
        let multiples = LIFTS.map(|e| (u, e * v)).into_iter().chain([(0.0, v)]);
        multiples.map(|(u, v)| Proof { u, v, lambda: 1.0, norms: [0.0; 2] })
    }

    /// The largest `(B y)_i / y_i`, widened by rounding; `passed` holds B x and B s.
    fn growth(&self, proof: &Proof, passed: &[Vec<Vec4>; 2], c: usize) -> f64 {
        let mut largest = 0.0f64;
        let vectors = self.x.iter().zip(&self.s);
        let [bx, bs] = passed;
        for ((x, s), (bx, bs)) in vectors.zip(bx.iter().zip(bs)) {
            let y = proof.of(x[c], s[c]);
            if y > 0.0 {
                largest = largest.max(proof.of(bx[c], bs[c]) / y);
            }
        }
        largest * (1.0 + Spectrum::ROUNDING)
    }

    fn norms(&self, proof: &Proof, areas: &[f64], c: usize) -> [f64; 2] {
        let squares = |x: &[Vec4], s: &[Vec4]| -> f64 {
            let each = x.iter().zip(s).zip(areas);
            let sum: f64 = each.map(|((x, s), a)| a * proof.of(x[c], s[c]).powi(2)).sum();
            sum / (6.0 * areas.iter().sum::<f64>())
        };
        let [x, s] = &self.seen;
        let seen = squares(x, s).sqrt() * (1.0 + Spectrum::ROUNDING);
        [squares(&self.x, &self.s).sqrt(), seen]
    }

    /// Bound on the norm of everything after this term; `None` if the term is not 0 on a patch that passes nothing on.
    pub fn after(&self, term: &[Light]) -> Option<f64> {
        let mut sum = 0.0;
        for (c, proofs) in self.channels.iter().enumerate() {
            let bound = |proof: &Proof| {
                let rest = self.scale(proof, term, c)? / (1.0 - proof.lambda);
                let [y, w] = proof.norms;
                Some((proof.lambda * rest * y).powi(2) + (rest * w).powi(2))
            };
            let least = proofs.iter().filter_map(bound).fold(f64::INFINITY, f64::min);
            if least.is_infinite() {
                return None;
            }
            let [rest, seen] = self.ones.norms[c].map(|norm| norm * largest(term, c));
            let ones = rest * rest + seen * seen;
            // NaN where nothing is proved of the ones and the term is 0.
            sum += if ones < least { ones } else { least };
        }
        Some(sum.sqrt())
    }

    /// Light that everything after this term cannot exceed, patch by patch, either half and in any channel.
    pub fn field(&self, term: &[Light]) -> Option<Vec<Light>> {
        let most = [0, 1, 2].map(|c| largest(term, c));
        self.field_of(term, |i, c| [&self.ones.rest, &self.ones.seen].map(|v| most[c] * f64::from(v[i][c])))
    }

    /// The least of the bounds of all y, and of another bound on both halves of channel c of patch i.
    fn field_of(&self, term: &[Light], other: impl Fn(usize, usize) -> [f64; 2]) -> Option<Vec<Light>> {
        let mut field = vec![Light::default(); term.len()];
        for (c, proofs) in self.channels.iter().enumerate() {
            let scaled = |proof: &Proof| {
                let rest = self.scale(proof, term, c)? / (1.0 - proof.lambda);
                Some((*proof, rest))
            };
            let proved: Vec<(Proof, f64)> = proofs.iter().filter_map(scaled).collect();
            if proved.is_empty() {
                return None;
            }
            for (i, light) in field.iter_mut().enumerate() {
                let mut least = other(i, c);
                for (proof, rest) in &proved {
                    let y = proof.of(self.x[i][c], self.s[i][c]);
                    let w = proof.of(self.seen[0][i][c], self.seen[1][i][c]);
                    let w = rest * w * (1.0 + Spectrum::ROUNDING);
                    // The first is NaN where nothing is proved of the ones and the term is 0.
                    least = [(proof.lambda * rest * y).min(least[0]), w.min(least[1])];
                }
                let up = |x: f64| x as f32 * (1.0 + f32::EPSILON);
                (light.invisible[c], light.visible[c]) = (up(least[0]), up(least[1]));
            }
        }
        Some(field)
    }

    /// The smallest c with `|term_invisible| <= c y` in one channel.
    fn scale(&self, proof: &Proof, term: &[Light], c: usize) -> Option<f64> {
        let mut scale = 0.0f64;
        for (i, light) in term.iter().enumerate() {
            let value = f64::from(light.invisible[c].abs());
            if value > 0.0 {
                let y = proof.of(self.x[i][c], self.s[i][c]);
                if y <= 0.0 {
                    return None;
                }
                scale = scale.max(value / y);
            }
        }
        Some(scale)
    }
}

/// s and `F s`: bounces are added until the next one is at most 1 everywhere.
fn lift(k: &dyn LinearOperator, b: &[Vec4], upper: [f64; 3]) -> (Vec<Vec4>, Vec<Vec4>) {
    // Half way to 1: mu far above the radius makes t shrink, mu far below 1 keeps the bound tight.
    let mu = DVec3::from_array(upper.map(|u| 0.5 * (1.0 + u))).as_vec3();
    let over = (Rgb::ONE / mu).extend(0.0);
    let mut t: Vec<Vec4> = b.iter().map(|b| positive(*b)).collect();
    let mut s = t.clone();
    for _ in 0..LIFT_PRODUCTS {
        let next = scaled(&k.incident(&t), b);
        t = next.iter().map(|t| *t * over).collect();
        if t.iter().all(|t| t.max_element() <= 1.0) {
            break;
        }
        for (s, t) in s.iter_mut().zip(&t) {
            *s += *t;
        }
    }
    let fs = k.incident(&s);
    (s, fs)
}

/// The largest invisible half of a term in one channel.
fn largest(term: &[Light], c: usize) -> f64 {
    let most = term.iter().map(|l| l.invisible[c].abs());
    f64::from(most.fold(0.0f32, f32::max))
}

/// Products with B that z may take, and the size of its last term that ends it.
const RESOLVENT_PRODUCTS: usize = 64;
const SMALL: f32 = 1e-4;

/// z of all channels; infinite where nothing is proved.
#[derive(Default)]
pub(crate) struct Resolvent {
    /// z less the ones.
    pub rest: Vec<Vec4>,
    /// `rho F z`.
    pub seen: Vec<Vec4>,
    /// Norms of both in each channel.
    pub norms: [[f64; 2]; 3],
}

impl Resolvent {
    /// z, from products with B and a bound on what follows the last, which `after` gives patch by patch.
    pub(crate) fn new(k: &dyn LinearOperator, b: &[Vec4], after: impl Fn(&[Light]) -> Option<Vec<Light>>) -> Resolvent {
        let mut term: Vec<Vec4> = b.iter().map(|b| positive(*b)).collect();
        let mut rest = vec![Vec4::ZERO; b.len()];
        for _ in 0..RESOLVENT_PRODUCTS {
            term = scaled(&k.incident(&term), b);
            for (sum, t) in rest.iter_mut().zip(&term) {
                *sum += *t;
            }
            if term.iter().all(|t| t.max_element() <= SMALL) {
                break;
            }
        }
        // Each product is off by its rounding at the most, and so is each sum.
        let wide = (1.0 + 2.0 * RESOLVENT_PRODUCTS as f64 * Spectrum::ROUNDING) as f32;
        let last: Vec<Light> = term.iter().map(|t| Light::unseen(wide * t.truncate())).collect();
        let field = after(&last);
        let left = |i: usize| match &field {
            Some(field) => field[i].invisible,
            None => Rgb::INFINITY,
        };
        for (i, sum) in rest.iter_mut().enumerate() {
            *sum = wide * *sum + left(i).extend(0.0);
        }
        let whole: Vec<Vec4> = rest.iter().zip(b).map(|(r, b)| *r + positive(*b)).collect();
        let seen: Vec<Vec4> = k.incident(&whole);
        let rho = k.reflectances().iter();
        let seen: Vec<Vec4> = seen.iter().zip(rho).map(|(f, r)| wide * *f * r.extend(0.0)).collect();
        let areas = k.areas();
        let norm = |v: &[Vec4], c: usize| -> f64 {
            let squares = v.iter().zip(areas).map(|(v, a)| a * f64::from(v[c]).powi(2));
            (squares.sum::<f64>() / (6.0 * areas.iter().sum::<f64>())).sqrt()
        };
        Resolvent { norms: [0, 1, 2].map(|c| [norm(&rest, c), norm(&seen, c)]), rest, seen }
    }
}

/// `x_i b_i` for every patch.
fn scaled(x: &[Vec4], b: &[Vec4]) -> Vec<Vec4> {
    x.iter().zip(b).map(|(x, b)| *x * *b).collect()
}
