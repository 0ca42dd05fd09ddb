//! `halflight render`: the picture of each mode, and a contact sheet of several.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::CliError;
use super::console::Console;
use super::options::{Common, Render};
use super::report::{Modes, Radius, RenderReport, mode_of};
use crate::image::{
    Exposure, GatherSampling, Picture, check_extension, make_directory, write_picture,
};
use crate::light::Transport;
use crate::solve::{Diverges, Settings, Solution, neumann};
use crate::study::{Assembled, Prepared, Seconds, Sheet, Tile, assemble, prepare, render};

/// Share of a picture's camera rays that may meet black backs before it is worth a warning.
const BACKS: f64 = 0.01;

/// One mode's picture, or the reason why there is none.
struct Outcome {
    transport: Transport,
    picture: Result<Picture, Diverges>,
    report: RenderReport,
}

/// Solves and renders every mode asked for.
pub fn run(own: &Render, common: &Common) -> Result<(), CliError> {
    let start = Instant::now();
    let console = Console::new(common);
    match &own.output {
        Some(path) => check_extension(path)?,
        None => make_directory(&common.out)?,
    }
    let scene = own.problem.subject.load()?;
    for warning in &scene.warnings {
        console.warn(warning);
    }
    let transports = own.problem.subject.transports(&scene);
    let load = start.elapsed().as_secs_f64();
    let fineness = own.problem.fineness(common.seed);
    let prepared = prepare(scene, fineness.patches);
    let clock = Instant::now();
    let (modes, rays) = assemble(&prepared, &transports, &fineness.sampling, &console);
    let seconds = Seconds {
        load,
        patches: prepared.seconds,
        form_factors: clock.elapsed().as_secs_f64(),
        ..Seconds::default()
    };
    let run = Shared {
        own,
        common,
        console: &console,
        prepared: &prepared,
        several: modes.len() > 1,
        rays,
        seconds,
    };
    let mut outcomes = Vec::new();
    for mode in &modes {
        let outcome = run.one_mode(mode)?;
        tell(&console, &outcome);
        outcomes.push(outcome);
    }
    finish(own, common, &console, &prepared.scene.name, outcomes)
}

/// What all modes of one run share.
struct Shared<'a> {
    own: &'a Render,
    common: &'a Common,
    console: &'a Console,
    prepared: &'a Prepared,
    several: bool,
    /// Rays cast for form factors.
    rays: u64,
    seconds: Seconds,
}

impl Shared<'_> {
    /// Solves, renders and writes one mode.
    fn one_mode(&self, mode: &Assembled) -> Result<Outcome, CliError> {
        let mut report = self.report(mode);
        let clock = Instant::now();
        let solution = neumann(&mode.operator, &Settings::default());
        report.seconds.solve = clock.elapsed().as_secs_f64();
        let (radius, verdict) = match &solution {
            Ok(s) => (s.radius, s.verdict),
            Err(e) => (e.radius, e.verdict),
        };
        report.spectral_radius = Some(radius.into());
        report.verdict = verdict.name();
        let picture = match solution {
            Ok(solution) => Ok(self.picture(mode, &solution, &mut report)?),
            Err(diverges) => Err(diverges),
        };
        report.seconds.sum();
        Ok(Outcome {
            transport: mode.transport,
            picture,
            report,
        })
    }

    /// Renders and writes a solution.
    fn picture(
        &self,
        mode: &Assembled,
        solution: &Solution,
        report: &mut RenderReport,
    ) -> Result<Picture, CliError> {
        let clock = Instant::now();
        let own = self.own;
        let sampling = GatherSampling::with_samples(own.problem.samples, self.common.seed);
        let size = (own.size.width, own.size.height);
        let gathered = render(self.prepared, mode, solution, size, &sampling, self.console);
        report.rays += gathered.rays;
        warn_of_backs(self.console, mode.transport, gathered.backs);
        let picture = gathered.total();
        report.seconds.gather = clock.elapsed().as_secs_f64();
        let path = self.file(mode.transport);
        write_picture(&path, &picture, exposure(own))?;
        report.files.push(path);
        Ok(picture)
    }

    /// What is known of a mode before it is solved.
    fn report(&self, mode: &Assembled) -> RenderReport {
        let (name, alpha, tau) = mode_of(mode.transport);
        RenderReport {
            scene: self.prepared.scene.name.clone(),
            mode: name,
            alpha,
            tau,
            width: self.own.size.width,
            height: self.own.size.height,
            triangles: self.prepared.scene.faces.len(),
            patches: self.prepared.patches.len(),
            rays: self.rays,
            seconds: self.seconds,
            spectral_radius: None,
            closure: mode.closure.map(Into::into),
            verdict: "",
            files: Vec::new(),
        }
    }

    /// Where one mode's picture goes.
    fn file(&self, transport: Transport) -> PathBuf {
        let place = (self.own.output.as_deref(), self.common.out.as_path());
        picture_file(place, &self.prepared.scene.name, transport, self.several)
    }
}

