//! The triangles of a luminaire, and the convex polygons that they make up.
//!
//! Not handled: polygons of more than four corners, which stay triangles and quadrangles.

use glam::{DVec3, Vec3};

/// One triangle of a luminaire, counter-clockwise seen from the emitting side.
#[derive(Clone, Debug)]
pub(crate) struct EmittingTriangle {
    pub corners: [Vec3; 3],
    pub exact: [DVec3; 3],
    pub normal: DVec3,
    pub face: u32,
    /// Area of the triangles up to and including this one over the luminaire's.
    pub share: f32,
}

/// Triangles, those that follow one another and make up a convex quadrangle of one plane taken together.
pub(crate) fn polygons(triangles: &[EmittingTriangle]) -> Vec<Vec<DVec3>> {
    let mut polygons: Vec<Vec<DVec3>> = Vec::new();
    let mut rest = triangles;
    while let [first, others @ ..] = rest {
        let joined = others.first().and_then(|second| quadrangle(first, second));
        rest = &others[usize::from(joined.is_some())..];
        polygons.push(joined.map_or_else(|| first.exact.to_vec(), |q| q.to_vec()));
    }
    polygons
}

/// The quadrangle that two triangles make up, if they share an edge and a plane and it is convex.
fn quadrangle(first: &EmittingTriangle, second: &EmittingTriangle) -> Option<[DVec3; 4]> {
    let n = first.normal;
    let turned = |t: &[DVec3; 3], k: usize| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
    let turns = (0..9).map(|k| (turned(&first.exact, k / 3), turned(&second.exact, k % 3)));
    // c-a of the first, a-c of the second.
    let shared = turns.into_iter().find(|([a, _, c], [p, q, _])| (a, c) == (p, q));
    let ([a, b, c], [_, _, d]) = shared?;
    let corners = [a, b, c, d];
    let size = (c - a).length();
    let flat = n.dot(d - a).abs() <= 1e-12 * size;
    let bends = |k: usize| {
        let [p, q, r] = [0, 1, 2].map(|i| corners[(k + i) % 4]);
        n.dot((q - p).cross(r - q)) > 0.0
    };
    (flat && (0..4).all(bends)).then_some(corners)
}
