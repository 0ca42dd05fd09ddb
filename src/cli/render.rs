//! `halflight render`: the picture of each mode, and a contact sheet of several.

use std::time::Instant;

use super::CliError;
use super::console::Console;
use super::options::{Common, Render};
use super::pictures::{Places, Shown, mode_sheet, warn_of_backs};
use super::report::{Modes, Radius, RenderReport, mode_of};
use crate::image::{Exposure, GatherSampling, Picture, check_extension, write_picture};
use crate::light::Transport;
use crate::solve::{Diverges, Settings, Solution, neumann};
use crate::study::{Assembled, Prepared, Seconds, assemble, prepare, render};

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
    let scene = own.problem.subject.load()?;
    for warning in &scene.warnings {
        console.warn(warning);
    }
    let transports = own.problem.subject.transports(&scene);
    let places = Places {
        output: own.output.as_deref(),
        directory: &common.out,
        stem: scene.name.clone(),
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
    warn_of_backs(&console, outcomes.iter().map(|o| o.backs));
    finish(&places, &console, exposure(own), outcomes)
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
        report.spectral_radius = Some(radius.into());
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
        let gathering = match own.problem.tolerance {
            Some(error) => crate::image::Gathering::Within { error, seed: self.common.seed },
            None => (&sampling).into(),
        };
        let gathered = render(self.prepared, mode, solution, size, gathering, self.console);
        eprintln!("{:?} {}", gathered.error, gathered.error.relative());
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
            spectral_radius: None,
            closure: mode.closure.map(Into::into),
            verdict: "",
            files: Vec::new(),
        }
    }
}

/// The contact sheet and the report of several modes, or the report or error of one.
fn finish(
    places: &Places,
    console: &Console,
    exposure: Exposure,
    mut outcomes: Vec<Outcome>,
) -> Result<(), CliError> {
    if outcomes.len() == 1 {
        let outcome = outcomes.remove(0);
        outcome.picture?;
        return console.report(&outcome.report);
    }
    let path = places.sheet();
    let shown: Vec<Shown> = outcomes
        .iter()
        .map(|o| (o.transport, o.picture.as_ref().map_err(|e| e.to_string())))
        .collect();
    let heading = format!("{}: L = E + K L, the visible half", places.stem);
    mode_sheet(heading, &shown, exposure).write(&path)?;
    console.say(format!("contact sheet: {}", path.display()));
    console.report(&Modes {
        modes: outcomes.into_iter().map(|o| o.report).collect(),
        files: vec![path],
    })
}

/// A line on one mode; where it was the only one, its error speaks for itself.
fn tell(console: &Console, outcome: &Outcome, several: bool) {
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
        Err(e) if several => console.warn(format!("{label}: no picture, {e}")),
        Err(_) => (),
    }
}

fn bounds(radius: Option<&Radius>) -> String {
    match radius {
        Some(r) if r.upper > 0.0 => format!("{:.4} to {:.4}", r.lower, r.upper),
        _ => "0".into(),
    }
}

fn exposure(own: &Render) -> Exposure {
    Exposure {
        stops: own.problem.subject.exposure,
    }
}
