//! A luminaire added to a scene that brings none: a horizontal rectangle above the middle, facing down.
//!
//! Its sides are half the width and depth of the scene's bounding box; y counts as up. Under a ceiling it hangs below
//! it by [`MARGIN`] of the scene's height. A scene counts as having a ceiling where vertical lines through the
//! rectangle meet a surface with a high free space below, and most horizontal lines from there meet walls. In a scene
//! open above, the rectangle lies below the top of the bounding box by the same margin, or, where things under it reach
//! so high, above the box by a quarter of its larger side.
//!
//! Its radiance gives the floor of the bounding box a mean irradiance of about pi W/m², so that a white floor has the
//! mean radiance 1: L = 1/(F + R), where F is the form factor from the floor to the rectangle with nothing in between.
//! Under a ceiling R = rho/(1 - rho) A_light/A is what the surfaces of area A and mean reflectance rho give back as in
//! an integrating sphere; elsewhere it is 0.
//!
//! Source of F at a point: J. R. Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*, plane element to
//! parallel rectangle.
//!
//! Not handled: scenes whose up is not y, and what stands between the rectangle and the floor.

use std::f64::consts::{FRAC_PI_4, TAU};

use glam::{DVec2, DVec3, Vec3Swizzles, Vec4, Vec4Swizzles};

use crate::light::Rgb;
use crate::scene::build::{Polygon, Soup, assemble};
use crate::scene::error::SceneError;
use crate::scene::polygon::{Triangulator, newell};
use crate::scene::{AddedLight, Camera, Material, Scene, Sides, SkyLight, UnitFrame};

/// The name of its material and its object.
const NAME: &str = "ceiling light";

/// Distance from ceiling to luminaire, as a share of the scene's height.
const MARGIN: f64 = 0.01;

/// Height of a free space below a ceiling at least, as a share of the scene's height.
const FREE: f64 = 0.25;

/// Share of the vertical lines that meet a ceiling where there is one.
const COVERED: f64 = 0.9;

/// The mean reflectance of a room at most: what comes back of more depends on every opening.
const WHITEST: f64 = 0.95;

/// Vertical lines each way through the rectangle, and points each way on the floor.
const LINES: usize = 16;

/// Makes the scene as [`assemble`] does, with the light asked for. The default camera frames the rest alone, and is
/// inside of a room where the light is.
pub(crate) fn assemble_lit(mut soup: Soup, light: Option<AddedLight>) -> Result<Scene, SceneError> {
    let frames = soup.cameras.is_empty() && !soup.has_view;
    if light == Some(AddedLight::Sky) {
        soup.has_view = true;
        let mut scene = assemble(soup)?;
        scene.set_sky(SkyLight { upper: Rgb::ONE, lower: Rgb::ONE }, DVec3::Y);
        if frames {
            scene.camera = Camera::framing(&scene);
        }
        return Ok(scene);
    }
    let frame = UnitFrame::of(soup.corners.iter().map(|&v| soup.vertices[v as usize]));
    let (Some(AddedLight::Ceiling), Some(frame)) = (light, frame) else {
        return assemble(soup);
    };
    let (file, polygons, object) = (soup.file.clone(), soup.polygons.len(), soup.objects.len() as u32);
    let panel = Panel::over(&Surfaces::of(&soup, &frame));
    panel.hang(&mut soup, &frame);
    soup.has_view = true;
    let mut scene = assemble(soup)?;
    let own = scene.faces.iter().position(|face| face.object == object).unwrap_or(scene.faces.len());
    if own == 0 {
        return Err(SceneError::Empty { file, dropped: polygons });
    }
    if frames {
        scene.camera = Camera::framing_first(&scene, own as u32);
    }
    Ok(scene)
}

/// All polygons as triangles in unit coordinates, with their area and what it reflects.
#[derive(Default)]
struct Surfaces {
    triangles: Vec<[DVec3; 3]>,
    /// Which sides of each triangle reflect.
    sides: Vec<Sides>,
    area: f64,
    /// The sum of area times mean rho of the channels.
    reflecting: f64,
}

impl Surfaces {
    fn of(soup: &Soup, frame: &UnitFrame) -> Surfaces {
        let mut triangulator = Triangulator::default();
        let (mut found, mut rest) = (Surfaces::default(), &soup.corners[..]);
        for polygon in &soup.polygons {
            let first = soup.corners.len() - rest.len();
            let (corners, after) = rest.split_at(polygon.corners);
            rest = after;
            let points: Vec<DVec3> = corners.iter().map(|&v| frame.to_unit(soup.vertices[v as usize])).collect();
            triangulator.run(&points);
            let area = 0.5 * newell(&points).length();
            let colours = soup.colours.get(first..first + polygon.corners).unwrap_or(&[]);
            let colour =
                if colours.is_empty() { Vec4::ONE } else { colours.iter().sum::<Vec4>() / colours.len() as f32 };
            let rho = soup.materials[polygon.material as usize].mean_rho() * colour.xyz();
            found.area += area;
            found.reflecting += area * f64::from(rho.element_sum() / 3.0);
            let sides = soup.materials[polygon.material as usize].sides;
            found.sides.extend(triangulator.triangles.iter().map(|_| sides));
            found.triangles.extend(triangulator.triangles.iter().map(|triangle| triangle.map(|i| points[i as usize])));
        }
        found
    }

