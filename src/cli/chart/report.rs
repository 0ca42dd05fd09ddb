//! The JSON report of `halflight chart`.

use std::path::PathBuf;

use serde::Serialize;

use crate::cli::report::mode_of;
use crate::render::Seconds;
use crate::scene::Scene;
use crate::study::tradeoff::{Ladder, Plan, Point, Tradeoff, Truth};

/// `halflight chart --json`.
#[derive(Serialize)]
pub struct ChartReport {
    /// One report a mode; those that diverge are left out.
    pub modes: Vec<ModeReport>,
}

/// One mode.
#[derive(Serialize)]
pub struct ModeReport {
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
    /// Two: for patch methods, and for path tracing.
    pub references: Vec<ReferenceReport>,
    /// Ladder after ladder, each from coarse to fine.
    pub points: Vec<PointReport>,
    /// Slopes of log error over log seconds.
    pub slopes: Vec<SlopeReport>,
    /// Files written, or read.
    pub files: Vec<PathBuf>,
}

/// What pictures were held against.
#[derive(Serialize)]
pub struct ReferenceReport {
    /// `patch methods` or `path tracing`.
    pub judges: &'static str,
    /// The method, or the user's file.
    pub by: String,
    /// How fine, in words.
    pub effort: String,
    /// Seconds it took when it was made.
    pub seconds: f64,
    /// Its own relative RMS error; null where it is not known.
    pub error: Option<f64>,
    /// Whether it was there already.
    pub kept: bool,
    /// Files written, or read.
    pub files: Vec<PathBuf>,
}

/// One picture.
#[derive(Serialize)]
pub struct PointReport {
    /// What was varied.
    pub method: &'static str,
    /// How fine, in words.
    pub effort: String,
    /// The error asked for; null where effort was given.
    pub asked: Option<f64>,
    /// The error estimated while running; null where none was.
    pub estimated: Option<f64>,
    /// The error against the reference, the reference's noise subtracted.
    pub reached: f64,
    /// Two standard errors below.
    pub reached_low: f64,
    /// Two standard errors above.
    pub reached_high: f64,
    /// Where the time went, reading the scene included.
    pub seconds: Seconds,
    /// Whether no other picture of the chart is both faster and better.
    pub on_front: bool,
}

/// How fast a method's error falls.
#[derive(Serialize)]
pub struct SlopeReport {
    /// What was varied.
    pub method: &'static str,
    /// Over all its points; null for fewer than two.
    pub slope: Option<f64>,
    /// Over the tolerances from 5 % to 0.5 % alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_5_to_half_percent: Option<f64>,
}

/// What is told of one mode.
pub fn report(scene: &Scene, plan: &Plan, t: &Tradeoff, files: Vec<PathBuf>) -> ModeReport {
    let (mode, alpha, tau) = mode_of(plan.transport);
    let front = t.front();
    let judges = ["patch methods", "path tracing"];
    let reference = |(truth, judges): (&Truth, &'static str)| ReferenceReport {
        judges,
        by: truth.made.by.clone(),
        effort: truth.made.effort.clone(),
        seconds: truth.made.seconds,
        error: truth.made.error,
        kept: truth.kept,
        files: truth.files.clone(),
    };
    let point = |(i, p): (usize, &Point)| PointReport {
        method: p.ladder.name(),
        effort: p.effort.clone(),
        asked: p.asked,
        estimated: p.estimated,
        reached: p.reached.error,
        reached_low: p.reached.low,
        reached_high: p.reached.high,
        seconds: p.seconds,
        on_front: front.contains(&i),
    };
    let slope = |ladder: Ladder| SlopeReport {
        method: ladder.name(),
        slope: t.slope(ladder),
        from_5_to_half_percent: match ladder {
            Ladder::Tolerance => t.tolerance_slope(crate::cli::chart::MIDDLE),
            _ => None,
        },
    };
    ModeReport {
        scene: scene.name.clone(),
        mode,
        alpha,
        tau,
        width: plan.size.0,
        height: plan.size.1,
        references: t.truths.iter().zip(judges).map(reference).collect(),
        points: t.points.iter().enumerate().map(point).collect(),
        slopes: plan.ladders.iter().copied().map(slope).collect(),
        files,
    }
}
