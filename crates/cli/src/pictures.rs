//! Pictures of several modes, by `render` or `trace`: where they go, their reports, and their contact sheet.
//!
//! Field names of reports are kept from version to version; new ones may be added.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::console::Console;
use crate::error::CliError;
use halflight::form_factors::RowSums;
use halflight::light::Transport;
use halflight::operator::Bounds;
use halflight::pictures::{Exposure, Picture, Size, check_destination, is_exr, make_directory};
use halflight::render::{EmitterPower, ErrorParts, LayerError, Seconds};
use halflight::scene::Scene;
use halflight_lighting::Measured;
use halflight_plot::{Cell, Drawing, Heading, Page, Shown};

/// Where the files of one run go.
pub struct Places<'a> {
    /// The requested file.
    pub output: Option<&'a Path>,
    /// The directory where none is.
    pub directory: &'a Path,
    /// What files in the directory are named after.
    pub stem: String,
    /// Whether there are several modes, which then are part of the files' names.
    pub several: bool,
}

impl Places<'_> {
    /// Makes sure that every file can be written, before the work that is to fill it.
    pub fn check(&self, transports: &[Transport]) -> Result<(), CliError> {
        if self.output.is_none() {
            make_directory(self.directory)?;
        }
        for &transport in transports {
            check_place(&self.picture(transport))?;
        }
        if self.several {
            check_place(&self.sheet())?;
        }
        Ok(())
    }

    /// One mode's picture.
    pub fn picture(&self, transport: Transport) -> PathBuf {
        let mode = transport.file_name();
        match self.output {
            None => self.directory.join(format!("{}-{mode}.png", self.stem)),
            Some(path) if self.several => {
                let extension = path.extension().unwrap_or_default().to_string_lossy();
                with_suffix(path, &mode, &extension)
            }
            Some(path) => path.to_path_buf(),
        }
    }

    /// The contact sheet.
    pub fn sheet(&self) -> PathBuf {
        match self.output {
            None => self.directory.join(format!("{}-modes.png", self.stem)),
            Some(path) => with_suffix(path, "modes", "png"),
        }
    }
}

/// Makes sure that a file can be written, in a folder that is made if there is none.
pub fn check_place(path: &Path) -> Result<(), CliError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.exists());
    folder.map_or(Ok(()), make_directory)?;
    Ok(check_destination(path)?)
}

fn with_suffix(path: &Path, suffix: &str, extension: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{suffix}.{extension}"))
}

/// One mode's picture, or the reason why there is none.
pub struct Outcome<R, E> {
    pub transport: Transport,
    pub picture: Result<Picture, E>,
    /// Share of the camera's rays that meet the black back of a face.
    pub backs: f64,
    pub report: R,
}

impl<R, E: Display> Outcome<R, E> {
    /// The name of the mode; a warning where there is no picture of one of several modes. One alone ends with its
    /// error.
    pub fn label(&self, several: bool, console: &Console) -> String {
        let label = self.transport.label();
        if let (Err(e), true) = (&self.picture, several) {
            console.warn(format!("{label}: no picture, {e}"));
        }
        label
    }

    /// The picture under its name and numbers, as in the paper's Figure 1.
    fn cell(&self, exposure: Exposure) -> Cell {
        let Transport { alpha, tau } = self.transport;
        let title = format!("{} (alpha {alpha}, tau {tau})", self.transport.label());
        let shown = match &self.picture {
            Ok(picture) => Shown::image(picture, exposure),
            Err(e) => Shown::Absent(format!("no picture: {e}")),
        };
        Cell::new(Heading::new(title, ""), shown)
    }
}

/// The report of all modes, with the contact sheet of several; where one alone has no picture its error.
pub fn finish<R: Serialize, E: Display + Into<CliError>>(
    mut outcomes: Vec<Outcome<R, E>>,
    places: &Places,
    heading: String,
    exposure: Exposure,
    console: &Console,
) -> Result<(), CliError> {
    if outcomes.len() == 1 {
        let Outcome { picture, report, .. } = outcomes.remove(0);
        picture.map_err(Into::into)?;
        return console.report(&Modes { modes: vec![report], files: Vec::new() });
    }
    let path = places.sheet();
    let cells = outcomes.iter().map(|outcome| outcome.cell(exposure)).collect();
    Page::sheet(heading, cells, 2).drawing().write(&path)?;
    console.say(format!("contact sheet: {}", path.display()));
    console.report(&Modes { modes: outcomes.into_iter().map(|o| o.report).collect(), files: vec![path] })
}