    /// rho/((1 - rho) A), what a closed room gives back of each unit of power; rho counts as [`WHITEST`] at most.
    fn returned(&self) -> f64 {
        let rho = (self.reflecting / self.area).min(WHITEST);
        rho / ((1.0 - rho) * self.area)
    }
}

/// The rectangle above the floor, unit coordinates.
struct Panel {
    /// The middle of the floor.
    middle: DVec3,
    /// Half of the floor's width and depth; those of the rectangle are half as large.
    half: DVec2,
    /// Height above the floor.
    height: f64,
    /// Share of its power that surfaces give back to each unit of area.
    returned: f64,
}

impl Panel {
    fn over(surfaces: &Surfaces) -> Panel {
        let triangles = &surfaces.triangles[..];
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let corners = triangles.iter().flatten();
        let (low, high) = corners.fold(start, |(low, high), &p| (low.min(p), high.max(p)));
        let (size, middle) = (high - low, 0.5 * (low + high));
        let wide = size.x.max(size.z);
        // What has no depth, like a wall alone, is lit from a place that has.
        let side = |length: f64| if length < MARGIN * size.max_element() { 0.5 * wide.max(MARGIN) } else { length };
        let half = 0.5 * DVec2::new(side(size.x), side(size.z));
        let height = size.y + 0.25 * wide.max(MARGIN);
        let mut panel = Panel { middle: middle.with_y(low.y), half, height, returned: 0.0 };
        let lines = panel.lines(surfaces);
        if let Some(ceiling) = panel.ceiling(&lines, size.y).filter(|&y| panel.has_walls(triangles, y)) {
            panel.height = ceiling - MARGIN * size.y;
            panel.returned = surfaces.returned();
        } else if !triangles.iter().any(|triangle| panel.is_below(triangle, 0.9 * size.y)) {
            panel.height = (1.0 - MARGIN) * size.y;
        }
        panel
    }

    /// Whether part of a triangle may lie under the rectangle and reach above a height: told by its bounding box.
    fn is_below(&self, triangle: &[DVec3; 3], height: f64) -> bool {
        let flat = triangle.map(|p| (p - self.middle).xz() / (0.5 * self.half));
        let (low, high) = (flat[0].min(flat[1]).min(flat[2]), flat[0].max(flat[1]).max(flat[2]));
        let beside = low.cmpgt(DVec2::ONE).any() || high.cmplt(DVec2::NEG_ONE).any();
        !beside && triangle.iter().any(|p| p.y - self.middle.y >= height)
    }

    /// What vertical lines through the rectangle meet, from above.
    fn lines(&self, surfaces: &Surfaces) -> Vec<Vec<Crossing>> {
        let mut lines: Vec<Vec<Crossing>> = (0..LINES * LINES).map(|_| Vec::new()).collect();
        for (triangle, &sides) in surfaces.triangles.iter().zip(&surfaces.sides) {
            let flat =
                triangle.map(|p| ((p - self.middle).xz() / (0.5 * self.half) + 1.0) * (0.5 * LINES as f64) - 0.5);
            let low = flat[0].min(flat[1]).min(flat[2]).ceil().max(DVec2::ZERO);
            let high = flat[0].max(flat[1]).max(flat[2]).floor().min(DVec2::splat(LINES as f64 - 1.0));
            for row in low.y as usize..(high.y + 1.0).max(0.0) as usize {
                for column in low.x as usize..(high.x + 1.0).max(0.0) as usize {
                    let heights = triangle.map(|p| p.y - self.middle.y);
                    let found = crossing(flat, heights, DVec2::new(column as f64, row as f64));
                    lines[row * LINES + column].extend(found.map(|found| Crossing { sides, ..found }));
                }
            }
        }
        lines.iter_mut().for_each(|line| line.sort_by(|a, b| b.height.total_cmp(&a.height)));
        lines
    }

    /// The height of the ceiling, if most lines meet one; things that hang from it may be lower in a tenth of them.
    fn ceiling(&self, lines: &[Vec<Crossing>], height: f64) -> Option<f64> {
        let mut found: Vec<f64> = lines.iter().filter_map(|line| above_free_space(line, FREE * height)).collect();
        found.sort_by(f64::total_cmp);
        (found.len() as f64 >= COVERED * lines.len() as f64).then(|| found[found.len() / 10])
    }

