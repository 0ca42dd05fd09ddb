//! The map: where each chart of each part lies in it, at one number of texels a metre.
//!
//! Parts whose file has charts keep them: the rectangle around all of them is one piece, as large as their area asks
//! for. All pieces are packed with a border of so many texels, at the largest scale at which they fit. A piece begins
//! at the edge of a texel.
//!
//! Not handled: pieces turned by a right angle to pack more tightly; several maps.

use glam::DVec2;
use guillotiere::{AtlasAllocator, size2};

use crate::charts::{Chart, charts, without_chart};
use crate::clip::{doubled_area, overlap};
use crate::error::BakeError;
use crate::parts::Part;

/// Share of the smaller of two triangles that may lie in both: coordinates are rounded.
const ROUNDING: f64 = 1e-3;
/// How far beyond the unit square coordinates may lie, likewise.
const BEYOND: f64 = 1e-4;
/// Factor between scales that are tried.
const FINER: f64 = 1.02;
/// Cells to a side of a grid in which triangles are looked for that overlap.
const CELLS: usize = 64;

/// Where the parts lie in a map.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Texels to a side.
    pub texels: usize,
    /// Texels a unit of the file; of parts with charts of their own in the mean.
    pub scale: f64,
    /// Texels around every piece.
    pub padding: usize,
    /// Charts, or parts that bring their own.
    pub pieces: usize,
    /// Part by part and triangle by triangle where its corners lie, texels from the upper left.
    pub places: Vec<Vec<[DVec2; 3]>>,
}

/// A piece to pack, and whose it is.
struct Piece {
    part: usize,
    chart: Chart,
}

impl Layout {
    /// Lays out parts in a square map.
    ///
    /// # Errors
    /// Charts of a file that overlap or leave the unit square; more pieces than fit.
    pub fn new(parts: &[Part], texels: usize, padding: usize) -> Result<Layout, BakeError> {
        let mut pieces = Vec::new();
        for (part, own) in parts.iter().enumerate() {
            let charts = if own.has_charts() { vec![given(own)?] } else { charts(own) };
            pieces.extend(charts.into_iter().map(|chart| Piece { part, chart }));
        }
        // Higher ones first: what they leave takes the others.
        pieces
            .sort_by(|a, b| b.chart.size.y.total_cmp(&a.chart.size.y).then(b.chart.size.x.total_cmp(&a.chart.size.x)));
        let (scale, corners) = packed(&pieces, texels, padding)?;
        let mut places: Vec<Vec<[DVec2; 3]>> =
            parts.iter().map(|part| vec![[DVec2::ZERO; 3]; part.triangles.len()]).collect();
        for (piece, corner) in pieces.iter().zip(corners) {
            for (k, laid) in &piece.chart.triangles {
                places[piece.part][*k] = laid.map(|at| corner + scale * at);
            }
        }
        for (part, own) in parts.iter().enumerate().filter(|(_, own)| !own.has_charts()) {
            let of_part: Vec<Chart> =
                pieces.iter().filter(|piece| piece.part == part).map(|piece| piece.chart.clone()).collect();
            let somewhere = places[part].iter().find(|place| **place != [DVec2::ZERO; 3]).map(|place| place[0]);
            for k in without_chart(own, &of_part) {
                places[part][k] = [somewhere.unwrap_or_default(); 3];
            }
        }
        Ok(Layout { texels, scale, padding, pieces: pieces.len(), places })
    }

    /// Where the corners of the triangles of a part lie, shares of the map's sides from the upper left.
    pub fn shares(&self, part: usize) -> Vec<[DVec2; 3]> {
        self.places[part].iter().map(|places| places.map(|at| at / self.texels as f64)).collect()
    }

    /// The rectangle around a part: upper left and lower right, texels.
    pub fn rectangle(&self, part: usize) -> [DVec2; 2] {
        let all = || self.places[part].iter().flatten().copied();
        [all().fold(DVec2::INFINITY, DVec2::min), all().fold(DVec2::NEG_INFINITY, DVec2::max)]
    }
}

/// The charts that a part brings, as one piece that is as large as its triangles.
fn given(part: &Part) -> Result<Chart, BakeError> {
    let laid: Vec<[DVec2; 3]> = part.triangles.iter().filter_map(|triangle| triangle.second).collect();
    let is_beyond = |at: &DVec2| at.cmplt(DVec2::splat(-BEYOND)).any() || at.cmpgt(DVec2::splat(1.0 + BEYOND)).any();
    let outside = laid.iter().flatten().find(|at| is_beyond(at) || !at.is_finite());
    if let Some(at) = outside {
        return Err(BakeError::Outside { part: part.name.clone(), u: at.x, v: at.y });
    }
    if let Some([first, second]) = overlapping(&laid) {
        return Err(BakeError::Overlap { part: part.name.clone(), first, second });
    }
    let in_space: f64 = part.triangles.iter().map(|triangle| triangle.area()).sum();
    let in_square: f64 = laid.iter().map(|t| 0.5 * doubled_area(t).abs()).sum();
    if in_square <= 0.0 {
        return Err(BakeError::Flat { part: part.name.clone() });
    }
    let side = (in_space / in_square).sqrt();
    let low = laid.iter().flatten().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = laid.iter().flatten().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    let triangles = laid.iter().enumerate().map(|(k, t)| (k, t.map(|at| side * (at - low)))).collect();
    Ok(Chart { triangles, size: side * (high - low) })
}

