//! `halflight factors`: form factors between the objects of a scene, as a table, CSV and JSON.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::cli::arguments::{Common, Completion};
use crate::cli::arguments::{tolerance, unit_interval};
use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::light::Transport;
use crate::pictures::{Table, make_directory};
use crate::scene::Scene;
use crate::study::{FactorSettings, FactorTable, How, factors};

/// Factors shown in the table at most; the files hold all of them.
const SHOWN: usize = 400;

/// `halflight factors`
#[derive(Args, Debug)]
pub struct Factors {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file; it needs no light
    /// and no camera
    pub scene: String,
    /// Error allowed, as a share of each form factor; a thousandth of it is allowed to any
    #[arg(long, value_name = "T", default_value_t = 1e-4, value_parser = tolerance)]
    pub tolerance: f64,
    /// Transmission of the materials that have none of their own, 0 to 1 [default: the scene file's, or 0]
    #[arg(long, value_name = "X", value_parser = unit_interval)]
    pub tau: Option<f32>,
    /// What its files do not say.
    #[command(flatten)]
    pub completion: Completion,
}

/// `halflight factors --json`
#[derive(Serialize)]
struct Report<'a> {
    scene: &'a str,
    tolerance: f64,
    objects: Vec<ObjectReport<'a>>,
    factors: Vec<FactorReport<'a>>,
    reciprocity: Vec<ReciprocityReport<'a>>,
    /// Form factors whose standard error exceeds the tolerance.
    unmet: usize,
    files: Vec<PathBuf>,
}

#[derive(Serialize)]
struct ObjectReport<'a> {
    name: &'a str,
    area: f64,
    row_sum: f64,
    standard_error: f64,
}

#[derive(Serialize)]
#[allow(non_snake_case)] // the symbol of the field
struct FactorReport<'a> {
    from: &'a str,
    to: &'a str,
    F: f64,
    standard_error: f64,
    method: How,
}

#[derive(Serialize)]
struct ReciprocityReport<'a> {
    a: &'a str,
    b: &'a str,
    residual: f64,
    standard_error: f64,
}

/// Finds them and reports.
pub fn run(own: &Factors, common: &Common, console: &Console) -> Result<(), CliError> {
    let scene = own.completion.load(&own.scene, console)?;
    make_directory(&common.out)?;
    if !scene.lights.is_empty() {
        console.warn("lights without area ([[lights]]) have no form factors: there are no columns for them");
    }
    let base = scene.transport.unwrap_or_default();
    let default = Transport { alpha: base.alpha, tau: own.tau.unwrap_or(base.tau) };
    let tau: Vec<f32> = scene.transports(default).iter().map(|t| t.tau).collect();
    let settings = FactorSettings { tolerance: own.tolerance, seed: common.seed };
    let table = factors(&scene, &tau, &settings, console);
    console.say(text(&table));
    if table.unmet > 0 {
        console.warn(format!(
            "{} of {} form factors have a standard error above the tolerance: the rays ran out; ask for a larger --tolerance",
            table.unmet,
            table.factors.len()
        ));
    }
    let file = common.out.join(format!("{}-factors.csv", scene.name));
    rows(&table).write(&file)?;
    console.say(file.display().to_string());
    console.report(&report(&scene, own, &table, vec![file]))
}

fn text(table: &FactorTable) -> String {
    let name = |i: usize| &table.columns[i];
    let wide = |least: usize| {
        let lengths = table.columns.iter().map(|name| name.chars().count());
        lengths.chain([least]).max().unwrap_or(least)
    };
    let w = wide(6);
    let mut text = format!("{:<w$}  {:<w$}  {:>13}  {:>14}  method\n", "from", "to", "F", "standard error");
    for f in table.factors.iter().take(SHOWN) {
        let (from, to) = (name(f.from), name(f.to));
        let (value, error, how) = (f.share.value, f.share.error, f.how.name());
        let _ = writeln!(text, "{from:<w$}  {to:<w$}  {value:>13.9}  {error:>14.1e}  {how}");
    }
    if table.factors.len() > SHOWN {
        let _ = writeln!(text, "... {} in all: see the file", table.factors.len());
    }
    let _ = writeln!(text, "\n{:<w$}  {:>12}  {:>13}  {:>14}", "object", "area", "row sum", "standard error");
    for r in table.rows.iter().take(SHOWN) {
        let (name, area, sum) = (&r.name, r.area, r.sum);
        let _ = writeln!(text, "{name:<w$}  {area:>12.5e}  {:>13.9}  {:>14.1e}", sum.value, sum.error);
    }
    let worst = table.reciprocity.iter().max_by(|a, b| a.residual.abs().total_cmp(&b.residual.abs()));
    if let Some(r) = worst {
        let (a, b) = (name(r.pair.0), name(r.pair.1));
        let _ = writeln!(
            text,
            "\nlargest reciprocity residual |A_i F_ij - A_j F_ji| / A F: {:.1e} +- {:.1e} ({a}, {b})",
            r.residual.abs(),
            r.error
        );
    }
    text
}

/// All form factors, one row each.
fn rows(table: &FactorTable) -> Table {
    let name = |i: usize| &table.columns[i];
    let mut rows = Table::new("from,to,F,standard_error,method");
    for f in &table.factors {
        rows.row(&[name(f.from), name(f.to), &f.share.value, &f.share.error, &f.how.name()]);
    }
    rows
}

fn report<'a>(scene: &'a Scene, own: &Factors, table: &'a FactorTable, files: Vec<PathBuf>) -> Report<'a> {
    let name = |i: usize| table.columns[i].as_str();
    let objects = table.rows.iter().map(|r| ObjectReport {
        name: &r.name,
        area: r.area,
        row_sum: r.sum.value,
        standard_error: r.sum.error,
    });
    let factors = table.factors.iter().map(|f| FactorReport {
        from: name(f.from),
        to: name(f.to),
        F: f.share.value,
        standard_error: f.share.error,
        method: f.how,
    });
    let reciprocity = table.reciprocity.iter().map(|r| ReciprocityReport {
        a: name(r.pair.0),
        b: name(r.pair.1),
        residual: r.residual,
        standard_error: r.error,
    });
    Report {
        scene: &scene.name,
        tolerance: own.tolerance,
        objects: objects.collect(),
        factors: factors.collect(),
        reciprocity: reciprocity.collect(),
        unmet: table.unmet,
        files,
    }
}
