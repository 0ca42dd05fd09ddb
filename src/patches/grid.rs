//! A rectangular grid of patches on one surface, cut further where other faces touch it.
//!
//! Each face is clipped against the cells it overlaps.
//! Cells that the surface fills by less than a quarter join their fullest neighbour; cells it does not touch point to
//! a patch nearby, so that a hit rounded over the rim still finds its patch. A cell crossed by lines of contact has a
//! patch for each side of them.
//!
//! Not handled: contacts beyond the fourth in a cell; their sides share patches.

use std::collections::{BTreeMap, VecDeque};

use glam::{DVec2, Vec2, Vec3};

use crate::scene::Scene;
use crate::scene::convex_polygon::{clip, half_plane};
use crate::surfaces::coplanar::Surface;

/// Finds a patch from a point's (u, v).
#[derive(Clone, Debug)]
pub struct Grid {
    /// The corner that u and v are measured from.
    pub origin: Vec3,
    /// u and v axes divided by the cell's width and height.
    pub per_cell: [Vec3; 2],
    /// Cells along u.
    pub columns: usize,
    /// Cells along v.
    pub rows: usize,
    /// Row by row.
    pub cells: Vec<Cell>,
}

/// What one cell of the grid points to.
#[derive(Clone, Debug)]
pub enum Cell {
    /// One patch.
    Patch(u32),
    /// Patches on the sides of lines that cross it.
    Cut(Box<Cut>),
}

/// A cell crossed by lines: bit k of the index into `patches` is the side of line k.
#[derive(Clone, Debug)]
pub struct Cut {
    lines: Vec<Line>,
    patches: Vec<u32>,
}

impl Cell {
    /// The patches that lie in it, a patch once or several times.
    pub fn patches(&self) -> &[u32] {
        match self {
            Cell::Patch(patch) => std::slice::from_ref(patch),
            Cell::Cut(cut) => &cut.patches,
        }
    }
}

/// Lines that cut one cell at most; a fifth is left out.
const MOST_LINES: usize = 4;

impl Grid {
    /// The patch of the cell that the point lies in.
    #[inline]
    pub fn patch(&self, position: Vec3) -> u32 {
        let (cell, at) = self.locate(position);
        match cell {
            Cell::Patch(patch) => *patch,
            Cell::Cut(cut) => cut.patches[side_bits(&cut.lines, at)],
        }
    }

    /// Numbers the patches from another on.
    pub(crate) fn number_from(&mut self, first: u32) {
        for cell in &mut self.cells {
            match cell {
                Cell::Patch(patch) => *patch += first,
                Cell::Cut(cut) => cut.patches.iter_mut().for_each(|p| *p += first),
            }
        }
    }

    /// The cell that the point lies in, and the point in units of cells.
    #[inline]
    fn locate(&self, position: Vec3) -> (&Cell, Vec2) {
        let d = position - self.origin;
        let at = Vec2::new(d.dot(self.per_cell[0]), d.dot(self.per_cell[1]));
        let (column, row) = (index(at.x, self.columns), index(at.y, self.rows));
        (&self.cells[row * self.columns + column], at)
    }
}

/// The cell of n along an axis that holds a coordinate; points rounded over the rim stay inside.
#[inline]
pub fn index(x: f32, n: usize) -> usize {
    // Casts to i32 are one instruction, to usize some ten.
    ((x as i32).max(0) as usize).min(n - 1)
}

/// The pieces of one cell, by the side of the cell's lines they lie on.
#[derive(Default)]
struct CellPieces {
    lines: Vec<Line>,
    parts: BTreeMap<usize, Vec<Piece>>,
}

impl CellPieces {
    fn area(&self) -> f64 {
        self.parts.values().flatten().map(|p| p.area).sum()
    }
}

