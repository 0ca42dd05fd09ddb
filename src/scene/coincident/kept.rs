//! The faces of one plane that are there, to be asked for those that overlap another.
//!
//! Boxes lie in grids by their size, each in the cell of its middle of the grid whose cells are as large as it. So a
//! question looks at few cells of each grid, and what was not kept costs nothing: a pile of n faces asks n times for one.
//!
//! Not handled: a face beside very many smaller ones asks all of them.

use std::collections::BTreeMap;

use glam::{DVec2, I64Vec2};
use rustc_hash::FxHashMap;

use crate::scene::coincident::polygons::overlap;

/// Faces up to which each question goes through all: a polygon's own few triangles need no grid.
pub(super) const FEW: usize = 8;

/// Triangles of one plane.
#[derive(Default)]
pub(super) struct Kept {
    tiles: Vec<[DVec2; 3]>,
    /// By the binary logarithm of the size of their cells; empty while the triangles are few.
    grids: BTreeMap<i32, FxHashMap<I64Vec2, Vec<u32>>>,
}

impl Kept {
    /// Adds a triangle, counter-clockwise; they count from 0.
    pub fn add(&mut self, tile: [DVec2; 3]) {
        self.tiles.push(tile);
        match self.tiles.len() {
            n if n <= FEW => (),
            n if n == FEW + 1 => (0..n).for_each(|k| self.enter(k)),
            n => self.enter(n - 1),
        }
    }

    fn enter(&mut self, k: usize) {
        let (low, high) = around(&self.tiles[k]);
        let level = (high - low).max_element().log2().ceil() as i32;
        let key = cell(0.5 * (low + high), level);
        self.grids.entry(level).or_default().entry(key).or_default().push(k as u32);
    }

    /// Those that overlap a triangle by more than rounding, in order.
    pub fn over(&self, tile: &[DVec2; 3]) -> Vec<usize> {
        let overlaps = |&k: &usize| overlap(&self.tiles[k], tile);
        if self.grids.is_empty() {
            return (0..self.tiles.len()).filter(overlaps).collect();
        }
        let (low, high) = around(tile);
        let near = self.grids.iter().flat_map(|(&level, cells)| near(cells, level, low, high));
        let mut found: Vec<usize> = near.map(|k| k as usize).filter(overlaps).collect();
        found.sort_unstable();
        found
    }
}

/// Those of a grid whose boxes may reach into another, in no order.
fn near(cells: &FxHashMap<I64Vec2, Vec<u32>>, level: i32, low: DVec2, high: DVec2) -> Vec<u32> {
    // Boxes reach half a cell beyond that of their middle at most.
    let half = DVec2::splat(0.5 * f64::from(level).exp2());
    let (first, last) = (cell(low - half, level), cell(high + half, level));
    let size = last - first + 1;
    if (size.x as f64) * (size.y as f64) > cells.len() as f64 {
        let within = |key: &I64Vec2| key.cmpge(first).all() && key.cmple(last).all();
        return cells.iter().filter(|(key, _)| within(key)).flat_map(|(_, own)| own).copied().collect();
    }
    let rows = first.y..=last.y;
    let keys = rows.flat_map(|y| (first.x..=last.x).map(move |x| I64Vec2::new(x, y)));
    keys.filter_map(|key| cells.get(&key)).flatten().copied().collect()
}

fn cell(at: DVec2, level: i32) -> I64Vec2 {
    (at * f64::from(-level).exp2()).floor().as_i64vec2()
}

fn around(tile: &[DVec2; 3]) -> (DVec2, DVec2) {
    let [a, b, c] = *tile;
    (a.min(b).min(c), a.max(b).max(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of many sizes scattered by a simple rule.
    fn scattered(k: u32) -> [DVec2; 3] {
        let at = |m: u32| f64::from(k * m % 97) / 97.0;
        let size = 0.5_f64.powi((k % 7) as i32);
        let corner = DVec2::new(at(31), at(53));
        [corner, corner + size * DVec2::new(1.0, 0.1), corner + size * DVec2::new(0.2, 0.9)]
    }

    #[test]
    fn grids_find_what_a_walk_through_all_finds() {
        let mut kept = Kept::default();
        let all: Vec<[DVec2; 3]> = (0..300).map(scattered).collect();
        for (k, tile) in all.iter().enumerate() {
            let expected: Vec<usize> = (0..k).filter(|&j| overlap(&all[j], tile)).collect();
            assert_eq!(kept.over(tile), expected, "{k}");
            kept.add(*tile);
        }
    }
}
