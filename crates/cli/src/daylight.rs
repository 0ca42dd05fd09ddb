//! `halflight daylight`: coefficients of sky patches at points, and what the skies of a weather file make of them.

use std::path::{Path, PathBuf};

use clap::Args;
use glam::DVec3;

use crate::console::Console;
use crate::error::CliError;
use crate::options::arguments::{Common, Completion, MemoryLimit, picture_error, unit_interval};
use crate::options::points::layout_of;
use halflight::Scene;
use halflight::pictures::{check_destination, make_directory};
use halflight_daylight::{
    Compass, DaylightFiles, DaylightGoal, DaylightReport, Division, Illuminance, Occupied, STANDARD, SceneSkyReport,
    Skies, SkyChoice, SkyTime, Standard, SunPlace, Weather, coefficients, write_daylight, write_scene_sky,
};

/// `halflight daylight`
#[derive(Args, Debug)]
#[command(next_help_heading = "Daylight")]
pub struct DaylightArguments {
    /// A built-in scene (see `halflight scenes`), an .obj, .glb or .gltf file, or a .toml scene file; it need not emit
    #[arg(help_heading = None::<&str>)]
    pub scene: String,
    /// Points of a table (x, y, z, nx, ny, nz and a name), a grid over an object, grid:OBJECT@HEIGHT,SPACING, or the
    /// cells of the scene's box, volume:XxYxZ
    #[arg(long, value_name = "FILE|GRID", required_unless_present = "sky_of")]
    pub points: Option<String>,
    /// Write the sky of a time, like "06-21 12:00", or of a number from 1, and its sun as a scene file for pictures,
    /// and nothing else
    #[arg(long, value_name = "TIME|N", value_parser = sky_of, requires = "sky", conflicts_with = "points")]
    pub sky_of: Option<SkyChoice>,
    /// A weather file (.epw, .wea), a matrix of skies (.mtx), or overcast, uniform, clear:ALTITUDE,AZIMUTH (CIE);
    /// without it coefficients alone are written
    #[arg(long, value_name = "FILE|KIND", value_parser = sky)]
    pub sky: Option<SkySource>,
    /// Divide the sky by Tregenza (1) or by Reinhart's MF:N: 144 N² patches, the cap and the ground
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = division)]
    pub mf: usize,
    /// Reflections that count: 0 is direct light alone [default: all of them]
    #[arg(long, value_name = "N")]
    pub bounces: Option<usize>,
    /// Relative error of the coefficients to aim at: RMS over the columns of a point, then over points
    #[arg(long, value_name = "T", default_value = "0.02", value_parser = picture_error)]
    pub tolerance: f64,
    /// The direction upwards: x, y, z, or three numbers [default: the scene file's sky, or y]
    #[arg(long, value_name = "AXIS", value_parser = axis)]
    pub up: Option<DVec3>,
    /// The direction to the north [default: the scene file's sky, or -z where y is up, y where z is up]
    #[arg(long, value_name = "AXIS", value_parser = axis)]
    pub north: Option<DVec3>,
    /// Reflectance of the ground that lies below the horizon
    #[arg(long, value_name = "RHO", default_value_t = 0.2, value_parser = unit_interval)]
    pub ground: f32,
    /// Hours of the day that count for autonomy, sunlit hours and UDI, standard time
    #[arg(long, value_name = "FROM-UNTIL", default_value = "8-18", value_parser = occupied)]
    pub hours: Occupied,
    /// What its files do not say.
    #[command(flatten)]
    pub completion: Completion,
    /// Within which memory.
    #[command(flatten)]
    pub limit: MemoryLimit,
}

/// What the sky is.
#[derive(Clone, Debug)]
pub enum SkySource {
    /// A weather file.
    Weather(PathBuf),
    /// A matrix of skies.
    Matrix(PathBuf),
    /// One without weather.
    Standard(Standard),
}

fn sky(text: &str) -> Result<SkySource, String> {
    let ends = |end: &str| Path::new(text).extension().is_some_and(|own| own.eq_ignore_ascii_case(end));
    if ends("epw") || ends("wea") {
        return Ok(SkySource::Weather(text.into()));
    }
    if ends("mtx") {
        return Ok(SkySource::Matrix(text.into()));
    }
    let clear = || {
        let numbers: Vec<f64> =
            text.strip_prefix("clear:")?.split(',').map(|own| own.parse().ok()).collect::<Option<_>>()?;
        let &[altitude, azimuth] = &numbers[..] else { return None };
        let is_known = (0.0..=90.0).contains(&altitude) && (-360.0..=360.0).contains(&azimuth);
        is_known.then(|| Standard::Clear(SunPlace { altitude: altitude.to_radians(), azimuth: azimuth.to_radians() }))
    };
    let kind = match text {
        "overcast" => Some(Standard::Overcast),
        "uniform" => Some(Standard::Uniform),
        _ => clear(),
    };
    kind.map(SkySource::Standard).ok_or_else(|| {
        "must be an .epw, .wea or .mtx file, overcast, uniform, or clear:ALTITUDE,AZIMUTH of the sun in degrees, as in \
         clear:40,180"
            .into()
    })
}

