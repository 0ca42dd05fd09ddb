//! The `rust-version` of the manifest is true: no locked dependency asks for a newer compiler.
//!
//! Asks `cargo metadata` for this platform's dependencies, without the network. Not handled: what the crate's own code
//! needs; clippy's `incompatible_msrv` reads that.

use std::process::Command;

/// `1.89` and `1.89.0` as (1, 89).
fn version(text: &str) -> (u32, u32) {
    let mut numbers = text.split('.').map(|part| part.parse().expect("a number"));
    (numbers.next().expect("a major version"), numbers.next().unwrap_or(0))
}

/// The platform that rustc builds for.
fn host() -> Option<String> {
    let told = Command::new("rustc").arg("-vV").output().ok()?;
    let text = String::from_utf8(told.stdout).ok()?;
    text.lines().find_map(|line| line.strip_prefix("host: ")).map(str::to_owned)
}

/// What cargo knows of the packages, or why it does not.
fn metadata() -> Result<serde_json::Value, String> {
    let cargo = option_env!("CARGO").unwrap_or("cargo");
    let host = host().ok_or("rustc does not say what it builds for")?;
    let asked = ["metadata", "--format-version=1", "--locked", "--offline", "--filter-platform", &host];
    let told = Command::new(cargo).current_dir(env!("CARGO_MANIFEST_DIR")).args(asked).output();
    let told = told.map_err(|error| format!("no cargo: {error}"))?;
    if !told.status.success() {
        return Err(String::from_utf8_lossy(&told.stderr).into_owned());
    }
    serde_json::from_slice(&told.stdout).map_err(|error| error.to_string())
}

#[test]
fn no_dependency_needs_a_newer_compiler_than_is_said() {
    let metadata = match metadata() {
        Ok(metadata) => metadata,
        Err(reason) => return eprintln!("skipped: {reason}"),
    };
    let packages = metadata["packages"].as_array().expect("a list of packages");
    // With a filter for the platform the list still has every locked package; those built here are the resolved ones.
    let nodes = metadata["resolve"]["nodes"].as_array().expect("resolved packages");
    let built: Vec<&str> = nodes.iter().filter_map(|node| node["id"].as_str()).collect();
    let stated = packages.iter().filter(|p| built.contains(&p["id"].as_str().unwrap_or("")));
    let needs = |p: &serde_json::Value| Some((version(p["rust_version"].as_str()?), p["name"].as_str()?.to_owned()));
    let (newest, name) = stated
        .filter(|p| !p["name"].as_str().is_some_and(|name| name.starts_with("halflight")))
        .filter_map(needs)
        .max()
        .expect("some say it");
    let own = version(env!("CARGO_PKG_RUST_VERSION"));
    assert!(own >= newest, "rust-version says {own:?}, and {name} needs {newest:?}");
}
