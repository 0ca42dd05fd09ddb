//! Charts, tables and sheets of measured ladders: error over seconds, requested over reached error, where the time
//! went, the pictures with their differences, all points as rows, and a comparison in Markdown.

use std::fmt::{Display, Write as _};

use crate::compare::engine::Measurements;
use crate::compare::ladder::{Ladder, LadderPoint, Method, ORDERS};
use crate::compare::verdict::{Answer, Difference};
use crate::statistics::log_slope;
use halflight::pictures::{Exposure, Size, Table, known};
use halflight_plot::chart::{BLACK, GREY};
use halflight_plot::{
    Axis, Bar, Bars, Cell, Chart, Heading, Page, Series, Shown, difference_cells, difference_scale, term_name,
};

const ERROR: &str = "error, % of the picture's RMS radiance";

fn chart(title: String, caption: String, x: &str, series: Vec<Series>) -> Chart {
    Chart { title, caption, x: Axis::log(x), y: Axis::log(ERROR), series, size: Size { width: 960, height: 640 } }
}

/// Seconds and an error in percent.
fn place(p: &LadderPoint, error: Option<f64>) -> Option<(f64, f64)> {
    Some((p.seconds.total, 100.0 * error?))
}

/// A line of errors over seconds, with its slope in its name.
fn line(name: &str, colour: usize, points: Vec<(f64, f64)>) -> Series {
    let slope = log_slope(&points).map_or(String::new(), |s| format!(", slope {s:.2}").replace('-', "−"));
    Series::measured(format!("{name}{slope}"), colour, points)
}

/// Errors against seconds, a line a method with its slope: of the whole picture, or of the bounces of order n.
pub fn compared_chart(title: String, caption: String, m: &Measurements, n: Option<usize>) -> Chart {
    let error = |p: &LadderPoint| n.map_or(Some(p.reached.error), |n| *p.orders.get(n)?);
    let lines = m.climbs.iter().enumerate().map(|(colour, climb)| {
        let points = climb.points.iter().filter_map(|p| place(p, error(p)));
        line(climb.ladder.name, colour, points.collect())
    });
    chart(title, caption, "time, s", lines.collect())
}

/// Error against seconds: every ladder with its slope, and the Pareto front.
pub fn charted_chart(title: String, caption: String, m: &Measurements) -> Chart {
    let place = |p: &LadderPoint| place(p, Some(p.reached.error));
    let lines = Ladder::CHARTED.iter().enumerate();
    let lines = lines.map(|(colour, l)| line(l.name, colour, m.of(l.method).filter_map(place).collect()));
    let mut series: Vec<Series> = lines.filter(|line| !line.points.is_empty()).collect();
    series.extend(least(m, m.points().map(|p| p.seconds.total)));
    series.push(Series::bound("Pareto front", BLACK, m.front().into_iter().filter_map(place).collect()));
    chart(title, caption, "time, s", series)
}

/// The line below which the reference cannot distinguish an error from none, across these values.
fn least(m: &Measurements, across: impl Iterator<Item = f64> + Clone) -> Option<Series> {
    let least = 100.0 * m.least_distinguished()?;
    let (low, high) = (across.clone().reduce(f64::min)?, across.reduce(f64::max)?);
    Some(Series::bound("least error the reference tells", GREY, vec![(low, least), (high, least)]))
}

/// Reached and estimated error against the requested error, with the line on which they are equal.
pub fn requested_chart(title: String, caption: String, m: &Measurements) -> Chart {
    let points = |value: fn(&LadderPoint) -> Option<f64>| -> Vec<(f64, f64)> {
        let place = |p: &LadderPoint| Some((100.0 * p.requested?, 100.0 * value(p)?));
        m.of(Method::Tolerance).filter_map(place).collect()
    };
    let equal = points(|p| p.requested);
    let across: Vec<f64> = equal.iter().map(|p| p.0).collect();
    let mut series = vec![Series::bound("one to one", BLACK, equal)];
    series.extend(least(m, across.into_iter()));
    series.push(Series::measured("reached", 0, points(|p| Some(p.reached.error))));
    series.push(Series::measured("estimated while running", 1, points(|p| p.estimated)));
    Chart { size: Size { width: 800, height: 560 }, ..chart(title, caption, "error asked for, %", series) }
}

