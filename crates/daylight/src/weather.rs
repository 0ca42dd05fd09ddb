//! Weather files: EPW, and `.wea` as Radiance has it.
//!
//! | file | time of a row | what counts |
//! |---|---|---|
//! | EPW | the middle of its hour, or its minute | direct normal and diffuse horizontal irradiance, dew point |
//! | `.wea`, units 1 | as written | the same irradiances |
//! | `.wea`, units 2 | as written | the same, direct on the horizontal |
//! | `.wea`, units 3 | as written | direct normal and diffuse horizontal illuminance |
//!
//! Times are standard time; where an EPW file has several rows an hour its minutes count. The dew point of a time is
//! the mean of its own and the two before, as in `gendaymtx`; 11 °C where there is none.
//!
//! Source: *Auxiliary EnergyPlus Programs*, EPW CSV format; the manual page of `gendaymtx`. Not handled: measured
//! illuminances of EPW files, which many files leave 0; data periods after the first.

use std::fs;
use std::path::Path;

use halflight::scene::Place;

use crate::error::DaylightError;
use crate::perez::Measured;
use crate::sun::{Location, SunPlace, day_of_year, sun_at};

/// The dew point where a file has none, °C.
const DEW_POINT: f64 = 11.0;

/// A row of a weather file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeatherTime {
    /// 1 to 12.
    pub month: usize,
    /// 1 to 31.
    pub day: usize,
    /// Standard time, 0 to 24; up to 25 where an interval that began before midnight ends after it.
    pub hour: f64,
    /// Day of the year from 1, that of a leap year from 29 February on.
    pub day_of_year: usize,
    /// What was measured.
    pub measured: Measured,
    /// °C.
    pub dew_point: f64,
}

/// A weather file.
#[derive(Clone, Debug, PartialEq)]
pub struct Weather {
    /// Of the place.
    pub name: String,
    /// Where.
    pub location: Location,
    /// In the file's order.
    pub times: Vec<WeatherTime>,
    /// Hours that each time stands for.
    pub hours: f64,
}

/// A text with its file's name, for errors.
struct Text<'a> {
    file: String,
    lines: Vec<&'a str>,
}

impl Weather {
    /// Reads an EPW or `.wea` file, whichever it is by its first line.
    ///
    /// A file that cannot be read, or a line that is wrong.
    pub fn read(path: &Path) -> Result<Weather, DaylightError> {
        let file = path.display().to_string();
        let bytes = fs::read(path).map_err(|source| DaylightError::Read { file: file.clone(), source })?;
        let all = String::from_utf8_lossy(&bytes);
        let text = Text { file, lines: all.trim_start_matches('\u{feff}').lines().collect() };
        let first = text.lines.first().map(|line| line.to_ascii_lowercase()).unwrap_or_default();
        if first.starts_with("location,") {
            text.epw()
        } else if first.starts_with("place") {
            text.wea()
        } else {
            Err(text.wrong(1, "is neither LOCATION of an EPW file nor place of a .wea file"))
        }
    }

    /// Where the sun is at a time of the file.
    pub fn sun(&self, time: &WeatherTime) -> SunPlace {
        sun_at(&self.location, time.day_of_year, time.hour)
    }
}

