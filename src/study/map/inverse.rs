//! tau_c(alpha): the frontier read the other way, by the secant rule between two columns of the map.
//!
//! The radius rises with tau, entry by entry of F^tau, so there is one tau_c for each alpha; log radius is convex in
//! log tau (Kingman 1961: the entries are sums of powers of tau), hence smooth enough that two steps suffice.

use crate::operator::Spectrum;

use crate::study::map::survey::Survey;
use crate::study::map::{Column, TauPoint, scaled};

/// Radii looked at for one alpha at most.
const STEPS: usize = 4;

/// Finds tau_c for every alpha of the grid whose frontier lies between two columns.
pub(crate) fn tau_frontier(survey: &Survey, columns: &[Column], spectra: &[Spectrum]) -> Vec<TauPoint> {
    let last = columns.len() - 1;
    let alphas = (1..=last).map(|step| step as f64 / last as f64);
    let found = alphas.filter_map(|alpha| {
        let right = columns.partition_point(|c| alpha * middle(c) < 1.0);
        let inside = 1 <= right && right <= last;
        inside.then(|| solve(survey, alpha, &columns[right - 1..=right], &spectra[right]))
    });
    found.collect()
}

fn middle(c: &Column) -> f64 {
    0.5 * (c.radius.lower + c.radius.upper)
}

/// The tau between two columns at which alpha times the radius is 1.
fn solve(survey: &Survey, alpha: f64, ends: &[Column], near: &Spectrum) -> TauPoint {
    let excess = |radius: f64| (alpha * radius).ln();
    let mut low = (ends[0].tau, excess(middle(&ends[0])));
    let mut high = (ends[1].tau, excess(middle(&ends[1])));
    let mut start = near.x.clone();
    for step in 1.. {
        // A radius of 0 has no logarithm: halve.
        let share = match low.1.is_finite() {
            true => low.1 / (low.1 - high.1),
            false => 0.5,
        };
        let tau = low.0 + (high.0 - low.0) * share;
        let spectrum = survey.spectrum(tau, &start);
        let radius = scaled(spectrum.worst(), alpha);
        if (radius.lower <= 1.0 && radius.upper >= 1.0) || step == STEPS {
            return TauPoint { alpha, tau, radius };
        }
        let here = (tau, (0.5 * (radius.lower + radius.upper)).ln());
        if here.1 < 0.0 {
            low = here;
        } else {
            high = here;
        }
        start = spectrum.x;
    }
    unreachable!("the last step returns")
}
