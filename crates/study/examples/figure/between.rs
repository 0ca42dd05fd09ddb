//! Between the modes: pictures over the (alpha, tau) square, solved from one cast of rays.
//!
//! ```text
//! F^t  = sum over k of t^k F^(k)                        layers of one cast (form_factors::rows::layers)
//! L    = (I - alpha b F^t)^-1 E                         one solve for each point, b = own alpha rho
//! ```
//!
//! A material without numbers of its own takes (alpha, tau); one with its own takes alpha times its alpha and tau times
//! its tau, as in the [map](halflight_study::map). The gather pass is linear in L, so all alphas of one tau are
//! gathered from the same rays, one field each. Points whose series is not proved to converge have no light and are
//! hatched.
//!
//! A grid of the square and two paths across it from mode to mode are shown, each at one exposure. Not handled: errors;
//! the effort is given.

use crate::common::{Failure, too_large};
use crate::page::{AXES, PageSettings, exposure_for, exposure_words, no_light};
use halflight::Solver;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Mode, Rgb, Transport};
use halflight::operator::LinearOperator;
use halflight::pictures::{Exposure, Picture};
use halflight::reading::invisible;
use halflight::render::{
    Assembled, Fineness, Silent, Square, SquareColumn, pictures, usable_memory, without_luminaires,
};
use halflight::solve::{Diverges, Extrapolated, Settings, extrapolated};
use halflight_plot::{Cell, Heading, Page, PageRow, Shown};
use halflight_study::map::check_crossings;

/// A point of the square, and its picture or the proof that there is none.
pub struct Point {
    /// Factors on every alpha and tau.
    pub transport: Transport,
    /// The solution on patches.
    pub solution: Result<Extrapolated, Diverges>,
    /// The visible half of L; none where the series is not proved to converge.
    pub picture: Option<Picture>,
}

/// Solves a scene at the points that both pages show, from one cast of rays; points of one tau are gathered together.
pub fn solve_square(settings: &PageSettings, effort: (Fineness, u32)) -> Result<Vec<Point>, Failure> {
    let (Fineness { patches, .. }, samples) = effort;
    let (p, sampling) = (Solver::new(settings.scene).cut(patches), effort.0.sampling(settings.seed));
    check_crossings(&p, &sampling, 1, usable_memory()).map_err(too_large)?;
    let square = Square::new(&p, &sampling, &Silent);
    let pass = GatherPass::new(settings.size, &GatherSampling::with_samples(samples, settings.seed));
    let points = square_points();
    let columns = points.chunk_by(|a, b| a.tau == b.tau);
    Ok(columns.flat_map(|own| solve_column(&square.column(own[0].tau), own, &pass)).collect())
}

/// The points of one tau.
fn solve_column(column: &SquareColumn, points: &[Transport], pass: &GatherPass) -> Vec<Point> {
    let mut values = Vec::new();
    let mut solved = Vec::new();
    for &Transport { alpha, .. } in points {
        let equation = column.at(alpha);
        let solution = extrapolated(&equation.operator, &Settings::default());
        if let Ok(found) = &solution {
            values.push(reflected(&equation, found));
        }
        solved.push(Point { transport: equation.transport, solution, picture: None });
    }
    let gathered = pictures(&column.lights, &values, pass, &Silent);
    let seen = gathered.emission.plus(&gathered.direct).unwrap_or_default();
    let lit = solved.iter_mut().filter(|point| point.solution.is_ok());
    for (point, indirect) in lit.zip(&gathered.indirect) {
        point.picture = seen.plus(indirect);
    }
    solved
}

/// The invisible light that hemisphere rays read: all of L but what luminaires emit.
fn reflected(equation: &Assembled, found: &Extrapolated) -> Vec<Rgb> {
    let emission = equation.operator.emission();
    let others = without_luminaires(&equation.lights, emission);
    let light = invisible(&found.light).into_iter();
    light.zip(invisible(emission).into_iter().zip(others)).map(|(l, (e, other))| l - (e - other)).collect()
}

/// Points of the grid each way, and of each path.
const GRID: u8 = 5;
const PATH: u8 = 9;
/// Points whose spectral radius may be more than this do not count for the exposure: they may be of any brightness.
const TAME: f64 = 0.9;

/// The points that both pages show, by tau.
fn square_points() -> Vec<Transport> {
    let mut points: Vec<Transport> = grid().into_iter().chain(paths()).flatten().collect();
    points.sort_by(|a, b| (a.tau, a.alpha).partial_cmp(&(b.tau, b.alpha)).unwrap_or(std::cmp::Ordering::Equal));
    points.dedup();
    points
}

/// Rows of falling tau, alpha rising in each, as the map has them.
fn grid() -> Vec<Vec<Transport>> {
    let shares = || (0..GRID).map(|k| f32::from(k) / f32::from(GRID - 1));
    let row = |tau: f32| shares().map(|alpha| Transport { alpha, tau }).collect();
    shares().rev().map(row).collect()
}

/// From global to local shading, and from one bounce to shadowless light.
fn paths() -> [Vec<Transport>; 2] {
    let shares: Vec<f32> = (0..PATH).map(|k| f32::from(k) / f32::from(PATH - 1)).collect();
    let along = |of: fn(f32) -> f32| shares.iter().map(|&tau| Transport { alpha: of(tau), tau }).collect();
    [along(|tau| 1.0 - tau), along(|tau| tau)]
}

