//! Figure 4 as a page: OpenGL, the local mode and path tracing side by side, a detail of each, and signed differences.
//!
//! Not handled: the pictures and the numbers ([`local_light`](crate::study::figures::local_light)).

use crate::light::Rgb;
use crate::pictures::{Exposure, Picture, Size};
use crate::plot::{Cell, Heading, Page, PageRow, Shown, Titled, difference_scale, difference_tiles};
use crate::study::figures::local_light::{Apart, LocalEffort, LocalLight, apart, shown};
use crate::study::figures::panel::exposure_words;

/// Magnification of the details.
const ZOOM: usize = 8;
/// Where the middle of the detail is, as shares of the picture's width and height.
const DETAIL: (f64, f64) = (0.41, 0.5);

/// The page.
pub fn local_page(found: &LocalLight, effort: &LocalEffort, brighter: f32) -> Page {
    let opengl = found.opengl.as_ref();
    let columns = Columns {
        found,
        effort,
        exposure: Exposure { stops: brighter },
        five: opengl.map_or(&found.five.picture, |drawn| &drawn.picture),
        absent: opengl.err().map(|why| why.to_string()),
    };
    let row = |name: &str, note: &str, cells| PageRow { heading: Heading::new(name, note), cells };
    Page {
        title: "Local illumination is OpenGL's lighting".into(),
        rows: vec![
            row("picture", "", columns.pictures()),
            row("detail", &format!("× {ZOOM}"), columns.details()),
            row("difference", "", columns.differences()),
        ],
        caption: columns.caption(),
        panel: effort.size,
        exposure: columns.exposure,
    }
}

/// What the cells of the page are made from.
struct Columns<'a> {
    found: &'a LocalLight,
    effort: &'a LocalEffort,
    exposure: Exposure,
    /// Five lights: OpenGL's picture, or ours where there is none.
    five: &'a Picture,
    /// Why there is no picture by OpenGL.
    absent: Option<String>,
}

impl Columns<'_> {
    /// A picture of OpenGL, or the reason why there is none.
    fn drawn(&self, picture: Picture) -> Shown {
        self.absent.as_ref().map_or(Shown::Picture(picture), |why| Shown::Hatched(why.clone()))
    }

    /// The three pictures, with their seconds.
    fn pictures(&self) -> Vec<Cell> {
        let (found, samples) = (self.found, self.effort.samples);
        let drawn = found.opengl.as_ref().map_or(String::new(), |drawn| {
            format!("{:.1} s with {samples} samples a pixel, {}", drawn.seconds, short(&drawn.renderer))
        });
        let local = format!(
            "{:.1} s with {samples} camera rays a pixel; {} from a quadrature of it",
            found.local.seconds.total,
            percent(found.quadrature)
        );
        let [once, enough] = found.traced_seconds;
        let traced = format!(
            "{once:.1} s with {samples} paths a pixel; {:.0} times as long for halflight's noise",
            enough / once
        );
        let picture = |picture: &Picture| Shown::Picture(picture.clone());
        vec![
            cell("OpenGL", "five point lights", self.drawn(self.five.clone()), drawn),
            cell("halflight, local", "α = 0, τ = 1, area light", picture(&found.local.picture), local),
            cell("path tracing, local", "area light", picture(&found.traced), traced),
        ]
    }

    /// The same part of each picture, magnified.
    fn details(&self) -> Vec<Cell> {
        let detail = |picture: &Picture| magnified(picture, self.effort.size);
        let [local, traced] =
            [&self.found.local.picture, &self.found.traced].map(|picture| Shown::Picture(detail(picture)));
        [self.drawn(detail(self.five)), local, traced].map(|shown| cell("", "", shown, String::new())).into()
    }

    /// What the pictures differ by.
    fn differences(&self) -> Vec<Cell> {
        let (five, found) = (self.five, self.found);
        let noise =
            self.minus("path tracing − halflight", "noise", [&found.traced, &found.local.picture], &found.tracer);
        let area = |name: &str| self.minus(name, "five lights for the area", [five, &found.local.picture], &found.area);
        if self.absent.is_some() {
            let none = cell("", "", self.drawn(five.clone()), String::new());
            return vec![area("five lights − one luminaire"), none, noise];
        }
        let name = "OpenGL − halflight";
        let ours = &found.five.picture;
        vec![area(name), self.minus(name, "the same five lights", [five, ours], &apart(five, ours)), noise]
    }

    /// The first of two pictures minus the second, and how far they are apart.
    fn minus(&self, name: &str, note: &str, pictures: [&Picture; 2], apart: &Apart) -> Cell {
        let [a, b] = pictures.map(shown);
        let scale = difference_scale(&a, &b);
        let [Titled { picture: tile, .. }, _] = difference_tiles(&a, &b, scale, self.exposure);
        let below = format!(
            "blue −{0}, red +{0}. Mean e_pixel {1}, mean colour {2:.2}/255, largest {3}",
            percent(f64::from(scale)),
            percent(apart.e_pixel),
            255.0 * apart.mean_colour,
            percent(apart.largest),
        );
        cell(name, note, Shown::Picture(tile), below)
    }

    /// What is seen, in words.
    fn caption(&self) -> String {
        format!(
            "After Figure 4 of Banks and Beason 2006: {} triangles below a luminaire of 18 by 18 at height 20. OpenGL \
             has no light with an area and takes five points for it. Under the same lights the pictures are one but \
             for Gouraud's interpolation and the samples of edges; what is left on the lower left is what five \
             points are off by, −(w² + d²)/(90 h²) = −1.8 % below the middle of the light. Linear colours, {}.",
            self.effort.triangles,
            exposure_words(self.exposure),
        )
    }
}

fn cell(name: &str, note: &str, shown: Shown, below: String) -> Cell {
    Cell { above: Heading::new(name, note), shown, gain: 1.0, below }
}

/// A share in percent, to two digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    let digits = (1.0 - percent.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{percent:.digits$} %")
}

/// A renderer's name without what stands in brackets.
fn short(renderer: &str) -> &str {
    renderer.split(" (").next().unwrap_or(renderer)
}

/// The detail of a picture, every pixel as a square, of the size of the whole.
fn magnified(picture: &Picture, Size { width, height }: Size) -> Picture {
    let (wide, high) = (width.div_ceil(ZOOM), height.div_ceil(ZOOM));
    let first =
        |share: f64, all: usize, part: usize| ((share * all as f64) as usize).saturating_sub(part / 2).min(all - part);
    let (left, top) = (first(DETAIL.0, width, wide), first(DETAIL.1, height, high));
    Picture::from_fn(width, height, |x, y| picture.get(left + x / ZOOM, top + y / ZOOM).unwrap_or(Rgb::ZERO))
}
