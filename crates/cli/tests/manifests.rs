//! What a release says of itself in several files is the same in all: the address, the version, the names.
//!
//! Reads text. Not handled: whether the address answers, which no test may ask.

use std::fs;
use std::path::{Path, PathBuf};

/// Where the address stands, besides the manifest of the workspace, of which all crates take it.
const PLACES: [&str; 2] = [".github/ISSUE_TEMPLATE/config.yml", "CITATION.cff"];

/// What is no address: who has one replaces it in the manifest and in [`PLACES`]. In two parts, as this file is read.
const PLACEHOLDER: &str = concat!("forge", ".invalid");

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn text(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The text between quotes behind a key of the manifest's `[workspace.package]`.
fn of_workspace(key: &str) -> String {
    let manifest = text("Cargo.toml");
    let (_, package) = manifest.split_once("[workspace.package]").expect("a workspace");
    let package = &package[..package.find("\n[").expect("more tables")];
    let line = package.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = \"")).expect("such a key");
    line[..line.find('"').expect("a quote")].to_string()
}

/// Manifests of the crates that are published.
fn manifests() -> Vec<String> {
    let crates = fs::read_dir(root().join("crates")).unwrap();
    let names = crates.map(|entry| format!("crates/{}/Cargo.toml", entry.unwrap().file_name().to_str().unwrap()));
    let mut found: Vec<String> = names.chain(["Cargo.toml".into()]).collect();
    found.sort();
    assert!(found.len() > 5);
    found
}

/// Paths from the root of all text files but those of builds and of git.
fn texts(folder: &Path, found: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            if !["target", ".git", "node_modules", "out", "data"].contains(&&name[..]) {
                texts(&path, found);
            }
        } else if let Ok(text) = fs::read_to_string(&path) {
            found.push((path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned(), text));
        }
    }
}

#[test]
fn the_address_is_the_same_wherever_it_stands() {
    let address = of_workspace("repository");
    assert!(address.starts_with("https://") && !address.ends_with('/'), "{address}");
    assert_eq!(of_workspace("homepage"), address);
    for place in PLACES {
        assert!(text(place).contains(&address), "{place} does not name {address}, which Cargo.toml does");
    }
    let mut all = Vec::new();
    texts(&root(), &mut all);
    assert!(all.len() > 500, "{} files", all.len());
    let strays: Vec<&str> = all
        .iter()
        .filter(|(_, text)| text.contains(&address) || text.contains(PLACEHOLDER))
        .map(|(path, _)| &path[..])
        .filter(|path| *path != "Cargo.toml" && !PLACES.contains(path))
        .collect();
    assert!(strays.is_empty(), "the address stands in files that no list has: {strays:?}");
    if !address.contains(PLACEHOLDER) {
        let left: Vec<_> = all.iter().filter(|(_, text)| text.contains(PLACEHOLDER)).map(|(path, _)| path).collect();
        assert!(left.is_empty(), "the placeholder is left in {left:?}");
    }
}

#[test]
fn every_crate_says_what_a_registry_shows() {
    for path in manifests() {
        let manifest = text(&path);
        for key in ["repository", "homepage", "readme", "license", "version", "rust-version"] {
            assert!(manifest.contains(&format!("\n{key}.workspace = true\n")), "{path} has no {key}");
        }
        for key in ["description", "documentation", "keywords", "categories", "include"] {
            assert!(manifest.contains(&format!("\n{key} = ")), "{path} has no {key}");
        }
        let line = manifest.lines().find(|line| line.starts_with("keywords = ")).unwrap();
        assert!(line.matches('"').count() <= 10, "{path}: a registry takes five keywords");
        let name = manifest.lines().find_map(|line| line.strip_prefix("name = ")).unwrap().trim_matches('"');
        assert!(manifest.contains(&format!("{name}\"\n")), "{path}: documentation is not that of {name}");
    }
}

#[test]
fn the_version_is_the_same_wherever_it_stands() {
    let version = of_workspace("version");
    let manifest = text("Cargo.toml");
    let (_, listed) = manifest.split_once("[workspace.dependencies]").unwrap();
    let own = listed.split("\n[").next().unwrap().lines().filter(|line| line.starts_with("halflight"));
    let (mut count, wanted) = (0, format!("version = \"{version}\""));
    for line in own {
        assert!(line.contains(&wanted), "{line}");
        count += 1;
    }
    assert_eq!(count, manifests().len() - 1, "each library once, the program never");
    assert!(text("CITATION.cff").lines().any(|line| line == format!("version: {version}")));
    assert!(text("CHANGELOG.md").contains(&version));
}

/// `halflight` is another project's distribution on PyPI.
#[test]
fn the_distribution_has_another_name_than_the_import() {
    assert!(text("python/pyproject.toml").lines().any(|line| line.starts_with("name = \"pyhalflight\"")));
    for page in ["README.md", "python/README.md", "docs/python.md"] {
        let text = text(page);
        assert!(text.contains("pip install pyhalflight"), "{page}");
        assert!(!text.contains("pip install halflight"), "{page}");
    }
    assert!(text("README.md").contains("cargo install halflight-cli"));
}

/// Scripts and workflows name files that are there.
#[test]
fn workflows_run_scripts_that_are_there() {
    let mut named = 0;
    for entry in fs::read_dir(root().join(".github/workflows")).unwrap() {
        let path = entry.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        for rest in text.split(".ci/").skip(1) {
            let script = &rest[..rest.find(|c: char| !c.is_ascii_alphabetic() && c != '-').unwrap_or(rest.len())];
            if !script.is_empty() {
                assert!(root().join(".ci").join(script).is_file(), "{} runs .ci/{script}", path.display());
                named += 1;
            }
        }
    }
    assert!(named >= 4, "{named}");
}
