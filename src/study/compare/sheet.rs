//! A comparison for people: the pictures with their differences, and the tables in Markdown.
//!
//! Not handled: charts ([`charts`](crate::study::compare::charts)).

use std::fmt::Write as _;
use std::path::Path;

use crate::pictures::Exposure;
use crate::plot::{ChartError, Sheet, Tile, Titled, difference_scale, difference_tiles};
use crate::study::compare::answer::Answer;
use crate::study::compare::comparison::Comparison;
use crate::study::compare::ladder::{Ladder, Method, ORDERS};
use crate::study::compare::verdict::Difference;
use crate::study::term_name;

/// The best pictures in a row, and under each its signed difference from path tracing with next-event estimation.
///
/// # Errors
/// A destination that cannot be written.
pub fn write_sheet(path: &Path, heading: String, c: &Comparison, exposure: Exposure) -> Result<(), ChartError> {
    let best = || c.methods.iter().map(|m| &m.answer);
    let titled = |a: &Answer| Titled { picture: a.picture.clone(), title: a.name.into(), note: a.effort.clone() };
    let mut pictures: Vec<Titled> = best().map(titled).collect();
    let reference = Ladder::COMPARED.iter().position(|ladder| ladder.method == Method::NextEvent);
    if let Some(k) = reference {
        let reference = &c.methods[k].answer.picture;
        let scales = best().map(|a| difference_scale(&a.picture, reference));
        // Equal pictures ask for scale 1: they do not count.
        let scale = scales.filter(|s| *s < 1.0).fold(0.0, f32::max);
        let scale = if scale > 0.0 { scale } else { 1.0 };
        for (_, other) in best().enumerate().filter(|(i, _)| *i != k) {
            let [Titled { picture, .. }, _] = difference_tiles(&other.picture, reference, scale, exposure);
            let title = format!("{} − next event", other.name);
            pictures.push(Titled { picture, title, note: String::new() });
        }
        let [_, legend] = difference_tiles(reference, reference, scale, exposure);
        pictures.push(legend);
    }
    let tiles = pictures.iter().map(Tile::from).collect();
    Sheet { heading, tiles, columns: c.methods.len(), exposure }.write(path)
}

/// The comparison as a Markdown document.
pub fn markdown(title: &str, c: &Comparison) -> String {
    let mut text = format!(
        "# {title}\n\n| method | seconds | relative RMS error | slope | effort | reference |\n|---|---|---|---|---|---|\n"
    );
    for method in &c.methods {
        for point in &method.points {
            let _ = writeln!(
                text,
                "| {} | {:.3} | {:.3} % | {} | {} | {} |",
                method.name,
                point.seconds.total,
                100.0 * point.reached.error,
                method.slope.map_or("-".into(), |s| format!("{s:.2}")),
                point.effort,
                method.reference,
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
    for pair in &c.pairs {
        let (a, b, whole) = (pair.a, pair.b, &pair.whole);
        let (verdict, apart) = (whole.verdict(), percent(whole));
        let _ = writeln!(text, "| {a} / {b} | {verdict} | {apart} | {} of {} |", pair.failing_pixels, pair.pixels);
    }
}

/// The difference of each pair's means, order by order; those that differ are marked.
fn order_table(text: &mut String, c: &Comparison) {
    let names: Vec<String> = (0..=ORDERS).map(term_name).collect();
    let _ = writeln!(text, "\n| pair | {} |\n|---{}|", names.join(" | "), "|---".repeat(names.len()));
    for pair in &c.pairs {
        let cell = |d: &Difference| if d.agree { percent(d) } else { format!("**{} differ**", percent(d)) };
        let cells: Vec<String> = pair.orders.iter().map(|order| cell(&order.means)).collect();
        let _ = writeln!(text, "| {} / {} | {} |", pair.a, pair.b, cells.join(" | "));
    }
}

/// A difference with its 95 % interval.
fn percent(d: &Difference) -> String {
    format!("{:+.3} % ± {:.3} %", 100.0 * d.relative, 100.0 * d.error)
}
