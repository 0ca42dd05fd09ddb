//! Figures: pages of pictures with a list of what their panels show, and the first of them, one scene in the four modes
//! at one exposure.
//!
//! After Figure 1 of D. C. Banks, K. M. Beason, *Retro-rendering with vector-valued light*, SPIE 6060, 2006: alpha down
//! and tau across. A mode whose series diverges has a hatched panel, and the others keep their common exposure. Not
//! handled: the solutions.

use serde::Serialize;

use halflight::light::{Mode, Transport};
use halflight::operator::Bounds;
use halflight::pictures::{Exposure, Picture, Size};
use halflight::render::Rendered;
use halflight::solve::{Diverges, Verdict};
use halflight_plot::{Cell, Corner, Heading, Page, PageRow, Shown, Style};

/// A page, and what its panels show.
#[derive(Serialize)]
pub struct Figure {
    /// What is drawn.
    #[serde(skip)]
    pub page: Page,
    /// Exposure of the page in stops: at 0 a radiance of 1 is white.
    pub stops: f32,
    /// One for each cell of the page that is not blank, row by row.
    pub panels: Vec<Panel>,
}

/// What the pages of one scene's pictures have in common.
#[derive(Clone, Copy, Debug)]
pub struct PageSettings<'a> {
    /// The scene's name.
    pub scene: &'a str,
    /// Width and height of every picture.
    pub size: Size,
    /// Stops that pictures are brighter than suits them.
    pub brighter: f32,
}

/// What one panel shows.
#[derive(Clone, Debug, Serialize)]
pub struct Panel {
    /// A mode's name, or a term or sum of the series.
    pub label: String,
    /// The default (alpha, tau).
    #[serde(flatten)]
    pub transport: Transport,
    /// How the series behaves.
    pub verdict: Verdict,
    /// Proved bounds on the spectral radius.
    #[serde(rename = "spectral_radius")]
    pub radius: Bounds,
    /// Estimated relative error of the picture, where it is known.
    pub error: Option<f64>,
    /// Brightness over the page's.
    pub gain: f32,
    /// Its top left pixel in the page's PNG.
    #[serde(flatten)]
    pub place: Corner,
}

/// A row of a figure: its heading, and its cells with what they show, nothing where they are blank.
pub(crate) type FigureRow = (Heading, Vec<(Cell, Option<Panel>)>);

impl Panel {
    /// Of a series that has a sum or none.
    pub(crate) fn new(label: String, transport: Transport, (verdict, radius): (Verdict, Bounds)) -> Panel {
        Panel { label, transport, verdict, radius, error: None, gain: 1.0, place: Corner::default() }
    }
}

impl Figure {
    /// The page of some rows, with the place of each panel.
    pub(crate) fn new(
        settings: &PageSettings,
        title: &str,
        caption: String,
        exposure: Exposure,
        rows: Vec<FigureRow>,
    ) -> Figure {
        let mut panels = Vec::new();
        let row = |(heading, cells): FigureRow| {
            let (cells, own): (Vec<Cell>, Vec<Option<Panel>>) = cells.into_iter().unzip();
            panels.extend(own);
            PageRow { heading, cells }
        };
        let rows = rows.into_iter().map(row).collect();
        let page = Page { title: title.into(), rows, caption, panel: settings.size, style: Style::Print };
        let places = page.places().into_iter().flatten();
        let placed = panels.into_iter().zip(places).filter_map(|(panel, place)| Some(Panel { place, ..panel? }));
        Figure { stops: exposure.stops, panels: placed.collect(), page }
    }
}

/// The share of the pixels that may be brighter than [`BRIGHT`], and that brightness.
const BRIGHTER: f64 = 0.03;
const BRIGHT: f32 = 0.85;

/// What the two numbers are, in a caption.
pub(crate) const AXES: &str =
    "α: share of the reflected light that travels on. τ: share of light that passes through surfaces.";

/// The exposure, in whole quarters of a stop, at which 3 % of all pixels are brighter than 0.85 in their largest
/// channel, 0 where nothing has light; and the settings' stops over it.
pub fn exposure_for<'a>(pictures: impl IntoIterator<Item = &'a Picture>, brighter: f32) -> Exposure {
    let pixels = pictures.into_iter().flat_map(|p| &p.pixels).map(|p| p.max_element());
    let mut values: Vec<f32> = pixels.filter(|v| v.is_finite()).collect();
    values.sort_by(f32::total_cmp);
    let at = ((1.0 - BRIGHTER) * values.len() as f64) as usize;
    let bright = values.get(at).copied().filter(|&v| v > 0.0);
    Exposure { stops: bright.map_or(0.0, |v| (4.0 * (BRIGHT / v).log2()).round() / 4.0) + brighter }
}

