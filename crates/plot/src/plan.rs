//! A false-colour plan: values at the points of a grid as colours and labelled contour lines, with axes in the file's
//! units and a legend.
//!
//! Between points colours are bilinear; where a neighbour is missing, in those that there are. Contours stand at the
//! values that EN 12464-1 grades illuminance by (1, 1.5, 2, 3, 5, 7.5 times a power of ten), or at even steps of 1, 2
//! or 5 where values differ by little. Missing points are left grey.
//!
//! Not handled: rows that are not at right angles to columns.

use glam::{DVec2, dvec2};

use crate::axes::{Range, TICK_EM, round_step};
use crate::drawing::{Align, Colour, Corner, Drawing, FAINT_INK, INK, PAPER};
use crate::isolines::GridValues;
use crate::viridis::viridis;
use crate::{Scale, font};
use halflight::pictures::Bitmap;

/// The longer side of the plan, and the shorter one at least, pixels.
const LONG: f64 = 640.0;
const SHORT: f64 = 120.0;
const LEFT: f64 = 84.0;
const TOP: f64 = 56.0;
/// Gap to the legend, its bar's width, and room for its numbers.
const LEGEND: [f64; 3] = [24.0, 18.0, 92.0];
const TITLE_EM: f64 = 17.0;
const CAPTION_EM: f64 = 13.0;
const LABEL_EM: f64 = 12.0;
const MISSING: Colour = [214; 3];
/// What contours stand at, times powers of ten.
const GRADES: [f64; 6] = [1.0, 1.5, 2.0, 3.0, 5.0, 7.5];
/// Contours at least, where values differ at all, and at most.
const LEVELS: [usize; 2] = [4, 12];
/// A line that is shorter has no label, nor one as near to another, pixels.
const LABELLED: f64 = 70.0;
const APART: f64 = 60.0;

/// An axis of the plan.
#[derive(Clone, Debug)]
pub struct PlanAxis {
    /// What it measures.
    pub name: String,
    /// Its coordinate at the first column or row, and the change to the next.
    pub first: f64,
    /// See there.
    pub step: f64,
}

/// Values on a grid, and the words around them.
#[derive(Clone, Debug)]
pub struct Plan {
    /// In one line above.
    pub title: String,
    /// Below; wrapped.
    pub caption: String,
    /// Over the legend.
    pub unit: String,
    /// Across, and up.
    pub axes: [PlanAxis; 2],
    /// Columns and rows.
    pub size: [usize; 2],
    /// Row by row from below; none where a point is missing or left out.
    pub values: Vec<Option<f64>>,
}

/// Where a plan is drawn.
struct Place {
    /// Pixels from a column or row to the next.
    step: f64,
    /// The plot's upper left corner, and its width and height.
    corner: DVec2,
    extent: DVec2,
}

impl Place {
    /// The pixel of a column and row.
    fn of(&self, at: DVec2) -> DVec2 {
        let from_left = self.corner.x + (at.x + 0.5) * self.step;
        dvec2(from_left, self.corner.y + self.extent.y - (at.y + 0.5) * self.step)
    }
}

impl Plan {
    /// The plan, drawn.
    pub fn drawing(&self) -> Drawing {
        let sides = DVec2::from(self.size.map(|count| count.max(1) as f64));
        let step = (LONG / sides.max_element()).max(SHORT / sides.min_element()).min(LONG);
        let place = Place { step, corner: dvec2(LEFT, TOP), extent: (sides * step).round() };
        let width = LEFT + place.extent.x + LEGEND.iter().sum::<f64>();
        let lines = font::wrap(&self.caption, CAPTION_EM, width - LEFT - 16.0);
        let below = TOP + place.extent.y + 68.0;
        let height = below + 1.4 * CAPTION_EM * lines.len() as f64;
        let mut drawing = Drawing::new((width as usize, height as usize), PAPER);
        let title_em = TITLE_EM * ((width - LEFT - 16.0) / font::width(&self.title, TITLE_EM)).min(1.0);
        drawing.text(&self.title, dvec2(LEFT, 32.0), title_em, Align::Left, INK);
        for (k, line) in lines.iter().enumerate() {
            let at = dvec2(LEFT, below + 1.4 * CAPTION_EM * k as f64);
            drawing.text(line, at, CAPTION_EM, Align::Left, FAINT_INK);
        }
        let values = self.grid();
        let range = self.range();
        drawing.image(colours(&values, &place, range), Corner { left: LEFT as usize, top: TOP as usize });
        self.draw_axes(&place, &mut drawing);
        let levels = levels(range);
        draw_lines(&values, &place, (range, &levels), &mut drawing);
        self.draw_legend(&place, (range, &levels), &mut drawing);
        drawing
    }

