//! Cutting a scene's surfaces into patches: grids on large surfaces, clusters of small ones.

use std::collections::HashMap;

use super::cluster;
use super::contact::Contacts;
use super::grid::Grid;
use super::parents::Parents;
use super::surface::{self, Surface};
use super::tiling::{Tiling, cut_tiles};
use super::zones::Zones;
use super::{Fragment, NONE, Owner, Patches};
use crate::rays::{Rays, Side};
use crate::scene::{Scene, Sides};

use glam::Vec3;

/// A patch before numbering: its material and the pieces of faces it consists of.
pub(super) struct Draft {
    pub material: u32,
    pub pieces: Vec<Piece>,
}

/// A triangle cut from a face, and its area.
pub(super) struct Piece {
    pub face: u32,
    pub corners: [Vec3; 3],
    pub area: f64,
}

impl Patches {
    /// Cuts the scene into about `count` patches, front sides and back sides of two-sided faces counted alike.
    ///
    /// The count is met within about a quarter where the geometry allows: at least one patch per surface and
    /// direction of the normal is needed, and at least one patch is always made.
    pub fn new(scene: &Scene, rays: &Rays, count: usize) -> Patches {
        let zones = Zones::whole(scene, rays);
        let surfaces = &zones.surfaces;
        let total: f64 = surfaces
            .iter()
            .map(|s| s.area * sides_of(scene, s.material))
            .sum();
        let mut size = (total / count.max(1) as f64).sqrt();
        // Edges of surfaces and voxels add patches: correct the size by the count it gave.
        for _ in 0..4 {
            let found = Patches::estimate(scene, surfaces, size);
            let ratio = found as f64 / count.max(1) as f64;
            if (0.9..1.1).contains(&ratio) {
                break;
            }
            size *= ratio.sqrt();
        }
        Patches::refined(scene, rays, &zones, &vec![size; surfaces.len()])
    }

    /// Number of patches that `size` would give, without cutting anything.
    fn estimate(scene: &Scene, surfaces: &[Surface], size: f64) -> usize {
        let (large, small): (Vec<_>, Vec<_>) = surfaces.iter().partition(|s| is_large(s, size));
        let cells: f64 = large
            .iter()
            .map(|s| s.cells(size) * sides_of(scene, s.material))
            .sum();
        let small: Vec<_> = small.into_iter().map(|s| (s, size)).collect();
        cells as usize + cluster::groups(&small, 1.0).len()
    }

    /// Cuts every zone into patches of its own size, unit coordinates.
    ///
    /// # Panics
    /// If there are fewer sizes than zones.
    pub fn refined(scene: &Scene, rays: &Rays, zones: &Zones, sizes: &[f64]) -> Patches {
        let contacts = Contacts::new(scene, rays);
        let mut owners = vec![Owner::Patch(NONE); scene.faces.len()];
        let (mut drafts, mut grids, mut tilings) = (Vec::new(), Vec::new(), Vec::new());
        let mut small = Vec::new();
        // Cut large surfaces into grids.
        for (s, surface) in zones.surfaces.iter().enumerate() {
            let (size, whole) = (sizes[zones.zone(s, 0, 0)], zones.tiles(s) == [1, 1]);
            let cut = |grids: &mut _, drafts: &mut _| {
                cut_tiles(scene, (zones, s), sizes, &contacts, (grids, drafts))
            };
            let large = !whole || is_large(surface, size);
            let tiling = large.then(|| cut(&mut grids, &mut drafts)).flatten();
            let Some(tiling) = tiling else {
                small.push((surface, size));
                continue;
            };
            let owner = match whole {
                true => Owner::Grid(grids.len() as u32 - 1),
                false => Owner::Tiling(tilings.len() as u32),
            };
            tilings.push(tiling);
            for &face in &surface.faces {
                owners[face as usize] = owner;
            }
        }
        // Gather small ones.
        let clusters = cluster::groups(&small, 1.0);
        let first = drafts.len() as u32;
        let parents = Parents::new(&grids, cluster::parents(&small, &clusters, first));
        for group in clusters {
            let faces = group.iter().flat_map(|&k| &small[k].0.faces);
            let mut pieces = Vec::new();
            for &face in faces {
                let corners = scene.corners(face);
                owners[face as usize] = Owner::Patch(drafts.len() as u32);
                let area = scene.area(face);
                pieces.push(Piece {
                    face,
                    corners,
                    area,
                });
            }
            let material = small[group[0]].0.material;
            drafts.push(Draft { material, pieces });
        }
        let size = sizes.iter().copied().fold(0.0, f64::max);
        Patches::number(scene, drafts, (owners, grids, tilings), parents, size)
    }

    /// Lays out drafts as patches: fronts first, then the backs of two-sided materials.
    fn number(
        scene: &Scene,
        drafts: Vec<Draft>,
        (owners, grids, tilings): (Vec<Owner>, Vec<Grid>, Vec<Tiling>),
        parents: Parents,
        size: f64,
    ) -> Patches {
        let mut patches = Patches {
            areas: Vec::new(),
            materials: Vec::new(),
            sides: Vec::new(),
            starts: vec![0],
            fragments: Vec::new(),
            owners,
            grids,
            tilings,
            size,
            backs: vec![NONE; drafts.len()],
            parents: parents.of(drafts.len()),
            normals: (0..scene.faces.len() as u32)
                .map(|f| surface::normal(scene.corners(f)).as_vec3())
                .collect(),
            starts_of_rays: Vec::new(),
            parts: Default::default(),
        };
        for draft in &drafts {
            patches.push(draft, Side::Front);
        }
        let fronts = patches.parents.clone();
        let mut next = fronts.iter().max().map_or(0, |p| p + 1);
        let mut behind: HashMap<u32, u32> = HashMap::new();
        for (front, draft) in drafts.iter().enumerate() {
            if scene.materials[draft.material as usize].sides == Sides::Two {
                patches.backs[front] = patches.len() as u32;
                patches.push(draft, Side::Back);
                // Numbers have no gaps: only some fronts have a back.
                let parent = *behind.entry(fronts[front]).or_insert_with(|| {
                    next += 1;
                    next - 1
                });
                patches.parents.push(parent);
            }
        }
        patches
    }

    fn push(&mut self, draft: &Draft, side: Side) {
        let area: f64 = draft.pieces.iter().map(|p| p.area).sum();
        let mut sum = 0.0;
        for piece in &draft.pieces {
            sum += piece.area;
            let share = (sum / area) as f32;
            self.fragments.push(Fragment {
                corners: piece.corners,
                face: piece.face,
                share,
            });
        }
        self.starts.push(self.fragments.len() as u32);
        self.areas.push(area);
        self.materials.push(draft.material);
        self.sides.push(side);
    }
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
