//! Charts: series of numbers on linear or logarithmic axes, as SVG and PNG from one drawing.
//!
//! A point whose value an axis cannot show (0 on a logarithmic one, NaN, infinity) is left out; a series can say why in
//! a label at its last point. Colours are those of Okabe and Ito, which colour-blind readers distinguish too, and every
//! series of measurements has a marker shape of its own. Not handled: error bars, several panels, long labels in lines.
//!
//! Source of the palette: M. Okabe, K. Ito, *Color Universal Design*, 2008.

use glam::{DVec2, dvec2};

use crate::axes::{Frame, Range, Scale, TICK_EM, superscript};
use crate::drawing::{Align, Colour, Drawing, FAINT_INK, INK, Marker};
use crate::font;
use halflight::pictures::Size;

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
    /// Words next to its last point, such as why it ends there.
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

const MARKER_SIZE: f64 = 9.0;
/// From a point to its label, pixels.
const LABEL_GAP: f64 = 12.0;

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
                format!("ends: {} = 0", term_name(n))
            } else {
                format!("diverges: {} is beyond all numbers", term_name(n))
            }
        });
        let shown = norms[..end.unwrap_or(norms.len())].iter().copied();
        Series { label, ..Series::measured(name, colour, (0..).map(f64::from).zip(shown).collect()) }
    }

    /// A proven bound at the given points, in the colour of the series it bounds.
    pub fn bound(name: impl Into<String>, colour: usize, points: Vec<(f64, f64)>) -> Series {
        Series { look: Look::Bound, ..Series::measured(name, colour, points) }
    }

    /// A line through some points, and a marker at others, as the series looks.
    fn draw(&self, line: &[DVec2], markers: &[DVec2], drawing: &mut Drawing) {
        let colour = PALETTE[self.colour % PALETTE.len()];
        match self.look {
            Look::Bound => drawing.dashed(line, colour, 1.25, 5.0),
            Look::Measured => {
                drawing.line(line, colour, 2.0);
                let shape = MARKERS[self.colour % MARKERS.len()];
                markers.iter().for_each(|&at| drawing.marker(shape, at, MARKER_SIZE, colour));
            }
        }
    }
}

