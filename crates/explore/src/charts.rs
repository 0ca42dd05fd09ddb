//! Charts: the flat pieces of surface that carry light in the page, cell by cell, and texel by texel.
//!
//! A grid of patches is a chart, whose cells have the light of their patches. Every cell has [`Charts::fine`] by as
//! many texels for direct light, whose shadows are sharper than patches. Light is bilinear between the middles of
//! cells, and of texels, and stays within its chart. A cluster of small faces is a chart too, without a place in a
//! plane: every face has a texel of its own, and the faces of a cell what they receive together
//! ([`crate::cell_rows`]).
//!
//! Where the page's picture needs it ([`crate::finer`]), cells are smaller than patches, and faces of clusters have
//! charts in their plane; those cells too have what they receive from their own points.
//!
//! The back of a two-sided surface is a chart of its own. Not handled: which light there is.

use glam::{Vec2, Vec3};

use crate::finer::{Finer, Plane};
use halflight::light::Rgb;
use halflight::patches::Owner;
use halflight::patches::Patches;
use halflight::patches::grid::{NONE, index};
use halflight::rays::Side;
use halflight::scene::Scene;
use halflight::surfaces::SurfacePoint;

/// Texels of a cluster at most, which the page keeps in 12 bits; more faces share them.
const SLOTS: usize = 4080;
/// Texels of all clusters, about: one for each of as many faces.
const MOST_SLOTS: usize = 300_000;
/// Paths that come to a chart, if it is where paths come, for none of them to be no chance.
const EXPECTED: f64 = 20.0;
/// How far from the middle of a texel the surface may lie for the texel to have light of its own, in texels.
const NEAR: f32 = 1.5;
/// How far points on an edge are moved towards the middle of their triangle.
const INWARD: f32 = 1e-3;

/// What a chart is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Source {
    /// A grid of patches, by number.
    Grid(usize),
    /// Small faces that share a patch, without a place in a plane.
    Cluster(u32),
    /// Some of those that lie in one plane, by number.
    Plane(usize),
}

/// A piece of surface, seen from one side.
pub(super) struct Chart {
    pub source: Source,
    /// Cells to a side of a patch.
    pub finer: usize,
    pub columns: usize,
    pub rows: usize,
    /// A point x lies at `(p (x - o), q (x - o))` in cells; `[p, q]` are 0 for a cluster of small faces.
    pub origin: Vec3,
    pub per_cell: [Vec3; 2],
    pub material: u32,
    /// Its faces; none of a back, which has those of its front.
    pub faces: Vec<u32>,
    /// The chart of the front, where this is a back.
    pub front: Option<usize>,
    /// Number of its first cell.
    pub first: usize,
}

impl Chart {
    /// Whether it is a grid, and not a cluster of small faces.
    pub fn is_grid(&self) -> bool {
        !matches!(self.source, Source::Cluster(_))
    }

    /// Whether its cells have rows of F of their own.
    fn is_gathered(&self) -> bool {
        self.finer > 1 || !matches!(self.source, Source::Grid(_))
    }

    /// Where a point lies, in cells.
    fn place(&self, x: Vec3) -> Vec2 {
        Vec2::from(self.per_cell.map(|axis| axis.dot(x - self.origin)))
    }

    /// The point at a place in cells.
    fn point(&self, at: Vec2) -> Vec3 {
        let [u, v] = self.per_cell.map(|axis| axis / axis.length_squared());
        self.origin + at.x * u + at.y * v
    }

    fn cells(&self) -> usize {
        self.columns * self.rows
    }
}

/// What a value is read from: numbers of cells or texels, and their weights.
pub(super) type Taps = [(usize, f32); 4];

/// All charts of a scene's patches.
pub(super) struct Charts {
    pub list: Vec<Chart>,
    /// Texels of direct light to a side of a cell.
    pub fine: usize,
    /// The patches that light each cell, with weights that add up to 1.
    pub cells: Vec<Vec<(u32, f32)>>,
    /// The patch that each cell belongs to.
    pub patches: Vec<u32>,
    /// Of each face the chart of its front and of its back.
    of_face: Vec<[Option<usize>; 2]>,
    /// Of each face of a cluster the texel that it reads.
    pub slots: Vec<u16>,
}

