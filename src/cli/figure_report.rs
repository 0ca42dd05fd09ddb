//! What `halflight figure --json` says of a page: its panels, and where they are in the PNG.
//!
//! Not handled: figure 4, which reports differences ([`figure_four`](crate::cli::figure_four)).

use std::path::PathBuf;

use serde::Serialize;

use crate::cli::report::mode_of;
use crate::operator::Bounds;
use crate::plot::Corner;
use crate::study::figures::{Figure, Panel};

/// One page of a figure.
#[derive(Serialize)]
pub(crate) struct PageReport {
    file: PathBuf,
    /// Brightness of all panels: at 0 a radiance of 1 is white.
    stops: f32,
    panels: Vec<PanelReport>,
}

/// One panel of a page.
#[derive(Serialize)]
pub(crate) struct PanelReport {
    label: String,
    mode: Option<&'static str>,
    alpha: f64,
    tau: f64,
    verdict: &'static str,
    spectral_radius: Bounds,
    /// Estimated relative error; null where effort was given.
    error: Option<f64>,
    /// Brightness over the page's.
    gain: f32,
    /// Where its top left pixel is in the PNG.
    left: usize,
    top: usize,
}

/// What a page shows, written to a file.
pub(crate) fn page_report(figure: &Figure, file: PathBuf) -> PageReport {
    let panel = |(panel, Corner { left, top }): (&Panel, Corner)| {
        let (mode, alpha, tau) = mode_of(panel.transport);
        PanelReport {
            label: panel.label.clone(),
            mode,
            alpha,
            tau,
            verdict: panel.verdict.name(),
            spectral_radius: panel.radius,
            error: panel.error,
            gain: panel.gain,
            left,
            top,
        }
    };
    let panels = figure.panels.iter().zip(figure.places()).map(panel).collect();
    PageReport { file, stops: figure.page.exposure.stops, panels }
}
