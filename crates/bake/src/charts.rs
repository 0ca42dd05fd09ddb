//! Charts: pieces of a part that lie flat in a map, each laid out by one projection along its normal.
//!
//! Faces of one plane that share an edge make a chart. Of curved parts, charts whose planes differ by little from that
//! of the largest among them are laid out together as long as none of them folds over another: then a map has fewer
//! borders, and texels are stretched by 1 / cos of the angle at most.
//!
//! Not handled: charts cut for less stretch; parts whose file has charts, which stay as they are.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec2Swizzles as _};
use rustc_hash::FxHashMap;

use crate::clip::overlap;
use crate::parts::{Part, Triangle};

/// Least cosine between normals of faces in one plane.
const FLAT: f64 = 0.999_99;
/// Least cosine between the normal of a chart and those of its faces: 35°.
const CURVED: f64 = 0.82;
/// Faces of a chart of several planes at most, of which every two are held against each other.
const MOST: usize = 400;

/// A piece of a part laid flat.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    /// Triangles of the part, and where their corners lie in it, the file's units, from 0 on.
    pub triangles: Vec<(usize, [DVec2; 3])>,
    /// Its sides, the file's units.
    pub size: DVec2,
}

/// Faces with a common edge, of which the end points are known by their bits.
type Edge = [[u64; 3]; 2];

/// The charts of a part.
pub(crate) fn charts(part: &Part) -> Vec<Chart> {
    let normals: Vec<DVec3> = part.triangles.iter().map(Triangle::normal).collect();
    let beside = beside(part);
    let is_real = |&k: &usize| normals[k] != DVec3::ZERO;
    let order = by_area(part, (0..part.triangles.len()).filter(is_real).collect());
    let planes = grown(&order, &beside, |seed, k| normals[seed].dot(normals[k]) >= FLAT, usize::MAX);
    joined(part, &normals, planes, &beside).iter().map(|faces| flat(part, &normals, faces)).collect()
}

/// Larger triangles first.
fn by_area(part: &Part, mut some: Vec<usize>) -> Vec<usize> {
    some.sort_by(|&a, &b| part.triangles[b].area().total_cmp(&part.triangles[a].area()).then(a.cmp(&b)));
    some
}

/// The triangles that share an edge with each.
fn beside(part: &Part) -> Vec<Vec<usize>> {
    let mut edges: FxHashMap<Edge, Vec<usize>> = FxHashMap::default();
    for (k, triangle) in part.triangles.iter().enumerate() {
        let bits = triangle.corners.map(|corner| corner.to_array().map(|x| (x as f32 + 0.0).to_bits() as u64));
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            edges.entry([bits[a].min(bits[b]), bits[a].max(bits[b])]).or_default().push(k);
        }
    }
    let mut beside = vec![Vec::new(); part.triangles.len()];
    for own in edges.values() {
        for &k in own {
            beside[k].extend(own.iter().copied().filter(|&j| j != k));
        }
    }
    beside.iter_mut().for_each(|own| own.sort_unstable());
    beside
}

/// Groups grown from each that has none yet, in order, over those beside that `fits` with the first.
fn grown(order: &[usize], beside: &[Vec<usize>], fits: impl Fn(usize, usize) -> bool, most: usize) -> Vec<Vec<usize>> {
    let mut taken = vec![true; beside.len()];
    order.iter().for_each(|&k| taken[k] = false);
    let mut groups = Vec::new();
    for &seed in order {
        if std::mem::replace(&mut taken[seed], true) {
            continue;
        }
        let (mut group, mut next) = (vec![seed], 0);
        while next < group.len() && group.len() < most {
            for &k in &beside[group[next]] {
                if !taken[k] && fits(seed, k) {
                    taken[k] = true;
                    group.push(k);
                }
            }
            next += 1;
        }
        groups.push(group);
    }
    groups
}

/// Groups of planes that lie next to each other and are laid out together; each of them alone where they would fold.
fn joined(part: &Part, normals: &[DVec3], planes: Vec<Vec<usize>>, beside: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut plane_of = vec![usize::MAX; part.triangles.len()];
    planes.iter().enumerate().for_each(|(p, faces)| faces.iter().for_each(|&k| plane_of[k] = p));
    let around = |faces: &Vec<usize>| {
        let mut own: Vec<usize> = faces.iter().flat_map(|&k| &beside[k]).map(|&k| plane_of[k]).collect();
        own.retain(|&p| p != usize::MAX);
        own.sort_unstable();
        own.dedup();
        own
    };
    let neighbours: Vec<Vec<usize>> = planes.iter().map(around).collect();
    let normal = |p: usize| normals[planes[p][0]];
    let area = |p: &usize| planes[*p].iter().map(|&k| part.triangles[k].area()).sum::<f64>();
    let mut order: Vec<usize> = (0..planes.len()).collect();
    order.sort_by(|a, b| area(b).total_cmp(&area(a)).then(a.cmp(b)));
    let groups = grown(&order, &neighbours, |seed, p| normal(seed).dot(normal(p)) >= CURVED, MOST);
    let mut all = Vec::new();
    for group in groups {
        let faces: Vec<usize> = group.iter().flat_map(|&p| planes[p].iter().copied()).collect();
        if group.len() > 1 && (faces.len() > MOST || folds(&flat(part, normals, &faces))) {
            all.extend(group.into_iter().map(|p| planes[p].clone()));
        } else {
            all.push(faces);
        }
    }
    all
}