fn sky_of(text: &str) -> Result<SkyChoice, String> {
    let time = || {
        let (date, clock) = text.split_once(' ')?;
        let (month, day) = date.split_once('-')?;
        let (hour, minute) = clock.split_once(':')?;
        let (month, day) = (month.parse().ok()?, day.parse().ok()?);
        let (hour, minute) = (hour.parse::<u8>().ok()?, minute.parse::<u8>().ok()?);
        let is_time = (1..=12).contains(&month) && (1..=31).contains(&day) && hour <= 24 && minute < 60;
        let hour = f64::from(hour) + f64::from(minute) / 60.0;
        is_time.then_some(SkyChoice::Time(SkyTime { month, day, hour }))
    };
    let found = text.parse().ok().map(SkyChoice::Number).or_else(time);
    found.ok_or_else(|| "must be month-day hour:minute, as in \"06-21 12:00\", or a number from 1".into())
}

fn division(text: &str) -> Result<usize, String> {
    let known = text.parse().ok().filter(|n| Division::new(*n).is_some());
    known.ok_or_else(|| format!("must be from 1 to {}", Division::FINEST))
}

fn axis(text: &str) -> Result<DVec3, String> {
    let (sign, name) = text.strip_prefix('-').map_or((1.0, text), |rest| (-1.0, rest));
    let named = [("x", DVec3::X), ("y", DVec3::Y), ("z", DVec3::Z)].into_iter().find(|(own, _)| *own == name);
    let numbers = || {
        let numbers: Option<Vec<f64>> = text.split(',').map(|own| own.trim().parse().ok()).collect();
        let &[x, y, z] = &numbers?[..] else { return None };
        Some(DVec3::new(x, y, z)).filter(|own| own.is_finite() && own.length() > 0.0)
    };
    let found = named.map(|(_, axis)| sign * axis).or_else(numbers);
    found.ok_or_else(|| "must be x, y, z, -x, -y, -z, or three numbers with commas between them, not all 0".into())
}

fn occupied(text: &str) -> Result<Occupied, String> {
    let numbers = text.split_once('-').and_then(|(from, until)| Some((from.parse().ok()?, until.parse().ok()?)));
    let known = numbers.filter(|(from, until): &(f64, f64)| 0.0 <= *from && from < until && *until <= 24.0);
    known.map(|(from, until)| Occupied { from, until }).ok_or_else(|| "must be like 8-18, from 0 to 24".into())
}

impl DaylightArguments {
    fn compass(&self, scene: &Scene) -> Result<Compass, CliError> {
        let own = scene.sky.as_ref().filter(|_| self.up.is_none());
        let up = self.up.or_else(|| own.map(|sky| sky.up.as_dvec3())).unwrap_or(DVec3::Y);
        let found = match self.north.or_else(|| own.map(|sky| sky.north.as_dvec3())) {
            None => Compass::of_up(up),
            Some(north) => Compass::new(up, north),
        };
        found.ok_or_else(|| CliError::Usage {
            message: format!("north and up are parallel: up is ({}, {}, {})", up.x, up.y, up.z),
            help: "pass --north, and --up if it is not y".into(),
        })
    }

    /// The skies, and the illuminance outside of one without a time.
    fn skies(&self, division: Division) -> Result<Option<(Skies, Option<f64>)>, CliError> {
        let ground = f64::from(self.ground);
        Ok(match &self.sky {
            None => None,
            Some(SkySource::Weather(path)) => Some((Skies::of_weather(&Weather::read(path)?, division, ground), None)),
            Some(SkySource::Matrix(path)) => Some((Skies::read_matrix(path, division)?, None)),
            Some(SkySource::Standard(kind)) => {
                Some((Skies::standard(*kind, division, STANDARD, ground), Some(STANDARD)))
            }
        })
    }
}

