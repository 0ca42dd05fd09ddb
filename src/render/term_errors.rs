//! Errors of the terms' powers: noise of F from independent casts, size of patches from two levels of them.
//!
//! Not handled: what both levels get wrong alike, which walks of light find ([`series`](crate::render::series)).

use crate::render::levels::of_finer;

/// Terms below this share of the first are not looked at.
const NEGLIGIBLE: f64 = 1e-6;

/// Estimated relative errors of one term's power.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct TermError {
    /// Noise of F.
    pub form_factors: f64,
    /// Size of the patches.
    pub patches: f64,
    /// Standard error of the walks of light, where the power is theirs.
    pub walks: f64,
    /// All together.
    pub total: f64,
}

/// Why no more patches and rays were taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Every term is within the tolerance.
    Met,
    /// K of more patches would not fit.
    Memory,
    /// There are as many patches and rays as are ever taken.
    Most,
    /// Two rounds in a row left the error about as large as it was.
    NoBetter,
    /// Another round would not end in time.
    Time,
}

impl End {
    /// What keeps the error above the tolerance; none where nothing does.
    pub fn why(self) -> Option<&'static str> {
        match self {
            End::Met => None,
            End::Memory => Some("more patches would not fit in memory"),
            End::Most => Some("no more patches and rays are taken than these"),
            End::NoBetter => Some("more patches and rays did not make the error smaller"),
            End::Time => Some("a finer round would not end in time"),
        }
    }
}

/// Whether a term's error is asked for: E is exact, and the smallest terms do not matter.
pub(crate) fn looked_at(powers: &[f64], n: usize) -> bool {
    let first = powers.get(1).copied().unwrap_or(0.0);
    n > 0 && powers[n] > NEGLIGIBLE * first && powers[n].is_finite()
}

/// What a term is off by patch size, the terms after it are at least.
pub(crate) fn hand_on(errors: &mut [TermError], powers: &[f64]) {
    let mut least = 0.0;
    let each = errors.iter_mut().enumerate();
    for (_, error) in each.filter(|(n, _)| looked_at(powers, *n)) {
        least = error.patches.max(least);
        error.patches = least;
        error.total = error.form_factors.hypot(error.patches);
    }
}

/// Errors of the first cast's powers.
pub(crate) fn errors(casts: &[Vec<f64>], coarse: &[f64]) -> Vec<TermError> {
    let terms = casts.iter().map(Vec::len).min().unwrap_or(0);
    let one = |n: usize| {
        let own = casts[0][n];
        if !looked_at(&casts[0], n) {
            return TermError::default();
        }
        let count = casts.len() as f64;
        let mean = casts.iter().map(|c| c[n]).sum::<f64>() / count;
        let spread: f64 = casts.iter().map(|c| (c[n] - mean).powi(2)).sum();
        let form_factors = (spread / (count - 1.0)).sqrt() / own;
        let patches = of_finer() * (own - coarse[n]).abs() / own;
        TermError { form_factors, patches, total: form_factors.hypot(patches), ..TermError::default() }
    };
    let mut errors: Vec<TermError> = (0..terms).map(one).collect();
    hand_on(&mut errors, &casts[0]);
    errors
}