/// Two triangles of the unit square that overlap, if any do.
fn overlapping(laid: &[[DVec2; 3]]) -> Option<[usize; 2]> {
    let mut cells: Vec<Vec<usize>> = vec![Vec::new(); CELLS * CELLS];
    let cell = |x: f64| ((x * CELLS as f64) as usize).min(CELLS - 1);
    for (k, t) in laid.iter().enumerate() {
        let (low, high) = (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
        for y in cell(low.y)..=cell(high.y) {
            for own in &mut cells[y * CELLS + cell(low.x)..=y * CELLS + cell(high.x)] {
                if let Some(&other) = own.iter().find(|&&j| overlap(&laid[j], t) > ROUNDING) {
                    return Some([other, k]);
                }
                own.push(k);
            }
        }
    }
    None
}

/// The largest scale at which all pieces fit, and their upper left corners.
fn packed(pieces: &[Piece], texels: usize, padding: usize) -> Result<(f64, Vec<DVec2>), BakeError> {
    let area: f64 = pieces.iter().map(|piece| piece.chart.size.element_product()).sum();
    let longest = pieces.iter().map(|piece| piece.chart.size.max_element()).fold(0.0, f64::max);
    if longest <= 0.0 {
        return Err(BakeError::Nothing);
    }
    let side = texels as f64;
    let mut scale = (side * side / area.max(f64::MIN_POSITIVE)).sqrt().min((side - 2.0 * padding as f64) / longest);
    while scale * longest > 1e-3 {
        if let Some(corners) = fitted(pieces, texels, padding, scale) {
            return Ok((scale, corners));
        }
        scale /= FINER;
    }
    Err(BakeError::Crowded { pieces: pieces.len(), texels, padding })
}

/// The corners of the pieces at a scale; none where they do not fit.
fn fitted(pieces: &[Piece], texels: usize, padding: usize, scale: f64) -> Option<Vec<DVec2>> {
    let mut free = AtlasAllocator::new(size2(texels as i32, texels as i32));
    let place = |piece: &Piece| {
        let length = |x: f64| (scale * x - 1e-6).ceil().max(1.0) as i32 + 2 * padding as i32;
        let found = free.allocate(size2(length(piece.chart.size.x), length(piece.chart.size.y)))?;
        let corner = found.rectangle.min;
        Some(DVec2::new(f64::from(corner.x), f64::from(corner.y)) + padding as f64)
    };
    pieces.iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::Triangle;
    use glam::DVec3;

    /// A square of some size with charts of its own, or without.
    fn square(size: f64, second: Option<[[f64; 2]; 4]>) -> Part {
        let at = [[0.0, 0.0], [size, 0.0], [size, size], [0.0, size]].map(|[x, y]| DVec3::new(x, 0.0, y));
        let of = |k: [usize; 3]| Triangle {
            corners: k.map(|k| at[k]),
            second: second.map(|all| k.map(|k| DVec2::from(all[k]))),
        };
        Part { name: "square".into(), triangles: vec![of([0, 2, 1]), of([0, 3, 2])] }
    }

    const UNIT: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    #[test]
    fn pieces_keep_their_distance_and_their_scale() {
        let parts = [square(2.0, None), square(1.0, Some(UNIT)), square(0.5, None)];
        let layout = Layout::new(&parts, 128, 3).expect("they fit");
        assert_eq!(layout.pieces, 3);
        let rectangles: Vec<[DVec2; 2]> = (0..3).map(|part| layout.rectangle(part)).collect();
        for (k, [low, high]) in rectangles.iter().enumerate() {
            assert!(low.min_element() >= 3.0 && high.max_element() <= 125.0 + 1e-9, "{low} {high}");
            let side = (high - low) / layout.scale;
            assert!((side - [2.0, 1.0, 0.5][k]).abs().max_element() < 1e-9, "{side}");
            let apart = |[a, b]: &[DVec2; 2]| (*a - *high).max(*low - *b).max_element();
            assert!(rectangles[..k].iter().all(|other| apart(other) >= 6.0 - 1e-9));
        }
        assert!(layout.scale > 36.0, "{}", layout.scale);
    }

    #[test]
    fn charts_that_overlap_or_leave_the_square_are_refused_by_name() {
        let folded = square(1.0, Some([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.9, 0.1]]));
        let error = Layout::new(&[folded], 64, 2).expect_err("folded").to_string();
        assert!(error.contains("`square`") && error.contains("0 and 1"), "{error}");
        let outside = square(1.0, Some(UNIT.map(|[u, v]| [2.0 * u, v])));
        let error = Layout::new(&[outside], 64, 2).expect_err("outside").to_string();
        assert!(error.contains("`square`") && error.contains("(2, "), "{error}");
        let many: Vec<Part> = (0..100).map(|_| square(1.0, None)).collect();
        assert!(matches!(Layout::new(&many, 32, 2), Err(BakeError::Crowded { pieces: 100, .. })));
    }
}
