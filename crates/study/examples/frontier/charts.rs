//! The charts of both sides of the frontier.

use crate::series::SeriesRun;
use crate::spread::Traced;
use halflight::pictures::Size;
use halflight_plot::{Axis, Chart, Series};

/// Points a factor of two that long series keep on a logarithmic axis.
const PER_OCTAVE: f64 = 2.0;

fn chart(title: String, caption: String, labels: [&str; 2], series: Vec<Series>) -> Chart {
    let [x, y] = labels.map(Axis::log);
    Chart { title, caption, x, y, series, size: Size { width: 960, height: 600 } }
}

/// The norm of what follows term n, as it is and as it is proved to be at most, and beyond the frontier the terms
/// themselves.
pub fn series_chart(title: String, caption: String, runs: &[SeriesRun]) -> Chart {
    let mut lines = Vec::new();
    for (colour, run) in runs.iter().enumerate() {
        let name = format!("{} alpha_c", run.share);
        if run.tails.is_empty() {
            let name = format!("{name}: the terms, which grow");
            let points = thinned(&run.norms[1..]);
            lines.push(Series::measured(name, colour, points));
            continue;
        }
        let tails = thinned(&run.tails[1..]);
        lines.push(Series::measured(format!("{name}: true tail"), colour, tails));
        let bounds = thinned(&run.bounds);
        lines.push(Series::bound(format!("{name}: proved bound"), colour, bounds));
    }
    let labels = ["n", "norm of what follows KⁿE, W/(m² sr)"];
    chart(title, caption, labels, lines)
}

/// `(n, value)` from n = 1, thinned to even steps of log n.
fn thinned(values: &[f64]) -> Vec<(f64, f64)> {
    let mut next = 1.0;
    let mut points = Vec::new();
    for (n, &value) in (1u32..).zip(values) {
        let n = f64::from(n);
        if n >= next {
            points.push((n, value));
            next = (n * 2f64.powf(1.0 / PER_OCTAVE)).max(next);
        }
    }
    points
}

/// Unshot power over shots a patch.
pub fn shooting_chart(title: String, caption: String, runs: &[SeriesRun]) -> Chart {
    let line = |(colour, run): (usize, &SeriesRun)| {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for shot in &run.shots {
            let far = points.last().is_none_or(|p| shot.sweeps >= 1.2 * p.0);
            if far {
                points.push((shot.sweeps, shot.unshot));
            }
        }
        points.extend(run.shots.last().map(|last| (last.sweeps, last.unshot)));
        let name = format!("{} alpha_c: {}", run.share, run.shot.name());
        Series::measured(name, colour, points)
    };
    let labels = ["shots per patch", "unshot power / emitted power"];
    let lines = runs.iter().enumerate().map(line).collect();
    chart(title, caption, labels, lines)
}

/// The path tracer's relative error over its paths, with the predicted power law through the last point of each.
pub fn spread_chart(title: String, caption: String, traced: &[Traced]) -> Chart {
    let mut lines = Vec::new();
    for (colour, one) in traced.iter().enumerate() {
        let exponent = -one.predicted;
        let points: Vec<(f64, f64)> = one.measured.spreads.iter().map(|s| (s.paths as f64, s.spread)).collect();
        // The geometric mean lies on the guide.
        let middle = points.iter().map(|(x, y)| (y * x.powf(exponent)).ln());
        let scale = (middle.sum::<f64>() / points.len() as f64).exp();
        let guide = points.iter().map(|(x, _)| (*x, scale * x.powf(-exponent))).collect();
        lines.push(Series::measured(format!("alpha {:.3}", one.alpha), colour, points));
        let law = format!("predicted: N^−{exponent:.2}");
        lines.push(Series::bound(law, colour, guide));
    }
    let labels = ["paths N", "relative error of the picture's mean"];
    chart(title, caption, labels, lines)
}
