//! `halflight daylight` as a person runs it: files, numbers, what it says to wrong arguments; `factors --exchange`; and
//! light from all around points.

use std::f64::consts::PI;
use std::fs;

use crate::run::{contents, halflight, place, report, succeed};

/// A floor of 2 by 2 m of reflectance 0, its front up (y).
const FLOOR: (&str, &str) =
    ("floor.obj", "mtllib floor.mtl\no floor\nusemtl black\nv -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n");
const BLACK: (&str, &str) = ("floor.mtl", "newmtl black\nKd 0 0 0\n");
const WEA: (&str, &str) = (
    "day.wea",
    "place Somewhere_X\nlatitude 40\nlongitude 0\ntime_zone 0\nsite_elevation 0\nweather_data_file_units 1\n\
     6 21 11.5 700 120\n6 21 12.5 710 118\n6 21 23.5 0 0\n",
);

#[test]
fn an_open_floor_has_the_illuminance_of_the_sky_and_the_sun() {
    let place = place(&[FLOOR, BLACK, WEA]);
    let found = report(&place, "daylight floor.obj --points grid:floor@0.5,0.5 --sky day.wea --tolerance 0.1");
    assert_eq!((&found["points"], &found["columns"], &found["met"]), (&16.into(), &146.into(), &true.into()));
    let metrics = &found["metrics"];
    assert_eq!((&metrics["hours"], &metrics["sda"], &metrics["ase"]), (&2.0.into(), &1.0.into(), &0.0.into()));
    let files = contents(&place);
    for file in [
        "floor-daylight.mtx",
        "floor-daylight.npy",
        "floor-daylight.npz",
        "floor-daylight-sky.mtx",
        "floor-daylight-hours.csv",
        "floor-daylight-hours.npy",
        "floor-daylight-points.csv",
        "floor-daylight-mean.svg",
        "floor-daylight-autonomy.svg",
        "floor-daylight-sunlit.svg",
        "floor-daylight-udi.svg",
    ] {
        assert!(files.contains_key(&format!("out/{file}")), "{file}");
    }
    assert!(files["out/floor-daylight.mtx"].starts_with(b"#?RADIANCE\n"));
    let head = String::from_utf8_lossy(&files["out/floor-daylight.mtx"][..160]).into_owned();
    assert!(
        ["NROWS=16\n", "NCOLS=146\n", "NCOMP=3\n", "FORMAT=float\n"].iter().all(|own| head.contains(own)),
        "{head}"
    );
    let hours = String::from_utf8(files["out/floor-daylight-hours.csv"].clone()).unwrap();
    let rows: Vec<Vec<&str>> = hours.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!((rows.len(), rows[0].len(), rows[3][3]), (4, 19, "0.00"));
    // What a matrix of its own makes of it: the sky spread over patches, the sun among them.
    let again =
        report(&place, "daylight floor.obj --points grid:floor@0.5,0.5 --sky out/floor-daylight-sky.mtx --out two");
    let (lux, spread) = (rows[1][3].parse::<f64>().unwrap(), again["mean"].as_f64().unwrap() * 3.0);
    let both = lux + rows[2][3].parse::<f64>().unwrap();
    assert!((spread / both - 1.0).abs() < 0.02, "{spread} {both}");
}

#[test]
fn the_daylight_factor_of_an_open_floor_is_one() {
    let place = place(&[FLOOR, BLACK]);
    for sky in ["overcast", "uniform", "clear:40,180"] {
        let found = report(&place, &format!("daylight floor.obj --points grid:floor@1,1 --sky {sky} --mf 2"));
        for factor in found["daylight_factors"].as_array().unwrap() {
            // Luminance counts as that of a patch's middle, and the illuminance is scaled by the same rule but for
            // cosines of middles in place of their means: 2e-3 at MF:2.
            assert!((factor[0].as_f64().unwrap() - 1.0).abs() < 3e-3, "{sky}: {factor}");
        }
    }
    let files = contents(&place);
    assert!(files.contains_key("out/floor-daylight-factor.svg"));
    succeed(&place, "daylight floor.obj --points grid:floor@1,1 --bounces 0 --out bare");
    assert!(!place.path().join("bare/floor-daylight-sky.mtx").exists());
}

