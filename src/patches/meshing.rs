//! Cutting a scene's surfaces into patches: grids on large surfaces, clusters of small ones, and the larger patch that
//! each would be part of at twice the size.
//!
//! Small surfaces share one patch where they have one material, near-equal normals and lie close together: they are
//! grouped by a voxel of the target size and by the cell of a cube map that the normal points to (26 cells, about 45°
//! wide), so that the cost is linear and neither connectivity nor order of the faces matters. A larger patch is a block
//! of two by two cells of a grid, or the cluster of twice the size; a solution on those shows what patch size does.
//!
//! Not handled: which size the light requires; light that differs between the surfaces of a cluster. Patches along
//! lines of contact, which separate light from dark, and surfaces of a single patch are their own parents.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::patches::grid::{Draft, Fragment, Grid, NONE, Piece};
use crate::patches::scene_patches::{Mesh, Owner, Patches};
use crate::rays::{Rays, Side};
use crate::scene::{Scene, Sides};
use crate::surfaces::coplanar::Surface;
use crate::surfaces::{Geometry, Surfaces};

/// What the faces of a scene belong to, as far as they are cut.
struct Owned {
    owners: Vec<Owner>,
    drafts: Vec<Draft>,
    grids: Vec<Grid>,
}

impl Owned {
    /// Nothing of so many faces.
    fn new(faces: usize) -> Owned {
        Owned { owners: vec![Owner::Patch(NONE); faces], drafts: Vec::new(), grids: Vec::new() }
    }

    /// Adds a surface that carries a grid.
    fn enter(&mut self, (mut grid, drafts): (Grid, Vec<Draft>), surface: &Surface) {
        grid.number_from(self.drafts.len() as u32);
        for &face in &surface.faces {
            self.owners[face as usize] = Owner::Grid(self.grids.len() as u32);
        }
        self.grids.push(grid);
        self.drafts.extend(drafts);
    }

    /// Adds a patch that all of its pieces' faces belong to.
    fn add(&mut self, draft: Draft) {
        let own = Owner::Patch(self.drafts.len() as u32);
        draft.pieces.iter().for_each(|piece| self.owners[piece.face as usize] = own);
        self.drafts.push(draft);
    }
}

impl Patches {
    /// Cuts the scene into about `count` patches, front sides and back sides of two-sided faces counted alike.
    ///
    /// The count is met within about a quarter where the geometry allows: at least one patch per surface and
    /// direction of the normal is needed, and at least one patch is always made. Of a sky two cells are counted.
    pub fn new(scene: &Scene, rays: &Rays, count: usize) -> Patches {
        Patches::cut_surfaces(scene, rays, &Surfaces::new(scene, rays), count)
    }

    /// Cuts a scene whose surfaces are known into about `count` patches, counted as in [`Patches::new`].
    pub fn cut(geometry: &Geometry, count: usize) -> Patches {
        Patches::cut_surfaces(&geometry.scene, &geometry.rays, &geometry.surfaces, count)
    }

    fn cut_surfaces(scene: &Scene, rays: &Rays, found: &Surfaces, count: usize) -> Patches {
        let surfaces = &found.list;
        let more = scene.sky.as_ref().map_or(0, |sky| sky.cells() as usize - 2);
        let total: f64 = surfaces.iter().map(|s| s.area * sides_of(scene, s.material)).sum();
        let mut size = (total / count.max(1) as f64).sqrt();
        // Edges of surfaces and voxels add patches: correct the size by the count it gave.
        for _ in 0..4 {
            let estimate = Patches::estimate(scene, surfaces, size) - more;
            let ratio = estimate as f64 / count.max(1) as f64;
            if (0.9..1.1).contains(&ratio) {
                break;
            }
            size *= ratio.sqrt();
        }
        let mut patches = Patches::of_size(scene, rays, found, size);
        patches.requested = count;
        patches
    }

