//! What pages of one scene's pictures have in common: their size, brightness and words, and how they are put together.
//!
//! Not handled: the pictures.

use halflight::operator::Bounds;
use halflight::pictures::{Exposure, Picture, Size};
use halflight::scene::Scene;
use halflight::solve::{Diverges, Verdict};
use halflight_plot::{Page, PageRow, Shown, Style};

/// A scene, and how it is shown.
#[derive(Clone, Copy)]
pub struct PageSettings<'a> {
    /// What is solved.
    pub scene: &'a Scene,
    /// Width and height of every picture.
    pub size: Size,
    /// Stops that pictures are brighter than suits them.
    pub brighter: f32,
    /// Chooses the sample points.
    pub seed: u32,
}

impl PageSettings<'_> {
    /// The page of some rows.
    pub fn page(&self, title: &str, caption: String, rows: Vec<PageRow>) -> Page {
        Page { title: title.into(), rows, caption, panel: self.size, style: Style::Print }
    }
}

/// The share of the pixels that may be brighter than [`BRIGHT`], and that brightness.
const BRIGHTER: f64 = 0.03;
const BRIGHT: f32 = 0.85;

/// What the two numbers are, in a caption.
pub const AXES: &str =
    "alpha: share of the reflected light that travels on. tau: share of light that passes through surfaces.";

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
pub fn exposure_words(exposure: Exposure) -> String {
    format!("exposure of {:+} stops", exposure.stops)
}

/// What stands in a panel without a picture.
pub fn no_light(e: &Diverges) -> Shown {
    let Bounds { lower, upper } = e.radius;
    let what = if e.verdict == Verdict::Diverges { "the series diverges" } else { "undecided" };
    Shown::Absent(format!("{what}: spectral radius {lower:.3} to {upper:.3}"))
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use halflight::light::Rgb;
    use halflight_plot::Cell;

    /// Small pictures of a scene.
    pub fn settings(scene: &Scene) -> PageSettings<'_> {
        PageSettings { scene, size: Size { width: 36, height: 24 }, brighter: 0.0, seed: 0 }
    }

    /// The sum of the codes of a panel that shows light.
    pub fn codes(cell: &Cell) -> u64 {
        let Shown::Image(bitmap) = &cell.shown else { panic!("no light: {cell:?}") };
        bitmap.bytes.iter().map(|&code| u64::from(code)).sum()
    }

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
