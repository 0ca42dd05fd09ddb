//! All patches of a scene: their areas, where the hits of a face find theirs, points on them, where they lie and what
//! they reflect.
//!
//! Areas are in unit coordinates squared. Invariants: the patches' areas of one side sum to the faces' area, but for
//! what masks cut away; every point of every face belongs to exactly one patch per reflecting side; numbering depends
//! on the scene only. A patch of a masked surface counts the area of what there is of it, and reflects and emits the
//! mean over that.
//!
//! Not handled: how surfaces are cut ([`crate::patches::meshing`]), the shape of a patch: a long one is about as wide
//! as it is long, and the parts of a divided patch, which reflect the mean of the patch they were cut from.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::light::shares::draw;
use crate::light::{Light, Rgb};
use crate::patches::division::{Part, Parts, Sample, Tree, grow, number};
use crate::patches::grid::{Fragment, Grid, NONE};
use crate::patches::spots::Spots;
use crate::rays::warp::triangle_point;
use crate::rays::{Hit, Ray, Side};
use crate::scene::{Means, Scene};
use crate::surfaces::SurfacePoint;
use crate::surfaces::face_means::FaceMeans;

/// What the area of a patch without chosen points weighs next to those that have some: next to nothing, but more than
/// none.
const UNSEEN: f64 = 1e-6;
/// Rays of a part over those of all in the mean, at least and at most.
const DENSITY: (f32, f32) = (0.5, 8.0);
/// Rays of a patch that no point stands for.
const UNREACHED: f64 = 16.0;

/// How a face's hits find their patch.
#[derive(Clone, Copy, Debug)]
pub enum Owner {
    /// One patch; [`NONE`] where it has none.
    Patch(u32),
    /// The grid of its surface.
    Grid(u32),
}

/// Patches as surfaces were cut into them, which division leaves as they are.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    pub areas: Vec<f64>,
    pub materials: Vec<u32>,
    pub sides: Vec<Side>,
    /// The larger patch that each would be part of at twice the size, by any number.
    pub parents: Vec<u32>,
    /// Fragments of patch i: `starts[i]..starts[i + 1]`.
    pub starts: Vec<u32>,
    pub fragments: Vec<Fragment>,
    pub owners: Vec<Owner>,
    pub grids: Vec<Grid>,
    /// About the size of the largest patches, unit coordinates.
    pub size: f64,
    /// The patch behind a front patch, or NONE.
    pub backs: Vec<u32>,
    /// Front unit normals of the faces.
    pub normals: Arc<[Vec3]>,
    /// What each patch with textures reflects and emits; empty where no material has textures.
    pub means: Vec<Option<Means>>,
}

/// All patches of a scene: a mesh, and the parts that its patches are divided into.
#[derive(Clone, Debug)]
pub struct Patches {
    pub(super) mesh: Arc<Mesh>,
    areas: Vec<f64>,
    materials: Vec<u32>,
    sides: Vec<Side>,
    parents: Vec<u32>,
    /// Points that stand for a patch, from which its rays start; empty where they are uniform over it.
    points: Vec<Vec<SurfacePoint>>,
    /// Patches that are divided further.
    parts: Parts,
    pub(super) spots: Spots,
    /// About how many were requested.
    pub(super) requested: usize,
}

impl Patches {
    /// What every face's hits go by, and the grids.
    pub fn layout(&self) -> (&[Owner], &[Grid]) {
        (&self.mesh.owners, &self.mesh.grids)
    }

    /// The patch on the other side of a front patch, where there is one.
    pub fn behind(&self, front: u32) -> Option<u32> {
        self.mesh.backs.get(front as usize).copied().filter(|&back| back != NONE)
    }

    /// The patches of a mesh, none of them divided.
    pub(super) fn of_mesh(mesh: Arc<Mesh>) -> Patches {
        let Mesh { areas, materials, sides, parents, .. } = &*mesh;
        let (areas, materials, sides, parents) = (areas.clone(), materials.clone(), sides.clone(), parents.clone());
        let (points, parts, spots) = (Vec::new(), Parts::default(), Spots::default());
        Patches { mesh, areas, materials, sides, parents, points, parts, spots, requested: 0 }
    }

