//! Words beside the last points of a chart's series, placed where they hide nothing.
//!
//! Heights below and above the point are tried in order of distance, to its right and to its left; the first place
//! that is inside the plot and free of lines and other labels is taken, with a thin line back to the point where it is
//! not beside it. Where no place is free, the one beside the point is taken. Not handled: wrapping long labels.

use glam::{DVec2, dvec2};

use crate::plot::font;

/// A placed label.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// What it says.
    pub text: String,
    /// Where its baseline starts.
    pub at: DVec2,
    /// A line from the point it belongs to, where it does not stand beside it.
    pub leader: Option<[DVec2; 2]>,
}

/// A rectangle: left, top, right, bottom.
pub type Area = [f64; 4];

const BESIDE: f64 = 12.0;

/// Places labels one after the other, clear of `lines` and inside `plot`. Each is a text and its point.
pub fn place(labels: &[(String, DVec2)], lines: &[Vec<DVec2>], plot: Area, em: f64) -> Vec<Placed> {
    let mut taken: Vec<Area> = Vec::new();
    let mut placed = Vec::new();
    for (text, point) in labels {
        let wide = font::width(text, em);
        let free = candidates(*point, wide, em).find(|(_, area)| {
            let outside = area[0] < plot[0] || area[1] < plot[1] || area[2] > plot[2];
            !outside
                && area[3] <= plot[3]
                && !taken.iter().any(|other| overlap(*area, *other))
                && !lines.iter().any(|line| crosses(line, *area))
        });
        let (step, area) = free.unwrap_or((0, area_at(dvec2(point.x + BESIDE, point.y), wide, em)));
        taken.push(area);
        placed.push(Placed {
            text: text.clone(),
            at: dvec2(area[0], area[3] - 0.3 * em),
            leader: (step != 0).then(|| [*point, nearer_end(*point, area)]),
        });
    }
    placed
}

/// Places to try and their distance in steps of half a line: right and left of the point, then further away.
///
/// Two heights below come before one above: series mostly fall, and a line back up crosses fewer of the others.
fn candidates(DVec2 { x, y }: DVec2, wide: f64, em: f64) -> impl Iterator<Item = (i32, Area)> {
    let steps = (0..40).flat_map(|k| [2 * k, 2 * k + 1, -k - 1]);
    steps.flat_map(move |step| {
        let height = y + 0.7 * em * f64::from(step);
        [x + BESIDE, x - BESIDE - wide].map(|left| (step, area_at(dvec2(left, height), wide, em)))
    })
}

/// Where a line from `point` meets a label: the middle of its left or right edge, a little outside.
fn nearer_end(point: DVec2, area: Area) -> DVec2 {
    let edge = if point.x < area[0] { area[0] - 3.0 } else { area[2] + 3.0 };
    dvec2(edge, 0.5 * (area[1] + area[3]))
}

/// The area of a line of text that starts at a point and is centred on its height.
fn area_at(DVec2 { x: left, y }: DVec2, wide: f64, em: f64) -> Area {
    [left, y - 0.65 * em, left + wide, y + 0.65 * em]
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

    #[test]
    fn labels_keep_clear_of_lines_and_of_each_other() {
        let line = vec![dvec2(0.0, 100.0), dvec2(400.0, 100.0)];
        let label = ("ends here".to_owned(), dvec2(50.0, 100.0));
        let placed = place(&[label.clone(), label], std::slice::from_ref(&line), PLOT, 14.0);
        let areas: Vec<Area> = placed
            .iter()
            .map(|p| area_at(dvec2(p.at.x, p.at.y - 0.35 * 14.0), font::width(&p.text, 14.0), 14.0))
            .collect();
        assert!(areas.iter().all(|area| !crosses(&line, *area)));
        assert!(!overlap(areas[0], areas[1]));
        assert!(placed.iter().all(|p| p.leader.is_some_and(|[from, _]| from == dvec2(50.0, 100.0))));
    }

    #[test]
    fn free_labels_stand_beside_their_point_and_inside_the_plot() {
        let labels = [("left".to_owned(), dvec2(10.0, 100.0)), ("right".to_owned(), dvec2(395.0, 200.0))];
        let placed = place(&labels, &[], PLOT, 14.0);
        assert_eq!(placed[0].at.x, 22.0);
        assert_eq!(placed[0].leader, None);
        assert!(placed[1].at.x + font::width("right", 14.0) < 395.0);
    }
}
