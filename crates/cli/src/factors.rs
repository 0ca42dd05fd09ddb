//! `halflight factors`: form factors between the objects of a scene, or between its patches, as tables, CSV, `.npz` and
//! JSON.

use std::fmt::{Display, Write as _};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Common, Completion, tolerance, unit_interval};
use crate::options::keep::{Keep, Kept};
use halflight::form_factors::{RowSums, row_sums};
use halflight::light::Transport;
use halflight::operator::Whole;
use halflight::pictures::{Exposure, Table, make_directory};
use halflight::render::{Discretization, Fineness, Solver, usable_memory};
use halflight::scene::Scene;
use halflight_export::{Array, Values, csr, write_npz};
use halflight_study::{
    Exchange, FactorMatrix, FactorSettings, FactorTable, How, PatchFactors, emissivities, factors, patch_factors,
};

/// Factors shown in the table at most; the files hold all of them.
const SHOWN: usize = 400;

/// `halflight factors`
#[derive(Args, Debug)]
#[command(next_help_heading = "Accuracy")]
pub struct Factors {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file; it needs no light
    /// and no camera
    #[arg(help_heading = None::<&str>)]
    pub scene: String,
    /// Error allowed, as a share of each form factor; a thousandth of it is allowed to any
    #[arg(long, value_name = "T", default_value_t = 1e-4, value_parser = tolerance)]
    pub tolerance: f64,
    /// Transmission of the materials that have none of their own, 0 to 1 [default: the scene file's, or 0]
    #[arg(long, value_name = "X", value_parser = unit_interval)]
    pub tau: Option<f32>,
    /// Find those between about so many patches instead, by rays
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub patches: Option<u32>,
    /// Cast so many hemisphere rays from each patch [default with --patches: 256]
    #[arg(long, value_name = "N", requires = "patches", value_parser = clap::value_parser!(u32).range(1..=1_048_576))]
    pub rays: Option<u32>,
    /// Have what objects exchange by radiation as well, by a table of their emissivities: object,emissivity
    #[arg(long, value_name = "FILE.csv", conflicts_with = "patches")]
    pub exchange: Option<PathBuf>,
    /// What is kept of the patches.
    #[command(flatten)]
    pub keep: Keep,
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
    /// What they exchange by radiation.
    #[serde(skip_serializing_if = "Option::is_none")]
    exchange: Option<ExchangeReport>,
    files: Vec<PathBuf>,
}

/// How far exchange is from that of a closed scene.
#[derive(Serialize)]
struct ExchangeReport {
    row_sums: Vec<f64>,
    reciprocity: Vec<f64>,
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
    let scene = own.completion.load_shape(&own.scene, console)?;
    make_directory(&common.out)?;
    if !scene.lights.is_empty() {
        console.warn("lights without area ([[lights]]) have no form factors: there are no columns for them");
    }
    let base = scene.transport.unwrap_or_default();
    let default = Transport { alpha: base.alpha, tau: own.tau.unwrap_or(base.tau) };
    let tau: Vec<f32> = scene.transports(default).iter().map(|t| t.tau).collect();
    let kept = own.keep.open(false, Exposure::default())?;
    if let Some(fineness) = own.fineness(kept.as_ref())? {
        return of_patches(&scene, default, (fineness, common), kept, console);
    }
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
    let mut files = write(&scene, &table, common)?;
    let exchange = own.exchange.as_ref().map(|path| exchange_of(path, &scene, &table, common)).transpose()?;
    if let Some((exchange, own)) = &exchange {
        say_exchange(exchange, console);
        files.extend(own.iter().cloned());
    }
    files.iter().for_each(|file| console.say(file.display().to_string()));
    let exchange = exchange.map(|(own, _)| ExchangeReport { row_sums: own.row_sums, reciprocity: own.reciprocity });
    console.report(&Report { exchange, ..report(&scene, own, &table, files) })
}