/// A sky for pictures: the floor has the illuminance that the year's table says; the matrix of the same skies with its
/// sun spread has the same but for that, over 179 in place of 683 lm/W.
#[test]
fn the_sky_of_an_hour_lights_a_scene() {
    let place = place(&[FLOOR, BLACK, WEA]);
    let found = report(&place, "daylight floor.obj --sky day.wea --sky-of 1 --mf 2 --out one");
    assert_eq!((&found["time"]["hour"], &found["whole"]), (&11.5.into(), &true.into()));
    let (diffuse, direct) = (found["diffuse"].as_f64().unwrap(), found["direct"].as_f64().unwrap());
    report(&place, "daylight floor.obj --points grid:floor@0.5,0.5 --sky day.wea --mf 2");
    let hours = fs::read_to_string(place.path().join("out/floor-daylight-hours.csv")).unwrap();
    let expected: f64 = hours.lines().nth(1).unwrap().split(',').nth(3).unwrap().parse().unwrap();
    let lux = |scene: &str| {
        let points = "--points grid:floor@0.5,0.5 --lux --tolerance 0.01 --size 16x16 --mode global";
        let found = report(&place, &format!("render {scene} {points} -o floor.png"));
        found["modes"][0]["points"][0]["illuminance"].as_f64().unwrap()
    };
    let shown = lux("one/floor-sky.toml");
    assert!((shown / expected - 1.0).abs() < 0.01 && shown > diffuse && shown < diffuse + direct, "{shown} {expected}");
    let spread = "obj = \"floor.obj\"\n[sky]\npatches = \"out/floor-daylight-sky.mtx\"\ncolumn = 1\n";
    fs::write(place.path().join("spread.toml"), spread).unwrap();
    let spread = lux("spread.toml") * 179.0 / 683.0;
    assert!((spread / expected - 1.0).abs() < 0.02, "{spread} {expected}");
    let again = report(&place, "daylight one/floor-sky.toml --sky day.wea --sky-of 2 --out two");
    assert_eq!(again["whole"], false);
}

#[test]
fn what_is_wrong_is_said_and_nothing_is_left() {
    let broken = ("broken.wea", "place A_B\nlatitude 40\nlongitude x\n");
    let place = place(&[
        FLOOR,
        BLACK,
        WEA,
        broken,
        ("floor.toml", "obj = \"floor.obj\"\n[sky]\npatches = \"grey.txt\"\n"),
        ("grey.txt", "# grey\n1 1 1\n1,5 1 1\n"),
        ("no.mtx", "#?RADIANCE\nNROWS=3\nNCOLS=1\nFORMAT=ascii\n\n1 1 1 1 1 1 1 1 1\n"),
    ]);
    for (arguments, code, words) in [
        ("daylight floor.obj --points grid:floor@1,1 --sky snow", 2, "overcast"),
        ("daylight floor.obj --points grid:floor@1,1 --sky clear:100,0", 2, "clear:40,180"),
        ("daylight floor.obj --points grid:floor@1,1 --mf 9", 2, "from 1 to 8"),
        ("daylight floor.obj --points grid:floor@1,1 --up 0,0,0", 2, "not all 0"),
        ("daylight floor.obj --points grid:floor@1,1 --north y", 2, "parallel"),
        ("daylight floor.obj --points grid:floor@1,1 --hours 18-8", 2, "8-18"),
        ("daylight floor.obj --points grid:floor", 2, "no grid"),
        ("daylight floor.obj --points volume:2x2", 2, "no volume"),
        ("daylight floor.obj --points grid:roof@1,1", 3, "no object `roof`"),
        ("daylight floor.obj --points grid:floor@1,1 --sky broken.wea", 3, "line 4"),
        ("daylight floor.obj --points grid:floor@1,1 --sky none.epw", 3, "none.epw"),
        ("daylight floor.obj --points grid:floor@1,1 --sky no.mtx", 3, "3 rows"),
        ("daylight floor.obj --sky day.wea", 2, "--points"),
        ("daylight floor.obj --sky-of 1", 2, "--sky"),
        ("daylight floor.obj --sky day.wea --sky-of noon", 2, "06-21 12:00"),
        ("daylight floor.obj --sky day.wea --sky-of 13-21_12:00", 2, "06-21 12:00"),
        ("daylight floor.obj --sky day.wea --sky-of 4", 3, "no sky 4 of 3"),
        ("daylight floor.obj --sky overcast --sky-of 2", 3, "no sky 2 of 1"),
        ("render floor.toml", 3, "grey.txt, line 3: `1,5` is no number"),
        ("factors floor.obj --exchange none.csv", 3, "none.csv"),
        ("factors floor.obj --exchange day.wea", 3, "emissivity"),
    ] {
        let ran = halflight(&place, arguments);
        assert_eq!(ran.code, Some(code), "{arguments}: {}", ran.err);
        assert!(ran.err.contains(words), "{arguments}: {}", ran.err);
    }
    assert!(!place.path().join("out/floor-daylight.mtx").exists());
}