    /// About how many were requested when they were cut.
    pub fn requested(&self) -> usize {
        self.requested
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

    /// `A_i` of every patch, m².
    pub fn file_areas(&self, scene: &Scene) -> Vec<f64> {
        let unit = scene.frame.in_metres().powi(2);
        self.areas.iter().map(|a| a * unit).collect()
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

    /// The patch that a point of a face's side belongs to; `None` on the black back of a one-sided face.
    #[inline]
    pub fn at(&self, face: u32, side: Side, position: Vec3) -> Option<u32> {
        let front = match self.mesh.owners[face as usize] {
            Owner::Patch(patch) => patch,
            Owner::Grid(grid) => self.mesh.grids[grid as usize].patch(position),
        };
        let patch = match side {
            Side::Front => front,
            Side::Back => self.mesh.backs[front as usize],
        };
        if patch == NONE {
            return None;
        }
        Some(self.parts.at(patch, position, self.normal(face, side)))
    }

    /// The patch that a ray meets in a crossing; `None` on the black back of a one-sided face.
    #[inline]
    pub fn met(&self, ray: &Ray, hit: &Hit) -> Option<u32> {
        self.at(hit.face, hit.side, ray.at(hit.t))
    }

    /// About the size of the largest patches, unit coordinates.
    pub fn size(&self) -> f64 {
        self.mesh.size
    }

    /// Unit normal of a face's side.
    #[inline]
    pub fn normal(&self, face: u32, side: Side) -> Vec3 {
        let normal = self.mesh.normals[face as usize];
        match side {
            Side::Front => normal,
            Side::Back => -normal,
        }
    }

    /// What a patch counts when the light of several is averaged: its area, or its chosen points where there are any.
    pub fn weights(&self) -> Vec<f64> {
        let chosen = |i: usize| self.chosen(i).len() as f64 + UNSEEN * self.areas[i];
        if self.points.is_empty() { self.areas.clone() } else { (0..self.len()).map(chosen).collect() }
    }

    /// The points that stand for patch i, if some were chosen.
    pub fn chosen(&self, i: usize) -> &[SurfacePoint] {
        self.points.get(i).map_or(&[], |own| own)
    }

    /// The point of patch `i` at (u, v) in the unit square; uniform over the patch, or over its chosen points, for
    /// uniform (u, v).
    pub fn point(&self, i: usize, u: f32, v: f32) -> SurfacePoint {
        let chosen = self.chosen(i);
        if !chosen.is_empty() {
            return chosen[((u * chosen.len() as f32) as usize).min(chosen.len() - 1)];
        }
        self.cut_point(i, u, v)
    }

    /// The point at (u, v) in the unit square of patch `i` as it was cut, chosen points or none; uniform over it for
    /// uniform (u, v).
    pub(crate) fn cut_point(&self, i: usize, u: f32, v: f32) -> SurfacePoint {
        let whole = self.parts.whole(i);
        let own = self.mesh.fragments(whole);
        let drawn = draw(own, |f| f.share, u);
        let Fragment { corners, face, .. } = own[drawn.index];
        let position = triangle_point(corners, drawn.again(), v);
        SurfacePoint { position, normal: self.normal(face, self.sides[i]), face }
    }

    /// The triangles a patch consists of, with the face each is a part of.
    pub fn pieces(&self, i: usize) -> impl Iterator<Item = (u32, [Vec3; 3])> {
        let whole = self.parts.whole(i);
        self.mesh.fragments(whole).iter().map(|f| (f.face, f.corners))
    }

    /// The middle of a patch's area, unit coordinates, and of a sliver too thin to have one that of its corners; of a
    /// patch divided by light the middle of its chosen points.
    pub fn middle(&self, i: usize) -> Vec3 {
        let extent = self.extent(i);
        if extent.width > 0.0 || !self.chosen(i).is_empty() {
            return extent.middle;
        }
        let corners = || self.pieces(i).flat_map(|(_, corners)| corners);
        corners().sum::<Vec3>() / corners().count().max(1) as f32
    }

    /// The unit normal of a patch's side: the mean over its area, and over its triangles where it is too thin to have
    /// one. 0 where that has no direction.
    pub fn mean_normal(&self, i: usize) -> Vec3 {
        let sum = |weight: fn([Vec3; 3]) -> f64| -> DVec3 {
            let normal = |face| self.normal(face, self.side(i)).as_dvec3();
            self.pieces(i).map(|(face, corners)| weight(corners) * normal(face)).sum()
        };
        let by_area = sum(|[a, b, c]| f64::from((b - a).cross(c - a).length()));
        let mean = if by_area == DVec3::ZERO { sum(|_| 1.0) } else { by_area };
        mean.normalize_or_zero().as_vec3()
    }

    /// Whether a patch is a cell of the sky.
    pub fn is_sky(&self, scene: &Scene, i: usize) -> bool {
        scene.is_sky_material(self.materials[i] as usize)
    }

    /// Which side of its faces a patch lies on.
    pub fn side(&self, i: usize) -> Side {
        self.sides[i]
    }
}

/// The points that a patch stands for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Their mean.
    pub middle: Vec3,
    /// Twice their RMS distance to it: 0.82 times the side of a square.
    pub width: f32,
}

/// Sums over points: how much they weigh, and what they and their squares come to.
#[derive(Clone, Copy, Default)]
struct PointSums {
    weight: f64,
    sum: DVec3,
    squares: f64,
}

impl Patches {
    /// Where a patch lies, by its chosen points, or else by its area.
    pub(crate) fn extent(&self, i: usize) -> Extent {
        let chosen = self.chosen(i);
        if chosen.is_empty() {
            return self.cut_extent(i);
        }
        let point = |m: PointSums, point: &SurfacePoint| m.with_point(point.position.as_dvec3());
        chosen.iter().fold(PointSums::default(), point).extent()
    }