impl Grid {
    /// Cuts a surface into cells of about a size, and along `contacts`; patches are numbered from 0. None where the
    /// surface is too thin for any.
    pub(crate) fn cut(scene: &Scene, s: &Surface, contacts: &[[DVec2; 2]], size: f64) -> Option<(Grid, Vec<Draft>)> {
        let [columns, rows] = s.divisions(size);
        let cell = DVec2::from(s.extent) / DVec2::new(columns as f64, rows as f64);
        let shape = Shape { columns, rows, cell };
        let mut cells: Vec<CellPieces> = Vec::new();
        cells.resize_with(columns * rows, CellPieces::default);
        contacts.iter().for_each(|contact| shape.draw(contact, &mut cells));
        s.faces.iter().for_each(|&face| shape.clip_face(scene, s, face, &mut cells));
        if cells.iter().all(|c| c.parts.is_empty()) {
            return None;
        }
        let targets = shape.assign(&cells);
        let (cells, drafts) = number(s, cells, &targets);
        let axis = |k: usize, length: f64| (s.axes[k] / length).as_vec3();
        let grid = Grid {
            origin: s.origin.as_vec3(),
            per_cell: [axis(0, shape.cell.x), axis(1, shape.cell.y)],
            columns,
            rows,
            cells,
        };
        Some((grid, drafts))
    }
}

/// Makes a draft of every part that is its own target, and points the other cells to theirs.
fn number(s: &Surface, mut cells: Vec<CellPieces>, targets: &[usize]) -> (Vec<Cell>, Vec<Draft>) {
    let mut drafts: Vec<Draft> = Vec::new();
    let draft = |pieces: Vec<Piece>, drafts: &mut Vec<Draft>| {
        drafts.push(Draft { material: s.material, pieces });
        drafts.len() as u32 - 1
    };
    let mut found: Vec<Cell> = vec![Cell::Patch(NONE); cells.len()];
    for k in 0..cells.len() {
        if targets[k] != k {
            continue;
        }
        let CellPieces { lines, parts } = std::mem::take(&mut cells[k]);
        found[k] = if lines.is_empty() {
            let pieces = parts.into_values().flatten().collect();
            Cell::Patch(draft(pieces, &mut drafts))
        } else {
            let mut patches = vec![NONE; 1 << lines.len()];
            for (bits, pieces) in parts {
                patches[bits] = draft(pieces, &mut drafts);
            }
            fill(&mut patches);
            Cell::Cut(Box::new(Cut { lines, patches }))
        };
    }
    for k in 0..cells.len() {
        if targets[k] != k {
            found[k] = found[targets[k]].clone();
            if let Cell::Patch(patch) = found[k] {
                let pieces = std::mem::take(&mut cells[k].parts).into_values().flatten();
                drafts[patch as usize].pieces.extend(pieces);
            }
        }
    }
    (found, drafts)
}

/// Points combinations of sides that hold no area to the combination that differs least.
fn fill(patches: &mut [u32]) {
    let known: Vec<(usize, u32)> = patches.iter().copied().enumerate().filter(|&(_, p)| p != NONE).collect();
    for (bits, patch) in patches.iter_mut().enumerate() {
        let nearest = known.iter().min_by_key(|(k, _)| (k ^ bits).count_ones());
        *patch = nearest.map_or(NONE, |n| n.1);
    }
}

/// The grid's measures.
struct Shape {
    columns: usize,
    rows: usize,
    cell: DVec2,
}

impl Shape {
    /// Adds the line through a segment to every cell the segment passes through.
    fn draw(&self, segment: &[DVec2; 2], cells: &mut [CellPieces]) {
        let [a, b] = segment.map(|p| p / self.cell);
        let (low, high) = (a.min(b), a.max(b));
        let normal = (b - a).perp().normalize_or_zero();
        let line = Line { normal: normal.as_vec2(), offset: normal.dot(a) as f32 };
        for row in span(low.y, high.y, self.rows) {
            for column in span(low.x, high.x, self.columns) {
                let corner = DVec2::new(column as f64, row as f64);
                if !passes_inside(a - corner, b - corner) {
                    continue;
                }
                let lines = &mut cells[row * self.columns + column].lines;
                let same = |l: &Line| {
                    let (parallel, apart) = (l.normal.dot(line.normal), l.offset - line.offset);
                    (parallel > 0.9999 && apart.abs() < 1e-3)
                        || (parallel < -0.9999 && (l.offset + line.offset).abs() < 1e-3)
                };
                if lines.len() < MOST_LINES && !lines.iter().any(same) {
                    lines.push(line);
                }
            }
        }
    }

