//! Charts: series of numbers on linear or logarithmic axes, as SVG and PNG from one drawing.
//!
//! A point whose value an axis cannot show (0 on a logarithmic one, NaN, infinity) is left out; a series can say why in
//! a label at its last point. Colours are those of Okabe and Ito, told apart by colour-blind readers too, and every
//! series of measurements has a marker shape of its own. Not handled: error bars, several panels.
//!
//! Source of the palette: M. Okabe, K. Ito, *Color Universal Design*, 2008.

use crate::pictures::Size;
use crate::plot::axis::{Scale, superscript};
use crate::plot::shapes::{Colour, Marker};

/// A chart.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What is shown, in one line above the plot.
    pub title: String,
    /// Scene and settings, below the plot; wrapped.
    pub caption: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn, the first at the bottom.
    pub series: Vec<Series>,
    /// Width and height in pixels.
    pub size: Size,
}

/// An axis: what it measures, and how.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Linear or logarithmic.
    pub scale: Scale,
}

/// A line of a chart.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// (x, y), in the order in which they are joined.
    pub points: Vec<(f64, f64)>,
    /// How it is drawn.
    pub look: Look,
    /// Which of the palette's colours and marker shapes it has; beyond the last they begin again.
    pub colour: usize,
    /// Words beside its last point, such as why it ends there.
    pub label: Option<String>,
}

/// What a series stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Values: a marker at each point, joined by a line.
    Measured,
    /// A proven bound, or a line to compare with: thin, dashed, without markers.
    Bound,
}

/// Okabe and Ito's palette without yellow, dark ones first; then black, and a grey, for lines to compare with.
pub(crate) const PALETTE: [Colour; 8] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [0, 0, 0],
    [150, 150, 150],
];

/// The numbers of black and grey in the palette.
pub(crate) const BLACK: usize = 6;
pub(crate) const GREY: usize = 7;

const MARKERS: [Marker; 6] =
    [Marker::Disc, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::Wedge, Marker::Cross];

impl Axis {
    /// A logarithmic axis.
    pub fn log(label: impl Into<String>) -> Axis {
        Axis { label: label.into(), scale: Scale::Log }
    }
}

impl Series {
    /// Values: a marker at each point, joined by a line.
    pub fn measured(name: impl Into<String>, colour: usize, points: Vec<(f64, f64)>) -> Series {
        Series { name: name.into(), points, look: Look::Measured, colour, label: None }
    }

    /// The norms of the terms `KⁿE`, n = 0, 1, 2 ..., with a label where they become exactly 0 or leave the numbers.
    ///
    /// Terms after such an end are dropped.
    pub fn bounces(name: impl Into<String>, colour: usize, norms: &[f64]) -> Series {
        let end = norms.iter().position(|v| *v == 0.0 || !v.is_finite());
        let label = end.map(|n| {
            if norms[n] == 0.0 {
                format!("ends: {} = 0", term(n))
            } else {
                format!("diverges: {} is beyond all numbers", term(n))
            }
        });
        let shown = norms[..end.unwrap_or(norms.len())].iter().copied();
        Series { label, ..Series::measured(name, colour, (0..).map(f64::from).zip(shown).collect()) }
    }

    /// A proven bound at the given points, in the colour of the series it bounds.
    pub fn bound(name: impl Into<String>, colour: usize, points: Vec<(f64, f64)>) -> Series {
        Series { look: Look::Bound, ..Series::measured(name, colour, points) }
    }

    /// Its colour on paper.
    pub fn rgb(&self) -> Colour {
        PALETTE[self.colour % PALETTE.len()]
    }

    /// Its marker shape.
    pub fn marker(&self) -> Marker {
        MARKERS[self.colour % MARKERS.len()]
    }
}

/// `E`, `KE`, `K²E` and so on.
pub(crate) fn term(n: usize) -> String {
    match n {
        0 => "E".into(),
        1 => "KE".into(),
        n => format!("K{}E", superscript(n.min(i32::MAX as usize) as i32)),
    }
}

