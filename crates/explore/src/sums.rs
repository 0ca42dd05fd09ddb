//! The sums that the page shows: what each kept term counts in a picture, for any alpha, tau, bounce and lamps.
//!
//! ```text
//! L_vis = g E + r rho sum over lamps, n, nodes q of  w I,   w = g a_n l_q(tau) s_n(tau) / S_qn
//!
//! a_n   (alpha r)^(n-1): exact, as alpha scales what is passed on, and r all reflectances
//! l_q   Lagrange's weights of the nodes, Chebyshev's extreme points 0 .. 1: both ends, and so all four modes
//! s_n   the power of the term at tau: interpolated by its logarithm, as terms grow geometrically with tau;
//!       what is interpolated linearly is a term's shape, its light over its power
//! rest  the terms after T_N, two geometric series: T_N = c v + d, v the dominant eigenvector, K v = lambda v,
//!         sum over n > N of alpha^(n-1) T_n = alpha^N lambda/(1 - alpha lambda) c v + alpha^N mu/(1 - alpha mu) d
//!       of which the first is exact, and mu = <d, K d>/<d, d>, with <x, y> = sum A x y / rho, for which
//!       reciprocity makes K symmetric: what is left of d's own series is orthogonal to d
//! ```
//!
//! The page has the same arithmetic in `page/transport.js`; [`crate::drawn`] compares both. Bounds on the
//! spectral radius between taus follow from those at them: it rises with tau, and its logarithm is convex in that of
//! tau (J. F. C. Kingman 1961), so chords are bounds above, and chords of the intervals beside it, drawn out, bounds
//! below.
//!
//! Not handled: what the interpolation leaves, which [`crate::terms`] measures.

use glam::DVec3;

use halflight::operator::Bounds;

/// Which terms are shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shown {
    /// One alone.
    Term(usize),
    /// E and all up to this one.
    UpTo(usize),
    /// All of them.
    All,
}

/// What is chosen in the page.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub alpha: f64,
    pub tau: f64,
    pub shown: Shown,
    /// Factor on the light of each lamp.
    pub gains: Vec<DVec3>,
    /// Factor on the reflectance of all surfaces: K is so many times as large.
    pub rho: f64,
    pub stops: f64,
}

/// What is kept of the terms besides their light; indices are node, lamp, then term or channel.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept {
    /// The nodes.
    pub taus: Vec<f64>,
    /// Power of the visible half of every term from E on, W.
    pub powers: Vec<Vec<Vec<DVec3>>>,
    /// Of every node the largest eigenvalue of each channel.
    pub lambda: Vec<DVec3>,
    /// By node and lamp, what tells the terms after the last.
    pub rest: Vec<Vec<Rest>>,
    /// Proved bounds on the spectral radius at alpha = 1, by tau.
    pub radii: Vec<(f64, Bounds)>,
}

/// The last term `T_N = c v + d` of a lamp, channel by channel.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub(super) struct Rest {
    /// c, where v has the power pi.
    pub dominant: [f64; 3],
    /// mu, by which the rest d of it shrinks from term to term.
    pub mu: [f64; 3],
}

/// What every layer of light counts.
#[derive(Clone, Debug)]
pub(super) struct Mixture {
    /// Factor on E of each lamp.
    pub emission: Vec<DVec3>,
    /// By node, lamp, and term from KE on.
    pub weights: Vec<Vec<Vec<DVec3>>>,
    /// Of the dominant eigenvector of each node.
    pub dominant: Vec<DVec3>,
    /// Factor on reflectances.
    pub rho: f64,
}

/// The nodes, so many.
pub(super) fn nodes(count: usize) -> Vec<f64> {
    let last = count.max(2) - 1;
    (0..=last).map(|q| 0.5 - 0.5 * (std::f64::consts::PI * q as f64 / last as f64).cos()).map(tidy).collect()
}

/// Between two nodes and next to both ends, where interpolation is worst: the middles in the angle.
pub(super) fn between(count: usize) -> Vec<f64> {
    let last = count.max(2) - 1;
    let middle = |q: usize| 0.5 - 0.5 * (std::f64::consts::PI * (q as f64 + 0.5) / last as f64).cos();
    (0..last).map(middle).chain([0.3]).map(tidy).collect()
}

/// Four digits are enough to name a tau.
fn tidy(tau: f64) -> f64 {
    (1e4 * tau).round() / 1e4
}

