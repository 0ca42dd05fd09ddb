//! Statistics of measurements: slopes of power laws, and how far chance carries a mean.
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
//! For V >> L Bennett's t is sqrt(2 L V), that of the normal bound; for V << L it is that of a Poisson number of mean
//! V. A normal number of variance W added to the sum turns V into V + W, since its generating function is smaller
//! still.
//!
//! Sources: G. Bennett, *Probability inequalities for the sum of independent random variables*, J. Amer. Statist.
//! Assoc. 57, 1962; A. Maurer, M. Pontil, *Empirical Bernstein bounds and sample variance penalization*, COLT 2009,
//! theorem 10. Quantiles are those of `statrs`, of which this is the only place. Not handled: numbers that depend on
//! one another.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Slope of log y over log x by least squares: the exponent of a power law. Points that are not above 0 are left out;
/// `None` for fewer than two others.
pub fn log_slope(points: &[(f64, f64)]) -> Option<f64> {
    let usable = points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0);
    let logs: Vec<(f64, f64)> = usable.map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let spread: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
    let common: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    (logs.len() > 1 && spread > 0.0).then(|| common / spread)
}

/// Degrees of freedom that count as infinitely many: the quantiles used here differ by less than 0.5 %.
const MANY: f64 = 1000.0;

/// Quantile p in (0, 1) of Student's distribution; beyond [`MANY`] degrees of freedom that of the normal one.
pub(crate) fn student_quantile(p: f64, freedom: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, freedom) {
        Ok(student) if freedom < MANY => student.inverse_cdf(p),
        _ => Normal::standard().inverse_cdf(p),
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_a_power_law_is_its_exponent() {
        let points: Vec<(f64, f64)> = (1..6).map(|k| (k as f64, (k as f64).powf(-0.5))).collect();
        assert!((log_slope(&points).unwrap() + 0.5).abs() < 1e-12);
        assert_eq!(log_slope(&points[..1]), None);
    }

    /// Values computed with 30 digits.
    #[test]
    fn quantiles_are_exact() {
        for (p, freedom, t) in [
            (0.975, f64::INFINITY, 1.959_963_984_540_05),
            (0.999, f64::INFINITY, 3.090_232_306_167_81),
            (1.0 - 1e-7, f64::INFINITY, 5.199_337_582_290_66),
            (0.975, 3.0, 3.182_446_305_283_71),
            (0.9995, 3.0, 12.923_978_636_688),
            (0.995, 10.0, 3.169_272_672_616_95),
            (0.975, 120.0, 1.979_930_405_082_44),
        ] {
            assert!((student_quantile(p, freedom) / t - 1.0).abs() < 1e-12, "{p} {freedom}");
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
