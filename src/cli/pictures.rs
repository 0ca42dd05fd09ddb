//! What `render` and `trace` share: where the pictures of the modes go, and their contact sheet.

use std::path::{Path, PathBuf};

use crate::cli::error::CliError;
use crate::cli::report::mode_of;
use crate::light::Transport;
use crate::pictures::{Exposure, Picture, check_destination, make_directory};
use crate::plot::{Sheet, Tile};

/// Where the files of one run go.
pub struct Places<'a> {
    /// The file asked for.
    pub output: Option<&'a Path>,
    /// The directory where none is.
    pub directory: &'a Path,
    /// What files in the directory are named after.
    pub stem: String,
    /// Whether there are several modes, so that files are told apart by them.
    pub several: bool,
}

impl Places<'_> {
    /// Makes sure that every file can be written, before the work that is to fill it.
    pub fn check(&self, transports: &[Transport]) -> Result<(), CliError> {
        if self.output.is_none() {
            make_directory(self.directory)?;
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
    pub fn picture(&self, transport: Transport) -> PathBuf {
        let mode = transport.label().replace(' ', "-");
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

/// One mode's picture, or the reason why there is none.
pub type Shown<'a> = (Transport, Result<&'a Picture, String>);

/// The pictures of several modes under their names, as the paper's Figure 1.
pub fn mode_sheet<'a>(heading: String, shown: &[Shown<'a>], exposure: Exposure) -> Sheet<'a> {
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
    Sheet { heading, tiles: tiles.collect(), columns: 2, exposure }
}

fn with_suffix(path: &Path, suffix: &str, extension: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{suffix}.{extension}"))
}
