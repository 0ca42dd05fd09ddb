//! The memory estimate made before K is put together, against what a run takes, and what happens where it is too much.

use halflight::Solver;
use halflight::form_factors::Sampling;
use halflight::light::Mode;
use halflight::render::{Discretization, Stored};
use halflight::scene::{LoadOptions, Scene};
use halflight_study::map::{Survey, check_crossings};

use crate::run::{contents, halflight, place};

fn room(patches: usize) -> Discretization {
    let scene = Scene::builtin("furnished-room", LoadOptions::default());
    Solver::new(&scene.unwrap().unwrap()).cut(patches)
}

const SAMPLING: Sampling = Sampling { rays: 64, emitter_rays: 64, seed: 0 };

#[test]
fn the_patches_said_to_fit_do_and_one_more_does_not() {
    let p = room(12_000);
    let modes = [Mode::Global.transport()];
    let all = p.check_memory(&modes, &SAMPLING, 1, 1.0).unwrap_err();
    // Half the rays of a row land apart at the most, and at least one does.
    assert!(matches!(all.stored, Stored::Rows(entries) if (1.0..=64.0).contains(&entries)));
    assert!(p.check_memory(&modes, &SAMPLING, 1, f64::INFINITY).is_ok());
    let error = p.check_memory(&modes, &SAMPLING, 1, 0.5 * all.bytes).unwrap_err();
    assert!(error.fitting > 1 && error.fitting < p.patches.len());
    assert!(p.check_memory(&modes, &SAMPLING, 1, all.bytes).is_ok());
    // The count cut is met within about a third, so ask for less than what fits by that.
    let fewer = room(error.fitting * 2 / 3);
    assert!(fewer.patches.len() <= error.fitting);
    assert!(fewer.check_memory(&modes, &SAMPLING, 1, error.limit).is_ok());
}

/// The stored entries are what most of the estimate stands for.
#[test]
fn the_measured_length_of_a_row_is_that_of_all_rows() {
    let p = room(2000);
    let modes = [Mode::Global.transport()];
    let Stored::Rows(estimated) = p.check_memory(&modes, &SAMPLING, 1, 1.0).unwrap_err().stored else {
        panic!("rows of F");
    };
    let (k, _) = p.assemble(&modes, &SAMPLING, &halflight::render::Silent);
    let f = k[0].operator.form_factors();
    let lengths: Vec<f64> = (0..f.len()).map(|i| f.row(i).0.len() as f64).collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let variance = lengths.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / lengths.len() as f64;
    // 64 rows were looked at. Columns that send nothing are counted too, here the lamp's: one entry a row at the most.
    let allowed = 4.0 * (variance / 64.0).sqrt() + 1.0;
    assert!((estimated - mean).abs() < allowed, "{estimated} {mean}");
}

#[test]
fn what_does_not_fit_is_refused_with_the_number_that_would() {
    let place = place(&[]);
    let before = contents(&place);
    for command in ["render", "bounces"] {
        let arguments = format!("{command} furnished-room --mode global --rays 64 --size 8x8 --memory 0.002 --out .");
        let ran = halflight(&place, &format!("{arguments} --patches 20000"));
        assert_eq!(ran.code, Some(5), "{}", ran.err);
        for part in ["MiB of memory", "one row of F for each patch", "--memory", "2.0 MiB can be used"] {
            assert!(ran.err.contains(part), "`{part}` not in {}", ran.err);
        }
        let fits = ran.err.split("pass --patches ").nth(1).unwrap();
        let fits: usize = fits.split(' ').next().unwrap().trim().parse().unwrap();
        assert!(fits > 1 && fits < 20_000);
        assert!(contents(&place) == before);
    }
    let ran = halflight(&place, "render --mode global --memory 0.00001 --size 8x8");
    assert_eq!(ran.code, Some(5), "{}", ran.err);
    let ran = halflight(&place, "render --memory 0");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
}

/// Where a tolerance asks for more patches than memory holds, it gets those that fit, and the error says so.
#[test]
fn a_tolerance_takes_what_memory_there_is() {
    let place = place(&[]);
    let render = "render furnished-room --mode global --tolerance 0.02 --size 32x32";
    let error = |report: &serde_json::Value| report["error"]["patches"].as_f64().unwrap();
    let free = crate::run::report_of_mode(&place, render);
    let tight = crate::run::report_of_mode(&place, &format!("{render} --memory 0.004"));
    assert!(tight["patches"].as_u64() < free["patches"].as_u64());
    assert!(error(&tight) > 0.0);
}

/// The other commands say what needs memory and what to do, each in its own words, before they measure anything.
#[test]
fn every_command_that_stores_patches_refuses_what_does_not_fit() {
    let place = place(&[]);
    let before = contents(&place);
    for (arguments, parts) in [
        (
            "compare --mode global --memory 0.002 --time 1 --size 8x8",
            ["one row of F for each patch", "pass a --time below 2"],
        ),
        ("chart --mode global --memory 0.0002 --time 1 --size 8x8", ["one row of F for each patch", "fewer faces"]),
        ("map furnished-room --memory 0.02 --patches 4000", ["all of whose crossings are kept", "pass --patches"]),
    ] {
        let ran = halflight(&place, &format!("{arguments} --out ."));
        assert_eq!(ran.code, Some(5), "{arguments}: {}", ran.err);
        for part in ["MiB can be used", "patches would fit", "--memory GIB"].iter().chain(&parts) {
            assert!(ran.err.contains(part), "{arguments}: `{part}` not in {}", ran.err);
        }
        assert!(contents(&place) == before, "{arguments}");
    }
}

/// What the crossings of a few patches foretell is what all of them take.
#[test]
fn crossings_said_to_fit_do() {
    let p = room(2000);
    let survey = Survey::new(&p, &SAMPLING, &halflight::render::Silent);
    let error = check_crossings(&p, &SAMPLING, 2, 1.0).unwrap_err();
    let Stored::Crossings(each) = error.stored else {
        panic!("{error}");
    };
    let mean = survey.crossings() as f64 / p.patches.len() as f64;
    // 64 patches were looked at, of some 100 crossings each, whose number varies by less than its mean.
    assert!((each - mean).abs() < 4.0 * mean / 8.0, "{each} {mean}");
    assert!(error.bytes > 12.0 * survey.crossings() as f64 * 0.5);
    assert!(check_crossings(&p, &SAMPLING, 2, error.bytes).is_ok());
    assert!(check_crossings(&p, &SAMPLING, 2, 0.99 * error.bytes).is_err());
}

/// Pictures are asked about before a scene is even read.
#[test]
fn pictures_that_do_not_fit_are_refused_with_the_pixels_that_would() {
    let place = place(&[]);
    for command in ["render", "bounces", "trace", "compare", "chart"] {
        let arguments = format!("{command} --size 16384x16384 --memory 0.5 --out .");
        let ran = halflight(&place, &arguments);
        assert_eq!(ran.code, Some(5), "{arguments}: {}", ran.err);
        for part in ["16384x16384 pixels", "512.0 MiB can be used", "smaller --size"] {
            assert!(ran.err.contains(part), "`{part}` not in {}", ran.err);
        }
        assert!(contents(&place).is_empty());
    }
    let ran = halflight(&place, "trace --size 40x10 --samples 1 --mode local --memory 0.001");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
}
