//! The (alpha, tau) square in pictures: a grid of it, and two paths across it from mode to mode.
//!
//! All panels share one exposure. Points whose series is not proved to converge are hatched: there is no light to show.
//! Not handled: how the points are solved ([`solve_points`](crate::study::figures::solve_points)).

use crate::light::{Mode, Transport};
use crate::operator::Bounds;
use crate::pictures::Picture;
use crate::plot::{Cell, Heading, Page, PageRow, Shown};
use crate::solve::Verdict;
use crate::study::figures::between::Point;
use crate::study::figures::panel::{Figure, PageSettings, Panel, exposure_for, exposure_words, no_light};

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
    let row = |row: Vec<Transport>| {
        let heading = Heading::new(row.first().map_or(String::new(), |t| format!("α = {}", t.alpha)), "");
        (heading, row)
    };
    let top = |t: Transport| if t.alpha == 1.0 { format!("τ = {}", t.tau) } else { String::new() };
    let below = |t: Transport| t.mode().filter(|_| t.alpha == 0.0).map_or("", Mode::name);
    let above = |t: Transport| t.mode().filter(|_| t.alpha == 1.0).map_or("", Mode::name);
    let cell =
        |t: Transport, shown| Cell { above: Heading::new(top(t), above(t)), shown, gain: 1.0, below: below(t).into() };
    let title = "Between the modes: α (interreflection) up, τ (transmission) to the right";
    figure(settings, title, points, grid().into_iter().map(row).collect(), &cell)
}

/// Two strips from mode to mode.
pub fn between_strip(settings: &PageSettings, points: &[Point]) -> Figure {
    let name = |t: Option<&Transport>| t.map_or(String::new(), |t| t.label());
    let rows = paths().map(|path| (Heading::new(name(path.first()), format!("to {}", name(path.last()))), path));
    let cell = |t: Transport, shown| Cell {
        above: Heading::new(t.mode().map_or("", Mode::name), format!("α = {}, τ = {}", t.alpha, t.tau)),
        shown,
        gain: 1.0,
        below: String::new(),
    };
    let title = "Between the modes: from global to local shading, and from one bounce to shadowless light";
    figure(settings, title, points, rows.into(), &cell)
}

/// A page of points in rows.
fn figure(
    settings: &PageSettings,
    title: &str,
    points: &[Point],
    rows: Vec<(Heading, Vec<Transport>)>,
    cell: &dyn Fn(Transport, Shown) -> Cell,
) -> Figure {
    let of = |t: Transport| points.iter().find(|p| p.transport == t);
    let on = rows.iter().flat_map(|(_, row)| row).filter_map(|&t| of(t));
    let mut exposure = exposure_for(on.clone().filter_map(tame));
    exposure.stops += settings.brighter;
    let panels = on.map(panel).collect();
    let row = |(heading, row): (Heading, Vec<Transport>)| {
        let cells = row.into_iter().map(|t| cell(t, of(t).map_or(Shown::Blank, shown)));
        PageRow { heading, cells: cells.collect() }
    };
    let caption = format!(
        "Scene {}. α: share of the reflected light that travels on. τ: share of light that passes through \
         surfaces. Solved from one cast of rays; one {} for all panels.",
        settings.scene,
        exposure_words(exposure),
    );
    let page = Page {
        title: title.into(),
        rows: rows.into_iter().map(row).collect(),
        caption,
        panel: settings.size,
        exposure,
    };
    Figure { page, panels }
}

/// The picture of a point well inside the frontier.
fn tame(point: &Point) -> Option<&Picture> {
    let radius = point.solution.as_ref().ok()?.radius;
    point.picture.as_ref().filter(|_| radius.upper < TAME)
}

fn shown(point: &Point) -> Shown {
    match (&point.solution, &point.picture) {
        (Err(e), _) => no_light(e),
        (Ok(_), Some(picture)) => Shown::Picture(picture.clone()),
        (Ok(_), None) => Shown::Blank,
    }
}

fn panel(point: &Point) -> Panel {
    let found = |found: (Verdict, Bounds)| Panel {
        label: point.transport.label(),
        transport: point.transport,
        verdict: found.0,
        radius: found.1,
        error: None,
        gain: 1.0,
    };
    match &point.solution {
        Ok(s) => found((s.verdict, s.radius)),
        Err(e) => found((e.verdict, e.radius)),
    }
}
