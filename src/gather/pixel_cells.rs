//! Cells of a pixel on a face's plane: where they lie in its texture, and its mean reflectance over them.
//!
//! Not handled: surfaces with masks, whose points count by how much of a surface is there.

use glam::{DVec2, DVec3};

use crate::gather::view::View;
use crate::rays::Side;

/// How many times as much surface a point of a pixel stands for as another, at most, along each axis: a pixel is taken
/// apart until that holds in each part, as the mean over a part is one over the surface. Such a mean is off by what
/// texels differ in the direction of the tilt, times `(UNEVEN - 1) / 6` at most; with 1.1 a room of checks in one pixel
/// each was off by 0.5 % at any number of rays.
pub(crate) const UNEVEN: f64 = 1.01;
/// Cells to a side at least: of fewer, each lies beside all others.
const LEAST: u32 = 4;

/// The square cells of a pixel that its camera rays stand for.
#[derive(Clone, Debug)]
pub(crate) struct PixelCells {
    /// Cells to a side.
    number: u32,
    /// The surface that rays see through each, row by row.
    shown: Vec<Shown>,
}

/// What the rays through a cell see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    Nothing,
    /// The surface of this number.
    One(u32),
    Several,
}

impl PixelCells {
    /// No more cells than rays, none of which has seen anything yet; none at all where rays are few.
    pub fn new(rays: u32) -> Option<PixelCells> {
        let number = 1_u32 << (rays.max(1).ilog2() / 2);
        let shown = || vec![Shown::Nothing; (number * number) as usize];
        (number >= LEAST).then(|| PixelCells { number, shown: shown() })
    }

    /// Adds that a ray through a place of the pixel sees surface number `surface`.
    pub fn see(&mut self, at: DVec2, surface: u32) {
        let [x, y] = self.cell(at);
        let shown = &mut self.shown[(y * self.number + x) as usize];
        *shown = match *shown {
            Shown::Nothing => Shown::One(surface),
            Shown::One(own) if own == surface => Shown::One(own),
            _ => Shown::Several,
        };
    }

    /// Whether rays see one surface, and nothing else, through the cell around a place and all cells beside it.
    pub fn is_within_surface(&self, at: DVec2) -> bool {
        let [x, y] = self.cell(at);
        let around = |p: u32| p.saturating_sub(1)..(p + 2).min(self.number);
        let shown = |x: u32, y: u32| self.shown[(y * self.number + x) as usize];
        let own = shown(x, y);
        matches!(own, Shown::One(_)) && around(y).all(|y| around(x).all(|x| shown(x, y) == own))
    }

    /// The mean reflectance of a surface over the cell around a place of pixel k; none where it has no texture, or is
    /// not evenly spread over the cell.
    pub fn mean(&self, view: &View, k: usize, face: u32, at: DVec2) -> Option<DVec3> {
        let texture = view.scene.whole_texture(face)?;
        let [low, high] = self.around(at);
        if unevenness(view, k, face, [low, high])?.max_element() > UNEVEN {
            return None;
        }
        let place = |u: f64, v: f64| coordinates(view, k, face, DVec2::new(u, v));
        let corners = [place(low.x, low.y)?, place(high.x, low.y)?, place(high.x, high.y)?, place(low.x, high.y)?];
        Some(view.scene.material(face).rho.as_dvec3() * texture.mean_in_pixel(corners))
    }

    /// Column and row of the cell that a place of the pixel lies in.
    fn cell(&self, at: DVec2) -> [u32; 2] {
        (at * f64::from(self.number)).to_array().map(|p| (p as u32).min(self.number - 1))
    }

    /// The lower left and upper right of the cell around a place.
    fn around(&self, at: DVec2) -> [DVec2; 2] {
        let [x, y] = self.cell(at);
        [0, 1].map(|step| DVec2::new((x + step).into(), (y + step).into()) / f64::from(self.number))
    }
}

/// How many times as much of a face's plane one corner of a part of pixel k stands for as the next along each axis.
pub(crate) fn unevenness(view: &View, k: usize, face: u32, [low, high]: [DVec2; 2]) -> Option<DVec2> {
    let forward = view.scene.camera.forward.as_dvec3();
    let camera = view.scene.camera.position.as_dvec3();
    let depth = |u: f64, v: f64| Some((in_plane(view, k, face, DVec2::new(u, v))? - camera).dot(forward));
    let [a, b] = [depth(low.x, low.y)?, depth(high.x, low.y)?];
    let [c, d] = [depth(low.x, high.y)?, depth(high.x, high.y)?];
    let over = |p: f64, q: f64| (p / q).max(q / p);
    // A point at depth z stands for an area that goes as z³.
    Some(DVec2::new(over(a, b).max(over(c, d)), over(a, c).max(over(b, d))).powf(3.0))
}

