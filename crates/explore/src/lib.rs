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
//! test (`states`). `rows` are those of F between coarse patches; `numbers` and `document` write everything
//! down, and `parts` puts it together with the page's own code, plain HTML, CSS, ES modules and shaders in `page/`.
//!
//! Worth: docs/explore.md. Not handled: highlights; patches divided by light.

mod cell_rows;
mod charts;
mod document;
mod drawn;
mod light;
mod numbers;
mod parts;
mod reached;
mod rows;
mod states;
mod sums;
mod terms;

use crate::cell_rows::CellRows;
use crate::charts::Charts;
use crate::document::Contents;
use crate::drawn::View;
use crate::light::Layers;
use crate::parts::joined;
use crate::reached::Reached;
use crate::rows::CoarseRows;
use crate::states::expected;
use crate::sums::{Shown, State};
use crate::terms::Solved;
use halflight::light::{Mode, Transport};
use halflight::patches::Patches;
use halflight::pictures::{ImageError, Size, relative_rms};
use halflight::render::{Apart, Solver, Unfit, Watch};
use halflight::scene::{Emitters, Scene};

pub use document::Words;
pub use terms::TermsEffort;

/// Texels of direct light to a side of a cell at most, and in all.
const FINEST: usize = 4;
const TEXELS: usize = 1_000_000;
/// The picture that each state of the page's test is compared by.
const TEST_SIZE: Size = Size { width: 128, height: 96 };
/// The picture that the page is compared with: pixels, its error, and points of a pixel to a side.
const COMPARED: Size = Size { width: 128, height: 96 };
const COMPARED_WITHIN: f64 = 0.02;
const POINTS: usize = 4;

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
pub fn page(scene: &Scene, effort: &TermsEffort, words: &Words, watch: &dyn Watch) -> Result<Page, PageError> {
    let apart = Apart { emitters: true, bounces: false };
    let solver = Solver::new(scene).seed(effort.seed).memory(effort.memory).apart(apart);
    let cut = solver.cut(effort.fineness.patches);
    let (geometry, patches) = (&*cut.geometry, &*cut.patches);
    let scene = &geometry.scene;
    let charts = charts(scene, patches);
    let reached = Reached::new(geometry, &charts, patches, effort.seed);
    let cut = cut.with_patches(reached.patches(patches));
    let (charts, texels) = charts.kept(scene, &reached.counts);
    let reached = reached.of(&texels);
    let mut solved = terms::solve(&cut, &reached.places, effort, watch)?;
    let taus: Vec<Vec<f32>> = solved.kept.taus.iter().map(|&tau| of_materials(scene, tau)).collect();
    watch.begin("small faces", 1);
    let cell_rows = CellRows::new((&geometry.rays, &cut.patches), &charts, &reached, &taus, effort.seed);
    let layers = Layers::new(&mut solved, &charts, &cell_rows, &reached.counts);
    watch.begin("rows of F", 1);
    let rows = CoarseRows::new(geometry, effort.seed);
    let emitters = &*Emitters::of(scene);
    let lamp_of = |face: u32| solved.lamp_of.get(emitters.of_face(scene, face)).copied().unwrap_or(0);
    let view = |size: Size, step: usize| View::new((scene, &geometry.rays), &charts, &lamp_of, size, step);
    let points = view(TEST_SIZE, 1);
    let expected = expected(&solved, &layers, &points);
    let rms = compared(&solver, (&solved, &layers), &view(COMPARED, POINTS), watch);
    let contents = Contents {
        words,
        geometry,
        patches,
        charts: &charts,
        solved: &solved,
        layers: &layers,
        rows: &rows,
        expected: &expected,
        test_size: TEST_SIZE,
        rms,
        nearest: points.nearest,
        lamp_of: &lamp_of,
    };
    let (json, numbers) = contents.texts()?;
    Ok(Page {
        html: joined(&words.title, &json, &numbers),
        counts: Counts {
            patches: patches.len(),
            cells: charts.cells.len(),
            texels: charts.texels(),
            lamps: solved.lamps.len(),
        },
        tau_error: solved.errors.iter().map(|e| e.error).max_by(f64::total_cmp).unwrap_or(0.0),
        rms,
    })
}

/// tau of every material where those without their own take `tau`.
fn of_materials(scene: &Scene, tau: f64) -> Vec<f32> {
    scene.transports(Transport { alpha: 1.0, tau: tau as f32 }).iter().map(|own| own.tau).collect()
}

/// The charts of patches, with as many texels to a side of a cell as fit.
fn charts(scene: &Scene, patches: &Patches) -> Charts {
    let fits = |charts: &Charts| charts.fine == 1 || charts.texels() <= TEXELS;
    let finest = (2..=FINEST).rev().map(|fine| Charts::new(scene, patches, fine)).find(fits);
    finest.unwrap_or_else(|| Charts::new(scene, patches, 1))
}

/// RMS difference of the page's picture of the mode that converges surely from one of a stated error, over the pixels
/// that see no luminaire.
fn compared(solver: &Solver, (solved, layers): (&Solved, &Layers), view: &View, watch: &dyn Watch) -> Option<f64> {
    let state = State { alpha: 1.0, tau: 0.0, shown: Shown::All, gains: solved.gains(), stops: 0.0 };
    let mixture = solved.kept.mixture(&state);
    let rendered = solver.render(Mode::Global, COMPARED).watch(watch).tolerance(COMPARED_WITHIN).ok()?;
    relative_rms(&view.picture(layers, &mixture), &rendered.picture, Some(&view.mask()), None).ok()
}
