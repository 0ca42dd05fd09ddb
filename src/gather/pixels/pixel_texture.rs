//! The texture that a pixel shows: means over pixels or parts of them, so that finer textures are no noise.
//!
//! Where all camera rays end on one plane surface the mean reflectance over the pixel is known, and stands for each
//! ray. Where a pixel shows several surfaces, a ray has that of its surface over a cell as large as its share of the
//! pixel, if the cells around show nothing else. At an edge it keeps its own point's: the mean over a cell would
//! include hidden texels, alike in both halves, so that the standard error would not show it. What light makes of a
//! mean is up to [`crate::gather::pixels::textured_light`].
//!
//! Worth: rooms with images take 1.2 to 1.7 times as long as with their mean colours (docs/validation.md, Textures);
//! pixels at edges took ten times as many rays.
//!
//! Not handled: textures of surfaces with masks, which keep the mean of the rays.

use glam::{DVec2, DVec3, UVec2, Vec3};

use crate::gather::pixels::pixel_cell::cells_to_a_side;
use crate::gather::pixels::pixel_layer::{Layer, SurfaceKey};
use crate::light::{Rgb, over};
use crate::rays::{Hit, Side};
use crate::reading::view::View;
use crate::scene::Scene;
use crate::surfaces::SurfacePoint;

/// Parts of a pixel at most; nearer to the horizon of a plane a pixel keeps its rays' mean.
const PARTS: u32 = 64;
/// Distance of the textures of two faces that count as one, as a share of the extent over which they are compared.
const APART: f64 = 0.01;

/// A point that a camera ray sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenPoint {
    /// The number of the ray within its half.
    pub index: u32,
    /// Where the ray passes through the pixel, shares of its width and height.
    pub at: DVec2,
    pub hit: Hit,
    /// In the face's plane.
    pub position: Vec3,
    pub key: SurfaceKey,
    /// Reflectance there.
    pub rho: Rgb,
    /// Mean reflectance over the part of the pixel that the ray stands for, where that is known.
    pub mean: Option<DVec3>,
    /// Share of the ray's light that comes from there; below 1 on and behind masks.
    pub share: f32,
}

/// The texture of one pixel, as far as its camera rays show.
#[derive(Debug, Default)]
pub(crate) enum PixelTexture {
    /// No camera ray was cast yet.
    #[default]
    Unknown,
    /// All camera rays so far met one textured plane surface.
    One(Box<Footprint>),
    /// There is no texture, or more than one surface.
    Varied,
}

/// A pixel on a plane surface with a texture.
#[derive(Debug)]
pub(crate) struct Footprint {
    pub key: SurfaceKey,
    /// A face of the surface; its texture goes on beyond its edges.
    pub face: u32,
    /// Mean reflectance over the pixel.
    pub rho: DVec3,
    /// How long the pixel is in coordinates of the texture.
    pub extent: f64,
}

impl PixelTexture {
    /// Adds the points that more camera rays of pixel k see; `all`: whether each of the rays saw one. Returns the mean
    /// reflectance of the pixel where it is known.
    pub(crate) fn see(&mut self, view: &View, k: usize, points: &[SeenPoint], all: bool) -> Option<DVec3> {
        if let PixelTexture::Unknown = self {
            let first = points.first().and_then(|point| Footprint::new(view, k, point));
            *self = first.map_or(PixelTexture::Varied, |own| PixelTexture::One(Box::new(own)));
        }
        let PixelTexture::One(own) = self else { return None };
        if !(all && points.iter().all(|point| own.holds(view.scene, point))) {
            *self = PixelTexture::Varied;
            return None;
        }
        Some(own.rho)
    }

    /// Ratio of the mean reflectance to that of another pixel of the same surface; 1 for different ones.
    pub(crate) fn over(&self, other: &PixelTexture) -> DVec3 {
        match (self, other) {
            (PixelTexture::One(own), PixelTexture::One(other)) if own.key == other.key => over(own.rho, other.rho),
            _ => DVec3::ONE,
        }
    }
}

impl Footprint {
    /// Pixel k on the plane of a point that it sees.
    fn new(view: &View, k: usize, seen: &SeenPoint) -> Option<Footprint> {
        let face = seen.hit.face;
        let texture = view.scene.whole_texture(face)?;
        let parts = parts(view, k, face)?;
        let place = |x: u32, y: u32| coordinates(view, k, face, DVec2::new(x.into(), y.into()) / parts.as_dvec2());
        let mut sum = DVec3::ZERO;
        for (x, y) in (0..parts.y).flat_map(|y| (0..parts.x).map(move |x| (x, y))) {
            let part = [place(x, y)?, place(x + 1, y)?, place(x + 1, y + 1)?, place(x, y + 1)?];
            sum += texture.mean_in_pixel(part);
        }
        let mean = sum / f64::from(parts.element_product());
        let UVec2 { x, y } = parts;
        let extent = place(0, 0)?.distance(place(x, y)?).max(place(x, 0)?.distance(place(0, y)?));
        Some(Footprint { key: seen.key, face, rho: view.scene.material(face).rho.as_dvec3() * mean, extent })
    }

