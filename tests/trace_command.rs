//! `halflight trace` as a person runs it: the files, the JSON, and the exit codes.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn trace(directory: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_halflight"))
        .arg("trace")
        .args(arguments.split_whitespace())
        .arg("--json")
        .current_dir(directory)
        .output()
        .unwrap()
}

fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_mode_reports_what_render_reports_and_its_noise() {
    let directory = tempfile::tempdir().unwrap();
    let run = |samples| format!("--mode global --size 16x12 --samples {samples} --next-event on");
    let [few, many] = [32, 512].map(|samples| json(&trace(directory.path(), &run(samples))));
    for (field, expected) in [
        ("width", 16),
        ("height", 12),
        ("samples", 512),
        ("patches", 0),
    ] {
        assert_eq!(many[field], expected, "{field}");
    }
    assert_eq!(many["verdict"], "sampled");
    assert!(many["spectral_radius"].is_null() && many["closure"].is_null());
    assert!(many["rays"].as_u64().unwrap() > 16 * 12 * 512);
    // 16 times the samples: a quarter of the noise, within what 192 pixels tell of it.
    let noise = |report: &Value| report["standard_error"].as_f64().unwrap();
    let ratio = noise(&few) / noise(&many);
    assert!((2.5..6.0).contains(&ratio), "{ratio}");
    let file = many["files"][0].as_str().unwrap();
    assert!(fs::metadata(directory.path().join(file)).unwrap().len() > 0);
}

#[test]
fn a_limited_time_gives_the_picture_of_its_number_of_samples() {
    let directory = tempfile::tempdir().unwrap();
    let timed = "--mode local --size 8x8 --time 0.05 -o timed.exr";
    let samples = json(&trace(directory.path(), timed))["samples"]
        .as_u64()
        .unwrap();
    assert!(samples > 0 && samples.is_multiple_of(16));
    let counted = format!("--mode local --size 8x8 --samples {samples} --threads 1 -o counted.exr");
    json(&trace(directory.path(), &counted));
    let read = |name: &str| fs::read(directory.path().join(name)).unwrap();
    assert_eq!(read("timed.exr"), read("counted.exr"));
}

#[test]
fn all_modes_come_with_a_contact_sheet() {
    let directory = tempfile::tempdir().unwrap();
    let report = json(&trace(
        directory.path(),
        "--mode all --size 8x8 --samples 4",
    ));
    let verdicts = [0, 1, 2, 3].map(|i| report["modes"][i]["verdict"].clone());
    assert_eq!(verdicts, ["sampled", "sampled", "ends", "ends"]);
    let sheet = report["files"][0].as_str().unwrap();
    assert!(directory.path().join(sheet).exists());
}

#[test]
fn a_series_cut_short_is_said_to_be() {
    let directory = tempfile::tempdir().unwrap();
    let cut = trace(
        directory.path(),
        "--mode global --size 8x8 --samples 16 --max-bounces 2",
    );
    assert!(String::from_utf8_lossy(&cut.stderr).contains("--max-bounces"));
    let report = json(&cut);
    assert_eq!(report["verdict"], "truncated");
    assert!(report["paths_cut"].as_u64().unwrap() > 0);
    assert_eq!(report["bounces"][3]["mean"][0], 0.0);
}

#[test]
fn arguments_that_cannot_be_met_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    for (arguments, code) in [
        ("--samples 0", 2),
        ("--time -1", 2),
        ("--time soon", 2),
        ("--next-event maybe", 2),
        ("--mode local --alpha 0.5", 2),
        ("no-such-scene", 3),
    ] {
        let output = trace(directory.path(), arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments}");
    }
}