/// `E`, `KE`, `K²E` and so on.
pub fn term_name(n: usize) -> String {
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

impl Chart {
    /// The chart, drawn: a point that an axis cannot show interrupts its line.
    pub fn drawing(&self) -> Drawing {
        let fits = |&(x, y): &(f64, f64)| self.x.scale.coordinate(x).and(self.y.scale.coordinate(y)).is_some();
        let points = self.series.iter().flat_map(|s| &s.points).copied();
        let (xs, ys): (Vec<f64>, Vec<f64>) = points.filter(fits).unzip();
        let ranges = [Range::of(self.x.scale, xs), Range::of(self.y.scale, ys)];
        let mut frame = Frame::new(self.size, [&self.title, &self.caption], ranges, 52.0);
        frame.x_ticks();
        frame.y_ticks();
        frame.axes([&self.x.label, &self.y.label]);
        for series in &self.series {
            let places: Vec<_> = series.points.iter().map(|&(x, y)| frame.place(x, y)).collect();
            for piece in places.split(Option::is_none) {
                let piece: Vec<_> = piece.iter().flatten().copied().collect();
                series.draw(&piece, &piece, &mut frame.drawing);
            }
        }
        self.draw_labels(&mut frame);
        let mut y = frame.top + 10.0;
        for series in &self.series {
            let left = frame.right + 24.0;
            let line = [dvec2(left, y), dvec2(left + 30.0, y)];
            series.draw(&line, &[dvec2(left + 15.0, y)], &mut frame.drawing);
            y = frame.entry(&series.name, y, 64.0);
        }
        frame.drawing
    }

    /// Words next to the last point of each series that has some, and below the middle where it shows no point at all.
    fn draw_labels(&self, frame: &mut Frame) {
        let places = |s: &Series| -> Vec<_> { s.points.iter().filter_map(|&(x, y)| frame.place(x, y)).collect() };
        let lines: Vec<_> = self.series.iter().map(places).collect();
        let nowhere = dvec2(frame.left, frame.up(0.25));
        let label = |(series, line): (&Series, &Vec<_>)| {
            let text = format!("{} {}", series.name, series.label.as_ref()?);
            Some((text, line.last().copied().unwrap_or(nowhere)))
        };
        let labels: Vec<_> = self.series.iter().zip(&lines).filter_map(label).collect();
        let plot = [frame.left, frame.top, frame.right, frame.bottom];
        for ((text, point), (step, area)) in labels.iter().zip(place(&labels, &lines, plot)) {
            if step != 0 {
                frame.drawing.line(&[*point, nearer_end(*point, area)], FAINT_INK, 0.75);
            }
            frame.drawing.text(text, baseline(area), TICK_EM, Align::Left, INK);
        }
    }
}

/// A rectangle: left, top, right, bottom.
type Area = [f64; 4];

/// Places labels, each a text and its point, one after the other, clear of `lines` and inside `plot`: how many steps
/// each stands from its point, and where.
///
/// Heights below and above the point are tried in order of distance, to its right and to its left; the first place that
/// is inside the plot and free of lines and other labels is taken. Where no place is free, the one next to the point
/// is.
fn place(labels: &[(String, DVec2)], lines: &[Vec<DVec2>], plot: Area) -> Vec<(i32, Area)> {
    let mut placed: Vec<(i32, Area)> = Vec::new();
    for (text, point) in labels {
        let wide = font::width(text, TICK_EM);
        let free = candidates(*point, wide).find(|(_, area)| {
            let inside = area[0] >= plot[0] && area[1] >= plot[1] && area[2] <= plot[2] && area[3] <= plot[3];
            inside
                && !placed.iter().any(|(_, other)| overlap(*area, *other))
                && !lines.iter().any(|line| crosses(line, *area))
        });
        placed.push(free.unwrap_or((0, area_at(dvec2(point.x + LABEL_GAP, point.y), wide))));
    }
    placed
}

/// Places to try and their distance in steps of half a line: right and left of the point, then further away.
///
/// Two heights below come before one above: series mostly fall, and a line back up crosses fewer of the others.
fn candidates(DVec2 { x, y }: DVec2, wide: f64) -> impl Iterator<Item = (i32, Area)> {
    let steps = (0..40).flat_map(|k| [2 * k, 2 * k + 1, -k - 1]);
    steps.flat_map(move |step| {
        let height = y + 0.7 * TICK_EM * f64::from(step);
        [x + LABEL_GAP, x - LABEL_GAP - wide].map(|left| (step, area_at(dvec2(left, height), wide)))
    })
}

/// Where a line from `point` meets a label: the middle of its left or right edge, a little outside.
fn nearer_end(point: DVec2, area: Area) -> DVec2 {
    let edge = if point.x < area[0] { area[0] - 3.0 } else { area[2] + 3.0 };
    dvec2(edge, 0.5 * (area[1] + area[3]))
}

/// The area of a line of text that starts at a point and is centred on its height.
fn area_at(DVec2 { x: left, y }: DVec2, wide: f64) -> Area {
    [left, y - 0.65 * TICK_EM, left + wide, y + 0.65 * TICK_EM]
}

/// Where the baseline of a label starts.
fn baseline(area: Area) -> DVec2 {
    dvec2(area[0], area[3] - 0.3 * TICK_EM)
}

fn overlap(a: Area, b: Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Whether a line comes within a few pixels of an area: looked up every two pixels, which misses corners at most.
fn crosses(line: &[DVec2], [left, top, right, bottom]: Area) -> bool {
    let near = |DVec2 { x, y }: DVec2| {
        let (across, down) = (x - left + 4.0, y - top + 4.0);
        (0.0..=right - left + 8.0).contains(&across) && (0.0..=bottom - top + 8.0).contains(&down)
    };
    let on_segment = |pair: &[DVec2]| {
        let [DVec2 { x: x0, y: y0 }, DVec2 { x: x1, y: y1 }] = [pair[0], pair[1]];
        let count = (0.5 * (x1 - x0).hypot(y1 - y0)).ceil().max(1.0) as i32;
        (0..=count).any(|i| {
            let t = f64::from(i) / f64::from(count);
            near(dvec2(x0 + t * (x1 - x0), y0 + t * (y1 - y0)))
        })
    };
    line.windows(2).any(on_segment)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLOT: Area = [0.0, 0.0, 400.0, 300.0];

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
        modes().drawing().write(&path("a.svg")).unwrap();
        modes().drawing().write(&path("a.png")).unwrap();
        let svg = std::fs::read_to_string(path("a.svg")).unwrap();
        assert_eq!(svg, modes().drawing().svg());
        let png = halflight::pictures::read_picture(path("a.png")).unwrap();
        assert_eq!(png.size(), (960, 600).into());
        assert!(modes().drawing().write(&path("a.pdf")).is_err());
        assert!(!path("a.pdf").exists());
    }

    #[test]
    fn labels_keep_clear_of_lines_and_of_each_other() {
        let line = vec![dvec2(0.0, 100.0), dvec2(400.0, 100.0)];
        let label = ("ends here".to_owned(), dvec2(50.0, 100.0));
        let placed = place(&[label.clone(), label], std::slice::from_ref(&line), PLOT);
        assert!(placed.iter().all(|(step, area)| *step != 0 && !crosses(&line, *area)));
        assert!(!overlap(placed[0].1, placed[1].1));
    }

    #[test]
    fn free_labels_stand_next_to_their_point_and_inside_the_plot() {
        let labels = [("left".to_owned(), dvec2(10.0, 100.0)), ("right".to_owned(), dvec2(395.0, 200.0))];
        let placed = place(&labels, &[], PLOT);
        assert_eq!((placed[0].0, baseline(placed[0].1).x), (0, 22.0));
        assert!(placed[1].1[2] < 395.0);
    }
}
