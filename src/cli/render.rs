//! `halflight render`: the picture of each mode, and a contact sheet of several.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::CliError;
use super::console::Console;
use super::options::{Common, Render};
use super::report::{Modes, Radius, RenderReport, mode_of};
use crate::image::{
    Exposure, GatherSampling, Picture, check_destination, check_extension, make_directory,
    write_picture,
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
    /// Share of the camera's rays that meet the black back of a face.
    backs: f64,
    report: RenderReport,
}

/// Solves and renders every mode asked for.
pub fn run(own: &Render, common: &Common) -> Result<(), CliError> {
    let start = Instant::now();
    let console = Console::new(common);
    if let Some(path) = &own.output {
        check_extension(path)?;
    }
    let scene = own.problem.load()?;
    for warning in &scene.warnings {
        console.warn(warning);
    }
    let transports = own.problem.transports(&scene);
    let places = Places {
        own,
        common,
        scene: scene.name.clone(),
        several: transports.len() > 1,
    };
    places.check(&transports)?;
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
        places: &places,
        rays,
        seconds,
    };
    let mut outcomes = Vec::new();
    for mode in &modes {
        let outcome = run.one_mode(mode)?;
        tell(&console, &outcome, places.several);
        outcomes.push(outcome);
    }
    warn_of_backs(&console, &outcomes);
    finish(&places, &console, outcomes)
}

/// What all modes of one run share.
struct Shared<'a> {
    own: &'a Render,
    common: &'a Common,
    console: &'a Console,
    prepared: &'a Prepared,
    places: &'a Places<'a>,
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
        report.spectral_radius = radius.into();
        report.verdict = verdict.name();
        let (picture, backs) = match solution {
            Ok(solution) => {
                let (picture, backs) = self.picture(mode, &solution, &mut report)?;
                (Ok(picture), backs)
            }
            Err(diverges) => (Err(diverges), 0.0),
        };
        report.seconds.sum();
        Ok(Outcome {
            transport: mode.transport,
            picture,
            backs,
            report,
        })
    }

    /// Renders and writes a solution; also tells the share of black backs.
    fn picture(
        &self,
        mode: &Assembled,
        solution: &Solution,
        report: &mut RenderReport,
    ) -> Result<(Picture, f64), CliError> {
        let clock = Instant::now();
        let own = self.own;
        let sampling = GatherSampling::with_samples(own.problem.samples, self.common.seed);
        let size = (own.size.width, own.size.height);
        let gathered = render(self.prepared, mode, solution, size, &sampling, self.console);
        report.rays += gathered.rays;
        let picture = gathered.total();
        report.seconds.gather = clock.elapsed().as_secs_f64();
        let path = self.places.picture(mode.transport);
        write_picture(&path, &picture, exposure(own))?;
        report.files.push(path);
        Ok((picture, gathered.backs))
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
            spectral_radius: Radius::default(),
            closure: mode.closure.map(Into::into),
            verdict: "",
            files: Vec::new(),
        }
    }
}

/// Where the files of one run go.
struct Places<'a> {
    own: &'a Render,
    common: &'a Common,
    /// The scene's name.
    scene: String,
    several: bool,
}

impl Places<'_> {
    /// Makes sure that every file can be written, before the work that is to fill it.
    fn check(&self, transports: &[Transport]) -> Result<(), CliError> {
        if self.own.output.is_none() {
            make_directory(&self.common.out)?;
        }
        for &transport in transports {
            check_destination(self.picture(transport))?;
        }
        if self.several {
            check_destination(self.sheet())?;
        }
        Ok(())
    }

    /// One mode's picture.
    fn picture(&self, transport: Transport) -> PathBuf {
        let mode = transport.label().replace(' ', "-");
        match &self.own.output {
            None => self.common.out.join(format!("{}-{mode}.png", self.scene)),
            Some(path) if self.several => {
                let extension = path.extension().unwrap_or_default().to_string_lossy();
                with_suffix(path, &mode, &extension)
            }
            Some(path) => path.clone(),
        }
    }

    /// The contact sheet.
    fn sheet(&self) -> PathBuf {
        match &self.own.output {
            None => self.common.out.join(format!("{}-modes.png", self.scene)),
            Some(path) => with_suffix(path, "modes", "png"),
        }
    }
}

/// The contact sheet and the report of several modes, or the report or error of one.
fn finish(places: &Places, console: &Console, mut outcomes: Vec<Outcome>) -> Result<(), CliError> {
    if outcomes.len() == 1 {
        let outcome = outcomes.remove(0);
        outcome.picture?;
        return console.report(&outcome.report);
    }
    let path = places.sheet();
    let exposure = exposure(places.own);
    sheet(&places.scene, &outcomes, exposure).write(&path)?;
    console.say(format!("contact sheet: {}", path.display()));
    console.report(&Modes {
        modes: outcomes.into_iter().map(|o| o.report).collect(),
        files: vec![path],
    })
}

/// The pictures of several modes under their names, as the paper's Figure 1.
fn sheet<'a>(scene: &str, outcomes: &'a [Outcome], exposure: Exposure) -> Sheet<'a> {
    let tiles = outcomes.iter().map(|o| {
        let (_, alpha, tau) = mode_of(o.transport);
        let numbers = format!("alpha {alpha}, tau {tau}");
        Tile {
            picture: o.picture.as_ref().ok(),
            title: format!("{} ({numbers})", o.transport.label()),
            note: match &o.picture {
                Ok(_) => String::new(),
                Err(e) => format!("no picture: {e}"),
            },
            gain: 1.0,
        }
    });
    Sheet {
        heading: format!("{scene}: L = E + K L, the visible half"),
        tiles: tiles.collect(),
        columns: 2,
        exposure,
    }
}

/// A line on one mode; where it was the only one, its error speaks for itself.
fn tell(console: &Console, outcome: &Outcome, several: bool) {
    let label = outcome.transport.label();
    let r = &outcome.report;
    let (s, radius) = (&r.seconds, &r.spectral_radius);
    match &outcome.picture {
        Ok(_) => console.say(format!(
            "{label:<11} {} in {:.2} s ({} patches, F {:.2} s, L {:.2} s, gather {:.2} s), spectral radius {}: {}",
            r.verdict, s.total, r.patches, s.form_factors, s.solve, s.gather,
            bounds(radius.lower, radius.upper),
            r.files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().join(" "),
        )),
        Err(e) if several => console.warn(format!("{label}: no picture, {e}")),
        Err(_) => (),
    }
}

fn bounds(lower: f64, upper: f64) -> String {
    match upper == 0.0 {
        true => "0".into(),
        false => format!("{lower:.4} to {upper:.4}"),
    }
}

/// All modes see the same backs but for those behind others: one warning, of the mode with the most.
fn warn_of_backs(console: &Console, outcomes: &[Outcome]) {
    let backs = outcomes.iter().map(|o| o.backs).fold(0.0, f64::max);
    if backs > BACKS {
        console.warn(format!(
            "{:.1} % of the camera's rays meet the black back of a one-sided face; \
             --two-sided gives every face two sides, `two_sided = true` in a scene file those of one material",
            100.0 * backs,
        ));
    }
}

fn exposure(own: &Render) -> Exposure {
    Exposure {
        stops: own.problem.exposure,
    }
}

fn with_suffix(path: &Path, suffix: &str, extension: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{suffix}.{extension}"))
}
