//! Two concentric spheres of fine triangles, and the ratio of their areas.
//!
//! Both are octahedra whose faces are cut into 64 by 64 triangles and pushed out to the sphere, so what a point of one
//! sees of the other varies by less than 1e-3 of itself.

use glam::DVec3;
use halflight::light::Rgb;
use halflight::scene::{Material, Scene};

const CUTS: u32 = 64;

/// Radius `inner` facing out and radius 1 facing in, both of reflectance `rho`, emitting `emission` (inner, outer); and
/// the inner area over the outer.
pub fn concentric_spheres(inner: f64, rho: f32, emission: [f64; 2]) -> (Scene, f64) {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    add_sphere(&mut vertices, &mut faces, inner, 0);
    add_sphere(&mut vertices, &mut faces, 1.0, 1);
    let area = |material: u32| -> f64 {
        let own = faces.iter().filter(|(_, m)| *m == material);
        let corners = own.map(|(f, _): &(Vec<u32>, u32)| [0, 1, 2].map(|i| vertices[f[i] as usize]));
        corners.map(|[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length()).sum()
    };
    let q = area(0) / area(1);
    let material = |name: &str, e: f64| Material::new(name, Rgb::splat(rho), Rgb::splat(e as f32));
    let materials = vec![material("inner", emission[0]), material("outer", emission[1])];
    let scene = Scene::from_faces("spheres", &vertices, &faces, materials).unwrap();
    (scene, q)
}

/// Material 0 faces out, material 1 in.
fn add_sphere(vertices: &mut Vec<DVec3>, faces: &mut Vec<(Vec<u32>, u32)>, radius: f64, material: u32) {
    for octant in 0..8 {
        let sign = |bit: u32| if octant & bit == 0 { 1.0 } else { -1.0 };
        let signs = DVec3::new(sign(1), sign(2), sign(4));
        let outward = signs.x * signs.y * signs.z > 0.0;
        let mut add = |corners: [(u32, u32); 3]| {
            let first = vertices.len() as u32;
            vertices.extend(corners.map(|(i, j)| {
                let p = DVec3::new(f64::from(i), f64::from(j), f64::from(CUTS - i - j));
                radius * (signs * p).normalize()
            }));
            let order = if outward == (material == 0) { [0, 1, 2] } else { [0, 2, 1] };
            faces.push((order.map(|k| first + k).to_vec(), material));
        };
        for i in 0..CUTS {
            for j in 0..CUTS - i {
                add([(i, j), (i + 1, j), (i, j + 1)]);
                if i + j + 1 < CUTS {
                    add([(i + 1, j), (i + 1, j + 1), (i, j + 1)]);
                }
            }
        }
    }
}
