//! Zones: the pieces of the surfaces whose patches have one size each, so that patches can be small where light asks
//! for it and large elsewhere.
//!
//! A large surface is divided into rectangular tiles, a small one is a zone by itself. Zones do not change while the
//! size of the patches in them does.
//!
//! Not handled: which size a zone needs; that depends on the light.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::rays::Rays;
use crate::scene::Scene;
use crate::surfaces::Surfaces;
use crate::surfaces::coplanar::Surface;

/// Patches along each side of a tile, at the size that zones are made for.
const ACROSS: usize = 2;

/// A scene's surfaces, divided into zones.
#[derive(Debug)]
pub struct Zones {
    pub(crate) surfaces: Arc<Surfaces>,
    /// Tiles of every surface along u and along v.
    tiles: Vec<[usize; 2]>,
    /// The first zone of every surface, and the number of zones.
    starts: Vec<u32>,
}

/// A rectangle of a surface in its (u, v), and whether it is bounded by other tiles below and above along each axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tile {
    pub low: DVec2,
    pub extent: DVec2,
    pub inner: [[bool; 2]; 2],
}

impl Zones {
    /// Zones for patches of `size` and smaller ones.
    pub fn new(scene: &Scene, rays: &Rays, size: f64) -> Zones {
        Zones::of(&Surfaces::new(scene, rays), size)
    }

    /// Zones of surfaces that are known, for patches of `size` and smaller ones.
    pub fn of(surfaces: &Arc<Surfaces>, size: f64) -> Zones {
        Zones::tiled(surfaces, |s| s.divisions(size).map(|n| n.div_ceil(ACROSS)))
    }

    /// Every surface one zone.
    pub(crate) fn whole(surfaces: &Arc<Surfaces>) -> Zones {
        Zones::tiled(surfaces, |_| [1, 1])
    }

    fn tiled(surfaces: &Arc<Surfaces>, tiles: impl Fn(&Surface) -> [usize; 2]) -> Zones {
        let tiles: Vec<[usize; 2]> = surfaces.list.iter().map(tiles).collect();
        let mut starts = vec![0];
        for (k, [columns, rows]) in tiles.iter().enumerate() {
            starts.push(starts[k] + (columns * rows) as u32);
        }
        Zones { surfaces: Arc::clone(surfaces), tiles, starts }
    }

    /// Number of zones.
    pub fn len(&self) -> usize {
        self.starts[self.tiles.len()] as usize
    }

    /// Whether there is none: never, as a scene has faces.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Tiles of surface s along u and along v.
    pub(crate) fn tiles(&self, s: usize) -> [usize; 2] {
        self.tiles[s]
    }

    /// The zone of a surface's tile.
    pub(crate) fn zone(&self, s: usize, column: usize, row: usize) -> usize {
        self.starts[s] as usize + row * self.tiles[s][0] + column
    }

    /// The rectangle of a surface's tile.
    pub(crate) fn tile(&self, s: usize, column: usize, row: usize) -> Tile {
        let tiles = self.tiles[s];
        let extent = self.surfaces.list[s].extent;
        let size = DVec2::new(extent[0] / tiles[0] as f64, extent[1] / tiles[1] as f64);
        let inner = |k: usize, n: usize| [k > 0, k + 1 < n];
        Tile {
            low: size * DVec2::new(column as f64, row as f64),
            extent: size,
            inner: [inner(column, tiles[0]), inner(row, tiles[1])],
        }
    }

    /// The zone of a point of a face.
    pub(crate) fn at(&self, face: u32, position: DVec3) -> usize {
        let s = self.surfaces.of_face[face as usize] as usize;
        let surface = &self.surfaces.list[s];
        let uv = surface.uv(position);
        let cell = |axis: usize| {
            let n = self.tiles[s][axis];
            let at = uv[axis] / surface.extent[axis] * n as f64;
            (at.max(0.0) as usize).min(n - 1)
        };
        self.zone(s, cell(0), cell(1))
    }
}