impl Kept {
    /// Number of terms after E.
    pub fn terms(&self) -> usize {
        self.powers.first().and_then(|lamps| lamps.first()).map_or(0, |terms| terms.len() - 1)
    }

    fn lamps(&self) -> usize {
        self.powers.first().map_or(0, Vec::len)
    }

    /// Lagrange's weights of the nodes.
    fn lagrange(&self, tau: f64) -> Vec<f64> {
        let of = |q: usize| {
            let others = self.taus.iter().enumerate().filter(|(k, _)| *k != q);
            others.map(|(_, other)| (tau - other) / (self.taus[q] - other)).product()
        };
        (0..self.taus.len()).map(of).collect()
    }

    /// A positive number interpolated by its logarithm; none where it is 0 at a node.
    fn by_logarithm(&self, weights: &[f64], of: impl Fn(usize) -> f64) -> Option<f64> {
        let terms = weights.iter().enumerate().map(|(q, l)| (l, of(q)));
        let sum = terms.map(|(l, x)| (x > 0.0).then(|| l * x.ln())).sum::<Option<f64>>()?;
        Some(sum.exp())
    }

    /// Power of term n of a lamp in a channel, at alpha = 1.
    fn power(&self, weights: &[f64], lamp: usize, n: usize, c: usize) -> f64 {
        let of = |q: usize| self.powers[q][lamp][n][c];
        let linear = || weights.iter().enumerate().map(|(q, l)| l * of(q)).sum();
        self.by_logarithm(weights, of).unwrap_or_else(linear)
    }

    /// Bounds on the spectral radius at (alpha, tau).
    pub fn radius(&self, alpha: f64, tau: f64) -> Bounds {
        let Bounds { lower, upper } = self.radius_at_one(tau);
        Bounds { lower: alpha * lower, upper: alpha * upper }
    }

    fn radius_at_one(&self, tau: f64) -> Bounds {
        if let Some((_, known)) = self.radii.iter().find(|(t, _)| *t == tau) {
            return *known;
        }
        let i = self.radii.partition_point(|(t, _)| *t < tau).saturating_sub(1);
        let at =
            |k: usize| self.radii.get(k).filter(|(t, _)| *t > 0.0).map(|(t, b)| (t.ln(), b.lower.ln(), b.upper.ln()));
        let x = tau.ln();
        let line = |(x0, y0): (f64, f64), (x1, y1): (f64, f64)| (y0 + (y1 - y0) * (x - x0) / (x1 - x0)).exp();
        let (low, high) = (self.radii[i].1, self.radii.get(i + 1).map_or(self.radii[i].1, |r| r.1));
        let upper = match (at(i), at(i + 1)) {
            (Some(a), Some(b)) => line((a.0, a.2), (b.0, b.2)),
            _ => high.upper,
        };
        let before = i.checked_sub(1).and_then(at).zip(at(i)).map(|(a, b)| line((a.0, a.2), (b.0, b.1)));
        let after = at(i + 1).zip(at(i + 2)).map(|(a, b)| line((b.0, b.2), (a.0, a.1)));
        let lower = [before, after].into_iter().flatten().filter(|x| x.is_finite()).fold(low.lower, f64::max);
        Bounds { lower, upper }
    }

