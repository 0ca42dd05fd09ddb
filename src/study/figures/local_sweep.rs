//! How wrong five lights are for a luminaire, over its width to height: measured, and as a closed form.
//!
//! Below the middle of a luminaire w by d at height h light falls as the mean over it of (1 + q)^-2, q the square of
//! the distance from its middle over h². The mean of q over the luminaire is (w² + d²)/(12 h²), over the five lights 4
//! (w² + d²)/(45 h²), so to first order the five are off by
//!
//! ```text
//! -2 (4/45 - 1/12) (w² + d²)/h² = -(w² + d²)/(90 h²)
//! ```
//!
//! Not handled: places other than the middle of the floor, but for the mean over a picture of the whole scene.

use crate::pictures::Size;
use crate::plot::{Axis, Chart, Series};
use crate::reference::opengl::render as draw;
use crate::render::Watch;
use crate::study::figures::local_light::{LocalEffort, apart, shown, solve};
use crate::study::figures::two_spheres::{FiveLights, Lit, TwoSpheres};

/// Width over height.
const RATIOS: [f64; 10] = [0.1, 0.15, 0.2, 0.25, 0.35, 0.5, 0.7, 0.9, 1.2, 1.6];
/// Width and height of pictures of the middle of the floor, and of the whole scene.
const MIDDLE: Size = Size { width: 4, height: 4 };
const WHOLE: Size = Size { width: 96, height: 96 };
/// Triangles of the whole scene, and camera rays a pixel.
const TRIANGLES: usize = 20_000;
const SAMPLES: u32 = 16;

/// One width.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Swept {
    /// Width over height, both sides of the luminaire being equal.
    pub ratio: f64,
    /// Five lights less the luminaire in the middle of the floor, whose radiance is 1 under the luminaire.
    pub e_pixel: f64,
    /// The closed form: `-(w² + d²)/(90 h²)`.
    pub closed_form: f64,
    /// Mean e_pixel over a picture of the whole scene, both by the local mode.
    #[serde(skip)]
    pub whole: f64,
}

/// All widths: the five lights by OpenGL where there is one, else by the local mode.
pub fn local_sweep(seed: u32, watch: &dyn Watch) -> Vec<Swept> {
    let one = |ratio: f64| {
        let of = |lit| TwoSpheres { triangles: TRIANGLES, ratio, lit, highlights: false };
        let (five, area) = (of(Lit::Five(FiveLights::Warn)), of(Lit::Area));
        let effort = |size| LocalEffort { size, triangles: TRIANGLES, samples: SAMPLES, seed };
        let own = |scene| solve(&scene, &effort(MIDDLE), SAMPLES, watch).picture;
        let scene = five.middle();
        let lit = draw(&scene, MIDDLE, SAMPLES).map_or_else(|_| own(scene), |found| found.picture);
        let mean = |picture: &crate::pictures::Picture| {
            let sum: f64 = shown(picture).pixels.iter().map(|p| f64::from(p.element_sum())).sum();
            sum / (3.0 * picture.pixels.len() as f64)
        };
        let [five, area] = [five, area].map(|s| (s, solve(&s.scene(), &effort(WHOLE), SAMPLES, watch).picture));
        Swept {
            ratio,
            e_pixel: mean(&lit) - mean(&own(area.0.middle())),
            closed_form: -2.0 * ratio * ratio / 90.0,
            whole: apart(&five.1, &area.1).e_pixel,
        }
    };
    RATIOS.map(one).into()
}

/// The widths as a chart.
pub fn sweep_chart(swept: &[Swept], five: &str) -> Chart {
    let points = |value: fn(&Swept) -> f64| swept.iter().map(|s| (s.ratio, value(s).abs())).collect();
    Chart {
        title: "Five lights for a luminaire".into(),
        caption: format!(
            "Two spheres on a floor below a square luminaire of width w at height h, and below five lights that stand \
             for it as in OpenGL, lit by {five}. The closed form holds below the middle of the luminaire, to first \
             order in w²/h². At w/h = 0.9, the paper's figure, it is 1.8 % there and the mean over the picture 0.4 %."
        ),
        x: Axis::log("width of the luminaire over its height, w/h"),
        y: Axis::log("difference, share of full scale"),
        series: vec![
            Series::bound("(w² + d²)/(90 h²)", 0, points(|s| s.closed_form)),
            Series::measured("middle of the floor", 0, points(|s| s.e_pixel)),
            Series::measured("mean e_pixel of the picture", 1, points(|s| s.whole)),
        ],
        size: Size { width: 900, height: 560 },
    }
}