    /// Number of patches that `size` would give, without cutting anything.
    fn estimate(scene: &Scene, surfaces: &[Surface], size: f64) -> usize {
        let (large, small): (Vec<_>, Vec<_>) = surfaces.iter().partition(|s| is_large(s, size));
        let cells: f64 = large.iter().map(|s| s.cells(size) * sides_of(scene, s.material)).sum();
        let clusters: FxHashSet<Key> = keys(&small, size).into_iter().collect();
        cells as usize + clusters.len()
    }

    /// Cuts all surfaces into patches of about a size, unit coordinates.
    fn of_size(scene: &Scene, rays: &Rays, found: &Surfaces, size: f64) -> Patches {
        let surfaces = &found.list;
        // Cut large surfaces into grids, side by side.
        let large = (0..surfaces.len()).into_par_iter().with_max_len(64);
        let cut = |s: usize| {
            let segments = found.discontinuities.segments(scene, rays, s, &surfaces[s]);
            Some((s, Grid::cut(scene, &surfaces[s], segments, size)?))
        };
        let cuts: Vec<(usize, (Grid, Vec<Draft>))> =
            large.filter(|&s| is_large(&surfaces[s], size)).filter_map(cut).collect();
        let mut own = Owned::new(scene.faces.len());
        let mut small = vec![true; surfaces.len()];
        for (s, cut) in cuts {
            small[s] = false;
            own.enter(cut, &surfaces[s]);
        }
        // Gather small ones.
        let small: Vec<&Surface> = (0..surfaces.len()).filter(|&s| small[s]).map(|s| &surfaces[s]).collect();
        let clusters = clusters(&small, size);
        let larger = larger_clusters(&small, &clusters, size);
        let parents = parents(&own.grids, own.drafts.len(), &larger);
        let together = |group: &Vec<usize>| together(scene, group.iter().map(|&k| small[k]));
        let drafts: Vec<Draft> = clusters.par_iter().map(together).collect();
        drafts.into_iter().for_each(|draft| own.add(draft));
        Patches::number(scene, found, own, parents, size)
    }

    /// Lays out drafts as patches: fronts first, then the backs of two-sided materials.
    fn number(scene: &Scene, found: &Surfaces, own: Owned, parents: Vec<u32>, size: f64) -> Patches {
        let drafts = own.drafts;
        let mut mesh = Mesh {
            starts: vec![0],
            owners: own.owners,
            grids: own.grids,
            size,
            backs: vec![NONE; drafts.len()],
            parents,
            normals: Arc::clone(&found.normals),
            ..Mesh::default()
        };
        for draft in &drafts {
            mesh.push(draft, Side::Front);
        }
        let fronts = mesh.parents.clone();
        let mut next = fronts.iter().max().map_or(0, |p| p + 1);
        let mut behind: HashMap<u32, u32> = HashMap::new();
        for (front, draft) in drafts.iter().enumerate() {
            if scene.materials[draft.material as usize].sides == Sides::Two {
                mesh.backs[front] = mesh.areas.len() as u32;
                mesh.push(draft, Side::Back);
                // Numbers have no gaps: only some fronts have a back.
                let parent = *behind.entry(fronts[front]).or_insert_with(|| {
                    next += 1;
                    next - 1
                });
                mesh.parents.push(parent);
            }
        }
        mesh.take_textures(scene, &found.means);
        Patches::of_mesh(Arc::new(mesh))
    }
}

impl Mesh {
    fn push(&mut self, draft: &Draft, side: Side) {
        let area: f64 = draft.pieces.iter().map(|p| p.area).sum();
        let mut sum = 0.0;
        for piece in &draft.pieces {
            sum += piece.area;
            let share = (sum / area) as f32;
            self.fragments.push(Fragment { corners: piece.corners, face: piece.face, share });
        }
        self.starts.push(self.fragments.len() as u32);
        self.areas.push(area);
        self.materials.push(draft.material);
        self.sides.push(side);
    }
}

/// A patch of small surfaces of one material.
fn together<'a>(scene: &Scene, surfaces: impl Iterator<Item = &'a Surface> + Clone) -> Draft {
    let material = surfaces.clone().next().map_or(0, |surface| surface.material);
    let piece = |&face: &u32| Piece { face, corners: scene.corners(face), area: scene.emitting_area(face) };
    Draft { material, pieces: surfaces.flat_map(|surface| &surface.faces).map(piece).collect() }
}

