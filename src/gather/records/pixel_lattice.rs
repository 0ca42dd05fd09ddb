//! Nested lattices of pixels, and the records on them near a pixel.
//!
//! The lattice of spacing s > 1 holds the pixels whose coordinates are s/2 modulo s, that of spacing 1 all pixels: the
//! coarser lattices are disjoint, and each puts one pixel into every square of s×s.
//!
//! Not handled: records further from the pixel than about two spacings of their lattice.

/// Spacing of the smallest tiles, pixels.
const LEAST_TILE: usize = 4;
/// Spacings to each side within which records are visited.
const AROUND: usize = 2;

/// Columns by which the chosen pixels of a row are shifted from those of the next.
const SKEW: usize = 4;

/// A number of pixel k of which every n-th value chooses one pixel in n of each row and column: creases lie along rows
/// and columns, and none may be missed.
pub(crate) fn skewed(k: usize, width: usize) -> usize {
    k % width + SKEW * (k / width)
}

/// Records by place in the picture.
pub(crate) struct Lattice {
    width: usize,
    height: usize,
    levels: Vec<Level>,
    /// The pixel of every record.
    pixels: Vec<u32>,
}

/// The records of one spacing, by tiles.
struct Level {
    spacing: usize,
    tile: usize,
    columns: usize,
    tiles: Vec<Vec<u32>>,
}

impl Lattice {
    /// Empty lattices of `spacing` and its halves down to 1.
    pub(crate) fn new(spacing: usize, width: usize, height: usize) -> Lattice {
        let spacings = std::iter::successors(Some(spacing), |s| (*s > 1).then_some(s / 2));
        let level = |spacing: usize| {
            let tile = spacing.max(LEAST_TILE);
            let columns = width.div_ceil(tile);
            Level { spacing, tile, columns, tiles: vec![Vec::new(); columns * height.div_ceil(tile)] }
        };
        Lattice { width, height, levels: spacings.map(level).collect(), pixels: Vec::new() }
    }

    /// Pixels across.
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// The pixels on the lattice of one spacing, in order.
    pub(crate) fn pixels(&self, spacing: usize) -> impl Iterator<Item = usize> {
        let (width, height) = (self.width, self.height);
        // A picture smaller than the spacing still has a pixel on it.
        let first = move |length: usize| (spacing / 2).min(length.saturating_sub(1));
        (first(height)..height)
            .step_by(spacing)
            .flat_map(move |y| (first(width)..width).step_by(spacing).map(move |x| y * width + x))
    }

    /// Adds the next record, number `record`, at pixel k.
    pub(crate) fn insert(&mut self, spacing: usize, k: usize, record: u32) {
        debug_assert_eq!(record as usize, self.pixels.len());
        let (x, y) = (k % self.width, k / self.width);
        self.pixels.push(k as u32);
        if let Some(level) = self.levels.iter_mut().find(|l| l.spacing == spacing) {
            level.tiles[y / level.tile * level.columns + x / level.tile].push(record);
        }
    }

    /// The pixel of a record.
    pub(crate) fn pixel_of(&self, record: u32) -> usize {
        self.pixels[record as usize] as usize
    }

    /// Visits the records of every lattice near pixel k.
    #[inline]
    pub(crate) fn visit(&self, k: usize, mut visit: impl FnMut(u32)) {
        let (x, y) = (k % self.width, k / self.width);
        for level in &self.levels {
            let reach = AROUND * level.spacing;
            let tiles = |p: usize, length: usize| {
                p.saturating_sub(reach) / level.tile..=(p + reach).min(length - 1) / level.tile
            };
            for row in tiles(y, self.height) {
                let columns = tiles(x, self.width);
                let first = row * level.columns;
                let own = &level.tiles[first + columns.start()..=first + columns.end()];
                own.iter().flatten().for_each(|&record| visit(record));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_lattices_are_disjoint_and_the_finest_is_everything() {
        let lattice = Lattice::new(8, 37, 21);
        let mut seen = vec![0; 37 * 21];
        for spacing in [8, 4, 2] {
            lattice.pixels(spacing).for_each(|k| seen[k] += 1);
        }
        assert!(seen.iter().all(|&n| n <= 1));
        assert_eq!(lattice.pixels(1).count(), 37 * 21);
        assert_eq!(Lattice::new(8, 2, 1).pixels(8).collect::<Vec<_>>(), vec![1]);
    }

    #[test]
    fn records_are_found_from_pixels_nearby() {
        let mut lattice = Lattice::new(8, 64, 64);
        for (record, k) in lattice.pixels(8).collect::<Vec<_>>().into_iter().enumerate() {
            lattice.insert(8, k, record as u32);
        }
        // Within two spacings to each side: nine records at least, and none is missed.
        let mut near = Vec::new();
        lattice.visit(64 * 30 + 30, |p| near.push(lattice.pixel_of(p)));
        let close = |k: &usize| (k % 64).abs_diff(30) <= 16 && (k / 64).abs_diff(30) <= 16;
        let expected: Vec<usize> = lattice.pixels(8).filter(close).collect();
        assert!(expected.len() >= 9 && expected.iter().all(|k| near.contains(k)));
    }
}