impl Charts {
    /// Points of a texel of small faces at most.
    pub const POINTS: usize = 8;

    /// The charts of patches that are not divided by light.
    pub fn new(scene: &Scene, patches: &Patches, fine: usize, finer: &Finer) -> Charts {
        let (owners, grids) = patches.layout();
        let solid = scene.solid_faces() as usize;
        let mut charts = Charts {
            list: Vec::new(),
            fine,
            cells: Vec::new(),
            patches: Vec::new(),
            of_face: vec![[None; 2]; scene.faces.len()],
            slots: vec![0; scene.faces.len()],
        };
        let mut of_grids: Vec<Vec<u32>> = vec![Vec::new(); grids.len()];
        let mut of_patches: Vec<Vec<u32>> = vec![Vec::new(); patches.len()];
        let mut is_in_plane = vec![false; scene.faces.len()];
        finer.planes.iter().flat_map(|plane| &plane.faces).for_each(|&face| is_in_plane[face as usize] = true);
        for (face, owner) in (0..).zip(&owners[..solid]) {
            match owner {
                Owner::Grid(grid) => of_grids[*grid as usize].push(face),
                Owner::Patch(patch) if *patch != NONE && !is_in_plane[face as usize] => {
                    of_patches[*patch as usize].push(face)
                }
                Owner::Patch(_) => {}
            }
        }
        for (number, (grid, faces)) in grids.iter().zip(of_grids).enumerate() {
            let finer = finer.grids.get(&number).copied().unwrap_or(1);
            let material = patches.materials()[grid.cells[0].patches()[0] as usize];
            let [columns, rows] = [grid.columns, grid.rows].map(|count| finer * count);
            let per_cell = grid.per_cell.map(|axis| finer as f32 * axis);
            let (source, origin, first) = (Source::Grid(number), grid.origin, charts.cells.len());
            charts.enter(Chart { source, finer, columns, rows, origin, per_cell, material, faces, front: None, first });
            let of = |k: usize| &grid.cells[k / columns / finer * grid.columns + k % columns / finer];
            charts.add_cells((0..columns * rows).map(|k| weighted(of(k).patches().to_vec(), patches)));
        }
        finer.planes.iter().enumerate().for_each(|plane| charts.enter_plane(plane, patches));
        let share = (MOST_SLOTS as f64 / of_patches.iter().map(Vec::len).sum::<usize>().max(1) as f64).min(1.0);
        for (patch, faces) in of_patches.into_iter().enumerate().filter(|(_, faces)| !faces.is_empty()) {
            let slots = (share * faces.len() as f64).ceil() as usize;
            charts.enter_cluster(scene, patches, (patch as u32, slots), faces);
        }
        charts.enter_backs(patches);
        charts
    }

    /// Adds a chart, without its cells.
    fn enter(&mut self, chart: Chart) {
        let side = usize::from(chart.front.is_some());
        let faces = chart.front.map_or(&chart.faces, |front| &self.list[front].faces);
        faces.iter().for_each(|&face| self.of_face[face as usize][side] = Some(self.list.len()));
        self.list.push(chart);
    }

    fn add_cells(&mut self, cells: impl Iterator<Item = Vec<(u32, f32)>>) {
        for own in cells {
            let largest = own.iter().max_by(|a, b| a.1.total_cmp(&b.1));
            self.patches.push(largest.map_or(0, |(patch, _)| *patch));
            self.cells.push(own);
        }
    }

    /// Adds the chart of small faces in a plane.
    fn enter_plane(&mut self, (number, plane): (usize, &Plane), patches: &Patches) {
        let Plane { patch, origin, columns, rows, .. } = *plane;
        let counts = [columns, rows].map(|count| count as f32);
        let per_cell = [0, 1].map(|k| counts[k] * plane.sides[k] / plane.sides[k].length_squared());
        let (material, faces) = (patches.materials()[patch as usize], plane.faces.clone());
        let (source, finer, first) = (Source::Plane(number), 1, self.cells.len());
        self.enter(Chart { source, finer, columns, rows, origin, per_cell, material, faces, front: None, first });
        self.add_cells((0..columns * rows).map(|_| vec![(patch, 1.0)]));
    }