    fn grid(&self) -> GridValues<'_> {
        GridValues { values: &self.values, size: self.size }
    }

    /// Least and most of all values that there are; 0 and 1 where there are none.
    fn range(&self) -> [f64; 2] {
        let all = self.values.iter().flatten().copied().filter(|value| value.is_finite());
        let range = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        if range[0] <= range[1] { range } else { [0.0, 1.0] }
    }

    fn draw_axes(&self, place: &Place, drawing: &mut Drawing) {
        let (low, high) = (place.corner, place.corner + place.extent);
        let frame = [low, dvec2(low.x, high.y), high, dvec2(high.x, low.y), low];
        drawing.line(&frame, INK, 1.0);
        for (axis, PlanAxis { name, first, step }) in self.axes.iter().enumerate() {
            // From the outer side of the first column or row to that of the last.
            let ends = [-0.5, self.size[axis] as f64 - 0.5].map(|k| first + k * step);
            let most = (place.extent[axis] / 70.0).max(1.0) as usize;
            for tick in Range::of(Scale::Linear, ends).ticks(most) {
                let share = if *step < 0.0 { 1.0 - tick.at } else { tick.at };
                let label = tick.label.unwrap_or_default();
                if axis == 0 {
                    let at = dvec2(low.x + share * place.extent.x, high.y);
                    drawing.line(&[at, at + dvec2(0.0, 5.0)], INK, 1.0);
                    drawing.text(&label, at + dvec2(0.0, 20.0), TICK_EM, Align::Center, INK);
                } else {
                    let at = dvec2(low.x, high.y - share * place.extent.y);
                    drawing.line(&[at - dvec2(5.0, 0.0), at], INK, 1.0);
                    drawing.text(&label, at + dvec2(-9.0, 0.35 * TICK_EM), TICK_EM, Align::Right, INK);
                }
            }
            let (at, align) = match axis {
                0 => (dvec2(low.x + 0.5 * place.extent.x, high.y + 42.0), Align::Center),
                _ => (dvec2(22.0, low.y + 0.5 * place.extent.y), Align::Upwards),
            };
            drawing.text(name, at, TICK_EM, align, INK);
        }
    }

    /// The colours of all values, with those of the contours marked.
    fn draw_legend(&self, place: &Place, (range, levels): ([f64; 2], &[f64]), drawing: &mut Drawing) {
        let left = (place.corner.x + place.extent.x + LEGEND[0]).round();
        let height = place.extent.y as usize;
        let bar = LEGEND[1] as usize;
        let mut bitmap = Bitmap::filled(bar, height, PAPER);
        for (row, pixels) in bitmap.bytes.chunks_exact_mut(3 * bar).enumerate() {
            let colour = viridis(1.0 - (row as f64 + 0.5) / height as f64);
            pixels.chunks_exact_mut(3).for_each(|pixel| pixel.copy_from_slice(&colour));
        }
        drawing.image(bitmap, Corner { left: left as usize, top: TOP as usize });
        drawing.text(&self.unit, dvec2(left, TOP - 8.0), TICK_EM, Align::Left, INK);
        let mut free = f64::INFINITY;
        for level in levels {
            let y = place.corner.y + (1.0 - share(*level, range)) * place.extent.y;
            drawing.line(&[dvec2(left, y), dvec2(left + LEGEND[1] + 4.0, y)], INK, 1.0);
            if y < free {
                let at = dvec2(left + LEGEND[1] + 8.0, y + 0.35 * LABEL_EM);
                drawing.text(&shown(*level), at, LABEL_EM, Align::Left, INK);
                free = y - 1.1 * LABEL_EM;
            }
        }
    }
}

/// Where a value stands between least and most.
fn share(value: f64, [low, high]: [f64; 2]) -> f64 {
    if high > low { (value - low) / (high - low) } else { 0.5 }
}