/// The exposure in words.
pub(crate) fn exposure_words(exposure: Exposure) -> String {
    format!("exposure of {:+} stops", exposure.stops)
}

/// What stands in a panel without a picture.
pub(crate) fn no_light(e: &Diverges) -> Shown {
    let Bounds { lower, upper } = e.radius;
    let what = if e.verdict == Verdict::Diverges { "the series diverges" } else { "undecided" };
    Shown::Absent(format!("{what}: spectral radius {lower:.3} to {upper:.3}"))
}

/// One mode's picture, or the proof that there is none.
pub struct SolvedMode {
    /// Which.
    pub mode: Mode,
    /// What became of it.
    pub picture: Result<Rendered, Diverges>,
    /// Whether the picture's errors were estimated.
    pub judged: bool,
}

impl SolvedMode {
    /// The picture's estimated error.
    fn error(&self) -> Option<f64> {
        self.picture.as_ref().ok().filter(|_| self.judged).map(|found| found.error.total)
    }
}

/// The panels row by row: alpha 1 above alpha 0, tau 0 left of tau 1.
const LAYOUT: [[Mode; 2]; 2] = [[Mode::Global, Mode::Shadowless], [Mode::OneBounce, Mode::Local]];

/// The page of four modes of a scene.
pub fn four_modes(settings: &PageSettings, solved: &[SolvedMode]) -> Figure {
    let pictures = solved.iter().filter_map(|s| s.picture.as_ref().ok());
    let exposure = exposure_for(pictures.map(|r| &r.picture), settings.brighter);
    let of = |&mode: &Mode| four_modes_cell(mode, solved.iter().find(|s| s.mode == mode), exposure);
    let rows = LAYOUT.map(|row| (Heading::default(), row.iter().map(of).collect()));
    let worst = solved.iter().filter_map(SolvedMode::error).reduce(f64::max);
    let worst = worst.map_or(String::new(), |e| format!(", estimated errors at most {:.1} %", 100.0 * e));
    let words = exposure_words(exposure);
    let caption = format!("Scene {}. {AXES} The visible half of L; one {words} for all panels{worst}.", settings.scene);
    Figure::new(settings, "One equation, L = E + K L, in four modes", caption, exposure, rows.into())
}

fn four_modes_cell(mode: Mode, solved: Option<&SolvedMode>, exposure: Exposure) -> (Cell, Option<Panel>) {
    let t = mode.transport();
    let meaning = match mode {
        Mode::Global => "shadows and interreflection",
        Mode::Shadowless => "interreflection, no shadows",
        Mode::OneBounce => "shadows, no interreflection",
        Mode::Local => "neither shadows nor interreflection",
    };
    let above = Heading::new(mode.name(), format!("α = {}, τ = {}", t.alpha, t.tau));
    let shown = match solved.map(|s| &s.picture) {
        Some(Ok(found)) => Shown::image(&found.picture, exposure),
        Some(Err(e)) => no_light(e),
        None => Shown::Blank,
    };
    let panel = |s: &SolvedMode| {
        let series = s.picture.as_ref().map_or_else(|e| (e.verdict, e.radius), |found| (found.verdict, found.radius));
        Panel { error: s.error(), ..Panel::new(mode.name().into(), t, series) }
    };
    (Cell { above, shown, below: meaning.into() }, solved.map(panel))
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::light::Rgb;

    #[test]
    fn exposures_bring_bright_pixels_below_white_whatever_the_lamp() {
        let lamp = Rgb::splat(100.0);
        let picture =
            |light: f32| Picture::from_fn(100, 1, |x, _| if x < 2 { lamp } else { Rgb::new(0.1, light, 0.1) });
        let stops = |light| exposure_for([&picture(light)], 0.0).stops;
        // 0.85 / 0.2 is 2.09 stops, 0.85 / 1.7 one less than none.
        assert_eq!([stops(0.2), stops(1.7)], [2.0, -1.0]);
        assert_eq!(exposure_for([&Picture::new(3, 3)], 0.0).stops, 0.0);
    }
}
