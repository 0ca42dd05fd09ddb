//! The scene of figure 4, made by a recipe: two spheres on a floor below a square luminaire, or below five lights that
//! stand for it as OpenGL would have it.
//!
//! ```text
//! floor z = 0, 120 by 120, white; spheres of radius 4 at (-5, 0, 4) and (5, 2, 4)
//! luminaire w by w at z = 20, facing down
//! five lights at the middles of its centre and corner tiles of 3 by 3, each of intensity L w²/5 along the axis
//! ```
//!
//! Under a Warn exponent of 1 they have the luminaire's emission by the cosine law. The panel is there in all variants,
//! dark where lights stand for it, so that all have the same unit coordinates. Not handled: curved surfaces; the
//! spheres have facets, as OpenGL's would.
//!
//! Source: Figure 4 of D. C. Banks, K. M. Beason, *Retro-rendering with vector-valued light*, SPIE 6060, 2006.

use std::f64::consts::PI;

use glam::DVec3;

use halflight::light::{Gloss, Rgb};
use halflight::scene::{Beam, Camera, Material, PunctualForm, PunctualLight, PunctualPlace, Scene};

/// Height of the luminaire.
pub const HEIGHT: f64 = 20.0;
/// Width of the luminaire over its height, in the paper's figure.
pub const RATIO: f64 = 0.9;
/// Triangles of the figure.
pub const TRIANGLES: usize = 500_000;
/// Radiance of the paper's luminaire, at which the five lights have an intensity of 0.67 in all, where a2 is 0.0025.
const RADIANCE: f64 = 0.67 * PI / (0.0025 * RATIO * RATIO * HEIGHT * HEIGHT);
/// Side of the floor.
const FLOOR: f64 = 120.0;
const RADIUS: f64 = 4.0;
const CENTRES: [DVec3; 2] = [DVec3::new(-5.0, 0.0, 4.0), DVec3::new(5.0, 2.0, 4.0)];

/// What lights the spheres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lit {
    /// The luminaire.
    Area,
    /// Gauss and Legendre's points on it, so many to a side, each with its share of the light: a quadrature.
    Quadrature(usize),
    /// Five lights.
    Five(FiveLights),
}

/// The kinds of lights that OpenGL has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FiveLights {
    /// By the cosine to the axis, as the luminaire.
    Warn,
    /// All around, weakened by 1/(a0 + a1 d + a2 d²).
    Point,
    /// Around axes that lean to the middle.
    Spot,
    /// Parallel light.
    Directional,
}

/// The scene, in variants.
#[derive(Clone, Copy, Debug)]
pub struct TwoSpheres {
    /// About how many triangles.
    pub triangles: usize,
    /// Width of the luminaire over its height.
    pub ratio: f64,
    /// What lights it.
    pub lit: Lit,
    /// Whether everything has highlights.
    pub highlights: bool,
}

impl FiveLights {
    /// All kinds.
    pub const ALL: [FiveLights; 4] = [FiveLights::Warn, FiveLights::Point, FiveLights::Spot, FiveLights::Directional];

    /// As scene files have it.
    pub fn name(self) -> &'static str {
        match self {
            FiveLights::Warn => "warn",
            FiveLights::Point => "point",
            FiveLights::Spot => "spot",
            FiveLights::Directional => "directional",
        }
    }
}

/// Triangles over shared vertices, in the file's units.
#[derive(Default)]
struct Mesh {
    vertices: Vec<DVec3>,
    faces: Vec<(Vec<u32>, u32)>,
}

impl Mesh {
    /// A grid of `across` by `up` quadrangles of two triangles over the unit square; triangles without area are left
    /// out.
    fn grid(&mut self, [across, up]: [u32; 2], material: u32, at: impl Fn(f64, f64) -> DVec3) {
        let first = self.vertices.len() as u32;
        for j in 0..=up {
            let row = (0..=across).map(|i| at(f64::from(i) / f64::from(across), f64::from(j) / f64::from(up)));
            self.vertices.extend(row);
        }
        let index = |i: u32, j: u32| first + j * (across + 1) + i;
        for j in 0..up {
            for i in 0..across {
                let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
                for corners in [[a, b, c], [a, c, d]] {
                    let [p, q, r] = corners.map(|v| self.vertices[v as usize]);
                    if (q - p).cross(r - p).length() > 1e-9 {
                        self.faces.push((corners.to_vec(), material));
                    }
                }
            }
        }
    }

