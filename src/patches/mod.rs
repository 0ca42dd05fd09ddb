//! Patches: the pieces of surface that carry one value of `L` each.
//!
//! Patch count is decoupled from triangle count. Faces that lie in one plane, touch and share a material form a
//! *surface*; a surface larger than the target size carries a rectangular grid of patches found from the point's
//! (u, v) in the plane, and small surfaces of one material with near-equal normals that lie close together share one
//! patch. Cells are cut further along lines where other faces touch the surface. Rays see only the faces as loaded; [`Patches::at`] tells which patch a hit belongs to. A two-sided face has
//! a patch on either side.
//!
//! Areas are in unit coordinates squared. Invariants: the patches' areas of one side sum to the faces' area; every
//! point of every face belongs to exactly one patch per reflecting side; numbering depends on the scene only.
//!
//! Patches have one size over the scene, or one for each of its zones ([`Zones`]). Not handled: which size light asks for.

mod beside;
mod clip;
mod cluster;
mod contact;
mod grid;
mod neighbours;
mod parents;
mod surface;
mod tiling;
mod zones;

use glam::Vec3;

use crate::rays::cosine::triangle_point;
use crate::rays::{Rays, Side};
use crate::scene::{Scene, Sides};
use contact::Contacts;
use grid::Grid;
pub use neighbours::Neighbours;
use parents::Parents;
use tiling::{Tiling, cut_tiles};
pub use zones::Zones;

/// No patch: the black back of a one-sided face.
const NONE: u32 = u32::MAX;

/// A piece of one face that belongs to a patch.
#[derive(Clone, Copy, Debug)]
struct Fragment {
    corners: [Vec3; 3],
    face: u32,
    /// Areas of the patch's fragments up to and including this one, divided by the patch's area.
    share: f32,
}

/// A point on a patch.
#[derive(Clone, Copy, Debug)]
pub struct PatchPoint {
    /// Unit coordinates.
    pub position: Vec3,
    /// Unit normal of the side the patch lies on.
    pub normal: Vec3,
    /// The face the point lies on.
    pub face: u32,
}

/// How a face's hits find their patch.
#[derive(Clone, Copy, Debug)]
enum Owner {
    Patch(u32),
    Grid(u32),
    Tiling(u32),
}

/// All patches of a scene.
#[derive(Debug)]
pub struct Patches {
    areas: Vec<f64>,
    materials: Vec<u32>,
    sides: Vec<Side>,
    /// Fragments of patch i: `starts[i]..starts[i + 1]`.
    starts: Vec<u32>,
    fragments: Vec<Fragment>,
    owners: Vec<Owner>,
    grids: Vec<Grid>,
    tilings: Vec<Tiling>,
    /// About the size of the largest patches, unit coordinates.
    size: f64,
    /// The larger patch that each would be part of at twice the size, by any number.
    parents: Vec<u32>,
    /// The patch behind a front patch, or NONE.
    backs: Vec<u32>,
    /// Front unit normals of the faces.
    normals: Vec<Vec3>,
}

/// A patch before numbering: its material and the pieces of faces it consists of.
struct Draft {
    material: u32,
    pieces: Vec<Piece>,
}

/// A triangle cut from a face, and its area.
struct Piece {
    face: u32,
    corners: [Vec3; 3],
    area: f64,
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
    fn estimate(scene: &Scene, surfaces: &[surface::Surface], size: f64) -> usize {
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
        };
        for draft in &drafts {
            patches.push(draft, Side::Front);
        }
        let fronts = patches.parents.clone();
        let apart = fronts.iter().max().map_or(0, |p| p + 1);
        for (front, draft) in drafts.iter().enumerate() {
            if scene.materials[draft.material as usize].sides == Sides::Two {
                patches.backs[front] = patches.len() as u32;
                patches.push(draft, Side::Back);
                patches.parents.push(fronts[front] + apart);
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

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Never true for a checked scene; here because a collection with `len` should have it.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// `A_i` of every patch, unit coordinates squared.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Material index of every patch.
    pub fn materials(&self) -> &[u32] {
        &self.materials
    }

    /// For every patch the number of the larger patch that it is part of, about four to one.
    ///
    /// Patches along lines of contact are their own, and so are surfaces of a single patch.
    pub fn parents(&self) -> &[u32] {
        &self.parents
    }

    /// Which patches lie beside each other.
    pub fn neighbours(&self) -> Neighbours {
        Neighbours::new(self)
    }

    /// The patch that a point of a face's side belongs to; `None` on the black back of a one-sided face.
    #[inline]
    pub fn at(&self, face: u32, side: Side, position: Vec3) -> Option<u32> {
        let front = match self.owners[face as usize] {
            Owner::Patch(patch) => patch,
            Owner::Grid(grid) => self.grids[grid as usize].patch(position),
            Owner::Tiling(tiling) => {
                let grid = self.tilings[tiling as usize].grid(position);
                self.grids[grid as usize].patch(position)
            }
        };
        match side {
            Side::Front => Some(front),
            Side::Back => Some(self.backs[front as usize]).filter(|&back| back != NONE),
        }
    }

    /// The patch that the front of a face is part of, where it is one patch only.
    fn of_face(&self, face: u32) -> Option<u32> {
        match self.owners[face as usize] {
            Owner::Patch(patch) => Some(patch),
            _ => None,
        }
    }

    /// About the size of the largest patches, unit coordinates.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Unit normal of a face's side.
    #[inline]
    pub fn normal(&self, face: u32, side: Side) -> Vec3 {
        let normal = self.normals[face as usize];
        match side {
            Side::Front => normal,
            Side::Back => -normal,
        }
    }

    /// The point of patch `i` at (u, v) in the unit square; uniform over the patch for uniform (u, v).
    pub fn point(&self, i: usize, u: f32, v: f32) -> PatchPoint {
        let own = &self.fragments[self.starts[i] as usize..self.starts[i + 1] as usize];
        let k = own.partition_point(|f| f.share <= u).min(own.len() - 1);
        let before = if k == 0 { 0.0 } else { own[k - 1].share };
        // Stretch u over the chosen fragment, so that one stratified number serves twice.
        let u = ((u - before) / (own[k].share - before)).clamp(0.0, 0.999_999_94);
        let face = own[k].face;
        PatchPoint {
            position: triangle_point(own[k].corners, u, v),
            normal: self.normal(face, self.sides[i]),
            face,
        }
    }

    /// The triangles a patch consists of, with the face each is a part of.
    pub fn pieces(&self, i: usize) -> impl Iterator<Item = (u32, [Vec3; 3])> {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        self.fragments[range].iter().map(|f| (f.face, f.corners))
    }

    /// Which side of its faces a patch lies on.
    pub fn side(&self, i: usize) -> Side {
        self.sides[i]
    }
}

/// Whether a surface carries a grid of its own.
fn is_large(s: &surface::Surface, size: f64) -> bool {
    s.area >= 0.5 * size * size || s.extent[0] >= 1.5 * size
}

fn sides_of(scene: &Scene, material: u32) -> f64 {
    match scene.materials[material as usize].sides {
        Sides::One => 1.0,
        Sides::Two => 2.0,
    }
}
