//! Which patches of a grid lie together: in blocks of two by two cells, and side by side.
//!
//! A line of contact divides light from dark: patches of cells that it cuts join no block and are no one's neighbours.
//!
//! Not handled: patches of other grids, which [`crate::patches::adjacency`] finds.

use glam::Vec3;

use crate::patches::grid::{Cell, Grid};
use crate::patches::pieces::NONE;

impl Grid {
    /// Every patch of the grid with the block of two by two cells it lies in; a patch may come several times.
    pub fn blocks(&self) -> impl Iterator<Item = (u32, u32)> {
        let across = self.columns.div_ceil(2);
        self.cells.iter().enumerate().flat_map(move |(k, cell)| {
            let (row, column) = (k / self.columns, k % self.columns);
            let block = (row / 2 * across + column / 2) as u32;
            let patches = match cell {
                Cell::Patch(patch) => std::slice::from_ref(patch),
                // A line of contact divides light from dark: its patches join no block.
                Cell::Cut(_) => &[],
            };
            patches.iter().map(move |&patch| (patch, block))
        })
    }

    /// Every patch of whole cells; a patch may come several times.
    pub fn whole(&self) -> impl Iterator<Item = u32> {
        self.cells.iter().filter_map(|cell| match cell {
            Cell::Patch(patch) => Some(*patch),
            Cell::Cut(_) => None,
        })
    }

    /// The patches of the cells beside that of a patch with its middle there: in u after and before, in v after and
    /// before. NONE stands for the rim, a cell cut by lines, and a cell that shares the patch.
    pub fn beside(&self, patch: u32, middle: Vec3) -> [u32; 4] {
        let d = middle - self.origin;
        let (column, row) = (d.dot(self.per_cell[0]) as usize, d.dot(self.per_cell[1]) as usize);
        let at = |row: usize, column: usize| {
            if row >= self.rows || column >= self.columns {
                return NONE;
            }
            match &self.cells[row * self.columns + column] {
                Cell::Patch(other) if *other != patch => *other,
                _ => NONE,
            }
        };
        let before = |k: usize| k.wrapping_sub(1);
        [at(row, column + 1), at(row, before(column)), at(row + 1, column), at(before(row), column)]
    }

    /// Half a cell along u and along v.
    pub fn halves(&self) -> [Vec3; 2] {
        self.per_cell.map(|axis| 0.5 * axis / axis.length_squared())
    }
}