/// What objects of the emissivities of a table exchange, and the files that it is written to.
fn exchange_of(
    path: &Path,
    scene: &Scene,
    table: &FactorTable,
    common: &Common,
) -> Result<(Exchange, Vec<PathBuf>), CliError> {
    let wrong = |message: String| CliError::Exchange { message: format!("{}: {message}", path.display()) };
    let matrix = FactorMatrix::of(table);
    let bytes = fs::read(path).map_err(|error| wrong(error.to_string()))?;
    let given = emissivities(&bytes, &matrix.rows).map_err(|error| wrong(error.to_string()))?;
    let found = Exchange::of(&matrix, &given).map_err(|error| wrong(error.to_string()))?;
    let file = |end: &str| common.out.join(format!("{}-exchange-{end}.csv", scene.name));
    let files = vec![file("conductances"), file("gebhart"), file("net")];
    for (file, values) in files.iter().zip([&found.conductances, &found.gebhart, &found.net]) {
        named_table(&found.rows, &found.columns, values).write(file)?;
    }
    Ok((found, files))
}

fn say_exchange(found: &Exchange, console: &Console) {
    let least = found.row_sums.iter().copied().fold(f64::INFINITY, f64::min);
    let most = found.row_sums.iter().copied().fold(0.0, f64::max);
    let worst = found.reciprocity.iter().copied().fold(0.0, f64::max);
    console.say(format!(
        "exchange: rows of Gebhart's factors sum to {least:.9} to {most:.9}, conductances differ from those back by \
         {worst:.1e} at most"
    ));
    if least < 1.0 - 1e-3 {
        console.warn("a part of what objects emit reaches neither an object nor a sky: it is lost to the outside");
    }
}

/// Writes all pairs, and the matrix with its residuals.
fn write(scene: &Scene, table: &FactorTable, common: &Common) -> Result<Vec<PathBuf>, CliError> {
    let file = |end: &str| common.out.join(format!("{}-factors{end}", scene.name));
    let files = vec![file(".csv"), file("-matrix.csv"), file("-residuals.csv"), file(".npz")];
    rows(table).write(&files[0])?;
    let matrix = FactorMatrix::of(table);
    named_table(&matrix.rows, &matrix.columns, &matrix.values).write(&files[1])?;
    residuals_table(&matrix, table).write(&files[2])?;
    write_npz(&files[3], &matrix_arrays(&matrix))?;
    Ok(files)
}

/// A matrix, its rows and columns named.
fn named_table(rows: &[String], columns: &[String], values: &[f64]) -> Table {
    let names: Vec<&str> = std::iter::once("from").chain(columns.iter().map(String::as_str)).collect();
    let mut table = Table::with_columns(&names);
    for (name, row) in rows.iter().zip(values.chunks(columns.len().max(1))) {
        let cells: Vec<&dyn Display> = std::iter::once(name as _).chain(row.iter().map(|f| f as _)).collect();
        table.row(&cells);
    }
    table
}

/// What each row leaves of closure and reciprocity.
fn residuals_table(matrix: &FactorMatrix, table: &FactorTable) -> Table {
    let mut residuals = Table::new("object,area,row_sum,standard_error,closure,reciprocity");
    for (i, row) in table.rows.iter().enumerate() {
        let (sum, worst) = (&row.sum, matrix.worst_reciprocity(i));
        residuals.row(&[&matrix.rows[i], &row.area, &sum.value, &sum.error, &matrix.closure[i], &worst]);
    }
    residuals
}

/// The arrays of a matrix: `F[i, j]` is the share of what leaves object i that reaches column j.
fn matrix_arrays(matrix: &FactorMatrix) -> Vec<(&'static str, Array<'_>)> {
    let (n, m) = (matrix.rows.len(), matrix.columns.len());
    let of = |shape: &[usize], values| Array { shape: shape.to_vec(), values };
    let numbers = |values: &'_ [f64]| Values::F64(values.to_vec().into());
    vec![
        ("F", of(&[n, m], numbers(&matrix.values))),
        ("standard_error", of(&[n, m], numbers(&matrix.errors))),
        ("rows", of(&[n], Values::Text((&matrix.rows[..]).into()))),
        ("columns", of(&[m], Values::Text((&matrix.columns[..]).into()))),
        ("area", of(&[n], numbers(&matrix.areas))),
        ("closure", of(&[n], numbers(&matrix.closure))),
        ("reciprocity", of(&[n, n], numbers(&matrix.reciprocity))),
    ]
}