    /// Adds the chart of small faces that share a patch and about so many texels: next to one another in space, as many
    /// texels to a cell as it has.
    fn enter_cluster(&mut self, scene: &Scene, patches: &Patches, (patch, slots): (u32, usize), mut faces: Vec<u32>) {
        faces.sort_by_cached_key(|&face| along_curve(scene.corners(face).into_iter().sum::<Vec3>() / 3.0));
        let block = self.fine * self.fine;
        let columns = slots.min(SLOTS).div_ceil(block);
        let slots = faces.len().min(columns * block);
        for (k, &face) in faces.iter().enumerate() {
            self.slots[face as usize] = self.texel_of_slot(columns, k * slots / faces.len()) as u16;
        }
        let material = patches.materials()[patch as usize];
        let (source, origin, per_cell) = (Source::Cluster(patch), Vec3::ZERO, [Vec3::ZERO; 2]);
        let (finer, first) = (1, self.cells.len());
        self.enter(Chart { source, finer, columns, rows: 1, origin, per_cell, material, faces, front: None, first });
        self.add_cells((0..columns).map(|_| vec![(patch, 1.0)]));
    }

    /// The texel, row by row of a chart of one row of cells, that is number k cell by cell.
    fn texel_of_slot(&self, columns: usize, k: usize) -> usize {
        let (s, cell, within) = (self.fine, k / (self.fine * self.fine), k % (self.fine * self.fine));
        within / s * s * columns + s * cell + within % s
    }

    /// The cells that have rows of F of their own.
    pub fn gathered_cells(&self) -> impl Iterator<Item = usize> {
        let gathered = self.list.iter().filter(|chart| chart.is_gathered());
        gathered.flat_map(|chart| chart.first..chart.first + chart.cells())
    }

    /// The chart of a side of a face; none of a black back.
    pub fn of(&self, face: u32, side: Side) -> Option<usize> {
        self.of_face[face as usize][usize::from(side == Side::Back)]
    }

    /// The front of a chart: itself unless it is a back.
    pub fn front(&self, chart: usize) -> usize {
        self.list[chart].front.unwrap_or(chart)
    }

    /// The texels of a cell.
    pub fn texels_of(&self, cell: usize) -> impl Iterator<Item = usize> {
        let chart = &self.list[self.list.partition_point(|chart| chart.first <= cell) - 1];
        let (s, k) = (self.fine, cell - chart.first);
        let (column, row, width) = (k % chart.columns.max(1), k / chart.columns.max(1), s * chart.columns);
        let first = chart.first * s * s + row * s * width + column * s;
        (0..s * s).map(move |i| first + i / s * width + i % s)
    }

    /// Adds the backs of two-sided surfaces.
    fn enter_backs(&mut self, patches: &Patches) {
        for front in 0..self.list.len() {
            let Chart { source, finer, columns, rows, origin, per_cell, material, first, .. } = self.list[front];
            let behind = |k: usize| -> Vec<u32> {
                self.cells[first + k].iter().filter_map(|(patch, _)| patches.behind(*patch)).collect()
            };
            let own: Vec<Vec<u32>> = (0..columns * rows).map(behind).collect();
            if own.iter().any(Vec::is_empty) {
                continue;
            }
            let (faces, front, first) = (Vec::new(), Some(front), self.cells.len());
            self.enter(Chart { source, finer, columns, rows, origin, per_cell, material, faces, front, first });
            self.add_cells(own.into_iter().map(|own| weighted(own, patches)));
        }
    }

