//! Several processes that MPI started make the bytes that one makes.
//!
//! Needs the feature `mpi` and `mpirun`; without them nothing is tested, and the test says so.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Commands whose loops are shared out, each small.
const COMMANDS: [&str; 5] = [
    "render two-rooms --mode global --tolerance 0.08 --size 32x32 -o OUT/picture.exr",
    "bounces cornell-box --mode global --patches 200 --out OUT",
    "map cornell-box --patches 100 --out OUT",
    "trace cornell-box --mode global --samples 4 --size 24x24 -o OUT/traced.exr",
    "factors cornell-box --tolerance 0.1 --out OUT",
];

/// `mpirun` for so many ranks on a machine that may have fewer cores; none where it is not to be had.
fn ranks(count: u32) -> Option<Command> {
    let mut mpirun = Command::new("mpirun");
    mpirun.envs([("OMPI_ALLOW_RUN_AS_ROOT", "1"), ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")]);
    mpirun.env("OMPI_MCA_rmaps_base_oversubscribe", "1").args(["-n", &count.to_string()]);
    let is_there = Command::new("mpirun").arg("--version").output().is_ok();
    (cfg!(feature = "mpi") && is_there).then_some(mpirun)
}

/// Runs a command, by MPI or alone, with one thread a process.
fn run(started: Option<Command>, arguments: &str, directory: &Path) -> std::process::Output {
    let program = env!("CARGO_BIN_EXE_halflight");
    let mut command = match started {
        None => Command::new(program),
        Some(mut mpirun) => {
            mpirun.arg(program);
            mpirun
        }
    };
    let words = arguments.split(' ').map(|word| word.replace("OUT", &directory.to_string_lossy()));
    command.args(words).args(["--threads", "1"]).output().expect("it starts")
}

/// The files that the commands make with so many ranks.
fn files(count: Option<u32>) -> BTreeMap<String, Vec<u8>> {
    let directory = tempfile::tempdir().expect("a directory");
    for command in COMMANDS {
        let done = run(count.and_then(ranks), command, directory.path());
        assert!(done.status.success(), "{command} by {count:?}: {}", String::from_utf8_lossy(&done.stderr));
    }
    let entries = fs::read_dir(directory.path()).expect("the directory").map(|entry| entry.expect("an entry").path());
    let named = |path: std::path::PathBuf| {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        (name, fs::read(path).expect("a file"))
    };
    entries.map(named).collect()
}

#[test]
fn any_number_of_ranks_makes_the_same_bytes() {
    if ranks(1).is_none() {
        return eprintln!("skipped: needs the feature mpi, and mpirun");
    }
    let alone = files(None);
    assert!(alone.len() >= 8, "{:?}", alone.keys());
    for count in 1..=4 {
        let together = files(Some(count));
        assert!(alone.keys().eq(together.keys()), "{count}: {:?}", together.keys());
        let differing: Vec<&String> =
            alone.iter().filter(|(name, bytes)| together[*name] != **bytes).map(|f| f.0).collect();
        assert!(differing.is_empty(), "{count}: {differing:?}");
    }
}

/// What every rank finds wrong one of them says, and all end with the exit code of one process.
#[test]
fn an_error_ends_all_ranks_and_is_told_once() {
    let Some(mpirun) = ranks(2) else { return eprintln!("skipped: needs the feature mpi, and mpirun") };
    let directory = tempfile::tempdir().expect("a directory");
    let done = run(Some(mpirun), "render no-such-scene.obj --out OUT", directory.path());
    let told = String::from_utf8_lossy(&done.stderr).matches("no scene named `no-such-scene.obj`").count();
    assert_eq!((done.status.code(), told), (Some(3), 1), "{}", String::from_utf8_lossy(&done.stderr));
}

/// Rows of F are kept by the rank that casts them, so that several have room for what one refuses.
#[test]
fn several_ranks_have_room_for_what_one_refuses() {
    if ranks(1).is_none() {
        return eprintln!("skipped: needs the feature mpi, and mpirun");
    }
    let directory = tempfile::tempdir().expect("a directory");
    let command = "bounces cornell-box --mode global --patches 6000 --rays 64 --size 8x8 --memory 0.006 --out OUT";
    let code = |count: u32| run(ranks(count), command, directory.path()).status.code();
    assert_eq!((code(1), code(4)), (Some(5), Some(0)));
}

/// A command whose ranks differ: what `sh` runs, of which `$1` is the program.
fn differing(script: &str) -> Option<Command> {
    let mut mpirun = ranks(2)?;
    mpirun.args(["sh", "-c", script, "sh", env!("CARGO_BIN_EXE_halflight")]);
    Some(mpirun)
}

#[test]
fn a_file_that_one_rank_cannot_read_ends_all() {
    let directory = tempfile::tempdir().expect("a directory");
    let script = |other: &str| {
        let rank = "if [ \"$OMPI_COMM_WORLD_RANK\" = 1 ]; then scene=OTHER; else scene=furnace; fi";
        let out = directory.path().to_string_lossy();
        format!("{rank}; exec \"$1\" render $scene --threads 1 --size 8x8 -o {out}/a.exr").replace("OTHER", other)
    };
    let cases = [("missing.obj", 3, "no scene named `missing.obj`"), ("cornell-box", 2, "has other arguments")];
    for (other, code, words) in cases {
        let Some(mut mpirun) = differing(&script(other)) else {
            return eprintln!("skipped: needs the feature mpi, and mpirun");
        };
        let done = mpirun.output().expect("it starts");
        let told = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!((done.status.code(), told.matches(words).count()), (Some(code), 1), "{other}: {told}");
        assert_eq!(fs::read_dir(directory.path()).expect("the directory").count(), 0, "{other}");
    }
}

/// A rank that is killed takes the others with it, and an interrupt ends all: no file is left that is not whole.
#[test]
fn a_lost_rank_and_an_interrupt_end_all() {
    for signal in ["kill -KILL $(cat OUT/pid)", "kill -INT $PPID"] {
        let directory = tempfile::tempdir().expect("a directory");
        let out = directory.path().to_string_lossy().into_owned();
        // Rank 1 shows its number to a sleeper, which lets the solve begin and then does what is said.
        let script = format!(
            "if [ \"$OMPI_COMM_WORLD_RANK\" = 1 ]; then echo $$ > OUT/pid; (sleep 1; {signal}) & fi; \
             exec \"$1\" trace cornell-box --threads 1 --size 64x64 --mode global --samples 100000 -o OUT/a.exr"
        );
        let Some(mut mpirun) = differing(&script.replace("OUT", &out)) else {
            return eprintln!("skipped: needs the feature mpi, and mpirun");
        };
        let done = mpirun.output().expect("it starts");
        let told = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(!done.status.success(), "{signal}: {told}");
        let left: Vec<_> =
            fs::read_dir(directory.path()).expect("the directory").map(|e| e.expect("an entry")).collect();
        assert!(left.iter().all(|entry| entry.file_name() == "pid"), "{signal}: {left:?}");
    }
}
