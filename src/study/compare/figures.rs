//! A comparison on paper: charts of error over time, tables, and the pictures with their differences.

use std::fmt::{Display, Write as _};

use crate::pictures::{Exposure, Picture, Table, known};
use crate::plot::{Axis, Chart, Look, Scale, Series, Sheet, Tile, difference_scale, difference_tiles};
use crate::study::bounce_figures::term_name;
use crate::study::compare::comparison::{Comparison, Point};
use crate::study::compare::verdict::Difference;
use crate::study::compare::{Method, ORDERS};
use crate::study::statistics::log_slope;

/// Error against seconds, both logarithmic, a line a method with its slope.
pub fn error_chart(title: String, caption: String, c: &Comparison) -> Chart {
    chart(title, caption, c, &|p| Some(p.rms))
}

/// The same for the bounces of order n.
pub fn order_chart(title: String, caption: String, c: &Comparison, n: usize) -> Chart {
    chart(title, caption, c, &|p| p.orders[n])
}

fn chart(title: String, caption: String, c: &Comparison, value: &dyn Fn(&Point) -> Option<f64>) -> Chart {
    let series = c.tracks.iter().enumerate().map(|(colour, track)| {
        let points: Vec<(f64, f64)> = track.points.iter().filter_map(|p| Some((p.seconds, value(p)?))).collect();
        let slope = log_slope(&points).map_or(String::new(), |s| format!(", slope {s:.2}"));
        Series { name: format!("{}{slope}", track.method.name()), points, look: Look::Measured, colour, note: None }
    });
    Chart {
        title,
        caption,
        x: Axis { label: "seconds".into(), scale: Scale::Log },
        y: Axis { label: "relative RMS error".into(), scale: Scale::Log },
        series: series.collect(),
        size: (960, 600),
    }
}

/// The best pictures in a row, and under each its signed difference from path tracing with next-event estimation.
pub fn picture_sheet(heading: String, c: &Comparison, exposure: Exposure) -> FigureSheet {
    let of = |m: Method| c.runs.iter().find(|r| r.method == m).map(|r| &r.best.picture);
    let mut pictures: Vec<(Picture, String, String)> = c
        .runs
        .iter()
        .map(|r| {
            let effort = r.best.effort.clone();
            (r.best.picture.clone(), r.method.name().to_string(), effort)
        })
        .collect();
    if let Some(reference) = of(Method::PathsNextEvent) {
        let scales = c.runs.iter().map(|r| difference_scale(&r.best.picture, reference));
        // Equal pictures ask for scale 1: they do not count.
        let scale = scales.filter(|s| *s < 1.0).fold(0.0, f32::max);
        let scale = if scale > 0.0 { scale } else { 1.0 };
        let mut legend = None;
        for run in &c.runs {
            let [difference, bar] = difference_tiles(&run.best.picture, reference, scale, exposure);
            if run.method == Method::PathsNextEvent {
                legend = Some(bar);
                continue;
            }
            let (picture, ..) = difference;
            let title = format!("{} − next event", run.method.name());
            pictures.push((picture, title, String::new()));
        }
        pictures.extend(legend);
    }
    FigureSheet { heading, pictures, columns: c.runs.len(), exposure }
}

/// A sheet that owns its pictures.
pub struct FigureSheet {
    heading: String,
    pictures: Vec<(Picture, String, String)>,
    columns: usize,
    exposure: Exposure,
}

impl FigureSheet {
    /// The sheet to write.
    pub fn sheet(&self) -> Sheet<'_> {
        Sheet {
            heading: self.heading.clone(),
            tiles: self.pictures.iter().map(Tile::from).collect(),
            columns: self.columns,
            exposure: self.exposure,
        }
    }
}

/// `agree` or `differ`.
pub fn verdict(agree: bool) -> &'static str {
    if agree { "agree" } else { "differ" }
}

/// The comparison as a Markdown document.
pub fn markdown(title: &str, c: &Comparison) -> String {
    let mut text = format!("# {title}\n\n");
    let _ = writeln!(text, "| method | seconds | relative RMS error | slope | effort | reference |");
    let _ = writeln!(text, "|---|---|---|---|---|---|");
    for (track, run) in c.tracks.iter().zip(&c.runs) {
        for (point, estimate) in track.points.iter().zip(&run.ladder) {
            let _ = writeln!(
                text,
                "| {} | {:.3} | {:.3} % | {} | {} | {} |",
                track.method.name(),
                point.seconds,
                100.0 * point.rms,
                track.slope.map_or("-".into(), |s| format!("{s:.2}")),
                estimate.effort,
                track.reference,
            );
        }
    }
    pair_table(&mut text, c);
    order_table(&mut text, c);
    text
}

/// Each pair's verdict, the difference of the means, and the pixels that fail.
fn pair_table(text: &mut String, c: &Comparison) {
    let _ = writeln!(text, "\n| pair | verdict | mean difference | failing pixels |\n|---|---|---|---|");
    for (a, b, pair) in &c.pairs {
        let _ = writeln!(
            text,
            "| {} / {} | {} | {} | {} of {} |",
            a.name(),
            b.name(),
            verdict(pair.agree),
            percent(&pair.mean),
            pair.failing_pixels,
            pair.pixels,
        );
    }
}

/// The difference of each pair's means, order by order; those that differ are marked.
fn order_table(text: &mut String, c: &Comparison) {
    let names: Vec<String> = (0..=ORDERS).map(term_name).collect();
    let _ = writeln!(text, "\n| pair | {} |\n|---{}|", names.join(" | "), "|---".repeat(names.len()));
    for (a, b, pair) in &c.pairs {
        let cell = |d: &Difference| match d.agree {
            true => percent(d),
            false => format!("**{} differ**", percent(d)),
        };
        let cells: Vec<String> = pair.orders.iter().map(cell).collect();
        let _ = writeln!(text, "| {} / {} | {} |", a.name(), b.name(), cells.join(" | "));
    }
}

/// A difference with its 95 % interval.
fn percent(d: &Difference) -> String {
    format!("{:+.3} % ± {:.3} %", 100.0 * d.relative, 100.0 * d.error)
}

/// Every pair's verdicts: a row for the whole picture (order "all") and one for each order.
pub fn pairs_table(c: &Comparison) -> Table {
    let mut table = Table::new("a,b,order,mean_difference,mean_difference_error,verdict,failing_pixels");
    for (a, b, pair) in &c.pairs {
        let [a, b] = [a.name(), b.name()];
        let Difference { relative, error, .. } = &pair.mean;
        table.row(&[&a, &b, &"all", relative, error, &verdict(pair.agree), &pair.failing_pixels]);
        for (n, d) in pair.orders.iter().enumerate() {
            table.row(&[&a, &b, &n, &d.relative, &d.error, &verdict(d.agree), &""]);
        }
    }
    table
}

/// The errors, a row a point.
pub fn points_table(c: &Comparison) -> Table {
    let orders: Vec<String> = (0..=ORDERS).map(|n| format!("rms_{}", term_name(n))).collect();
    let mut table = Table::new(&format!("method,seconds,rms,{}", orders.join(",")));
    for track in &c.tracks {
        for p in &track.points {
            let orders = p.orders.map(known);
            let name = track.method.name();
            let mut row: Vec<&dyn Display> = vec![&name, &p.seconds, &p.rms];
            row.extend(orders.iter().map(|o| o as &dyn Display));
            table.row(&row);
        }
    }
    table
}
