//! Warnings before and after pictures are made: black backs, a path tracer's infinite variance, a tolerance not met.
//!
//! Not handled: black backs that no ray of the camera meets.

use crate::console::terminal::Console;
use halflight::light::{Rgb, Transport};
use halflight::pictures::Size;
use halflight::rays::{Ray, Rays, Side};
use halflight::render::{Rendered, Shortfall, Unmet};
use halflight::scene::{Scene, Sides};
use halflight_study::map::{Growth, Variance, growth};

/// Share of the camera's rays that may meet black backs before it is worth a warning.
const BACKS: f64 = 0.01;
/// Camera rays along the longer side of the picture that find the objects.
const GRID: usize = 64;
/// Objects that are named.
const NAMED: usize = 6;

/// What the pictures of a run show.
pub struct Pictured<'a> {
    pub scene: &'a Scene,
    pub rays: &'a Rays,
    pub size: Size,
}

/// Warns if more than a hundredth of the camera's rays meet black backs. The `shares` of the pictures differ by the
/// backs behind others: the largest is said.
pub fn warn_of_backs(console: &Console, pictured: &Pictured, shares: impl Iterator<Item = f64>) {
    let share = shares.fold(0.0, f64::max);
    if share <= BACKS || !console.warns() {
        return;
    }
    console.warn(format!(
        "{:.1} % of the camera's rays meet the black backs of one-sided faces{}",
        100.0 * share,
        from_behind(pictured),
    ));
}

/// The objects whose black backs a grid of camera rays meets, the most seen first, and what helps.
fn from_behind(&Pictured { scene, rays, size }: &Pictured) -> String {
    let Size { width, height } = grid(size);
    let mut counts = [vec![0; scene.objects.len()], vec![0; scene.materials.len()]];
    for k in 0..width * height {
        let (x, y) = ((k % width) as f32 + 0.5, (k / width) as f32 + 0.5);
        let (origin, direction) = scene.camera.ray(x / width as f32, y / height as f32, width as f32 / height as f32);
        let hit = rays.closest(&Ray { origin, direction, source: None });
        if let Some(hit) = hit.filter(|hit| hit.side == Side::Back && reflects_in_front(scene, hit.face)) {
            let face = scene.faces[hit.face as usize];
            counts[0][face.object as usize] += 1;
            counts[1][face.material as usize] += 1;
        }
    }
    let [objects, materials] = counts.map(|counts| most_first(&counts));
    let objects: Vec<&str> = objects.iter().map(|&object| scene.objects[object].as_str()).collect();
    let materials: Vec<&str> = materials.iter().take(NAMED).map(|&m| scene.materials[m].name.as_str()).collect();
    let of = match objects.len().saturating_sub(NAMED) {
        _ if objects.is_empty() => return ": turn these, or give them two sides, by --two-sided".into(),
        0 => format!(", of {}", objects.join(", ")),
        more => format!(", of {} and {more} more", objects[..NAMED].join(", ")),
    };
    let tables = materials.iter().map(|name| format!("\n  [materials.{name:?}]\n  two_sided = true"));
    format!(
        "{of}: turn these, or give them two sides, by --two-sided={} or in a scene file by{}",
        materials.join(","),
        tables.collect::<String>(),
    )
}

/// The numbers of what was counted at all, the largest counts first.
fn most_first(counts: &[usize]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..counts.len()).filter(|&k| counts[k] > 0).collect();
    order.sort_by_key(|&k| std::cmp::Reverse(counts[k]));
    order
}

/// A grid of the picture's shape.
fn grid(Size { width, height }: Size) -> Size {
    let longer = width.max(height).max(1);
    let side = |n: usize| (n * GRID).div_ceil(longer).max(1);
    Size { width: side(width), height: side(height) }
}

fn reflects_in_front(scene: &Scene, face: u32) -> bool {
    let material = scene.material(face);
    !scene.is_sky(face) && material.sides == Sides::One && material.rho != Rgb::ZERO
}

/// Looks at the variance of path tracing a mode, and warns where it is infinite or may be.
pub fn check_variance(console: &Console, scene: &Scene, rays: &Rays, transport: Transport, seed: u32) -> Growth {
    let found = growth(scene, rays, transport, seed);
    if let Some(words) = warning(&found) {
        console.warn(format!("{}: {words}", transport.label()));
    }
    found
}

fn warning(g: &Growth) -> Option<String> {
    let (mean, squares) = (g.mean?, g.squares?);
    let range = |low: f64, high: f64| format!("{low:.3} to {high:.3}");
    let radius = range(mean.lower, mean.upper);
    let growth = range(squares.lower, squares.upper);
    if g.diverges() {
        return Some(format!(
            "the series E + KE + K²E + … diverges (spectral radius of K {radius}), so a traced picture is its sum up to \
             --max-bounces and grows with that; `halflight bounces` shows the terms, smaller --alpha or --tau converge"
        ));
    }
    let instead = "`halflight render` solves L = E + K L without it; smaller --alpha or --tau tame it";
    match g.variance {
        Variance::Finite => None,
        Variance::Infinite => {
            let slower = match g.exponent {
                Some(x) => format!("about as N^-{x:.2}, not as N^-1/2"),
                None => "slower than N^-1/2".into(),
            };
            Some(format!(
                "the variance is infinite though the mean is not (spectral radius of K {radius}, of the squared weights \
                 of its paths {growth}), so with N samples the error falls {slower}, and reported standard errors are too small; \
                 {instead}"
            ))
        }
        Variance::Undecided => Some(format!(
            "the variance may be infinite (spectral radius of K {radius}, of the squared weights of its paths at most \
             about {:.3}, and 1 is the limit), so with N samples the error may fall slower than N^-1/2; {instead}",
            squares.upper,
        )),
    }
}

/// Warns where the estimated error is above the tolerance.
pub(crate) fn warn_of_error(console: &Console, transport: Transport, found: &Rendered, tolerance: f64) {
    if let Some(unmet) = found.unmet(tolerance) {
        console.warn(format!("{}: {}", transport.label(), words_of(&unmet)));
    }
}

/// Why an error is above its tolerance, and what helps.
pub(crate) fn words_of(unmet: &Unmet) -> String {
    let helps = match unmet.why {
        Shortfall::Unseen | Shortfall::Unknown | Shortfall::Contradicted => "",
        Shortfall::Time => "; a longer --time helps",
        Shortfall::Rays => "; a --time of some minutes allows more",
        Shortfall::Effort => "; a larger --size leaves less to bend within a pixel",
    };
    format!("{unmet}{helps}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::operator::Bounds;

    fn found(variance: Variance, mean: f64, squares: f64, exponent: Option<f64>) -> Growth {
        let around = |x: f64| Bounds { lower: x, upper: 1.001 * x };
        Growth { variance, mean: Some(around(mean)), squares: Some(around(squares)), exponent }
    }

    #[test]
    fn each_side_of_each_frontier_has_its_words() {
        assert_eq!(warning(&found(Variance::Finite, 0.5, 0.4, Some(0.5))), None);
        let words = |g| warning(&g).unwrap();
        let between = words(found(Variance::Infinite, 0.9, 1.3, Some(0.341)));
        assert!(between.contains("N^-0.34") && between.contains("render"));
        let near = words(found(Variance::Undecided, 0.8, 0.99, None));
        assert!(near.contains("may be infinite") && near.contains("0.991"));
        let beyond = words(found(Variance::Infinite, 1.2, 2.0, None));
        assert!(beyond.contains("diverges") && beyond.contains("--max-bounces"));
    }
}