    /// Whether most horizontal lines from the middle of the space below a ceiling meet something.
    fn has_walls(&self, triangles: &[[DVec3; 3]], ceiling: f64) -> bool {
        let start = self.middle + 0.5 * ceiling * DVec3::Y;
        let ways = (0..8).map(|i| DVec2::from_angle((f64::from(i) + 0.03) * FRAC_PI_4));
        let walled = ways.filter(|way| triangles.iter().any(|triangle| meets(triangle, start, *way)));
        walled.count() >= 4
    }

    /// Adds it to the polygons, which are in the file's units.
    fn hang(&self, soup: &mut Soup, frame: &UnitFrame) {
        let first = soup.vertices.len() as u32;
        let signs = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        soup.vertices.extend(signs.map(|(x, z)| {
            let offset = DVec3::new(0.5 * x * self.half.x, self.height, 0.5 * z * self.half.y);
            frame.to_file(self.middle + offset)
        }));
        soup.corners.extend(first..first + 4);
        let (material, object) = (soup.materials.len() as u32, soup.objects.len() as u32);
        soup.polygons.push(Polygon { corners: 4, material, object, number: 0 });
        soup.objects.push(NAME.to_owned());
        let returned = self.returned * self.half.x * self.half.y;
        let radiance = (self.form_factor() + returned).recip().min(1e30) as f32;
        soup.materials.push(Material::new(NAME, Rgb::ZERO, Rgb::splat(radiance)));
    }

    /// From the floor to the rectangle: the mean over points of the floor.
    fn form_factor(&self) -> f64 {
        let place = |i: usize| (2 * i + 1) as f64 / LINES as f64 - 1.0;
        let points = (0..LINES * LINES).map(|i| self.half * DVec2::new(place(i / LINES), place(i % LINES)));
        points.map(|point| self.point_factor(point)).sum::<f64>() / (LINES * LINES) as f64
    }

    /// From a point of the floor, given from its middle.
    fn point_factor(&self, point: DVec2) -> f64 {
        let [low, high] = [-0.5, 0.5].map(|sign| (sign * self.half - point) / self.height);
        corner_factor(high.x, high.y) - corner_factor(low.x, high.y) - corner_factor(high.x, low.y)
            + corner_factor(low.x, low.y)
    }
}

/// From a horizontal point to a rectangle at height 1 above it with one corner right above and the opposite one at
/// (x, z); negative where one of them is.
fn corner_factor(x: f64, z: f64) -> f64 {
    let part = |a: f64, b: f64| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
    (part(x, z) + part(z, x)) / TAU
}

/// Where a vertical line meets a triangle.
#[derive(Clone, Copy)]
struct Crossing {
    height: f64,
    /// Whether the front looks up.
    up: bool,
    sides: Sides,
}

/// The crossing of the vertical line through `point` with a triangle given by its plan and heights.
fn crossing([a, b, c]: [DVec2; 3], heights: [f64; 3], point: DVec2) -> Option<Crossing> {
    let double_area = (b - a).perp_dot(c - a);
    let [u, v, w] = [(b, c), (c, a), (a, b)].map(|(p, q)| (p - point).perp_dot(q - point) / double_area);
    let height = u * heights[0] + v * heights[1] + w * heights[2];
    // x to the right and z down: counter-clockwise in the plan is seen from below.
    (u >= 0.0 && v >= 0.0 && w >= 0.0).then_some(Crossing { height, up: double_area < 0.0, sides: Sides::One })
}

/// The lowest surface with a high free space below it; the inside of a body is not free, which one-sided surfaces that
/// look away from it tell.
fn above_free_space(line: &[Crossing], free: f64) -> Option<f64> {
    let below = |i: usize| line.get(i + 1).map_or(0.0, |next| next.height);
    let is_skin = |crossing: &Crossing, up: bool| crossing.sides == Sides::One && crossing.up == up;
    let inside = |i: usize| is_skin(&line[i], true) && line.get(i + 1).is_some_and(|next| is_skin(next, false));
    let first = (0..line.len()).find(|&i| line[i].height - below(i) > free && !inside(i))?;
    Some(line[first].height)
}

/// Whether the horizontal ray meets the triangle.
fn meets(triangle: &[DVec3; 3], start: DVec3, way: DVec2) -> bool {
    // Seen along the ray: across and up.
    let seen = triangle.map(|p| DVec2::new((p - start).xz().perp_dot(way), p.y - start.y));
    let ahead = triangle.map(|p| (p - start).xz().dot(way));
    crossing(seen, ahead, DVec2::ZERO).is_some_and(|met| met.height > 0.0)
}
