//! The pixels around one.
//!
//! Not handled: atlases, whose neighbours need not lie beside each other on a surface.

use std::ops::Range;

/// Columns and rows up to `reach` from pixel k of so many pixels in rows of `width`.
pub(crate) fn spans(k: usize, reach: usize, width: usize, pixels: usize) -> [Range<usize>; 2] {
    let near = |at: usize, length: usize| at.saturating_sub(reach)..(at + reach + 1).min(length);
    let width = width.max(1);
    [near(k % width, width), near(k / width, pixels / width)]
}

/// The pixels in these, row by row; pixel k is one of them.
pub(crate) fn window(k: usize, reach: usize, width: usize, pixels: usize) -> impl Iterator<Item = usize> + Clone {
    let width = width.max(1);
    let [columns, rows] = spans(k, reach, width, pixels);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_end_with_the_picture() {
        let of = |k: usize, reach: usize| window(k, reach, 4, 12).collect::<Vec<_>>();
        assert_eq!(of(5, 1), [0, 1, 2, 4, 5, 6, 8, 9, 10]);
        assert_eq!(of(0, 1), [0, 1, 4, 5]);
        assert_eq!(of(11, 1), [6, 7, 10, 11]);
        assert_eq!(of(6, 9), (0..12).collect::<Vec<_>>());
        assert_eq!(of(7, 0), [7]);
    }
}
