//! `halflight report`: what it says of the program and the machine, and that nothing private is in it.

use crate::run::{contents, fields, place, report, succeed};

#[test]
fn a_report_says_what_the_program_is_and_runs_on() {
    let place = place(&[]);
    let found = report(&place, "report");
    let names = [
        "architecture",
        "command",
        "features",
        "instructions",
        "memory",
        "processor",
        "profile",
        "system",
        "threads",
        "version",
    ];
    assert_eq!(fields(&found), names);
    assert_eq!(found["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(
        (&found["system"], &found["architecture"]),
        (&std::env::consts::OS.into(), &std::env::consts::ARCH.into())
    );
    assert!(found["threads"].as_u64() >= Some(1), "{found}");
    assert!(found["memory"].as_f64().is_none_or(|memory| memory > 0.01), "{found}");
    assert!(found["command"].is_null());
    let text = succeed(&place, "report").out;
    assert!(text.contains(env!("CARGO_PKG_VERSION")) && text.lines().count() == 5, "{text}");
    assert!(contents(&place).is_empty());
}

#[test]
fn commands_are_told_without_what_is_private() {
    let place = place(&[]);
    for (typed, told) in [
        ("render cornell-box --mode global --size 64x64 -q", "render cornell-box --mode global --size 64x64 -q"),
        ("/home/eve/bin/halflight render /home/eve/flat.OBJ --tolerance 2%", "render FILE.obj --tolerance 2%"),
        ("render --two-sided=Eve,Flat --out=secret -o eve.exr", "render --two-sided=NAME --out=NAME -o FILE.exr"),
        ("render --points grid:eve@1,2 -oeve.png --eve=5 -z7", "render --points NAME -oFILE.png --OPTION=5 -OPTION7"),
        ("relight eve.exr --lamp eve=0.5 --json", "relight FILE.exr --lamp NAME --json"),
        ("render --layers bounces,eve eve.doc", "render --layers NAME NAME"),
    ] {
        let ran = succeed(&place, &format!("report {typed}"));
        let line = ran.out.lines().find_map(|line| line.strip_prefix("command ")).expect("a command").trim();
        assert!(!ran.out.to_lowercase().contains("eve") && !ran.out.contains("secret"), "{}", ran.out);
        assert_eq!(line, format!("halflight {told}"), "{typed}");
    }
}