/// Coordinates of the texture at a point of pixel k.
pub(crate) fn coordinates(view: &View, k: usize, face: u32, at: DVec2) -> Option<DVec2> {
    let found = view.scene.coordinates_beyond(face, in_plane(view, k, face, at)?);
    found.is_finite().then_some(found)
}

/// Where the ray through a point of pixel k meets a face's plane, if it does.
fn in_plane(view: &View, k: usize, face: u32, at: DVec2) -> Option<DVec3> {
    let ray = view.camera_ray(k, at.x as f32, at.y as f32);
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let normal = view.patches.normal(face, Side::Front).as_dvec3();
    let corner = view.scene.corners(face)[0].as_dvec3();
    let t = (corner - origin).dot(normal) / direction.dot(normal);
    (t > 0.0 && t.is_finite()).then(|| origin + t * direction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Mode;

    const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/room.toml");
    const SIZE: usize = 24;

    #[test]
    fn cells_are_no_more_than_rays_and_cover_the_pixel() {
        for (rays, number) in [(16, 4), (63, 4), (64, 8), (255, 8), (256, 16)] {
            let cells = PixelCells::new(rays).unwrap();
            assert_eq!(cells.number, number);
            // Corners of cells are multiples of a 16th.
            let points = (0..256).map(|k| (DVec2::new(f64::from(k % 16), f64::from(k / 16)) + 0.5) / 16.0);
            let area: f64 = points
                .map(|at| {
                    let [low, high] = cells.around(at);
                    assert!(low.cmple(at).all() && at.cmple(high).all(), "{rays}: {low} {at} {high}");
                    // Each cell as often as a 16th of the pixel fits in.
                    1.0 / (256.0 * (high - low).element_product())
                })
                .sum();
            assert!((area - f64::from(number * number)).abs() < 1e-9, "{rays}: {area} cells");
        }
        assert!((0..16).all(|rays| PixelCells::new(rays).is_none()), "each of four cells lies beside all others");
    }

    #[test]
    fn cells_beside_another_surface_are_not_within_one() {
        let mut cells = PixelCells::new(64).unwrap();
        let middle = |x: u32, y: u32| (DVec2::new(x.into(), y.into()) + 0.5) / 8.0;
        for (x, y) in (0..64).map(|k| (k % 8, k / 8)).filter(|&cell| cell != (1, 6)) {
            // An edge passes between columns 3 and 4; nothing is seen through one cell.
            cells.see(middle(x, y), u32::from(x > 3));
        }
        for (x, y) in (0..64).map(|k| (k % 8, k / 8)) {
            let beside_edge = (3..5).contains(&x);
            let beside_nothing = x < 3 && y > 4;
            assert_eq!(cells.is_within_surface(middle(x, y)), !beside_edge && !beside_nothing, "{x} {y}");
        }
        // A second ray through a cell that sees another surface makes it an edge, for its neighbours too.
        cells.see(middle(6, 1), 0);
        assert!(!cells.is_within_surface(middle(6, 1)) && !cells.is_within_surface(middle(7, 2)));
        assert!(cells.is_within_surface(middle(7, 3)));
    }

    /// Rays of a pixel on an edge once had the texel that each met, and such pixels took ten times as many of them.
    #[test]
    fn the_mean_over_cells_is_that_over_the_pixel() {
        let lights = lights_of(ROOM, Mode::Local.transport(), 100);
        let view = View::new(&lights, (SIZE, SIZE).into());
        let mut judged = 0;
        for k in (0..SIZE * SIZE).step_by(7) {
            let Some(hit) = view.rays.closest(&view.camera_ray(k, 0.5, 0.5)) else { continue };
            let mean = |n: u32| {
                let cells = PixelCells::new(n * n).unwrap();
                let middles = (0..n * n).map(|i| (DVec2::new((i % n).into(), (i / n).into()) + 0.5) / f64::from(n));
                let sum = middles.map(|at| cells.mean(&view, k, hit.face, at)).sum::<Option<DVec3>>();
                sum.map(|sum| sum / f64::from(n * n))
            };
            let [Some(few), Some(many)] = [4, 8].map(mean) else { continue };
            // A cell counts by its share of the pixel, which a surface at a slant is up to UNEVEN times as much of
            // along each axis.
            let off = (many - few).abs().max_element();
            assert!(off < (UNEVEN - 1.0) / 3.0, "{k}: {off}");
            judged += 1;
        }
        assert!(judged > 20, "{judged}");
    }
}
