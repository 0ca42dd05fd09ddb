//! Where the page's picture needs finer cells: what pixels of the file's camera are off by is laid to the charts that
//! they see, and those whose error is largest for the cells that it takes are made finer.
//!
//! A grid gets cells of half the size. Small faces of a cluster, which have one texel each, get charts of their own in
//! their plane, with texels as large as a pixel is there. That a finer chart keeps [`LEFT`] of its
//! squared error is a guess, which only orders the work: the picture is compared anew each time.
//!
//! Not handled: places that the file's camera does not see, which stay as fine as the patches are.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::charts::{Charts, Source};
use crate::drawn::SeenError;
use crate::finer::{Finer, Plane};
use halflight::scene::Scene;

/// Halvings of a grid's cells at most, as a factor.
const MOST: usize = 16;
/// Cells to a side of a plane's chart at most.
const LONGEST: usize = 64;
/// The share of a chart's squared error that is taken to stay when it is made finer.
const LEFT: f64 = 0.4;
/// Faces shorter than so many texels keep the one that they have.
const SHORT: f32 = 1.5;
/// How far corners may lie from the plane of a face that they share a chart with, in lengths of that face.
const FLAT: f32 = 1e-3;

/// A way to make a chart finer.
enum Step {
    Grid(usize),
    Again(usize),
    Plane(Plane),
}

impl Finer {
    /// Finer cells, so many more at most, where their squared error is largest, until about `enough` of it is left;
    /// whether there were any to be had.
    pub fn refine(
        &mut self,
        (scene, charts): (&Scene, &Charts),
        errors: &[SeenError],
        enough: f64,
        mut cells: f64,
    ) -> bool {
        let mut left: f64 = errors.iter().map(|seen| seen.error).sum();
        let mut steps = self.steps(scene, charts, errors);
        steps.sort_by(|(_, e, n), (_, f, m)| (f / m).total_cmp(&(e / n)));
        let mut any = false;
        for (step, error, more) in steps {
            if left <= enough {
                break;
            }
            if more > cells {
                continue;
            }
            (cells, left, any) = (cells - more, left - (1.0 - LEFT) * error, true);
            match step {
                Step::Grid(grid) => *self.grids.entry(grid).or_insert(1) *= 2,
                Step::Again(k) => {
                    self.planes[k].columns *= 2;
                    self.planes[k].rows *= 2;
                }
                Step::Plane(plane) => self.planes.push(plane),
            }
        }
        any
    }

    /// All ways to make charts finer, with the squared error there and the cells that it takes.
    fn steps(&self, scene: &Scene, charts: &Charts, errors: &[SeenError]) -> Vec<(Step, f64, f64)> {
        let mut by_chart: BTreeMap<usize, Vec<&SeenError>> = BTreeMap::new();
        errors.iter().for_each(|seen| by_chart.entry(charts.front(seen.chart)).or_default().push(seen));
        let mut steps = Vec::new();
        for (chart, seen) in by_chart {
            let chart = &charts.list[chart];
            let error: f64 = seen.iter().map(|seen| seen.error).sum();
            let more = 3.0 * (chart.columns * chart.rows) as f64;
            match chart.source {
                Source::Grid(grid) if self.grids.get(&grid).is_none_or(|&factor| factor < MOST) => {
                    steps.push((Step::Grid(grid), error, more));
                }
                Source::Plane(k) if chart.columns.max(chart.rows) < LONGEST => {
                    steps.push((Step::Again(k), error, more));
                }
                Source::Cluster(patch) => {
                    let planes = planes(scene, patch, &seen, charts.fine).into_iter();
                    steps.extend(planes.map(|(plane, error)| {
                        let cells = (plane.columns * plane.rows) as f64;
                        (Step::Plane(plane), error, cells)
                    }));
                }
                _ => {}
            }
        }
        steps
    }
}

/// The planes of faces of a cluster that are seen and longer than a texel there, with what is off in each.
fn planes(scene: &Scene, patch: u32, seen: &[&SeenError], fine: usize) -> Vec<(Plane, f64)> {
    // Of every face its error, and the smallest pixel there.
    let mut faces: BTreeMap<u32, (f64, f32)> = BTreeMap::new();
    for seen in seen {
        let own = faces.entry(seen.face).or_insert((0.0, f32::INFINITY));
        *own = (own.0 + seen.error, own.1.min(seen.length));
    }
    let mut groups: Vec<(Vec<u32>, f64, f32)> = Vec::new();
    for (face, (error, texel)) in faces {
        let corners = scene.corners(face);
        if longest(corners).length() < SHORT * texel {
            continue;
        }
        match groups.iter_mut().find(|(others, ..)| are_flat(scene.corners(others[0]), corners)) {
            Some(group) => {
                group.0.push(face);
                *group = (std::mem::take(&mut group.0), group.1 + error, group.2.min(texel));
            }
            None => groups.push((vec![face], error, texel)),
        }
    }
    groups
        .into_iter()
        .filter_map(|(faces, error, texel)| Some((plane(scene, patch, faces, texel, fine)?, error)))
        .collect()
}

/// The longest edge of a triangle.
fn longest([a, b, c]: [Vec3; 3]) -> Vec3 {
    let edges = [b - a, c - b, a - c];
    edges.into_iter().max_by(|p, q| p.length_squared().total_cmp(&q.length_squared())).unwrap_or(Vec3::ZERO)
}

/// Whether two triangles have an edge or a corner in common, lie in one plane and face the same way.
fn are_flat(own: [Vec3; 3], other: [Vec3; 3]) -> bool {
    let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).normalize_or_zero();
    let (n, length) = (normal(own), longest(own).length());
    let touch = own.iter().any(|p| other.iter().any(|q| p.distance(*q) <= FLAT * length));
    touch && n.dot(normal(other)) > 0.0 && other.iter().all(|x| n.dot(*x - own[0]).abs() <= FLAT * length)
}

/// The chart of faces in a plane; none of what has no area.
fn plane(scene: &Scene, patch: u32, faces: Vec<u32>, texel: f32, fine: usize) -> Option<Plane> {
    let first = scene.corners(faces[0]);
    let u = longest(first).try_normalize()?;
    let normal = (first[1] - first[0]).cross(first[2] - first[0]).try_normalize()?;
    let v = normal.cross(u);
    let range = |axis: Vec3| {
        let all = faces.iter().flat_map(|&face| scene.corners(face)).map(|x| axis.dot(x - first[0]));
        all.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    };
    let ([left, right], [bottom, top]) = (range(u), range(v));
    let (width, height) = (right - left, top - bottom);
    let count = |length: f32| ((length / (texel * fine as f32)).ceil() as usize).clamp(1, LONGEST);
    let is_real = width.min(height) > 1e-6 * width.max(height);
    is_real.then(|| Plane {
        origin: first[0] + left * u + bottom * v,
        sides: [width * u, height * v],
        columns: count(width),
        rows: count(height),
        patch,
        faces,
    })
}
