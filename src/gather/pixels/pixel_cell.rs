//! Cells of a pixel: the squares that its camera rays stand for, one each.
//!
//! Not handled: what is seen through them.

use glam::Vec2;

/// Cells to a side of a pixel of so many rays, no more cells than rays: points of the nets that rays are drawn from lie
/// evenly in them.
pub(crate) fn cells_to_a_side(rays: u32) -> u32 {
    1 << (rays.max(1).ilog2() / 2)
}

/// The corners of the cell around a place of a pixel, in order.
pub(crate) fn cell_corners(at: Vec2, cells: u32) -> [Vec2; 4] {
    let side = 1.0 / cells as f32;
    let low = (at / side).floor().min(Vec2::splat((cells - 1) as f32)) * side;
    [low, low + side * Vec2::X, low + side, low + side * Vec2::Y]
}