    /// Where a patch as it was cut lies, by its area.
    pub(crate) fn cut_extent(&self, i: usize) -> Extent {
        let triangle = |m: PointSums, (_, corners): (u32, [Vec3; 3])| m.with_triangle(corners.map(Vec3::as_dvec3));
        self.pieces(i).fold(PointSums::default(), triangle).extent()
    }
}

impl PointSums {
    fn with_point(self, x: DVec3) -> PointSums {
        PointSums { weight: self.weight + 1.0, sum: self.sum + x, squares: self.squares + x.length_squared() }
    }

    /// With the points of a triangle, which weigh as much as its area: the mean of their squares is a twelfth of the
    /// corners' squares and of the square of the corners' sum.
    fn with_triangle(self, [a, b, c]: [DVec3; 3]) -> PointSums {
        let area = 0.5 * (b - a).cross(c - a).length();
        let corners = a + b + c;
        let squares = [a, b, c, corners].iter().map(|x| x.length_squared()).sum::<f64>() / 12.0;
        PointSums {
            weight: self.weight + area,
            sum: self.sum + area / 3.0 * corners,
            squares: self.squares + area * squares,
        }
    }

    fn extent(self) -> Extent {
        if self.weight == 0.0 {
            return Extent { middle: Vec3::ZERO, width: 0.0 };
        }
        let middle = self.sum / self.weight;
        let spread = (self.squares / self.weight - middle.length_squared()).max(0.0);
        Extent { middle: middle.as_vec3(), width: 2.0 * spread.sqrt() as f32 }
    }
}

/// Share of its area that a patch has at least: one of which there is nothing still has a row of K.
const LEAST_COVERAGE: f64 = 1e-6;

impl Mesh {
    /// The pieces of patch i.
    fn fragments(&self, i: usize) -> &[Fragment] {
        &self.fragments[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// Finds the means of all patches, and takes what is cut away from their areas; nothing where no material has
    /// textures.
    pub(super) fn take_textures(&mut self, scene: &Scene, of_faces: &FaceMeans) {
        if !scene.is_textured() {
            return;
        }
        let own = |i: usize| {
            let of_piece = |&Fragment { face, corners: [a, b, c], .. }: &Fragment| {
                let whole = of_faces.whole(face).filter(|_| scene.corners(face) == [a, b, c]);
                let means = whole.copied().unwrap_or_else(|| scene.means(face, [a, b, c]));
                (f64::from((b - a).cross(c - a).length()), means)
            };
            mean(&self.fragments(i).iter().map(of_piece).collect::<Vec<_>>())
        };
        let textured = |i: &usize| scene.materials[self.materials[*i] as usize].maps.is_some();
        let found: Vec<Option<Means>> =
            (0..self.areas.len()).into_par_iter().map(|i| textured(&i).then(|| own(i)).flatten()).collect();
        for (area, means) in self.areas.iter_mut().zip(&found) {
            *area *= means.map_or(1.0, |means| means.coverage.max(LEAST_COVERAGE));
        }
        self.means = found;
    }
}

impl Patches {
    fn mean(&self, i: usize) -> Option<&Means> {
        self.mesh.means.get(self.parts.whole(i))?.as_ref()
    }

    /// Mean reflectance of patch i.
    pub fn reflectance(&self, scene: &Scene, i: usize) -> Rgb {
        self.mean(i).map_or_else(|| scene.materials[self.materials[i] as usize].rho, |means| means.of_surface().0)
    }

    /// Reflectance over the mean of patch i, channel by channel; 1 where the patch has no texture or reflects nothing.
    pub(crate) fn over_mean(&self, i: usize, rho: Rgb) -> Rgb {
        let Some(means) = self.mean(i) else { return Rgb::ONE };
        let mean = means.of_surface().0;
        Rgb::select(mean.cmpgt(Rgb::ZERO), rho / mean.max(Rgb::splat(f32::MIN_POSITIVE)), Rgb::ONE)
    }

    /// Mean emission of patch i: `(E_invisible, E_visible)`, W/(m² sr).
    pub fn emitted(&self, scene: &Scene, i: usize) -> Light {
        let material = &scene.materials[self.materials[i] as usize];
        let textured = |means: &Means| Light::emitted(means.of_surface().1, material.visibility);
        self.mean(i).map_or_else(|| material.emitted(), textured)
    }
}

/// The mean over pieces by their areas; none of no piece.
///
/// Pieces so thin that rounding leaves none of them an area count alike.
fn mean(pieces: &[(f64, Means)]) -> Option<Means> {
    let area: f64 = pieces.iter().map(|piece| piece.0).sum();
    let weight = |own: f64| if area > 0.0 { own } else { 1.0 };
    let (mut sum, mut mean) = (Means::default(), Means::default());
    pieces.iter().for_each(|(own, means)| sum.add(weight(*own), means));
    mean.add(1.0 / if area > 0.0 { area } else { pieces.len() as f64 }, &sum);
    (!pieces.is_empty()).then_some(mean)
}

impl Patches {
    /// Whether patches were divided by light.
    pub fn are_divided(&self) -> bool {
        self.parts.count > 0
    }

    /// The patch that a patch is a part of; itself where it was not divided.
    pub fn whole(&self, patch: u32) -> u32 {
        self.parts.whole(patch as usize) as u32
    }

    /// The mesh divided anew by the light sampled on it: rays of the parts start from where it was sampled; `samples`
    /// are those of every patch of the mesh. A patch that a spot cuts stays whole, as samples miss what the spot holds.
    pub fn divided(&self, mut samples: Vec<Vec<Sample>>) -> Patches {
        let Mesh { areas, materials, sides, parents, .. } = &*self.mesh;
        let count = areas.len();
        samples.resize_with(count, Vec::new);
        (0..count).filter(|&i| !self.strata(i).is_empty()).for_each(|i| samples[i].clear());
        let trees: Vec<Tree> = samples.into_par_iter().map(grow).collect();
        let mut all = Patches {
            points: vec![Vec::new(); count],
            parts: Parts { roots: vec![NONE; count], count, ..Parts::default() },
            requested: self.requested,
            spots: self.spots.clone(),
            ..Patches::of_mesh(Arc::clone(&self.mesh))
        };
        let mut planes = Vec::new();
        for (i, tree) in trees.into_iter().enumerate() {
            let total = tree.count();
            let mut is_first = true;
            let mut add = |own: Vec<Sample>| {
                let share = areas[i] * own.len() as f64 / total.max(1) as f64;
                let points = own.iter().map(|s| s.point).collect();
                if std::mem::take(&mut is_first) {
                    all.points[i] = points;
                    all.areas[i] = if total > 0 { share } else { areas[i] };
                    return i as u32;
                }
                all.points.push(points);
                all.parts.whole.push(i as u32);
                all.areas.push(share);
                all.materials.push(materials[i]);
                all.sides.push(sides[i]);
                all.parents.push(parents[i]);
                all.areas.len() as u32 - 1
            };
            if let Part::Divided(root) = number(tree, &mut planes, &mut add) {
                all.parts.roots[i] = root;
            }
        }
        all.parts.planes = planes;
        all
    }

    /// Rays of each patch where `rays` are requested of all in the mean: in proportion to the points that stand for a
    /// part, within limits, and few where there are none.
    pub fn ray_counts(&self, rays: u32) -> Vec<u32> {
        if !self.are_divided() {
            return vec![rays; self.len()];
        }
        let few = (UNREACHED / f64::from(rays)).min(1.0) as f32;
        let reached: Vec<f32> = self.points.iter().map(|own| own.len() as f32).collect();
        let count = reached.iter().filter(|&&n| n > 0.0).count().max(1);
        let mean = reached.iter().sum::<f32>() / count as f32;
        let density = |(i, &n): (usize, &f32)| match n {
            _ if !self.strata(i).is_empty() => 1.0,
            0.0 => few,
            n => (n / mean).clamp(DENSITY.0, DENSITY.1),
        };
        reached.iter().enumerate().map(|own| (rays as f32 * density(own)).ceil() as u32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Rays;

    /// A cell of a cube's wall is a square; its points chosen anew at its corners lie further apart.
    #[test]
    fn a_square_is_as_wide_as_its_points_lie_apart() {
        let scene = Scene::open("furnace").expect("a scene");
        let mut patches = Patches::new(&scene, &Rays::new(&scene), 24);
        let side = patches.areas()[0].sqrt();
        let whole = patches.extent(0);
        assert!((f64::from(whole.width) / side - 2.0 * 6.0_f64.sqrt().recip()).abs() < 1e-5, "{whole:?}");
        let ends = [0.0, 0.999_999].map(|u| patches.point(0, 0.0, u));
        let apart = ends[0].position.distance(ends[1].position);
        patches.points = vec![ends.to_vec()];
        let chosen = patches.extent(0);
        assert!((chosen.width - apart).abs() < 1e-5, "{chosen:?} {apart}");
        assert!(chosen.middle.distance(0.5 * (ends[0].position + ends[1].position)) < 1e-5);
    }

    /// A patch whose pieces rounding leaves without an area reflects a number all the same.
    #[test]
    fn pieces_without_an_area_have_a_mean() {
        let means = |rho: f64| Means { coverage: 1.0, rho: DVec3::splat(rho), emission: DVec3::ZERO };
        let of = |pieces: &[(f64, Means)]| mean(pieces).map(|mean| mean.rho.x);
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[(0.0, means(0.5)), (0.0, means(0.25))]), Some(0.375));
        assert_eq!(of(&[(3.0, means(0.5)), (1.0, means(0.25)), (0.0, means(0.0))]), Some(0.4375));
    }
}
