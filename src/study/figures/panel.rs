//! What all figures share: their panels in figures, and a brightness that suits several pictures at once.
//!
//! Not handled: how panels are laid out ([`Page`]).

use crate::light::Transport;
use crate::operator::Bounds;
use crate::pictures::{Exposure, Picture, Size};
use crate::plot::{Cell, Corner, Page, Shown};
use crate::solve::{Diverges, Verdict};

/// A page, and what its panels show, row by row.
pub struct Figure {
    /// What is drawn.
    pub page: Page,
    /// One for each cell of the page that is not blank.
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
#[derive(Clone, Debug)]
pub struct Panel {
    /// A mode's name, or a term or sum of the series.
    pub label: String,
    /// The default (alpha, tau).
    pub transport: Transport,
    /// How the series behaves.
    pub verdict: Verdict,
    /// Proved bounds on the spectral radius.
    pub radius: Bounds,
    /// Estimated relative error of the picture, where it is known.
    pub error: Option<f64>,
    /// Brightness over the page's.
    pub gain: f32,
}

/// The share of the pixels that may be brighter than [`BRIGHT`], and that brightness.
const BRIGHTER: f64 = 0.03;
const BRIGHT: f32 = 0.85;

/// The exposure, in whole quarters of a stop, at which 3 % of all pixels are brighter than 0.85 in their largest
/// channel; 0 where nothing has light.
pub fn exposure_for<'a>(pictures: impl IntoIterator<Item = &'a Picture>) -> Exposure {
    let pixels = pictures.into_iter().flat_map(|p| &p.pixels).map(|p| p.max_element());
    let mut values: Vec<f32> = pixels.filter(|v| v.is_finite()).collect();
    values.sort_by(f32::total_cmp);
    let at = ((1.0 - BRIGHTER) * values.len() as f64) as usize;
    let bright = values.get(at).copied().filter(|&v| v > 0.0);
    Exposure { stops: bright.map_or(0.0, |v| (4.0 * (BRIGHT / v).log2()).round() / 4.0) }
}

/// The exposure in words.
pub(crate) fn exposure_words(exposure: Exposure) -> String {
    format!("exposure of {:+} stops", exposure.stops)
}

/// What stands in a panel without a picture.
pub(crate) fn no_light(e: &Diverges) -> Shown {
    let Bounds { lower, upper } = e.radius;
    Shown::Hatched(match e.verdict {
        Verdict::Diverges => format!("the series diverges: spectral radius {lower:.3} to {upper:.3}"),
        _ => format!("undecided: spectral radius {lower:.3} to {upper:.3}"),
    })
}

impl Figure {
    /// The top left pixel of each of [`Figure::panels`] in the page's PNG.
    pub fn places(&self) -> Vec<Corner> {
        let shown = |cell: &Cell| !matches!(cell.shown, Shown::Blank);
        let cells = self.page.rows.iter().flat_map(|row| &row.cells);
        let places = self.page.places().into_iter().flatten();
        cells.zip(places).filter(|(cell, _)| shown(cell)).map(|(_, place)| place).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Rgb;

    #[test]
    fn exposures_bring_bright_pixels_below_white_whatever_the_lamp() {
        let lamp = Rgb::splat(100.0);
        let picture =
            |light: f32| Picture::from_fn(100, 1, |x, _| if x < 2 { lamp } else { Rgb::new(0.1, light, 0.1) });
        let stops = |light| exposure_for([&picture(light)]).stops;
        // 0.85 / 0.2 is 2.09 stops, 0.85 / 1.7 one less than none.
        assert_eq!([stops(0.2), stops(1.7)], [2.0, -1.0]);
        assert_eq!(exposure_for([&Picture::new(3, 3)]).stops, 0.0);
    }
}