    /// What each layer counts in a state.
    pub fn mixture(&self, state: &State) -> Mixture {
        // What arrives is that of an alpha so many times as large.
        let state = &State { alpha: state.rho * state.alpha, ..state.clone() };
        let weights = self.lagrange(state.tau);
        let last = self.terms();
        let radius = self.radius(state.alpha, state.tau);
        let diverges = state.shown == Shown::All && state.alpha > 0.0 && radius.upper >= 1.0;
        let power = |n: usize| state.alpha.powi(n as i32 - 1);
        let mut coefficients = vec![vec![DVec3::ZERO; last]; self.lamps()];
        let (mut emission, mut shown) = (1.0, 1..=last);
        match state.shown {
            _ if diverges => (emission, shown) = (0.0, last..=last),
            Shown::Term(n) => (emission, shown) = (f64::from(u8::from(n == 0)), n.max(1)..=n),
            Shown::UpTo(n) => shown = 1..=n,
            Shown::All => {}
        }
        let factor = if diverges { self.brightened(state, &weights) } else { 1.0 };
        let mut of_dominant = DVec3::ZERO;
        for (lamp, own) in coefficients.iter_mut().enumerate() {
            shown.clone().for_each(|n| own[n - 1] = DVec3::splat(factor * power(n)));
            if state.shown == Shown::All && !diverges {
                let [of_last, dominant] = self.rest(lamp, state.alpha, &weights);
                own[last - 1] += of_last;
                of_dominant += state.gains[lamp] * dominant;
            }
        }
        let of = |q: usize, lamp: usize, n: usize| {
            let one = |c: usize| {
                let a = state.gains[lamp][c] * coefficients[lamp][n - 1][c] * weights[q];
                let sizes = self.by_logarithm(&weights, |q| self.powers[q][lamp][n][c]);
                sizes.map_or(a, |size| a * size / self.powers[q][lamp][n][c])
            };
            if coefficients[lamp][n - 1] == DVec3::ZERO || weights[q] == 0.0 {
                return DVec3::ZERO;
            }
            DVec3::new(one(0), one(1), one(2))
        };
        let of_lamp = |q: usize, lamp: usize| (1..=last).map(|n| of(q, lamp, n)).collect();
        Mixture {
            emission: state.gains.iter().map(|gain| emission * *gain).collect(),
            weights: (0..self.taus.len()).map(|q| (0..self.lamps()).map(|l| of_lamp(q, l)).collect()).collect(),
            dominant: weights.iter().map(|l| *l * of_dominant).collect(),
            rho: state.rho,
        }
    }

    /// By how much the last term is brightened to have the power of the first.
    fn brightened(&self, state: &State, weights: &[f64]) -> f64 {
        let power = |n: usize| -> f64 {
            let lamps = (0..self.lamps()).flat_map(|lamp| (0..3).map(move |c| (lamp, c)));
            let all = lamps.map(|(lamp, c)| state.gains[lamp][c] * self.power(weights, lamp, n, c));
            state.alpha.powi(n as i32 - 1) * all.sum::<f64>()
        };
        let last = power(self.terms());
        if last > 0.0 { power(1) / last } else { 0.0 }
    }

