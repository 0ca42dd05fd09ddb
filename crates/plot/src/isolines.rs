//! Contour lines of values on a grid, some of which may be missing: marching squares (W. Lorensen, H. Cline 1987, in
//! two dimensions), joined to lines.
//!
//! A line crosses the side between two neighbours where the value linear between them is the level, and a square of
//! four neighbours as straight pieces; of a saddle the mean of the four says which corners belong together. Squares
//! with a missing corner have no line, so lines end there.
//!
//! Of our own since the crates for it know of no missing values, and draw lines around them. Not handled: smoothing.

use std::collections::HashMap;

use glam::{DVec2, dvec2};

/// Values at columns and rows, row by row; `None` where one is missing.
pub(crate) struct GridValues<'a> {
    pub values: &'a [Option<f64>],
    /// Columns and rows.
    pub size: [usize; 2],
}

/// A side of a square: of the point that it begins at, to the next column (0) or row (1).
type Side = (usize, usize);

impl GridValues<'_> {
    /// The value at a column and row; none where there is no such point.
    pub fn at(&self, column: usize, row: usize) -> Option<f64> {
        self.values.get(row * self.size[0] + column).copied().flatten()
    }

    /// The contour lines of a level, in columns and rows from the first point; closed ones end where they begin.
    pub fn lines(&self, level: f64) -> Vec<Vec<DVec2>> {
        let mut pieces: Vec<[Side; 2]> = Vec::new();
        for row in 0..self.size[1].saturating_sub(1) {
            for column in 0..self.size[0].saturating_sub(1) {
                self.add_pieces(level, column, row, &mut pieces);
            }
        }
        let joined = joined(&pieces);
        joined.into_iter().map(|line| line.into_iter().map(|side| self.crossing(level, side)).collect()).collect()
    }

    /// Adds the pieces of a level in one square.
    fn add_pieces(&self, level: f64, column: usize, row: usize, pieces: &mut Vec<[Side; 2]>) {
        let corner = |(i, j): (usize, usize)| self.at(column + i, row + j).filter(|value| value.is_finite());
        let [Some(a), Some(b), Some(c), Some(d)] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(corner) else { return };
        let first = row * self.size[0] + column;
        // From corner to corner, as the corners are: below, right, above, left.
        let sides: [Side; 4] = [(first, 0), (first + 1, 1), (first + self.size[0], 0), (first, 1)];
        let above = [a, b, c, d].map(|value| value >= level);
        let crossed: Vec<usize> = (0..4).filter(|&k| above[k] != above[(k + 1) % 4]).collect();
        match crossed[..] {
            [p, q] => pieces.push([sides[p], sides[q]]),
            [p, q, r, s] => {
                // Around the corners that the middle does not belong with.
                let apart = above[0] != (0.25 * (a + b + c + d) >= level);
                let pairs = if apart { [[s, p], [q, r]] } else { [[p, q], [r, s]] };
                pieces.extend(pairs.map(|pair| pair.map(|k| sides[k])));
            }
            _ => {}
        }
    }

    /// Where a side is crossed.
    fn crossing(&self, level: f64, (from, axis): Side) -> DVec2 {
        let to = if axis == 0 { from + 1 } else { from + self.size[0] };
        let [a, b] = [from, to].map(|k| self.values[k].unwrap_or(level));
        let share = if a == b { 0.5 } else { ((level - a) / (b - a)).clamp(0.0, 1.0) };
        let start = dvec2((from % self.size[0]) as f64, (from / self.size[0]) as f64);
        start + share * if axis == 0 { DVec2::X } else { DVec2::Y }
    }
}

/// Pieces that share sides, end to end.
fn joined(pieces: &[[Side; 2]]) -> Vec<Vec<Side>> {
    let mut at: HashMap<Side, Vec<usize>> = HashMap::new();
    for (k, piece) in pieces.iter().enumerate() {
        piece.iter().for_each(|side| at.entry(*side).or_default().push(k));
    }
    let mut is_used = vec![false; pieces.len()];
    let mut lines = Vec::new();
    // Open lines first, from their ends; what remains is closed.
    let ends = |k: &usize| pieces[*k].iter().any(|side| at[side].len() == 1);
    for start in (0..pieces.len()).filter(ends).chain(0..pieces.len()) {
        if is_used[start] {
            continue;
        }
        let [a, b] = pieces[start];
        let mut line = if at[&b].len() == 1 { vec![b] } else { vec![a] };
        let mut piece = Some(start);
        while let Some(k) = piece {
            is_used[k] = true;
            let [a, b] = pieces[k];
            let next = if line.last() == Some(&a) { b } else { a };
            line.push(next);
            piece = at[&next].iter().copied().find(|&k| !is_used[k]);
        }
        lines.push(line);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(size: [usize; 2], value: impl Fn(f64, f64) -> Option<f64>) -> Vec<Option<f64>> {
        (0..size[0] * size[1]).map(|k| value((k % size[0]) as f64, (k / size[0]) as f64)).collect()
    }

    #[test]
    fn a_cone_has_circles_and_a_slope_one_straight_line() {
        let size = [21, 21];
        let values = grid(size, |x, y| Some((x - 10.0).hypot(y - 10.0)));
        let lines = GridValues { values: &values, size }.lines(6.0);
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].first(), lines[0].last());
        assert!(lines[0].iter().all(|p| ((*p - dvec2(10.0, 10.0)).length() - 6.0).abs() < 0.05));
        let slope = grid(size, |x, _| Some(x));
        let lines = GridValues { values: &slope, size }.lines(3.25);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].len() == 21 && lines[0].iter().all(|p| (p.x - 3.25).abs() < 1e-12));
    }

    #[test]
    fn lines_end_at_missing_values_and_saddles_do_not_cross() {
        let size = [9, 5];
        let with_hole = grid(size, |x, y| if x == 4.0 { None } else { Some(y) });
        let lines = GridValues { values: &with_hole, size }.lines(1.5);
        assert_eq!(lines.len(), 2);
        let saddle = [Some(1.0), Some(0.0), Some(0.0), Some(1.0)];
        let lines = GridValues { values: &saddle, size: [2, 2] }.lines(0.5);
        assert_eq!(lines.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        assert!(GridValues { values: &[], size: [0, 0] }.lines(1.0).is_empty());
    }
}