    /// These charts without light on those that no path reaches, which are black then; and the texels that are left. A
    /// chart so small that [`EXPECTED`] paths would not come to it by its area is kept.
    pub fn kept(mut self, scene: &Scene, counts: &[u32]) -> (Charts, Vec<usize>) {
        let block = self.fine * self.fine;
        let area = |k: usize| -> f64 {
            let Chart { faces, front, .. } = &self.list[k];
            let faces = front.map_or(faces, |front| &self.list[front].faces);
            faces.iter().map(|&face| scene.area(face)).sum()
        };
        let count = |k: usize| -> u32 {
            let Chart { first, .. } = self.list[k];
            counts[first * block..(first + self.list[k].cells()) * block].iter().sum()
        };
        let found: Vec<(f64, u32)> = (0..self.list.len()).map(|k| (area(k), count(k))).collect();
        let all = found.iter().filter(|(_, count)| *count > 0);
        let (reached, paths) = all.fold((0.0, 0.0), |sum, (area, count)| (sum.0 + area, sum.1 + f64::from(*count)));
        let (mut cells, mut patches, mut left) = (Vec::new(), Vec::new(), Vec::new());
        let mut numbers = vec![None; self.list.len()];
        for (number, chart) in self.list.iter_mut().enumerate() {
            let (own, first) = (chart.first..chart.first + chart.cells(), cells.len());
            let texels = own.start * block..own.end * block;
            let (area, count) = found[number];
            if count > 0 || paths * area < EXPECTED * reached {
                cells.extend(self.cells[own.clone()].iter().cloned());
                patches.extend(&self.patches[own]);
                left.extend(texels);
                numbers[number] = Some(number);
            } else {
                (chart.columns, chart.rows) = (0, 0);
            }
            chart.first = first;
        }
        let of_face =
            self.of_face.iter().map(|sides| sides.map(|chart| chart.and_then(|chart| numbers[chart]))).collect();
        (Charts { cells, patches, of_face, ..self }, left)
    }

    /// Number of texels.
    pub fn texels(&self) -> usize {
        self.cells.len() * self.fine * self.fine
    }

    /// Which side of its faces a chart is.
    pub fn side(&self, chart: usize) -> Side {
        if self.list[chart].front.is_some() { Side::Back } else { Side::Front }
    }

    /// Adds light of cells to the texels, bilinear between the cells of a grid.
    pub fn add_to_texels(&self, cells: &[Rgb], texels: &mut [Rgb]) {
        let s = self.fine;
        for chart in self.list.iter().filter(|chart| chart.cells() > 0) {
            let (first, size) = (chart.first * s * s, [chart.columns, chart.rows]);
            for k in 0..chart.cells() * s * s {
                let at = Vec2::new((k % (s * size[0])) as f32 + 0.5, (k / (s * size[0])) as f32 + 0.5) / s as f32;
                let at = if chart.is_grid() { at } else { at.floor() + 0.5 };
                let read = |(j, weight): (usize, f32)| weight * cells[chart.first + j];
                texels[first + k] += bilinear(at, size).map(read).into_iter().sum::<Rgb>();
            }
        }
    }

    /// What a point of a face reads: cells, and texels; none on the black back of a one-sided face.
    pub fn taps(&self, face: u32, side: Side, x: Vec3) -> Option<[Taps; 2]> {
        let number = self.of(face, side)?;
        let chart = &self.list[number];
        let texels = chart.first * self.fine * self.fine;
        if !chart.is_grid() {
            let alone = |k: usize| [(k, 1.0), (k, 0.0), (k, 0.0), (k, 0.0)];
            let slot = usize::from(self.slots[face as usize]);
            let cell = slot % (self.fine * chart.columns) / self.fine;
            return Some([alone(chart.first + cell), alone(texels + slot)]);
        }
        let at = chart.place(x);
        let s = self.fine;
        let coarse = bilinear(at, [chart.columns, chart.rows]).map(|(k, weight)| (chart.first + k, weight));
        let fine = bilinear(s as f32 * at, [s * chart.columns, s * chart.rows]);
        Some([coarse, fine.map(|(k, weight)| (texels + k, weight))])
    }

    /// The texel that a point of a face lies in; none on the black back of a one-sided face.
    pub fn texel(&self, face: u32, side: Side, x: Vec3) -> Option<usize> {
        let number = self.of(face, side)?;
        let (chart, s) = (&self.list[number], self.fine);
        let first = chart.first * s * s;
        if !chart.is_grid() {
            return Some(first + usize::from(self.slots[face as usize]));
        }
        let at = s as f32 * chart.place(x);
        let [column, row] = [index(at.x, s * chart.columns), index(at.y, s * chart.rows)];
        Some(first + row * s * chart.columns + column)
    }