/// A round value without noughts at its end.
fn shown(level: f64) -> String {
    let digits = (1.0 - level.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{level:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// The values that contours stand at.
fn levels([low, high]: [f64; 2]) -> Vec<f64> {
    if high <= low {
        return Vec::new();
    }
    let is_between = |level: &f64| *level > low && *level < high;
    if high > 0.0 {
        // Of values around and below 0 those down to a hundredth of the most.
        let least = low.max(0.01 * high).log10().floor() as i32;
        let powers = least..=high.log10().floor() as i32;
        let all = powers.flat_map(|power| GRADES.map(|grade| grade * 10_f64.powi(power)));
        let graded: Vec<f64> = all.filter(is_between).collect();
        if (LEVELS[0]..=LEVELS[1]).contains(&graded.len()) {
            return graded;
        }
    }
    let step = round_step((high - low) / 8.0);
    let first = (low / step).ceil();
    let all = (0..LEVELS[1]).map(|k| (first + k as f64) * step);
    all.filter(is_between).collect()
}

/// The colours of a plan's pixels.
fn colours(values: &GridValues, place: &Place, range: [f64; 2]) -> Bitmap {
    let (width, height) = (place.extent.x as usize, place.extent.y as usize);
    let mut bitmap = Bitmap::filled(width, height, MISSING);
    for (k, pixel) in bitmap.bytes.chunks_exact_mut(3).enumerate() {
        let at = dvec2((k % width) as f64 + 0.5, (height - 1 - k / width) as f64 + 0.5) / place.step - 0.5;
        if let Some(value) = between(values, at) {
            pixel.copy_from_slice(&viridis(share(value, range)));
        }
    }
    bitmap
}

/// The value between columns and rows; none where the nearest point has none.
fn between(values: &GridValues, at: DVec2) -> Option<f64> {
    let last = values.size.map(|count| count.saturating_sub(1));
    let inside = |axis: usize| at[axis].clamp(0.0, last[axis] as f64);
    let (x, y) = (inside(0), inside(1));
    values.at(x.round() as usize, y.round() as usize)?;
    let (i, j) = (x as usize, y as usize);
    let (u, v) = (x - i as f64, y - j as f64);
    let corners =
        [(i, j, (1.0 - u) * (1.0 - v)), (i + 1, j, u * (1.0 - v)), (i, j + 1, (1.0 - u) * v), (i + 1, j + 1, u * v)];
    let (mut sum, mut weights) = (0.0, 0.0);
    for (i, j, weight) in corners.into_iter().filter(|corner| corner.2 > 0.0) {
        if let Some(value) = values.at(i.min(last[0]), j.min(last[1])) {
            sum += weight * value;
            weights += weight;
        }
    }
    (weights > 0.0).then(|| sum / weights)
}

/// Contour lines, and their values along them.
fn draw_lines(values: &GridValues, place: &Place, (range, levels): ([f64; 2], &[f64]), drawing: &mut Drawing) {
    let mut labels: Vec<(DVec2, f64)> = Vec::new();
    for &level in levels {
        let colour = on(level, range);
        for line in values.lines(level) {
            let line: Vec<DVec2> = line.into_iter().map(|at| place.of(at)).collect();
            drawing.line(&line, colour, 1.2);
            let length: f64 = line.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
            let is_free = |at: &DVec2| labels.iter().all(|(other, _)| other.distance(*at) > APART);
            let middle = || (0..line.len()).map(|k| line[(line.len() / 2 + k) % line.len()]);
            let fits = |at: &DVec2| {
                let off = *at - place.corner;
                off.cmpgt(DVec2::splat(16.0)).all() && (place.extent - off).cmpgt(DVec2::splat(16.0)).all()
            };
            if length > LABELLED
                && let Some(at) = middle().find(|at| fits(at) && is_free(at))
            {
                labels.push((at, level));
            }
        }
    }
    for (at, level) in labels {
        let text = shown(level);
        let half = dvec2(0.5 * font::width(&text, LABEL_EM) + 2.0, 0.5 * LABEL_EM);
        drawing.rectangle(at - half, at + half, viridis(share(level, range)));
        drawing.text(&text, at + dvec2(0.0, 0.35 * LABEL_EM), LABEL_EM, Align::Center, on(level, range));
    }
}

/// What is read on the colour of a value.
fn on(level: f64, range: [f64; 2]) -> Colour {
    if share(level, range) < 0.6 { PAPER } else { INK }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contours_are_round_and_neither_few_nor_many() {
        assert_eq!(levels([90.0, 520.0]), [100.0, 150.0, 200.0, 300.0, 500.0]);
        assert_eq!(levels([400.0, 450.0]), [410.0, 420.0, 430.0, 440.0]);
        assert_eq!(levels([3.0, 3.0]), [0.0; 0]);
        for range in [[0.0, 1.0], [1e-9, 1e9], [-3.0, -1.0], [-1.0, 1.0], [0.0, 497.9]] {
            let levels = levels(range);
            assert!((3..=LEVELS[1]).contains(&levels.len()), "{range:?} {levels:?}");
        }
        assert_eq!([100.0, 0.75, 1.5, 2000.0, 0.02].map(shown), ["100", "0.75", "1.5", "2000", "0.02"]);
    }

    #[test]
    fn missing_points_are_grey_and_no_grid_is_no_trouble() {
        let axis = || PlanAxis { name: "x".into(), first: 0.0, step: 1.0 };
        let plan = |size: [usize; 2], values: Vec<Option<f64>>| Plan {
            title: "t".into(),
            caption: "c".into(),
            unit: "lx".into(),
            axes: [axis(), axis()],
            size,
            values,
        };
        for plan in [plan([0, 0], Vec::new()), plan([1, 1], vec![None]), plan([3, 1], vec![Some(1.0); 3])] {
            assert!(plan.drawing().bitmap().is_ok());
        }
        let holed = plan([2, 1], vec![Some(5.0), None]);
        let page = holed.drawing().bitmap().expect("a plan");
        let middle = |share: f64| {
            let at = (TOP + 100.0) as usize * page.width + (LEFT + share * LONG) as usize;
            [0, 1, 2].map(|c| page.bytes[3 * at + c])
        };
        assert_eq!([middle(0.25), middle(0.75)], [viridis(0.5), MISSING]);
    }
}
