//! Facets: what is flat of a surface, made of the triangles that touch in one plane.
//!
//! A facet is held twice: as convex tiles, to be clipped, and as the directed edges that bound it, to be integrated
//! along. Edges that two triangles share run both ways and cancel, so no polygon has to be put together and holes
//! need no care.
//!
//! Not handled: triangles that touch along parts of edges (T-junctions) stay facets of their own.

use std::collections::HashMap;

use glam::DVec3;

use crate::form_factors::plane::{Plane, area_vector, plane_of, split};

/// A directed edge.
pub(crate) type Edge = [DVec3; 2];

/// A flat piece of surface with a front.
#[derive(Clone, Debug)]
pub(crate) struct Facet {
    pub plane: Plane,
    pub area: f64,
    /// Convex polygons that cover it, counter-clockwise seen from the front.
    pub tiles: Vec<Vec<DVec3>>,
    /// What bounds it, the facet to the left seen from the front.
    pub edges: Vec<Edge>,
}

impl Facet {
    /// A facet of tiles in one plane.
    fn new(plane: Plane, tiles: Vec<Vec<DVec3>>) -> Facet {
        let edges = boundary(&tiles);
        let area = tiles.iter().fold(0.0, |sum, t| sum + area_vector(t).dot(plane.normal));
        Facet { plane, area, tiles, edges }
    }

    /// The facet as seen from behind: front and back exchanged.
    pub(crate) fn reversed(&self) -> Facet {
        let plane = Plane { normal: -self.plane.normal, offset: -self.plane.offset, ..self.plane };
        let turn = |tile: &Vec<DVec3>| tile.iter().rev().copied().collect();
        Facet::new(plane, self.tiles.iter().map(turn).collect())
    }

    /// The part in front of a plane; `None` where there is none.
    pub(crate) fn in_front_of(&self, plane: &Plane) -> Option<Facet> {
        let mut heights = self.points().map(|p| plane.height(p));
        if heights.clone().all(|h| h >= 0.0) {
            return heights.any(|h| h > 0.0).then(|| self.clone());
        }
        let halves = self.tiles.iter().map(|t| split(t, |p| plane.height(p)).0);
        let tiles: Vec<_> = halves.filter(|t| t.len() > 2).collect();
        (!tiles.is_empty()).then(|| Facet::new(self.plane, tiles))
    }

    /// Corners of the tiles.
    pub(crate) fn points(&self) -> impl Iterator<Item = DVec3> + Clone {
        self.tiles.iter().flatten().copied()
    }

    /// The tiles cut along a plane.
    pub(crate) fn cut_along(&mut self, plane: &Plane) {
        let cut = |tile: &Vec<DVec3>| <[_; 2]>::from(split(tile, |p| plane.height(p)));
        let tiles = self.tiles.iter().flat_map(cut);
        self.tiles = tiles.filter(|t| t.len() > 2).collect();
    }

    /// Merges the tiles where together they are one convex polygon.
    fn joined(mut self) -> Facet {
        if let Some(ring) = ring(&self.edges).filter(|r| self.tiles.len() > 1 && self.is_convex(r)) {
            self.tiles = vec![ring];
        }
        self
    }

    fn is_convex(&self, ring: &[DVec3]) -> bool {
        let n = ring.len();
        let turns = (0..n).all(|k| {
            let (a, b, c) = (ring[k], ring[(k + 1) % n], ring[(k + 2) % n]);
            (b - a).cross(c - b).dot(self.plane.normal) >= 0.0
        });
        // Turning left throughout is not enough: a star may do that twice around.
        let area = area_vector(ring).dot(self.plane.normal);
        turns && (area - self.area).abs() <= 1e-9 * self.area
    }
}

/// The facets of a set of triangles, each the triangles that touch by whole edges in one plane, to within `flat`.
pub(crate) fn facets(triangles: &[[DVec3; 3]], flat: f64) -> Vec<Facet> {
    let mut by_edge: HashMap<[[u64; 3]; 2], Vec<usize>> = HashMap::new();
    for (k, t) in triangles.iter().enumerate() {
        for i in 0..3 {
            by_edge.entry(key(t[i], t[(i + 1) % 3])).or_default().push(k);
        }
    }
    // Larger triangles have truer planes: facets begin with them.
    let areas: Vec<f64> = triangles.iter().map(|t| area_vector(t).length()).collect();
    let mut order: Vec<usize> = (0..triangles.len()).collect();
    order.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]));
    let mut taken = vec![false; triangles.len()];
    let mut found = Vec::new();
    for founder in order {
        if taken[founder] || areas[founder] <= 0.0 {
            continue;
        }
        let plane = plane_of(&triangles[founder], flat);
        taken[founder] = true;
        let (mut members, mut next) = (vec![founder], 0);
        while next < members.len() {
            let t = triangles[members[next]];
            next += 1;
            for i in 0..3 {
                let across = by_edge.get(&key(t[(i + 1) % 3], t[i]));
                for &k in across.into_iter().flatten() {
                    if !taken[k] && lies_in(&plane, &triangles[k]) {
                        taken[k] = true;
                        members.push(k);
                    }
                }
            }
        }
        let tiles = members.iter().map(|&k| triangles[k].to_vec()).collect();
        found.push(Facet::new(plane, tiles).joined());
    }
    found
}

