//! Speed against accuracy on paper: error over seconds, asked over reached, where the time went, and all numbers as CSV.

use std::fmt::Display;

use crate::pictures::{Table, known};
use crate::plot::bars::Bar;
use crate::plot::chart::{BLACK, GREY};
use crate::plot::{Axis, Bars, Chart, Look, Scale, Series};
use crate::study::tradeoff::{Ladder, Point, Tradeoff};

const SIZE: (u32, u32) = (960, 640);

/// Error against seconds, both logarithmic: every ladder with its slope, and the Pareto front.
pub fn error_chart(title: String, caption: String, t: &Tradeoff) -> Chart {
    let front = t.front();
    let place = |p: &Point| (p.seconds.total, 100.0 * p.reached.error);
    let front = front.iter().map(|&i| place(&t.points[i])).collect();
    let mut series = Vec::new();
    for (colour, ladder) in Ladder::ALL.into_iter().enumerate() {
        let points: Vec<_> = t.of(ladder).map(place).collect();
        if points.is_empty() {
            continue;
        }
        let slope = t.slope(ladder).map_or(String::new(), |s| format!(", slope {s:.2}").replace('-', "−"));
        series.push(Series {
            name: format!("{}{slope}", ladder.name()),
            points,
            look: Look::Measured,
            colour,
            note: None,
        });
    }
    let spread = t.points.iter().map(|p| p.seconds.total);
    series.extend(least(t, spread));
    series.push(Series::bound("Pareto front", BLACK, front));
    Chart {
        title,
        caption,
        x: log_axis("time, s"),
        y: log_axis("reached error, % of the picture's RMS radiance"),
        series,
        size: SIZE,
    }
}

/// The line below which the reference cannot tell an error from none, across these values.
fn least(t: &Tradeoff, across: impl Iterator<Item = f64> + Clone) -> Option<Series> {
    let told = 100.0 * t.least_told()?;
    let (low, high) = (across.clone().reduce(f64::min)?, across.reduce(f64::max)?);
    let points = vec![(low, told), (high, told)];
    Some(Series::bound("least error the reference tells", GREY, points))
}

fn log_axis(label: &str) -> Axis {
    Axis { label: label.into(), scale: Scale::Log }
}

/// Reached and estimated error against the error asked for, with the line on which they are equal.
pub fn asked_chart(title: String, caption: String, t: &Tradeoff) -> Chart {
    let points = |value: fn(&Point) -> Option<f64>| -> Vec<(f64, f64)> {
        let place = |p: &Point| Some((100.0 * p.asked?, 100.0 * value(p)?));
        t.of(Ladder::Tolerance).filter_map(place).collect()
    };
    let measured =
        |name: &str, colour, points| Series { name: name.into(), points, look: Look::Measured, colour, note: None };
    let equal = points(|p| p.asked);
    let across: Vec<f64> = equal.iter().map(|p| p.0).collect();
    let mut series = vec![Series::bound("one to one", BLACK, equal)];
    series.extend(least(t, across.into_iter()));
    series.push(measured("reached", 0, points(|p| Some(p.reached.error))));
    series.push(measured("estimated while running", 1, points(|p| p.estimated)));
    Chart {
        title,
        caption,
        x: log_axis("error asked for, %"),
        y: log_axis("error, % of the picture's RMS radiance"),
        series,
        size: (800, 560),
    }
}

/// Where the time went at each tolerance.
pub fn seconds_bars(title: String, caption: String, t: &Tradeoff) -> Bars {
    let bar = |p: &Point| {
        let s = &p.seconds;
        Bar {
            name: format!("{} %", rounded(100.0 * p.asked.unwrap_or_default())),
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
        bars: t.of(Ladder::Tolerance).map(bar).collect(),
        size: (800, 560),
    }
}

/// Two figures that count, without trailing zeros.
fn rounded(value: f64) -> String {
    let digits = (1.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// All points, a row each; what is not known is left empty.
pub fn points_table(t: &Tradeoff) -> Table {
    let mut table = Table::new(
        "method,effort,asked,estimated,reached,reached_low,reached_high,load,patches,form_factors,solve,gather,seconds,on_front",
    );
    let front = t.front();
    for (i, p) in t.points.iter().enumerate() {
        let (s, r) = (&p.seconds, &p.reached);
        let (name, asked, estimated) = (p.ladder.name(), known(p.asked), known(p.estimated));
        let errors: [&dyn Display; 5] = [&asked, &estimated, &r.error, &r.low, &r.high];
        let seconds: [&dyn Display; 6] = [&s.load, &s.patches, &s.form_factors, &s.solve, &s.gather, &s.total];
        let first: [&dyn Display; 2] = [&name, &p.effort];
        table.row(&[&first, &errors[..], &seconds, &[&front.contains(&i)]].concat());
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::tradeoff::tests::made_up;

    #[test]
    fn numbers_keep_two_figures() {
        let shown = [10.0, 0.2, 0.0123, 123.4, 0.0, 1.96].map(rounded);
        assert_eq!(shown, ["10", "0.2", "0.012", "123", "0", "2"]);
    }

    #[test]
    fn the_figures_show_every_point() {
        let t = made_up(&[(1.0, 0.1), (10.0, 0.01), (100.0, 0.001)]);
        let chart = error_chart("t".into(), "c".into(), &t);
        let svg = chart.svg().unwrap();
        assert!(svg.contains("tolerance, slope −1.00") && svg.contains("Pareto front"));
        // Three points, and one in the legend.
        assert_eq!(svg.matches("<circle").count(), 4);
        let asked = asked_chart("t".into(), "c".into(), &t);
        let of = |n: usize| asked.series[n].points.clone();
        assert_eq!(of(0), [(20.0, 20.0), (2.0, 2.0), (0.2, 0.2)]);
        assert_eq!(of(1).len() + of(2).len(), 6);
        let bars = seconds_bars("t".into(), "c".into(), &t);
        assert_eq!(bars.bars[1].parts, [0.0, 0.0, 0.0, 2.5, 7.5]);
        assert_eq!(bars.bars[2].name, "0.2 %");
    }

    #[test]
    fn every_point_has_its_row() {
        let text = points_table(&made_up(&[(1.0, 0.1), (2.0, 0.2)])).text();
        assert_eq!(text.lines().count(), 3);
        assert!(text.lines().nth(2).unwrap().ends_with(",2,false"));
    }
}
