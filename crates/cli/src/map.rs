//! `halflight map`: where the bounce series converges, over the (alpha, tau) square, as a chart, CSV and JSON.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Common, Completion, MemoryLimit};
use crate::pictures::Files;
use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::pictures::{Table, make_directory};
use halflight::render::Discretization;
use halflight_study::map::{FrontierPoint, GridPoint, Map, MapChart, TauPoint, check_crossings, map};

/// `halflight map`
#[derive(Args, Debug)]
#[command(next_help_heading = "Accuracy")]
pub struct MapArguments {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file; it need not emit
    #[arg(default_value = "cornell-box", help_heading = None::<&str>)]
    pub scene: String,
    /// Points of the grid each way
    #[arg(long, value_name = "N", default_value_t = 21, value_parser = clap::value_parser!(u16).range(2..=1001))]
    pub grid: u16,
    /// What its files do not say.
    #[command(flatten)]
    pub completion: Completion,
    /// About how many patches to cut the scene into
    #[arg(long, value_name = "N", default_value_t = 4000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub patches: u32,
    /// Hemisphere rays from each patch
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub rays: u32,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// `halflight map --json`
#[derive(Serialize)]
struct MapReport {
    scene: String,
    patches: usize,
    rays: u64,
    crossings: usize,
    /// Loading, patches, rays and radii; drawing and writing excluded.
    seconds: f64,
    /// Bounds on the spectral radius at every point.
    grid: Vec<GridPoint>,
    /// alpha_c of every tau; above 1 where it lies outside the square.
    frontier: Vec<FrontierPoint>,
    /// tau_c of every alpha of the grid that has one in the square.
    tau_frontier: Vec<TauPoint>,
    /// alpha from which on the path tracer's variance is infinite.
    variance_frontier: Vec<FrontierPoint>,
    /// Whether `variance_frontier` is exact, or only proved to be no higher than the true one.
    variance_exact: bool,
    files: Vec<PathBuf>,
}

/// Maps a scene.
pub fn run(own: &MapArguments, common: &Common, console: &Console) -> Result<(), CliError> {
    let start = Instant::now();
    let scene = own.completion.load(&own.scene, console)?;
    make_directory(&common.out)?;
    let prepared = Solver::new(&scene).cut(own.patches as usize);
    let sampling = Sampling { rays: own.rays, seed: common.seed, ..Sampling::default() };
    let limit = own.limit.bytes();
    check_crossings(&prepared, &sampling, own.grid.into(), limit)?;
    let map = map(&prepared, own.grid.into(), &sampling, console);
    let seconds = start.elapsed().as_secs_f64();
    console.say(table(&map));
    console.say(sentence(&prepared, &map, seconds));
    let files = write(common, &prepared, &map)?.said(console);
    console.report(&MapReport {
        scene: prepared.geometry.scene.name.clone(),
        patches: prepared.patches.len(),
        rays: map.rays,
        crossings: map.crossings,
        seconds,
        grid: map.grid().collect(),
        frontier: map.frontier(),
        variance_frontier: map.variance_frontier(),
        tau_frontier: map.tau_frontier,
        variance_exact: map.grey,
        files,
    })
}

fn write(common: &Common, prepared: &Discretization, map: &Map) -> Result<Files, CliError> {
    let scene = &prepared.geometry.scene;
    let chart = MapChart {
        map,
        title: format!("Where the bounce series of {} converges", scene.name),
        caption: format!(
            "{}: {} triangles, {} patches, {} rays, {} by {} points.",
            scene.name,
            scene.solid_faces(),
            prepared.patches.len(),
            map.rays,
            map.columns.len(),
            map.columns.len(),
        ),
    };
    let mut files = Files::new(&common.out, &format!("{}-map", scene.name));
    files.draw("", &["svg", "png"], &chart.drawing())?;
    grid_table(map).write(files.add(".csv"))?;
    alpha_table(map).write(files.add("-alpha-c.csv"))?;
    tau_table(map).write(files.add("-tau-c.csv"))?;
    Ok(files)
}

/// The columns for people: at most eleven of them.
fn table(map: &Map) -> String {
    let mut text = format!("{:>6} {:>19} {:>19} {:>19}\n", "tau", "radius at alpha = 1", "alpha_c", "alpha_variance");
    let pairs = map.frontier().into_iter().zip(map.variance_frontier());
    let rows: Vec<_> = map.columns.iter().zip(pairs).collect();
    let step = rows.len().saturating_sub(1).div_ceil(10).max(1);
    for (column, (mean, variance)) in rows.into_iter().step_by(step) {
        let range = |low: f64, high: f64| format!("{low:.4} to {high:.4}");
        let _ = writeln!(
            text,
            "{:>6.3} {:>19} {:>19} {:>19}",
            column.tau,
            range(column.radius.lower, column.radius.upper),
            range(mean.lower, mean.upper),
            range(variance.lower, variance.upper),
        );
    }
    text
}

/// What a person should take from the map.
fn sentence(prepared: &Discretization, map: &Map, seconds: f64) -> String {
    let highest = map.columns.last().map_or(0.0, |c| c.radius.upper);
    let verdict = match map.tau_frontier.last() {
        Some(full) if full.alpha == 1.0 => {
            format!("with all interreflection (alpha 1) the series diverges from tau = {:.4} on", full.tau)
        }
        _ if highest < 1.0 => "the series converges over the whole square".into(),
        _ => "the series diverges at every tau once alpha is large enough".into(),
    };
    format!(
        "{}: {verdict} ({} patches, {} rays, {} crossings, {seconds:.2} s)",
        prepared.geometry.scene.name,
        prepared.patches.len(),
        map.rays,
        map.crossings,
    )
}

fn grid_table(map: &Map) -> Table {
    let mut table = Table::new("alpha,tau,lower,upper");
    for GridPoint { alpha, tau, radius } in map.grid() {
        table.row(&[&alpha, &tau, &radius.lower, &radius.upper]);
    }
    table
}

fn alpha_table(map: &Map) -> Table {
    let mut table =
        Table::new("tau,alpha_c,alpha_c_lower,alpha_c_upper,alpha_variance,alpha_variance_lower,alpha_variance_upper");
    for (m, v) in map.frontier().iter().zip(map.variance_frontier()) {
        table.row(&[&m.tau, &m.alpha, &m.lower, &m.upper, &v.alpha, &v.lower, &v.upper]);
    }
    table
}

fn tau_table(map: &Map) -> Table {
    let mut table = Table::new("alpha,tau_c,radius_lower,radius_upper");
    for TauPoint { alpha, tau, radius } in &map.tau_frontier {
        table.row(&[alpha, tau, &radius.lower, &radius.upper]);
    }
    table
}
