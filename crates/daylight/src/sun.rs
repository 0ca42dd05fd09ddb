//! Where the sun is.
//!
//! ```text
//! declination   0.4093 sin(2 pi (J - 81) / 365)
//! solar time    hour + 0.170 sin(4 pi (J - 80) / 373) - 0.129 sin(2 pi (J - 8) / 355) + 12/pi (meridian - longitude)
//! altitude      asin(sin(lat) sin(decl) - cos(lat) cos(decl) cos(pi t / 12))
//! ```
//!
//! with J the day of the year, angles in radians, longitude and meridian west of Greenwich: what Radiance's `gensky`
//! and `gendaymtx` compute. Within half a degree of the almanac. Source: the formulas of IES RP-21, *Calculation of
//! daylight availability*, 1984. Not handled: the years before 1950 and after 2050, refraction.

use std::f64::consts::PI;

use glam::DVec3;

use crate::division::direction;

/// Apparent diameter of the sun, radians: 0.533°.
pub const DIAMETER: f64 = 0.533 * PI / 180.0;

/// Where on earth, degrees: north and east of what is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// North of the equator.
    pub latitude: f64,
    /// East of Greenwich.
    pub longitude: f64,
    /// Hours ahead of Greenwich.
    pub time_zone: f64,
}

/// Where the sun is at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPlace {
    /// Radians; below 0 it has set.
    pub altitude: f64,
    /// Radians from north by east.
    pub azimuth: f64,
}

impl SunPlace {
    /// East, north and up of the direction to its middle.
    pub fn direction(&self) -> DVec3 {
        direction(self.altitude, self.azimuth)
    }

    /// Whether a part of it is above the horizon.
    pub fn is_up(&self) -> bool {
        self.altitude > -0.5 * DIAMETER
    }
}

/// The day of a year without a leap day, from 1.
pub fn day_of_year(month: usize, day: usize) -> usize {
    const BEFORE: [usize; 12] = [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334];
    BEFORE[month.clamp(1, 12) - 1] + day
}

/// Where the sun is on a day of the year, at an hour of standard time.
pub fn sun_at(place: &Location, day: usize, hour: f64) -> SunPlace {
    let j = day as f64;
    let declination = 0.4093 * (2.0 * PI / 365.0 * (j - 81.0)).sin();
    let equation = 0.170 * (4.0 * PI / 373.0 * (j - 80.0)).sin() - 0.129 * (2.0 * PI / 355.0 * (j - 8.0)).sin();
    let meridian = (place.longitude - 15.0 * place.time_zone) / 15.0;
    let angle = PI / 12.0 * (hour + equation + meridian);
    let (latitude, (sin, cos)) = (place.latitude.to_radians(), declination.sin_cos());
    let altitude = (latitude.sin() * sin - latitude.cos() * cos * angle.cos()).clamp(-1.0, 1.0).asin();
    let west = cos * angle.sin();
    let south = -latitude.cos() * sin - latitude.sin() * cos * angle.cos();
    SunPlace { altitude, azimuth: PI - west.atan2(south) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_noon_it_stands_south_and_90_less_latitude_high_at_an_equinox() {
        let place = Location { latitude: 50.0, longitude: 0.0, time_zone: 0.0 };
        let day = day_of_year(3, 22);
        let places = (0..2400).map(|k| sun_at(&place, day, 0.01 * f64::from(k)));
        let noon = places.max_by(|a, b| a.altitude.total_cmp(&b.altitude)).expect("times");
        assert!((noon.altitude.to_degrees() - 40.0).abs() < 0.5, "{noon:?}");
        assert!((noon.azimuth.to_degrees() - 180.0).abs() < 0.2, "{noon:?}");
        // In the morning it stands in the east.
        let early = sun_at(&place, day, 8.0).direction();
        assert!(early.x > 0.0 && early.z > 0.0);
    }
}