impl Text<'_> {
    fn wrong(&self, line: usize, message: impl Into<String>) -> DaylightError {
        DaylightError::Weather { place: Place::line(&self.file, line), message: message.into() }
    }

    fn number(&self, line: usize, what: &str, text: &str) -> Result<f64, DaylightError> {
        let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| self.wrong(line, format!("`{}` is no number for {what}", text.trim())))
    }

    /// A number of a range.
    fn within(&self, line: usize, what: &str, text: &str, range: (f64, f64)) -> Result<f64, DaylightError> {
        let number = self.number(line, what, text)?;
        let outside = || self.wrong(line, format!("{what} {number} is not from {} to {}", range.0, range.1));
        (range.0..=range.1).contains(&number).then_some(number).ok_or_else(outside)
    }

    fn location(&self, lines: [usize; 3], [north, east, zone]: [(&str, f64); 3]) -> Result<Location, DaylightError> {
        let east_number = east.1 * self.number(lines[1], "the longitude", east.0)?;
        let zone_number = zone.1 * self.number(lines[2], "the time zone", zone.0)?;
        let latitude = self.within(lines[0], "the latitude", north.0, (-90.0, 90.0))?;
        if !(-180.0..=180.0).contains(&east_number) {
            return Err(self.wrong(lines[1], format!("the longitude {east_number} is not from -180 to 180")));
        }
        if !(-15.0..=15.0).contains(&zone_number) {
            return Err(self.wrong(lines[2], format!("the time zone of {zone_number} hours is not from -15 to 15")));
        }
        Ok(Location { latitude, longitude: east_number, time_zone: zone_number })
    }

    fn epw(&self) -> Result<Weather, DaylightError> {
        let fields: Vec<&str> = self.lines[0].split(',').collect();
        let [latitude, longitude, zone] = [6, 7, 8].map(|k| (fields.get(k).copied().unwrap_or_default(), 1.0));
        let location = self.location([1; 3], [latitude, longitude, zone])?;
        let is_periods = |line: &str| line.to_ascii_uppercase().starts_with("DATA PERIODS");
        let Some(head) = self.lines.iter().position(|line| is_periods(line)) else {
            return Err(self.wrong(self.lines.len(), "ends without a line DATA PERIODS"));
        };
        let an_hour = self.lines[head].split(',').nth(2).unwrap_or_default();
        let an_hour = self.within(head + 1, "the records an hour", an_hour, (1.0, 60.0))?;
        let mut times = Times::default();
        for (k, line) in self.lines.iter().enumerate().skip(head + 1).filter(|(_, line)| !line.trim().is_empty()) {
            let fields: Vec<&str> = line.split(',').collect();
            if fields.len() < 16 {
                return Err(
                    self.wrong(k + 1, format!("has {} fields; irradiances are the 15th and 16th", fields.len()))
                );
            }
            let hour = self.within(k + 1, "the hour", fields[3], (1.0, 24.0))? - 1.0;
            let minute = self.within(k + 1, "the minute", fields[4], (0.0, 60.0))?;
            let hour = hour + if an_hour == 1.0 { 0.5 } else { minute / 60.0 };
            let [direct, diffuse] = [(14, "the direct normal irradiance"), (15, "the diffuse horizontal irradiance")]
                .map(|(field, what)| self.within(k + 1, what, fields[field], (0.0, 9998.0)));
            let dew = self.number(k + 1, "the dew point", fields[7]).ok().filter(|dew| *dew < 99.9 && *dew > -90.0);
            let measured = Measured::Irradiance { direct: direct?, diffuse: diffuse? };
            times.add(self.date(k + 1, fields[1], fields[2])?, hour, measured, dew);
        }
        self.weather(fields.get(1).copied().unwrap_or_default(), location, times, 1.0 / an_hour)
    }

    fn wea(&self) -> Result<Weather, DaylightError> {
        const KEYS: [&str; 6] =
            ["place", "latitude", "longitude", "time_zone", "site_elevation", "weather_data_file_units"];
        let mut values = [""; 6];
        for (k, (key, value)) in KEYS.iter().zip(&mut values).enumerate() {
            let line = self.lines.get(k).copied().unwrap_or_default();
            let own = line.split_once(char::is_whitespace).filter(|(name, _)| name.eq_ignore_ascii_case(key));
            *value = own.ok_or_else(|| self.wrong(k + 1, format!("is not `{key}` and a value")))?.1.trim();
        }
        let [_, latitude, longitude, zone, _, units] = values;
        let location = self.location([2, 3, 4], [(latitude, 1.0), (longitude, -1.0), (zone, -1.0 / 15.0)])?;
        let units = self.within(6, "the units", units, (1.0, 3.0))?;
        let mut times = Times::default();
        for (k, line) in self.lines.iter().enumerate().skip(6).filter(|(_, line)| !line.trim().is_empty()) {
            let fields: Vec<&str> = line.split_whitespace().collect();
            let &[month, day, hour, direct, diffuse, ..] = &fields[..] else {
                return Err(
                    self.wrong(k + 1, format!("has {} fields, not month, day, hour and two values", fields.len()))
                );
            };
            let date = self.date(k + 1, month, day)?;
            // DAYSIM's times of less than an hour go on past midnight.
            let hour = self.within(k + 1, "the hour", hour, (0.0, 25.0))?;
            let direct = self.within(k + 1, "the direct value", direct, (0.0, 1e6))?;
            let diffuse = self.within(k + 1, "the diffuse value", diffuse, (0.0, 1e6))?;
            let height = sun_at(&location, times.day_of_year(date), hour).altitude.sin();
            let measured = match units {
                2.0 if height > 1e-6 => Measured::Irradiance { direct: direct / height, diffuse },
                3.0 => Measured::Illuminance { direct, diffuse },
                _ => Measured::Irradiance { direct, diffuse },
            };
            times.add(date, hour, measured, None);
        }
        let hours = spacing(&times.all);
        self.weather(values[0], location, times, hours)
    }

    fn date(&self, line: usize, month: &str, day: &str) -> Result<(usize, usize), DaylightError> {
        let month = self.within(line, "the month", month, (1.0, 12.0))?;
        Ok((month as usize, self.within(line, "the day", day, (1.0, 31.0))? as usize))
    }

    fn weather(&self, name: &str, location: Location, times: Times, hours: f64) -> Result<Weather, DaylightError> {
        if times.all.is_empty() {
            return Err(self.wrong(self.lines.len(), "ends without a time"));
        }
        Ok(Weather { name: name.trim().to_owned(), location, times: times.all, hours })
    }
}

/// Hours between most times that follow one another; 1 of a single one.
fn spacing(times: &[WeatherTime]) -> f64 {
    let apart = |pair: &[WeatherTime]| {
        24.0 * (pair[1].day_of_year as f64 - pair[0].day_of_year as f64) + pair[1].hour - pair[0].hour
    };
    let mut all: Vec<f64> = times.windows(2).map(apart).filter(|hours| *hours > 0.0).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).map_or(1.0, |hours| hours.min(1.0))
}

/// Times as they are read.
#[derive(Default)]
struct Times {
    all: Vec<WeatherTime>,
    /// Whether 29 February was read.
    is_leap: bool,
    /// The dew points of the last two times, where there are any.
    dew: Option<[f64; 2]>,
}

impl Times {
    fn day_of_year(&self, (month, day): (usize, usize)) -> usize {
        if (month, day) == (2, 29) { 60 } else { day_of_year(month, day) + usize::from(self.is_leap && month > 2) }
    }

    fn add(&mut self, date: (usize, usize), hour: f64, measured: Measured, dew: Option<f64>) {
        self.is_leap |= date == (2, 29);
        let dew_point = dew.map_or(DEW_POINT, |now| {
            let before = self.dew.unwrap_or([now; 2]);
            (before[0] + before[1] + now) / 3.0
        });
        self.dew = dew.map(|now| [self.dew.unwrap_or([now; 2])[1], now]);
        let (month, day) = date;
        self.all.push(WeatherTime { month, day, hour, day_of_year: self.day_of_year(date), measured, dew_point });
    }
}