/// Where one mode's picture goes: the file asked for, or one in the directory named after the stem.
pub(super) fn picture_file(
    (output, directory): (Option<&Path>, &Path),
    stem: &str,
    transport: Transport,
    several: bool,
) -> PathBuf {
    let mode = transport.label().replace(' ', "-");
    match output {
        None => directory.join(format!("{stem}-{mode}.png")),
        Some(path) if several => {
            let extension = path.extension().unwrap_or_default().to_string_lossy();
            with_suffix(path, &mode, &extension)
        }
        Some(path) => path.to_path_buf(),
    }
}

/// The contact sheet and the report of several modes, or the report or error of one.
fn finish(
    own: &Render,
    common: &Common,
    console: &Console,
    scene: &str,
    mut outcomes: Vec<Outcome>,
) -> Result<(), CliError> {
    if outcomes.len() == 1 {
        let outcome = outcomes.remove(0);
        outcome.picture?;
        console.report(&outcome.report);
        return Ok(());
    }
    let path = sheet_file((own.output.as_deref(), &common.out), scene);
    let shown: Vec<Shown> = outcomes
        .iter()
        .map(|o| (o.transport, o.picture.as_ref().map_err(|e| e.to_string())))
        .collect();
    let heading = format!("{scene}: L = E + K L, the visible half");
    sheet(heading, &shown, exposure(own)).write(&path)?;
    console.say(format!("contact sheet: {}", path.display()));
    console.report(&Modes {
        modes: outcomes.into_iter().map(|o| o.report).collect(),
        files: vec![path],
    });
    Ok(())
}

/// One mode's picture, or the reason why there is none.
pub(super) type Shown<'a> = (Transport, Result<&'a Picture, String>);

/// The pictures of several modes under their names, as the paper's Figure 1.
pub(super) fn sheet<'a>(heading: String, shown: &[Shown<'a>], exposure: Exposure) -> Sheet<'a> {
    let tiles = shown.iter().map(|(transport, picture)| {
        let (_, alpha, tau) = mode_of(*transport);
        let numbers = format!("alpha {alpha}, tau {tau}");
        Tile {
            picture: picture.as_ref().ok().copied(),
            title: format!("{} ({numbers})", transport.label()),
            note: match picture {
                Ok(_) => String::new(),
                Err(e) => format!("no picture: {e}"),
            },
            gain: 1.0,
        }
    });
    Sheet {
        heading,
        tiles: tiles.collect(),
        columns: 2,
        exposure,
    }
}

fn tell(console: &Console, outcome: &Outcome) {
    let label = outcome.transport.label();
    let r = &outcome.report;
    let s = &r.seconds;
    match &outcome.picture {
        Ok(_) => console.say(format!(
            "{label:<11} {} in {:.2} s ({} patches, F {:.2} s, L {:.2} s, gather {:.2} s), spectral radius {}: {}",
            r.verdict, s.total, r.patches, s.form_factors, s.solve, s.gather,
            bounds(r.spectral_radius.as_ref()),
            r.files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().join(" "),
        )),
        Err(e) => console.warn(format!("{label}: no picture, {e}")),
    }
}

fn bounds(radius: Option<&Radius>) -> String {
    match radius {
        Some(r) if r.upper > 0.0 => format!("{:.4} to {:.4}", r.lower, r.upper),
        _ => "0".into(),
    }
}

pub(super) fn warn_of_backs(console: &Console, transport: Transport, backs: f64) {
    if backs > BACKS {
        console.warn(format!(
            "{}: {:.1} % of the camera's rays meet the black back of a one-sided face; \
             --two-sided gives every face two sides, `two_sided = true` in a scene file those of one material",
            transport.label(),
            100.0 * backs,
        ));
    }
}

fn exposure(own: &Render) -> Exposure {
    Exposure {
        stops: own.problem.subject.exposure,
    }
}

/// Where the contact sheet goes.
pub(super) fn sheet_file((output, directory): (Option<&Path>, &Path), stem: &str) -> PathBuf {
    match output {
        None => directory.join(format!("{stem}-modes.png")),
        Some(path) => with_suffix(path, "modes", "png"),
    }
}

fn with_suffix(path: &Path, suffix: &str, extension: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{suffix}.{extension}"))
}