    /// What the terms after the last add: to the coefficient of the last term of a lamp, and to v.
    fn rest(&self, lamp: usize, alpha: f64, weights: &[f64]) -> [DVec3; 2] {
        let scale = alpha.powi(self.terms() as i32);
        let series = |x: f64| scale * x / (1.0 - alpha * x);
        let [mut of_last, mut of_dominant] = [DVec3::ZERO; 2];
        for c in 0..3 {
            let mu = (0..weights.len()).map(|q| weights[q] * self.rest[q][lamp].mu[c]).sum();
            let own = self.by_logarithm(weights, |q| self.rest[q][lamp].dominant[c]).unwrap_or(0.0);
            let lambda = self.by_logarithm(weights, |q| self.lambda[q][c]).unwrap_or(0.0);
            of_last[c] = series(mu);
            of_dominant[c] = own * (series(lambda) - series(mu));
        }
        [of_last, of_dominant]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two modes of light, of eigenvalues that grow with tau; one patch for each, so that all is known in closed form.
    fn kept(taus: &[f64], eigenvalues: fn(f64) -> [f64; 2], terms: usize) -> Kept {
        let first = [1.0, 0.5];
        let term = |tau: f64, n: usize| [0, 1].map(|k| first[k] * eigenvalues(tau)[k].powi(n as i32 - 1));
        let power = |tau: f64, n: usize| if n == 0 { 1.0 } else { term(tau, n).iter().sum() };
        let rest = |tau: f64| vec![Rest { dominant: [term(tau, terms)[0]; 3], mu: [eigenvalues(tau)[1]; 3] }];
        let radius = |tau: f64| {
            let r = eigenvalues(tau)[0];
            Bounds { lower: 0.999 * r, upper: 1.001 * r }
        };
        Kept {
            taus: taus.to_vec(),
            powers: taus.iter().map(|&t| vec![(0..=terms).map(|n| DVec3::splat(power(t, n))).collect()]).collect(),
            lambda: taus.iter().map(|&t| DVec3::splat(eigenvalues(t)[0])).collect(),
            rest: taus.iter().map(|&t| rest(t)).collect(),
            radii: (0..=10).map(|k| f64::from(k) / 10.0).map(|t| (t, radius(t))).collect(),
        }
    }

    fn state(alpha: f64, tau: f64, shown: Shown) -> State {
        State { alpha, tau, shown, gains: vec![DVec3::ONE], rho: 1.0, stops: 0.0 }
    }

    /// With two eigenvalues the rest is two geometric series, and the sum is exact.
    #[test]
    fn the_rest_of_two_modes_of_light_is_exact() {
        let kept = kept(&[0.0, 1.0], |_| [0.8, 0.3], 4);
        for alpha in [0.2, 0.7, 1.0] {
            let mixture = kept.mixture(&state(alpha, 0.0, Shown::All));
            let own = &mixture.weights[0][0];
            for (k, eigenvalue) in [0.8_f64, 0.3].into_iter().enumerate() {
                let first = [1.0, 0.5][k];
                let dominant = if k == 0 { mixture.dominant[0].x } else { 0.0 };
                let sum: f64 =
                    own.iter().zip(0..).map(|(w, n)| w.x * first * eigenvalue.powi(n)).sum::<f64>() + dominant;
                let exact = first / (1.0 - alpha * eigenvalue);
                assert!((sum - exact).abs() < 1e-9 * exact, "{alpha}: {sum} {exact}");
            }
        }
    }

    /// Twice the reflectance is twice K: with two eigenvalues the sum is known.
    #[test]
    fn other_reflectances_are_another_k() {
        let kept = kept(&[0.0, 1.0], |_| [0.4, 0.3], 4);
        let mixture = kept.mixture(&State { rho: 2.0, ..state(1.0, 0.0, Shown::All) });
        let own = &mixture.weights[0][0];
        let series: f64 = own.iter().zip(0..).map(|(w, n)| w.x * 0.4_f64.powi(n)).sum();
        let exact = 2.0 / (1.0 - 2.0 * 0.4);
        assert!((mixture.rho * (series + mixture.dominant[0].x) - exact).abs() < 1e-9 * exact);
        assert!(kept.mixture(&State { rho: 3.0, ..state(1.0, 0.0, Shown::All) }).emission == [DVec3::ZERO]);
    }

    #[test]
    fn light_that_grows_geometrically_with_tau_is_interpolated_without_error() {
        let kept = kept(&nodes(5), |tau| [0.4 * (1.2 * tau).exp(), 0.0], 8);
        for tau in [0.05, 0.3, 0.9] {
            let mixture = kept.mixture(&state(1.0, tau, Shown::Term(8)));
            let sum: f64 = (0..5).map(|q| mixture.weights[q][0][7].x * kept.powers[q][0][8].x).sum();
            let exact = (0.4 * (1.2 * tau).exp()).powi(7);
            assert!((sum - exact).abs() < 1e-9 * exact, "{tau}: {sum} {exact}");
        }
    }

    #[test]
    fn bounds_hold_between_taus_and_are_tight() {
        let radius = |tau: f64| 0.5 + 0.3 * tau + 0.2 * tau * tau;
        let mut kept = kept(&nodes(5), |_| [0.5, 0.1], 4);
        let taus = [0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0];
        let bounds = |t: f64| Bounds { lower: 0.999 * radius(t), upper: 1.001 * radius(t) };
        kept.radii = taus.iter().map(|&t| (t, bounds(t))).collect();
        for k in 1..200 {
            let tau = f64::from(k) / 200.0;
            let Bounds { lower, upper } = kept.radius(1.0, tau);
            assert!(lower <= radius(tau) && radius(tau) <= upper, "{tau}: {lower} {upper}");
            // Chords miss what the logarithm bends over two intervals, here 4 %, and widen bounds of 0.2 % threefold.
            assert!(tau < 0.1 || upper - lower < 0.05 * radius(tau), "{tau}: {lower} {upper}");
        }
        assert_eq!(kept.radius(0.5, 0.4).lower, 0.5 * bounds(0.4).lower);
    }

    #[test]
    fn where_the_series_diverges_the_last_term_stands_for_it() {
        let kept = kept(&nodes(5), |tau| [0.7 + 0.6 * tau, 0.1], 6);
        let mixture = kept.mixture(&state(1.0, 1.0, Shown::All));
        assert!(mixture.emission == [DVec3::ZERO]);
        let of_last = mixture.weights[4][0][5].x * kept.powers[4][0][6].x;
        assert!((of_last - kept.powers[4][0][1].x).abs() < 1e-12, "{of_last}");
        assert!(kept.mixture(&state(0.5, 1.0, Shown::All)).emission == [DVec3::ONE]);
        assert!(kept.mixture(&state(1.0, 1.0, Shown::UpTo(3))).emission == [DVec3::ONE]);
    }
}