/// Finds coefficients, and writes and says what comes of them.
pub fn run(own: &DaylightArguments, common: &Common, console: &Console) -> Result<(), CliError> {
    let scene = own.completion.load(&own.scene, console)?;
    let Some(division) = Division::new(own.mf) else { unreachable!("the argument was checked") };
    let compass = own.compass(&scene)?;
    if let Some(choice) = own.sky_of {
        return run_sky_of((own, choice), &scene, (division, compass), (common, console));
    }
    let layout = layout_of(&scene, own.points.as_deref().unwrap_or_default(), compass.up)?;
    let skies = own.skies(division)?;
    make_directory(&common.out)?;
    check_destination(common.out.join(format!("{}-daylight.mtx", scene.name)))?;
    let all_suns = skies.iter().flat_map(|(skies, _)| skies.skies.iter().filter_map(|sky| sky.sun));
    let suns: Vec<DVec3> = all_suns.map(|sun| sun.towards).collect();
    let goal = DaylightGoal {
        transport: scene.transport.unwrap_or_default(),
        division,
        compass,
        suns: &suns,
        bounces: own.bounces,
        tolerance: own.tolerance,
        seed: common.seed,
        memory: own.limit.bytes(),
        watch: console,
    };
    let found = coefficients(&scene, &layout.sensors, &goal)?;
    let light = skies.as_ref().map(|(skies, _)| Illuminance::new(&found, skies));
    let metrics = skies.as_ref().zip(light.as_ref()).and_then(|((skies, _), light)| light.metrics(skies, own.hours));
    let files = DaylightFiles {
        layout: &layout,
        found: &found,
        skies: skies.as_ref().zip(light.as_ref()).map(|((skies, _), light)| (skies, light)),
        metrics: metrics.as_ref(),
        outside: skies.as_ref().and_then(|(_, outside)| *outside),
        tolerance: own.tolerance,
    };
    let report = write_daylight((&common.out, &scene.name), &files)?;
    say(&report, console);
    console.report(&report)
}

/// Writes the sky of a time for a scene file.
fn run_sky_of(
    (own, choice): (&DaylightArguments, SkyChoice),
    scene: &Scene,
    (division, compass): (Division, Compass),
    (common, console): (&Common, &Console),
) -> Result<(), CliError> {
    let Some((skies, _)) = own.skies(division)? else { unreachable!("--sky-of requires --sky") };
    let at = skies.find(choice)?;
    make_directory(&common.out)?;
    let path = Path::new(&own.scene);
    let is_geometry = path.is_file() && !path.extension().is_some_and(|end| end.eq_ignore_ascii_case("toml"));
    let geometry = is_geometry.then_some(path);
    let report = write_scene_sky((&common.out, &scene.name), (&skies, at), &compass, geometry)?;
    let SceneSkyReport { time, diffuse, direct, whole, files } = &report;
    let when = time.map_or_else(|| format!("sky {}", at + 1), |time| time.to_string());
    console.say(format!("{}, {when}: the sky {diffuse:.0} lx on the horizontal, the sun {direct:.0} lx", skies.name));
    if !whole {
        console.say("the lines of the .toml belong into the scene file: its geometry is not that of one OBJ or glTF");
    }
    files.iter().for_each(|file| console.say(file.display().to_string()));
    console.report(&report)
}

fn say(report: &DaylightReport, console: &Console) {
    let DaylightReport { scene, points, columns, patches, error, patch_error, tolerance, seconds, .. } = report;
    console.say(format!(
        "{scene}: {points} points by {columns} columns in {seconds:.2} s ({patches} patches), estimated error {:.2} %, of \
         which patches {:.2} %",
        100.0 * error,
        100.0 * patch_error,
    ));
    if !report.met {
        console.warn(format!(
            "the estimated error is {:.2} %, not {:.2} %: more rays or patches would take too long; each coefficient has \
             its own in the .npz",
            100.0 * error,
            100.0 * tolerance
        ));
    }
    if let Some(factors) = &report.daylight_factors {
        let mean = factors.iter().map(|own| own[0]).sum::<f64>() / factors.len() as f64;
        let least = factors.iter().map(|own| own[0]).fold(f64::INFINITY, f64::min);
        console.say(format!("daylight factor: mean {:.3} %, least {:.3} %", 100.0 * mean, 100.0 * least));
    }
    if let Some(metrics) = &report.metrics {
        console.say(format!(
            "{}: sDA 300/50 % {:.1} %, ASE 1000/250 {:.1} %, of {} occupied hours; mean {:.0} lx over all times",
            report.sky.as_deref().unwrap_or_default(),
            100.0 * metrics.sda,
            100.0 * metrics.ase,
            (10.0 * metrics.hours).round() / 10.0,
            report.mean.unwrap_or_default(),
        ));
    }
    report.files.iter().for_each(|file| console.say(file.display().to_string()));
}
