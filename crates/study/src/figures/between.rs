//! Between the modes: pictures over the (alpha, tau) square, solved from one cast of rays.
//!
//! ```text
//! F^t  = sum over k of t^k F^(k)                        layers of one cast (form_factors::rows::layers)
//! L    = (I - alpha b F^t)^-1 E                         one solve for each point, b = own alpha rho
//! ```
//!
//! A material without numbers of its own takes (alpha, tau); one with its own takes alpha times its alpha and tau times
//! its tau, as in the [map](crate::map). The gather pass is linear in L, so all alphas of one tau are gathered
//! from the same rays, one field each. Points whose series is not proved to converge have no light and are hatched.
//!
//! A grid of the square and two paths across it from mode to mode are shown, each at one exposure. Not handled: errors;
//! the effort is given.

use crate::figures::panel::{AXES, Figure, PageSettings, Panel, exposure_for, exposure_words, no_light};
use halflight::form_factors::Sampling;
use halflight::gather::{GatherPass, GatherSampling};
use halflight::light::{Mode, Rgb, Transport};
use halflight::operator::LinearOperator;
use halflight::pictures::{Exposure, Picture, Size};
use halflight::reading::invisible;
use halflight::render::{Assembled, Discretization, Square, SquareColumn, Watch, pictures, without_luminaires};
use halflight::solve::{Diverges, Extrapolated, Settings, extrapolated};
use halflight_plot::{Cell, Heading, Shown};

/// A point of the square, and its picture or the proof that there is none.
pub struct Point {
    /// Factors on every alpha and tau.
    pub transport: Transport,
    /// The solution on patches.
    pub solution: Result<Extrapolated, Diverges>,
    /// The visible half of L; none where the series is not proved to converge.
    pub picture: Option<Picture>,
}

/// How finely the square is solved, and how large its pictures are.
pub struct SquareEffort {
    /// Rays of the patches.
    pub sampling: Sampling,
    /// Rays of the pixels.
    pub gather: GatherSampling,
    /// Pixels across and down.
    pub size: Size,
}

/// Solves a scene at points of the (alpha, tau) square from one cast of rays; points of one tau are gathered together.
pub fn solve_points(p: &Discretization, points: &[Transport], effort: &SquareEffort, watch: &dyn Watch) -> Vec<Point> {
    let square = Square::new(p, &effort.sampling, watch);
    let mut taus: Vec<f32> = points.iter().map(|t| t.tau).collect();
    taus.sort_by(f32::total_cmp);
    taus.dedup();
    let of = |tau: f32| points.iter().filter(|t| t.tau == tau).map(|t| t.alpha).collect();
    taus.into_iter().flat_map(|tau| solve_column(&square.column(tau), of(tau), effort, watch)).collect()
}

/// The points of one tau.
fn solve_column(column: &SquareColumn, alphas: Vec<f32>, effort: &SquareEffort, watch: &dyn Watch) -> Vec<Point> {
    let mut values = Vec::new();
    let mut solved = Vec::new();
    watch.begin("series", alphas.len() as u64);
    for alpha in alphas {
        let equation = column.at(alpha);
        let solution = extrapolated(&equation.operator, &Settings::default());
        if let Ok(found) = &solution {
            values.push(reflected(&equation, found));
        }
        solved.push(Point { transport: equation.transport, solution, picture: None });
        watch.tick(1);
    }
    let gathered = pictures(&column.lights, &values, &GatherPass::new(effort.size, &effort.gather), watch);
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

/// The points that both figures need.
pub fn square_points() -> Vec<Transport> {
    let mut points: Vec<Transport> = grid().into_iter().chain(paths()).flatten().collect();
    points.sort_by(|a, b| (a.tau, a.alpha).partial_cmp(&(b.tau, b.alpha)).unwrap_or(std::cmp::Ordering::Equal));
    points.dedup();
    points
}

/// Rows of falling alpha, tau rising in each: the corners stand as in the figure of four modes.
fn grid() -> Vec<Vec<Transport>> {
    let shares = || (0..GRID).map(|k| f32::from(k) / f32::from(GRID - 1));
    let row = |alpha: f32| shares().map(|tau| Transport { alpha, tau }).collect();
    shares().rev().map(row).collect()
}

/// From global to local shading, and from one bounce to shadowless light.
fn paths() -> [Vec<Transport>; 2] {
    let shares: Vec<f32> = (0..PATH).map(|k| f32::from(k) / f32::from(PATH - 1)).collect();
    let along = |of: fn(f32) -> f32| shares.iter().map(|&tau| Transport { alpha: of(tau), tau }).collect();
    [along(|tau| 1.0 - tau), along(|tau| tau)]
}

/// A grid of pictures over the square.
pub fn between_grid(settings: &PageSettings, points: &[Point]) -> Figure {
    let name = |t: Transport, alpha: f32| t.mode().filter(|_| t.alpha == alpha).map_or("", Mode::name);
    let labels = |t: Transport| {
        let top = if t.alpha == 1.0 { format!("τ = {}", t.tau) } else { String::new() };
        (Heading::new(top, name(t, 1.0)), name(t, 0.0))
    };
    let heading =
        |row: &Vec<Transport>| Heading::new(row.first().map_or(String::new(), |t| format!("α = {}", t.alpha)), "");
    let rows = grid().into_iter().map(|row| (heading(&row), row)).collect();
    let title = "Between the modes: α (interreflection) up, τ (transmission) to the right";
    figure(settings, title, points, rows, &labels)
}

/// Two strips from mode to mode.
pub fn between_strip(settings: &PageSettings, points: &[Point]) -> Figure {
    let name = |t: Option<&Transport>| t.map_or(String::new(), |t| t.label());
    let rows = paths().map(|path| (Heading::new(name(path.first()), format!("to {}", name(path.last()))), path));
    let labels =
        |t: Transport| (Heading::new(t.mode().map_or("", Mode::name), format!("α = {}, τ = {}", t.alpha, t.tau)), "");
    let title = "Between the modes: from global to local shading, and from one bounce to shadowless light";
    figure(settings, title, points, rows.into(), &labels)
}

/// A page of points in rows, with labels above and below each.
fn figure(
    settings: &PageSettings,
    title: &str,
    points: &[Point],
    rows: Vec<(Heading, Vec<Transport>)>,
    labels: &dyn Fn(Transport) -> (Heading, &'static str),
) -> Figure {
    let of = |t: Transport| points.iter().find(|p| p.transport == t);
    let on = rows.iter().flat_map(|(_, row)| row).filter_map(|&t| of(t));
    let exposure = exposure_for(on.filter_map(Point::tame), settings.brighter);
    let cell = |t: Transport| {
        let (above, below) = labels(t);
        let shown = of(t).map_or(Shown::Blank, |point| point.shown(exposure));
        (Cell { above, shown, below: below.into() }, of(t).map(Point::panel))
    };
    let words = exposure_words(exposure);
    let caption = format!("Scene {}. {AXES} Solved from one cast of rays; one {words} for all panels.", settings.scene);
    let rows = rows.into_iter().map(|(heading, row)| (heading, row.into_iter().map(cell).collect()));
    Figure::new(settings, title, caption, exposure, rows.collect())
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

    fn panel(&self) -> Panel {
        let series = self.solution.as_ref().map_or_else(|e| (e.verdict, e.radius), |s| (s.verdict, s.radius));
        Panel::new(self.transport.label(), self.transport, series)
    }
}