/// Where the time went at each tolerance.
pub fn seconds_bars(title: String, caption: String, m: &Measurements) -> Bars {
    let bar = |p: &LadderPoint| {
        let s = &p.seconds;
        Bar {
            name: format!("{} %", rounded(100.0 * p.requested.unwrap_or_default())),
            whole: format!("{} s", rounded(s.total)),
            parts: vec![s.load, s.patches, s.form_factors, s.solve, s.gather],
        }
    };
    let names = ["reading the scene", "rays and patches", "form factors", "solving", "gather"];
    Bars {
        title,
        caption,
        x: "error asked for".into(),
        y: "share of the time, %".into(),
        parts: names.map(String::from).to_vec(),
        bars: m.of(Method::Tolerance).map(bar).collect(),
        size: Size { width: 800, height: 560 },
    }
}

/// Two figures that count, without trailing zeros.
fn rounded(value: f64) -> String {
    let digits = (1.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// All points of a comparison, a row each.
pub fn compared_table(m: &Measurements) -> Table {
    let orders: Vec<String> = (0..=ORDERS).map(|n| format!("rms_{}", term_name(n))).collect();
    let mut table = Table::new(&format!("method,seconds,rms,{}", orders.join(",")));
    for p in m.points() {
        let orders: Vec<String> = p.orders.iter().map(|order| known(*order)).collect();
        let mut row: Vec<&dyn Display> = vec![&p.ladder.name, &p.seconds.total, &p.reached.error];
        row.extend(orders.iter().map(|order| order as &dyn Display));
        table.row(&row);
    }
    table
}

/// Every pair's verdicts: a row for the whole picture (order "all") and one for each order.
pub fn pairs_table(m: &Measurements) -> Table {
    let mut table = Table::new("a,b,order,mean_difference,mean_difference_error,verdict,failing_pixels");
    for pair in &m.pairs {
        let d = pair.whole;
        table.row(&[&pair.a, &pair.b, &"all", &d.relative, &d.error, &d.verdict(), &pair.failing_pixels]);
        for order in &pair.orders {
            let d = order.means;
            table.row(&[&pair.a, &pair.b, &order.n, &d.relative, &d.error, &d.verdict(), &""]);
        }
    }
    table
}

/// All points of a chart, a row each; what is not known is left empty.
pub fn charted_table(m: &Measurements) -> Table {
    let mut table = Table::new(
        "method,effort,asked,estimated,reached,reached_low,reached_high,load,patches,form_factors,solve,gather,seconds,on_front",
    );
    for p in m.points() {
        let (s, r) = (&p.seconds, &p.reached);
        let (requested, estimated) = (known(p.requested), known(p.estimated));
        let errors: [&dyn Display; 7] = [&p.ladder.name, &p.effort, &requested, &estimated, &r.error, &r.low, &r.high];
        let seconds: [&dyn Display; 7] =
            [&s.load, &s.patches, &s.form_factors, &s.solve, &s.gather, &s.total, &p.on_front];
        table.row(&[errors, seconds].concat());
    }
    table
}

/// The best pictures in a row, and under each its signed difference from path tracing with next-event estimation.
pub fn compared_sheet(heading: String, m: &Measurements, exposure: Exposure) -> Page {
    let cell = |a: &Answer| Cell {
        below: a.effort.clone(),
        ..Cell::new(Heading::new(a.name, ""), Shown::image(&a.picture, exposure))
    };
    let mut cells: Vec<Cell> = m.answers.iter().map(cell).collect();
    let judge = m.climbs.iter().position(|climb| climb.ladder.method == Method::NextEvent);
    if let Some(k) = judge {
        let reference = &m.answers[k].picture;
        let scales = m.answers.iter().map(|a| difference_scale(&a.picture, reference));
        // The scale of equal pictures is 1: they do not count.
        let scale = scales.filter(|s| *s < 1.0).fold(0.0, f32::max);
        let scale = if scale > 0.0 { scale } else { 1.0 };
        for (_, other) in m.answers.iter().enumerate().filter(|(i, _)| *i != k) {
            let [difference, _] = difference_cells(&other.picture, reference, scale);
            cells.push(Cell { above: Heading::new(format!("{} − next event", other.name), ""), ..difference });
        }
        let [_, legend] = difference_cells(reference, reference, scale);
        cells.push(legend);
    }
    Page::sheet(heading, cells, m.answers.len())
}

/// The comparison as a Markdown document.
pub fn markdown(title: &str, m: &Measurements) -> String {
    let mut text = format!(
        "# {title}\n\n| method | seconds | relative RMS error | slope | effort | reference |\n|---|---|---|---|---|---|\n"
    );
    for climb in &m.climbs {
        for point in &climb.points {
            let _ = writeln!(
                text,
                "| {} | {:.3} | {:.3} % | {} | {} | {} |",
                climb.ladder.name,
                point.seconds.total,
                100.0 * point.reached.error,
                climb.slope.map_or("-".into(), |s| format!("{s:.2}")),
                point.effort,
                climb.reference,
            );
        }
    }
    pair_table(&mut text, m);
    order_table(&mut text, m);
    text
}

/// Each pair's verdict, the difference of the means, and the pixels that fail.
fn pair_table(text: &mut String, m: &Measurements) {
    let _ = writeln!(text, "\n| pair | verdict | mean difference | failing pixels |\n|---|---|---|---|");
    for pair in &m.pairs {
        let (a, b, whole) = (pair.a, pair.b, &pair.whole);
        let (verdict, apart) = (whole.verdict(), percent(whole));
        let _ = writeln!(text, "| {a} / {b} | {verdict} | {apart} | {} of {} |", pair.failing_pixels, pair.pixels);
    }
}

/// The difference of each pair's means, order by order; those that differ are marked.
fn order_table(text: &mut String, m: &Measurements) {
    let names: Vec<String> = (0..=ORDERS).map(term_name).collect();
    let _ = writeln!(text, "\n| pair | {} |\n|---{}|", names.join(" | "), "|---".repeat(names.len()));
    for pair in &m.pairs {
        let cell = |d: &Difference| if d.agree { percent(d) } else { format!("**{} differ**", percent(d)) };
        let cells: Vec<String> = pair.orders.iter().map(|order| cell(&order.means)).collect();
        let _ = writeln!(text, "| {} / {} | {} |", pair.a, pair.b, cells.join(" | "));
    }
}

/// A difference with its 95 % interval.
fn percent(d: &Difference) -> String {
    format!("{:+.3} % ± {:.3} %", 100.0 * d.relative, 100.0 * d.error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::engine::made_up;

    #[test]
    fn numbers_keep_two_figures() {
        let shown = [10.0, 0.2, 0.0123, 123.4, 0.0, 1.96].map(rounded);
        assert_eq!(shown, ["10", "0.2", "0.012", "123", "0", "2"]);
    }

    #[test]
    fn the_figures_show_every_point() {
        let t = made_up(&[(1.0, 0.1), (10.0, 0.01), (100.0, 0.001)]);
        let chart = charted_chart("t".into(), "c".into(), &t);
        let svg = chart.drawing().svg();
        assert!(svg.contains("tolerance, slope −1.00") && svg.contains("Pareto front"));
        // Three points, and one in the legend.
        assert_eq!(svg.matches("A4.5 4.5").count(), 2 * 4);
        let chart = requested_chart("t".into(), "c".into(), &t);
        let of = |n: usize| chart.series[n].points.clone();
        assert_eq!(of(0), [(20.0, 20.0), (2.0, 2.0), (0.2, 0.2)]);
        assert_eq!(of(1).len() + of(2).len(), 6);
        let bars = seconds_bars("t".into(), "c".into(), &t);
        assert_eq!(bars.bars[1].parts, [0.0, 0.0, 0.0, 2.5, 7.5]);
        assert_eq!(bars.bars[2].name, "0.2 %");
    }

    #[test]
    fn every_point_has_its_row() {
        let text = charted_table(&made_up(&[(1.0, 0.1), (2.0, 0.2)])).text();
        assert_eq!(text.lines().count(), 3);
        assert!(text.lines().nth(2).unwrap().ends_with(",2,false"));
    }
}