fn lies_in(plane: &Plane, triangle: &[DVec3; 3]) -> bool {
    let faces = area_vector(triangle).dot(plane.normal) > 0.0;
    faces && triangle.iter().all(|&p| plane.height(p) == 0.0)
}

fn key(a: DVec3, b: DVec3) -> [[u64; 3]; 2] {
    [a, b].map(|p| p.to_array().map(f64::to_bits))
}

/// The edges of polygons but those that two of them share.
fn boundary(tiles: &[Vec<DVec3>]) -> Vec<Edge> {
    let mut edges: Vec<Edge> = Vec::new();
    let mut open: HashMap<[[u64; 3]; 2], Vec<usize>> = HashMap::new();
    for tile in tiles {
        for k in 0..tile.len() {
            let (a, b) = (tile[k], tile[(k + 1) % tile.len()]);
            if let Some(other) = open.get_mut(&key(b, a)).and_then(Vec::pop) {
                edges[other] = [DVec3::NAN; 2];
            } else {
                open.entry(key(a, b)).or_default().push(edges.len());
                edges.push([a, b]);
            }
        }
    }
    edges.retain(|e| !e[0].is_nan());
    edges
}

/// The edges in order, if they form one ring.
fn ring(edges: &[Edge]) -> Option<Vec<DVec3>> {
    let bits = |p: DVec3| p.to_array().map(f64::to_bits);
    let follow: HashMap<_, _> = edges.iter().map(|e| (bits(e[0]), e[1])).collect();
    let first = edges.first()?[0];
    let mut ring = vec![first];
    let mut at = *follow.get(&bits(first))?;
    while at != first && ring.len() < edges.len() {
        ring.push(at);
        at = *follow.get(&bits(at))?;
    }
    (at == first && ring.len() == edges.len()).then_some(ring)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: f64 = 1e-12;

    fn at(x: f64, y: f64) -> DVec3 {
        DVec3::new(x, y, 0.5 * x)
    }

    /// A frame: the square [0, 3]² with a hole [1, 2]², eight triangles in one tilted plane.
    fn frame() -> Vec<[DVec3; 3]> {
        let outer = [at(0., 0.), at(3., 0.), at(3., 3.), at(0., 3.)];
        let inner = [at(1., 1.), at(2., 1.), at(2., 2.), at(1., 2.)];
        let sides = (0..4).flat_map(|k| {
            let next = (k + 1) % 4;
            let (a, b, c, d) = (outer[k], outer[next], inner[next], inner[k]);
            [[a, b, c], [a, c, d]]
        });
        sides.collect()
    }

    #[test]
    fn a_frame_is_one_facet_with_two_rings() {
        let [facet] = &facets(&frame(), FLAT)[..] else {
            panic!("one facet");
        };
        assert_eq!((facet.tiles.len(), facet.edges.len()), (8, 8));
        assert!((facet.area - 8.0 * 1.25_f64.sqrt()).abs() < 1e-12);
        let half = Plane { normal: DVec3::X, offset: 1.5, flat: FLAT };
        let cut = facet.in_front_of(&half).expect("half of it");
        assert!((cut.area - 0.5 * facet.area).abs() < 1e-12);
        // The cut runs through both arms, and neighbours' edges cancel: those that remain close.
        let sum: DVec3 = cut.edges.iter().map(|e| e[1] - e[0]).sum();
        assert!(sum.length() < 1e-14);
        let along: f64 = cut.edges.iter().map(|e| (e[1] - e[0]).length()).sum();
        let whole: f64 = facet.edges.iter().map(|e| (e[1] - e[0]).length()).sum();
        assert!((along - (0.5 * whole + 2.0)).abs() < 1e-12, "{along} {whole}");
    }

    #[test]
    fn squares_become_one_tile_and_folds_stay_apart() {
        let (a, b, c, d) = (at(0., 0.), at(1., 0.), at(1., 1.), at(0., 1.));
        let square = facets(&[[a, b, c], [a, c, d]], FLAT);
        assert_eq!((square.len(), square[0].tiles.len(), square[0].edges.len()), (1, 1, 4));
        let fold = DVec3::new(0.0, 1.0, 1e-9);
        assert_eq!(facets(&[[a, b, c], [a, c, fold]], FLAT).len(), 2);
    }
}