    /// Whether a texel is one of a grid.
    pub fn is_of_grid(&self, texel: usize) -> bool {
        let cell = texel / (self.fine * self.fine);
        let chart = self.list.partition_point(|chart| chart.first <= cell) - 1;
        self.list[chart].is_grid()
    }

    /// The points of each texel from which direct light is measured, with their patches; none where there is no
    /// surface.
    pub fn places(&self, scene: &Scene, patches: &Patches) -> Vec<Vec<(SurfacePoint, u32)>> {
        let mut places = vec![Vec::new(); self.texels()];
        for number in 0..self.list.len() {
            let chart = &self.list[number];
            let own = &mut places[chart.first * self.fine * self.fine..][..chart.cells() * self.fine * self.fine];
            if chart.is_grid() {
                self.places_of_grid(number, (scene, patches), own);
            } else {
                self.places_of_faces(number, patches, own);
            }
        }
        places
    }

    fn places_of_grid(
        &self,
        number: usize,
        (scene, patches): (&Scene, &Patches),
        places: &mut [Vec<(SurfacePoint, u32)>],
    ) {
        let (s, chart, side) = (self.fine, &self.list[number], self.side(number));
        let texel = chart.per_cell.map(|axis| axis.length().recip()).into_iter().fold(0.0, f32::max) / s as f32;
        let faces = &self.list[self.front(number)].faces;
        for cell in 0..chart.cells() {
            let own: Vec<Piece> = match chart.source {
                Source::Grid(_) => pieces(patches, &self.cells[chart.first + cell]).collect(),
                _ => faces.iter().map(|&face| (self.patches[chart.first], face, scene.corners(face))).collect(),
            };
            for k in 0..s * s {
                let (column, row) = (cell % chart.columns * s + k % s, cell / chart.columns * s + k / s);
                let middle = Vec2::new(column as f32 + 0.5, row as f32 + 0.5) / s as f32;
                let found = nearest((patches, side), &own, chart.point(middle));
                let found = found.filter(|(_, apart)| *apart <= NEAR * texel);
                places[row * s * chart.columns + column].extend(found.map(|(place, _)| place));
            }
        }
    }

    fn places_of_faces(&self, number: usize, patches: &Patches, places: &mut [Vec<(SurfacePoint, u32)>]) {
        let (chart, side) = (&self.list[number], self.side(number));
        let patch = self.patches[chart.first];
        let is_own = |face: u32| self.of(face, side) == Some(number);
        for (face, corners) in patches.pieces(patch as usize).filter(|piece| is_own(piece.0)) {
            let own = &mut places[usize::from(self.slots[face as usize])];
            if own.len() < Charts::POINTS {
                let position = corners.into_iter().sum::<Vec3>() / 3.0;
                own.push((SurfacePoint { position, normal: patches.normal(face, side), face }, patch));
            }
        }
    }

    /// For cells and texels that have no light of their own those next to them whose mean they take, so that what is
    /// hidden does not darken what is seen beside it: in the order in which they are to be filled.
    pub fn fills(&self, scale: usize, is_own: &[bool], passes: usize) -> Vec<(usize, Vec<usize>)> {
        let (mut known, mut fills) = (is_own.to_vec(), Vec::new());
        for _ in 0..passes {
            let before = fills.len();
            for chart in self.list.iter().filter(|chart| chart.is_grid()) {
                let size = [scale * chart.columns, scale * chart.rows];
                let first = chart.first * scale * scale;
                for k in (0..size[0] * size[1]).filter(|k| !known[first + k]) {
                    let own: Vec<usize> = around(k, size).map(|j| first + j).filter(|&j| known[j]).collect();
                    if !own.is_empty() {
                        fills.push((first + k, own));
                    }
                }
            }
            fills[before..].iter().for_each(|(k, _)| known[*k] = true);
        }
        fills
    }
}