/// Whether two triangles of a chart lie over each other.
fn folds(chart: &Chart) -> bool {
    let laid = &chart.triangles;
    (0..laid.len()).any(|a| (0..a).any(|b| overlap(&laid[a].1, &laid[b].1) > 0.0))
}

/// Faces seen along their normal, turned so that the rectangle around them is small and lies at 0.
fn flat(part: &Part, normals: &[DVec3], faces: &[usize]) -> Chart {
    let sum: DVec3 = faces.iter().map(|&k| part.triangles[k].doubled()).sum();
    let normal = sum.normalize_or(normals[faces[0]]);
    let edges = faces.iter().take(12).flat_map(|&k| {
        let [a, b, c] = part.triangles[k].corners;
        [b - a, c - b, a - c]
    });
    let along = |edge: DVec3| {
        let u = edge.reject_from_normalized(normal).normalize_or(normal.any_orthonormal_vector());
        let axes = [u, normal.cross(u)];
        let place = |x: DVec3| DVec2::from(axes.map(|axis| axis.dot(x)));
        let corners = || faces.iter().flat_map(|&k| part.triangles[k].corners).map(place);
        let low = corners().fold(DVec2::INFINITY, DVec2::min);
        let high = corners().fold(DVec2::NEG_INFINITY, DVec2::max);
        (axes, low, high - low)
    };
    let least = |best: ([DVec3; 2], DVec2, DVec2), next: ([DVec3; 2], DVec2, DVec2)| {
        if next.2.element_product() < best.2.element_product() * (1.0 - 1e-6) { next } else { best }
    };
    let (axes, low, size) = edges.map(along).reduce(least).expect("a chart has a face");
    // The longer side lies: pieces of like height are packed side by side.
    let stands = size.y > size.x;
    let place = |x: DVec3| {
        let at = DVec2::from(axes.map(|axis| axis.dot(x))) - low;
        if stands { DVec2::new(at.y, size.x - at.x) } else { at }
    };
    let size = if stands { size.yx() } else { size };
    Chart { triangles: faces.iter().map(|&k| (k, part.triangles[k].corners.map(place))).collect(), size }
}

/// Numbers of the triangles of a part that no chart holds, since they have no area.
pub(crate) fn without_chart(part: &Part, charts: &[Chart]) -> Vec<usize> {
    let held: BTreeMap<usize, ()> = charts.iter().flat_map(|c| c.triangles.iter().map(|(k, _)| (*k, ()))).collect();
    (0..part.triangles.len()).filter(|k| !held.contains_key(k)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(triangles: &[[[f64; 3]; 3]]) -> Part {
        let one = |corners: &[[f64; 3]; 3]| Triangle { corners: corners.map(DVec3::from), second: None };
        Part { name: "part".into(), triangles: triangles.iter().map(one).collect() }
    }

    #[test]
    fn faces_of_one_plane_are_one_chart_and_those_around_a_corner_are_not() {
        let (a, b, c, d) = ([0.0; 3], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]);
        let wall = part(&[[a, b, c], [a, c, d], [a, d, [0.0, 0.0, 3.0]]]);
        let found = charts(&wall);
        assert_eq!(found.len(), 2);
        let sizes: Vec<DVec2> = found.iter().map(|c| DVec2::new(c.size.max_element(), c.size.min_element())).collect();
        assert!(sizes.contains(&DVec2::new(3.0, 1.0)) && sizes.contains(&DVec2::new(2.0, 1.0)), "{sizes:?}");
        // Distances in a chart are those in space.
        for (k, laid) in found.iter().flat_map(|chart| &chart.triangles) {
            let corners = wall.triangles[*k].corners;
            assert!((laid[0].distance(laid[1]) - corners[0].distance(corners[1])).abs() < 1e-12);
        }
    }

    #[test]
    fn a_cylinder_has_few_charts_that_do_not_fold() {
        const SIDES: usize = 24;
        let at = |k: usize, y: f64| {
            let angle = std::f64::consts::TAU * (k % SIDES) as f64 / SIDES as f64;
            [angle.cos(), y, angle.sin()]
        };
        let side = |k: usize| [[at(k, 0.0), at(k, 1.0), at(k + 1, 1.0)], [at(k, 0.0), at(k + 1, 1.0), at(k + 1, 0.0)]];
        let found = charts(&part(&(0..SIDES).flat_map(side).collect::<Vec<_>>()));
        assert!(found.len() > 4 && found.len() < 9, "{}", found.len());
        assert!(found.iter().all(|chart| !folds(chart)));
        assert_eq!(found.iter().map(|chart| chart.triangles.len()).sum::<usize>(), 2 * SIDES);
    }
}