    /// Whether a point lies on this surface, its texture as on the first face.
    fn holds(&self, scene: &Scene, point: &SeenPoint) -> bool {
        self.key == point.key && goes_on(scene, self.face, point, || self.extent)
    }
}

/// The number of the surface of each point that a pixel's rays see, each with one continuous texture.
pub(crate) fn surfaces(view: &View, seen: &[SeenPoint]) -> Vec<u32> {
    let mut known: Vec<Layer> = Vec::new();
    let number = |point: &SeenPoint| {
        let own = view.surface_point(point.hit.face, point.hit.side, point.position);
        let distance = |from: &SurfacePoint| {
            let [a, b] = [from, &own].map(|p| view.scene.coordinates_beyond(from.face, p.position.as_dvec3()));
            a.distance(b)
        };
        let goes_on = |from: &SurfacePoint| goes_on(view.scene, from.face, point, || distance(from));
        let same = known.iter().position(|l| l.holds(point.key, &own) && goes_on(&l.first));
        let number = same.unwrap_or_else(|| {
            known.push(Layer::new(point.key, own));
            known.len() - 1
        });
        number as u32
    };
    seen.iter().map(number).collect()
}

/// Whether the texture of a face continues at a point of another one, to a small share of an extent in coordinates.
fn goes_on(scene: &Scene, face: u32, point: &SeenPoint, extent: impl FnOnce() -> f64) -> bool {
    let alike = |face: u32| scene.coordinates_beyond(face, point.position.as_dvec3());
    face == point.hit.face || alike(face).distance(alike(point.hit.face)) <= APART * extent()
}

/// Parts along each axis that pixel k is taken into, so that each of them is evenly spread over a face's plane.
fn parts(view: &View, k: usize, face: u32) -> Option<UVec2> {
    let uneven = unevenness(view, k, face, [DVec2::ZERO, DVec2::ONE])?;
    let parts = (uneven.map(f64::ln) / UNEVEN.ln()).ceil().max(DVec2::ONE);
    (parts.element_product() <= f64::from(PARTS)).then(|| parts.as_uvec2())
}

/// Largest ratio of the surface areas seen per pixel area along each axis: a pixel is divided until that holds in each
/// part, as the mean over a part is one over the surface. Such a mean is off by `(UNEVEN - 1) / 6` of the contrast of
/// texels at most.
const UNEVEN: f64 = 1.01;
/// Cells to a side at least: of fewer, each is a neighbour of all others.
const LEAST_CELLS: u32 = 4;