/// The files of one run in the directory for output, in the order in which they are written.
pub struct Files {
    start: PathBuf,
    named: Vec<PathBuf>,
}

impl Files {
    /// No files yet; their names will start with `stem`.
    pub fn new(directory: &Path, stem: &str) -> Files {
        Files { start: directory.join(stem), named: Vec::new() }
    }

    /// The place of one more file, by how its name ends.
    pub fn add(&mut self, end: &str) -> PathBuf {
        let mut path = self.start.clone().into_os_string();
        path.push(end);
        self.named.push(path.clone().into());
        path.into()
    }

    /// Writes a drawing as files of these kinds, `svg` or `png`.
    pub fn draw(&mut self, end: &str, kinds: &[&str], drawing: &Drawing) -> Result<(), CliError> {
        for kind in kinds {
            drawing.write(&self.add(&format!("{end}.{kind}")))?;
        }
        Ok(())
    }

    /// Says where they are, and gives them back.
    pub fn said(self, console: &Console) -> Vec<PathBuf> {
        for file in &self.named {
            console.say(file.display().to_string());
        }
        self.named
    }
}

/// `--json` of all commands that solve for modes: as many as were requested and have a result.
#[derive(Serialize)]
pub struct Modes<T> {
    /// One report a mode.
    pub modes: Vec<T>,
    /// Files written for all modes together.
    pub files: Vec<PathBuf>,
}

/// `halflight render --json`, of each mode.
#[derive(Default, Serialize)]
pub struct RenderReport {
    /// The scene's name.
    pub scene: String,
    /// Its mode.
    #[serde(flatten)]
    pub transport: Transport,
    /// Pixels across and down.
    #[serde(flatten)]
    pub size: Size,
    /// Triangles loaded.
    pub triangles: u32,
    /// Patches cut.
    pub patches: usize,
    /// Rays cast for form factors (shared by the modes of one run) and for this picture.
    pub rays: u64,
    /// Where the time went.
    pub seconds: Seconds,
    /// Estimated relative errors of the picture; null where effort was given instead of a tolerance, and for a path
    /// tracer.
    pub error: Option<ErrorParts>,
    /// Whether the estimated error is at most the requested one; null where none was.
    pub met: Option<bool>,
    /// Why it is not.
    pub why: Option<String>,
    /// Proved bounds; null where none were sought.
    pub spectral_radius: Option<Bounds>,
    /// The least, largest and mean row sum of F; null where no ray was needed.
    pub row_sums: Option<RowSums>,
    /// `converges`, `ends` or `diverges`; of a traced picture see [`TraceReport`](crate::trace::TraceReport).
    pub verdict: &'static str,
    /// Light at points, where it is requested.
    #[serde(flatten)]
    pub measured: Option<Measured>,
    /// Powers of the emitters, where their light is kept apart.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub luminaires: Vec<EmitterPower>,
    /// Names of the picture's layers, where it is taken apart.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<String>,
    /// RMS of each of them over the pixels that see no luminaire, and of its estimated error, W/(m² sr), where the
    /// picture has a tolerance.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layer_errors: Vec<LayerError>,
    /// Stops that PNG files are brightened by.
    pub exposure: f32,
    /// Files written.
    pub files: Vec<PathBuf>,
}

impl RenderReport {
    /// What is known of a mode before it is solved or traced.
    pub fn new(scene: &Scene, transport: Transport, size: Size) -> RenderReport {
        let (scene, triangles) = (scene.name.clone(), scene.solid_faces());
        RenderReport { scene, transport, size, triangles, ..RenderReport::default() }
    }

    /// How its PNG files are shown, where a radiance of 1 is not white.
    pub fn shown(&self) -> String {
        let has_png = self.files.iter().any(|file| !is_exr(file));
        if has_png && self.exposure != 0.0 {
            format!(" (shown {:+.1} stops; --exposure 0 makes radiance 1 white)", self.exposure)
        } else {
            String::new()
        }
    }

    /// The names of the files, in one line.
    pub fn file_names(&self) -> String {
        self.files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(" ")
    }
}