impl Chart {
    /// A chart of bounce series: the norm of `KⁿE` over n, logarithmic, 960 by 600 pixels.
    pub fn of_bounces(title: impl Into<String>, caption: impl Into<String>, series: Vec<Series>) -> Chart {
        Chart {
            title: title.into(),
            caption: caption.into(),
            x: Axis { label: "bounce n".into(), scale: Scale::Linear },
            y: Axis::log("norm of KⁿE, W/(m² sr)"),
            series,
            size: (960, 600).into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn modes() -> Chart {
        let series = vec![
            Series::bounces("global", 0, &[4.0, 0.5, 0.25, 0.125, 0.0625]),
            Series::bounces("one-bounce", 1, &[4.0, 0.4, 0.0, 0.0]),
            Series::bound("proven bound", 0, vec![(2.0, 1.0), (4.0, 0.25)]),
        ];
        Chart::of_bounces("Light & bounces", "Cornell box, 504 patches", series)
    }

    fn markers(svg: &str) -> usize {
        svg.matches("Z\" fill=").count()
    }

    #[test]
    fn svg_holds_the_labels_and_a_marker_for_each_point() {
        let svg = modes().drawing().svg();
        for text in [
            "bounce n",
            "norm of KⁿE, W/(m² sr)",
            "10⁻²",
            "10¹",
            "one-bounce ends: K²E = 0",
            "proven bound",
            "Light &amp; bounces",
            "Cornell box, 504 patches",
            "sans-serif",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        // Five and two points, and one marker each in the legend.
        assert_eq!(markers(&svg), 5 + 2 + 2);
        assert_eq!(svg.matches("<text").count(), svg.matches("</text>").count());
    }

    #[test]
    fn bitmaps_have_the_size_and_colours_of_the_chart() {
        let page = modes().drawing().bitmap().unwrap();
        assert_eq!((page.width, page.height), (960, 600));
        let blue = page.bytes.chunks_exact(3).filter(|p| *p == [0, 114, 178]);
        assert!(blue.count() > 100);
    }

    #[test]
    fn series_end_at_the_first_zero_or_overflow() {
        let dark = Series::bounces("dark", 0, &[0.0, 1.0]);
        assert_eq!(dark.label.as_deref(), Some("ends: E = 0"));
        assert!(dark.points.is_empty());
        let wild = Series::bounces("wild", 0, &[1.0, 1e300, f64::INFINITY, f64::NAN]);
        assert_eq!(wild.points, [(0.0, 1.0), (1.0, 1e300)]);
        assert!(wild.label.unwrap().contains("K²E"));
        let whole = Series::bounces("whole", 0, &[1.0, 0.5]);
        assert_eq!((whole.points.len(), whole.label), (2, None));
    }

    #[test]
    fn odd_series_are_drawn_without_trouble() {
        let huge: Vec<f64> = (0..40).map(|n| 10_f64.powi(9 * n)).collect();
        let series = vec![
            Series::bounces("dark", 0, &[0.0]),
            Series::bounces("also dark", 1, &[0.0]),
            Series::bounces("one", 2, &[1.0]),
            Series::bounces("huge", 3, &huge),
            Series::bounces("nothing", 9, &[]),
        ];
        let svg = Chart::of_bounces("", "", series).drawing().svg();
        let finite = huge.iter().filter(|v| v.is_finite()).count();
        assert_eq!(markers(&svg), finite + 1 + 5);
        assert_eq!(markers(&Chart::of_bounces("", "", vec![]).drawing().svg()), 0);
        let gap = Series::bounces("gap", 0, &[1.0]);
        let points = vec![(0.0, 1.0), (1.0, -1.0), (2.0, f64::NAN), (3.0, 1.0)];
        let svg = Chart::of_bounces("", "", vec![Series { points, ..gap }]).drawing().svg();
        assert_eq!(markers(&svg), 2 + 1);
    }

    #[test]
    fn charts_are_written_by_extension() {
        let directory = tempfile::tempdir().unwrap();
        let path = |name: &str| directory.path().join(name);
        modes().write(path("a.svg")).unwrap();
        modes().write(path("a.png")).unwrap();
        let svg = std::fs::read_to_string(path("a.svg")).unwrap();
        assert_eq!(svg, modes().drawing().svg());
        let png = crate::pictures::read_picture(path("a.png")).unwrap();
        assert_eq!(png.size(), (960, 600).into());
        assert!(modes().write(path("a.pdf")).is_err());
        assert!(!path("a.pdf").exists());
    }
}
