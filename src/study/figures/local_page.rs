//! Figure 4 as a page: OpenGL, the local mode and path tracing side by side, a detail of each, and signed differences.
//!
//! Not handled: the pictures and the numbers ([`local_light`](crate::study::figures::local_light)).

use crate::light::Rgb;
use crate::pictures::{Exposure, Picture};
use crate::plot::{Cell, Heading, Page, PageRow, Shown, difference_scale, difference_tiles};
use crate::study::figures::local_light::{Apart, LocalEffort, LocalLight, apart, shown};

/// Magnification of the details.
const ZOOM: usize = 8;
/// Where the middle of the detail is, as shares of the picture's width and height.
const DETAIL: (f64, f64) = (0.41, 0.5);

/// The page.
pub fn local_page(found: &LocalLight, effort: &LocalEffort, brighter: f32) -> Page {
    let exposure = Exposure { stops: brighter };
    let opengl = found.opengl.as_ref();
    let absent = opengl.err().map(|why| why.to_string());
    let five = opengl.map_or(&found.five.picture, |drawn| &drawn.picture);
    let lit = |picture: &Picture| Shown::Picture(picture.clone());
    let gl = |picture: Picture| absent.as_ref().map_or(Shown::Picture(picture), |why| Shown::Hatched(why.clone()));
    let (local, traced) = (&found.local.picture, &found.traced);
    let seconds = opengl.map_or(String::new(), |drawn| {
        format!("{:.1} s with {} samples a pixel, {}", drawn.seconds, effort.samples, short(&drawn.renderer))
    });
    let pictures = vec![
        cell("OpenGL", "five point lights", gl(five.clone()), seconds),
        cell(
            "halflight, local",
            "α = 0, τ = 1, area light",
            lit(local),
            format!(
                "{:.1} s with {} camera rays a pixel; {} from a quadrature of it",
                found.local.seconds.total,
                effort.samples,
                percent(found.quadrature)
            ),
        ),
        cell(
            "path tracing, local",
            "area light",
            lit(traced),
            format!(
                "{:.1} s with {} paths a pixel; {:.0} times as long for halflight's noise",
                found.traced_seconds[0],
                effort.samples,
                found.traced_seconds[1] / found.traced_seconds[0]
            ),
        ),
    ];
    let detail = |picture: &Picture| magnified(picture, effort.size);
    let details = vec![
        cell("", "", gl(detail(five)), String::new()),
        cell("", "", lit(&detail(local)), String::new()),
        cell("", "", lit(&detail(traced)), String::new()),
    ];
    let same = apart(five, &found.five.picture);
    let minus = |name: &str, note: &str, a: &Picture, b: &Picture, apart: &Apart| {
        let [a, b] = [a, b].map(shown);
        let scale = difference_scale(&a, &b);
        let [(tile, ..), _] = difference_tiles(&a, &b, scale, exposure);
        let below = format!(
            "blue −{0}, red +{0}. Mean e_pixel {1}, mean colour {2:.2}/255, largest {3}",
            percent(f64::from(scale)),
            percent(apart.e_pixel),
            255.0 * apart.mean_colour,
            percent(apart.largest),
        );
        cell(name, note, Shown::Picture(tile), below)
    };
    let own = minus("OpenGL − halflight", "the same five lights", five, &found.five.picture, &same);
    let first = if absent.is_none() { "OpenGL − halflight" } else { "five lights − one luminaire" };
    let differences = vec![
        minus(first, "five lights for the area", five, local, &found.area),
        if absent.is_none() { own } else { cell("", "", gl(five.clone()), String::new()) },
        minus("path tracing − halflight", "noise", traced, local, &found.tracer),
    ];
    let row = |name: &str, note: &str, cells| PageRow { heading: Heading::new(name, note), cells };
    Page {
        title: "Local illumination is OpenGL's lighting".into(),
        rows: vec![
            row("picture", "", pictures),
            row("detail", &format!("× {ZOOM}"), details),
            row("difference", "", differences),
        ],
        caption: format!(
            "After Figure 4 of Banks and Beason 2006: {} triangles below a luminaire of 18 by 18 at height 20. OpenGL \
             has no light with an area and takes five points for it. Under the same lights the pictures are one but \
             for Gouraud's interpolation and the samples of edges; what is left on the lower left is what five \
             points are off by, −(w² + d²)/(90 h²) = −1.8 % below the middle of the light. Linear colours, {}.",
            effort.triangles,
            crate::study::figures::panel::exposure_words(exposure),
        ),
        panel: effort.size,
        exposure,
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
fn magnified(picture: &Picture, (width, height): (usize, usize)) -> Picture {
    let (wide, high) = (width.div_ceil(ZOOM), height.div_ceil(ZOOM));
    let first =
        |share: f64, all: usize, part: usize| ((share * all as f64) as usize).saturating_sub(part / 2).min(all - part);
    let (left, top) = (first(DETAIL.0, width, wide), first(DETAIL.1, height, high));
    Picture::from_fn(width, height, |x, y| picture.get(left + x / ZOOM, top + y / ZOOM).unwrap_or(Rgb::ZERO))
}