/// Patches with weights by area, which add up to 1.
fn weighted(mut own: Vec<u32>, patches: &Patches) -> Vec<(u32, f32)> {
    own.retain(|patch| *patch != NONE);
    own.sort_unstable();
    own.dedup();
    let all: f64 = own.iter().map(|&patch| patches.areas()[patch as usize]).sum();
    let share = |patch: u32| if all > 0.0 { patches.areas()[patch as usize] / all } else { 1.0 / own.len() as f64 };
    own.iter().map(|&patch| (patch, share(patch) as f32)).collect()
}

/// The four around a place, whose middles lie at half integers; those at the rim stand for what is beyond.
fn bilinear(at: Vec2, [columns, rows]: [usize; 2]) -> Taps {
    let low = Vec2::splat(0.5);
    let at = at.clamp(low, (Vec2::new(columns as f32, rows as f32) - 0.5).max(low)) - 0.5;
    let cell = at.floor();
    let share = at - cell;
    let (column, row) = (cell.x as usize, cell.y as usize);
    let number = |right: usize, below: usize| (row + below).min(rows - 1) * columns + (column + right).min(columns - 1);
    [
        (number(0, 0), (1.0 - share.x) * (1.0 - share.y)),
        (number(1, 0), share.x * (1.0 - share.y)),
        (number(0, 1), (1.0 - share.x) * share.y),
        (number(1, 1), share.x * share.y),
    ]
}

/// The up to eight around number k of a grid.
fn around(k: usize, [columns, rows]: [usize; 2]) -> impl Iterator<Item = usize> {
    let (column, row) = (k % columns, k / columns);
    let (across, down) =
        (column.saturating_sub(1)..(column + 2).min(columns), row.saturating_sub(1)..(row + 2).min(rows));
    down.flat_map(move |y| across.clone().map(move |x| y * columns + x)).filter(move |&j| j != k)
}

/// A triangle of a patch: of which, of which face, and its corners.
type Piece = (u32, u32, [Vec3; 3]);

/// The triangles of some patches.
fn pieces(patches: &Patches, own: &[(u32, f32)]) -> impl Iterator<Item = Piece> {
    own.iter().flat_map(|&(patch, _)| patches.pieces(patch as usize).map(move |(face, corners)| (patch, face, corners)))
}

/// The point of some triangles nearest to x, and how far away it is.
fn nearest((patches, side): (&Patches, Side), own: &[Piece], x: Vec3) -> Option<((SurfacePoint, u32), f32)> {
    let one = |&(patch, face, corners): &Piece| {
        let position = nearest_of_triangle(corners, x);
        let apart = position.distance(x);
        let middle = corners.into_iter().sum::<Vec3>() / 3.0;
        let position = position.lerp(middle, INWARD);
        ((SurfacePoint { position, normal: patches.normal(face, side), face }, patch), apart)
    };
    own.iter().map(one).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The point of a triangle nearest to a point of its plane: that point, or the nearest of its edges.
fn nearest_of_triangle(corners: [Vec3; 3], x: Vec3) -> Vec3 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let is_inside = [(a, b), (b, c), (c, a)].into_iter().all(|(p, q)| (q - p).cross(x - p).dot(normal) >= 0.0);
    if is_inside && normal != Vec3::ZERO {
        return x;
    }
    let of_edge = |(p, q): (Vec3, Vec3)| {
        let along = (x - p).dot(q - p) / (q - p).length_squared().max(f32::MIN_POSITIVE);
        p.lerp(q, along.clamp(0.0, 1.0))
    };
    let edges = [(a, b), (b, c), (c, a)].map(of_edge);
    edges.into_iter().min_by(|p, q| p.distance(x).total_cmp(&q.distance(x))).unwrap_or(a)
}

/// Where a point of unit coordinates comes on a curve through all of space that keeps neighbours together (G. Morton
/// 1966): the bits of its coordinates, in turn.
fn along_curve(x: Vec3) -> u32 {
    let cells = x.to_array().map(|x| ((x + 1.0) * 512.0).clamp(0.0, 1023.0) as u32);
    (0..10).fold(0, |code, bit| (0..3).fold(code, |code, axis| code | (cells[axis] >> bit & 1) << (3 * bit + axis)))
}
