//! How far chance carries a mean: quantiles of Student's distribution, and Bennett's bound for rare light.
//!
//! A sample of a path tracer lies in 0..=M. Where light is rare most samples are 0 and few are large, the mean is far
//! from normal, and the spread of the samples seen may be 0 though light is there. Two bounds hold for any
//! distribution in 0..=M; in units of M, with V the variance of the sum:
//!
//! ```text
//! P(sum is off by t or more, one way) <= exp(-V h(t/V)),   h(u) = (1 + u) ln(1 + u) - u          Bennett
//! P(sqrt(V) > sqrt(V seen) + sqrt(2 L)) <= exp(-L)                                               Maurer and Pontil
//! ```
//!
//! For V >> L Bennett's t is sqrt(2 L V), that of the normal bound; for V << L it is that of a Poisson number of mean V.
//! A normal number of variance W added to the sum turns V into V + W, since its generating function is smaller still.
//!
//! Sources: G. Bennett, *Probability inequalities for the sum of independent random variables*, J. Amer. Statist. Assoc. 57,
//! 1962; A. Maurer, M. Pontil, *Empirical Bernstein bounds and sample variance penalization*, COLT 2009, theorem 10.

use std::f64::consts::{FRAC_PI_2, TAU};

/// The t with `V h(t/V) = L`: a sum of independent numbers of total variance `variance`, none above its mean by more
/// than 1, exceeds its mean by t with probability at most exp(-`L`).
pub(crate) fn bennett(variance: f64, l: f64) -> f64 {
    if variance <= 0.0 {
        return 0.0;
    }
    let wanted = l / variance;
    // Newton from above on a convex function comes down to its root.
    let mut u = (2.0 * wanted).sqrt() + wanted;
    for _ in 0..60 {
        let h = (1.0 + u) * u.ln_1p() - u;
        let step = (h - wanted) / u.ln_1p();
        u -= step;
        if step.abs() <= 1e-12 * u {
            break;
        }
    }
    variance * u
}

/// Largest variance of a sum that its seen variance allows, but for a probability exp(-`L`); both in units of M².
pub(crate) fn variance_limit(seen: f64, l: f64) -> f64 {
    (seen.max(0.0).sqrt() + (2.0 * l).sqrt()).powi(2)
}

/// Quantile p in (1/2, 1) of Student's distribution; beyond [`MANY`] degrees of freedom that of the normal one.
pub(crate) fn student_quantile(p: f64, freedom: f64) -> f64 {
    if freedom >= MANY {
        return bisect(40.0, |z| normal_tail(z) > 1.0 - p);
    }
    // t = sqrt(freedom) tan(angle) has the density cos^(freedom - 1).
    let density = |angle: f64| angle.cos().max(0.0).powf(freedom - 1.0);
    let half = simpson(&density, 0.0, FRAC_PI_2);
    let tail = |angle: f64| 0.5 * simpson(&density, angle, FRAC_PI_2) / half;
    freedom.sqrt() * bisect(FRAC_PI_2, |angle| tail(angle) > 1.0 - p).tan()
}

/// Degrees of freedom that count as infinitely many: the quantiles used here differ by less than 0.5 %.
const MANY: f64 = 1000.0;

/// Where a falling condition on 0..=`high` ceases to hold.
fn bisect(high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, high);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

fn simpson(f: &dyn Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    const PARTS: u32 = 400;
    let step = (to - from) / f64::from(PARTS);
    let at = |k: u32| {
        let weight = match k {
            0 | PARTS => 1.0,
            k if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        weight * f(from + f64::from(k) * step)
    };
    (0..=PARTS).map(at).sum::<f64>() * step / 3.0
}

/// Probability that a standard normal number exceeds z >= 0.
fn normal_tail(z: f64) -> f64 {
    let density = (-0.5 * z * z).exp() / TAU.sqrt();
    if z < 3.0 {
        // 1/2 less the density's Taylor series about 0.
        let (mut term, mut sum, mut k) = (z, z, 1.0);
        while term > 1e-17 * sum {
            term *= z * z / (2.0 * k + 1.0);
            sum += term;
            k += 1.0;
        }
        0.5 - density * sum
    } else {
        // Laplace's continued fraction, from the tail forward.
        density / (1..60).rev().fold(z, |f, k| z + f64::from(k) / f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (p, freedom, t) in [
            (0.975, f64::INFINITY, 1.959_963_985),
            (0.999, f64::INFINITY, 3.090_232_306),
            (1.0 - 1e-7, f64::INFINITY, 5.199_337_582),
            (0.975, 3.0, 3.182_446_305),
            (0.9995, 3.0, 12.923_978_64),
            (0.995, 10.0, 3.169_272_667),
            (0.975, 120.0, 1.979_930_405),
        ] {
            assert!((student_quantile(p, freedom) / t - 1.0).abs() < 1e-6, "{p} {freedom}");
        }
    }

    #[test]
    fn bennett_is_the_normal_bound_for_many_and_the_poisson_bound_for_few() {
        // h(u) = u²/2 - u³/6 + …: the deviation is sqrt(2 L V) (1 + u/6 + …) with u = sqrt(2 L / V).
        let (v, l) = (1e8_f64, 10.0);
        let u = (2.0 * l / v).sqrt();
        assert!((bennett(v, l) / (v * u) - 1.0 - u / 6.0).abs() < u * u);
        // A Poisson number of mean 0.1 is 8 or more with probability below exp(-L) where 0.1 + t = 8.
        let u: f64 = 79.0;
        let l = 0.1 * ((1.0 + u) * u.ln_1p() - u);
        assert!((bennett(0.1, l) - 7.9).abs() < 1e-9);
        let poisson = (-0.1f64).exp() * 0.1f64.powi(8) / 40_320.0 * 1.02;
        assert!(poisson < (-l).exp());
        assert_eq!(bennett(0.0, 10.0), 0.0);
    }
}
