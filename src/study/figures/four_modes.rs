//! Figure 1: one scene in the four modes at one exposure, alpha down and tau across.
//!
//! After Figure 1 of D. C. Banks, K. M. Beason, *Retro-rendering with vector-valued light*, SPIE 6060, 2006. A mode
//! whose series diverges has a hatched panel, and the others keep their common exposure. Not handled: the solutions.

use crate::light::Mode;
use crate::plot::{Cell, Heading, Page, PageRow, Shown};
use crate::render::Rendered;
use crate::solve::Diverges;
use crate::study::figures::panel::{Figure, PageSettings, Panel, exposure_for, exposure_words, no_light};

/// One mode's picture, or the proof that there is none.
pub struct SolvedMode {
    /// Which.
    pub mode: Mode,
    /// What became of it.
    pub picture: Result<Rendered, Diverges>,
    /// Whether the picture's errors were estimated.
    pub judged: bool,
}

/// The panels row by row: alpha 1 above alpha 0, tau 0 left of tau 1.
const LAYOUT: [[Mode; 2]; 2] = [[Mode::Global, Mode::Shadowless], [Mode::OneBounce, Mode::Local]];

/// The page of four modes of a scene.
pub fn four_modes(settings: &PageSettings, solved: &[SolvedMode]) -> Figure {
    let pictures = solved.iter().filter_map(|s| s.picture.as_ref().ok());
    let mut exposure = exposure_for(pictures.map(|r| &r.picture));
    exposure.stops += settings.brighter;
    let of = |mode: Mode| solved.iter().find(|s| s.mode == mode);
    let rows = LAYOUT.map(|row| PageRow {
        heading: Heading::default(),
        cells: row.iter().map(|&mode| cell(mode, of(mode))).collect(),
    });
    let worst = solved.iter().filter(|s| s.judged).filter_map(|s| Some(s.picture.as_ref().ok()?.error.total));
    let worst =
        worst.reduce(f64::max).map_or(String::new(), |e| format!(", estimated errors at most {:.1} %", 100.0 * e));
    let page = Page {
        title: "One equation, L = E + K L, in four modes".into(),
        rows: rows.into(),
        caption: format!(
            "Scene {}. α: share of the reflected light that travels on. τ: share of light that passes through \
             surfaces. The visible half of L; one {} for all panels{worst}.",
            settings.scene,
            exposure_words(exposure),
        ),
        panel: settings.size,
        exposure,
    };
    Figure { page, panels: LAYOUT.as_flattened().iter().filter_map(|&mode| Some(panel(of(mode)?))).collect() }
}

fn cell(mode: Mode, solved: Option<&SolvedMode>) -> Cell {
    let t = mode.transport();
    let shown = match solved.map(|s| &s.picture) {
        Some(Ok(found)) => Shown::Picture(found.picture.clone()),
        Some(Err(e)) => no_light(e),
        None => Shown::Blank,
    };
    let meaning = match mode {
        Mode::Global => "shadows and interreflection",
        Mode::Shadowless => "interreflection, no shadows",
        Mode::OneBounce => "shadows, no interreflection",
        Mode::Local => "neither shadows nor interreflection",
    };
    let above = Heading::new(mode.name(), format!("α = {}, τ = {}", t.alpha, t.tau));
    Cell { above, shown, gain: 1.0, below: meaning.into() }
}

fn panel(solved: &SolvedMode) -> Panel {
    let (verdict, radius) = match &solved.picture {
        Ok(found) => (found.verdict, found.radius),
        Err(e) => (e.verdict, e.radius),
    };
    let judged = solved.picture.as_ref().ok().filter(|_| solved.judged);
    let label = solved.mode.name().to_owned();
    let error = judged.map(|found| found.error.total);
    Panel { label, transport: solved.mode.transport(), verdict, radius, error, gain: 1.0 }
}