    /// A sphere by latitudes and longitudes, seen from outside.
    fn sphere(&mut self, centre: DVec3, rings: u32, material: u32) {
        self.grid([2 * rings, rings], material, |u, v| {
            // The seam's two columns of vertices and the poles are exactly the same points.
            let (sin, cos) = if u == 1.0 { (0.0, 1.0) } else { (2.0 * PI * u).sin_cos() };
            let (across, up) =
                if v == 0.0 || v == 1.0 { (0.0, 2.0 * v - 1.0) } else { ((PI * v).sin(), -(PI * v).cos()) };
            centre + RADIUS * DVec3::new(across * cos, across * sin, up)
        });
    }
}

impl TwoSpheres {
    /// The paper's: the luminaire, or what stands for it.
    pub fn paper(lit: Lit) -> TwoSpheres {
        TwoSpheres { triangles: TRIANGLES, ratio: RATIO, lit, highlights: false }
    }

    /// The scene, from the figure's camera.
    pub fn scene(&self) -> Scene {
        let mut mesh = Mesh::default();
        let side = (0.2 * self.triangles as f64).sqrt().round().max(2.0) as u32;
        let rings = (0.075 * self.triangles as f64).sqrt().round().max(4.0) as u32;
        mesh.grid([side, side], 0, |u, v| FLOOR * DVec3::new(u - 0.5, v - 0.5, 0.0));
        for (centre, material) in CENTRES.into_iter().zip(1..) {
            mesh.sphere(centre, rings, material);
        }
        self.finish(mesh, DVec3::new(0.0, -27.0, 24.0), DVec3::new(0.0, 0.0, 1.5), 38.0)
    }

    /// The middle of the floor alone, finely cut and seen from above, so bright that under the luminaire its radiance
    /// is 1 in the middle.
    pub fn middle(&self) -> Scene {
        let mut mesh = Mesh::default();
        mesh.grid([32, 32], 0, |u, v| DVec3::new(u - 0.5, v - 0.5, 0.0));
        let mut scene = self.finish(mesh, DVec3::new(0.0, -0.01, 10.0), DVec3::ZERO, 0.1);
        let gain = (1.0 / (self.radiance() * self.form())) as f32;
        scene.materials.iter_mut().for_each(|m| m.emission *= gain);
        scene.lights.iter_mut().for_each(|light| light.intensity *= gain);
        scene
    }

    /// Radiance of the luminaire: whatever its width it has the same power.
    fn radiance(&self) -> f64 {
        RADIANCE * (RATIO / self.ratio).powi(2)
    }

    /// Form factor from the floor's middle to the luminaire: four times that to a rectangle over its corner.
    fn form(&self) -> f64 {
        let a = 0.5 * self.ratio;
        let root = (1.0 + a * a).sqrt();
        4.0 / PI * (a / root) * (a / root).atan()
    }

    fn finish(&self, mut mesh: Mesh, eye: DVec3, target: DVec3, fov: f32) -> Scene {
        let width = self.ratio * HEIGHT;
        mesh.grid([1, 1], 3, |u, v| DVec3::new(width * (u - 0.5), width * (0.5 - v), HEIGHT));
        let gloss = self.highlights.then_some(Gloss { specular: Rgb::splat(0.3), exponent: 30.0 });
        let emission = if self.lit == Lit::Area { Rgb::splat(self.radiance() as f32) } else { Rgb::ZERO };
        let diffuse =
            |name: &str, rho: [f32; 3]| Material { gloss, ..Material::new(name, Rgb::from_array(rho), Rgb::ZERO) };
        let materials = vec![
            diffuse("floor", [1.0; 3]),
            diffuse("left", [1.0, 0.92, 0.85]),
            diffuse("right", [0.25, 0.45, 0.9]),
            Material::new("luminaire", Rgb::ZERO, emission),
        ];
        let made = Scene::from_faces("two-spheres", &mesh.vertices, &mesh.faces, materials);
        let mut scene = made.expect("the recipe makes a correct scene");
        let [eye, target] = [eye, target].map(|point| scene.frame.to_unit(point));
        let forward = (target - eye).normalize();
        let right = forward.cross(DVec3::Z).normalize();
        let up = right.cross(forward);
        let [position, forward, right, up] = [eye, forward, right, up].map(|v| v.as_vec3());
        scene.camera = Camera { position, forward, right, up, vertical_fov: fov };
        scene.lights = self.lights(&scene);
        scene
    }

