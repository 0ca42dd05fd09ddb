//! The JSON reports. Field names are kept from version to version; new ones may be added.

use std::path::PathBuf;

use serde::Serialize;

use crate::form_factors::Closure;
use crate::light::Transport;
use crate::operator::Bounds;
use crate::pictures::Size;
use crate::reference::Mean;
use crate::render::{ErrorParts, Rendered, Seconds, TermError};
use crate::scene::Scene;
use crate::solve::Bounce;
use crate::study::map::Growth;

/// `halflight render --json`, one for each mode.
#[derive(Serialize)]
pub struct RenderReport {
    /// The scene's name.
    pub scene: String,
    /// `global`, `shadowless`, `one-bounce`, `local`; null away from the corners.
    pub mode: Option<&'static str>,
    /// Interreflection.
    pub alpha: f64,
    /// Transmission.
    pub tau: f64,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Triangles loaded.
    pub triangles: usize,
    /// Patches cut.
    pub patches: usize,
    /// Rays cast for form factors (shared by the modes of one run) and for this picture.
    pub rays: u64,
    /// Where the time went.
    pub seconds: Seconds,
    /// Estimated relative errors of the picture; null where effort was given instead of a tolerance, and for a path
    /// tracer.
    pub error: Option<ErrorParts>,
    /// Whether the error stated is at most what was asked for; null where none was.
    pub met: Option<bool>,
    /// Why it is not.
    pub why: Option<String>,
    /// Proved bounds; null where none were sought.
    pub spectral_radius: Option<Bounds>,
    /// Row sums of F; null where no ray was needed.
    pub closure: Option<Closure>,
    /// `converges`, `ends` or `diverges`; of a traced picture see [`TraceReport`].
    pub verdict: &'static str,
    /// Files written.
    pub files: Vec<PathBuf>,
}

impl RenderReport {
    /// What is known of a mode before it is solved or traced.
    pub fn new(scene: &Scene, transport: Transport, size: Size) -> RenderReport {
        let (mode, alpha, tau) = mode_of(transport);
        RenderReport {
            scene: scene.name.clone(),
            mode,
            alpha,
            tau,
            width: size.width,
            height: size.height,
            triangles: scene.solid_faces() as usize,
            patches: 0,
            rays: 0,
            seconds: Seconds::default(),
            error: None,
            met: None,
            why: None,
            spectral_radius: None,
            closure: None,
            verdict: "",
            files: Vec::new(),
        }
    }

    /// Adds what a picture cost and how good it is.
    pub fn take(&mut self, within: &Rendered, load: f64) {
        self.patches = within.patches;
        self.rays = within.rays;
        self.seconds = within.seconds;
        self.seconds.load = load;
        self.seconds.sum();
        self.error = Some(within.error);
        self.closure = within.closure;
    }
}

/// `halflight trace --json`, one for each mode: render's fields and these.
///
/// There are no patches, form factors or bounds: those fields are 0 or null; `gather` is the time spent tracing. The
/// verdict is `ends` (alpha is 0 everywhere), `sampled` (every path ended by itself), `truncated` (`--max-bounces`
/// ended some, so later bounces are missing) or `overflows` (no picture).
#[derive(Serialize)]
pub struct TraceReport {
    /// The fields of render.
    #[serde(flatten)]
    pub render: RenderReport,
    /// Paths for each pixel.
    pub samples: u64,
    /// RMS of the pixels' standard errors over RMS of the pixels without their noise, where no luminaire is seen; null
    /// from one sample, and where there is more noise than picture.
    pub standard_error: Option<f64>,
    /// Whether the standard errors mean anything.
    pub variance: Growth,
    /// Whether emitters were looked for at every vertex.
    pub next_event: bool,
    /// Reflections after which a path ends in any case.
    pub max_bounces: u32,
    /// Paths.
    pub paths: u64,
    /// Paths that `max_bounces` ended with light still to gather.
    pub paths_cut: u64,
    /// Mean radiance of the picture by bounce; the last is that of all later bounces together.
    pub bounces: Vec<MeanReport>,
}

/// Mean radiance of one bounce order over the picture, with its standard error.
#[derive(Serialize)]
pub struct MeanReport {
    /// Number of reflections.
    pub n: usize,
    /// Mean radiance per channel and its standard error.
    #[serde(flatten)]
    pub mean: Mean,
}

/// Several modes of one run.
#[derive(Serialize)]
pub struct Modes<T> {
    /// One report a mode.
    pub modes: Vec<T>,
    /// Files written for all modes together.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<PathBuf>,
}

/// `halflight bounces --json`, one for each mode.
#[derive(Serialize)]
pub struct BouncesReport {
    /// The scene's name.
    pub scene: String,
    /// `global`, `shadowless`, `one-bounce`, `local`; null away from the corners.
    pub mode: Option<&'static str>,
    /// Interreflection.
    pub alpha: f64,
    /// Transmission.
    pub tau: f64,
    /// Patches cut.
    pub patches: usize,
    /// Proved bounds.
    pub spectral_radius: Bounds,
    /// `converges`, `ends`, `diverges` or `undecided`.
    pub verdict: &'static str,
    /// Whether every term is within the tolerance; null where effort was given instead.
    pub met: Option<bool>,
    /// What keeps it from that.
    pub why: Option<&'static str>,
    /// The terms.
    pub bounces: Vec<BounceReport>,
}

/// One term.
#[derive(Serialize)]
pub struct BounceReport {
    /// Its figures.
    #[serde(flatten)]
    pub bounce: Bounce,
    /// Estimated relative errors of the power; null where effort was given instead of a tolerance.
    pub error: Option<TermError>,
}

/// A mode's name, alpha and tau; numbers as written by a person (0.1, not 0.10000000149).
pub fn mode_of(t: Transport) -> (Option<&'static str>, f64, f64) {
    (t.mode().map(|m| m.name()), decimal(t.alpha), decimal(t.tau))
}

/// The f64 whose shortest decimal form is that of the f32.
fn decimal(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::from(x))
}
