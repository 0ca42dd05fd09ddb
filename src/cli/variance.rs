//! What a person is told where the path tracer's variance is infinite, before it starts.

use crate::cli::console::Console;
use crate::light::Transport;
use crate::rays::Rays;
use crate::scene::Scene;
use crate::study::map::{Growth, Variance, growth};

/// Looks at the variance of path tracing a mode, and warns where it is infinite or may be.
pub fn check_variance(console: &Console, scene: &Scene, rays: &Rays, transport: Transport, seed: u32) -> Growth {
    let found = growth(scene, rays, transport, seed);
    if let Some(words) = warning(&found) {
        console.warn(format!("{}: {words}", transport.label()));
    }
    found
}

fn warning(g: &Growth) -> Option<String> {
    let (mean, squares) = (g.mean?, g.squares?);
    let range = |low: f64, high: f64| format!("{low:.3} to {high:.3}");
    let radius = range(mean.lower, mean.upper);
    let growth = range(squares.lower, squares.upper);
    if g.diverges() {
        return Some(format!(
            "the series E + KE + K²E + … diverges (spectral radius of K {radius}), so a traced picture is its sum up to \
             --max-bounces and grows with that; `halflight bounces` shows the terms, smaller --alpha or --tau converge"
        ));
    }
    let instead = "`halflight render` solves L = E + K L without it; smaller --alpha or --tau tame it";
    match g.variance {
        Variance::Finite => None,
        Variance::Infinite => {
            let slower = match g.exponent {
                Some(x) => format!("about as N^-{x:.2}, not as N^-1/2"),
                None => "slower than N^-1/2".into(),
            };
            Some(format!(
                "the variance is infinite though the mean is not (spectral radius of K {radius}, of the squared weights \
                 of its paths {growth}), so with N samples the error falls {slower}, and reported standard errors are too small; \
                 {instead}"
            ))
        }
        Variance::Undecided => Some(format!(
            "the variance may be infinite (spectral radius of K {radius}, of the squared weights of its paths at most \
             about {:.3}, and 1 is the limit), so with N samples the error may fall slower than N^-1/2; {instead}",
            squares.upper,
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::Bounds;

    fn found(variance: Variance, mean: f64, squares: f64, exponent: Option<f64>) -> Growth {
        let around = |x: f64| Bounds { lower: x, upper: 1.001 * x };
        Growth { variance, mean: Some(around(mean)), squares: Some(around(squares)), exponent }
    }

    #[test]
    fn each_side_of_each_frontier_has_its_words() {
        assert_eq!(warning(&found(Variance::Finite, 0.5, 0.4, Some(0.5))), None);
        let words = |g| warning(&g).unwrap();
        let between = words(found(Variance::Infinite, 0.9, 1.3, Some(0.341)));
        assert!(between.contains("N^-0.34") && between.contains("render"));
        let near = words(found(Variance::Undecided, 0.8, 0.99, None));
        assert!(near.contains("may be infinite") && near.contains("0.991"));
        let beyond = words(found(Variance::Infinite, 1.2, 2.0, None));
        assert!(beyond.contains("diverges") && beyond.contains("--max-bounces"));
    }
}