/// The square cells of a pixel, one for each camera ray.
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
    pub(crate) fn new(rays: u32) -> Option<PixelCells> {
        let number = cells_to_a_side(rays);
        let shown = || vec![Shown::Nothing; (number * number) as usize];
        (number >= LEAST_CELLS).then(|| PixelCells { number, shown: shown() })
    }

    /// Adds that a ray through a place of the pixel sees surface number `surface`.
    pub(crate) fn see(&mut self, at: DVec2, surface: u32) {
        let [x, y] = self.cell(at);
        let shown = &mut self.shown[(y * self.number + x) as usize];
        *shown = match *shown {
            Shown::Nothing => Shown::One(surface),
            Shown::One(own) if own == surface => Shown::One(own),
            _ => Shown::Several,
        };
    }

    /// Whether rays see one surface, and nothing else, through the cell around a place and all its neighbours.
    pub(crate) fn is_within_surface(&self, at: DVec2) -> bool {
        let [x, y] = self.cell(at);
        let around = |p: u32| p.saturating_sub(1)..(p + 2).min(self.number);
        let shown = |x: u32, y: u32| self.shown[(y * self.number + x) as usize];
        let own = shown(x, y);
        matches!(own, Shown::One(_)) && around(y).all(|y| around(x).all(|x| shown(x, y) == own))
    }

    /// The mean reflectance of a surface over the cell around a place of pixel k; none where it has no texture, or is
    /// not evenly spread over the cell.
    pub(crate) fn mean(&self, view: &View, k: usize, face: u32, at: DVec2) -> Option<DVec3> {
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

/// Ratio of the areas of a face's plane seen per pixel area, between corners of a part of pixel k along each axis.
fn unevenness(view: &View, k: usize, face: u32, [low, high]: [DVec2; 2]) -> Option<DVec2> {
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
fn coordinates(view: &View, k: usize, face: u32, at: DVec2) -> Option<DVec2> {
    let coordinates = view.scene.coordinates_beyond(face, in_plane(view, k, face, at)?);
    coordinates.is_finite().then_some(coordinates)
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
    use crate::gather::nearness::NOBODY;
    use crate::gather::pixels::adaptive_sampling::{Plan, sample_pixels};
    use crate::gather::pixels::camera_rays::{CameraRays, CameraSampling};
    use crate::gather::pixels::pixel::Pixel;
    use crate::gather::sampling::Limit;
    use crate::light::Mode;
    use crate::reading::patch_light::Fields;
    use crate::reading::view::lights_of;

    const ROOM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/room.toml");
    const SIZE: usize = 24;

    /// Pixels of the textured room in the local mode, where light is smooth within each.
    fn pixels(view: &View) -> Vec<Pixel> {
        let fields = Fields::new(&[vec![Rgb::ONE; view.patches.len()]]);
        let sampling = CameraSampling { tabled: 64, visibility: 1, seed: 0 };
        let plan = Plan { first: 8, noise: None, limit: Limit::NONE, nearing: NOBODY };
        sample_pixels(&CameraRays::new(view, &fields, &sampling), &plan)
    }

    #[test]
    fn the_mean_over_a_pixel_is_that_of_many_points() {
        let lights = lights_of(ROOM, Mode::Local.transport(), 100);
        let view = View::new(&lights, (SIZE, SIZE).into());
        let mut judged = 0;
        for (k, pixel) in pixels(&view).iter().enumerate() {
            let PixelTexture::One(own) = &pixel.texture else { continue };
            let texture = view.scene.whole_texture(own.face).unwrap();
            const N: u32 = 128;
            let points = (0..N * N).map(|i| DVec2::new((i % N).into(), (i / N).into()) + 0.5);
            let colour = |at: DVec2| texture.colour(coordinates(&view, k, own.face, at / f64::from(N)).unwrap());
            let sum: DVec3 = points.map(|at| colour(at).as_dvec3()).sum();
            let expected = sum / f64::from(N * N) * view.scene.material(own.face).rho.as_dvec3();
            // Points of a part count by at most UNEVEN along each axis, so a mean is off by at most half of that of
            // what texels differ by in one direction, of which a third is left in the mean over the part.
            assert!((own.rho - expected).abs().max_element() < (UNEVEN - 1.0) / 3.0, "{k} {own:?} {expected}");
            judged += 1;
        }
        assert!(judged > SIZE * SIZE / 4, "{judged}");
    }

    #[test]
    fn textures_finer_than_a_pixel_leave_no_noise_where_light_is_smooth() {
        let lights = lights_of(ROOM, Mode::Local.transport(), 100);
        let view = View::new(&lights, (SIZE, SIZE).into());
        for (k, pixel) in pixels(&view).iter().enumerate() {
            let PixelTexture::One(own) = &pixel.texture else { continue };
            let [a, b] = pixel.layers[0].reflected().map(|sum| sum / f64::from(pixel.count));
            assert!((a - b).abs().max_element() < 1e-9 && (a - own.rho).abs().max_element() < 1e-9, "{k} {a} {b}");
        }
    }

    #[test]
    fn a_pixel_that_shows_several_surfaces_keeps_its_own_reflectances() {
        let lights = lights_of(ROOM, Mode::Local.transport(), 100);
        let view = View::new(&lights, (SIZE, SIZE).into());
        let seen = pixels(&view);
        let one = |pixel: &Pixel| matches!(pixel.texture, PixelTexture::One(_));
        assert!(seen.iter().all(|pixel| pixel.layers.len() <= 1 || !one(pixel)));
        assert!(seen.iter().any(|pixel| pixel.layers.len() > 1));
        // Light on the same surface goes as the reflectances.
        let two: Vec<&PixelTexture> = seen.iter().filter(|p| one(p)).map(|p| &p.texture).collect();
        for pair in two.windows(2) {
            let over = pair[0].over(pair[1]) * pair[1].over(pair[0]);
            assert!((over - 1.0).abs().max_element() < 1e-12, "{over}");
        }
    }

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
        assert!((0..16).all(|rays| PixelCells::new(rays).is_none()), "each of four cells is next to all others");
    }

    #[test]
    fn cells_next_to_another_surface_are_not_within_one() {
        let mut cells = PixelCells::new(64).unwrap();
        let middle = |x: u32, y: u32| (DVec2::new(x.into(), y.into()) + 0.5) / 8.0;
        for (x, y) in (0..64).map(|k| (k % 8, k / 8)).filter(|&cell| cell != (1, 6)) {
            // An edge passes between columns 3 and 4; nothing is seen through one cell.
            cells.see(middle(x, y), u32::from(x > 3));
        }
        for (x, y) in (0..64).map(|k| (k % 8, k / 8)) {
            let is_at_edge = (3..5).contains(&x) || x < 3 && y > 4;
            assert_eq!(cells.is_within_surface(middle(x, y)), !is_at_edge, "{x} {y}");
        }
        // A second ray through a cell that sees another surface makes it an edge, for its neighbours too.
        cells.see(middle(6, 1), 0);
        assert!(!cells.is_within_surface(middle(6, 1)) && !cells.is_within_surface(middle(7, 2)));
        assert!(cells.is_within_surface(middle(7, 3)));
    }

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