impl Factors {
    /// The patches and rays requested, or those of the folder that is read; none where objects are.
    fn fineness(&self, kept: Option<&Kept>) -> Result<Option<Fineness>, CliError> {
        let known = kept.and_then(Kept::fineness);
        let default = known.unwrap_or_default();
        let Some(patches) = self.patches.map(|n| n as usize).or(known.map(|known| known.patches)) else {
            return match kept {
                None => Ok(None),
                Some(_) => Err(CliError::Usage {
                    message:
                        "--save and --load keep form factors between patches, and those between objects are requested"
                            .into(),
                    help: "pass --patches N".into(),
                }),
            };
        };
        Ok(Some(Fineness { patches, rays: self.rays.unwrap_or(default.rays) }))
    }
}

/// `halflight factors --patches --json`
#[derive(Serialize)]
struct PatchReport<'a> {
    scene: &'a str,
    patches: usize,
    /// Rays cast; 0 where F was read.
    rays: u64,
    entries: usize,
    /// Row sums.
    row_sums: Option<RowSums>,
    /// Frobenius norm of `A F - (A F)^T` over that of `A F`.
    reciprocity: f64,
    files: Vec<PathBuf>,
}

/// Finds those between patches and reports.
fn of_patches(
    scene: &Scene,
    transport: Transport,
    (fineness, common): (Fineness, &Common),
    kept: Option<Kept>,
    console: &Console,
) -> Result<(), CliError> {
    let solver = Kept::with(kept.as_ref(), Solver::new(scene));
    let p = solver.cut(fineness.patches);
    // One file has all rows.
    let p = Discretization { rows: Arc::new(Whole(Arc::clone(&p.rows))), ..p };
    let sampling = fineness.sampling(common.seed);
    if let Some(kept) = &kept {
        kept.read(&p, &[transport], &sampling, console)?;
    }
    p.check_memory(&[transport], &sampling, 1, usable_memory())?;
    let tau: Vec<f32> = p.transports(transport).iter().map(|t| t.tau).collect();
    let found = patch_factors(&p, &tau, &sampling, console);
    let mut files = vec![common.out.join(format!("{}-patch-factors.npz", scene.name))];
    write_npz(&files[0], &patch_arrays(scene, &found))?;
    if let Some(kept) = kept {
        kept.save_factors(&p, transport, sampling)?;
        files.extend(kept.finish(console)?);
    }
    let report = PatchReport {
        scene: &scene.name,
        patches: p.patches.len(),
        rays: found.rays,
        entries: found.factors.rows.entries(),
        row_sums: row_sums(&found.factors, p.patches.areas()),
        reciprocity: found.residual,
        files,
    };
    let sums = report.row_sums.map_or("no rows".into(), |c| format!("row sums {:.6} to {:.6}", c.min, c.max));
    console.say(format!(
        "{}: {} patches, {} form factors between them from {} rays; {sums}, reciprocity residual {:.4}: {}",
        scene.name,
        report.patches,
        report.entries,
        report.rays,
        report.reciprocity,
        report.files[0].display()
    ));
    console.report(&report)
}

/// F with SciPy's names for CSR, row i what patch i receives of all others; and what is known of every patch.
fn patch_arrays<'a>(scene: &'a Scene, found: &'a PatchFactors) -> Vec<(&'static str, Array<'a>)> {
    let mut arrays = csr(&found.factors.rows);
    arrays.extend([
        ("sky", Array::vector(Values::F32((&found.sky[..]).into()))),
        ("area", Array::vector(Values::F64((&found.areas[..]).into()))),
        ("closure", Array::vector(Values::F32((&found.closure[..]).into()))),
        ("reciprocity", Array::vector(Values::F32((&found.reciprocity[..]).into()))),
        ("object", Array::vector(Values::I32((&found.objects[..]).into()))),
        ("objects", Array::vector(Values::Text((&scene.objects[..]).into()))),
    ]);
    arrays
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
        exchange: None,
        files,
    }
}
