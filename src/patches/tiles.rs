//! The grids of one surface: one for each of its tiles, cells of different size side by side.
//!
//! A tile that the surface has no part in points to the grid of the nearest one that has.
//!
//! Not handled: a hit on the very rim of a hole along which two tiles meet may round into the other tile, and finds the
//! patch there that is nearest to the hole.

use glam::{DVec2, Vec2, Vec3};

use crate::patches::clip::span;
use crate::patches::grid::{Grid, TilePart, index};
use crate::patches::pieces::Draft;
use crate::patches::zones::Zones;
use crate::scene::Scene;
use crate::surfaces::coplanar::Surface;
use crate::surfaces::discontinuities::Place;

/// Finds the grid of a point's tile.
#[derive(Clone, Debug)]
pub(crate) struct Tiling {
    origin: Vec3,
    per_tile: [Vec3; 2],
    columns: usize,
    rows: usize,
    grids: Vec<u32>,
}

impl Tiling {
    /// The grid of the tile that the point lies in.
    #[inline]
    pub fn grid(&self, position: Vec3) -> u32 {
        let at = self.units(position);
        let (column, row) = (index(at.x, self.columns), index(at.y, self.rows));
        self.grids[row * self.columns + column]
    }

    /// The grid of the tile that the point lies in; none outside of the tiles' rectangle.
    pub fn inside(&self, position: Vec3) -> Option<u32> {
        let at = self.units(position);
        let within = |x: f32, n: usize| x >= 0.0 && x <= n as f32;
        let inside = within(at.x, self.columns) && within(at.y, self.rows);
        inside.then(|| self.grid(position))
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        self.grids.len()
    }

    /// Every grid once, with the tiling it belongs to.
    pub fn grids(&self) -> impl Iterator<Item = (u32, &Tiling)> {
        let (first, last) = (self.grids.iter().min(), self.grids.iter().max());
        let range = first.copied().unwrap_or(0)..last.map_or(0, |&g| g + 1);
        range.map(move |g| (g, self))
    }

    /// A point in units of tiles.
    #[inline]
    fn units(&self, position: Vec3) -> Vec2 {
        let d = position - self.origin;
        Vec2::new(d.dot(self.per_tile[0]), d.dot(self.per_tile[1]))
    }
}

/// A surface cut into patches, numbered from 0 on as its grids are.
pub(crate) struct CutSurface {
    pub tiling: Tiling,
    pub grids: Vec<Grid>,
    pub drafts: Vec<Draft>,
}

impl CutSurface {
    /// Numbers the grids and patches from others on.
    pub fn numbered_from(mut self, grid: u32, patch: u32) -> CutSurface {
        self.tiling.grids.iter_mut().for_each(|g| *g += grid);
        self.grids.iter_mut().for_each(|g| g.number_from(patch));
        self
    }
}

/// Cuts the tiles of surface s, each to its zone's size. None where the surface is too thin for any.
pub(crate) fn cut_tiles(place: Place, zones: &Zones, s: usize, sizes: &[f64]) -> Option<CutSurface> {
    let (scene, surface) = (place.scene, &zones.surfaces.list[s]);
    let [columns, rows] = zones.tiles(s);
    let segments = zones.surfaces.discontinuities.segments(place, s, surface);
    let faces = by_tile(scene, surface, [columns, rows]);
    let (mut grids, mut drafts): (Vec<Grid>, Vec<Draft>) = (Vec::new(), Vec::new());
    let mut found: Vec<Option<u32>> = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let tile = zones.tile(s, column, row);
            let size = sizes[zones.zone(s, column, row)];
            let whole = columns * rows == 1;
            let cells = if whole { surface.divisions(size) } else { even(tile.extent / size) };
            let first = drafts.len() as u32;
            let part = TilePart { surface, tile, faces: &faces[row * columns + column] };
            let made = part.cut(scene, segments, cells, first);
            found.push(made.map(|(grid, pieces)| {
                grids.push(grid);
                drafts.extend(pieces);
                grids.len() as u32 - 1
            }));
        }
    }
    let any = found.iter().any(Option::is_some);
    any.then(|| CutSurface { tiling: tiling(surface, [columns, rows], &found), grids, drafts })
}

/// The faces that reach into each tile.
fn by_tile(scene: &Scene, surface: &Surface, [columns, rows]: [usize; 2]) -> Vec<Vec<u32>> {
    let mut faces = vec![Vec::new(); columns * rows];
    let tiles = DVec2::new(columns as f64, rows as f64) / DVec2::from(surface.extent);
    for &face in &surface.faces {
        let corners = scene.corners(face);
        let [a, b, c] = corners.map(|p| surface.uv(p.as_dvec3()) * tiles);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        for row in span(low.y, high.y, rows) {
            for column in span(low.x, high.x, columns) {
                faces[row * columns + column].push(face);
            }
        }
    }
    faces
}

/// Cells of a tile along each axis: even, so that two by two of them make a larger one, or one.
fn even(ratio: DVec2) -> [usize; 2] {
    ratio.to_array().map(|r| match r.clamp(1.0, 4096.0) {
        r if r < 1.25 => 1,
        r => 2 * (0.5 * r).round().max(1.0) as usize,
    })
}

fn tiling(surface: &Surface, [columns, rows]: [usize; 2], found: &[Option<u32>]) -> Tiling {
    let nearest = |k: usize| {
        let apart = |other: usize| {
            let (a, b) = (k % columns, other % columns);
            a.abs_diff(b).pow(2) + (k / columns).abs_diff(other / columns).pow(2)
        };
        let filled = (0..found.len()).filter(|&other| found[other].is_some());
        filled.min_by_key(|&other| apart(other))
    };
    let grid = |k: usize| nearest(k).and_then(|other| found[other]).unwrap_or(0);
    let axis = |k: usize, n: usize| (surface.axes[k] * (n as f64 / surface.extent[k])).as_vec3();
    Tiling {
        origin: surface.origin.as_vec3(),
        per_tile: [axis(0, columns), axis(1, rows)],
        columns,
        rows,
        grids: (0..found.len()).map(grid).collect(),
    }
}
