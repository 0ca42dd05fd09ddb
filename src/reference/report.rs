//! What the path tracer is told and what it tells besides pictures: settings, counts, means, and that light overflowed.

use crate::reference::path::NextEvent;

/// How paths are traced.
#[derive(Clone, Copy, Debug)]
pub struct TraceSettings {
    /// Whether emitters are looked for on purpose.
    pub next_event: NextEvent,
    /// Reflections after which a path ends in any case; what comes later is missing from the picture.
    pub max_bounces: u32,
    /// Chooses the random numbers.
    pub seed: u32,
}

impl Default for TraceSettings {
    fn default() -> Self {
        TraceSettings { next_event: NextEvent::On, max_bounces: 128, seed: 0 }
    }
}

/// What was done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Paths, one for each sample of each pixel.
    pub paths: u64,
    /// Rays cast: from the camera, from surface to surface, and to emitters.
    pub rays: u64,
    /// Paths that `max_bounces` ended with light still to gather.
    pub cut: u64,
    /// Paths that met the black back of a one-sided face first.
    pub backs: u64,
}

/// A mean over the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Mean {
    /// Radiance per channel, W/(m² sr); `mean` in reports.
    #[serde(rename = "mean")]
    pub value: [f64; 3],
    /// Its standard error per channel; `standard_error` in reports.
    #[serde(rename = "standard_error")]
    pub error: [f64; 3],
}

/// Light grew beyond single precision: a series that diverges, followed too far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error, miette::Diagnostic)]
#[error("the light overflows within {max_bounces} bounces: the series diverges")]
#[diagnostic(
    code(halflight::trace::overflow),
    help("--max-bounces N with a smaller N shows the first bounces; `halflight bounces` shows how they grow")
)]
pub struct Overflow {
    /// Reflections after which paths ended.
    pub max_bounces: u32,
}

impl Counts {
    pub(crate) fn add(&mut self, other: &Counts) {
        self.paths += other.paths;
        self.rays += other.rays;
        self.cut += other.cut;
        self.backs += other.backs;
    }
}