    /// The lights of a scene, in its unit coordinates.
    fn lights(&self, scene: &Scene) -> Vec<PunctualLight> {
        let half = 0.5 * self.ratio * HEIGHT;
        let power = self.radiance() * 4.0 * half * half;
        let place = |x: f64, y: f64, attenuation| {
            let position = scene.frame.to_unit(DVec3::new(x, y, HEIGHT));
            PunctualPlace::new(position, attenuation, scene.frame.scale)
        };
        let light = |form, intensity: f64| PunctualLight { form, intensity: Rgb::splat(intensity as f32), name: None };
        let warn = |x, y, share: f64| {
            let place = place(x, y, PunctualLight::PHYSICAL);
            let beam = Beam::Spot { direction: DVec3::NEG_Z, exponent: 1.0, cutoff: 0.0 };
            light(PunctualForm::Point { place, beam }, share * power)
        };
        let third = 2.0 * half / 3.0;
        let five = [(0.0, 0.0), (-third, -third), (-third, third), (third, -third), (third, third)];
        match self.lit {
            Lit::Area => Vec::new(),
            Lit::Quadrature(count) => {
                let points = gauss_legendre(count);
                let all = points.iter().flat_map(|a| points.iter().map(move |b| (a, b)));
                all.map(|((x, u), (y, v))| warn(half * x, half * y, 0.25 * u * v)).collect()
            }
            Lit::Five(kind) => five
                .map(|(x, y)| match kind {
                    FiveLights::Warn => warn(x, y, 0.2),
                    FiveLights::Point => light(PunctualForm::even(place(x, y, [60.0, 2.0, 0.8])), 0.1 * power),
                    FiveLights::Spot => {
                        let place = place(x, y, PunctualLight::PHYSICAL);
                        let direction = DVec3::new(-x, -y, -HEIGHT).normalize();
                        let cutoff = 80_f64.to_radians().cos();
                        let beam = Beam::Spot { direction, exponent: 8.0, cutoff };
                        light(PunctualForm::Point { place, beam }, 0.1 * power)
                    }
                    FiveLights::Directional => {
                        let direction = DVec3::new(-x, -y, -HEIGHT).normalize();
                        light(PunctualForm::Directional { direction }, 0.1 * PI)
                    }
                })
                .into(),
        }
    }
}

/// Points and weights of Gauss and Legendre's rule of so many points on -1..1, by Newton's method.
fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    let legendre = |x: f64| {
        let (mut before, mut value) = (1.0, x);
        for k in 2..=count {
            let k = k as f64;
            (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
        }
        (value, n * (before - x * value) / (1.0 - x * x))
    };
    let point = |k: usize| {
        let mut x = (PI * (k as f64 + 0.75) / (n + 0.5)).cos();
        for _ in 0..20 {
            let (value, slope) = legendre(x);
            x -= value / slope;
        }
        let slope = legendre(x).1;
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_integrates_polynomials() {
        let rule = gauss_legendre(8);
        for power in 0..16 {
            let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(power)).sum();
            let exact = if power % 2 == 0 { 2.0 / f64::from(power + 1) } else { 0.0 };
            assert!((sum - exact).abs() < 1e-13, "{power}: {sum}");
        }
    }

    #[test]
    fn spheres_are_closed_and_look_outwards() {
        let scene = TwoSpheres { triangles: 2000, ..TwoSpheres::paper(Lit::Area) }.scene();
        let mut volume = 0.0;
        let mut area = DVec3::ZERO;
        for face in 0..scene.faces.len() as u32 {
            if matches!(scene.faces[face as usize].material, 1 | 2) {
                let [a, b, c] = scene.exact_corners(face).map(|p| p * scene.frame.scale);
                volume += a.dot(b.cross(c)) / 6.0;
                area += 0.5 * (b - a).cross(c - a);
            }
        }
        let exact = 2.0 * 4.0 / 3.0 * PI * RADIUS.powi(3);
        assert!((volume / exact - 1.0).abs() < 0.05 && area.length() < 1e-9, "{volume} {exact} {area}");
    }
}
