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

/// What the report of one mode says of it.
fn of_mode(output: &Output) -> Value {
    let report = json(output);
    assert_eq!(report["modes"].as_array().map(Vec::len), Some(1), "{report}");
    report["modes"][0].clone()
}

#[test]
fn a_mode_reports_what_render_reports_and_its_noise() {
    let directory = tempfile::tempdir().unwrap();
    let run = |samples| format!("--mode global --size 16x12 --samples {samples} --next-event on");
    let [few, many] = [32, 512].map(|samples| of_mode(&trace(directory.path(), &run(samples))));
    for (field, expected) in [("width", 16), ("height", 12), ("samples", 512), ("patches", 0)] {
        assert_eq!(many[field], expected, "{field}");
    }
    assert_eq!(many["verdict"], "sampled");
    assert!(many["spectral_radius"].is_null() && many["row_sums"].is_null());
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
    let samples = of_mode(&trace(directory.path(), timed))["samples"].as_u64().unwrap();
    assert!(samples > 0 && samples.is_multiple_of(16));
    let counted = format!("--mode local --size 8x8 --samples {samples} --threads 1 -o counted.exr");
    json(&trace(directory.path(), &counted));
    let read = |name: &str| fs::read(directory.path().join(name)).unwrap();
    assert_eq!(read("timed.exr"), read("counted.exr"));
}

#[test]
fn all_modes_come_with_a_contact_sheet() {
    let directory = tempfile::tempdir().unwrap();
    let report = json(&trace(directory.path(), "--mode all --size 8x8 --samples 4"));
    let verdicts = [0, 1, 2, 3].map(|i| report["modes"][i]["verdict"].clone());
    assert_eq!(verdicts, ["sampled", "sampled", "ends", "ends"]);
    let sheet = report["files"][0].as_str().unwrap();
    assert!(directory.path().join(sheet).exists());
}

#[test]
fn a_series_cut_short_is_said_to_be() {
    let directory = tempfile::tempdir().unwrap();
    let cut = trace(directory.path(), "--mode global --size 8x8 --samples 16 --max-bounces 2");
    assert!(String::from_utf8_lossy(&cut.stderr).contains("--max-bounces"));
    let report = of_mode(&cut);
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

/// The frontier of the variance of the furnished room at tau = 1 lies at alpha 0.624, that of the mean at 0.798
/// (`halflight map`).
#[test]
fn an_infinite_variance_is_told_before_it_misleads() {
    let directory = tempfile::tempdir().unwrap();
    let run = |mode: &str| {
        let output = trace(directory.path(), &format!("furnished-room {mode} --size 8x8 --samples 4 --max-bounces 16"));
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        (of_mode(&output)["variance"].clone(), words)
    };
    // Nothing passes through anything, or nothing travels on: finite without a look.
    for mode in ["--mode global", "--mode local"] {
        let (variance, words) = run(mode);
        assert_eq!(variance["verdict"], "finite");
        assert!(variance["squared_weights"].is_null() && !words.contains("variance"));
    }
    let (inside, words) = run("--alpha 0.45 --tau 1");
    assert_eq!(inside["verdict"], "finite");
    assert_eq!(inside["exponent"], 0.5);
    assert!(!words.contains("variance"), "{words}");
    let (near, words) = run("--alpha 0.62 --tau 1");
    assert_eq!(near["verdict"], "undecided");
    assert!(words.contains("may be infinite"), "{words}");
    let (between, words) = run("--alpha 0.72 --tau 1");
    assert_eq!(between["verdict"], "infinite");
    assert!(between["spectral_radius"]["upper"].as_f64() < Some(1.0));
    // docs/frontier.md predicts N^-0.341 at alpha 0.722 from patches of another size.
    let exponent = between["exponent"].as_f64().unwrap();
    assert!((exponent - 0.341).abs() < 0.05, "{exponent}");
    for part in ["variance is infinite", "N^-1/2", "halflight render"] {
        assert!(words.contains(part), "{words}");
    }
    let (beyond, words) = run("--mode shadowless");
    assert_eq!(beyond["verdict"], "infinite");
    assert!(words.contains("diverges") && beyond["exponent"].is_null(), "{words}");
}

/// Where the mean diverges far enough, the overflow keeps its error.
#[test]
fn light_that_overflows_is_an_error() {
    let directory = tempfile::tempdir().unwrap();
    let output = trace(directory.path(), "furnished-room --mode shadowless --size 8x8 --samples 16 --max-bounces 3000");
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("overflows"));
}