    /// The limits of the k-th cell along an axis, in cells; none at the surface's rim, which rounding may pass.
    fn limits(&self, axis: usize, k: usize) -> [Option<f64>; 2] {
        let n = [self.columns, self.rows][axis];
        [(k > 0).then_some(k as f64), (k + 1 < n).then_some((k + 1) as f64)]
    }

    /// Puts the parts of a face into the cells they lie in.
    fn clip_face(&self, scene: &Scene, s: &Surface, face: u32, cells: &mut [CellPieces]) {
        let corners = scene.corners(face).map(|p| s.uv(p.as_dvec3()) / self.cell);
        let low = corners[0].min(corners[1]).min(corners[2]);
        let high = corners[0].max(corners[1]).max(corners[2]);
        let full = self.cell.element_product();
        let lift = |q: DVec2| {
            let q = q * self.cell;
            (s.origin + s.axes[0] * q.x + s.axes[1] * q.y).as_vec3()
        };
        for row in span(low.y, high.y, self.rows) {
            let strip = clip(&corners, DVec2::Y, self.limits(1, row));
            for column in span(low.x, high.x, self.columns) {
                let polygon = clip(&strip, DVec2::X, self.limits(0, column));
                let cell = &mut cells[row * self.columns + column];
                for (bits, part) in split(polygon, &cell.lines) {
                    for k in 2..part.len() {
                        let [a, b, c] = [part[0], part[k - 1], part[k]];
                        let area = 0.5 * (b - a).perp_dot(c - a) * full;
                        if area > 1e-9 * full {
                            let corners = [a, b, c].map(lift);
                            let piece = Piece { face, corners, area };
                            cell.parts.entry(bits).or_default().push(piece);
                        }
                    }
                }
            }
        }
    }

    /// The cell whose patches each cell uses: itself, its fullest neighbour if nearly empty, the nearest if empty.
    fn assign(&self, cells: &[CellPieces]) -> Vec<usize> {
        let full = self.cell.element_product();
        let areas: Vec<f64> = cells.iter().map(CellPieces::area).collect();
        let whole = |k: usize| cells[k].lines.is_empty();
        let keeps = |k: usize| areas[k] >= 0.25 * full || !whole(k);
        let mut targets: Vec<usize> = vec![usize::MAX; cells.len()];
        for k in 0..cells.len() {
            if areas[k] > 0.0 {
                let fullest = self
                    .neighbours(k)
                    .filter(|&n| areas[n] >= 0.25 * full && whole(n))
                    .max_by(|&a, &b| areas[a].total_cmp(&areas[b]));
                targets[k] = if keeps(k) { k } else { fullest.unwrap_or(k) };
            }
        }
        // Flood the empty cells from the filled ones.
        let mut queue: VecDeque<usize> = (0..cells.len()).filter(|&k| areas[k] > 0.0).collect();
        while let Some(k) = queue.pop_front() {
            for n in self.neighbours(k) {
                if targets[n] == usize::MAX {
                    targets[n] = targets[k];
                    queue.push_back(n);
                }
            }
        }
        targets
    }

    /// The up to four cells that share an edge with cell k.
    fn neighbours(&self, k: usize) -> impl Iterator<Item = usize> {
        let (row, column) = (k / self.columns, k % self.columns);
        [
            (column > 0).then(|| k - 1),
            (column + 1 < self.columns).then_some(k + 1),
            (row > 0).then(|| k - self.columns),
            (row + 1 < self.rows).then_some(k + self.columns),
        ]
        .into_iter()
        .flatten()
    }
}

/// No patch: the black back of a one-sided face.
pub const NONE: u32 = u32::MAX;

/// A patch before numbering: its material and the pieces of faces it consists of.
pub(crate) struct Draft {
    pub material: u32,
    pub pieces: Vec<Piece>,
}

/// A triangle cut from a face, and its area.
pub(crate) struct Piece {
    pub face: u32,
    pub corners: [Vec3; 3],
    pub area: f64,
}

