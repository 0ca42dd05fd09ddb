//! A page to play with: one HTML file in which anyone may walk through a solved scene, take bounces away, slide between
//! the modes, and turn lamps up and down.
//!
//! What the page shows is linear in what is solved here:
//!
//! | slider | is |
//! |---|---|
//! | lamps | exact: light is linear in E |
//! | alpha | exact for every term: `alpha^(n-1) KⁿE`; the terms after the last are two geometric series |
//! | tau | solved at Chebyshev's points, interpolated between them with an error that is measured and stated |
//! | bounce | terms are kept apart |
//!
//! The files in the order of light: `charts` says where on surfaces light is kept, `reached` what of them is seen,
//! `terms` solves `KⁿE` by lamp and tau, `cell_rows` has what small faces receive, `light` brings all of it to
//! the charts, `sums` says what each layer counts. `drawn` draws a picture of it here, the oracle of the page's own
//! test (`states`). `fitted` compares it with a rendered one and has `refining` choose where cells are smaller
//! (`finer`), until both are near or the page is large. `rows` are those of F between coarse patches; `numbers` and
//! `document` write everything down, and `parts` puts it together with the page's own code, plain HTML, CSS, ES modules
//! and shaders in `page/`.
//!
//! Worth: docs/explore.md. Not handled: highlights; errors anywhere but by the file's camera.

mod cell_rows;
mod charts;
mod document;
mod drawn;
mod finer;
mod fitted;
mod light;
mod numbers;
mod parts;
mod reached;
mod refining;
mod rows;
mod states;
mod sums;
mod terms;

use crate::document::Contents;
use crate::fitted::{Fitted, Fitting, first_charts, reference};
use crate::parts::joined;
use crate::reached::Reached;
use crate::rows::CoarseRows;
use crate::states::expected;
use halflight::pictures::{ImageError, Size};
use halflight::render::{Apart, Solver, Unfit, Watch};
use halflight::scene::{Emitters, Scene};

pub use document::Words;
pub use fitted::Limits;
pub use terms::TermsEffort;

/// The picture that each state of the page's test is compared by.
const TEST_SIZE: Size = Size { width: 128, height: 96 };
/// From which difference from a rendered picture on a page warns of itself.
pub const DOUBTFUL: f64 = 0.15;

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    /// The terms do not fit in memory.
    #[error(transparent)]
    Memory(#[from] Unfit),
    /// A texture cannot be written.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// How many there are of what.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Counts {
    /// Patches that were solved.
    pub patches: usize,
    /// Cells of light.
    pub cells: usize,
    /// Texels of direct light.
    pub texels: usize,
    /// Lamps with sliders.
    pub lamps: usize,
}

/// How a page is made.
#[derive(Clone, Copy, Debug)]
pub struct PageEffort {
    /// How finely the terms are solved.
    pub terms: TermsEffort,
    /// How near to a rendered picture it comes, and how large it may get.
    pub limits: Limits,
}

/// A finished page, and what is known of it.
pub struct Page {
    /// The HTML file.
    pub html: String,
    /// How many there are of what.
    pub counts: Counts,
    /// The largest relative RMS error of reflected light at taus between the nodes, at which it was solved too.
    pub tau_error: f64,
    /// RMS difference from a picture of 2 %, over the pixels that see no luminaire; none where there is none.
    pub rms: Option<f64>,
}

/// Solves a scene and makes its page.
///
/// # Errors
/// [`PageError`] where the terms do not fit in memory, or a texture cannot be written.
pub fn page(scene: &Scene, effort: &PageEffort, words: &Words, watch: &dyn Watch) -> Result<Page, PageError> {
    let PageEffort { terms: effort, limits } = effort;
    let apart = Apart { emitters: true, bounces: false };
    let solver = Solver::new(scene).seed(effort.seed).memory(effort.memory).apart(apart);
    let cut = solver.cut(effort.fineness.patches);
    let (geometry, patches) = (&*cut.geometry, &*cut.patches);
    let scene = &geometry.scene;
    let first = || {
        let charts = first_charts(scene, patches);
        let reached = Reached::new(geometry, &charts, patches, effort.seed);
        (charts, reached)
    };
    let rendered = reference(&solver, watch);
    let (charts, reached) = first();
    let mut parts = cut.with_patches(reached.patches(patches));
    let mut solved = terms::solve(&parts, effort, watch)?;
    let fitting = Fitting { cut: &parts, patches, solved: &solved, seed: effort.seed, watch };
    let mut fitted = fitting.attempt((charts, reached), rendered.as_ref());
    if fitted.is_far(limits) {
        let (charts, reached) = first();
        let light = fitted.reflected_once(scene, charts.texels());
        parts = cut.with_patches(reached.divided(patches, &light));
        solved = terms::solve(&parts, effort, watch)?;
        let fitting = Fitting { cut: &parts, patches, solved: &solved, seed: effort.seed, watch };
        fitted = fitting.attempt((charts, reached), rendered.as_ref());
    }
    watch.begin("rows of F", 1);
    let rows = CoarseRows::new(geometry, effort.seed);
    let emitters = &*Emitters::of(scene);
    let lamp_of = |face: u32| solved.lamp_of.get(emitters.of_face(scene, face)).copied().unwrap_or(0);
    let fitting = Fitting { cut: &parts, patches, solved: &solved, seed: effort.seed, watch };
    let html = |fitted: &Fitted| -> Result<String, ImageError> {
        let points = fitting.view(&fitted.charts, TEST_SIZE, 1);
        let contents = Contents {
            words,
            geometry,
            patches,
            parts: &parts.patches,
            charts: &fitted.charts,
            solved: &solved,
            layers: &fitted.layers,
            rows: &rows,
            expected: &expected(&solved, &fitted.layers, &points),
            test_size: TEST_SIZE,
            rms: fitted.rms,
            nearest: points.nearest,
            lamp_of: &lamp_of,
        };
        let (json, numbers) = contents.texts()?;
        Ok(joined(&words.title, &json, &numbers))
    };
    let bytes = |fitted: &Fitted| Ok::<_, PageError>(html(fitted)?.len());
    let fitted = fitting.refined(fitted, rendered.as_ref(), limits, bytes)?;
    Ok(Page {
        html: html(&fitted)?,
        counts: Counts {
            patches: parts.patches.len(),
            cells: fitted.charts.cells.len(),
            texels: fitted.charts.texels(),
            lamps: solved.lamps.len(),
        },
        tau_error: solved.errors.iter().map(|e| e.error).max_by(f64::total_cmp).unwrap_or(0.0),
        rms: fitted.rms,
    })
}
