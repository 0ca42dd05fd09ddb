//! Weather files: what is read, and what is refused with its line.

use std::fs;

use halflight_daylight::{Division, Measured, Skies, Weather};

const WEA: &str = "place Zurich_CHE\nlatitude 47.38\nlongitude -8.57\ntime_zone -15\nsite_elevation 569\n\
                   weather_data_file_units 1\n6 21 11.500 600 150\n6 21 12.500 620 140\n12 21 0.5 0 0\n";

fn read(name: &str, text: &str) -> Result<Weather, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    fs::write(&path, text).expect("a file");
    Weather::read(&path).map_err(|error| error.to_string())
}

#[test]
fn a_wea_file_is_read() {
    let weather = read("a.wea", WEA).expect("weather");
    assert_eq!((weather.location.longitude, weather.location.time_zone, weather.hours), (8.57, 1.0, 1.0));
    assert_eq!(weather.times[0].measured, Measured::Irradiance { direct: 600.0, diffuse: 150.0 });
    let skies = Skies::of_weather(&weather, Division::new(1).expect("a division"), 0.2);
    assert!(skies.skies[1].sun.is_some() && skies.skies[2].sun.is_none());
    assert!(skies.skies[2].luminance.iter().all(|l| *l == 0.0));
}

/// Times of ten minutes as DAYSIM writes them, each in the middle of an interval that may end after midnight.
#[test]
fn times_go_on_past_midnight() {
    let head = WEA.split("6 21").next().expect("a head");
    let rows = "6 21 23.917 0 0\n6 21 24.083 0 0\n6 22 0.250 0 0\n";
    let weather = read("a.wea", &format!("{head}{rows}")).expect("weather");
    assert!((weather.hours - 1.0 / 6.0).abs() < 0.01 && weather.times[1].hour == 24.083, "{}", weather.hours);
    assert!(read("a.wea", &format!("{head}6 21 25.5 0 0\n")).is_err_and(|error| error.contains("the hour 25.5")));
}

#[test]
fn an_epw_file_is_read_with_times_in_the_middle_of_hours() {
    let row = |hour: usize, direct: f64, diffuse: f64| {
        format!("1999,6,21,{hour},60,?9?9,20.0,12.0,50,101325,0,0,0,500,{direct},{diffuse},0,0,0,0\n")
    };
    let head = "LOCATION,Zurich,-,CHE,IWEC,066700,47.38,8.57,1.0,569\nDESIGN CONDITIONS,0\n\
                DATA PERIODS,1,1,Data,Sunday, 1/ 1,12/31\n";
    let weather = read("a.epw", &[head, &row(12, 500.0, 100.0), &row(13, 400.0, 90.0)].concat()).expect("weather");
    assert_eq!(weather.name, "Zurich");
    assert_eq!((weather.times[0].hour, weather.times[1].hour, weather.times[1].dew_point), (11.5, 12.5, 12.0));
    let error = read("b.epw", &[head, "1999,6,21,12,60,?,1\n"].concat()).expect_err("a short row");
    assert!(error.contains("line 4") && error.contains("7 fields"), "{error}");
    let error = read("c.epw", &[head, &row(12, 9999.0, 1.0)].concat()).expect_err("a missing value");
    assert!(error.contains("line 4") && error.contains("direct normal irradiance 9999"), "{error}");
    let error = read("d.epw", "LOCATION,Zurich,-,CHE,IWEC,0,47,8,1,569\n").expect_err("no data");
    assert!(error.contains("DATA PERIODS"), "{error}");
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    for (text, line, what) in [
        ("P6\n".to_owned(), 1, "neither LOCATION"),
        (WEA.replace("latitude 47.38", "latitude 147.38"), 2, "latitude 147.38"),
        (WEA.replace("longitude", "longtitude"), 3, "`longitude`"),
        (WEA.replace("6 21 11.500", "13 21 11.500"), 7, "month 13"),
        (WEA.replace("600 150", "x 150"), 7, "`x` is no number"),
        (WEA.replace("620 140", "620"), 8, "4 fields"),
        (WEA.replace("_units 1", "_units 4"), 6, "units 4"),
        (WEA.lines().take(6).collect::<Vec<_>>().join("\n"), 6, "without a time"),
    ] {
        let error = read("b.wea", &text).expect_err("broken weather");
        assert!(error.contains(&format!("line {line}")) && error.contains(what), "{error}");
    }
}
