//! `--points` as people's tables come: whatever their heads and separators, the light at the same points is the same.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use crate::run::{halflight, report_of_mode};

/// Illuminance at the points of `tests/data/point-tables`, lux.
const LUX: [f64; 3] = [944.0, 1238.0, 886.0];

fn data() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/point-tables")
}

fn room() -> TempDir {
    let place = TempDir::new().expect("a folder");
    for name in ["room.obj", "room.mtl", "plain.csv", "pandas-index.csv", "normal-first.csv"] {
        fs::copy(data().join(name), place.path().join(name)).expect("a file");
    }
    place
}

#[test]
fn light_is_measured_where_the_head_says() {
    let place = room();
    let spreadsheet = "\u{feff}Nr.;\"Normal X\";\"Normal Y\";\"Normal Z\";\"X (m)\";\"Y (m)\";\"Z (m)\";Name\r\n\
                       1;0;1;0;2;0,8;1;desk\r\n2;0;1;0;1;0,8;2,5;door\r\n3;1;0;0;0,02;1,5;2,5;wall, left\r\n";
    fs::write(place.path().join("spreadsheet.csv"), spreadsheet).expect("a file");
    let radiance = "# sensors\nz x y dir_z dir_x dir_y\n1 2 .8\t0 0 1\n2.5 1 .8\t0 0 1\n2.5 .02 1.5\t0 1 0\n";
    fs::write(place.path().join("room.pts"), radiance).expect("a file");
    for table in ["plain.csv", "pandas-index.csv", "normal-first.csv", "spreadsheet.csv", "room.pts"] {
        let options = "--mode global --size 8x8 --tolerance 0.01 --lux";
        let report = report_of_mode(&place, &format!("render room.obj {options} --points {table}"));
        let points = report["points"].as_array().expect("points");
        assert_eq!(points.len(), 3);
        for (point, lux) in points.iter().zip(LUX) {
            let found = point["illuminance"].as_f64().expect("a number");
            assert!((found / lux - 1.0).abs() < 0.03, "{table}: {found} for {lux}");
        }
        if table == "spreadsheet.csv" {
            let names: Vec<_> = points.iter().map(|point| point["name"].as_str().expect("a name")).collect();
            assert_eq!(names, ["desk", "door", "wall, left"]);
            let written = fs::read_to_string(place.path().join("out/room-points-global.csv")).expect("a table");
            assert!(written.contains("\ndesk,2,") && written.contains("\n\"wall, left\",0.02,"), "{written}");
        }
    }
    // What the program writes is a table of the same points.
    fs::copy(place.path().join("out/room-points-global.csv"), place.path().join("again.csv")).expect("a file");
    let again =
        report_of_mode(&place, "render room.obj --mode global --size 8x8 --tolerance 0.01 --lux --points again.csv");
    assert!((again["points"][0]["illuminance"].as_f64().expect("a number") / LUX[0] - 1.0).abs() < 0.03);
}

#[test]
fn a_head_that_cannot_be_understood_is_refused_by_name() {
    let place = room();
    fs::write(place.path().join("odd.csv"), "# by hand\neast,north,height,nx,ny,nz\n2,.8,1,0,1,0\n").expect("a file");
    let ran = halflight(&place, "render room.obj --mode global --size 8x8 --points odd.csv");
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    let said = ran.err.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in ["odd.csv, line 2", "`east, north, height, nx, ny, nz`", "no column is x", "x,y,z,nx,ny,nz"] {
        assert!(said.contains(part), "{part}: {said}");
    }
}