/// A piece of one face that belongs to a patch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fragment {
    pub corners: [Vec3; 3],
    pub face: u32,
    /// Areas of the patch's fragments up to and including this one, divided by the patch's area.
    pub share: f32,
}

/// The line `normal · (u, v) = offset`, in units of cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub normal: Vec2,
    pub offset: f32,
}

/// Bit k is the side of line k that a point lies on.
#[inline]
pub(crate) fn side_bits(lines: &[Line], at: Vec2) -> usize {
    let bit = |(k, l): (usize, &Line)| usize::from(l.normal.dot(at) >= l.offset) << k;
    lines.iter().enumerate().map(bit).sum()
}

/// The cells that an interval touches, at least one.
pub(crate) fn span(low: f64, high: f64, n: usize) -> std::ops::Range<usize> {
    (low.floor().max(0.0) as usize).min(n - 1)..(high.ceil().max(1.0) as usize).min(n)
}

/// Whether a segment passes through the inside of the unit square, not merely along its rim.
pub(crate) fn passes_inside(a: DVec2, b: DVec2) -> bool {
    const RIM: f64 = 1e-4;
    let d = b - a;
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        if d[axis].abs() < 1e-12 {
            if a[axis] <= RIM || a[axis] >= 1.0 - RIM {
                return false;
            }
            continue;
        }
        let (t, u) = ((RIM - a[axis]) / d[axis], (1.0 - RIM - a[axis]) / d[axis]);
        enter = enter.max(t.min(u));
        leave = leave.min(t.max(u));
    }
    enter < leave
}

/// The parts of a convex polygon on each side of the lines.
pub(crate) fn split(polygon: Vec<DVec2>, lines: &[Line]) -> Vec<(usize, Vec<DVec2>)> {
    let mut parts = vec![(0, polygon)];
    for (k, line) in lines.iter().enumerate() {
        let (normal, offset) = (line.normal.as_dvec2(), f64::from(line.offset));
        parts = parts
            .into_iter()
            .flat_map(|(bits, part)| {
                [(bits, half_plane(&part, -normal, -offset)), (bits | 1 << k, half_plane(&part, normal, offset))]
            })
            .filter(|(_, part)| part.len() > 2)
            .collect();
    }
    parts
}

impl Grid {
    /// Every patch of the grid with the block of two by two cells it lies in; a patch may come several times.
    pub fn blocks(&self) -> impl Iterator<Item = (u32, u32)> {
        let across = self.columns.div_ceil(2);
        self.cells.iter().enumerate().flat_map(move |(k, cell)| {
            let (row, column) = (k / self.columns, k % self.columns);
            let block = (row / 2 * across + column / 2) as u32;
            let patches = match cell {
                Cell::Patch(patch) => std::slice::from_ref(patch),
                // A line of contact divides light from dark: its patches join no block.
                Cell::Cut(_) => &[],
            };
            patches.iter().map(move |&patch| (patch, block))
        })
    }

    /// Every patch of whole cells; a patch may come several times.
    pub fn whole(&self) -> impl Iterator<Item = u32> {
        self.cells.iter().filter_map(|cell| match cell {
            Cell::Patch(patch) => Some(*patch),
            Cell::Cut(_) => None,
        })
    }

    /// The patches of the cells next to that of a patch with its middle there: in u after and before, in v after and
    /// before. NONE stands for the rim, a cell cut by lines, and a cell that shares the patch.
    pub fn beside(&self, patch: u32, middle: Vec3) -> [u32; 4] {
        let d = middle - self.origin;
        let (column, row) = (d.dot(self.per_cell[0]) as usize, d.dot(self.per_cell[1]) as usize);
        let at = |row: usize, column: usize| {
            if row >= self.rows || column >= self.columns {
                return NONE;
            }
            match &self.cells[row * self.columns + column] {
                Cell::Patch(other) if *other != patch => *other,
                _ => NONE,
            }
        };
        let before = |k: usize| k.wrapping_sub(1);
        [at(row, column + 1), at(row, before(column)), at(row + 1, column), at(before(row), column)]
    }

    /// Half a cell along u and along v.
    pub fn halves(&self) -> [Vec3; 2] {
        self.per_cell.map(|axis| 0.5 * axis / axis.length_squared())
    }
}