/// A grid of pictures over the square.
pub fn between_grid(settings: &PageSettings, points: &[Point]) -> Page {
    let name = |t: Transport, tau: f32| t.mode().filter(|_| t.tau == tau).map_or("", Mode::name);
    let labels = |t: Transport| {
        let top = if t.tau == 1.0 { format!("alpha {}", t.alpha) } else { String::new() };
        (Heading::new(top, name(t, 1.0)), name(t, 0.0))
    };
    let heading =
        |row: &Vec<Transport>| Heading::new(row.first().map_or(String::new(), |t| format!("tau {}", t.tau)), "");
    let rows = grid().into_iter().map(|row| (heading(&row), row)).collect();
    let title = "Between the modes: alpha (interreflection) to the right, tau (transmission) up";
    page(settings, title, points, rows, &labels)
}

/// Two strips from mode to mode.
pub fn between_strip(settings: &PageSettings, points: &[Point]) -> Page {
    let name = |t: Option<&Transport>| t.map_or(String::new(), |t| t.label());
    let rows = paths().map(|path| (Heading::new(name(path.first()), format!("to {}", name(path.last()))), path));
    let labels =
        |t: Transport| (Heading::new(t.mode().map_or("", Mode::name), format!("alpha {}, tau {}", t.alpha, t.tau)), "");
    let title = "Between the modes: from global to local shading, and from one bounce to shadowless light";
    page(settings, title, points, rows.into(), &labels)
}

/// A page of points in rows, with labels above and below each.
fn page(
    settings: &PageSettings,
    title: &str,
    points: &[Point],
    rows: Vec<(Heading, Vec<Transport>)>,
    labels: &dyn Fn(Transport) -> (Heading, &'static str),
) -> Page {
    let of = |t: Transport| points.iter().find(|p| p.transport == t);
    let on = rows.iter().flat_map(|(_, row)| row).filter_map(|&t| of(t));
    let exposure = exposure_for(on.filter_map(Point::tame), settings.brighter);
    let cell = |t: Transport| {
        let (above, below) = labels(t);
        let shown = of(t).map_or(Shown::Blank, |point| point.shown(exposure));
        Cell { above, shown, below: below.into() }
    };
    let (name, words) = (&settings.scene.name, exposure_words(exposure));
    let caption = format!("Scene {name}. {AXES} Solved from one cast of rays; one {words} for all panels.");
    let row =
        |(heading, row): (Heading, Vec<Transport>)| PageRow { heading, cells: row.into_iter().map(cell).collect() };
    settings.page(title, caption, rows.into_iter().map(row).collect())
}

impl Point {
    /// The picture of a point well inside the frontier.
    fn tame(&self) -> Option<&Picture> {
        let radius = self.solution.as_ref().ok()?.radius;
        self.picture.as_ref().filter(|_| radius.upper < TAME)
    }

    fn shown(&self, exposure: Exposure) -> Shown {
        match (&self.solution, &self.picture) {
            (Err(e), _) => no_light(e),
            (Ok(_), Some(picture)) => Shown::image(picture, exposure),
            (Ok(_), None) => Shown::Blank,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::tests::settings;
    use halflight::scene::Scene;

    const EFFORT: (Fineness, u32) = (Fineness { patches: 300, rays: 64 }, 16);

    /// The mean of the channels of all pixels.
    fn mean(picture: &Picture) -> f64 {
        let sum: f64 = picture.pixels.iter().map(|p| f64::from(p.element_sum())).sum();
        sum / (3.0 * picture.pixels.len() as f64)
    }

    /// One cast for all tau and one for each give the light of a corner within the noise of either.
    #[test]
    fn the_square_has_the_modes_in_its_corners() {
        let scene = Scene::open("gallery").unwrap();
        let settings = settings(&scene);
        let points = solve_square(&settings, EFFORT).unwrap();
        let (grid, strip) = (between_grid(&settings, &points), between_strip(&settings, &points));
        let shapes = [&grid, &strip].map(|page| page.rows.iter().map(|row| row.cells.len()).collect::<Vec<_>>());
        assert_eq!(shapes, [vec![5; 5], vec![9; 2]]);
        let lit = |page: &Page| page.rows.iter().flat_map(|r| &r.cells).all(|c| matches!(c.shown, Shown::Image(_)));
        assert!(lit(&grid) && lit(&strip));
        // As the map: alpha to the right, tau upwards.
        let corner = |row: usize, column: usize| &grid.rows[row].cells[column];
        assert_eq!([corner(4, 4).below.as_str(), corner(4, 0).below.as_str()], ["global", "one-bounce"]);
        assert_eq!([&corner(0, 4).above.note[..], &corner(0, 0).above.note[..]], ["shadowless", "local"]);
        let ends = |row: &PageRow| [0, 8].map(|k| row.cells[k].above.name.clone());
        assert_eq!(ends(&strip.rows[0]), ["global", "local"]);
        assert_eq!(ends(&strip.rows[1]), ["one-bounce", "shadowless"]);
        let solver = Solver::new(&scene);
        for mode in Mode::ALL {
            let corner = points.iter().find(|p| p.transport == mode.transport()).unwrap();
            let alone = solver.render(mode, settings.size).fineness(EFFORT.0, EFFORT.1).unwrap();
            let ratio = mean(corner.picture.as_ref().unwrap()) / mean(&alone.picture);
            assert!((ratio - 1.0).abs() < 0.02, "{mode}: {ratio}");
        }
    }

    #[test]
    fn points_without_a_sum_are_hatched() {
        let scene = Scene::open("furnished-room").unwrap();
        let settings = settings(&scene);
        let page = between_grid(&settings, &solve_square(&settings, EFFORT).unwrap());
        let hatched = |cell: &&Cell| matches!(&cell.shown, Shown::Absent(why) if why.contains("diverges"));
        let count = page.rows.iter().flat_map(|row| &row.cells).filter(hatched).count();
        assert!(hatched(&&page.rows[0].cells[4]) && count < 6, "{count}");
    }
}
