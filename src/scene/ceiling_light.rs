//! A luminaire added to a scene that brings none: a horizontal rectangle of half the width and depth of the bounding
//! box above its middle, facing down; y counts as up.
//!
//! Under a ceiling it hangs below it by [`MARGIN`] of the scene's height: a scene has a ceiling where vertical rays
//! from half its height meet a side that reflects, and most horizontal ones meet walls. In a scene open above, it lies
//! below the top of the box by the same margin, or, where things under it reach so high, above the box by a quarter of
//! its larger side. Its radiance, so that a white floor of the box has the mean radiance 1, is
//!
//! ```text
//! L = 1/(F + R),     R = rho/(1 - rho) A_light/A under a ceiling, elsewhere 0
//! ```
//!
//! with F the form factor from the floor to the rectangle with nothing in between, and R what the surfaces of area A
//! and mean reflectance rho give back as in an integrating sphere.
//!
//! Source of F at a point: J. R. Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*, plane element to
//! parallel rectangle. Not handled: scenes whose up is not y, and what stands between the rectangle and the floor.

use std::f64::consts::{FRAC_PI_4, TAU};

use glam::{DVec2, DVec3, Vec3, Vec3Swizzles};

use crate::light::Rgb;
use crate::scene::bounds::Bounds;
use crate::scene::enclosure::{Line, Walls};
use crate::scene::model::{Material, Scene};
use crate::scene::soup::{Polygon, Soup};

/// The name of its material and its object.
const NAME: &str = "ceiling light";

/// Distance from ceiling to luminaire, as a share of the scene's height.
const MARGIN: f64 = 0.01;

/// Share of the vertical rays that meet a ceiling where there is one; in as many more it may hang lower.
const COVERED: f64 = 0.9;

/// The mean reflectance of a room at most: what comes back of more depends on every opening.
const WHITEST: f64 = 0.95;

/// Vertical rays each way through the rectangle, and points each way on the floor.
const RAYS: usize = 16;

/// Adds the luminaire of a scene to the polygons that the scene was made of.
pub(crate) fn add(scene: &Scene, soup: &mut Soup) {
    let walls = Walls::new(scene, 0..scene.solid_faces());
    let (size, middle, bottom) = (walls.bounds.size(), walls.bounds.middle(), walls.bounds.low.y);
    let wide = size.x.max(size.z).max(MARGIN);
    // What has no depth, like a wall alone, is lit from a place that has.
    let side = |length: f64| if length < MARGIN * size.max_element() { 0.5 * wide } else { length };
    let floor = 0.5 * DVec2::new(side(size.x), side(size.z));
    let panel = 0.5 * floor;
    let is_below = |face: u32| {
        let flat = scene.corners(face).map(|p| (p.as_dvec3() - middle).xz() / panel);
        let Bounds { low, high } = Bounds::of(flat);
        let top = scene.corners(face).into_iter().fold(f32::MIN, |top, p| top.max(p.y));
        low.cmple(DVec2::ONE).all() && high.cmpge(DVec2::NEG_ONE).all() && f64::from(top) - bottom >= 0.9 * size.y
    };
    let ceiling = ceiling(&walls, middle, panel);
    let height = match ceiling {
        Some(ceiling) => ceiling - bottom - MARGIN * size.y,
        None if (0..scene.solid_faces()).any(is_below) => size.y + 0.25 * wide,
        None => (1.0 - MARGIN) * size.y,
    };
    let factor = grid().map(|point| point_factor(floor * point, panel, height)).sum::<f64>() / (RAYS * RAYS) as f64;
    let returned = if ceiling.is_some() { returned(scene) * 4.0 * panel.x * panel.y } else { 0.0 };
    let radiance = (factor + returned).recip().min(1e30) as f32;
    let first = soup.vertices.len() as u32;
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, z)| DVec3::new(middle.x + x * panel.x, bottom + height, middle.z + z * panel.y));
    soup.vertices.extend(corners.map(|corner| scene.frame.to_file(corner)));
    soup.corners.extend(first..first + 4);
    let (material, object) = (soup.materials.len() as u32, soup.objects.len() as u32);
    soup.polygons.push(Polygon { corners: 4, material, object, number: 0 });
    soup.objects.push(NAME.to_owned());
    soup.materials.push(Material::new(NAME, Rgb::ZERO, Rgb::splat(radiance)));
}

/// The y of the ceiling above a rectangle, if there is one.
fn ceiling(walls: &Walls, middle: DVec3, panel: DVec2) -> Option<f64> {
    let start = |at: DVec2| (middle + DVec3::new(panel.x * at.x, 0.0, panel.y * at.y)).as_vec3();
    let upwards: Vec<Line> = grid().map(|at| (start(at), Vec3::Y)).collect();
    let lit = walls.nearest(&upwards).into_iter().flatten().filter(|met| met.is_live);
    let mut heights: Vec<f64> = lit.map(|met| middle.y + f64::from(met.distance)).collect();
    heights.sort_by(f64::total_cmp);
    let angle = |i: u32| (f64::from(i) + 0.03) * FRAC_PI_4;
    let around = (0..8).map(|i| (middle.as_vec3(), DVec3::new(angle(i).cos(), 0.0, angle(i).sin()).as_vec3()));
    let walled = walls.nearest(&around.collect::<Vec<Line>>()).into_iter().flatten().count();
    (heights.len() as f64 >= COVERED * (RAYS * RAYS) as f64 && walled >= 4).then(|| heights[heights.len() / 10])
}

/// Points spread evenly over the square from (-1, -1) to (1, 1).
fn grid() -> impl Iterator<Item = DVec2> {
    let place = |i: usize| (2 * i + 1) as f64 / RAYS as f64 - 1.0;
    (0..RAYS * RAYS).map(move |i| DVec2::new(place(i / RAYS), place(i % RAYS)))
}

/// The form factor from a point of the floor, given from its middle, to a rectangle of half sides `panel` at a height.
fn point_factor(point: DVec2, panel: DVec2, height: f64) -> f64 {
    let [low, high] = [-panel, panel].map(|corner| (corner - point) / height);
    // To a rectangle at height 1 with one corner right above and the opposite one at (x, z).
    let part = |a: f64, b: f64| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
    let corner = |x, z| (part(x, z) + part(z, x)) / TAU;
    corner(high.x, high.y) - corner(low.x, high.y) - corner(high.x, low.y) + corner(low.x, low.y)
}

/// rho/((1 - rho) A), what a closed room gives back of each unit of power; rho counts as [`WHITEST`] at most.
fn returned(scene: &Scene) -> f64 {
    let (mut area, mut reflecting) = (0.0, 0.0);
    for face in 0..scene.solid_faces() {
        area += scene.area(face);
        reflecting += scene.area(face) * scene.means_of_face(face).rho.element_sum() / 3.0;
    }
    let rho = (reflecting / area).min(WHITEST);
    rho / ((1.0 - rho) * area)
}