/// A cube whose floor has another emissivity than all else: `G = 1 / (1/(A1 e1) + (1 - e2)/(A2 e2))`, since the floor
/// sees none of itself (M. F. Modest, *Radiative heat transfer*, two grey surfaces).
#[test]
fn a_cube_of_two_surfaces_exchanges_what_the_textbook_has() {
    let cube = "o floor\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\nf 4 3 2 1\n\
                o rest\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    let place = place(&[("cube.obj", cube), ("eps.csv", "object,emissivity\nfloor,0.3\nrest,0.7\n")]);
    let found = report(&place, "factors cube.obj --exchange eps.csv");
    let exact = 1.0 / (1.0 / 0.3 + 0.3 / (5.0 * 0.7));
    let table = fs::read_to_string(place.path().join("out/cube-exchange-conductances.csv")).unwrap();
    let cells: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(cells[0], ["from", "floor", "rest"]);
    for (row, column) in [(1, 2), (2, 1)] {
        let own: f64 = cells[row][column].parse().unwrap();
        assert!((own / exact - 1.0).abs() < 1e-6, "{own} {exact}");
    }
    for sum in found["exchange"]["row_sums"].as_array().unwrap() {
        assert!((sum.as_f64().unwrap() - 1.0).abs() < 1e-6, "{sum}");
    }
}

/// Within a closed room that emits and reflects the same everywhere L is E / (1 - rho): in the furnace 0.5, so that the
/// scalar irradiance is 2 pi, and the cylindrical one pi / 2.
#[test]
fn within_a_furnace_light_comes_from_all_around() {
    let place = place(&[]);
    let found =
        report(&place, "render furnace --mode global --size 16 --tolerance 0.05 --points volume:2x1x1 --fluence");
    let points = found["modes"][0]["points"].as_array().unwrap();
    assert_eq!(points.len(), 2);
    for point in points {
        for (kind, exact) in [("scalar", 2.0 * PI), ("cylindrical", 0.5 * PI)] {
            let (own, error) = (point[kind][1].as_f64().unwrap(), point[format!("{kind}_error")][1].as_f64().unwrap());
            assert!((own - exact).abs() < 2.0 * error + 1e-3 * exact, "{kind}: {own} {exact} {error}");
            assert!(error < 0.05 * exact);
        }
        assert!(point.get("semicylindrical").is_none(), "points of a volume face up");
    }
    let table = fs::read_to_string(place.path().join("out/furnace-points-global.csv")).unwrap();
    assert!(
        table
            .lines()
            .next()
            .unwrap()
            .ends_with("semicylindrical_error_r,semicylindrical_error_g,semicylindrical_error_b")
    );
}
