//! What goes wrong on the way to daylight, and what to do about it.

use std::io;

use halflight::pictures::WriteError;
use halflight::render::Unfit;
use halflight::scene::Place;
use halflight::solve::Diverges;
use miette::Diagnostic;

/// Why there are no coefficients or skies.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum DaylightError {
    /// A file cannot be read.
    #[error("cannot read {file}: {source}")]
    #[diagnostic(code(halflight::daylight::read), help("check the path, and that the file may be read"))]
    Read {
        /// The file.
        file: String,
        /// Why.
        source: io::Error,
    },
    /// A line of a weather file is wrong.
    #[error("{place}: {message}")]
    #[diagnostic(
        code(halflight::daylight::weather),
        help(
            "an EPW file begins with LOCATION, and rows follow DATA PERIODS; a .wea file begins with place, latitude, \
             longitude, time_zone, site_elevation and weather_data_file_units, and rows are month, day, hour, direct, diffuse"
        )
    )]
    Weather {
        /// Where.
        place: Place,
        /// What is wrong.
        message: String,
    },
    /// A matrix cannot be read as one of a sky.
    #[error("{file}: {message}")]
    #[diagnostic(
        code(halflight::daylight::matrix),
        help(
            "a matrix of a sky has Radiance's header, a row each for the ground and every patch, and a column a time: what gendaymtx writes"
        )
    )]
    Matrix {
        /// The file.
        file: String,
        /// What is wrong.
        message: String,
    },
    /// There is no sky of that time or number.
    #[error("{sky} has no {message}")]
    #[diagnostic(
        code(halflight::daylight::no_such_sky),
        help(
            "a time is like 06-21 12:00, standard time; a number counts the times of a weather file or the columns of a matrix"
        )
    )]
    NoSuchSky {
        /// What the skies are.
        sky: String,
        /// What is not there.
        message: String,
    },
    /// There is nowhere to measure.
    #[error("there is no point to measure at")]
    #[diagnostic(code(halflight::daylight::points), help("name a table of points or a grid with at least one"))]
    NoPoints,
    /// The series has no sum.
    #[error(transparent)]
    Diverges(#[from] Diverges),
    /// F would not fit in memory.
    #[error(transparent)]
    Memory(#[from] Unfit),
    /// A file cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}