/// Whether a surface carries a grid of its own.
fn is_large(s: &Surface, size: f64) -> bool {
    s.area >= 0.5 * size * size || s.extent[0] >= 1.5 * size
}

fn sides_of(scene: &Scene, material: u32) -> f64 {
    match scene.materials[material as usize].sides {
        Sides::One => 1.0,
        Sides::Two => 2.0,
    }
}

/// What surfaces of one cluster agree in: material, voxel, cell of the normal.
type Key = (u32, [i64; 3], [i8; 3]);

/// The keys of surfaces in voxels of a size.
fn keys(small: &[&Surface], size: f64) -> Vec<Key> {
    let key = |s: &&Surface| {
        let middle = s.origin + 0.5 * (s.axes[0] * s.extent[0] + s.axes[1] * s.extent[1]);
        let voxel = (middle / size).floor().as_i64vec3();
        (s.material, voxel.to_array(), direction_cell(s.normal))
    };
    small.par_iter().with_min_len(1024).map(key).collect()
}

/// Indices into `small` of the surfaces that belong together at a size, in the order of their first members.
fn clusters(small: &[&Surface], size: f64) -> Vec<Vec<usize>> {
    let mut order: FxHashMap<Key, usize> = FxHashMap::default();
    let mut found: Vec<Vec<usize>> = Vec::new();
    for (k, key) in keys(small, size).into_iter().enumerate() {
        let g = *order.entry(key).or_insert_with(|| {
            found.push(Vec::new());
            found.len() - 1
        });
        found[g].push(k);
    }
    found
}

/// For each cluster of a size the number of the cluster of twice the size that it is part of.
fn larger_clusters(small: &[&Surface], own: &[Vec<usize>], size: f64) -> Vec<u32> {
    let mut larger = vec![0; small.len()];
    for (g, group) in clusters(small, 2.0 * size).iter().enumerate() {
        group.iter().for_each(|&k| larger[k] = g as u32);
    }
    own.iter().map(|group| larger[group[0]]).collect()
}

/// Cell of a cube map with 3×3 cells a face; cells on an edge or corner of the cube belong to all its faces.
fn direction_cell(n: DVec3) -> [i8; 3] {
    let along = n / n.abs().max_element();
    // Nudged so that directions on a cell's border, as of a box at 45°, fall on one side whatever the rounding.
    (along * 1.4999).round().to_array().map(|x| x as i8)
}

/// The larger patch, numbered without gaps, that each patch is part of: a block of cells of a grid, or the cluster of
/// twice the size, `clusters` for each of those numbered from `first`.
fn parents(grids: &[Grid], first: usize, clusters: &[u32]) -> Vec<u32> {
    let mut parents = vec![NONE; first + clusters.len()];
    let mut numbers: HashMap<(u32, u32), u32> = HashMap::new();
    let blocks = grids.iter().zip(0..).flat_map(|(grid, g)| grid.blocks().map(move |(patch, block)| (patch, g, block)));
    let clusters = clusters.iter().zip(first as u32..).map(|(&cluster, patch)| (patch, NONE, cluster));
    for (patch, grid, block) in blocks.chain(clusters) {
        let next = numbers.len() as u32;
        let own = &mut parents[patch as usize];
        if *own == NONE {
            *own = *numbers.entry((grid, block)).or_insert(next);
        }
    }
    let alone = parents.iter_mut().filter(|p| **p == NONE);
    for (own, next) in alone.zip(numbers.len() as u32..) {
        *own = next;
    }
    parents
}

impl Patches {
    /// Share of the area whose patches are no part of a larger one.
    pub fn alone(&self) -> f64 {
        let mut parts = vec![0_u32; self.len()];
        self.parents().iter().for_each(|&p| parts[p as usize] += 1);
        let each = self.parents().iter().zip(self.areas());
        let alone: f64 = each.filter(|(p, _)| parts[**p as usize] == 1).map(|(_, area)| area).sum();
        alone / self.areas().iter().sum::<f64>()
    }
}
